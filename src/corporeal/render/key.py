"""What colours mean, and when it is, written into the corners of a film's pictures."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from corporeal.render.colours import Colour, ramp
from corporeal.render.figures import ENTRIES, LETTERS

INK = (34, 34, 34)
PLATE = (244, 241, 236)
MARGIN = 12
"""[px]"""
BAR = (120, 10)
"""[px]"""


def names(
    picture: np.ndarray, title: str, labels: Sequence[str], colours: Sequence[Colour]
) -> np.ndarray:
    """Write names beside their colours into the upper left corner, each pair once."""
    image, draw, font = _canvas(picture)
    step = font.size + 5
    draw.text((MARGIN, MARGIN), title, fill=INK, font=font)
    entries = list(dict.fromkeys(zip(labels, colours, strict=True)))
    for row, (name, colour) in enumerate(entries[:ENTRIES]):
        top = MARGIN + (row + 1) * step
        box = (MARGIN, top + 2, MARGIN + font.size - 2, top + font.size)
        draw.rectangle(box, fill=tuple(round(255 * c) for c in colour))
        text = name if len(name) <= LETTERS else name[: LETTERS - 1] + "…"
        draw.text((MARGIN + font.size + 4, top), text, fill=INK, font=font)
    return np.asarray(image)


def scale(picture: np.ndarray, title: str, low: str, high: str) -> np.ndarray:
    """Draw the colours from the lowest to the highest value into the upper left corner."""
    image, draw, font = _canvas(picture)
    draw.text((MARGIN, MARGIN), title, fill=INK, font=font)
    row = (255 * ramp(np.linspace(0, 1, BAR[0]))).astype(np.uint8)
    bar = np.broadcast_to(row, (BAR[1], BAR[0], 3))
    top = round(MARGIN + font.size + 6)
    image.paste(Image.fromarray(np.ascontiguousarray(bar)), (MARGIN, top))
    draw.text((MARGIN, top + BAR[1] + 2), low, fill=INK, font=font)
    right = MARGIN + BAR[0] - draw.textlength(high, font=font)
    draw.text((right, top + BAR[1] + 2), high, fill=INK, font=font)
    return np.asarray(image)


def caption(picture: np.ndarray, text: str) -> np.ndarray:
    """Write a line into the lower left corner, on a plate that keeps it legible."""
    image, draw, font = _canvas(picture)
    left, top, right, bottom = draw.textbbox((0, 0), text, font=font)
    low = picture.shape[0] - MARGIN
    plate = (MARGIN - 5, low - (bottom - top) - 6, MARGIN + (right - left) + 5, low + 4)
    draw.rounded_rectangle(plate, 4, fill=PLATE)
    draw.text((MARGIN - left, low - bottom - 1), text, fill=INK, font=font)
    return np.asarray(image)


def _canvas(picture: np.ndarray) -> tuple[Image.Image, ImageDraw.ImageDraw, ImageFont.FreeTypeFont]:
    image = Image.fromarray(picture)
    font = ImageFont.load_default(size=max(11, picture.shape[0] // 34))
    if not isinstance(font, ImageFont.FreeTypeFont):
        raise RuntimeError("Pillow was built without FreeType.")
    return image, ImageDraw.Draw(image), font
