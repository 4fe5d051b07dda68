"""Pictures of the second batch, and the colours of its pieces."""

from collections.abc import Sequence

import numpy as np

from corporeal.geometry.srgb import srgb_to_linear
from corporeal.showcase.procedural_textures import TextureImage, colour_ramp, fractal_noise, image_bytes, rgb_of_hex
from corporeal.showcase.prop_mesh import PropMesh
from weighed.pictures import SIZE, band, blank, words


def dyed(mesh: PropMesh, colour: str) -> PropMesh:
    """Colour a piece, so that several of one body keep their own; '#rrggbb' in sRGB."""
    return mesh.tinted(srgb_to_linear(rgb_of_hex(colour) / 255))


def pear_skin(n: int = 512) -> TextureImage:
    """Yellow green with a blush on one side and fine dots."""
    around = np.arange(n)[None] / n
    blush = 0.5 + 0.5 * np.cos(2 * np.pi * (around - 0.3)) + 0.12 * fractal_noise(n, 5, 1.8)
    skin = colour_ramp(blush, "#9caf3a", "#b9bd48", "#cdb04a", "#c4803f")
    return image_bytes(skin * (1 - 0.05 * (fractal_noise(n, 9, 0.2) > 2.0)[..., None]))


def flask(neck: float) -> TextureImage:
    """Brushed steel, a dark band below, the cup apart; ``neck`` as a share of the height."""
    picture, draw = blank("#b4b8bc")
    band(draw, 0.0, 0.05, "#2a2c30")
    band(draw, neck - 0.004, neck + 0.008, "#1c1d20")
    for turn in (0.25, 0.75):
        words(picture, "0.75 L", (turn, 0.12), (0.14, 0.025), "#40444a")
    brushed = 1 + 0.03 * fractal_noise(SIZE, 3, 0.3, (12, 1))[..., None]
    return image_bytes(np.asarray(picture) * brushed)


def tissue(n: int = 1024) -> TextureImage:
    """White embossed paper; fine lines where its windings show, by the run of the profile."""
    v = 1 - np.arange(n)[:, None] / n
    dots = np.sin(2 * np.pi * 40 * np.arange(n)[None] / n) * np.sin(2 * np.pi * 60 * v)
    white = rgb_of_hex("#f2f1ee") + 4 * dots[..., None] + 2 * fractal_noise(n, 4, 0.6)[..., None]
    lines = 8 * np.sin(2 * np.pi * 160 * v) * np.ones((n, n))
    ends = (v < 0.14) | ((v > 0.5) & (v < 0.64))
    return image_bytes(np.where(ends[..., None], rgb_of_hex("#eceae5") + lines[..., None], white))


def wine(heights: Sequence[float]) -> TextureImage:
    """Dark green glass, a paper label, a capsule over the neck.

    Args:
        heights: Of the label's edges and of the capsule's lower edge, as shares of the bottle's.

    """
    low, high, capsule = heights
    picture, draw = blank("#16211a")
    band(draw, capsule, 1.0, "#5a1020")
    middle = (low + high) / 2
    for turn in (0.25, 0.75):
        x = turn * SIZE
        box = [x - 210, (1 - high) * SIZE, x + 210, (1 - low) * SIZE]
        draw.rectangle(box, fill="#efe8d6", outline="#8a6d3b", width=3)
        words(picture, "Merlot", (turn, middle + 0.07), (0.28, 0.07), "#5a1020")
        words(picture, "Red wine", (turn, middle - 0.02), (0.2, 0.035), "#333333")
        words(picture, "75 cl", (turn, middle - 0.10), (0.09, 0.025), "#333333")
    return np.asarray(picture)


def crust(n: int = 512) -> TextureImage:
    """Baked dough, lighter where it cracked."""
    return image_bytes(colour_ramp(0.5 + 0.16 * fractal_noise(n, 12, 1.3), "#a8672c", "#c98a45", "#deb071"))
