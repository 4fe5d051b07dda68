"""Figure of masks over photographs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, UInt8

from corporeal.core.errors import UserError
from corporeal.core.store import disk_errors
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.reconstruction.gaussians.gaussian_scene import MASK_MIN_U8
from corporeal.render.contact_sheet import SheetTile, write_contact_sheet

MASKS_FIGURE_FILE = "objects.png"
"""Beside what was reconstructed."""
MAX_SHOWN_PHOTOGRAPHS = 6
"""Photographs that are shown, from all sides."""
SHOWN_SIDE_PX = 320
"""Longest side of each [px]."""
FAINT_CONTRAST_FRACTION = 0.25
"""Of its contrast, what is no object keeps so much, on white."""
OUTLINE_RGB = (230, 60, 40)
"""sRGB of outlines."""


def masks_figure(source: Path, masked_by: Path | None, path: Path) -> None:
    """Draw the masks of posed photographs, if they have any and the photographs can be read."""
    try:
        seen = read_posed_photos(source, SHOWN_SIDE_PX, bare=True, most=MAX_SHOWN_PHOTOGRAPHS)
        cut = read_posed_photos(source, SHOWN_SIDE_PX, masked_by, most=MAX_SHOWN_PHOTOGRAPHS)
    except UserError:  # of those few most are broken: whoever reads all says what is wrong
        return
    if cut.masks is None or cut.masks.shape[1:] != seen.views.rgb.shape[1:3]:
        return
    own = dict(zip(seen.names, seen.views.rgb, strict=True))
    draw_masks_over([own[name] for name in cut.names], cut.masks >= MASK_MIN_U8, cut.names, path)


def draw_masks_over(
    pictures: Sequence[UInt8[np.ndarray, "H W 3"]], masks: Bool[np.ndarray, "V H W"], names: Sequence[str], path: Path
) -> None:
    """Draw pictures, paler where no object is, with outlines."""
    steps = np.linspace(0, len(names) - 1, min(len(names), MAX_SHOWN_PHOTOGRAPHS)).round()
    which: list[int] = np.unique(steps.astype(int)).tolist()
    tiles = [SheetTile(_draw_over(pictures[k], masks[k]), names[k]) for k in which]
    with disk_errors(path):
        write_contact_sheet(tiles, path)


def _draw_over(picture: UInt8[np.ndarray, "H W 3"], mask: Bool[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    pale = (255 - FAINT_CONTRAST_FRACTION * (255 - picture.astype(np.float64))).astype(np.uint8)
    made = np.where(mask[..., None], picture, pale)
    inner = mask.copy()
    inner[1:] &= mask[:-1]
    inner[:-1] &= mask[1:]
    inner[:, 1:] &= mask[:, :-1]
    inner[:, :-1] &= mask[:, 1:]
    made[mask & ~inner] = OUTLINE_RGB
    return made
