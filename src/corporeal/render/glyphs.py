"""What the font of our figures can write."""

from functools import cache

from PIL import Image, ImageDraw, ImageFont

from corporeal.render.figure_keys import font

SIZE = 24
"""Of letters that are compared [px]."""
NO_LETTER = "\uffff"
"""Never a character (Unicode 23.7): a font draws the sign of what it has not."""


def drawable(name: str, instead: str) -> str:
    """Return a name as figures can write it.

    The font that comes with Matplotlib has Latin, Greek, Cyrillic, Arabic and Hebrew letters, but
    no Chinese, Japanese or Korean: such a name is written ``instead``; pages show it as it is.
    """
    if name.isascii():
        return name
    return name if all(map(_known, name)) else instead


@cache
def _known(letter: str) -> bool:
    """Tell whether the font draws a letter otherwise than what is no letter at all."""
    return _drawn(letter) != _drawn(NO_LETTER)


def _drawn(letter: str) -> bytes:
    sheet = Image.new("L", (2 * SIZE, 2 * SIZE))
    one_by_one = font(SIZE).font_variant(layout_engine=ImageFont.Layout.BASIC)
    ImageDraw.Draw(sheet).text((SIZE / 2, SIZE / 2), letter, 255, one_by_one)
    return sheet.tobytes()
