"""Sampling of consistent material values from the measured ranges.

A value is drawn from a triangle on its range's own scale, whose peak is the chosen value. It spans the whole range if
none was chosen, half of the way to either end where a model did, and nothing where a person stated it. Within one
material the stiffer grade is also the stronger, and in porous and granular material the denser; what is of one material
in one object is of one grade.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import erf, sqrt

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import (
    WALLED_KINDS,
    Hypothesis,
    Inventory,
    Material,
    MaterialField,
    MeasuredRange,
    ObjectDescription,
    PartComponent,
    PartDescription,
    Provenance,
    Structure,
    apply_hypothesis,
)
from corporeal.materials.contact_pairs import ImpactBody, friction_between, pair_restitution
from corporeal.materials.library import find_material, library, part_materials
from corporeal.materials.library_entry import MaterialEntry
from corporeal.materials.material_candidates import fraction_of, value_at_fraction
from corporeal.materials.range_placement import CONTENTS_DENSITY_FIELD, library_entry

RANGE_SPAN_OF_SOURCE = {"typical": 1.0, "fallback": 1.0, "model": 0.5, "recording": 0.5, "annotation": 0.0}
RANGE_SPAN_OF_SOURCE |= {"field": 0.0}
"""How far towards the ends of its range a value is drawn, by who chose it."""
GRADE_CORRELATION = 0.9
"""Correlation of what moves together."""
GRADE_FIELDS = ("young_pa", "yield_stress", "hardening", "cohesion", "friction_angle")
"""Grow together within one material."""
POROUS_GROUPS = ("foam", "fibrous", "granular", "bulk", "food")
"""Groups in which the denser is also the stiffer (Gibson and Ashby 1997: E ∝ ρ²)."""
MAX_FILL_ERROR_FRACTION = 0.1
"""How far from the truth a stated share of a container's room may be [-]."""
MAX_RELATIVE_FILL_ERROR_RATIO = 0.5
"""How far it may be at most, over itself: what is nearly empty is no more often full [-]."""
SOLIDITY_LOG_STD = 0.25
"""Standard deviation of the logarithm of a solidity that was judged by eye [-]."""
SHARE_LOG_STD = 0.2
"""Standard deviation of the logarithm of a share that was judged by eye [-]."""
MAX_MOUTH_INFLATION_PA = 10_000.0
"""What a person can blow up without a pump, above the air around [Pa]: lungs press no harder."""
NAMED_WALL_LOG_STD = 0.45
"""Standard deviation of the logarithm of a wall that is only usual of objects of that name: half the interquartile
range of what 62 named objects weigh in reality over what they weighed with such walls, in deviations (.46); the median
distance of 11 of published mass gives .43 (decision mass-by-name).
"""
MAX_INNER_VOLUME_FRACTION = 0.99
"""Of what encloses them, all that lies inside takes up at most [-]."""


def triangular_quantile(quantile: float, low: float, peak: float, high: float) -> float:
    """Value of a triangular distribution on [low, high] at a quantile."""
    if high <= low:
        return peak
    if quantile < (peak - low) / (high - low):
        return low + sqrt(quantile * (high - low) * (peak - low))
    return high - sqrt((1 - quantile) * (high - low) * (high - peak))


def draw_hypotheses(inventory: Inventory, rng: np.random.Generator, library: str) -> Inventory:
    """Sample a hypothesis for every part by their probabilities.

    Ways that share a reading of the object ("imitation") are drawn together. Unrecognised parts may be of any of the
    library's materials. Where several answers were given, one of them is drawn first, since its ways and its values fit
    each other.
    """
    return replace(inventory, objects=tuple(_draw_object(thing, rng, library) for thing in inventory.objects))


def take_answer(inventory: Inventory, number: int) -> Inventory:
    """Let every object be as one of the answers about it says; they are taken in turn."""
    return replace(inventory, objects=tuple(_with_answer(thing, number) for thing in inventory.objects))


def _with_answer(thing: ObjectDescription, number: int) -> ObjectDescription:
    if not thing.answers:
        return thing
    account = thing.answers[number % len(thing.answers)]
    return replace(thing, parts=account.parts, answers=())


def _draw_object(thing: ObjectDescription, rng: np.random.Generator, library: str) -> ObjectDescription:
    if thing.answers:
        thing = _with_answer(thing, int(rng.integers(len(thing.answers))))
    read = ""  # the reading that the first part of the object to have any was drawn with

    def drawn(words: PartDescription) -> PartDescription:
        nonlocal read
        pieces = tuple(drawn(p) for p in words.pieces)
        if pieces:
            return replace(words, pieces=pieces)
        at = float(rng.uniform())
        ways = [w for w in words.hypotheses if w.reading == read] if read else []
        way = _hypothesis_at_quantile(ways or words.hypotheses, at)
        read = read or (way.reading if way else "")
        chosen = apply_hypothesis(words, way) if way and _is_available(way, library) else words
        if chosen.material is None:
            every = part_materials(library)
            return _substitute_material(chosen, every[int(rng.uniform() * len(every))], library)
        return chosen

    return replace(thing, parts=tuple(drawn(p) for p in thing.parts))


def _hypothesis_at_quantile(ways: Sequence[Hypothesis], at: float) -> Hypothesis | None:
    """Return the way at a quantile; None where there are none."""
    left = at * sum(way.probability for way in ways)
    for way in ways:
        left -= way.probability
        if left < 0:
            return way
    return ways[-1] if ways else None


def _is_available(way: Hypothesis, library: str) -> bool:
    """Return whether the library in use has the material, with walls where it is to have some."""
    if way.material is None:
        return True
    try:
        entry = library_entry(way.material, library)
    except UserError:
        return False
    return way.structure not in WALLED_KINDS or "shell_thickness" in entry.ranges


def _substitute_material(words: PartDescription, name: str, library: str) -> PartDescription:
    """Let some material stand in for an unknown one, unless it makes no such walls."""
    walled = words.structure in WALLED_KINDS and words.thickness is None
    if walled and "shell_thickness" not in library_entry(name, library).ranges:
        return words
    kept = {f: p for f, p in words.placements.items() if f in ("shell_thickness", CONTENTS_DENSITY_FIELD)}
    reason = f"It may be {name} instead of something unknown."
    return replace(words, material=name, placements=kept, values={}, reason=reason)


@dataclass
class GradeDraws:
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
            own = GRADE_CORRELATION * grade + sqrt(1 - GRADE_CORRELATION**2) * own
        return 0.5 * (1 + erf(own / sqrt(2)))


def sample_material_field(
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
    grades = GradeDraws(rng, {})
    made = [_draw_material(m, owner, grades, library) for m, owner in zip(field.materials, object_of_part, strict=True)]
    words = tuple(
        _draw_shares(_draw_wall(w, owner, grades), rng) for w, owner in zip(field.words, object_of_part, strict=True)
    )
    structures = tuple(
        _draw_structure(s, m, w, owner, grades, library)
        for s, m, w, owner in zip(field.structures, made, words, object_of_part, strict=True)
    )
    pieces = tuple(
        tuple(_draw_piece(p, piece, owner, grades, library) for p, piece in zip(group, w.pieces, strict=True))
        for group, w, owner in zip(field.pieces or ((),) * len(made), words, object_of_part, strict=True)
    )
    ground = library_entry(floor, library)
    bodies = [*made, _draw_material(ground.pick(ground.typical()), -1, grades, library)]
    entries = [library_entry(m.name, library) for m in bodies]
    solid = [*(s.kind == "solid" for s in structures), True]
    return MaterialField(
        materials=tuple(made),
        structures=structures,
        words=words,
        friction=_draw_friction(field, entries, grades),
        restitution=_draw_restitution([ImpactBody(*s) for s in zip(entries, bodies, solid, strict=True)], grades),
        pieces=pieces if field.pieces else (),
        floor=bodies[-1],
    )


def _draw_material(material: Material, owner: int, grades: GradeDraws, library: str) -> Material:
    porous = _material_group(material.name, library) in POROUS_GROUPS
    grounds = {
        f: _draw_ground(g, grades.quantile(owner, material.name, f, f in GRADE_FIELDS or _is_porous_density(f, porous)))
        for f, g in material.grounds.items()
    }
    return replace(material, grounds=grounds, **{f: g.value for f, g in grounds.items()})


def _material_group(name: str, library_name: str) -> str:
    """Look a group up; what a library does not hold came from the default one, as contents may."""
    entries = library(library_name)
    return (entries[name] if name in entries else find_material(name)).group


def _is_porous_density(field: str, porous: bool) -> bool:
    return porous and field == "density"


def _draw_ground(ground: Provenance, quantile: float) -> Provenance:
    span = RANGE_SPAN_OF_SOURCE.get(ground.chosen_by, 1.0)
    value = _value_at_quantile(ground.range, ground.value, quantile, span)
    return Provenance(value, ground.range, ground.chosen_by, ground.reason, ground.margin)


def _value_at_quantile(r: MeasuredRange, chosen: float, quantile: float, span: float) -> float:
    peak = fraction_of(r, chosen)
    drawn = triangular_quantile(quantile, peak - span * peak, peak, peak + span * (1 - peak))
    return value_at_fraction(r, drawn) if span > 0 else chosen


def _draw_structure(
    structure: Structure, material: Material, words: PartDescription, owner: int, grades: GradeDraws, library: str
) -> Structure:
    if structure.inflated:  # its air is as rules and makers ask, and no material of a library
        return replace(structure, thickness=words.thickness or structure.thickness)
    thickness = structure.thickness
    if structure.kind != "solid":
        thickness = words.thickness or material.shell_thickness
    if structure.contents is None:
        solidity = structure.solidity
        if solidity < 1.0 and words.answered_by != "annotation":
            wide = np.exp(SOLIDITY_LOG_STD * grades.normal(owner, words.name, "solidity"))
            solidity = float(min(solidity * wide, 1.0))
        return replace(structure, thickness=thickness, solidity=solidity)
    fill = structure.fill
    if words.answered_by != "annotation":
        quantile = grades.quantile(owner, words.name, "fill", False)
        wide = min(MAX_FILL_ERROR_FRACTION, MAX_RELATIVE_FILL_ERROR_RATIO * fill)
        fill = triangular_quantile(quantile, fill - wide, fill, min(fill + wide, 1.0))
    inner = _draw_material(structure.contents, owner, grades, library)
    return replace(structure, thickness=thickness, contents=inner, fill=fill)


def _draw_piece(
    piece: PartComponent, words: PartDescription, owner: int, grades: GradeDraws, library: str
) -> PartComponent:
    material = _draw_material(piece.material, owner, grades, library)
    structure = _draw_structure(piece.structure, material, words, owner, grades, library)
    return PartComponent(words, material, structure)


def _draw_wall(words: PartDescription, owner: int, grades: GradeDraws) -> PartDescription:
    """Draw a wall that is only usual of such objects; rules fix what inflated balls weigh.

    No rule states the pressure of what is inflated by mouth: an air bed, a beach ball.
    """
    by_mouth = 0 < (words.inflation or 0.0) <= MAX_MOUTH_INFLATION_PA
    ruled = words.inflation is not None and not by_mouth
    if not words.wall_usual or words.thickness is None or ruled:
        return words
    wide = float(np.exp(NAMED_WALL_LOG_STD * grades.normal(owner, words.name, "wall")))
    return replace(words, thickness=words.thickness * wide)


def _draw_shares(words: PartDescription, rng: np.random.Generator) -> PartDescription:
    """Draw the shares of a part's pieces; they still add up to what they did."""
    if not words.pieces:
        return words
    found = {}
    outside = np.array([not (p.inside or p.missing) for p in words.pieces])
    for what in ("volume_share", "surface_share"):
        shares = np.array([getattr(p, what) for p in words.pieces])
        drawn = shares * np.exp(SHARE_LOG_STD * rng.normal(size=len(shares)))
        drawn[outside] *= shares[outside].sum() / max(drawn[outside].sum(), 1e-300)
        found[what] = drawn
    volume = dict(zip((p.name for p in words.pieces), found["volume_share"], strict=True))
    for p in words.pieces:  # what is inside never outgrows what encloses it
        own = [q.name for q in words.pieces if q.inside == p.name]
        room, taken = volume[p.name], sum(volume[name] for name in own)
        for name in own:
            volume[name] *= min(1.0, MAX_INNER_VOLUME_FRACTION * room / max(taken, 1e-300))
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


def _draw_friction(field: MaterialField, entries: Sequence[MaterialEntry], grades: GradeDraws) -> np.ndarray:
    """Draw the friction of every pair in its published range; what a person stated stays."""
    stated = [_is_friction_stated(m.grounds) for m in field.materials] + [False]
    drawn = np.array(field.friction)
    for a, one in enumerate(entries):
        for b, other in enumerate(entries[: a + 1]):
            r, chosen = friction_between(one, other).sliding, float(field.friction[a, b])
            if stated[a] or stated[b] or chosen not in r:
                continue
            first, second = sorted((one.name, other.name))
            quantile = grades.quantile(-1, first, f"on {second}", False)
            drawn[a, b] = drawn[b, a] = _value_at_quantile(r, chosen, quantile, 1.0)
    return drawn


def _draw_restitution(strikers: Sequence[ImpactBody], grades: GradeDraws) -> np.ndarray:
    """Draw the restitution of measured pairs in its range; the others follow their materials."""
    drawn = np.zeros((len(strikers), len(strikers)))
    for a, one in enumerate(strikers):
        for b, other in enumerate(strikers[: a + 1]):
            pair = pair_restitution(one, other)
            value = pair.value
            if pair.measured:
                first, second = sorted((one.entry.name, other.entry.name))
                quantile = grades.quantile(-1, first, f"rebound from {second}", False)
                value = _value_at_quantile(pair.measured, value, quantile, 1.0)
            drawn[a, b] = drawn[b, a] = value
    return drawn


def _is_friction_stated(grounds: Mapping[str, Provenance]) -> bool:
    return "friction" in grounds and grounds["friction"].chosen_by == "annotation"
