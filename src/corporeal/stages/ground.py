"""Ground: turn a material's name into numbers, inside the range that somebody measured."""

from dataclasses import dataclass

import numpy as np

from corporeal import materials
from corporeal.errors import UserError
from corporeal.materials import Entry
from corporeal.types import (
    Ground,
    Inventory,
    Material,
    MaterialField,
    Parts,
    PartWords,
    Scene,
    Structure,
)


@dataclass(frozen=True)
class GroundConfig:
    """Where the numbers come from."""

    library: str = "default"
    """"default", "reference" (the 22 materials as first published), or the path of a TOML file."""
    floor: str = "concrete"
    """What the floor and the walls are made of, for friction and rebound."""
    neutral: str = "plastics-PP"
    """What stands in for a part of unknown material."""


DEFAULT = GroundConfig()
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
    floor = _find(config.floor, config.library)
    surfaces, bodies = [*entries, floor], [*made, floor.pick(floor.typical())]
    return MaterialField(
        materials=made,
        structures=tuple(_structure(m, w) for m, w in zip(made, words, strict=True)),
        words=words,
        friction=_matrix(len(bodies), lambda a, b: _friction(surfaces, bodies, a, b)),
        restitution=_matrix(
            len(bodies), lambda a, b: materials.restitution_between(bodies[a], bodies[b])
        ),
    )


def doubts(field: MaterialField, parts: Parts, scene: Scene) -> tuple[str, ...]:
    """Say, one sentence each, which parts' materials nobody knew."""
    return tuple(
        f"{scene.objects[part.object].name}: {part.name} is of unknown material; {material.name} "
        "stands in. Say what it is with --annotations."
        for part, material, words in zip(parts.catalogue, field.materials, field.words, strict=True)
        if words.material is None
    )


def _words(inventory: Inventory, number: int, name: str) -> PartWords:
    for words in inventory.objects[number].parts:
        if words.name == name:
            return words
    raise UserError(f"The description has no part {name!r}. Describe the scene again.")


def _entry(words: PartWords, config: GroundConfig) -> Entry:
    return _find(words.material or config.neutral, config.library)


def _find(name: str, library: str) -> Entry:
    """Look a material up; a smaller library gives what stands for it there."""
    entries = materials.library(library)
    return (
        entries[name] if name in entries else materials.counterpart(materials.find(name), library)
    )


# ---------------------------------------------------------------- numbers


def _material(entry: Entry, words: PartWords) -> Material:
    grounds = entry.typical()
    if words.material is None:
        reason = NEUTRAL.format(name=entry.name)
        grounds = {f: Ground(g.value, g.range, "fallback", reason) for f, g in grounds.items()}
    for field, value in words.values.items():
        allowed = entry.ranges.get(field)
        if allowed is None:
            known = ", ".join(entry.ranges)
            raise UserError(f"{entry.name} has no {field} in the library. It has: {known}.")
        grounds[field] = Ground(value, allowed, "annotation", "stated in the annotation file")
    return entry.pick(grounds)


def _structure(material: Material, words: PartWords) -> Structure:
    if words.structure == "shell":
        if words.thickness:
            return Structure("shell", words.thickness, "The wall's thickness is stated.")
        if material.shell_thickness:
            reason = f"Such walls of {material.name} are usually this thin."
            return Structure("shell", material.shell_thickness, reason)
        raise UserError(
            f"{words.name} is said to be a shell of {material.name}, but how thin is not known. "
            "Give thickness_mm in the annotation file."
        )
    if words.structure == "solid":
        return Structure("solid", None, "It is stated to be solid.")
    return Structure("solid", None, "How it is built is not said: the shape decides.")


# ---------------------------------------------------------------- pairs


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
