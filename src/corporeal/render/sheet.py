"""A contact sheet: many small pictures with a caption each, on one page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.render.png import write_png

PAPER, INK, FAINT = (255, 255, 255), (28, 30, 34), (120, 124, 132)
GAP = 14
"""Between tiles [px]."""
LINE = 17
"""Height of a line of a caption [px]."""


@dataclass(frozen=True)
class Tile:
    """One picture and what stands below it: a title in bold ink, then fainter lines."""

    picture: UInt8[np.ndarray, "H W 3"]
    title: str
    lines: tuple[str, ...] = ()


def sheet(tiles: Sequence[Tile], path: Path, columns: int = 0) -> None:
    """Write a PNG of all tiles, row by row; as many columns as make the page about 3 : 2."""
    height, width = tiles[0].picture.shape[:2]
    rows_of_text = 1 + max(len(t.lines) for t in tiles)
    down, right = height + rows_of_text * LINE + GAP + 4, width + GAP
    columns = columns or min(len(tiles), max(1, round((1.5 * len(tiles) * down / right) ** 0.5)))
    rows = -(-len(tiles) // columns)
    page = Image.new("RGB", (columns * right + GAP, rows * down + GAP), PAPER)
    pen = ImageDraw.Draw(page)
    for k, tile in enumerate(tiles):
        x, y = GAP + k % columns * right, GAP + k // columns * down
        page.paste(Image.fromarray(tile.picture), (x, y))
        _caption(pen, tile, (x, y + height + 4), width)
    write_png(page, path)


def _caption(pen: ImageDraw.ImageDraw, tile: Tile, place: tuple[int, int], width: int) -> None:
    x, y = place
    for k, words in enumerate((tile.title, *tile.lines)):
        font = ImageFont.load_default(14 if k == 0 else 12)
        pen.text((x, y + k * LINE), _cut(words, font, width), INK if k == 0 else FAINT, font)


def _cut(words: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> str:
    """Return as many of the words as fit, with an ellipsis where they don't."""
    if font.getlength(words) <= width:
        return words
    while words and font.getlength(words + "…") > width:
        words = words[:-1]
    return words + "…"
