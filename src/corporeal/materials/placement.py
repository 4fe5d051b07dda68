"""Which values of a part can be placed in their ranges, and what a placement comes to."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import UnknownChoiceError
from corporeal.core.types import WALLED, PartWords, Placement
from corporeal.materials.consistency import contradictions
from corporeal.materials.entry import Entry
from corporeal.materials.library import counterpart, find, library
from corporeal.materials.offer import Choice, choice
from corporeal.materials.scale import fraction_of, place

PLACED = (
    "young",
    "poisson",
    "density",
    "yield_stress",
    "friction_angle",
    "cohesion",
    "shell_thickness",
)
"""Fields of ``Material`` that use and treatment decide; the others keep their usual value."""
WEIGHING = ("density", "shell_thickness")
"""Those of them that a mass hangs on."""
By = Literal["model", "recording"]
CONTENTS = "contents_density"
"""The density of what is inside: of the contents' material, placed with the wall's values."""


def entry_of(name: str, library_name: str = "default") -> Entry:
    """Look a material up; a smaller library gives what stands for it there."""
    entries = library(library_name)
    return entries[name] if name in entries else counterpart(find(name), library_name)


def held(name: str, library_name: str = "default") -> Entry:
    """Look up what is inside: a library that says nothing of it leaves it to the default one."""
    known = library(library_name)
    return known[name] if name in known else find(name)


def spelling(name: str, library_name: str, offered: list[str]) -> str | None:
    """Return how a library spells a name that somebody gave, None where it is not offered."""
    try:
        found = find(name, library_name).name
    except UnknownChoiceError:
        return None
    return found if found in offered else None


def choices(
    words: PartWords, library_name: str = "default", weighing: bool = False
) -> dict[str, Choice]:
    """Offer the quantities of a part that somebody may place; nothing where none is open.

    Args:
        words: The description of the part.
        library_name: Where its material is looked up.
        weighing: Offer only what its mass hangs on.

    """
    if words.material is None:
        return {}
    entry = entry_of(words.material, library_name)
    walled = words.structure in WALLED and words.thickness is None
    placed = WEIGHING if weighing else PLACED
    fields = [f for f in placed if f in entry.ranges and (walled or f != "shell_thickness")]
    offered = {f: choice(entry.name, f, entry.ranges[f]) for f in fields if f not in words.values}
    if words.contents is not None:
        inside = held(words.contents, library_name)
        offered[CONTENTS] = choice(inside.name, "density", inside.ranges["density"])
    return {f: c for f, c in offered.items() if c.range.low < c.range.high}


@dataclass(frozen=True)
class Judgement:
    """Where somebody puts a quantity, and why."""

    number: float
    """A fraction of the range, or a value in the unit that was offered."""
    reason: str


def from_fractions(
    judged: Mapping[str, Judgement], by: By, offered: Mapping[str, Choice]
) -> dict[str, Placement]:
    """Take fractions, each with its reason, as they are."""
    return {f: Placement(j.number, by, j.reason) for f, j in judged.items() if f in offered}


def from_values(
    judged: Mapping[str, Judgement], by: By, offered: Mapping[str, Choice]
) -> dict[str, Placement]:
    """Find the place of values, each in the unit that was offered and with its reason."""
    placed = {}
    for field, judgement in judged.items():
        r, value = offered[field].range, judgement.number * offered[field].factor
        inside = min(max(value, r.low), r.high)  # a bound's last digit
        placed[field] = Placement(fraction_of(r, inside), by, judgement.reason)
    return placed


def usual(offered: Mapping[str, Choice], why: str) -> dict[str, Placement]:
    """Place everything where it usually lies, because nobody could be asked."""
    return {
        f: Placement(fraction_of(c.range, c.range.typical), "fallback", why)
        for f, c in offered.items()
    }


def wall_put(words: PartWords, library_name: str = "default") -> float | None:
    """How thick a part's wall was put inside the measured range [m]; None: not placed."""
    placed = words.placements.get("shell_thickness")
    if words.material is None or placed is None or placed.chosen_by == "fallback":
        return None
    return place(entry_of(words.material, library_name).ranges["shell_thickness"], placed.fraction)


def odd(
    words: PartWords, placements: Mapping[str, Placement], library_name: str = "default"
) -> dict[str, str]:
    """Say which of a part's values do not fit each other: field → why, in a clause.

    Only what somebody placed or stated can be put right: what was not asked of a way, as the
    stiffness of all but the likeliest, contradicts nothing.
    """
    if words.material is None:
        return {}
    entry = entry_of(words.material, library_name)
    chosen = {
        f: place(r, placements[f].fraction) for f, r in entry.ranges.items() if f in placements
    }
    return contradictions(entry.group, entry.ranges, chosen | words.values)
