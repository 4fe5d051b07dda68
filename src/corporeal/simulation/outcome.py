"""What happened, as numbers: who touched whom and when, what bounced, what kept a dent where."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from math import degrees

import numpy as np
from jaxtyping import Float
from scipy.spatial import Delaunay

from corporeal.core.audit_data import FLOOR_NAME, ObjectOutcome, Outcome, PairOutcome, pair_name
from corporeal.core.types import MaterialField, Particles, Scene, Trajectory, Vector
from corporeal.geometry.rotation import fit_rigid_motion
from corporeal.simulation.residual_shape import (
    ResidualDent,
    box_diagonal,
    place_at_start,
    residual_dent,
    upper_percentile,
)
from corporeal.simulation.surface_mark import keeps_surface_mark, surface_mark

REST_DURATION_S = 0.3
"""A dent is what is left after so long at rest [s]."""
SEPARATION_DURATION_S = 0.1
"""Bodies have separated when they stay apart so long [s]."""
REACH_PARTICLE_FRACTION = 0.98
"""Share of the particles that tell how far something reaches [-]; lone drops do not."""
REST_FRAMES = 8
"""Frames that are averaged over the rest."""
TOUCHING_DISTANCE_DX = 0.5
"""Bodies no farther apart touch [cells]: the distance of two particles in one body. Surfaces are known no better. What
rests on something is within 0.45, what stands beside it from 1 on."""


def measure_outcome(scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory) -> Outcome:
    """Describe what was seen.

    Args:
        scene: What was simulated.
        particles: Its material points.
        field: What every part is made of: grains are marked, what holds together is dented.
        trajectory: How they moved, with the ledger.
    """
    names = [o.name for o in scene.objects]
    bodies = ObjectParticles(scene, particles, field, trajectory)
    pairs = pair_rows(names, particles.cell, trajectory)
    return Outcome(
        objects={name: object_row(b, names, bodies) for b, name in enumerate(names)},
        pairs=pairs,
        order=contact_order(pairs),
        cell_m=particles.cell,
        duration_s=float(trajectory.time[-1]),
    )


class ObjectParticles:
    """Particle positions of every object over time; one pass over the frames on disk."""

    def __init__(self, scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory) -> None:
        self.gravity = -scene.gravity[2]
        self.cell, self.time, self.ledger = particles.cell, trajectory.time, trajectory.ledger
        self.trajectory = trajectory
        count = len(trajectory.ledger.mass[0])
        first_of_contents = len(scene.objects) - len(particles.contents)
        self.vessel_of = {first_of_contents + k: c.vessel for k, c in enumerate(particles.contents)}
        """Object that lay in a vessel → that vessel."""
        self.members = [np.flatnonzero(particles.object == b) for b in range(count)]
        first = trajectory.frames[0].position.astype(float)
        self.start = [first[m] for m in self.members]
        self.size = [box_diagonal(start) for start in self.start]
        parting = np.array([keeps_surface_mark(m) for m in field.materials], dtype=bool)
        self.parting = [parting[particles.part[m]] for m in self.members]
        """Of each object's particles, which keep a mark at their surface."""
        self.error = np.zeros((len(self.time), count))
        self.squeeze = np.zeros(count)
        self.last: list[list[np.ndarray]] = [[] for _ in range(count)]
        sampled = set(self.resting_frames().tolist())
        for k in range(len(self.time)):
            self._take(k, k in sampled)

    def _take(self, k: int, keep: bool) -> None:
        position = self.trajectory.frames[k].position.astype(float)
        for b, mine in enumerate(self.members):
            now, start = position[mine], self.start[b]
            fit = fit_rigid_motion(start, now, np.ones(len(start)))
            shift = np.linalg.norm(fit.undo(now) - start, axis=1)
            if self.size[b] > 0.0:  # one particle has no shape
                self.error[k, b] = np.sqrt(np.mean(shift**2)) / self.size[b]
            self.squeeze[b] = max(self.squeeze[b], upper_percentile(shift))
            if keep:
                self.last[b].append(now)

    def resting_frames(self) -> np.ndarray:
        """Return the indices of up to ``REST_FRAMES`` frames in the last 0.3 s."""
        late = np.flatnonzero(self.time >= self.time[-1] - REST_DURATION_S - 1e-9)
        return np.unique(np.linspace(late[0], late[-1], REST_FRAMES).astype(int))

    def when(self, instant: float, body: int) -> Float[np.ndarray, "N 3"]:
        """One object's particles [m] at an instant of impact [s]: from the frame before, in flight.

        The frame after would already show its effect.
        """
        k = frame_before(self.time, instant)
        flight = instant - self.time[k]
        velocity = self.ledger.momentum[k, body] / self.ledger.mass[k, body]
        position = self.trajectory.frames[k].position[self.members[body]].astype(float)
        return position + flight * velocity


def object_row(body: int, names: list[str], bodies: ObjectParticles) -> ObjectOutcome:
    """Describe what happened to one object."""
    ledger, cell, start = bodies.ledger, bodies.cell, bodies.start[body]
    mark, rim = residual_mark(body, bodies)
    centre = ledger.centre[:, body]
    late = bodies.resting_frames()
    drift = float(np.linalg.norm(np.ptp(centre[late], axis=0)))
    moved = centre[-1] - centre[0]
    fit = fit_rigid_motion(start, bodies.last[body][-1], np.ones(len(start)))
    rms = ledger.rms_speed[late, body]
    bounced = rise_after_impact(bodies.trajectory, body, bodies.gravity, bodies.cell)
    return ObjectOutcome(
        at_rest=bool(rms.max() * REST_DURATION_S < cell),
        rms_speed_end=float(rms[-1]),
        shape_error_end=float(bodies.error[-1, body]),
        shape_error_max=float(bodies.error[:, body].max()),
        dent_depth_m=mark.depth,
        dent_depth_dx=mark.depth / cell,
        dent_place=None if mark.share == 0 else to_vector(mark.place),
        dent_share=mark.share,
        dent_from_contact_m=dent_distances(body, mark, names, bodies),
        rim_height_m=rim,
        deepest_squeeze_m=float(bodies.squeeze[body]),
        moved_m=to_vector(moved),
        moved_level_m=float(np.hypot(moved[0], moved[1])),
        turned_deg=degrees(fit.angle),
        rest_drift_m=drift,
        length_m=float(np.ptp(start, axis=0).max()),
        fall_m=bounced.fall,
        rebound_m=bounced.rebound,
        rebound_ratio=bounced.ratio,
        reach_m=level_reach(bodies.last[body][-1], cell),
        height_m=vertical_extent(bodies.last[body][-1], start, cell),
        left_vessel=left_vessel(body, bodies),
    )


def residual_mark(body: int, bodies: ObjectParticles) -> tuple[ResidualDent, float | None]:
    """Measure the residual mark and its rim [m]; None: the object keeps cohesion.

    An object of whose particles most are grains or paste is measured at their surface.
    """
    start, last, parting = bodies.start[body], bodies.last[body], bodies.parting[body]
    if 2 * np.count_nonzero(parting) <= len(start):
        return residual_dent(start, last, bodies.cell), None
    mark = surface_mark(start[parting], [x[parting] for x in last], bodies.cell, bodies.cell)
    return ResidualDent(mark.depth, mark.place, mark.share), mark.rim


def level_reach(points: Float[np.ndarray, "N 3"], cell: float) -> float:
    """Level distance from their middle within which most points lie [m]."""
    points = points[np.isfinite(points).all(axis=1)]
    aside = points[:, :2] - np.median(points[:, :2], axis=0)
    return float(np.quantile(np.hypot(*aside.T), REACH_PARTICLE_FRACTION)) + cell / 4


def vertical_extent(points: Float[np.ndarray, "N 3"], start: Float[np.ndarray, "N 3"], cell: float) -> float:
    """Extent of most material along z [m]: of the points, and half a row above and below them.

    A row is half a cell high at the start. What is squeezed flat has rows as much lower: a puddle that was a column
    would else be taken for half a cell higher than it is.

    Args:
        points: Now [m].
        start: At the start [m].
        cell: dx [m].
    """
    now, before = _along_z(points), _along_z(start)
    squeezed = min(1.0, now / before) if before > 0.0 else 1.0
    return now + 0.5 * cell * squeezed


def _along_z(points: Float[np.ndarray, "N 3"]) -> float:
    points = points[np.isfinite(points).all(axis=1)]
    low, high = np.quantile(points[:, 2], (1 - REACH_PARTICLE_FRACTION, REACH_PARTICLE_FRACTION))
    return float(high - low)


def left_vessel(body: int, bodies: "ObjectParticles") -> float | None:
    """Share of a vessel's contents that is outside of the vessel's convex hull at the end [-]."""
    vessel = bodies.vessel_of.get(body)
    if vessel is None:
        return None
    fit = fit_rigid_motion(bodies.start[vessel], bodies.last[vessel][-1], np.ones(len(bodies.start[vessel])))
    points = bodies.last[body][-1]
    there = np.isfinite(points).all(axis=1)
    inside = Delaunay(bodies.start[vessel]).find_simplex(fit.undo(points[there])) >= 0
    return 1.0 - float(inside.sum()) / len(points)


def to_vector(values: Float[np.ndarray, "3"]) -> Vector:
    """Return three numbers of an array as a tuple."""
    x, y, z = values.tolist()
    return x, y, z


def dent_distances(body: int, mark: ResidualDent, names: list[str], bodies: ObjectParticles) -> dict[str, float | None]:
    """Distance on the undeformed body from each first contact to the dent's centroid [m]."""
    found: dict[str, float | None] = {}
    for other, name in enumerate([*names, FLOOR_NAME]):
        instant = bodies.ledger.first_contact[-1, body, other]
        if other == body or not np.isfinite(instant):
            continue
        point = bodies.ledger.contact_point[-1, body, other]
        struck = place_at_start(point, bodies.when(instant, body), bodies.start[body])
        found[name] = None if mark.share == 0 else float(np.linalg.norm(mark.place - struck))
    return found


@dataclass(frozen=True)
class Bounce:
    """How far a body fell before its first contact, and how far it rose after it."""

    fall: float | None
    """[m]"""
    rebound: float | None
    """[m]"""
    ratio: float | None
    """Rebound over fall [-]."""


def rise_after_impact(trajectory: Trajectory, body: int, gravity: float, cell: float) -> Bounce:
    """Height of fall before the first contact, and of the rebound.

    The fall is the free fall from rest that ends at its speed, so that an object thrown down has
    fallen from far; the rebound is measured from where its centre of mass was. Both at that
    instant, found by free flight from the last frame before it. A fall of less than half a cell
    has no ratio.

    Args:
        trajectory: How everything moved, with the ledger.
        body: Which.
        gravity: Downward acceleration [m/s²].
        cell: dx [m].
    """
    ledger, time = trajectory.ledger, trajectory.time
    first = ledger.first_contact[-1, body]
    if np.isnan(first).all():
        return Bounce(None, None, None)
    touch = float(np.nanmin(first))
    k = frame_before(time, touch)
    height = ledger.centre[:, body, 2]
    speed = ledger.momentum[k, body, 2] / ledger.mass[k, body]
    flight = touch - time[k]
    met = height[k] + speed * flight - 0.5 * gravity * flight**2
    struck = min(0.0, speed - gravity * flight)
    rising = np.flatnonzero(np.diff(height[k + 1 :]) > 0)
    peak = height[k + 1 + rising[0] :].max() if len(rising) else met
    fall = float(0.5 * struck**2 / gravity) if gravity > 0.0 else 0.0
    rebound = max(0.0, float(peak - met))
    ratio = rebound / fall if fall > cell / 2 else None
    return Bounce(fall, rebound, ratio)


def frame_before(time: Float[np.ndarray, " F"], instant: float) -> int:
    """Return the number of the last frame before an instant [s]."""
    return max(0, int(np.searchsorted(time, instant)) - 1)


def pair_rows(names: list[str], cell: float, trajectory: Trajectory) -> dict[str, PairOutcome]:
    """Describe what happened between every two objects, and between each object and the floor."""
    ledger, time = trajectory.ledger, trajectory.time
    rows = {}
    for a, c in combinations(range(len(names) + 1), 2):
        instant = float(ledger.first_contact[-1, a, c])
        touched = bool(np.isfinite(instant))
        floor = c == len(names)
        gap = None if floor else ledger.gap[:, a, c]
        after = None if gap is None or not touched else gap[time > instant]
        impulse = np.linalg.norm(ledger.plane_impulse[-1, 0, a]) if floor else ledger.pair_impulse[-1, a, c]
        rows[pair_name(names[a], FLOOR_NAME if floor else names[c])] = PairOutcome(
            first_contact_s=instant if touched else None,
            contact_point=to_vector(ledger.contact_point[-1, a, c]) if touched else None,
            separated=None if after is None else stays_separated(after, time[time > instant], cell),
            gap_start_dx=None if gap is None else float(gap[0]) / cell,
            gap_end_m=None if gap is None else float(gap[-1]),
            gap_end_dx=None if gap is None else float(gap[-1]) / cell,
            largest_gap_after_m=float(after.max()) if after is not None and len(after) else None,
            impulse=float(impulse),
        )
    return rows


def stays_separated(gap: Float[np.ndarray, " F"], time: Float[np.ndarray, " F"], cell: float) -> bool:
    """Whether two bodies are more than a cell apart for at least 0.1 s."""
    apart = np.concatenate([[False], gap > cell, [False]]).astype(int)
    edges = np.flatnonzero(np.diff(apart)).reshape(-1, 2)
    return any(time[last - 1] - time[first] >= SEPARATION_DURATION_S - 1e-9 for first, last in edges)


def contact_order(pairs: Mapping[str, PairOutcome]) -> tuple[tuple[str, str], ...]:
    """Pairs of objects by the time they first touched, those that touched at the start left out."""
    met = [
        (row.first_contact_s, name)
        for name, row in pairs.items()
        if row.gap_start_dx is not None and row.first_contact_s is not None and row.gap_start_dx > TOUCHING_DISTANCE_DX
    ]
    split = [name.split("|") for _, name in sorted(met)]
    return tuple((first, second) for first, second in split)
