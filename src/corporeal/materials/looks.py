"""What liquids look like where nobody drew them."""

import numpy as np

from corporeal.geometry.srgb import linear
from corporeal.types import Finish

LOOKS: dict[str, tuple[str, float]] = {
    "water": ("#5b9fd0", 0.55),
    "oil": ("#e2bb3a", 0.75),
    "olive_oil": ("#b7a52a", 0.75),
    "castor_oil": ("#e3cf7a", 0.7),
    "motor_oil": ("#6b4a16", 0.9),
    "honey": ("#d98a12", 1.0),
    "maple_syrup": ("#8a4513", 0.95),
    "corn_syrup": ("#e4c87a", 0.75),
    "chocolate_syrup": ("#3b2114", 1.0),
    "ketchup": ("#b3170f", 1.0),
    "sauce": ("#a8401c", 1.0),
    "mayonnaise": ("#f3ead0", 1.0),
    "toothpaste": ("#eef3f4", 1.0),
    "milk": ("#f6f2e8", 1.0),
    "dairy_cream": ("#f4ecd8", 1.0),
}
"""Material → sRGB and opacity [-]."""
PLAIN = ("#b9a88c", 1.0)
"""Of all others."""
WET = 0.12
"""Roughness of a liquid's surface [-]."""


def finish_of(name: str) -> Finish:
    """Return how the surface of some contents looks."""
    written, opacity = LOOKS.get(name, PLAIN)
    rgb = np.array([int(written[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    red, green, blue = (float(x) for x in linear(rgb))
    return Finish(
        name,
        (red, green, blue, opacity),
        roughness=WET if name in LOOKS else 0.9,
        alpha_mode="BLEND" if opacity < 1.0 else "OPAQUE",
    )
