"""Colour scales of materials, laws, objects and numbers, equal in all scenes."""

import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Law
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

COLOUR_HASH_SALT = "s41605"
"""Chosen so that materials which meet in the showcase lie far apart."""
HUE_COUNT = 30
LIGHTNESS_CHROMA_TIERS = ((0.52, 0.115), (0.66, 0.125), (0.79, 0.105), (0.40, 0.085))
"""Lightness and chroma of OKLCH."""
MIN_OKLAB_DISTANCE = 0.08
"""Colours nearer than this in OKLab are taken for one another."""
MAX_COLOUR_TRIES = 60
BRIGHT_SCHEME = ("#4477aa", "#228833", "#66ccee", "#ccbb44", "#aa3377", "#ee6677")
"""Tol's bright scheme, without its grey."""
LAW_COLOURS = {law: (CONSTITUTIVE_LAWS[law].name, BRIGHT_SCHEME[law.value % len(BRIGHT_SCHEME)]) for law in Law}
"""What each law is called in figures, and its colour."""
OBJECT_COLOURS = (
    "#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#ee8866", "#77aadd",
    "#44bb99", "#ffaabb", "#999933", "#882255",
)  # fmt: skip
"""By place in the scene, then again from the start."""

Colour = tuple[float, float, float]


def colour_from_hex(text: str) -> Colour:
    """Read ``#rrggbb`` as sRGB in [0, 1]."""
    r, g, b = (int(text[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return r, g, b


def distinct_colours(names: Sequence[str]) -> list[Colour]:
    """Give every name its own colour; the later of two that look alike takes another one.

    Shaded surfaces differ in lightness by themselves, so that it counts half.
    """
    taken: dict[str, tuple[float, float, float]] = {}
    for name in dict.fromkeys(names):
        tries = [_own(name), *(_own(f"{name} {k}") for k in range(1, MAX_COLOUR_TRIES))]
        far = [min((_oklab_distance(own, other) for other in taken.values()), default=1.0) for own in tries]
        clear = next((k for k, d in enumerate(far) if d >= MIN_OKLAB_DISTANCE), int(np.argmax(far)))
        taken[name] = tries[clear]
    return [colour_from_oklch(*taken[name]) for name in names]


def _own(name: str) -> tuple[float, float, float]:
    """Lightness, chroma and hue [rad] of a name."""
    number = int.from_bytes(hashlib.sha256(f"{COLOUR_HASH_SALT} {name}".encode()).digest()[:6], "big")
    lightness, chroma = LIGHTNESS_CHROMA_TIERS[number % len(LIGHTNESS_CHROMA_TIERS)]
    return (lightness, chroma, 2 * np.pi * ((number // len(LIGHTNESS_CHROMA_TIERS)) % HUE_COUNT) / HUE_COUNT)


def _oklab_distance(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    """How far apart two colours look."""
    (a, b), (p, q) = ((c * np.cos(h), c * np.sin(h)) for _, c, h in (one, other))
    return float(np.hypot((one[0] - other[0]) / 2, np.hypot(a - p, b - q)))


def colour_from_oklch(lightness: float, chroma: float, hue: float) -> Colour:
    """OKLCH to sRGB in [0, 1] (Ottosson 2020, "A perceptual color space for image processing")."""
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    lms = np.array(
        [
            lightness + 0.3963377774 * a + 0.2158037573 * b,
            lightness - 0.1055613458 * a - 0.0638541728 * b,
            lightness - 0.0894841775 * a - 1.2914855480 * b,
        ]
    )
    rgb = (
        np.array(
            [
                [4.0767416621, -3.3077115913, 0.2309699292],
                [-1.2684380046, 2.6097574011, -0.3413193965],
                [-0.0041960863, -0.7034186147, 1.7076147010],
            ]
        )
        @ lms**3
    )
    rgb = np.clip(rgb, 0, 1)
    r, g, b = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    return float(r), float(g), float(b)


def turbo(values: Sequence[float], log: bool) -> tuple[Float[np.ndarray, "N 3"], float, float]:
    """Colours from lowest to highest (Mikhailov 2019), and those two; equal values: the middle."""
    x = np.asarray(values, dtype=float)
    low, high = float(x.min()), float(x.max())
    if log:
        x = np.log(np.maximum(x, 1e-300))
    span = x.max() - x.min()
    share = (x - x.min()) / span if span > 1e-9 * max(abs(x.max()), 1e-30) else x * 0 + 0.5
    return ramp_colours(share), low, high


def ramp_colours(share: Float[np.ndarray, "*N"]) -> Float[np.ndarray, "*N 3"]:
    """Colours of shares from 0, the lowest, to 1, the highest: turbo without its dark ends."""
    table = _turbo_table()
    place = (0.04 + 0.92 * np.clip(np.asarray(share), 0, 1)) * len(table)
    return table[place.astype(int)]


@cache
def _turbo_table() -> Float[np.ndarray, "256 3"]:
    """Mikhailov's 256 colours, sRGB in [0, 1]; as Matplotlib's, which takes long to import."""
    return np.loadtxt(Path(__file__).with_name("turbo.csv"), delimiter=",")
