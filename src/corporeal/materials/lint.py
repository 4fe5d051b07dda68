"""Is a library sound? Every number has a range in order, a plausible size and a known source."""

from collections import Counter
from collections.abc import Iterator, Mapping

from corporeal.materials.library import Entry, source_table
from corporeal.materials.quantities import QUANTITIES
from corporeal.types import Law, Range

ALWAYS = ("young", "poisson", "density")
NEEDED = {
    Law.VON_MISES: (*ALWAYS, "yield_stress"),
    Law.DRUCKER_PRAGER: (*ALWAYS, "friction_angle", "cohesion"),
}
MEANINGLESS = {
    "yield_stress": {Law.VON_MISES},
    "hardening": {Law.VON_MISES},
    "friction_angle": {Law.DRUCKER_PRAGER},
    "cohesion": {Law.DRUCKER_PRAGER},
}
"""Fields that only these laws read."""


def lint(entries: Mapping[str, Entry]) -> list[str]:
    """Return what is wrong, one sentence each; empty when nothing is."""
    names = Counter(n.lower() for e in entries.values() for n in (e.name, *e.aliases))
    found = [f"{name}: means two materials" for name, count in names.items() if count > 1]
    for entry in entries.values():
        found += [f"{entry.name}: {problem}" for problem in _problems(entry)]
    return found


def _problems(entry: Entry) -> Iterator[str]:
    law = entry.law.name.lower()
    yield from (f"{law} needs {f}" for f in NEEDED.get(entry.law, ALWAYS) if f not in entry.ranges)
    for field, laws in MEANINGLESS.items():
        if field in entry.ranges and entry.law not in laws:
            yield f"{law} never reads {field}"
    for field, r in entry.ranges.items():
        yield from _range_problems(field, r)
    if "poisson" in entry.ranges and entry.ranges["poisson"].typical >= 0.5:
        yield "a Poisson's ratio of 0.5 has no finite Lamé constant"


def _range_problems(field: str, r: Range) -> Iterator[str]:
    quantity = QUANTITIES[field]
    if not r.low <= r.typical <= r.high:
        yield f"{field} is out of order: {r.low:g}, {r.typical:g}, {r.high:g}"
    if not quantity.low <= r.low <= r.high <= quantity.high:
        yield f"{field} of {r.low:g} to {r.high:g} {quantity.unit} is not of this world"
    for key in r.source.split("+"):
        if key not in source_table():
            yield f"{field} cites {key!r}, which sources.toml does not list"
