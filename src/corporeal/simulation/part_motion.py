"""Deformation, displacement and separation of the parts of every object, measured in the frames of a run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from corporeal.core.types import MaterialField, Particles, Scene, Trajectory
from corporeal.geometry.rotation import RigidFit, fit_rigid_motion
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.simulation.residual_shape import trusted_fit, upper_percentile

MAX_FRAMES = 240
"""Frames that are looked at; of a longer run, evenly chosen ones."""
MAX_PARTICLES = 4000
"""Particles of an object that are looked at."""
LINKED_NEIGHBOURS = 8
"""Neighbours at rest that a particle is linked to."""
SEPARATION_CHECKS = 12
"""Frames in which separation is measured, beside the last."""
PIECE_GAP_RATIO = 3.0
"""Particles farther apart than so many times the usual distance of neighbours are of different pieces [-]."""
LINK_STRETCH_RATIO = 2.0
"""A link is broken beyond so many times its length at rest, …"""
LINK_REACH_DX, LINK_REACH_RATIO = 2.0, 0.03
"""… and so much more [cells], and of the object's longest side [-]."""


@dataclass(frozen=True)
class PartMotion:
    """How one part moved beside the rigid motion of its object."""

    size: tuple[float, float, float]
    """Sides of the box of its largest piece at rest, shortest first [m]."""
    height: float
    """Vertical side of that box [m]."""
    deformation: float
    """Displacement that a hundredth of its particles exceed once its own rigid motion is removed, at any time [m]."""
    shift: float
    """The same once the motion of the rest of its object is removed: of its rigid parts, or of most of it [m]."""
    separated: float
    """Largest share of it that was not connected with most of its object any more [-]."""


@dataclass(frozen=True)
class ObjectMotion:
    """How one object moved."""

    number: int
    """In the scene."""
    length: float
    """Longest side of its box at rest [m]."""
    middle_side: float
    """Middle side of that box [m]."""
    soft_width: float
    """Shortest side of the box of what deforms of it, at rest [m]; 0: nothing does."""
    parts: dict[int, PartMotion]
    """Of what holds together: no liquids, no grains."""
    below_floor: float
    """Depth of its lowest point below the floor at the end, if it had its shape at rest [m]."""
    lowest_part: int | None
    """Which part is there."""


def measure_motion(
    scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory
) -> tuple[ObjectMotion, ...]:
    """Measure every object that holds together, in the scene's order.

    Args:
        scene: Its surfaces are those at rest.
        particles: The material points at rest.
        field: What every part is made of.
        trajectory: How they moved.
    """
    loose = np.array([CONSTITUTIVE_LAWS[m.law].loose for m in field.materials], dtype=bool)
    whole = np.flatnonzero(~loose[particles.part])
    bodies = [
        _Body(scene, particles, field, number, members)
        for number in range(len(scene.objects))
        if len(members := whole[particles.object[whole] == number])
    ]
    count = len(trajectory.time)
    looked = np.unique(np.linspace(0, count - 1, min(count, MAX_FRAMES)).astype(int))
    checked = set(looked[np.linspace(0, len(looked) - 1, SEPARATION_CHECKS + 1).astype(int)].tolist())
    for k in looked.tolist():
        position = trajectory.frames[k].position.astype(float)
        for body in bodies:
            body.take(position, separation=k in checked)
    return tuple(body.motion() for body in bodies)


class _Body:
    """One object's particles at rest, and what was measured of them so far."""

    def __init__(
        self, scene: Scene, particles: Particles, field: MaterialField, number: int, members: Int[np.ndarray, " N"]
    ) -> None:
        rng = np.random.default_rng([number, 11])
        self.number = number
        if len(members) > MAX_PARTICLES:
            members = np.sort(rng.choice(members, MAX_PARTICLES, replace=False))
        self.members, self.part = members, particles.part[members]
        self.rest = particles.position[members].astype(float)
        self.now = self.rest
        self.numbers = np.unique(self.part).tolist()
        kinds = [particles.treatments[k].kind for k in range(len(particles.treatments))]
        self.stiff = np.array([kinds[k] == "rigid" for k in self.part], dtype=bool)
        self.length = float(np.ptp(self.rest, axis=0).max())
        self.links = rest_links(self.rest)
        self.reach = LINK_REACH_DX * particles.cell + LINK_REACH_RATIO * self.length
        shown = [s for s in scene.surfaces if s.object == number and len(s.triangles)]
        vertices = [s.vertices[np.unique(s.triangles)] for s in shown]
        self.surface = np.concatenate(vertices) if shown else self.rest
        self.piece = [s.name for s, v in zip(shown, vertices, strict=True) for _ in range(len(v))]
        self.name_of_part = {k: field.words[k].name for k in self.numbers}
        self.deformation = dict.fromkeys(self.numbers, 0.0)
        self.shift = dict.fromkeys(self.numbers, 0.0)
        self.separated = dict.fromkeys(self.numbers, 0.0)

    def take(self, position: Float[np.ndarray, "P 3"], separation: bool) -> None:
        """Look at one frame."""
        now = position[self.members]
        if not np.isfinite(now).all():
            return
        self.now = now
        if self.stiff.all():
            return
        around = self._reference(now).undo(now) - self.rest
        for k in self.numbers:
            mine = self.part == k
            own = fit_rigid_motion(self.rest[mine], now[mine], np.ones(int(mine.sum())))
            change = np.linalg.norm(own.undo(now[mine]) - self.rest[mine], axis=1)
            self.deformation[k] = max(self.deformation[k], upper_percentile(change))
            self.shift[k] = max(self.shift[k], upper_percentile(np.linalg.norm(around[mine], axis=1)))
        if separation:
            apart = separated_particles(self.rest, now, self.links, self.reach)
            for k in self.numbers:
                self.separated[k] = max(self.separated[k], float(apart[self.part == k].mean()))

    def _reference(self, now: Float[np.ndarray, "N 3"]) -> RigidFit:
        if np.count_nonzero(self.stiff) > LINKED_NEIGHBOURS:
            return fit_rigid_motion(self.rest, now, self.stiff.astype(float))
        return trusted_fit(self.rest, now)

    def motion(self) -> ObjectMotion:
        """Return what was measured."""
        below, lowest = self._depth_below_floor()
        soft = self.rest[~self.stiff]
        width = float(np.ptp(soft, axis=0).min()) if len(soft) else 0.0
        parts = {k: self._part_motion(k) for k in self.numbers}
        middle = float(np.sort(np.ptp(self.rest, axis=0))[1])
        return ObjectMotion(self.number, self.length, middle, width, parts, below, lowest)

    def _part_motion(self, k: int) -> PartMotion:
        sides = largest_piece_sides(self.rest[self.part == k])
        short, middle, long = sorted(sides.tolist())
        return PartMotion((short, middle, long), float(sides[2]), self.deformation[k], self.shift[k], self.separated[k])

    def _depth_below_floor(self) -> tuple[float, int]:
        fit = self._reference(self.now)
        surface, points = ((x - fit.centre) @ fit.rotation.T + fit.moved for x in (self.surface, self.rest))
        lowest = int(np.argmin(surface[:, 2]))
        there = self.piece[lowest] if self.piece else ""
        named = [k for k, name in self.name_of_part.items() if name == there]
        return max(0.0, -float(surface[lowest, 2])), (named or [int(self.part[np.argmin(points[:, 2])])])[0]


# ------------------------------------------------------------------ pieces


def largest_piece_sides(rest: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " 3"]:
    """Sides of the box of the largest of the pieces that a part is made of [m]: of one castor, not of four."""
    if len(rest) < 2:
        return np.zeros(3)
    distance, near = _nearest(rest, rest, min(LINKED_NEIGHBOURS + 1, len(rest)))
    close = distance[:, 1:] <= PIECE_GAP_RATIO * np.median(distance[:, 1])
    first = np.repeat(np.arange(len(rest)), close.shape[1])
    piece = _pieces(np.stack([first, near[:, 1:].ravel()], axis=1)[close.ravel()], len(rest))
    return np.ptp(rest[piece == np.argmax(np.bincount(piece))], axis=0)


def rest_links(rest: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, "L 2"]:
    """Pairs of neighbouring particles at rest; every piece is linked with the largest one."""
    if len(rest) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    near = _nearest(rest, rest, min(LINKED_NEIGHBOURS + 1, len(rest)))[1][:, 1:]
    first = np.repeat(np.arange(len(rest)), near.shape[1])
    links = np.stack([first, near.ravel()], axis=1)
    piece = _pieces(links, len(rest))
    largest = np.flatnonzero(piece == np.argmax(np.bincount(piece)))
    distance, nearest = (x[:, 0] for x in _nearest(rest[largest], rest, 1))
    bridges: list[Sequence[int]] = []
    for number in np.unique(piece).tolist():
        mine = np.flatnonzero(piece == number)
        if mine[0] not in largest:
            closest = mine[np.argmin(distance[mine])]
            bridges.append((int(closest), int(largest[nearest[closest]])))
    return np.concatenate([links, np.array(bridges, dtype=np.int64).reshape(-1, 2)])


def separated_particles(
    rest: Float[np.ndarray, "N 3"], now: Float[np.ndarray, "N 3"], links: Int[np.ndarray, "L 2"], reach: float
) -> Bool[np.ndarray, " N"]:
    """Return which particles are not connected with the largest piece any more.

    Args:
        rest: Where they were at rest [m].
        now: Where they are [m].
        links: From ``rest_links``.
        reach: How much farther than ``LINK_STRETCH_RATIO`` times its length a link holds [m].
    """
    if len(rest) < 2:
        return np.zeros(len(rest), dtype=bool)
    before, after = (np.linalg.norm(x[links[:, 0]] - x[links[:, 1]], axis=1) for x in (rest, now))
    piece = _pieces(links[after <= LINK_STRETCH_RATIO * before + reach], len(rest))
    return piece != np.argmax(np.bincount(piece))


def _nearest(
    points: Float[np.ndarray, "N 3"], asked: Float[np.ndarray, "M 3"], count: int
) -> tuple[Float[np.ndarray, "M K"], Int[np.ndarray, "M K"]]:
    """Distances [m] and numbers of the nearest points, the nearest first."""
    distance, number = KDTree(points).query(asked, k=count)
    return np.asarray(distance).reshape(len(asked), -1), np.asarray(number).reshape(len(asked), -1)


def _pieces(links: Int[np.ndarray, "L 2"], count: int) -> Int[np.ndarray, " N"]:
    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])
