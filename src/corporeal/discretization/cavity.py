"""Cavities: volume inside a wall, and level of contents that fill a part of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.open_cavity import is_below_rim

VESSEL_SAMPLES_COUNT = 20_000
"""Points thrown into a vessel's box to measure how much goes in."""
MIN_OPEN_HOLLOW_RATIO = 0.5
"""A hollow that is open up to the rim is what a vessel fills if it is more than this share of the material [-]: less,
as over a can's lid or a candle's wax, is the empty end of what is full.
"""


@dataclass(frozen=True)
class Cavity:
    """What is behind one part's wall."""

    points: Float[np.ndarray, "N 3"]
    """Evenly in it [m]."""
    volume: float
    """[m³]"""

    def level(self, fill: float) -> float:
        """Height [m] below which the share ``fill`` of the room lies; inf: all of it."""
        if fill >= 1 or not len(self.points):
            return np.inf
        return float(np.quantile(self.points[:, 2], fill))


def is_vessel(member: MeasuredPart) -> bool:
    """Whether the cavity lies between the faces of the mesh instead of behind all of them.

    A bowl too wide to be distinguished from a body by what is blocked around its hollow is recognised by its volume.
    """
    apart = member.build is not MeshKind.BODY or member.volume == 0
    return apart or member.hollow > MIN_OPEN_HOLLOW_RATIO * member.volume


def measure_cavity(anatomy: MeasuredObject, member: MeasuredPart, thickness: float, rng: np.random.Generator) -> Cavity:
    """Measure the cavity inside a wall.

    Behind a closed outer surface it is all that lies deeper than the wall; a vessel's reaches up to its rim.

    Args:
        anatomy: The object.
        member: The part with the wall.
        thickness: Of the wall [m].
        rng: Source of the probes.
    """
    if is_vessel(member):
        box = np.prod(np.ptp(part_corners(member), axis=0))
        points = keep_below_rim(anatomy, member, random_box_points(member, VESSEL_SAMPLES_COUNT, rng))
        return Cavity(points, float(box) * len(points) / VESSEL_SAMPLES_COUNT)
    probes = anatomy.probes[anatomy.part_of_probe == member.part]
    deep = member.shape.closest(probes)[0] > thickness
    wall = min(member.face_area * thickness, member.volume)
    return Cavity(probes[deep] if deep.any() else probes, member.volume - wall)


def vessel_points(
    anatomy: MeasuredObject, member: MeasuredPart, spacing: float, rng: np.random.Generator
) -> Float[np.ndarray, "N 3"]:
    """Fill a vessel up to its rim: one point per spacing³ [m]."""
    box = float(np.prod(np.ptp(part_corners(member), axis=0)))
    count = int(np.clip(box / spacing**3, 1, 5_000_000))
    return keep_below_rim(anatomy, member, random_box_points(member, count, rng))


def part_corners(member: MeasuredPart) -> Float[np.ndarray, "N 3"]:
    """Every corner of a part [m]."""
    return np.concatenate([m.corners.reshape(-1, 3) for m in (member.body, member.sheet)])


def random_box_points(member: MeasuredPart, count: int, rng: np.random.Generator) -> Float[np.ndarray, "count 3"]:
    """Points at random in a part's upright box [m]."""
    corners = part_corners(member)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return low + rng.uniform(0, 1, (count, 3)) * (high - low)


def keep_below_rim(
    anatomy: MeasuredObject, member: MeasuredPart, points: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, "N 3"]:
    """Keep the points that a level liquid could reach without running over the rim.

    Those outside the material with the part's faces below and, but for one crack, all around.
    """
    return points[is_reachable_by_liquid(anatomy, member, points)]


def is_reachable_by_liquid(
    anatomy: MeasuredObject, member: MeasuredPart, points: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " N"]:
    """Whether a level liquid in a vessel could reach each point without running over the rim."""
    return is_below_rim(anatomy.shape, (member.body, member.sheet), points)
