"""Rods: parts that are long and thin everywhere, straight or bent, with their centreline.

A part is a rod when slices across its longest direction are single round patches of nearly one size. Branches, loops,
hairpins, flat strips and strong taper are not found here.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import MeasuredPart
from corporeal.geometry.point_sampling import scatter_points

MIN_ROD_SLENDERNESS = 8.0
"""Least length over diameter of a rod."""
ROD_SLICES_COUNT = 40
ROD_PROBES_COUNT = 8000
MAX_SECTION_SPREAD_RATIO = 1.25
"""Largest ratio of a slice's diameter by its spread to that by its area: 1 for a disc, 1.14 for a strip twice as wide
as thick."""
MAX_DIAMETER_DEVIATION_FRACTION = 0.3
"""Largest deviation of a slice's diameter from the mean, over the mean."""
SECTION_RING_RADIUS_RATIO = 0.354
"""Radius of the ring of six points that stands for a section, over its simulated diameter: the second moment of area is
then that of the disc."""


@dataclass(frozen=True)
class Rod:
    """A centreline of M points."""

    points: Float[np.ndarray, "M 3"]
    """[m]"""
    diameter: float
    """[m]"""


def find_rod(member: MeasuredPart, rng: np.random.Generator) -> Rod | None:
    """Return the centreline of a part that is a rod; None where it is none."""
    solid = member.build is MeshKind.BODY and member.closed and member.volume > 0
    if not solid or member.size[2] < MIN_ROD_SLENDERNESS * 4 * member.volume / member.body_area:
        return None
    spacing = (member.volume / ROD_PROBES_COUNT) ** (1 / 3)
    probes = scatter_points(member.shape, spacing, rng)
    if len(probes) < ROD_PROBES_COUNT / 4:
        return None
    middle = probes.mean(axis=0)
    axis = np.linalg.svd(probes - middle, full_matrices=False)[2][0]
    along = (probes - middle) @ axis
    low, high = float(along.min()), float(along.max())
    slice_of = np.minimum(((along - low) / (high - low) * ROD_SLICES_COUNT).astype(np.int64), ROD_SLICES_COUNT - 1)
    count = np.bincount(slice_of, minlength=ROD_SLICES_COUNT)
    if count.min() < 8:
        return None
    centre = np.stack([np.bincount(slice_of, x) / count for x in probes.T], axis=1)
    ends = [2 * centre[0] - centre[1], 2 * centre[-1] - centre[-2]]
    slope = np.gradient(centre, axis=0)
    tilt = slope @ axis / np.linalg.norm(slope, axis=1)
    area = count * spacing**3 / ((high - low) / ROD_SLICES_COUNT) * tilt
    across = probes - centre[slice_of]
    tangent = slope / np.linalg.norm(slope, axis=1)[:, None]
    across = across - np.sum(across * tangent[slice_of], axis=1)[:, None] * tangent[slice_of]
    spread = np.bincount(slice_of, np.sum(across**2, axis=1)) / count
    by_area, by_spread = 2 * np.sqrt(area / np.pi), 2 * np.sqrt(2 * spread)
    inner = slice(1, ROD_SLICES_COUNT - 1)
    diameter = float(by_area[inner].mean())
    uneven = np.abs(by_area[inner] / diameter - 1).max() > MAX_DIAMETER_DEVIATION_FRACTION
    if uneven or (by_spread[inner] / by_area[inner]).max() > MAX_SECTION_SPREAD_RATIO:
        return None
    line = np.concatenate([[0.5 * (ends[0] + centre[0])], centre, [0.5 * (ends[1] + centre[-1])]])
    return Rod(line, diameter)


def rod_section_points(rod: Rod, simulated: float, step: float) -> Float[np.ndarray, "N 3"]:
    """Points that stand for a rod: six on a ring every ``step`` [m] along.

    Args:
        rod: The centreline.
        simulated: Diameter on the grid [m].
        step: [m]
    """
    lengths = np.linalg.norm(np.diff(rod.points, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(2, round(arc[-1] / step))
    at = (np.arange(count) + 0.5) * arc[-1] / count
    centre = np.stack([np.interp(at, arc, x) for x in rod.points.T], axis=1)
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    first = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent).sum(axis=0))])
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(tangent, first)
    # Every second ring is turned by half a gap, so that no row of points lies along the grid.
    angle = np.pi / 3 * np.arange(6)[:, None] + np.pi / 6 * (np.arange(count) % 2)
    out = np.cos(angle)[..., None] * first + np.sin(angle)[..., None] * second
    return (centre + SECTION_RING_RADIUS_RATIO * simulated * out).reshape(-1, 3)
