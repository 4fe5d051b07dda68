"""Consistent sets of values drawn from the measured ranges: what is not known, as samples.

A value is drawn from a triangle on its range's own scale, whose peak is the chosen value. It spans
the whole range where nobody chose, half of the way to either end where a model did, and nothing
where a person stated it. Within one material the stiffer grade is also the stronger, and in porous
and loose matter the denser; what is of one material in one object is of one grade.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import erf, sqrt

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import (
    WALLED,
    Ground,
    Hypothesis,
    Inventory,
    Material,
    MaterialField,
    ObjectWords,
    PartWords,
    Piece,
    Range,
    Structure,
    in_way,
)
from corporeal.materials.contact import Striker, friction_between, restitution
from corporeal.materials.entry import Entry
from corporeal.materials.library import find, library, substances
from corporeal.materials.placement import CONTENTS, entry_of
from corporeal.materials.scale import fraction_of, place

SPAN = {"typical": 1.0, "fallback": 1.0, "model": 0.5, "recording": 0.5, "annotation": 0.0}
SPAN |= {"field": 0.0}
"""How far towards the ends of its range a value is drawn, by who chose it."""
TOGETHER = 0.9
"""Correlation of what moves together."""
GRADE = ("young", "yield_stress", "hardening", "cohesion", "friction_angle")
"""Grow together within one material."""
POROUS = ("foam", "fibrous", "granular", "bulk", "food")
"""Groups in which the denser is also the stiffer (Gibson and Ashby 1997: E ∝ ρ²)."""
FULLER = 0.1
"""How far from the truth a stated share of a container's room may be [-]."""
HALF = 0.5
"""How far it may be at most, over itself: what is nearly empty is no more often full [-]."""
LOOSER = 0.25
"""Standard deviation of the logarithm of a solidity that was judged by eye [-]."""
SHARES = 0.2
"""Standard deviation of the logarithm of a share that was judged by eye [-]."""
BY_MOUTH = 10_000.0
"""What a person can blow up without a pump, above the air around [Pa]: lungs press no harder."""
NAMED_WALLS = 0.45
"""Standard deviation of the logarithm of a wall that is only usual of things of that name: half the
interquartile range of what 62 named things weigh in life over what they weighed with such walls, in
deviations (.46); the median distance of 11 of published mass gives .43 (decision 104)."""
MOST_INSIDE = 0.99
"""Of what encloses them, all that lies inside takes up at most [-]."""


def triangle(quantile: float, low: float, peak: float, high: float) -> float:
    """Value of a triangular distribution on [low, high] at a quantile."""
    if high <= low:
        return peak
    if quantile < (peak - low) / (high - low):
        return low + sqrt(quantile * (high - low) * (peak - low))
    return high - sqrt((1 - quantile) * (high - low) * (high - peak))


def otherwise(inventory: Inventory, rng: np.random.Generator, library: str) -> Inventory:
    """Draw for every part one of the ways it may be, as a whole, by their probabilities.

    Ways that share a reading of the object ("imitation") are drawn together. What nobody recognised
    may be of any of the library's materials. Where several answers were given, one of them is drawn
    first, since its ways and its values fit each other.
    """
    return replace(
        inventory,
        objects=tuple(_object(thing, rng, library) for thing in inventory.objects),
    )


def as_answered(inventory: Inventory, number: int) -> Inventory:
    """Let every object be as one of the answers about it says; they are taken in turn."""
    return replace(inventory, objects=tuple(_told(thing, number) for thing in inventory.objects))


def _told(thing: ObjectWords, number: int) -> ObjectWords:
    if not thing.answers:
        return thing
    account = thing.answers[number % len(thing.answers)]
    return replace(thing, parts=account.parts, answers=())


def _object(thing: ObjectWords, rng: np.random.Generator, library: str) -> ObjectWords:
    if thing.answers:
        thing = _told(thing, int(rng.integers(len(thing.answers))))
    read = ""  # the reading that the first part of the object to have any was drawn with

    def drawn(words: PartWords) -> PartWords:
        nonlocal read
        pieces = tuple(drawn(p) for p in words.pieces)
        if pieces:
            return replace(words, pieces=pieces)
        at = float(rng.uniform())
        ways = [w for w in words.hypotheses if w.reading == read] if read else []
        way = _drawn_way(ways or words.hypotheses, at)
        read = read or (way.reading if way else "")
        chosen = in_way(words, way) if way and _can_be(way, library) else words
        if chosen.material is None:
            every = substances(library)
            return _instead(chosen, every[int(rng.uniform() * len(every))], library)
        return chosen

    return replace(thing, parts=tuple(drawn(p) for p in thing.parts))


def _drawn_way(ways: Sequence[Hypothesis], at: float) -> Hypothesis | None:
    """Return the way at a quantile; None where there are none."""
    left = at * sum(way.probability for way in ways)
    for way in ways:
        left -= way.probability
        if left < 0:
            return way
    return ways[-1] if ways else None


def _can_be(way: Hypothesis, library: str) -> bool:
    """Tell whether the library in use has the material, with walls where it is to have some."""
    if way.material is None:
        return True
    try:
        entry = entry_of(way.material, library)
    except UserError:
        return False
    return way.structure not in WALLED or "shell_thickness" in entry.ranges


def _instead(words: PartWords, name: str, library: str) -> PartWords:
    """Let some material stand in for an unknown one, unless it makes no such walls."""
    walled = words.structure in WALLED and words.thickness is None
    if walled and "shell_thickness" not in entry_of(name, library).ranges:
        return words
    kept = {f: p for f, p in words.placements.items() if f in ("shell_thickness", CONTENTS)}
    reason = f"It may be {name} instead of something unknown."
    return replace(words, material=name, placements=kept, values={}, reason=reason)


@dataclass
class Grades:
    """The luck of one draw: the same material in the same object is of the same grade."""

    rng: np.random.Generator
    known: dict[tuple[int, str, str], float]

    def normal(self, owner: int, material: str, what: str) -> float:
        """Draw a standard normal number once for each of its three names."""
        key = (owner, material, what)
        if key not in self.known:
            self.known[key] = float(self.rng.normal())
        return self.known[key]

    def quantile(self, owner: int, material: str, what: str, bound: bool) -> float:
        """Draw a quantile; what is bound moves with the material's grade."""
        own = self.normal(owner, material, what)
        if bound:
            grade = self.normal(owner, material, "grade")
            own = TOGETHER * grade + sqrt(1 - TOGETHER**2) * own
        return 0.5 * (1 + erf(own / sqrt(2)))


def sample(
    field: MaterialField,
    object_of_part: Sequence[int],
    rng: np.random.Generator,
    library: str = "default",
    floor: str = "concrete",
) -> MaterialField:
    """Draw one consistent set of values for a whole scene; all stay inside their ranges.

    Args:
        field: What was chosen, with its grounds.
        object_of_part: Owner of each part.
        rng: Source of the draw.
        library: Where materials are looked up.
        floor: What the floor and the walls are made of.

    """
    grades = Grades(rng, {})
    made = [
        _material(m, owner, grades, library)
        for m, owner in zip(field.materials, object_of_part, strict=True)
    ]
    words = tuple(
        _shares(_walled(w, owner, grades), rng)
        for w, owner in zip(field.words, object_of_part, strict=True)
    )
    structures = tuple(
        _structure(s, m, w, owner, grades, library)
        for s, m, w, owner in zip(field.structures, made, words, object_of_part, strict=True)
    )
    pieces = tuple(
        tuple(
            _piece(p, piece, owner, grades, library)
            for p, piece in zip(group, w.pieces, strict=True)
        )
        for group, w, owner in zip(
            field.pieces or ((),) * len(made), words, object_of_part, strict=True
        )
    )
    ground = entry_of(floor, library)
    bodies = [*made, _material(ground.pick(ground.typical()), -1, grades, library)]
    entries = [entry_of(m.name, library) for m in bodies]
    solid = [*(s.kind == "solid" for s in structures), True]
    return MaterialField(
        materials=tuple(made),
        structures=structures,
        words=words,
        friction=_friction(field, entries, grades),
        restitution=_restitution(
            [Striker(*s) for s in zip(entries, bodies, solid, strict=True)], grades
        ),
        pieces=pieces if field.pieces else (),
        floor=bodies[-1],
    )


def _material(material: Material, owner: int, grades: Grades, library: str) -> Material:
    porous = _group(material.name, library) in POROUS
    grounds = {
        f: _drawn(g, grades.quantile(owner, material.name, f, f in GRADE or _dense(f, porous)))
        for f, g in material.grounds.items()
    }
    return replace(material, grounds=grounds, **{f: g.value for f, g in grounds.items()})


def _group(name: str, library_name: str) -> str:
    """Look a group up; what a library does not hold came from the default one, as contents may."""
    entries = library(library_name)
    return (entries[name] if name in entries else find(name)).group


def _dense(field: str, porous: bool) -> bool:
    return porous and field == "density"


def _drawn(ground: Ground, quantile: float) -> Ground:
    span = SPAN.get(ground.chosen_by, 1.0)
    value = _within(ground.range, ground.value, quantile, span)
    return Ground(value, ground.range, ground.chosen_by, ground.reason, ground.margin)


def _within(r: Range, chosen: float, quantile: float, span: float) -> float:
    peak = fraction_of(r, chosen)
    drawn = triangle(quantile, peak - span * peak, peak, peak + span * (1 - peak))
    return place(r, drawn) if span > 0 else chosen


def _structure(
    structure: Structure,
    material: Material,
    words: PartWords,
    owner: int,
    grades: Grades,
    library: str,
) -> Structure:
    if structure.inflated:  # its air is as rules and makers ask, and no material of a library
        return replace(structure, thickness=words.thickness or structure.thickness)
    thickness = structure.thickness
    if structure.kind != "solid":
        thickness = words.thickness or material.shell_thickness
    if structure.contents is None:
        solidity = structure.solidity
        if solidity < 1.0 and words.answered_by != "annotation":
            wide = np.exp(LOOSER * grades.normal(owner, words.name, "solidity"))
            solidity = float(min(solidity * wide, 1.0))
        return replace(structure, thickness=thickness, solidity=solidity)
    fill = structure.fill
    if words.answered_by != "annotation":
        quantile = grades.quantile(owner, words.name, "fill", False)
        wide = min(FULLER, HALF * fill)
        fill = triangle(quantile, fill - wide, fill, min(fill + wide, 1.0))
    inner = _material(structure.contents, owner, grades, library)
    return replace(structure, thickness=thickness, contents=inner, fill=fill)


def _piece(piece: Piece, words: PartWords, owner: int, grades: Grades, library: str) -> Piece:
    material = _material(piece.material, owner, grades, library)
    structure = _structure(piece.structure, material, words, owner, grades, library)
    return Piece(words, material, structure)


def _walled(words: PartWords, owner: int, grades: Grades) -> PartWords:
    """Draw a wall that is only usual of such things; rules fix what inflated balls weigh.

    Nobody rules what is blown up by mouth: an air bed, a beach ball.
    """
    by_mouth = 0 < (words.inflation or 0.0) <= BY_MOUTH
    ruled = words.inflation is not None and not by_mouth
    if not words.wall_usual or words.thickness is None or ruled:
        return words
    wide = float(np.exp(NAMED_WALLS * grades.normal(owner, words.name, "wall")))
    return replace(words, thickness=words.thickness * wide)


def _shares(words: PartWords, rng: np.random.Generator) -> PartWords:
    """Draw the shares of a part's pieces; they still add up to what they did."""
    if not words.pieces:
        return words
    found = {}
    outside = np.array([not (p.inside or p.missing) for p in words.pieces])
    for what in ("volume_share", "surface_share"):
        shares = np.array([getattr(p, what) for p in words.pieces])
        drawn = shares * np.exp(SHARES * rng.normal(size=len(shares)))
        drawn[outside] *= shares[outside].sum() / max(drawn[outside].sum(), 1e-300)
        found[what] = drawn
    volume = dict(zip((p.name for p in words.pieces), found["volume_share"], strict=True))
    for p in words.pieces:  # what is inside never outgrows what encloses it
        own = [q.name for q in words.pieces if q.inside == p.name]
        room, taken = volume[p.name], sum(volume[name] for name in own)
        for name in own:
            volume[name] *= min(1.0, MOST_INSIDE * room / max(taken, 1e-300))
    pieces = tuple(
        replace(
            p,
            volume_share=float(volume[p.name]),
            surface_share=float(s),
            inner_share=float(sum(volume[q.name] for q in words.pieces if q.inside == p.name)),
        )
        for p, s in zip(words.pieces, found["surface_share"], strict=True)
    )
    return replace(words, pieces=pieces)


def _friction(field: MaterialField, entries: Sequence[Entry], grades: Grades) -> np.ndarray:
    """Draw the friction of every pair in its published range; what a person stated stays."""
    stated = [_stated(m.grounds) for m in field.materials] + [False]
    drawn = np.array(field.friction)
    for a, one in enumerate(entries):
        for b, other in enumerate(entries[: a + 1]):
            r, chosen = friction_between(one, other).sliding, float(field.friction[a, b])
            if stated[a] or stated[b] or chosen not in r:
                continue
            first, second = sorted((one.name, other.name))
            quantile = grades.quantile(-1, first, f"on {second}", False)
            drawn[a, b] = drawn[b, a] = _within(r, chosen, quantile, 1.0)
    return drawn


def _restitution(strikers: Sequence[Striker], grades: Grades) -> np.ndarray:
    """Draw the restitution of measured pairs in its range; the others follow their materials."""
    drawn = np.zeros((len(strikers), len(strikers)))
    for a, one in enumerate(strikers):
        for b, other in enumerate(strikers[: a + 1]):
            pair = restitution(one, other)
            value = pair.value
            if pair.measured:
                first, second = sorted((one.entry.name, other.entry.name))
                quantile = grades.quantile(-1, first, f"rebound from {second}", False)
                value = _within(pair.measured, value, quantile, 1.0)
            drawn[a, b] = drawn[b, a] = value
    return drawn


def _stated(grounds: Mapping[str, Ground]) -> bool:
    return "friction" in grounds and grounds["friction"].chosen_by == "annotation"
