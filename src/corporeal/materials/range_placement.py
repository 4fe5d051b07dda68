"""Which values of a part can be placed in their ranges, and what a placement comes to.

Do a material's chosen values fit each other? Each may lie in its range and the set still be odd.

Within one material the stiffer grade is also the stronger and the denser one. So the yield strain
σ_y/E must lie between what the weak, the usual and the strong grade have, and so must, in foams
and fibrous material, E/ρ² (Gibson and Ashby 1997: E ∝ ρ² in open cells).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import UnknownChoiceError
from corporeal.core.types import WALLED_KINDS, MeasuredRange, PartDescription, RangePlacement
from corporeal.materials.library import find_material, library, library_counterpart
from corporeal.materials.library_entry import MaterialEntry
from corporeal.materials.material_candidates import QuantityChoice, fraction_of, quantity_choice, value_at_fraction
from corporeal.materials.quantities import question_name

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
    QuantityBond("yield_stress", "young_pa", 1, (), "stiff but weak", "soft but strong"),
    QuantityBond("young_pa", "density", 2, ("foam",), "dense but soft", "light but stiff"),
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


def _clause(bond: QuantityBond, ranges: Mapping[str, MeasuredRange], values: Mapping[str, float]) -> str:
    strong, by = ranges[bond.strong], ranges[bond.by]
    ratio = values[bond.strong] / values[bond.by] ** bond.power
    grades = [getattr(strong, end) / getattr(by, end) ** bond.power for end in ("low", "typical", "high")]
    low, high = min(grades) / CONSISTENCY_RATIO, max(grades) * CONSISTENCY_RATIO
    if low <= ratio <= high:
        return ""
    kind = bond.odd if ratio < low else bond.odder
    power = f"^{bond.power:g}" if bond.power != 1 else ""
    return (
        f"{kind}: {question_name(bond.strong)}/{question_name(bond.by)}{power} is {ratio:.2g}, and its grades have "
        f"{min(grades):.2g} to {max(grades):.2g} (SI)"
    )


PLACED_FIELDS = ("young_pa", "poisson", "density", "yield_stress", "friction_angle", "cohesion", "shell_thickness")
"""Fields of ``Material`` that use and treatment decide; the others keep their usual value."""
MASS_FIELDS = ("density", "shell_thickness")
"""Those of them that a mass hangs on."""
PlacementSource = Literal["model", "recording"]
CONTENTS_DENSITY_FIELD = "contents_density"
"""The density of what is inside: of the contents' material, placed with the wall's values."""


def library_entry(name: str, library_name: str = "default") -> MaterialEntry:
    """Look a material up; a smaller library gives its counterpart."""
    entries = library(library_name)
    return entries[name] if name in entries else library_counterpart(find_material(name), library_name)


def contents_entry(name: str, library_name: str = "default") -> MaterialEntry:
    """Look up what is inside: a library that says nothing of it leaves it to the default one."""
    known = library(library_name)
    return known[name] if name in known else find_material(name)


def library_spelling(name: str, library_name: str, offered: list[str]) -> str | None:
    """Return the library's spelling of a name; None: not offered."""
    try:
        found = find_material(name, library_name).name
    except UnknownChoiceError:
        return None
    return found if found in offered else None


def quantity_choices(
    words: PartDescription, library_name: str = "default", weighing: bool = False
) -> dict[str, QuantityChoice]:
    """Return the open quantities of a part, which a model may place."""
    if words.material is None:
        return {}
    entry = library_entry(words.material, library_name)
    walled = words.structure in WALLED_KINDS and words.thickness is None
    placed = MASS_FIELDS if weighing else PLACED_FIELDS
    fields = [f for f in placed if f in entry.ranges and (walled or f != "shell_thickness")]
    offered = {f: quantity_choice(entry.name, f, entry.ranges[f]) for f in fields if f not in words.values}
    if words.contents is not None:
        inside = contents_entry(words.contents, library_name)
        offered[CONTENTS_DENSITY_FIELD] = quantity_choice(inside.name, "density", inside.ranges["density"])
    return {f: c for f, c in offered.items() if c.range.low < c.range.high}


@dataclass(frozen=True)
class QuantityJudgement:
    """Placement of a quantity, with a reason."""

    number: float
    """A fraction of the range, or a value in the unit that was offered."""
    reason: str


def placements_from_fractions(
    judged: Mapping[str, QuantityJudgement], by: PlacementSource, offered: Mapping[str, QuantityChoice]
) -> dict[str, RangePlacement]:
    """Take fractions, each with its reason, as they are."""
    return {f: RangePlacement(j.number, by, j.reason) for f, j in judged.items() if f in offered}


def placements_from_values(
    judged: Mapping[str, QuantityJudgement], by: PlacementSource, offered: Mapping[str, QuantityChoice]
) -> dict[str, RangePlacement]:
    """Find the place of values, each in the unit that was offered and with its reason."""
    placed = {}
    for field, judgement in judged.items():
        r, value = offered[field].range, judgement.number * offered[field].factor
        inside = min(max(value, r.low), r.high)  # a bound's last digit
        placed[field] = RangePlacement(fraction_of(r, inside), by, judgement.reason)
    return placed


def usual_placements(offered: Mapping[str, QuantityChoice], why: str) -> dict[str, RangePlacement]:
    """Place everything where it usually lies, because no model could be asked."""
    return {f: RangePlacement(fraction_of(c.range, c.range.typical), "fallback", why) for f, c in offered.items()}


def placed_wall_thickness(words: PartDescription, library_name: str = "default") -> float | None:
    """How thick a part's wall was put inside the measured range [m]; None: not placed."""
    placed = words.placements.get("shell_thickness")
    if words.material is None or placed is None or placed.chosen_by == "fallback":
        return None
    return value_at_fraction(library_entry(words.material, library_name).ranges["shell_thickness"], placed.fraction)


def placement_contradictions(
    words: PartDescription, placements: Mapping[str, RangePlacement], library_name: str = "default"
) -> dict[str, str]:
    """Return which of a part's values do not fit each other: field → why, in a clause.

    Only placed or stated values can be corrected: what was not asked of a way, as the stiffness of all but the
    likeliest, contradicts nothing.
    """
    if words.material is None:
        return {}
    entry = library_entry(words.material, library_name)
    chosen = {f: value_at_fraction(r, placements[f].fraction) for f, r in entry.ranges.items() if f in placements}
    return value_contradictions(entry.group, entry.ranges, chosen | words.values)
