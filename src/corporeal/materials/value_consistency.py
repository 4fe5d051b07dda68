"""Do a material's chosen values fit each other? Each may lie in its range and the set still be odd.

Within one material the stiffer grade is also the stronger and the denser one. So the yield strain
σ_y/E must lie between what the weak, the usual and the strong grade have, and so must, in foams
and fibrous material, E/ρ² (Gibson and Ashby 1997: E ∝ ρ² in open cells).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from corporeal.core.types import MeasuredRange

CONSISTENCY_RATIO = 1.5
"""By what factor a set may leave what the grades have."""


@dataclass(frozen=True)
class QuantityBond:
    """Two quantities that grow together."""

    strong: str
    by: str
    power: float
    """The ratio strong / by^power is that of the grade."""
    groups: tuple[str, ...]
    """Where it holds; empty: everywhere."""
    odd: str
    """What a ratio that is too small means, in words."""
    odder: str
    """And one that is too large."""


QUANTITY_BONDS = (
    QuantityBond("yield_stress", "young", 1, (), "stiff but weak", "soft but strong"),
    QuantityBond("young", "density", 2, ("foam",), "dense but soft", "light but stiff"),
)


def value_contradictions(
    group: str, ranges: Mapping[str, MeasuredRange], values: Mapping[str, float]
) -> dict[str, str]:
    """Return which chosen values do not fit each other.

    Args:
        group: The material's.
        ranges: Field → measured range.
        values: Field → chosen value [SI].

    Returns:
        Field → why it does not fit, in a clause.

    """
    found = {}
    for bond in QUANTITY_BONDS:
        applies = group in bond.groups or not bond.groups
        if applies and all(f in values and f in ranges for f in (bond.strong, bond.by)):
            clause = _clause(bond, ranges, values)
            found |= {bond.strong: clause} if clause else {}
    return found


def _clause(
    bond: QuantityBond, ranges: Mapping[str, MeasuredRange], values: Mapping[str, float]
) -> str:
    strong, by = ranges[bond.strong], ranges[bond.by]
    ratio = values[bond.strong] / values[bond.by] ** bond.power
    grades = [
        getattr(strong, end) / getattr(by, end) ** bond.power for end in ("low", "typical", "high")
    ]
    low, high = min(grades) / CONSISTENCY_RATIO, max(grades) * CONSISTENCY_RATIO
    if low <= ratio <= high:
        return ""
    kind = bond.odd if ratio < low else bond.odder
    power = f"^{bond.power:g}" if bond.power != 1 else ""
    return (
        f"{kind}: {bond.strong}/{bond.by}{power} is {ratio:.2g}, and its grades have "
        f"{min(grades):.2g} to {max(grades):.2g} (SI)"
    )
