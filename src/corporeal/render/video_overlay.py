"""Overlays of videos: colour bar and time."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from corporeal.render.colours import Colour, ramp_colours
from corporeal.render.figures import MAX_LEGEND_CHARACTERS, MAX_LEGEND_ENTRIES

TEXT_COLOUR = (34, 34, 34)
PLATE_COLOUR = (244, 241, 236)
MARGIN_PX = 12
"""[px]"""
BAR_SIZE_PX = (120, 10)
"""[px]"""


def draw_names(picture: np.ndarray, title: str, labels: Sequence[str], colours: Sequence[Colour]) -> np.ndarray:
    """Write names beside their colours into the upper left corner, each pair once."""
    image, draw, font = _canvas(picture)
    step = font.size + 5
    draw.text((MARGIN_PX, MARGIN_PX), title, fill=TEXT_COLOUR, font=font)
    entries = list(dict.fromkeys(zip(labels, colours, strict=True)))
    for row, (name, colour) in enumerate(entries[:MAX_LEGEND_ENTRIES]):
        top = MARGIN_PX + (row + 1) * step
        box = (MARGIN_PX, top + 2, MARGIN_PX + font.size - 2, top + font.size)
        draw.rectangle(box, fill=tuple(round(255 * c) for c in colour))
        text = name if len(name) <= MAX_LEGEND_CHARACTERS else name[: MAX_LEGEND_CHARACTERS - 1] + "…"
        draw.text((MARGIN_PX + font.size + 4, top), text, fill=TEXT_COLOUR, font=font)
    return np.asarray(image)


def draw_scale(picture: np.ndarray, title: str, low: str, high: str) -> np.ndarray:
    """Draw the colours from the lowest to the highest value into the upper left corner."""
    image, draw, font = _canvas(picture)
    draw.text((MARGIN_PX, MARGIN_PX), title, fill=TEXT_COLOUR, font=font)
    row = (255 * ramp_colours(np.linspace(0, 1, BAR_SIZE_PX[0]))).astype(np.uint8)
    bar = np.broadcast_to(row, (BAR_SIZE_PX[1], BAR_SIZE_PX[0], 3))
    top = round(MARGIN_PX + font.size + 6)
    image.paste(Image.fromarray(np.ascontiguousarray(bar)), (MARGIN_PX, top))
    draw.text((MARGIN_PX, top + BAR_SIZE_PX[1] + 2), low, fill=TEXT_COLOUR, font=font)
    right = MARGIN_PX + BAR_SIZE_PX[0] - draw.textlength(high, font=font)
    draw.text((right, top + BAR_SIZE_PX[1] + 2), high, fill=TEXT_COLOUR, font=font)
    return np.asarray(image)


def draw_caption(picture: np.ndarray, text: str) -> np.ndarray:
    """Write a line into the lower left corner, on a plate that keeps it legible."""
    image, draw, font = _canvas(picture)
    left, top, right, bottom = draw.textbbox((0, 0), text, font=font)
    low = picture.shape[0] - MARGIN_PX
    plate = (MARGIN_PX - 5, low - (bottom - top) - 6, MARGIN_PX + (right - left) + 5, low + 4)
    draw.rounded_rectangle(plate, 4, fill=PLATE_COLOUR)
    draw.text((MARGIN_PX - left, low - bottom - 1), text, fill=TEXT_COLOUR, font=font)
    return np.asarray(image)


def _canvas(picture: np.ndarray) -> tuple[Image.Image, ImageDraw.ImageDraw, ImageFont.FreeTypeFont]:
    image = Image.fromarray(picture)
    font = ImageFont.load_default(size=max(11, picture.shape[0] // 34))
    if not isinstance(font, ImageFont.FreeTypeFont):
        raise RuntimeError("Pillow was built without FreeType.")
    return image, ImageDraw.Draw(image), font
