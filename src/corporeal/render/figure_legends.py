"""Legends of figures.

The letters are those of DejaVu Sans, the font that comes with Matplotlib; Matplotlib itself would take longer to import
than a whole figure to draw.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont

from corporeal.render.colours import Colour

INK_COLOUR = "#222222"
TICK_COLOUR = "#888888"
SMALL_FONT_PX, LARGE_FONT_PX = 15, 19
"""Of letters in keys, and in titles [px]."""
LINE_PITCH_PX = 21
"""From one name to the next [px]."""
NAME_INDENT_PX = 22
"""From the left of a name's colour to the name [px]."""
COLUMN_GAP_PX = 22
"""[px]"""
SCALE_BAR_SIZE_PX = 378, 16
"""Of a scale [px]."""
TICK_LENGTH_PX = 5
"""Of a scale, below its bar [px]."""


@dataclass(frozen=True)
class TextLine:
    """Words somewhere on the page."""

    text: str
    place: tuple[float, float]
    """[px]"""
    anchor: str
    """Which point of the words lies there, as Pillow names it."""
    size: int = SMALL_FONT_PX
    """[px]"""

    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the letters [px]."""
        left, top, right, bottom = figure_font(self.size).getbbox(self.text, anchor=self.anchor)
        x, y = self.place
        return x + left, y + top, x + right, y + bottom


@dataclass(frozen=True)
class LegendEntry:
    """A name in a legend."""

    name: str
    colour: Colour | None
    """sRGB in [0, 1]; None: it has no colour."""


@dataclass(frozen=True)
class ScaleTick:
    """A value on a scale."""

    share: float
    """Where along the bar, from 0 to 1."""
    words: str


@dataclass(frozen=True)
class ColourSwatch:
    """A rectangle of colours, from left to right."""

    corner: tuple[float, float]
    """Left and top [px]."""
    size: tuple[int, int]
    """[px]"""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""


@dataclass(frozen=True)
class PanelLegend:
    """What is drawn below a panel."""

    lines: tuple[TextLine, ...]
    swatches: tuple[ColourSwatch, ...]

    def draw(self, sheet: Image.Image) -> None:
        """Draw it on a page."""
        pen = ImageDraw.Draw(sheet)
        for s in self.swatches:
            row = np.round(255 * s.colour).astype(np.uint8)[None]
            corner = round(s.corner[0]), round(s.corner[1])
            sheet.paste(Image.fromarray(row).resize(s.size, Image.Resampling.NEAREST), corner)
        for line in self.lines:
            pen.text(line.place, line.text, INK_COLOUR, figure_font(line.size), line.anchor)


@cache
def figure_font(size: int) -> ImageFont.FreeTypeFont:
    """Letters of so many pixels."""
    found = find_spec("matplotlib")
    assert found is not None and found.origin is not None
    path = Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(path, size)


def names_legend(entries: Sequence[LegendEntry], middle: float, top: float) -> PanelLegend:
    """List names beside their colours in two columns, the first filled first.

    Args:
        entries: Names and their colours.
        middle: Of the panel, from the left [px].
        top: Where the key begins [px].
    """
    rows = -(-len(entries) // 2)
    columns = [c for c in (entries[:rows], entries[rows:]) if c]
    wide = [NAME_INDENT_PX + max(figure_font(SMALL_FONT_PX).getlength(e.name) for e in c) for c in columns]
    left = middle - (sum(wide) + COLUMN_GAP_PX * (len(columns) - 1)) / 2
    lines, swatches = [], []
    for column, width in zip(columns, wide, strict=True):
        for row, entry in enumerate(column):
            y = top + row * LINE_PITCH_PX
            lines.append(TextLine(entry.name, (left + NAME_INDENT_PX, y + LINE_PITCH_PX / 2), "lm"))
            if entry.colour is not None:
                swatches.append(ColourSwatch((left, y + 3), (SMALL_FONT_PX, SMALL_FONT_PX), np.array([entry.colour])))
        left += width + COLUMN_GAP_PX
    return PanelLegend(tuple(lines), tuple(swatches))


def scale_legend(marks: Sequence[ScaleTick], ramp: Float[np.ndarray, "N 3"], middle: float, top: float) -> PanelLegend:
    """Draw a bar of colours over some values.

    Args:
        marks: Values along it.
        ramp: Colours from left to right, sRGB.
        middle: Of the panel, from the left [px].
        top: Where the key begins [px].
    """
    width, height = SCALE_BAR_SIZE_PX
    left, low = middle - width / 2, top + height
    swatches = [ColourSwatch((left, top), SCALE_BAR_SIZE_PX, ramp)]
    tick = np.array([[int(TICK_COLOUR[k : k + 2], 16) / 255 for k in (1, 3, 5)]])
    lines = []
    for mark in marks:
        x = left + mark.share * width
        swatches.append(ColourSwatch((x, low), (1, TICK_LENGTH_PX), tick))
        lines.append(TextLine(mark.words, (x, low + TICK_LENGTH_PX + 3), "mt"))
    return PanelLegend(tuple(lines), tuple(swatches))


GLYPH_SIZE_PX = 24
"""Of letters that are compared [px]."""
NONCHARACTER = "\uffff"
"""Never a character (Unicode 23.7): a font draws the sign of what it has not."""


def drawable_name(name: str, instead: str) -> str:
    """Return a name as figures can write it.

    The font that comes with Matplotlib has Latin, Greek, Cyrillic, Arabic and Hebrew letters, but no Chinese, Japanese
    or Korean: such a name is written ``instead``; pages show it as it is.
    """
    if name.isascii():
        return name
    return name if all(map(_has_glyph, name)) else instead


@cache
def _has_glyph(letter: str) -> bool:
    """Return whether the font draws a letter otherwise than what is no letter at all."""
    return _glyph_pixels(letter) != _glyph_pixels(NONCHARACTER)


def _glyph_pixels(letter: str) -> bytes:
    sheet = Image.new("L", (2 * GLYPH_SIZE_PX, 2 * GLYPH_SIZE_PX))
    one_by_one = figure_font(GLYPH_SIZE_PX).font_variant(layout_engine=ImageFont.Layout.BASIC)
    ImageDraw.Draw(sheet).text((GLYPH_SIZE_PX / 2, GLYPH_SIZE_PX / 2), letter, 255, one_by_one)
    return sheet.tobytes()
