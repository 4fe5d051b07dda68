"""Default appearance of materials without textures."""

import numpy as np

from corporeal.core.types import Finish
from corporeal.geometry.srgb import srgb_to_linear

LIQUID_COLOURS: dict[str, tuple[str, float]] = {
    "liquid": ("#8fb3c8", 0.7),
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
    "molasses": ("#2f1a0d", 1.0),
    "jam": ("#8e1f2b", 1.0),
}
"""Material or group → sRGB and opacity [-]."""
METAL_COLOURS: dict[str, str] = {
    "metal": "#b4b7bb",
    "gold": "#dcae45",
    "copper": "#c07a52",
    "brass": "#c2a352",
    "bronze": "#a27c48",
    "lead": "#85888d",
    "cast-iron": "#6a6b6d",
}
"""Material or group → sRGB of its reflection."""
SOLID_COLOURS: dict[str, str] = {
    "mineral": "#b7b1a6",
    "glass": "#c5dde0",
    "ceramic": "#e4ddd0",
    "porcelain": "#f1efe9",
    "terracotta": "#b5643c",
    "brick": "#9c4a35",
    "granite": "#8d8782",
    "marble": "#e6e2db",
    "gypsum": "#ece9e2",
    "ice": "#cfe6ee",
    "granular": "#c2a878",
    "gravel": "#8f8b85",
    "soil_clay": "#7b5a3c",
    "mud": "#5d4632",
    "potting_soil": "#3d2c20",
    "snow": "#f2f5f7",
    "soft": "#c7684e",
    "fibrous": "#bd8f5f",
    "leaves-flowers": "#5d8a3a",
    "leaf_tissue": "#5d8a3a",
    "paper": "#efeae0",
    "leather": "#7a4a2b",
    "cotton": "#e7e2d6",
    "synthetic_textile": "#6d7fa3",
    "felt": "#7d8f5b",
    "foam": "#e8dcae",
    "packaging_foam": "#f2f2ee",
    "foam_beads": "#f4f4f1",
    "polymer": "#4f7fb5",
    "elastomer": "#a8433a",
    "food": "#c49a62",
    "apple": "#b23a2e",
    "potato": "#b99a6b",
    "meat": "#a4574f",
    "bulk": "#a9834f",
}
"""Material or group → sRGB."""
DEFAULT_COLOUR = "#b9a88c"
"""sRGB of all others."""
LIQUID_ROUGHNESS = 0.12
"""Roughness of a liquid's surface [-]."""
METAL_ROUGHNESS = 0.35
"""Roughness of a metal [-]."""
MATT_ROUGHNESS = 0.9
"""Roughness of all others [-]."""


def default_finish(*names: str) -> Finish:
    """Return how the surface of a material looks, given its name and those of its kin.

    The first name that is known decides; of none, the surface is plain.
    """
    for name in names:
        if name in LIQUID_COLOURS:
            written, opacity = LIQUID_COLOURS[name]
            mode = "BLEND" if opacity < 1.0 else "OPAQUE"
            return Finish(names[0], _colour(written, opacity), roughness=LIQUID_ROUGHNESS, alpha_mode=mode)
        if name in METAL_COLOURS:
            shine = _colour(METAL_COLOURS[name])
            return Finish(names[0], shine, metallic=1.0, roughness=METAL_ROUGHNESS)
        if name in SOLID_COLOURS:
            return Finish(names[0], _colour(SOLID_COLOURS[name]), roughness=MATT_ROUGHNESS)
    return Finish(names[0], _colour(DEFAULT_COLOUR), roughness=MATT_ROUGHNESS)


def _colour(written: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    """Return linear RGBA of an sRGB colour as "#rrggbb"."""
    rgb = np.array([int(written[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    red, green, blue = (float(x) for x in srgb_to_linear(rgb))
    return red, green, blue, opacity
