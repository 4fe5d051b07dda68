"""Ground: turn a material's name into numbers, inside the range that somebody measured."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal import materials
from corporeal.core.errors import UserError
from corporeal.core.types import (
    Ground,
    Inventory,
    Material,
    MaterialField,
    Note,
    NoteKind,
    Parts,
    PartWords,
    Piece,
    Range,
    Scene,
    Structure,
)
from corporeal.fields.impose import impose
from corporeal.materials import Entry
from corporeal.materials.consistency import contradictions
from corporeal.materials.inflated import (
    SealedBall,
    air_bears,
    as_ruled,
    as_sealed_wall,
    sealed_air,
    sealed_ball,
    solid_as_ruled,
)
from corporeal.materials.placement import CONTENTS, entry_of, held
from corporeal.materials.scale import place
from corporeal.mpm.laws import MENU
from corporeal.pipeline.settings.ground_config import GroundConfig

DEFAULT = GroundConfig()
BUILT_BY = {
    "annotation": "Your annotation says",
    "recording": "A recorded answer says",
    "model": "A model says",
    "metadata": "The file's metadata says",
    "unknown": "It is assumed",
}
"""The source of how a part is built."""
WALLS = {
    "shell": "has a wall",
    "sheet": "is a wall formed into something open",
    "hollow": "is a closed wall with air behind it",
    "filled": "has a wall",
}
"""How a part that has a wall is described."""
PUT = {
    "annotation": "Your annotation puts",
    "recording": "A recorded answer puts",
    "model": "A model puts",
    "evidence": "The estimate of its mass puts",
}
"""Who chose a wall's thickness."""
UNFIT = "It does not fit the others:"
NEUTRAL = (
    "Nobody knows what this part is made of. {name} stands in: the commonest moulded plastic, "
    "whose density and stiffness lie in the middle of what everyday solids have."
)


def ground(
    scene: Scene, parts: Parts, inventory: Inventory, config: GroundConfig = DEFAULT
) -> MaterialField:
    """Choose every value of every part, each with its range, its source and a reason.

    Raises:
        OutOfRangeError: An annotated value lies outside the measured range.
        UserError: The library has no such material or quantity.

    """
    words = tuple(_words(inventory, part.object, part.name) for part in parts.catalogue)
    entries = [_entry(w, config) for w in words]
    made = tuple(_material(e, w) for e, w in zip(entries, words, strict=True))
    structures = tuple(
        _built(m, w, config, scene, part.object)
        for m, w, part in zip(made, words, parts.catalogue, strict=True)
    )
    made = tuple(
        _as_built(m, s, w.rebound) for m, s, w in zip(made, structures, words, strict=True)
    )
    touching = pairs(words, made, structures, config)
    found = MaterialField(
        materials=made,
        structures=structures,
        words=words,
        friction=touching.friction,
        restitution=touching.restitution,
        pieces=tuple(tuple(_piece(p, config) for p in w.pieces) for w in words),
        floor=_floor(config),
    )
    return impose(found, scene, parts, config.field)


def doubts(field: MaterialField, parts: Parts, scene: Scene) -> tuple[str, ...]:
    """Say, one sentence each, which materials nobody knew and which values are to be doubted."""
    doubts = list(field.notes)
    for k, part in enumerate(parts.catalogue):
        owner = scene.objects[part.object].name
        where = owner if owner == part.name else f"{owner}: {part.name}"
        pieces = field.pieces[k] if field.pieces else ()
        rows = [(f"{where}: {p.words.name}", p.material, p.words) for p in pieces]
        for row in rows or [(where, field.materials[k], field.words[k])]:
            doubts += _doubts(*row)
    return tuple(doubts)


def _doubts(where: str, material: Material, words: PartWords) -> list[str]:
    unknown = Note(
        f"{where} is of unknown material; {material.name} stands in. Say what it is with "
        "--annotations.",
        NoteKind.GRAVE,
    )
    return ([unknown] if words.material is None else []) + [
        f"{where}: {name} of {material.name}: {ground.reason[ground.reason.index(UNFIT) :]}"
        for name, ground in material.grounds.items()
        if UNFIT in ground.reason
    ]


def _words(inventory: Inventory, number: int, name: str) -> PartWords:
    parts = inventory.objects[number].parts
    for words in parts:
        if words.name == name:
            return words
    for piece in (p for words in parts for p in words.pieces):
        if piece.name == name:  # it has a surface of its own, and shares it with nobody
            return replace(piece, volume_share=1.0, surface_share=1.0)
    raise UserError(f"The description has no part {name!r}. Describe the scene again.")


def _entry(words: PartWords, config: GroundConfig) -> Entry:
    entry = entry_of(words.material or config.neutral, config.library)
    if entry.group == "liquid" and not MENU[entry.law].liquid:
        raise UserError(
            f"{words.name} is described as made of {entry.name}, a liquid, for which its library "
            "has no law of flow. Say what holds it, with structure: filled and contents: "
            f"{entry.name}."
        )
    return entry


# ---------------------------------------------------------------- numbers


def _material(entry: Entry, words: PartWords) -> Material:
    grounds = _placed(entry, words)
    for field, stated in words.stated.items():
        if field in entry.ranges:
            grounds[field] = _from_file(stated, entry.ranges[field])
    for field, value in words.values.items():
        allowed = entry.ranges.get(field)
        if allowed is None:
            known = ", ".join(entry.ranges)
            raise UserError(f"{entry.name} has no {field} in the library. It has: {known}.")
        grounds[field] = Ground(value, allowed, "annotation", "stated in the annotation file", 1.0)
    graded = {f: g.value for f, g in grounds.items() if not _beside(g, entry.ranges.get(f))}
    unfit = contradictions(entry.group, entry.ranges, graded)
    for field, clause in unfit.items():
        reason = f"{grounds[field].reason} {UNFIT} {clause}."
        grounds[field] = replace(grounds[field], reason=reason)
    return entry.pick(grounds)


def _beside(ground: Ground, measured: Range | None) -> bool:
    """Whether a value has a span of its own: of a wet foam, not of a grade of its material."""
    low, high = ground.range.low, ground.range.high
    return low < high and measured is not None and (low, high) != (measured.low, measured.high)


def _from_file(stated: Ground, measured: Range) -> Ground:
    """Believe a number of the scene's file: in the range that the file names, from its source.

    A file of ours names the library's range, and then that is it.
    """
    if (stated.range.low, stated.range.high) == (measured.low, measured.high):
        return replace(stated, range=measured)
    if stated.value in measured or stated.range.low < stated.range.high:
        return stated
    span = f"{measured.low:.4g} to {measured.high:.4g}"
    return replace(stated, reason=f"{stated.reason}. {UNFIT} measured values are {span}.")


def _placed(entry: Entry, words: PartWords) -> dict[str, Ground]:
    """Take every value where it was placed in its range, and where nobody placed it, the usual."""
    grounds = _usual(entry, words)
    if words.material is None:
        reason = NEUTRAL.format(name=entry.name)
        return {f: Ground(g.value, g.range, "fallback", reason) for f, g in grounds.items()}
    for field, r in entry.ranges.items():
        chosen = words.placements.get(field)
        if chosen is not None:
            value = place(r, chosen.fraction)
            grounds[field] = Ground(value, r, chosen.chosen_by, chosen.reason, words.margin)
    return grounds


def _usual(entry: Entry, words: PartWords) -> dict[str, Ground]:
    """Take every usual value, and say where its range is an estimate."""
    grounds = {f: replace(g, margin=words.margin) for f, g in entry.typical().items()}
    return {
        f: replace(g, reason=g.reason.replace("measured", "estimated"))
        if materials.estimated(g.range.source)
        else g
        for f, g in grounds.items()
    }


def _piece(words: PartWords, config: GroundConfig) -> Piece:
    material = _material(_entry(words, config), words)
    return Piece(words, material, _structure(material, words, config))


def _real(words: PartWords) -> str:
    """Say how much of what its scan draws is real, where somebody said."""
    said = words.swelling
    return f" It takes up {said.likely:.0%} of what its scan draws: {said.reason}" if said else ""


def _structure(material: Material, words: PartWords, config: GroundConfig) -> Structure:
    if words.structure == "solid":
        reason = f"{BUILT_BY[words.built_by]} that it is solid.{_real(words)}"
        return Structure("solid", None, reason)
    if words.structure == "packed":
        share = words.solidity or 1.0
        reason = (
            f"{BUILT_BY[words.built_by]} that it is packed: {share:.0%} of its shape is matter."
            f"{_real(words)}"
        )
        return Structure("solid", None, reason, solidity=share)
    if words.structure is None:
        return Structure("solid", None, "How it is built is unknown: the shape decides.")
    if not (words.material or words.thickness or material.shell_thickness):
        reason = f"It is described as a {words.structure} of unknown material"
        return Structure(
            "solid", None, f"{reason}; of {material.name} none are: the shape decides."
        )
    wall = _wall(material, words)
    thickness, reason = wall.thickness, wall.reason
    reason = f"{BUILT_BY[words.built_by]} that it {WALLS[words.structure]}. {reason}"
    if words.structure != "filled":
        return Structure("shell", thickness, reason)
    if words.contents is None:
        raise UserError(
            f"{words.name} is described as filled, but not with what. Give contents in the "
            "annotation file: corporeal materials lists them."
        )
    inside = held(words.contents, config.library)
    fill = 1.0 if words.fill is None else words.fill
    full = "How full is unknown: it is taken as full." if words.fill is None else ""
    inner = inside.pick(_inner_grounds(inside, words))
    reason = f"{reason} It is filled with {inner.name}. {full}".strip()
    return Structure("filled", thickness, reason, inner, fill, loose=_flows(inside))


def _built(
    material: Material, words: PartWords, config: GroundConfig, scene: Scene, number: int
) -> Structure:
    """Say how a part of one object is built, and what air is sealed in it."""
    bare = _structure(material, words, config)
    if words.inflation is None:
        return bare
    return with_air(bare, material, words, radius(scene, number))


def _as_built(material: Material, structure: Structure, rebound: float | None) -> Material:
    """Let a sealed wall rebound as its bulk does, and a solid ball as the rules of its sport."""
    if structure.sealed:
        return as_sealed_wall(material)
    return solid_as_ruled(material, rebound) if structure.kind == "solid" else material


def radius(scene: Scene, number: int) -> float:
    """Half of the middle extent of a real object [m]: the radius of a ball."""
    points = np.concatenate([s.vertices for s in scene.surfaces if s.object == number])
    return 0.5 * float(np.median(np.ptp(points, axis=0))) / scene.objects[number].scale


def with_air(
    structure: Structure, material: Material, words: PartWords, radius: float
) -> Structure:
    """Make a wall with sealed air behind it a soft solid, unless it flows when it is dented.

    Args:
        structure: How the part is built.
        material: Of its wall.
        words: Its description.
        radius: Of the object [m].

    """
    gauge = words.inflation
    if structure.kind != "shell" or structure.thickness is None or gauge is None:
        return structure
    sealed = (
        f"{structure.reason} Air at {gauge / 1e3:.3g} kPa above its surroundings is sealed in it"
    )
    if not air_bears(gauge, material, structure.thickness, radius):
        if MENU[material.law].flows:
            reason = f"{sealed}, which dents it less than its wall resists."
            return replace(structure, reason=reason, sealed=True)
        reason = f"{sealed}: wall and air bounce side by side, as one soft solid."
        inner = as_ruled(
            sealed_ball(SealedBall(gauge, material, structure.thickness, radius)), words.rebound
        )
        built = Structure("filled", structure.thickness, reason, inner, 1.0, inflated=True)
        return replace(built, gauge=gauge, rebound=words.rebound)
    reason = f"{sealed}: it bounces as a soft solid, nine times as stiff as the pressure."
    inner = as_ruled(sealed_air(gauge), words.rebound)
    return Structure("filled", structure.thickness, reason, inner, 1.0, inflated=True)


def _inner_grounds(inside: Entry, words: PartWords) -> dict[str, Ground]:
    grounds = _usual(inside, words)
    chosen = words.placements.get(CONTENTS)
    if chosen is not None:
        r = inside.ranges["density"]
        value = place(r, chosen.fraction)
        grounds["density"] = Ground(value, r, chosen.chosen_by, chosen.reason, words.margin)
    return grounds


@dataclass(frozen=True)
class _Wall:
    """How thick a wall is, and why."""

    thickness: float
    """[m]"""
    reason: str


def _wall(material: Material, words: PartWords) -> _Wall:
    if words.thickness:
        whose = "usual of such things" if words.wall_usual else "stated"
        if words.wall_usual and words.wall_why:
            whose += f": {words.wall_why}"
        return _Wall(words.thickness, f"Its thickness, {_mm(words.thickness)} mm, is {whose}.")
    if material.shell_thickness:
        ground = material.grounds["shell_thickness"]
        where = f"{_mm(ground.value)} mm, in the range of {material.name}: " + " to ".join(
            (_mm(ground.range.low), f"{_mm(ground.range.high)} mm.")
        )
        if ground.chosen_by in PUT:
            return _Wall(ground.value, f"{PUT[ground.chosen_by]} its thickness at {where}")
        return _Wall(ground.value, f"Its thickness, unless its mesh shows it, is the usual {where}")
    raise UserError(
        f"{words.name} is described as a {words.structure or 'shell'} of {material.name}, but how "
        "thin its wall is is not known. Give thickness_mm in the annotation file."
    )


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.3g}"


def _flows(entry: Entry) -> bool:
    return entry.group == "liquid" or MENU[entry.law].granular


# ---------------------------------------------------------------- pairs


@dataclass(frozen=True)
class Pairs:
    """What happens where parts touch; see ``MaterialField``."""

    friction: Float[np.ndarray, "K1 K1"]
    restitution: Float[np.ndarray, "K1 K1"]


def pairs(
    words: Sequence[PartWords],
    made: Sequence[Material],
    structures: Sequence[Structure],
    config: GroundConfig = DEFAULT,
) -> Pairs:
    """Look up friction and restitution of all pairs of parts, and of each with the floor.

    Args:
        words: Of every part.
        made: Its material.
        structures: How it is built.
        config: Which library, and what the floor is made of.

    """
    surfaces, bodies = [_entry(w, config) for w in words], [*made, _floor(config)]
    surfaces.append(entry_of(config.floor, config.library))
    solid = [*(s.kind == "solid" for s in structures), True]
    strikers = [materials.Striker(*s) for s in zip(surfaces, bodies, solid, strict=True)]
    return Pairs(
        _matrix(len(bodies), lambda a, b: _friction(surfaces, bodies, a, b)),
        _matrix(len(bodies), lambda a, b: materials.restitution(strikers[a], strikers[b]).value),
    )


def _floor(config: GroundConfig) -> Material:
    entry = entry_of(config.floor, config.library)
    return entry.pick(entry.typical())


def _friction(surfaces: list[Entry], bodies: list[Material], a: int, b: int) -> float:
    """Friction of two parts; a value that a person stated outranks a measured pair."""
    if any(_stated(bodies[k], "friction") for k in (a, b)):
        return materials.combine(bodies[a].friction, bodies[b].friction)
    return materials.friction_between(surfaces[a], surfaces[b]).sliding.typical


def _stated(material: Material, field: str) -> bool:
    return field in material.grounds and material.grounds[field].chosen_by == "annotation"


def _matrix(count: int, pair) -> np.ndarray:
    filled = np.zeros((count, count))
    for a in range(count):
        for b in range(a + 1):
            filled[a, b] = filled[b, a] = pair(a, b)
    return filled
