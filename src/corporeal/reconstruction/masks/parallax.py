"""What stands on the floor, told by its plane, whatever its colours.

Taken to the plane of the floor, views from all sides agree about all that lies there, shadows and
prints too, and not about what rises above it (plane and parallax: Irani and Anandan, "A unified
approach to moving object detection in 2D and 3D scenes", PAMI 1998). Pixels that contradict the
median of all views carve a hull as masks do.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import binary_dilation

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.level import level
from corporeal.multiview.region import Region
from corporeal.multiview.silhouettes import outside
from corporeal.reconstruction.masks.floor_colour import colours_on, evened, parted
from corporeal.reconstruction.masks.floor_square import WITNESSES, met, square
from corporeal.reconstruction.masks.swept_floor import SURE, level_plane
from corporeal.reconstruction.masks.volume import Volume, volume

PATCH, DARKEST = 3, 4.0
"""Cells whose mean colour is compared; what is darker [of 255] is as dark."""
LIGHT, RATIO = 0.35, 0.25
"""Differences of lightness and of the ratios of channels, in logarithms, from which on a pixel does
not show what the other views have there: right poses have .01 to .05 in the median, of a print .2.
"""
SEEN = 0.5
"""Share of the views that must see a place, so that its hull is no long cone."""
MOST = 0.5
"""Of the views that see a place, how many must see it beside masks for it to be beside them."""
AS_LARGE = 0.08
"""Of the pixels of masks that a piece shows, in the median view: noise and edges of a print have up
to .05."""
HIGH = 0.05
"""Height of its upper end, in radii of the ball."""
DEEP = 2.0
"""Below the middle of the ball, in its radii, from where heights are measured then: under all."""
LOWEST = 2
"""Percentile of the heights of a hull's cells that is near the floor then."""
TRIED = np.linspace(-0.12, 0.12, 9)
"""Heights about it, in radii of the ball; at the floor's views agree most."""


@dataclass(frozen=True)
class Standing:
    """What stands on the floor; V views of H × W, M cells."""

    shown: Bool[np.ndarray, "V H W"]
    """Pixels that show something else than the floor has there."""
    room: Volume
    cells: Bool[np.ndarray, " M"]
    """Of the room, in the hull that these pixels carve."""

    def beside(self, masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, " M"]:
        """Return the cells of the hull that most views see beside masks."""
        apart, looking = self.room.votes(masks)
        return self.cells & (apart >= MOST * looking)

    def free(self, piece: Bool[np.ndarray, " M"]) -> bool:
        """Tell whether a piece of the hull rises above the floor, and is no wall."""
        return not self.room.wall(piece) and bool(self.room.height[piece].max() > HIGH)


def standing(
    views: Views,
    masks: Bool[np.ndarray, "V H W"],
    floor: Plane | None,
    around: Region,
) -> Standing | None:
    """Find what stands on the floor; None: nobody knows where that is, or views are too few.

    Args:
        views: The pictures.
        masks: What was taken for objects: under them the floor is looked for.
        floor: The plane that objects stand on, its normal up; None: points do not tell.
        around: The ball that all cameras look at.

    """
    if len(views.cameras) <= WITNESSES:
        return None
    plane = floor or _below(views, masks, around)
    if plane is None:
        return None
    room, shown = volume(views.cameras, around, plane), _contradicting(views, plane, around)
    lying, looking = room.votes(shown)
    kept = ~outside(lying, looking) & (looking >= SEEN * len(masks))
    return Standing(shown, room, kept)


def as_large(seen: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"]) -> float:
    """Return how many pixels are seen over those of masks, in the median view."""
    return float(np.median(seen.sum(axis=(1, 2)) / np.maximum(masks.sum(axis=(1, 2)), 1)))


def _below(views: Views, masks: Bool[np.ndarray, "V H W"], around: Region) -> Plane | None:
    """Return a floor under what masks show; None: cameras do not agree about up."""
    found = level(views.cameras)
    if found.sure < SURE:
        return None
    room = volume(views.cameras, around, level_plane(found.up, -DEEP, around))
    hull = room.carved(masks)
    if not hull.any():
        return None
    heights = TRIED + np.percentile(room.height[hull], LOWEST) - DEEP
    planes = [level_plane(found.up, h, around) for h in heights.tolist()]
    return min(planes, key=lambda plane: _contradicting(views, plane, around).sum())


def _contradicting(views: Views, floor: Plane, around: Region) -> Bool[np.ndarray, "V H W"]:
    """Tell which pixels show something else than the median of all views has there on the floor."""
    ground = square(views.cameras, floor, around)
    pairs = zip(views.rgb, views.cameras, strict=True)
    seen = evened(np.stack([colours_on(ground, rgb, c, PATCH, DARKEST) for rgb, c in pairs]))
    known = np.asarray(np.isfinite(seen).all(axis=-1))
    usual = np.zeros(seen.shape[1:])
    some = known.any(axis=0)
    usual[some] = np.nanmedian(seen[:, some], axis=0)
    light, ratios = parted(np.where(known[..., None], seen - usual, 0.0))
    off = (np.abs(light) > LIGHT) | (np.abs(ratios).max(axis=-1) > RATIO)
    made = np.zeros(views.rgb.shape[:3], np.bool_)
    for one, camera, other in zip(made, views.cameras, off, strict=True):
        cell = ground.cells(met(camera, floor))
        shown = (cell >= 0) & other.ravel()[cell]
        one[:] = binary_dilation(shown.reshape(one.shape))  # what stands has its colours, too
    return made
