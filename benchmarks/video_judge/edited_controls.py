"""Videos with one known fault, made from the reference: six by changing its motion.

Frozen, reversed and slow change time; ghost, gain and glide change the motion of one object. The other four are
simulated: see ``simulated_controls``.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Frame
from corporeal.render.camera_track import FirstContact, first_contact
from corporeal.simulation.simulation_result import SimulationResult
from video_judge.video_motion import VideoMotion, nearest_frame, object_diagonals

SLOW_MOTION_RATIO = 4.0
"""How many times slower the control "slow" runs."""
GAINED_DISTANCE_RATIO = 2.5
"""How many times as far an object goes after its impact in the control "gain"."""
GLIDE_DIAGONALS = 0.5
"""How far a resting object creeps in the control "glide", over its diagonal [-]."""
MIN_REST_S = 0.3
"""What has been at rest for less need not stay so [s]."""
REST_DRIFT_RATIO = 0.02
"""What moves by less than this share of its diagonal in ``MIN_REST_S`` is at rest [-]."""

EDITED_CONTROLS = ("frozen", "reversed", "slow", "ghost", "gain", "glide")


def edit_motion(control: str, reference: SimulationResult) -> VideoMotion | None:
    """Make a control by changing the reference's motion; None: the scene has no place for it.

    Args:
        control: One of ``EDITED_CONTROLS``.
        reference: Our own run.

    """
    made = CONTROL_MAKERS[control](reference)
    return None if made is None else VideoMotion(reference.prepared, made)


def freeze_motion(reference: SimulationResult) -> Callable[[float], Frame]:
    """Let nothing move."""
    return lambda time: nearest_frame(reference.trajectory, 0.0)


def reverse_motion(reference: SimulationResult) -> Callable[[float], Frame]:
    """Run time backwards."""
    end = float(reference.trajectory.time[-1])
    return lambda time: nearest_frame(reference.trajectory, end - time)


def slow_motion(reference: SimulationResult) -> Callable[[float], Frame]:
    """Run time slower than the dates say."""
    return lambda time: nearest_frame(reference.trajectory, time / SLOW_MOTION_RATIO)


def ghost_motion(reference: SimulationResult) -> Callable[[float], Frame] | None:
    """Let the faster of the first two to meet fly on, through the other; None: nothing meets."""
    contact = _contact(reference)
    if contact is None:
        return None
    ledger, k = reference.trajectory.ledger, _frame_before(reference, contact)
    velocity = ledger.momentum[k] / np.maximum(ledger.mass[k], 1e-12)[:, None]
    striker = max(contact.objects, key=lambda b: float(np.linalg.norm(velocity[b])))
    mine = reference.prepared.particles.object == striker
    last, gravity = reference.trajectory.frames[k], np.array(reference.prepared.scene.gravity)
    on_floor = len(contact.objects) > 1

    def at(time: float) -> Frame:
        frame = nearest_frame(reference.trajectory, time)
        flown = time - last.time
        if flown <= 0:
            return frame
        way = velocity[striker] * flown + 0.5 * gravity * flown**2
        x = last.position[mine].astype(float) + way
        pose = last.deformation[mine]
        return _with(frame, mine, _above_floor(x) if on_floor else x, pose)

    return at


def gain_motion(reference: SimulationResult) -> Callable[[float], Frame] | None:
    """Let an object go farther after its impact than it did; None: nothing meets."""
    contact = _contact(reference)
    if contact is None:
        return None
    k, centre = _frame_before(reference, contact), reference.trajectory.ledger.centre
    went = np.linalg.norm(centre[k:] - centre[k], axis=-1).max(axis=0)
    chosen = max(contact.objects, key=lambda b: float(went[b]))
    mine, start = reference.prepared.particles.object == chosen, centre[k, chosen]
    after = float(reference.trajectory.time[k])

    def at(time: float) -> Frame:
        frame = nearest_frame(reference.trajectory, time)
        if frame.time <= after:
            return frame
        x = frame.position[mine].astype(float)
        x = x + (GAINED_DISTANCE_RATIO - 1) * (x.mean(axis=0) - start)
        return _with(frame, mine, _above_floor(x), frame.deformation[mine])

    return at


def glide_motion(reference: SimulationResult) -> Callable[[float], Frame] | None:
    """Let the object that rests longest creep away from the others; None: nothing rests."""
    since = rest_since(reference)
    end = float(reference.trajectory.time[-1])
    if not len(since) or float(since.min()) > end - MIN_REST_S:
        return None
    chosen = int(since.argmin())
    mine, begin = reference.prepared.particles.object == chosen, float(since[chosen])
    way = _away(reference, chosen) * GLIDE_DIAGONALS * object_diagonals(reference.prepared)[chosen]

    def at(time: float) -> Frame:
        frame = nearest_frame(reference.trajectory, time)
        share = max(0.0, frame.time - begin) / max(end - begin, 1e-12)
        x = frame.position[mine].astype(float) + share * way
        return _with(frame, mine, x, frame.deformation[mine])

    return at


CONTROL_MAKERS: dict[str, Callable[[SimulationResult], Callable[[float], Frame] | None]] = {
    "frozen": freeze_motion,
    "reversed": reverse_motion,
    "slow": slow_motion,
    "ghost": ghost_motion,
    "gain": gain_motion,
    "glide": glide_motion,
}


def rest_since(reference: SimulationResult) -> Float[np.ndarray, " B"]:
    """Since when the centre of every object stays where it is at the end [s].

    Only of objects that touch the floor then; infinite for the others.
    """
    ledger, time = reference.trajectory.ledger, reference.trajectory.time
    bodies = len(reference.prepared.scene.objects)
    near = REST_DRIFT_RATIO * object_diagonals(reference.prepared)
    moved = np.linalg.norm(ledger.centre - ledger.centre[-1], axis=-1) > near
    last = [int(np.flatnonzero(moved[:, b])[-1]) + 1 if moved[:, b].any() else 0
            for b in range(bodies)]  # fmt: skip
    met = ledger.last_contact[-1][:bodies, bodies:]
    held = np.isfinite(met).any(axis=1) if met.size else np.zeros(bodies, bool)
    return np.where(held, time[np.minimum(last, len(time) - 1)], np.inf)


def _contact(reference: SimulationResult) -> FirstContact | None:
    return first_contact(reference.trajectory.ledger, len(reference.prepared.scene.objects))


def _frame_before(reference: SimulationResult, contact: FirstContact) -> int:
    return max(0, int(np.searchsorted(reference.trajectory.time, contact.time)) - 1)


def _away(reference: SimulationResult, chosen: int) -> Float[np.ndarray, "3"]:
    """Horizontal unit vector from the other objects to one; along x where there are none."""
    centre = reference.trajectory.ledger.centre[-1]
    others = np.delete(centre, chosen, axis=0)
    way = centre[chosen] - others.mean(axis=0) if len(others) else np.array([1.0, 0.0, 0.0])
    way[2] = 0.0
    length = float(np.linalg.norm(way))
    return way / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])


def _above_floor(x: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    return x + np.array([0.0, 0.0, max(0.0, -float(x[:, 2].min()))])


def _with(frame: Frame, mine: np.ndarray, x: np.ndarray, deformation: np.ndarray) -> Frame:
    """Put one object elsewhere in a frame."""
    position, motion = frame.position.copy(), frame.deformation.copy()
    position[mine], motion[mine] = x, deformation
    return replace(frame, position=position, deformation=motion)
