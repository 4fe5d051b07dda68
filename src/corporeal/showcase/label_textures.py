"""Drawn pictures: the can's label, the ball's stripes, the vase's glaze, the book's cover."""

from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw

from corporeal.showcase.procedural_textures import TextureImage, fractal_noise, image_bytes

ImageBrush = ImageDraw.ImageDraw
LabelOutline = list[tuple[float, float]]
CITRUS_CENTRES_U = (0.15, 0.48, 0.81)
"""Where the slices sit round the can, in u."""


def can_label(n: int = 512) -> TextureImage:
    """Draw waves, citrus slices and bubbles; u round the can, v up its 115 mm."""
    top, bottom = 1 - 0.0985 / 0.115, 1 - 0.0118 / 0.115
    u = np.linspace(0, 1, 240)

    def paint(d: ImageBrush, s: int) -> None:
        def y(t: float) -> float:
            return (top + (bottom - top) * t) * s

        def wave(level: float, sway: np.ndarray) -> LabelOutline:
            return [(a * s, y(level + b)) for a, b in zip(u, sway, strict=True)]

        d.rectangle([0, y(0), s, y(1)], fill="#0c8c86")
        for level, colour in ((0.06, "#f2643d"), (0.035, "#fff3d6")):
            crest = wave(level, 0.02 * np.sin(6 * np.pi * u))
            d.polygon([(0, y(0)), *crest, (s, y(0))], fill=colour)
        for level, colour in ((0.72, "#fff3d6"), (0.80, "#ffb52e"), (0.86, "#f2643d")):
            crest = wave(level, 0.045 * np.sin(4 * np.pi * u + 9 * level))
            d.polygon([(0, y(1)), *crest, (s, y(1))], fill=colour)
        for cx in CITRUS_CENTRES_U:
            _citrus(d, cx * s, y(0.40), 0.125 * s)
        for x, t, r in _bubbles(90):
            _oval(d, (x * s, y(t)), 0.55 * r * s, r * s, "#8fe0d3")

    return _draw_label(n, "#c9ccd0", paint)


def ball_stripes(n: int = 512) -> TextureImage:
    """Latitude bands: red, cream, blue."""

    def paint(d: ImageBrush, s: int) -> None:
        bands = (0.30, 0.70, "#f6ead2"), (0.38, 0.62, "#1f5fae"), (0.475, 0.525, "#f6ead2")
        for a, b, colour in bands:
            d.rectangle([0, a * s, s, b * s], fill=colour)

    return _draw_label(n, "#d8342c", paint)


def vase_glaze(n: int = 512) -> TextureImage:
    """White glaze, blue bands, petals and dots; v along the profile, the outside comes first."""
    blue, pale = "#27509b", "#7fa3d6"
    bands = (
        (0.055, 0.075, blue),
        (0.385, 0.392, blue),
        (0.40, 0.415, blue),
        (0.10, 0.105, pale),
        (0.455, 0.462, blue),
        (0.49, 0.5, pale),
    )
    dots = (0.375, 0.008, blue), (0.34, 0.006, pale), (0.12, 0.007, blue)
    turn = np.linspace(0, 2 * np.pi, 60)

    def petal(u: float, wide: float, tall: float) -> LabelOutline:
        x = u + wide * 0.033 * np.sin(turn) * np.sin(turn / 2) ** 0.8
        y = 0.235 - tall * 0.115 * np.cos(turn)
        return list(zip(x, 1 - y, strict=True))

    def paint(d: ImageBrush, s: int) -> None:
        for low, high, colour in bands:
            d.rectangle([0, (1 - high) * s, s, (1 - low) * s], fill=colour)
        for k in range(12):
            for wide, tall, colour in ((1.0, 1.0, blue), (0.5, 0.72, pale)):
                outline = petal((k + 0.5) / 12, wide, tall)
                d.polygon([(a * s, b * s) for a, b in outline], fill=colour)
            for v, r, colour in dots:
                _oval(d, (k / 12 * s, (1 - v) * s), r * s, 0.6 * r * s, colour)

    glaze = _draw_label(n, "#f4f1e8", paint).astype(float)
    return image_bytes(glaze + 2.5 * fractal_noise(n, 3)[..., None])


def book_cover(n: int = 512) -> TextureImage:
    """Cloth with a gold frame, a sun over hills."""
    gold = "#d9ab4e"
    u = np.linspace(0.085, 0.915, 80)

    def paint(d: ImageBrush, s: int) -> None:
        for inset, width in ((0.06, s // 70), (0.085, s // 220)):
            d.rectangle([inset * s, inset * s, (1 - inset) * s, (1 - inset) * s], None, gold, width)
        _oval(d, (0.50 * s, 0.40 * s), 0.16 * s, 0.16 * s, "#e8b95a")
        for k, colour in enumerate(("#b9402f", "#8d2c2a", "#5f1f25")):
            top = 0.52 + 0.11 * k + 0.05 * np.sin(7 * u + 2 * k)
            hill = [(a * s, b * s) for a, b in zip(u, top, strict=True)]
            d.polygon([*hill, (0.915 * s, 0.915 * s), (0.085 * s, 0.915 * s)], fill=colour)
        d.rectangle([0.25 * s, 0.14 * s, 0.75 * s, 0.165 * s], fill=gold)
        d.rectangle([0.36 * s, 0.185 * s, 0.64 * s, 0.198 * s], fill=gold)

    cloth = 1 + 0.03 * fractal_noise(n, 9, 0.4)[..., None]
    return image_bytes(_draw_label(n, "#243a5e", paint).astype(float) * cloth)


def _draw_label(n: int, background: str, paint: Callable[[ImageBrush, int], None]) -> TextureImage:
    """Paint at twice the size, then shrink: clean edges."""
    picture = Image.new("RGB", (2 * n, 2 * n), background)
    paint(ImageDraw.Draw(picture), 2 * n)
    return np.asarray(picture.resize((n, n), Image.Resampling.LANCZOS))


def _oval(
    d: ImageBrush, centre: tuple[float, float], wide: float, tall: float, colour: str
) -> None:
    x, y = centre
    d.ellipse([x - wide, y - tall, x + wide, y + tall], fill=colour)


def _bubbles(count: int) -> list[tuple[float, float, float]]:
    """Centres in (u, share of the label's height) and radii of bubbles beside the slices."""
    rng = np.random.default_rng(4)
    x, t, r = rng.random(count), 0.12 + rng.random(count) * 0.55, rng.random(count) ** 2
    beside = np.abs(x[:, None] - np.array(CITRUS_CENTRES_U)).min(1) > 0.085
    return list(zip(x[beside], t[beside], 0.003 + 0.009 * r[beside], strict=True))


def _citrus(d: ImageBrush, cx: float, cy: float, r: float) -> None:
    """Draw a slice with eight segments, narrow because the label is stretched round the can."""
    for k, colour in ((1, "#f59a1f"), (0.9, "#fff3d6"), (0.82, "#ffb52e")):
        _oval(d, (cx, cy), 0.55 * k * r, k * r, colour)
    for a in np.arange(0, np.pi, np.pi / 4):
        dx, dy = 0.47 * r * np.cos(a), 0.86 * r * np.sin(a)
        d.line([cx - dx, cy - dy, cx + dx, cy + dy], fill="#fff3d6", width=int(r / 11))
    _oval(d, (cx, cy), 0.55 * 0.14 * r, 0.14 * r, "#fff3d6")
