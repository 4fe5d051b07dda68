"""Friction and restitution of pairs of materials: measured pairs first, then combination rules."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from math import sqrt

from corporeal.core.types import Material, MeasuredRange
from corporeal.materials.library_entry import MaterialEntry
from corporeal.materials.loss_restitution import loss_of_restitution, restitution_of_loss
from corporeal.materials.restitution_speed import (
    MIN_CARRIED_RESTITUTION,
    NOMINAL_IMPACT_SPEED_M_S,
    is_stated_by_person,
    material_at_speed,
    yield_restitution,
)


@dataclass(frozen=True)
class Friction:
    """Friction between two materials."""

    sliding: MeasuredRange
    """Kinetic coefficient [-]."""
    static: tuple[float, float] | None
    """Low and high of the published static coefficients [-]; None: not published."""
    reason: str


def friction_between(a: MaterialEntry, b: MaterialEntry) -> Friction:
    """Sliding friction of ``a`` on ``b``: the most particular measured pair, else ``combine_friction``."""
    row = _closest_row(a.kin, b.kin, measured_friction_pairs)
    if row is None:
        return _friction_by_rule(a, b)
    low, typical, high = row["sliding"]
    measured = MeasuredRange(low, typical, high, row["source"])
    static = (row["static"][0], row["static"][1])
    one, other = row["of"] if row["of"][0] in a.kin else reversed(row["of"])
    return Friction(measured, static, f"measured: {one} on {other}, clean and dry")


def combine_friction(friction_a: float, friction_b: float) -> float:
    """Friction of an unmeasured pair from the surfaces' own values: μ = √(μ_a μ_b)."""
    return sqrt(friction_a * friction_b)


@dataclass(frozen=True)
class ImpactBody:
    """One of two rigid bodies that strike each other."""

    entry: MaterialEntry
    """Where its material is looked up."""
    material: Material
    """Its chosen values."""
    solid: bool = True
    """Whether it is solid where it strikes: a wall rings, and takes energy that a ball keeps."""


@dataclass(frozen=True)
class Restitution:
    """Newton's coefficient of two bodies that strike each other."""

    value: float
    """[-]"""
    measured: MeasuredRange | None
    """Range of the pair; None: not measured, and ``value`` is the rule's."""


VITREOUS_MATERIALS = frozenset(("glass", "ceramic", "porcelain"))
"""What is as smooth and as free of pores as metals are, and does not yield."""
BULK_LOSS_GROUPS = frozenset(("soft", "elastomer", "foam", "food"))
"""Groups of what loses in its bulk alone: loss factor and restitution tell of the same."""


def pair_restitution(a: ImpactBody, b: ImpactBody, speed: float = NOMINAL_IMPACT_SPEED_M_S) -> Restitution:
    """Restitution of two bodies: the most particular measured pair, else a rule.

    What was measured are solid balls on solid bodies, so it holds for what is solid. A value that
    a person stated for one of the materials outranks it. Of solid metals, glass and ceramics no
    value "on a hard floor" is needed: their bulk loses what its loss factor says, and metals yield;
    those of measured pairs, too, at faster impacts than they were measured in.

    Args:
        a: One body.
        b: The other.
        speed: Of the impact [m/s].
    """
    solid = a.solid and b.solid
    by_person = any(is_stated_by_person(s.material, "restitution") for s in (a, b))
    row = _closest_row(a.entry.kin, b.entry.kin, measured_restitution_pairs) if solid and not by_person else None
    if row is not None:
        low, typical, high = row["restitution"]
        most = yield_restitution(*_yielding_materials(a, b), speed)
        return Restitution(min(typical, most), MeasuredRange(low, typical, high, row["source"]))
    one, other = (material_at_speed(s.material, speed) for s in (a, b))
    if by_person or not solid:
        return Restitution(series_restitution(one, other), None)
    value = _choose_rule(a, b)(one, other)
    return Restitution(min(value, yield_restitution(*_yielding_materials(a, b), speed)), None)


@dataclass(frozen=True)
class RestitutionLaw:
    """How the restitution of two bodies changes with the speed v of an impact.

    e = value (v/speed)^(-exponent) - slope (v - speed), between ``least`` and ``most``.
    """

    value: float
    """[-]"""
    speed: float
    """[m/s]"""
    slope: float = 0.0
    """[s/m]"""
    exponent: float = 0.0
    """[-]"""
    least: float = 0.0
    """[-]"""
    most: float = 1.0
    """[-]"""


YIELD_SPEED_EXPONENT = 0.25
"""Exponent of a metal that yields: e ∝ v^(-1/4) (``yield_restitution``)."""
FULL_YIELD_SPEED_M_S = 1e4
"""At which every metal yields [m/s]."""


def pair_restitution_law(a: ImpactBody, b: ImpactBody, speed: float = NOMINAL_IMPACT_SPEED_M_S) -> RestitutionLaw:
    """Return how restitution changes about the speed of an impact, as ``pair_restitution`` gives it.

    Metals are as elastic as their bulk up to the speed at which they yield. The line of a rated ball, which is exact
    for it alone, is the chord from this speed to a quarter of it.

    Args:
        a: One body.
        b: The other.
        speed: Of the impact [m/s].
    """
    now, slow, fast = (pair_restitution(a, b, v).value for v in (speed, 0.0, FULL_YIELD_SPEED_M_S))
    limit = yield_restitution(*_yielding_materials(a, b), FULL_YIELD_SPEED_M_S)
    if fast == limit < min(slow, 1.0):
        yields_at = FULL_YIELD_SPEED_M_S * (limit / slow) ** (1.0 / YIELD_SPEED_EXPONENT)
        return RestitutionLaw(now, max(speed, yields_at), 0.0, YIELD_SPEED_EXPONENT, 0.0, slow)
    slope = (pair_restitution(a, b, 0.25 * speed).value - now) / (0.75 * speed)
    return RestitutionLaw(now, speed, slope, 0.0, min(now, MIN_CARRIED_RESTITUTION), max(now, slow))


def _yielding_materials(a: ImpactBody, b: ImpactBody) -> tuple[Material, Material]:
    """Both materials; what is no metal is crushed or creeps, and does not yield as one."""
    one, other = (s.material if s.entry.group == "metal" else replace(s.material, yield_stress=None) for s in (a, b))
    return one, other


def _choose_rule(a: ImpactBody, b: ImpactBody) -> Callable[[Material, Material], float]:
    """Choose the rule for two solids by where they lose."""
    if _is_smooth(a) and _is_smooth(b):
        return _bulk_restitution
    return _soft_pair_restitution if {a.entry.group, b.entry.group} <= BULK_LOSS_GROUPS else series_restitution


def _is_smooth(body: ImpactBody) -> bool:
    return body.entry.group == "metal" or bool(VITREOUS_MATERIALS & set(body.entry.kin))


def _bulk_restitution(a: Material, b: Material) -> float:
    """Restitution of two bodies that lose in their bulk alone [-]."""
    return restitution_of_loss(contact_loss_factor(a, b))


def _soft_pair_restitution(a: Material, b: Material) -> float:
    """Restitution of two bodies that are soft and lossy in their bulk, both [-].

    Their loss factors add up, each by its share of the compliance (``contact_loss_factor``). Of each the loss factor is
    that of its rebound from something rigid, whatever is drawn for either.
    """
    of_a = compliance_share(a, b)
    losses = [loss_of_restitution(max(m.restitution, MIN_CARRIED_RESTITUTION)) for m in (a, b)]
    return restitution_of_loss(of_a * losses[0] + (1.0 - of_a) * losses[1])


def compliance_share(a: Material, b: Material) -> float:
    """Share of the compliance of a contact, and so of the energy in it, that is ``a``'s [-].

    One force presses both and their dents add up, so that 1/E* = (1 - ν_a²)/E_a + (1 - ν_b²)/E_b (Hertz; Johnson,
    Contact Mechanics, 1985, §4.2), and each stores its part of the sum.
    """
    stiff_a, stiff_b = (m.young_pa / (1.0 - m.poisson**2) for m in (a, b))
    return stiff_b / (stiff_a + stiff_b)


def contact_loss_factor(a: Material, b: Material) -> float:
    """Loss factor of a contact of two bodies that lose in their bulk [-]: of each its share."""
    of_a = compliance_share(a, b)
    return of_a * a.loss + (1.0 - of_a) * b.loss


def series_restitution(a: Material, b: Material) -> float:
    """Restitution of an unmeasured pair of which one is rough, fibrous or a polymer, or a wall.

    Each body stores energy in proportion to its compliance (``compliance_share``) and returns e²
    of it: e² = (E_b e_a² + E_a e_b²)/(E_a + E_b), with the plane-strain modulus E/(1 - ν²), so the
    softer body decides (Cross, Am. J. Phys. 68 (2000) 1025, eq. for two bodies in series).
    """
    of_a = compliance_share(a, b)
    return sqrt(of_a * a.restitution**2 + (1.0 - of_a) * b.restitution**2)


@cache
def measured_friction_pairs() -> dict[frozenset[str], dict]:
    """Every pair of measured friction, by the names in it."""
    return _pair_rows("pair")


@cache
def measured_restitution_pairs() -> dict[frozenset[str], dict]:
    """Every pair of measured restitution, by the names in it."""
    return _pair_rows("rebound")


def _pair_rows(table: str) -> dict[frozenset[str], dict]:
    text = files("corporeal.materials").joinpath("pairs.toml").read_text(encoding="utf-8")
    return {frozenset(row["of"]): row for row in tomllib.loads(text)[table]}


@cache
def _closest_row(
    a: tuple[str, ...], b: tuple[str, ...], table: Callable[[], Mapping[frozenset[str], dict]]
) -> dict | None:
    """Return the most particular row that lists the two or their kin; None: there is none.

    Every draw of a mixture asks for the same few pairs.
    """
    known = table()
    rows = (known.get(frozenset(names)) for names in _names_by_closeness(a, b))
    return next((row for row in rows if row), None)


def _names_by_closeness(a: tuple[str, ...], b: tuple[str, ...]) -> list[tuple[str, str]]:
    """All pairs of names of the two, most particular first."""
    ranked = [(i + j, one, other) for i, one in enumerate(a) for j, other in enumerate(b)]
    return [(one, other) for _, one, other in sorted(ranked, key=lambda r: r[0])]


def _friction_by_rule(a: MaterialEntry, b: MaterialEntry) -> Friction:
    default = Material.friction  # a library without friction, such as "reference"
    plain = MeasuredRange(default, default, default, "engineering-estimate")
    one, other = (e.ranges.get("friction", plain) for e in (a, b))
    low, typical, high = (combine_friction(getattr(one, at), getattr(other, at)) for at in ("low", "typical", "high"))
    reason = f"rule: square root of {one.typical:.2g} ({a.name}) times {other.typical:.2g} ({b.name})"
    return Friction(MeasuredRange(low, typical, high, f"{one.source}+{other.source}"), None, reason)
