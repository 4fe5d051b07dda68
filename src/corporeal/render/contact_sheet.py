"""A contact sheet: many small pictures with a caption each, on one page."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.render.png_writer import write_png

PAPER_RGB, INK_RGB, FAINT_RGB = (255, 255, 255), (28, 30, 34), (120, 124, 132)
TILE_GAP_PX = 14
"""Between tiles [px]."""
CAPTION_LINE_PX = 17
"""Height of a line of a caption [px]."""


@dataclass(frozen=True)
class SheetTile:
    """One picture and what stands below it: a title in bold ink, then fainter lines."""

    picture: UInt8[np.ndarray, "H W 3"]
    title: str
    lines: tuple[str, ...] = ()


def write_contact_sheet(tiles: Sequence[SheetTile], path: Path, columns: int = 0) -> None:
    """Write a PNG of all tiles, row by row; as many columns as make the page about 3 : 2."""
    height, width = tiles[0].picture.shape[:2]
    rows_of_text = 1 + max(len(t.lines) for t in tiles)
    down, right = height + rows_of_text * CAPTION_LINE_PX + TILE_GAP_PX + 4, width + TILE_GAP_PX
    columns = columns or min(len(tiles), max(1, round((1.5 * len(tiles) * down / right) ** 0.5)))
    rows = -(-len(tiles) // columns)
    page = Image.new("RGB", (columns * right + TILE_GAP_PX, rows * down + TILE_GAP_PX), PAPER_RGB)
    pen = ImageDraw.Draw(page)
    for k, tile in enumerate(tiles):
        x, y = TILE_GAP_PX + k % columns * right, TILE_GAP_PX + k // columns * down
        page.paste(Image.fromarray(tile.picture), (x, y))
        _caption(pen, tile, (x, y + height + 4), width)
    write_png(page, path)


def _caption(pen: ImageDraw.ImageDraw, tile: SheetTile, place: tuple[int, int], width: int) -> None:
    x, y = place
    for k, words in enumerate((tile.title, *tile.lines)):
        font = ImageFont.load_default(14 if k == 0 else 12)
        pen.text((x, y + k * CAPTION_LINE_PX), _truncate(words, font, width), INK_RGB if k == 0 else FAINT_RGB, font)


def _truncate(words: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> str:
    """Return as many of the words as fit, with an ellipsis where they don't."""
    if font.getlength(words) <= width:
        return words
    while words and font.getlength(words + "…") > width:
        words = words[:-1]
    return words + "…"
