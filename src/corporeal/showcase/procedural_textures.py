"""Small tileable textures, [H W 3] uint8 sRGB: filtered noise, wood, weave, bark, leaf, glaze."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

TextureImage = UInt8[np.ndarray, "H W 3"]


def fractal_noise(
    n: int, seed: int, falloff: float = 1.6, stretch: tuple[float, float] = (1, 1)
) -> Float[np.ndarray, "n n"]:
    """Tileable fractal noise, mean 0 and variance 1; ``stretch`` makes it longer along (u, v)."""
    frequency = np.fft.fftfreq(n, 1 / n)
    ky, kx = np.meshgrid(frequency, frequency, indexing="ij")
    k = np.hypot(kx * stretch[0], ky * stretch[1])
    white = np.fft.fft2(np.random.default_rng(seed).standard_normal((n, n)))
    x = np.fft.ifft2(white / np.maximum(k, 1.5) ** falloff * (k > 0)).real
    return x / x.std()


def rgb_of_hex(hex_colour: str) -> Float[np.ndarray, "3"]:
    """'#rrggbb' to three numbers in [0, 255]."""
    return np.array([int(hex_colour[i : i + 2], 16) for i in (1, 3, 5)], float)


def colour_ramp(x: np.ndarray, *colours: str) -> np.ndarray:
    """Map x in [0, 1] through evenly spaced colours."""
    stops = np.linspace(0, 1, len(colours))
    c = np.array([rgb_of_hex(h) for h in colours])
    return np.stack([np.interp(x, stops, c[:, i]) for i in range(3)], -1)


def image_bytes(x: np.ndarray) -> TextureImage:
    """Round to bytes."""
    return np.clip(np.round(x), 0, 255).astype(np.uint8)


def speckle_texture(n: int, seed: int, *colours: str, falloff: float = 0.8, contrast: float = 0.22) -> TextureImage:
    """Plain fractal noise through a ramp: sand, soil, terracotta, mud."""
    return image_bytes(colour_ramp(0.5 + contrast * fractal_noise(n, seed, falloff), *colours))


def swirl_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Marbled rubber."""
    return image_bytes(colour_ramp(0.5 + 0.25 * np.sin(3.0 * fractal_noise(n, seed, 2.4, (2, 1))), *colours))


def wood_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Grain along u: warped rings and fine fibres."""
    v = np.arange(n)[:, None] / n
    rings = np.sin(2 * np.pi * (5 * v + 0.55 * fractal_noise(n, seed, 2.2, (9, 1))))
    fibre = fractal_noise(n, seed + 1, 0.9, (24, 1))
    return image_bytes(colour_ramp(0.5 + 0.20 * rings + 0.13 * fibre, *colours))


def weave_texture(n: int, seed: int, *colours: str, threads: int = 32) -> TextureImage:
    """Plain weave with slubs."""
    t = np.arange(n) * 2 * np.pi * threads / n
    over = np.sin(t / 2)[:, None] * np.sin(t / 2)[None]
    bump = np.where(over > 0, np.abs(np.cos(t / 2))[:, None], np.abs(np.cos(t / 2))[None])
    weft, warp = fractal_noise(n, seed, 0.35, (8, 1)), fractal_noise(n, seed + 1, 0.35, (1, 8))
    slub = 0.085 * weft + 0.085 * warp + 0.012 * fractal_noise(n, seed + 2, 1.5)
    return image_bytes(colour_ramp(0.42 + 0.30 * (bump - 0.5) + slub, *colours))


def bark_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Ridges along v."""
    ridges = 0.2 * fractal_noise(n, seed, 1.2, (1, 5)) + 0.1 * fractal_noise(n, seed + 1, 0.8)
    return image_bytes(colour_ramp(0.5 + ridges, *colours))


def leaf_texture(n: int, *colours: str) -> TextureImage:
    """Pale midrib and side veins; u from base to tip, v across."""
    v, u = np.meshgrid(np.abs(np.linspace(-1, 1, n)), np.linspace(0, 1, n), indexing="ij")
    veins = np.exp(-((np.sin(np.pi * 7 * (u - 0.35 * v)) / 0.18) ** 2)) * (v > 0.03)
    rib = (np.exp(-((v / 0.06) ** 2)) + 0.35 * veins)[..., None]
    blade = colour_ramp(0.35 + 0.25 * v + 0.08 * fractal_noise(n, 5), *colours)
    return image_bytes(blade + 38 * rib * [1, 1, 0.6])


def pages_texture(n: int = 256) -> TextureImage:
    """Edges of paper, one line per leaf."""
    line = np.random.default_rng(1).standard_normal(n)[:, None, None]
    return image_bytes(rgb_of_hex("#efe6d0") + 9 * line + 3 * fractal_noise(n, 2, 0.5, (12, 1))[..., None])


def mug_glaze_texture(n: int = 512) -> TextureImage:
    """Below v = 0.5 the outside from foot to rim, above it the inside from rim to floor."""
    t = (np.arange(n) + 0.5) / n
    v, u = np.meshgrid(1 - t, t, indexing="ij")
    edge = 0.115 + 0.016 * np.sin(4 * np.pi * u) + 0.008 * np.sin(10 * np.pi * u + 1)
    foot, outside = (v < edge)[..., None], (v < 0.478)[..., None]
    x = np.where(foot, rgb_of_hex("#c19a76"), np.where(outside, rgb_of_hex("#2f7f86"), rgb_of_hex("#f3eee0")))
    line = np.exp(-(((v - edge - 0.006) / 0.006) ** 2))[..., None]
    return image_bytes(x * (1 - 0.25 * line) + 5 * fractal_noise(n, 4, 1.0)[..., None] * foot)


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


def _oval(d: ImageBrush, centre: tuple[float, float], wide: float, tall: float, colour: str) -> None:
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
