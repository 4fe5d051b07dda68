"""Masks over some of the photographs: whether the thing is what somebody meant is seen at once."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, UInt8

from corporeal.core.errors import UserError
from corporeal.core.store import writing
from corporeal.io.photographs import read_photographs
from corporeal.reconstruction.gaussians.intake import ON
from corporeal.render.sheet import Tile, sheet

FIGURE = "objects.png"
"""Beside what was reconstructed."""
MOST = 6
"""Photographs that are shown, from all sides."""
SIDE = 320
"""Longest side of each [px]."""
FAINT = 0.25
"""Of its contrast, what is no object keeps so much, on white."""
EDGE = (230, 60, 40)
"""sRGB of outlines."""


def masks_figure(source: Path, masked_by: Path | None, path: Path) -> None:
    """Draw the masks of posed photographs, if they have any and the photographs can be read.

    Args:
        source: A folder of photographs with poses.
        masked_by: A folder of masks instead of the photographs' own.
        path: A PNG.

    """
    try:
        seen = read_photographs(source, SIDE, bare=True, most=MOST)
        cut = read_photographs(source, SIDE, masked_by, most=MOST)
    except UserError:  # of those few most are broken: whoever reads all says what is wrong
        return
    if cut.masks is None or cut.masks.shape[1:] != seen.views.rgb.shape[1:3]:
        return
    own = dict(zip(seen.names, seen.views.rgb, strict=True))
    drawn_over([own[name] for name in cut.names], cut.masks >= ON, cut.names, path)


def drawn_over(
    pictures: Sequence[UInt8[np.ndarray, "H W 3"]],
    masks: Bool[np.ndarray, "V H W"],
    names: Sequence[str],
    path: Path,
) -> None:
    """Draw pictures, paler where no object is, with outlines.

    Args:
        pictures: At most a few of them are drawn.
        masks: Which pixels are on objects.
        names: Of the pictures.
        path: A PNG.

    """
    steps = np.linspace(0, len(names) - 1, min(len(names), MOST)).round()
    which: list[int] = np.unique(steps.astype(int)).tolist()
    tiles = [Tile(_over(pictures[k], masks[k]), names[k]) for k in which]
    with writing(path):
        sheet(tiles, path)


def _over(
    picture: UInt8[np.ndarray, "H W 3"], mask: Bool[np.ndarray, "H W"]
) -> UInt8[np.ndarray, "H W 3"]:
    pale = (255 - FAINT * (255 - picture.astype(np.float64))).astype(np.uint8)
    made = np.where(mask[..., None], picture, pale)
    inner = mask.copy()
    inner[1:] &= mask[:-1]
    inner[:-1] &= mask[1:]
    inner[:, 1:] &= mask[:, :-1]
    inner[:, :-1] &= mask[:, 1:]
    made[mask & ~inner] = EDGE
    return made
