"""What happens between two surfaces: measured pairs first, then a stated rule."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import sqrt

from corporeal.materials.entry import Entry
from corporeal.types import Material, Range


@dataclass(frozen=True)
class Friction:
    """Friction between two materials."""

    sliding: Range
    """Kinetic coefficient [-]."""
    static: tuple[float, float] | None
    """Low and high of the published static coefficients [-]; None: not published."""
    reason: str


def friction_between(a: Entry, b: Entry) -> Friction:
    """Sliding friction of ``a`` on ``b``: the most particular measured pair, else ``combine``."""
    for one, other in _by_closeness(a, b):
        row = pairs().get(frozenset((one, other)))
        if row:
            low, typical, high = row["sliding"]
            measured = Range(low, typical, high, row["source"])
            static = (row["static"][0], row["static"][1])
            return Friction(measured, static, f"measured: {one} on {other}, clean and dry")
    return _by_rule(a, b)


def combine(friction_a: float, friction_b: float) -> float:
    """Friction of an unmeasured pair from the surfaces' own values: μ = √(μ_a μ_b)."""
    return sqrt(friction_a * friction_b)


def restitution_between(a: Material, b: Material) -> float:
    """Restitution of an unmeasured pair.

    Each body stores energy in proportion to its compliance and returns the share e² of it:
    e² = (E_b e_a² + E_a e_b²)/(E_a + E_b), with the plane-strain modulus E/(1 - ν²), so the softer
    body decides (Cross, Am. J. Phys. 68 (2000) 1025, eq. for two bodies in series).
    """
    stiff_a, stiff_b = (m.young / (1.0 - m.poisson**2) for m in (a, b))
    squared = stiff_b * a.restitution**2 + stiff_a * b.restitution**2
    return sqrt(squared / (stiff_a + stiff_b))


@cache
def pairs() -> dict[frozenset[str], dict]:
    """Every measured pair, by the names in it."""
    text = files("corporeal.materials").joinpath("pairs.toml").read_text(encoding="utf-8")
    return {frozenset(row["of"]): row for row in tomllib.loads(text)["pair"]}


def _by_closeness(a: Entry, b: Entry) -> list[tuple[str, str]]:
    """All pairs of names of the two, most particular first."""
    ranked = [(i + j, one, other) for i, one in enumerate(a.kin) for j, other in enumerate(b.kin)]
    return [(one, other) for _, one, other in sorted(ranked, key=lambda r: r[0])]


def _by_rule(a: Entry, b: Entry) -> Friction:
    default = Material.friction  # a library without friction, such as "reference"
    plain = Range(default, default, default, "engineering-estimate")
    one, other = (e.ranges.get("friction", plain) for e in (a, b))
    low, typical, high = (
        combine(getattr(one, at), getattr(other, at)) for at in ("low", "typical", "high")
    )
    reason = (
        f"rule: square root of {one.typical:.2g} ({a.name}) times {other.typical:.2g} ({b.name})"
    )
    return Friction(Range(low, typical, high, f"{one.source}+{other.source}"), None, reason)
