"""Glyphs of the font of figures."""

from functools import cache

from PIL import Image, ImageDraw, ImageFont

from corporeal.render.figure_legends import figure_font

GLYPH_SIZE_PX = 24
"""Of letters that are compared [px]."""
NONCHARACTER = "\uffff"
"""Never a character (Unicode 23.7): a font draws the sign of what it has not."""


def drawable_name(name: str, instead: str) -> str:
    """Return a name as figures can write it.

    The font that comes with Matplotlib has Latin, Greek, Cyrillic, Arabic and Hebrew letters, but
    no Chinese, Japanese or Korean: such a name is written ``instead``; pages show it as it is.
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
