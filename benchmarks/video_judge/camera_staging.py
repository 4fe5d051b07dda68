"""Instants and cameras of a scene's videos, chosen from the reference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Ledger, Vector
from corporeal.pipeline.stages.video import motion_summary
from corporeal.pipeline.viewer_data import bind_scene
from corporeal.render.camera_placement import CameraAim, fit_camera
from corporeal.render.camera_track import FirstContact, MotionBounds
from corporeal.simulation.simulation_result import SimulationResult

DATED_PICTURES = 12
"""Pictures of the whole scene."""
CLOSE_UP_PICTURES = 3
"""Pictures from close by."""
PICTURE_SIZE_PX = (400, 300)
"""Of every picture [px]."""
LOOK_TURNS_DEG = (0.0, -25.0, 25.0)
"""Turn of the camera about the vertical in each look [degrees]."""
REFERENCE_FILL_FRACTION = 0.80
"""Share of a picture that the reference's motion takes."""
CONTACT_FILL_FRACTION = 0.45
"""Share of a close-up of a contact that the smaller object takes, so that the other is seen too."""
NO_CONTACT_FILL_FRACTION = 0.95
"""The same where nothing touches: nearer than the dated pictures, with nothing else to be seen."""
CLOSE_UP_DELAY_S = 0.03
"""A close-up shows a contact so long after it began [s]."""


@dataclass(frozen=True)
class CloseUpShot:
    """One picture from close by."""

    time: float
    """[s]"""
    contact: FirstContact | None
    """What it is about; None: nothing touches, so it is about what moves most."""


@dataclass(frozen=True)
class Staging:
    """Instants and cameras of one scene."""

    reel: MotionBounds
    times: Float[np.ndarray, " DATED"]
    """Of the dated pictures [s]."""
    closes: tuple[CloseUpShot, ...]
    end: float
    """Of the video [s]."""

    @cached_property
    def view(self) -> Vector:
        """Direction from the scene to the camera of the first look."""
        aim = fit_camera(self.reel.boxes, PICTURE_SIZE_PX, None, REFERENCE_FILL_FRACTION)
        x, y, z = np.subtract(aim.eye, aim.target).tolist()
        return x, y, z

    def wide(self, look: int) -> CameraAim:
        """Return the camera of the dated pictures."""
        return fit_camera(
            self.reel.boxes,
            PICTURE_SIZE_PX,
            turn_about_vertical(self.view, LOOK_TURNS_DEG[look]),
            REFERENCE_FILL_FRACTION,
        )

    def near(self, close: CloseUpShot, look: int) -> CameraAim:
        """Return the camera of a close-up: the smaller of two that touch, or what moves most.

        Sizes and places are those of the reference at the close-up's time.
        """
        now = self.reel.boxes[int(np.abs(self.reel.time - close.time).argmin())]
        extent = np.linalg.norm(now[:, 1] - now[:, 0], axis=1)
        if close.contact is not None:
            chosen = min(close.contact.objects, key=lambda b: np.nan_to_num(extent[b], nan=np.inf))
        else:
            way = np.nan_to_num(np.abs(self.reel.boxes - self.reel.boxes[:1])).max(axis=(0, 2, 3))
            chosen = int(way.argmax())
        box = now[chosen] if np.isfinite(now[chosen]).all() else self.reel.boxes[0, chosen]
        fill = NO_CONTACT_FILL_FRACTION if close.contact is None else CONTACT_FILL_FRACTION
        return fit_camera(box[None, None], PICTURE_SIZE_PX, turn_about_vertical(self.view, LOOK_TURNS_DEG[look]), fill)


def stage_scene(reference: SimulationResult) -> Staging:
    """Choose instants and cameras."""
    p, trajectory = reference.prepared, reference.trajectory
    skin = bind_scene(p).skin
    reel = motion_summary(skin, p.scene, p.particles, trajectory)
    end = float(trajectory.time[-1])
    found = first_contacts(trajectory.ledger, len(p.scene.objects))
    return Staging(reel, picture_times(reference), close_up_shots(found, end), end)


def turn_about_vertical(view: Vector, degrees: float) -> Vector:
    """Turn a direction about the vertical."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return float(c * view[0] - s * view[1]), float(s * view[0] + c * view[1]), view[2]


def picture_times(reference: SimulationResult) -> Float[np.ndarray, " DATED"]:
    """Choose when to look [s]: half by the clock, half where most moves.

    Motion is summed over objects as a share of their own size, so that small ones count.
    """
    trajectory, owner = reference.trajectory, reference.prepared.particles.object
    members = [np.flatnonzero(owner == k) for k in range(int(owner.max()) + 1)]
    before = trajectory.frames[0].position.astype(float)
    size = [max(float(np.linalg.norm(np.ptp(before[m], axis=0))), 1e-9) for m in members]
    moved = [0.0]
    for k in range(1, len(trajectory.time)):
        now = trajectory.frames[k].position.astype(float)
        way = ((now - before) ** 2).sum(axis=1)
        moved.append(sum(np.sqrt(way[m].mean()) / s for m, s in zip(members, size, strict=True)))
        before = now
    total = np.cumsum(moved)
    clock = 0.5 * np.linspace(0, 1, len(total)) + 0.5 * total / max(float(total[-1]), 1e-9)
    wanted = np.linspace(0, clock[-1], DATED_PICTURES)
    chosen = [int(np.abs(clock - c).argmin()) for c in wanted]
    return np.asarray(trajectory.time, dtype=float)[chosen]


def first_contacts(ledger: Ledger, objects: int) -> list[FirstContact]:
    """Return first contacts after the start by time: first those of two objects, then of planes."""
    when = np.array(ledger.first_contact[-1], dtype=float)
    when[~(when > float(ledger.time[0]))] = np.inf
    pairs = [
        FirstContact(float(when[i, j]), (i, j))
        for i in range(objects)
        for j in range(i + 1, objects)
        if np.isfinite(when[i, j])
    ]
    planes = [
        FirstContact(float(when[i, objects:].min()), (i,))
        for i in range(objects)
        if when.shape[1] > objects and np.isfinite(when[i, objects:].min())
    ]
    return [*sorted(pairs, key=lambda c: c.time), *sorted(planes, key=lambda c: c.time)]


def close_up_shots(found: list[FirstContact], end: float) -> tuple[CloseUpShot, ...]:
    """Look at the first two contacts just after they began, and at the end at what is left."""
    if not found:
        return tuple(CloseUpShot(end * (k + 1) / CLOSE_UP_PICTURES, None) for k in range(CLOSE_UP_PICTURES))
    first, second = found[0], found[min(1, len(found) - 1)]
    begun = min(first.time + CLOSE_UP_DELAY_S, end)
    then = min(second.time + (CLOSE_UP_DELAY_S if len(found) > 1 else 4 * CLOSE_UP_DELAY_S), end)
    return CloseUpShot(begun, first), CloseUpShot(then, second), CloseUpShot(end, first)
