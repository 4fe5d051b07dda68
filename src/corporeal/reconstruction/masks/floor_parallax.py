"""Objects on the floor by parallax to its plane.

Taken to the plane of the floor, views from all sides agree about all that lies there, shadows and prints too, and not
about what rises above it (plane and parallax: Irani and Anandan, "A unified approach to moving object detection in 2D
and 3D scenes", PAMI 1998). Pixels that contradict the median of all views carve a hull as masks do.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import binary_dilation

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.silhouette_coherence import is_outside_silhouettes
from corporeal.multiview.up_direction import estimate_up_direction
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_colour import equalise_floor_colour, floor_cell_colours, lightness_and_ratios
from corporeal.reconstruction.masks.floor_grid import MIN_AGREEING_PARTNERS, floor_grid, floor_intersections
from corporeal.reconstruction.masks.floor_sweep import MIN_UP_AGREEMENT, level_plane
from corporeal.reconstruction.masks.voxel_volume import VoxelVolume, voxel_volume

PARALLAX_PATCH_CELLS, DARK_CELL_U8 = 3, 4.0
"""Cells whose mean colour is compared; what is darker [of 255] is as dark."""
MAX_LIGHTNESS_DIFFERENCE_LOG, MAX_RATIO_DIFFERENCE_LOG = 0.35, 0.25
"""Differences of lightness and of the ratios of channels, in logarithms, from which on a pixel does not show what the
other views have there: right poses have .01 to .05 in the median, of a print .2.
"""
MIN_PARALLAX_VIEWS_FRACTION = 0.5
"""Share of the views that must see a place, so that its hull is no long cone."""
MIN_BESIDE_VIEWS_FRACTION = 0.5
"""Of the views that see a place, how many must see it beside masks for it to be beside them."""
MIN_PIECE_TO_MASK_RATIO = 0.08
"""Of the pixels of masks that a piece shows, in the median view: noise and edges of a print have up to .05."""
MIN_TOP_HEIGHT_RADII = 0.05
"""Height of its upper end, in radii of the ball."""
HEIGHT_ORIGIN_DEPTH_RADII = 2.0
"""Below the middle of the ball, in its radii, from where heights are measured then: under all."""
FLOOR_HEIGHT_PERCENTILE = 2
"""Percentile of the heights of a hull's cells that is near the floor then."""
TRIED_HEIGHTS_RADII = np.linspace(-0.12, 0.12, 9)
"""Heights about it, in radii of the ball; at the floor's views agree most."""


@dataclass(frozen=True)
class StandingRegions:
    """What stands on the floor; V views of H × W, M cells."""

    shown: Bool[np.ndarray, "V H W"]
    """Pixels that show something else than the floor has there."""
    room: VoxelVolume
    cells: Bool[np.ndarray, " M"]
    """Of the room, in the hull that these pixels carve."""

    def beside(self, masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, " M"]:
        """Return the cells of the hull that most views see beside masks."""
        apart, looking = self.room.votes(masks)
        return self.cells & (apart >= MIN_BESIDE_VIEWS_FRACTION * looking)

    def free(self, piece: Bool[np.ndarray, " M"]) -> bool:
        """Return whether a piece of the hull rises above the floor, and is no wall."""
        return not self.room.wall(piece) and bool(self.room.height[piece].max() > MIN_TOP_HEIGHT_RADII)


def find_standing_regions(
    views: Views, masks: Bool[np.ndarray, "V H W"], floor: GroundPlane | None, around: ViewedRegion
) -> StandingRegions | None:
    """Find what stands on the floor; None: its place is unknown, or views are too few.

    Args:
        views: The pictures.
        masks: What was taken for objects: under them the floor is looked for.
        floor: The plane that objects stand on, its normal up; None: points do not tell.
        around: The ball that all cameras look at.
    """
    if len(views.cameras) <= MIN_AGREEING_PARTNERS:
        return None
    plane = floor or _floor_below_masks(views, masks, around)
    if plane is None:
        return None
    room, shown = (voxel_volume(views.cameras, around, plane), _contradicting_pixels(views, plane, around))
    lying, looking = room.votes(shown)
    kept = ~is_outside_silhouettes(lying, looking) & (looking >= MIN_PARALLAX_VIEWS_FRACTION * len(masks))
    return StandingRegions(shown, room, kept)


def pixels_to_mask_ratio(seen: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"]) -> float:
    """Return how many pixels are seen over those of masks, in the median view."""
    return float(np.median(seen.sum(axis=(1, 2)) / np.maximum(masks.sum(axis=(1, 2)), 1)))


def _floor_below_masks(views: Views, masks: Bool[np.ndarray, "V H W"], around: ViewedRegion) -> GroundPlane | None:
    """Return a floor under what masks show; None: cameras do not agree about up."""
    found = estimate_up_direction(views.cameras)
    if found.sure < MIN_UP_AGREEMENT:
        return None
    room = voxel_volume(views.cameras, around, level_plane(found.up, -HEIGHT_ORIGIN_DEPTH_RADII, around))
    hull = room.carved(masks)
    if not hull.any():
        return None
    heights = (
        TRIED_HEIGHTS_RADII + np.percentile(room.height[hull], FLOOR_HEIGHT_PERCENTILE) - HEIGHT_ORIGIN_DEPTH_RADII
    )
    planes = [level_plane(found.up, h, around) for h in heights.tolist()]
    return min(planes, key=lambda plane: _contradicting_pixels(views, plane, around).sum())


def _contradicting_pixels(views: Views, floor: GroundPlane, around: ViewedRegion) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels show something else than the median of all views has there on the floor."""
    ground = floor_grid(views.cameras, floor, around)
    pairs = zip(views.rgb, views.cameras, strict=True)
    seen = equalise_floor_colour(
        np.stack([floor_cell_colours(ground, rgb, c, PARALLAX_PATCH_CELLS, DARK_CELL_U8) for rgb, c in pairs])
    )
    known = np.asarray(np.isfinite(seen).all(axis=-1))
    usual = np.zeros(seen.shape[1:])
    some = known.any(axis=0)
    usual[some] = np.nanmedian(seen[:, some], axis=0)
    light, ratios = lightness_and_ratios(np.where(known[..., None], seen - usual, 0.0))
    off = (np.abs(light) > MAX_LIGHTNESS_DIFFERENCE_LOG) | (np.abs(ratios).max(axis=-1) > MAX_RATIO_DIFFERENCE_LOG)
    made = np.zeros(views.rgb.shape[:3], np.bool_)
    for one, camera, other in zip(made, views.cameras, off, strict=True):
        cell = ground.cells(floor_intersections(camera, floor))
        shown = (cell >= 0) & other.ravel()[cell]
        one[:] = binary_dilation(shown.reshape(one.shape))  # what stands has its colours, too
    return made
