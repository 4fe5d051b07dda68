"""What the font of our figures can write."""

from functools import cache


def drawable(name: str, instead: str) -> str:
    """Return a name as figures can write it.

    The font that comes with Matplotlib has Latin, Greek, Cyrillic, Arabic and Hebrew letters, but
    no Chinese, Japanese or Korean: such a name is written ``instead``; pages show it as it is.
    """
    if name.isascii():
        return name
    known = _known()
    return name if all(ord(letter) in known for letter in name) else instead


@cache
def _known() -> frozenset[int]:
    from matplotlib import font_manager  # takes long, and most names are plain
    from matplotlib.ft2font import FT2Font

    font = FT2Font(font_manager.findfont(font_manager.FontProperties()))
    return frozenset(font.get_charmap())
