"""Something that stands on the floor beside what masks show, and is in none of them.

Masks are of what has the colours of the middle, so that a second thing of other colours is lost
without a word. But it stands up: taken to the plane of the floor, views from all sides agree about
all that lies there, whatever its colours, shadows and prints too, and not about what rises above
it (plane and parallax: Irani and Anandan, "A unified approach to moving object detection in 2D and
3D scenes", PAMI 1998). Pixels that contradict the median of all views carve a hull as masks do, and
what of it is seen beside masks is something else.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import binary_dilation

from corporeal.geometry.ground_plane import Plane
from corporeal.geometry.level import level
from corporeal.geometry.region import Region
from corporeal.geometry.silhouettes import outside
from corporeal.masking.floor_colour import colours_on, evened, parted
from corporeal.masking.floor_square import WITNESSES, met, square
from corporeal.masking.volume import Volume, volume
from corporeal.types import Views

PATCH, DARKEST = 3, 4.0
"""Cells whose mean colour is compared; what is darker [of 255] is as dark."""
LIGHT, RATIO = 0.35, 0.25
"""Differences of lightness and of the ratios of channels, in logarithms, from which on a pixel does
not show what the other views have there: right poses have .01 to .05 in the median, of a print .2.
"""
SEEN = 0.5
"""Share of the views that must see a place, so that its hull is no long cone."""
BESIDE_MASKS = 0.5
"""Of the views that see a place, how many must see it beside masks."""
ASIDE = 0.6
"""Of the pixels of a piece, in the median view, that are beside masks: what masks lack of a thing
has .0 to .5, other things .9."""
AS_LARGE = 0.08
"""Of the pixels of masks that it shows, in the median view: noise and edges of a print have up to
.05."""
AT_EDGE = 0.15
"""Share of a piece at the edge of the ball that cameras look at, above which it is a
wall: .27 of one behind a chair, up to .06 of things."""
HIGH = 0.05
"""Height of its upper end, in radii of the ball."""
SURE = 0.8
"""How well level cameras must agree about up where points do not say where the floor is."""
LOWEST = 2
"""Percentile of the heights of a hull's cells that is near the floor then."""
TRIED = np.linspace(-0.12, 0.12, 9)
"""Heights about it, in radii of the ball; at the floor's views agree most."""


@dataclass(frozen=True)
class Beside:
    """Where something else is."""

    as_large: float
    """Pixels that it covers over those of masks, in the median view [-]."""
    view: int
    """In which the most of it is seen."""
    across: float
    """Where it is there, in widths of the picture from the left."""
    down: float
    """The same, in heights from the top."""


def beside(
    views: Views,
    masks: Bool[np.ndarray, "V H W"],
    near: Bool[np.ndarray, "V H W"],
    floor: Plane | None,
    around: Region,
) -> Beside | None:
    """Find the largest thing that stands beside what masks show; None: nothing does.

    Args:
        views: The pictures.
        masks: What was taken for objects.
        near: The same and what borders on it, where nothing is said.
        floor: The plane that objects stand on, its normal up; None: points do not tell.
        around: The ball that all cameras look at.

    """
    if len(views.cameras) <= WITNESSES:
        return None
    plane = floor or _below(views, masks, around)
    if plane is None:
        return None
    room = volume(views.cameras, around, plane)
    not_standing, looking = room.votes(_standing(views, plane, around))
    apart, _ = room.votes(near)
    kept = ~outside(not_standing, looking) & (looking >= SEEN * len(masks))
    piece, count = room.pieces(kept & (apart >= BESIDE_MASKS * looking))
    found = [
        _told(room.silhouettes(piece == k), masks, near)
        for k in range(1, count + 1)
        if _stands_free(room, piece == k)
    ]
    return max(filter(None, found), key=lambda one: one.as_large, default=None)


def _below(views: Views, masks: Bool[np.ndarray, "V H W"], around: Region) -> Plane | None:
    """Return a floor under what masks show; None: cameras do not agree about up."""
    found = level(views.cameras)
    if found.sure < SURE:
        return None
    deep = float(found.up @ np.array(around.centre)) - 2 * around.radius
    room = volume(views.cameras, around, Plane(found.up, deep, 0.0, 0.0))
    hull = room.carved(masks)
    if not hull.any():
        return None
    heights = TRIED + np.percentile(room.height[hull], LOWEST)
    planes = [Plane(found.up, float(deep + h * around.radius), 0.0, 0.0) for h in heights]
    return min(planes, key=lambda plane: _standing(views, plane, around).sum())


def _standing(views: Views, floor: Plane, around: Region) -> Bool[np.ndarray, "V H W"]:
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


def _stands_free(room: Volume, cells: Bool[np.ndarray, " M"]) -> bool:
    """Tell whether a piece rises above the floor, and is no wall."""
    return bool(room.outer[cells].mean() <= AT_EDGE and room.height[cells].max() > HIGH)


def _told(
    seen: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"], near: np.ndarray
) -> Beside | None:
    """Return where a piece is seen; None: it is too small, or a part of what masks show."""
    count = seen.sum(axis=(1, 2))
    apart = (seen & ~near).sum(axis=(1, 2))
    as_large = float(np.median(count / np.maximum(masks.sum(axis=(1, 2)), 1)))
    if as_large < AS_LARGE or np.median(apart / np.maximum(count, 1)) < ASIDE:
        return None
    view = int(apart.argmax())
    down, across = (np.argwhere(seen[view]).mean(axis=0) + 0.5) / seen.shape[1:]
    return Beside(as_large, view, float(across), float(down))
