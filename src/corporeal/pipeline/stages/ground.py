"""Ground: choose material values inside measured ranges."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal import materials
from corporeal.core.errors import UserError
from corporeal.core.types import (
    Inventory,
    Material,
    MaterialField,
    MeasuredRange,
    Note,
    NoteKind,
    PartComponent,
    PartDescription,
    Parts,
    Provenance,
    Scene,
    Structure,
)
from corporeal.fields.impose_field import impose_field
from corporeal.materials import MaterialEntry
from corporeal.materials.material_candidates import value_at_fraction
from corporeal.materials.pressurised_ball import (
    InflatedBall,
    air_with_ruled_restitution,
    inflated_ball_material,
    is_carried_by_air,
    sealed_air_material,
    sealed_wall_material,
    solid_with_ruled_restitution,
)
from corporeal.materials.range_placement import (
    CONTENTS_DENSITY_FIELD,
    contents_entry,
    library_entry,
    value_contradictions,
)
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.pipeline.settings import GroundConfig

DEFAULT_CONFIG = GroundConfig()
STRUCTURE_SOURCE_WORDS = {
    "annotation": "Your annotation says",
    "recording": "A recorded answer says",
    "model": "A model says",
    "metadata": "The file's metadata says",
    "unknown": "It is assumed",
}
"""The source of how a part is built."""
WALL_KIND_WORDS = {
    "shell": "has a wall",
    "sheet": "is a wall formed into something open",
    "hollow": "is a closed wall with air behind it",
    "filled": "has a wall",
}
"""How a part that has a wall is described."""
THICKNESS_SOURCE_WORDS = {
    "annotation": "Your annotation puts",
    "recording": "A recorded answer puts",
    "model": "A model puts",
    "evidence": "The estimate of its mass puts",
}
"""Who chose a wall's thickness."""
UNFIT_PREFIX = "It does not fit the others:"
NEUTRAL_MATERIAL_WARNING = (
    "The material of this part is unknown. {name} is assumed: the commonest moulded plastic, with "
    "density and stiffness in the middle of those of everyday solids."
)


def ground(scene: Scene, parts: Parts, inventory: Inventory, config: GroundConfig = DEFAULT_CONFIG) -> MaterialField:
    """Choose every value of every part, each with its range, its source and a reason.

    Raises:
        OutOfRangeError: An annotated value lies outside the measured range.
        UserError: The library has no such material or quantity.
    """
    words = tuple(_part_description(inventory, part.object, part.name) for part in parts.catalogue)
    entries = [_entry(w, config) for w in words]
    made = tuple(_material(e, w) for e, w in zip(entries, words, strict=True))
    structures = tuple(
        _structure_of_part(m, w, config, scene, part.object)
        for m, w, part in zip(made, words, parts.catalogue, strict=True)
    )
    made = tuple(_structure_rebound(m, s, w.rebound) for m, s, w in zip(made, structures, words, strict=True))
    touching = pair_coefficients(words, made, structures, config)
    found = MaterialField(
        materials=made,
        structures=structures,
        words=words,
        friction=touching.friction,
        restitution=touching.restitution,
        pieces=tuple(tuple(_piece(p, config) for p in w.pieces) for w in words),
        floor=_floor(config),
    )
    return impose_field(found, scene, parts, config.field)


def grounding_warnings(field: MaterialField, parts: Parts, scene: Scene) -> tuple[str, ...]:
    """Warn of unknown materials and doubtful values, one sentence each."""
    doubts = list(field.notes)
    for k, part in enumerate(parts.catalogue):
        owner = scene.objects[part.object].name
        where = owner if owner == part.name else f"{owner}: {part.name}"
        pieces = field.pieces[k] if field.pieces else ()
        rows = [(f"{where}: {p.words.name}", p.material, p.words) for p in pieces]
        for row in rows or [(where, field.materials[k], field.words[k])]:
            doubts += _part_warnings(*row)
    return tuple(doubts)


def _part_warnings(where: str, material: Material, words: PartDescription) -> list[str]:
    unknown = Note(
        f"{where} is of unknown material; {material.name} is assumed. State its material with --annotations.",
        NoteKind.GRAVE,
    )
    return ([unknown] if words.material is None else []) + [
        f"{where}: {name} of {material.name}: {ground.reason[ground.reason.index(UNFIT_PREFIX) :]}"
        for name, ground in material.grounds.items()
        if UNFIT_PREFIX in ground.reason
    ]


def _part_description(inventory: Inventory, number: int, name: str) -> PartDescription:
    parts = inventory.objects[number].parts
    for words in parts:
        if words.name == name:
            return words
    for piece in (p for words in parts for p in words.pieces):
        if piece.name == name:  # it does not share its surface
            return replace(piece, volume_share=1.0, surface_share=1.0)
    raise UserError(f"The description has no part {name!r}. Describe the scene again.")


def _entry(words: PartDescription, config: GroundConfig) -> MaterialEntry:
    entry = library_entry(words.material or config.neutral, config.library)
    if entry.group == "liquid" and not CONSTITUTIVE_LAWS[entry.law].liquid:
        raise UserError(
            f"{words.name} is described as made of {entry.name}, a liquid, for which its library "
            "has no constitutive law of flow. Annotate its container with structure: filled and "
            "contents: "
            f"{entry.name}."
        )
    return entry


def _material(entry: MaterialEntry, words: PartDescription) -> Material:
    grounds = _placed_values(entry, words)
    for field, stated in words.stated.items():
        if field in entry.ranges:
            grounds[field] = _from_file(stated, entry.ranges[field])
    for field, value in words.values.items():
        allowed = entry.ranges.get(field)
        if allowed is None:
            known = ", ".join(entry.ranges)
            raise UserError(f"{entry.name} has no {field} in the library. It has: {known}.")
        grounds[field] = Provenance(value, allowed, "annotation", "stated in the annotation file", 1.0)
    graded = {f: g.value for f, g in grounds.items() if not _has_own_range(g, entry.ranges.get(f))}
    unfit = value_contradictions(entry.group, entry.ranges, graded)
    for field, clause in unfit.items():
        reason = f"{grounds[field].reason} {UNFIT_PREFIX} {clause}."
        grounds[field] = replace(grounds[field], reason=reason)
    return entry.pick(grounds)


def _has_own_range(ground: Provenance, measured: MeasuredRange | None) -> bool:
    """Whether a value has its own range, not that of a grade of its material."""
    low, high = ground.range.low, ground.range.high
    return low < high and measured is not None and (low, high) != (measured.low, measured.high)


def _from_file(stated: Provenance, measured: MeasuredRange) -> Provenance:
    """Take a value from the scene's file, with the range and the source that it states.

    Files written here state the library's range.
    """
    if (stated.range.low, stated.range.high) == (measured.low, measured.high):
        return replace(stated, range=measured)
    if stated.value in measured or stated.range.low < stated.range.high:
        return stated
    span = f"{measured.low:.4g} to {measured.high:.4g}"
    return replace(stated, reason=f"{stated.reason}. {UNFIT_PREFIX} measured values are {span}.")


def _placed_values(entry: MaterialEntry, words: PartDescription) -> dict[str, Provenance]:
    """Take every value as placed in its range, else the typical one."""
    grounds = _typical_values(entry, words)
    if words.material is None:
        reason = NEUTRAL_MATERIAL_WARNING.format(name=entry.name)
        return {f: Provenance(g.value, g.range, "fallback", reason) for f, g in grounds.items()}
    for field, r in entry.ranges.items():
        chosen = words.placements.get(field)
        if chosen is not None:
            value = value_at_fraction(r, chosen.fraction)
            grounds[field] = Provenance(value, r, chosen.chosen_by, chosen.reason, words.margin)
    return grounds


def _typical_values(entry: MaterialEntry, words: PartDescription) -> dict[str, Provenance]:
    """Take every typical value, and state where its range is an estimate."""
    grounds = {f: replace(g, margin=words.margin) for f, g in entry.typical().items()}
    return {
        f: replace(g, reason=g.reason.replace("measured", "estimated")) if materials.is_estimate(g.range.source) else g
        for f, g in grounds.items()
    }


def _piece(words: PartDescription, config: GroundConfig) -> PartComponent:
    material = _material(_entry(words, config), words)
    return PartComponent(words, material, _structure(material, words, config))


def _scan_thickening_words(words: PartDescription) -> str:
    """Return the stated ratio of real to scanned volume in words."""
    said = words.swelling
    return f" It takes up {said.likely:.0%} of what its scan draws: {said.reason}" if said else ""


def _structure(material: Material, words: PartDescription, config: GroundConfig) -> Structure:
    if words.structure == "solid":
        reason = f"{STRUCTURE_SOURCE_WORDS[words.built_by]} that it is solid.{_scan_thickening_words(words)}"
        return Structure("solid", None, reason)
    if words.structure == "packed":
        share = words.solidity or 1.0
        reason = (
            f"{STRUCTURE_SOURCE_WORDS[words.built_by]} that it is packed: {share:.0%} of its shape "
            "is material."
            f"{_scan_thickening_words(words)}"
        )
        return Structure("solid", None, reason, solidity=share)
    if words.structure is None:
        return Structure("solid", None, "How it is built is unknown: the shape decides.")
    if not (words.material or words.thickness or material.shell_thickness):
        reason = f"It is described as a {words.structure} of unknown material"
        return Structure("solid", None, f"{reason}; {material.name} has none: the shape decides.")
    wall = _wall_thickness(material, words)
    thickness, reason = wall.thickness, wall.reason
    reason = f"{STRUCTURE_SOURCE_WORDS[words.built_by]} that it {WALL_KIND_WORDS[words.structure]}. {reason}"
    if words.structure != "filled":
        return Structure("shell", thickness, reason)
    if words.contents is None:
        raise UserError(
            f"{words.name} is described as filled, but not with what. Give contents in the "
            "annotation file: corporeal materials lists them."
        )
    inside = contents_entry(words.contents, config.library)
    fill = 1.0 if words.fill is None else words.fill
    full = "How full is unknown: it is taken as full." if words.fill is None else ""
    inner = inside.pick(_inner_grounds(inside, words))
    reason = f"{reason} It is filled with {inner.name}. {full}".strip()
    return Structure("filled", thickness, reason, inner, fill, loose=_flows(inside))


def _structure_of_part(
    material: Material, words: PartDescription, config: GroundConfig, scene: Scene, number: int
) -> Structure:
    """Return the structure of a part, with sealed air."""
    bare = _structure(material, words, config)
    if words.inflation is None:
        return bare
    return with_sealed_air(bare, material, words, ball_radius(scene, number))


def _structure_rebound(material: Material, structure: Structure, rebound: float | None) -> Material:
    """Set restitution of a sealed wall from its bulk loss, and of a solid ball from the rules of its sport."""
    if structure.sealed:
        return sealed_wall_material(material)
    return solid_with_ruled_restitution(material, rebound) if structure.kind == "solid" else material


def ball_radius(scene: Scene, number: int) -> float:
    """Half of the middle extent of a real object [m]: the radius of a ball."""
    points = np.concatenate([s.vertices for s in scene.surfaces if s.object == number])
    return 0.5 * float(np.median(np.ptp(points, axis=0))) / scene.objects[number].scale


def with_sealed_air(structure: Structure, material: Material, words: PartDescription, radius: float) -> Structure:
    """Replace a wall with sealed air by an equivalent soft solid, unless it yields when dented.

    Args:
        structure: How the part is built.
        material: Of its wall.
        words: Its description.
        radius: Of the object [m].
    """
    gauge = words.inflation
    if structure.kind != "shell" or structure.thickness is None or gauge is None:
        return structure
    sealed = f"{structure.reason} Air at {gauge / 1e3:.3g} kPa above its surroundings is sealed in it"
    if not is_carried_by_air(gauge, material, structure.thickness, radius):
        if CONSTITUTIVE_LAWS[material.law].flows:
            reason = f"{sealed}, which dents it less than its wall resists."
            return replace(structure, reason=reason, sealed=True)
        reason = f"{sealed}: wall and air act in parallel, as one soft solid."
        inner = air_with_ruled_restitution(
            inflated_ball_material(InflatedBall(gauge, material, structure.thickness, radius)), words.rebound
        )
        built = Structure("filled", structure.thickness, reason, inner, 1.0, inflated=True)
        return replace(built, gauge_pressure=gauge, rebound=words.rebound)
    reason = f"{sealed}: it bounces as a soft solid, nine times as stiff as the pressure."
    inner = air_with_ruled_restitution(sealed_air_material(gauge), words.rebound)
    return Structure("filled", structure.thickness, reason, inner, 1.0, inflated=True)


def _inner_grounds(inside: MaterialEntry, words: PartDescription) -> dict[str, Provenance]:
    grounds = _typical_values(inside, words)
    chosen = words.placements.get(CONTENTS_DENSITY_FIELD)
    if chosen is not None:
        r = inside.ranges["density"]
        value = value_at_fraction(r, chosen.fraction)
        grounds["density"] = Provenance(value, r, chosen.chosen_by, chosen.reason, words.margin)
    return grounds


@dataclass(frozen=True)
class _WallThickness:
    """Thickness of a wall, with its reason."""

    thickness: float
    """[m]"""
    reason: str


def _wall_thickness(material: Material, words: PartDescription) -> _WallThickness:
    if words.thickness:
        whose = "usual of such objects" if words.wall_usual else "stated"
        if words.wall_usual and words.wall_why:
            whose += f": {words.wall_why}"
        return _WallThickness(words.thickness, f"Its thickness, {_mm(words.thickness)} mm, is {whose}.")
    if material.shell_thickness:
        ground = material.grounds["shell_thickness"]
        where = f"{_mm(ground.value)} mm, in the range of {material.name}: " + " to ".join(
            (_mm(ground.range.low), f"{_mm(ground.range.high)} mm.")
        )
        if ground.chosen_by in THICKNESS_SOURCE_WORDS:
            return _WallThickness(ground.value, f"{THICKNESS_SOURCE_WORDS[ground.chosen_by]} its thickness at {where}")
        return _WallThickness(ground.value, f"Its thickness, unless its mesh shows it, is the usual {where}")
    raise UserError(
        f"{words.name} is described as a {words.structure or 'shell'} of {material.name}, but the "
        "thickness of its wall is not known. Give thickness_mm in the annotation file."
    )


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.3g}"


def _flows(entry: MaterialEntry) -> bool:
    return entry.group == "liquid" or CONSTITUTIVE_LAWS[entry.law].granular


@dataclass(frozen=True)
class PairCoefficients:
    """Contact coefficients; see ``MaterialField``."""

    friction: Float[np.ndarray, "K1 K1"]
    restitution: Float[np.ndarray, "K1 K1"]


def pair_coefficients(
    words: Sequence[PartDescription],
    made: Sequence[Material],
    structures: Sequence[Structure],
    config: GroundConfig = DEFAULT_CONFIG,
) -> PairCoefficients:
    """Look up friction and restitution of all pairs of parts, and of each with the floor."""
    surfaces, bodies = [_entry(w, config) for w in words], [*made, _floor(config)]
    surfaces.append(library_entry(config.floor, config.library))
    solid = [*(s.kind == "solid" for s in structures), True]
    strikers = [materials.ImpactBody(*s) for s in zip(surfaces, bodies, solid, strict=True)]
    return PairCoefficients(
        _matrix(len(bodies), lambda a, b: _friction(surfaces, bodies, a, b)),
        _matrix(len(bodies), lambda a, b: materials.pair_restitution(strikers[a], strikers[b]).value),
    )


def _floor(config: GroundConfig) -> Material:
    entry = library_entry(config.floor, config.library)
    return entry.pick(entry.typical())


def _friction(surfaces: list[MaterialEntry], bodies: list[Material], a: int, b: int) -> float:
    """Friction of two parts; a value that a person stated outranks a measured pair."""
    if any(_stated_friction(bodies[k], "friction") for k in (a, b)):
        return materials.combine_friction(bodies[a].friction, bodies[b].friction)
    return materials.friction_between(surfaces[a], surfaces[b]).sliding.typical


def _stated_friction(material: Material, field: str) -> bool:
    return field in material.grounds and material.grounds[field].chosen_by == "annotation"


def _matrix(count: int, pair) -> np.ndarray:
    filled = np.zeros((count, count))
    for a in range(count):
        for b in range(a + 1):
            filled[a, b] = filled[b, a] = pair(a, b)
    return filled
