"""Pictures of the props: labels, grain, weave, print. Heights are shares, from below."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from corporeal.showcase.procedural_textures import TextureImage, fractal_noise, image_bytes, rgb_of_hex

SIZE = 1024
"""Width and height of a picture [px]."""
Brush = ImageDraw.ImageDraw


def blank(colour: str) -> tuple[Image.Image, Brush]:
    """Begin a picture of one colour."""
    picture = Image.new("RGB", (SIZE, SIZE), colour)
    return picture, ImageDraw.Draw(picture)


def band(draw: Brush, low: float, high: float, colour: str) -> None:
    """Paint all round between two heights."""
    draw.rectangle([0, round((1 - high) * SIZE), SIZE, round((1 - low) * SIZE)], fill=colour)


def words(picture: Image.Image, text: str, at: tuple[float, float], size: tuple[float, float], ink: str) -> None:
    """Write a word into a box about ``at`` (share round, height), ``size`` wide and high."""
    font = ImageFont.load_default(120)
    left, top, right, bottom = font.getbbox(text)
    mask = Image.new("L", (round(right - left) + 8, round(bottom - top) + 8))
    ImageDraw.Draw(mask).text((4 - left, 4 - top), text, font=font, fill=255)
    mask = mask.resize((round(size[0] * SIZE), round(size[1] * SIZE)), Image.Resampling.LANCZOS)
    corner = round(at[0] * SIZE - mask.width / 2), round((1 - at[1]) * SIZE - mask.height / 2)
    picture.paste(Image.new("RGB", mask.size, ink), corner, mask)


def disc(draw: Brush, at: tuple[float, float], radii: tuple[float, float], colour: str) -> None:
    """Paint an ellipse about ``at`` (share round, height)."""
    x, y = at[0] * SIZE, (1 - at[1]) * SIZE
    a, b = radii[0] * SIZE, radii[1] * SIZE
    draw.ellipse([x - a, y - b, x + a, y + b], fill=colour)


def tomato_can(height: float) -> TextureImage:
    """Bare ends with ribs, a paper label with tomatoes; ``height`` of the can [m]."""
    low, high = 0.006 / height, 1 - 0.008 / height
    picture, draw = blank("#b9bcc0")
    band(draw, low, high, "#f3e4c4")
    band(draw, high - 0.10, high, "#2e6b34")
    band(draw, low, low + 0.10, "#2e6b34")
    for turn in (0.0, 0.5):
        words(picture, "TOMATOES", (turn + 0.25, 0.74), (0.38, 0.11), "#a01515")
        words(picture, "CHOPPED", (turn + 0.25, 0.63), (0.2, 0.06), "#2e6b34")
        for u, v, r in ((0.15, 0.34, 0.055), (0.35, 0.34, 0.055), (0.25, 0.36, 0.07)):
            disc(draw, (turn + u, v), (r, 1.9 * r), "#c8201c")
            disc(draw, (turn + u - 0.3 * r, v + 0.7 * r), (0.25 * r, 0.4 * r), "#ee7a6a")
            for tip in (-0.6, 0.0, 0.6):
                x, y = (turn + u) * SIZE, (1 - v - 1.75 * r) * SIZE
                end = (x + tip * r * SIZE, y + 0.55 * r * SIZE)
                draw.line([(x, y), end], fill="#2e6b34", width=11)
    return np.asarray(picture)


def jam_jar(height: float, level: float) -> TextureImage:
    """Red up to ``level`` [m] behind clear glass, and a hand-written label."""
    picture, draw = blank("#bccbc4")
    band(draw, 0.0, 0.004 / height, "#c9d6d2")
    band(draw, 0.004 / height, level / height, "#7a0f1f")
    speck = np.random.default_rng(3)
    for u, v in speck.random((500, 2)):
        colour = "#9c2233" if speck.random() < 0.6 else "#d9a05a"
        disc(draw, (u, 0.06 + v * (level / height - 0.09)), (0.003, 0.004), colour)
    for turn in (0.25, 0.75):
        x, y = turn * SIZE, (1 - 0.42) * SIZE
        draw.rectangle([x - 150, y - 190, x + 150, y + 190], fill="#f7f1e1", outline="#8a6d3b")
        words(picture, "Jam", (turn, 0.50), (0.19, 0.13), "#44301a")
        words(picture, "Strawberry", (turn, 0.36), (0.25, 0.08), "#8f1d2c")
    return np.asarray(picture)


def gingham(squares: int = 16) -> TextureImage:
    """Red and white checks."""
    step = np.arange(SIZE) * squares // SIZE % 2
    sum_ = step[:, None] + step[None]
    shades = np.stack([rgb_of_hex("#f7f4ef"), rgb_of_hex("#dd8080"), rgb_of_hex("#b3202a")])
    return image_bytes(shades[sum_])


def cola_bottle(heights: Sequence[float]) -> TextureImage:
    """Dark up to the level, pale above, a red label round the waist, a red cap.

    Args:
        heights: Of the level, of the label's lower and upper edge and of the cap's lower edge, as
            shares of the bottle's.

    """
    level, low, high, cap = heights
    picture, draw = blank("#b7c6c2")
    band(draw, 0.0, level, "#2a120a")
    band(draw, level - 0.006, level, "#8a5a3a")
    band(draw, low, high, "#c4161c")
    band(draw, cap, 1.0, "#b01218")
    for turn in (0.25, 0.75):
        words(picture, "COLA", (turn, (low + high) / 2), (0.34, 0.62 * (high - low)), "#ffffff")
    return np.asarray(picture)


def dictionary(spine: bool = False) -> TextureImage:
    """Dark red cloth with gold print."""
    picture, draw = blank("#6d1420")
    for inset in (0.05, 0.065):
        a, b = inset * SIZE, (1 - inset) * SIZE
        draw.rectangle([a, a, b, b], outline="#d8b35a", width=5)
    if not spine:
        words(picture, "DICTIONARY", (0.5, 0.72), (0.72, 0.10), "#d8b35a")
        words(picture, "English - French", (0.5, 0.58), (0.5, 0.05), "#d8b35a")
        words(picture, "A - Z", (0.5, 0.25), (0.22, 0.07), "#d8b35a")
    cloth = 1 + 0.03 * fractal_noise(SIZE, 9, 0.4)[..., None]
    return image_bytes(np.asarray(picture).astype(float) * cloth)


def stripes(*colours: str, count: int = 12) -> TextureImage:
    """Upright stripes of woven cloth."""
    column = np.arange(SIZE) * count // SIZE % len(colours)
    cloth = np.stack([rgb_of_hex(c) for c in colours])[column][None].repeat(SIZE, 0)
    thread = 1 + 0.04 * fractal_noise(SIZE, 5, 0.35, (1, 8))[..., None]
    return image_bytes(cloth * thread)


def play_ball() -> TextureImage:
    """Red rubber with moulded rings and a valve."""
    picture, draw = blank("#b3231f")
    for v in (0.2, 0.35, 0.5, 0.65, 0.8):
        band(draw, v - 0.004, v + 0.004, "#7d1512")
    for u in np.arange(8) / 8:
        x = u * SIZE
        draw.rectangle([x - 2, 0, x + 2, SIZE], fill="#7d1512")
    disc(draw, (0.31, 0.57), (0.012, 0.02), "#1c1a1a")
    return image_bytes(np.asarray(picture) + 3 * fractal_noise(SIZE, 8, 0.3)[..., None])
