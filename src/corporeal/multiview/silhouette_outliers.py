"""Views whose silhouettes contradict those of all others: their poses, or their masks, are wrong.

A camera that was placed on the wrong piece of a repeating pattern has an ordinary reprojection error; only what it
shows of the object is not where the others see it. The visual hull is carved with each view left out, and forgives a
few of the rest, so that one wrong view does not carve away what the right ones agree on.

Detection of inverted masks.

Programs differ in what white means. Inverted masks contradict neither the pictures nor one another: together they show
the surroundings without the object.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import binary_dilation

from corporeal.core.types import Camera
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.silhouette_coherence import (
    SilhouetteComparison,
    hull_grid_points,
    mask_overlap_and_fill,
    pixels_of_points,
    shrink_mask,
)
from corporeal.multiview.viewed_region import find_viewed_region

MIN_CROPPED_BORDER_FRACTION = 0.1
"""Share of a side of a picture that a mask fills where what it shows is cropped."""


def find_cropped_masks(masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, " V"]:
    """Tell in which pictures masks fill much of a border."""
    sides = masks[:, 0], masks[:, -1], masks[:, :, 0], masks[:, :, -1]
    return np.max([side.mean(axis=1) for side in sides], axis=0) > MIN_CROPPED_BORDER_FRACTION


MIN_INVERTED_BORDER_FRACTION = 0.5
"""Share of a picture's border, and of what all cameras look at, in the median picture: an object that pictures cut off
on most of their sides is still where they look, and what has a hole there is not cut off on most.
"""
CENTRE_HALF_SIDE_WIDTHS = 0.05
"""Half the side of the square about what all cameras look at, in widths of the picture."""


def are_masks_inverted(masks: Bool[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> bool:
    """Return whether most masks hold most of the borders, and not what all cameras look at."""
    frame = np.ones(masks.shape[1:], np.bool_)
    frame[1:-1, 1:-1] = False
    around = np.median(masks[:, frame].mean(axis=1))
    place = np.array([*find_viewed_region(cameras).centre, 1.0])
    middles = [_centre_mask_fraction(m, c, place) for m, c in zip(masks, cameras, strict=True)]
    return bool(around > MIN_INVERTED_BORDER_FRACTION and np.median(middles) < 1 - MIN_INVERTED_BORDER_FRACTION)


def _centre_mask_fraction(mask: Bool[np.ndarray, "H W"], camera: Camera, place: np.ndarray) -> float:
    """Return how much of the square about a place (4,), homogeneous, is in a mask [-].

    Of a place that a picture does not show, the nearest square on it.
    """
    across, down, ahead = camera.K @ (np.linalg.inv(camera.world_from_camera) @ place)[:3]
    height, width = mask.shape
    half = max(1, round(CENTRE_HALF_SIDE_WIDTHS * width))
    ahead = max(ahead, 1e-9)
    u, v = (int(np.clip(x / ahead, half, n - half)) for x, n in ((across, width), (down, height)))
    return float(mask[v - half : v + half, u - half : u + half].mean())


MAX_OUTLIER_IMAGE_SIDE_PX = 128
"""Longer side at which silhouettes are compared [px], at most: a step of the grid that the hull is carved from is no
longer than a pixel, or the hull's silhouette would have holes."""
MAX_DENYING_VIEWS_FRACTION = 0.1
"""Share of the views that may deny a point of the hull, at least one."""
MIN_VIEWS_FOR_OUTLIERS = 8
"""Views from which on a hull tells one that is wrong from those that are right."""
MAX_OUTLIER_VIEWS_FRACTION = 0.34
"""Share of the views from which on the right ones are ambiguous."""


@dataclass(frozen=True)
class OutlierBounds:
    """Below both of which a view is wrong.

    A right view may overlap little where it alone sees that a place is empty.
    """

    overlap: float
    """With the hull of the others, over the median of all views [-]."""
    filled: float
    """Share of its mask that the hull of the others fills [-]."""


GIVEN_MASK_BOUNDS = OutlierBounds(0.75, 0.95)
"""Of given masks. Measured on real sets: overlaps of right views 0.9 and more, of wrong ones 0.7 and less; right ones
are filled by 0.97 and more, turned by 25 degrees 0.91 and less.
"""
GROWN_MASK_BOUNDS = OutlierBounds(0.85, 0.8)
"""Of grown masks that are accepted, which vary more: of 17 sets of one object every right view is filled by 0.91 and
more; views that show another object on the same floor by 0.68 and less, at overlaps of 0.8 and less.
"""


def outlier_views(
    masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...], bounds: OutlierBounds = GIVEN_MASK_BOUNDS
) -> tuple[int, ...]:
    """Return the numbers of views that do not show what the others see; (): of none that is known.

    Args:
        masks: 255: the object; views with an empty one say nothing.
        cameras: In any frame and unit.
        bounds: Of what is right.
    """
    if len(cameras) < MIN_VIEWS_FOR_OUTLIERS:
        return ()
    found = compare_with_hull_of_others(masks, cameras)
    apart = found.overlap < bounds.overlap * np.nanmedian(found.overlap)
    wrong = np.flatnonzero(apart & (found.filled < bounds.filled))
    return tuple(wrong.tolist()) if len(wrong) <= MAX_OUTLIER_VIEWS_FRACTION * len(cameras) else ()


def median_fill_by_others(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> float:
    """Return which share of a mask the hull of the others fills, the median of all views."""
    return float(np.nanmedian(compare_with_hull_of_others(masks, cameras).filled))


def compare_with_hull_of_others(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> SilhouetteComparison:
    """Compare each mask with the hull of the others."""
    points = hull_grid_points(masks, cameras)
    side = min(MAX_OUTLIER_IMAGE_SIDE_PX, _finest_image_side_px(points, cameras))
    coarse = [shrink_mask(mask, side) for mask in masks]
    denied = np.zeros(len(points), np.int16)
    seen = np.zeros(len(points), np.int16)
    cells, denials = [], []
    for mask, camera in zip(coarse, cameras, strict=True):
        cell = pixels_of_points(points, camera, mask.shape)
        near = np.asarray(binary_dilation(mask), bool)
        deny = (cell >= 0) & ~near.ravel()[cell]
        cells.append(cell.astype(np.int32))
        denials.append(deny)
        denied += deny
        seen += cell >= 0
    allowed = max(1, int(MAX_DENYING_VIEWS_FRACTION * len(cameras)))
    looked = seen > len(cameras) / 4
    shares = np.array(
        [
            _mask_fractions(mask, cell[looked & (denied - deny <= allowed)])
            for mask, cell, deny in zip(coarse, cells, denials, strict=True)
        ]
    )
    return SilhouetteComparison(shares[:, 0], shares[:, 1])


def _finest_image_side_px(points: Float[np.ndarray, "N 3"], cameras: tuple[Camera, ...]) -> int:
    """Return the longer side of pictures in which a step of a cubic grid is a pixel [px]."""
    step, middle = float(np.linalg.norm(points[1] - points[0])), points.mean(axis=0)
    shares = []
    for camera in cameras:
        P = projection_matrix(camera)
        depth = abs(float(P[2, :3] @ middle + P[2, 3]))
        focal = float(np.linalg.norm(P[0, :3] - (P[0, :3] @ P[2, :3]) * P[2, :3]))
        shares.append(step * focal / depth / max(camera.width, camera.height))
    return int(1.0 / float(np.median(shares)))


def _mask_fractions(mask: Bool[np.ndarray, "h w"], cell: np.ndarray) -> tuple[float, float]:
    """Compare a mask with pixels that are shown."""
    shown = np.zeros(mask.size, bool)
    shown[cell[cell >= 0]] = True
    return mask_overlap_and_fill(shown.reshape(mask.shape), mask)
