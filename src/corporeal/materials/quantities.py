"""The numbers a material may have, their units in data files, and their SI unit in code."""

from dataclasses import dataclass
from math import pi

from corporeal.core.errors import UserError


@dataclass(frozen=True)
class Quantity:
    """One number of a material."""

    field: str
    """Its name in ``types.Material``."""
    words: str
    unit: str
    """SI unit, "-" when it has none."""
    low: float
    """No real material lies below [SI]: a lint bound that catches unit slips."""
    high: float
    """No real material lies above [SI]."""


QUANTITIES = {
    q.field: q
    for q in (
        Quantity("young_pa", "Young's modulus", "Pa", 1e2, 1.2e12),
        Quantity("poisson", "Poisson's ratio", "-", -0.99, 0.5),
        Quantity("density", "Density", "kg/m³", 1.0, 2.3e4),
        Quantity("yield_stress", "Yield stress", "Pa", 1e2, 5e9),
        Quantity("strength", "Strength", "Pa", 1e3, 1e10),
        Quantity("hardening", "Hardening modulus", "Pa", 0.0, 1e10),
        Quantity("friction_angle", "Friction angle", "rad", 0.0, pi / 3),
        Quantity("cohesion", "Cohesion", "Pa", 0.0, 1e6),
        Quantity("friction", "Sliding friction", "-", 0.0, 2.0),
        Quantity("restitution", "Restitution", "-", 0.0, 1.0),
        Quantity("loss", "Loss factor", "-", 0.0, 2.0),
        Quantity("shell_thickness", "Wall thickness", "m", 1e-6, 0.2),
        Quantity("viscosity", "Viscosity", "Pa·s", 1e-4, 1e4),
        Quantity("consistency", "Consistency", "Pa·sⁿ", 1e-4, 1e4),
        Quantity("flow_index", "Flow index", "-", 0.1, 2.0),
        Quantity("yield_shear", "Yield shear stress", "Pa", 1e-3, 1e5),
        Quantity("strength_local", "Local strength", "Pa", 1e5, 1e10),
    )
}

KEY_STEM_OF_FIELD = {"yield_stress": "yield", "young_pa": "young"}
"""Field → the first part of its data key, where that is another word: a key ends in the unit of its file."""
FIELD_OF_KEY_STEM = {KEY_STEM_OF_FIELD.get(field, field): field for field in QUANTITIES}
SI_OF_KEY_UNIT = {
    "GPa": ("Pa", 1e9),
    "MPa": ("Pa", 1e6),
    "kPa": ("Pa", 1e3),
    "Pa": ("Pa", 1.0),
    "kg_m3": ("kg/m³", 1.0),
    "g_cm3": ("kg/m³", 1e3),
    "deg": ("rad", pi / 180.0),
    "mm": ("m", 1e-3),
    "Pa_s": ("Pa·s", 1.0),
    "mPa_s": ("Pa·s", 1e-3),
    "Pa_sn": ("Pa·sⁿ", 1.0),
}


def question_name(field: str) -> str:
    """Name a field in questions to a language model, and so in recorded answers: the unit is with the range there."""
    return "young" if field == "young_pa" else field


def parse_quantity_key(key: str) -> tuple[str, float]:
    """Read a data key such as ``"young_GPa"``: the field it means and the factor to SI.

    Raises:
        UserError: The key names no quantity, or the unit is not one of that quantity's.
    """
    if key in QUANTITIES and QUANTITIES[key].unit == "-":
        return key, 1.0
    for suffix, (unit, factor) in SI_OF_KEY_UNIT.items():
        stem = key.removesuffix(f"_{suffix}")
        field = FIELD_OF_KEY_STEM.get(stem)
        if stem != key and field is not None and QUANTITIES[field].unit == unit:
            return field, factor
    raise UserError(f"Unknown quantity {key!r}. The unit is in the key: {', '.join(example_keys())}.")


def example_keys() -> list[str]:
    """One valid key per quantity, as the default library spells it."""
    return [
        "young_GPa",
        "poisson",
        "density_kg_m3",
        "yield_MPa",
        "strength_MPa",
        "hardening_GPa",
        "friction_angle_deg",
        "cohesion_kPa",
        "friction",
        "restitution",
        "loss",
        "shell_thickness_mm",
        "viscosity_Pa_s",
        "consistency_Pa_sn",
        "flow_index",
        "yield_shear_Pa",
        "strength_local_MPa",
    ]
