"""Foreground Gaussians: without floor, background and haze."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float16, Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Gaussians
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.rasteriser_numba import gaussian_contributions, gaussian_weights

CELL_WITH_MASKS_PX, CELL_WITHOUT_MASKS_PX = 4, 16
"""Pixels along a cell in which contributions are summed, with masks and without."""
MIN_VISIBLE_CONTRIBUTION = 0.1
"""Least contribution to a picture, in pixels, for a view to count as having seen it. Where there are more Gaussians
than pixels, this share of what those that show contribute in the mean."""
MIN_INSIDE_MASKS_FRACTION = 0.5
"""Share of what shows of a Gaussian that must be inside masks."""
FAINT_OPACITY = 0.05
"""Opacity below which it is haze."""
FLOOR_LAYER_RADII = 0.01
"""Height of the layer that is the floor, in radii of what the cameras look at."""
MAX_OBJECT_RADII = 1.1
"""Radius of what may be an object, in those."""
MIN_VIEWS_FRACTION = 0.2
"""Share of the views that must see it, where there are no masks."""
HAZE_WIDTH_RADII = 0.5
"""Standard deviation of haze, in those radii."""
COVERED_PIXEL_FRACTION = 0.5
"""Share of a pixel from which on it is an object's."""
MIN_SUNK_DEPTH_FRACTION = 0.01
"""Below the floor, in the longest side of the objects: less may be error of the floor."""
MIN_CONTRIBUTION_PX = 1e-12
"""Contribution that can be divided by [px]."""
FAINT_REACH_SIGMAS = 2.0
"""Standard deviations to which a faint Gaussian reaches."""
NEAR_NEIGHBOUR_DISTANCES = 3.0
"""Distances between neighbours within which a Gaussian, or a place, goes with an object."""


@dataclass(frozen=True)
class GaussianVisibility:
    """What the pictures show of each of N Gaussians."""

    weight: Float[np.ndarray, " N"]
    """Sum of its blending weights T α over all pictures [px]."""
    inside: Float[np.ndarray, " N"] | None
    """The part of that inside masks [px]; None: there are none."""
    views: Int[np.ndarray, " N"]
    """In how many pictures it shows."""
    share: Float16[np.ndarray, "V N"]
    """Of what each picture would show of it if nothing hid it."""
    least: float
    """What it must contribute to a picture for that to count, in the mean [px]."""


def gaussian_visibility(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    masks: Bool[np.ndarray, "V H W"] | None = None,
    threads: int | None = None,
) -> GaussianVisibility:
    """Describe what cameras see of each Gaussian.

    Raises:
        UserError: There is not a mask for each camera.
    """
    if masks is not None and len(masks) != len(cameras):
        raise UserError(f"There are {len(masks)} masks for {len(cameras)} cameras. Give one each.")
    total, inside = np.zeros(gaussians.count), np.zeros(gaussians.count)
    views, least = np.zeros(gaussians.count, np.int64), []
    share = np.zeros((len(cameras), gaussians.count), np.float16)
    cell = CELL_WITHOUT_MASKS_PX if masks is None else CELL_WITH_MASKS_PX
    for k, camera in enumerate(cameras):
        shares, unhidden = gaussian_contributions(gaussians, camera, cell, threads)
        own = np.asarray(shares.sum(axis=1)).ravel()
        least.append(MIN_VISIBLE_CONTRIBUTION * min(1.0, own.sum() / max(np.count_nonzero(own), 1)))
        total += own
        views += own > least[-1]
        share[k] = np.minimum(own / np.maximum(unhidden, MIN_CONTRIBUTION_PX), 1)
        if masks is not None:
            inside += shares @ _inside_fraction(masks[k]).ravel()
    within = None if masks is None else inside
    return GaussianVisibility(total, within, views, share, float(np.mean(least)))


def foreground_gaussians(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    seen: GaussianVisibility,
    floor: bool = True,
    layer_radii: float = FLOOR_LAYER_RADII,
) -> Bool[np.ndarray, " N"]:
    """Return which Gaussians belong to the objects.

    With masks: those that show mostly inside them. Without: those that are above the floor, within the ball that the
    cameras look at, in a fair share of the pictures, and neither faint nor as wide as haze.

    Args:
        gaussians: In the world's frame: +z up, the floor at z = 0.
        cameras: In the same frame.
        seen: What they see of the Gaussians, and what of that is inside masks.
        floor: Whether a floor is among the Gaussians; masks leave none.
        layer_radii: Height of the layer that is floor, in radii of what the cameras look at [-].
    """
    kept = (seen.weight > seen.least) & (gaussians.opacity > FAINT_OPACITY)
    if seen.inside is not None:
        return kept & (seen.inside > MIN_INSIDE_MASKS_FRACTION * seen.weight)
    around = find_viewed_region(tuple(cameras), gaussians.mean)
    distance = np.linalg.norm(gaussians.mean - np.array(around.centre), axis=1)
    kept &= distance < MAX_OBJECT_RADII * around.radius
    kept &= gaussians.scale.max(axis=1) < HAZE_WIDTH_RADII * around.radius
    kept &= seen.views >= MIN_VIEWS_FRACTION * len(cameras)
    if floor:
        kept &= gaussians.mean[:, 2] > layer_radii * around.radius
    return kept


def pixels_covered(
    gaussians: Gaussians, cameras: Sequence[Camera], of_objects: Int[np.ndarray, " M"]
) -> Bool[np.ndarray, "V H W"]:
    """Return the pixels that show mostly Gaussians of objects."""
    shares = [gaussian_weights(gaussians, c, 1)[of_objects].sum(axis=0) for c in cameras]
    pairs = zip(shares, cameras, strict=True)
    return np.stack([np.asarray(share).reshape(c.height, c.width) > COVERED_PIXEL_FRACTION for share, c in pairs])


def places_near_objects(
    gaussians: Gaussians, of_objects: Int[np.ndarray, " M"], position: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " N"]:
    """Return which places are at a Gaussian of objects, within a few distances or widths of it."""
    mean, widest = gaussians.mean[of_objects], gaussians.scale[of_objects].max(axis=1)
    tree = KDTree(mean)
    apart = float(np.median(np.asarray(tree.query(mean, k=2)[0])[:, 1]))
    distance, nearest = map(np.asarray, tree.query(position))
    return distance < NEAR_NEIGHBOUR_DISTANCES * np.maximum(apart, widest[nearest])


def assign_hidden_gaussians(gaussians: Gaussians, owner: Int[np.ndarray, " N"], floor: bool) -> Int[np.ndarray, " N"]:
    """Let faint and hidden Gaussians go with the object they are near, or they would stay behind.

    Faint ones are near what they reach. Where a floor is among them, only those above it go.
    """
    mean = gaussians.mean
    own, rest = np.flatnonzero(owner >= 0), np.flatnonzero(owner < 0)
    tree = KDTree(mean[own])
    apart = float(np.median(np.asarray(tree.query(mean[own], k=2)[0])[:, 1]))
    distance, nearest = map(np.asarray, tree.query(mean[rest]))
    reach = FAINT_REACH_SIGMAS * gaussians.scale[rest].max(axis=1) * (gaussians.opacity[rest] < COVERED_PIXEL_FRACTION)
    goes = (distance < np.maximum(NEAR_NEIGHBOUR_DISTANCES * apart, reach)) & (
        mean[rest, 2] > NEAR_NEIGHBOUR_DISTANCES * apart
    )
    goes |= not floor
    made = owner.copy()
    made[rest[goes]] = owner[own[nearest[goes]]]
    return made


def gaussians_below_floor(gaussians: Gaussians, owner: Int[np.ndarray, " N"], longest: float) -> Bool[np.ndarray, " N"]:
    """Return which Gaussians of objects are below the floor.

    Where no camera looks from below, the visual hull goes on under it, as a cone that nothing denies. The floor ends
    the surface there; in a video of an object that is lifted the cone would show.

    Args:
        gaussians: In the world's frame: +z up, the floor at z = 0.
        owner: Whose each is; -1: no object's.
        longest: Side of the objects' boxes [in the unit of the Gaussians].
    """
    return (owner >= 0) & (gaussians.mean[:, 2] < -MIN_SUNK_DEPTH_FRACTION * longest)


def _inside_fraction(mask: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "h w"]:
    """Return the share of each cell that is inside."""
    rows, columns = (np.arange(0, mask.shape[0], CELL_WITH_MASKS_PX), np.arange(0, mask.shape[1], CELL_WITH_MASKS_PX))
    sums = np.add.reduceat(np.add.reduceat(mask.astype(float), rows, axis=0), columns, axis=1)
    ones = np.ones(mask.shape)
    return sums / np.add.reduceat(np.add.reduceat(ones, rows, axis=0), columns, axis=1)
