"""What names and statements in the file say of each part."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

from corporeal import materials
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.types import (
    Ground,
    ObjectWords,
    PartWords,
    Range,
    Scene,
    Surface,
)
from corporeal.discretization.no_block import no_block
from corporeal.discretization.ware import Called, sheet_if_full, with_usual_wall
from corporeal.materials.placement import (
    entry_of,
)
from corporeal.materials.quantities import QUANTITIES
from corporeal.recognition.identity import Identity
from corporeal.recognition.metadata import (
    evidence,
    hollowed,
    recognise,
)
from corporeal.recognition.said_contents import as_said
from corporeal.recognition.stated import (
    as_stated,
    sealed,
    stated_inflation,
    stated_substance,
    stated_thickness,
    stated_values,
    walled,
)
from corporeal.recognition.usual import usual_inflation, usual_rebound
from corporeal.recognition.wet import values_when_wet

OPEN = ("sheet", "metadata")
"""What an open vessel is by its name, and who says so."""


def words_of_file(
    scene: Scene,
    identity: Identity,
    library: str,
    from_pictures: Collection[int],
    unasked: bool,
) -> list[list[PartWords]]:
    """Return what the file says of each part of each object: stated, or recognised by its names.

    Args:
        scene: What was assembled.
        identity: Its parts.
        library: Where materials are looked up.
        from_pictures: Objects, by number, whose surfaces need not show how deep a vessel is.
        unasked: No model looks: that a name says wet counts, and what is too thick for a block.

    Raises:
        UserError: A number in the file can be no material's.

    """
    words: list[list[PartWords]] = [[] for _ in scene.objects]
    walls = partial(has_wall, library)
    for entry, seen in zip(identity.catalogue, evidence(scene, identity), strict=True):
        pictured = entry.object in from_pictures
        found = stated_material(list(seen.surfaces), library) or hollowed(
            recognise(seen), seen, walls, pictured
        )
        if unasked:
            called = Called([name.words for name in seen.general], seen.extent)
            found = with_usual_wall(found, called)
        if unasked and not pictured:
            found = sheet_if_full(no_block(found, seen, library), seen, library)
        if not pictured:
            found = as_said(found, seen, found.material is None or walls(found.material))
        by = "metadata" if found.material else "unknown"
        found = replace(found, name=entry.name, answered_by=by)
        found = walled(found, stated_thickness(seen.surfaces))
        stated = _stated_values(seen.surfaces)
        if unasked:
            dry = _density(found.material, library)
            stated = values_when_wet(seen.general, found.material, dry) | stated
        found = replace(as_stated(found, seen.surfaces), stated=stated)
        found = sealed(found, stated_inflation(seen.surfaces), usual_inflation(seen))
        found = replace(found, rebound=usual_rebound(seen))
        built_by = "metadata" if found.structure else "unknown"
        words[entry.object].append(replace(found, built_by=built_by))
    return words


def open_ware(objects: Sequence[ObjectWords]) -> tuple[str, ...]:
    """Say of which objects from pictures the name decided that they are no solids."""
    made = [(o.name, p) for o in objects for p in o.parts if (p.structure, p.built_by) == OPEN]
    return tuple(
        f"{name}: pictures need not show how deep it is inside. By its name it is taken for open "
        f"ware, with a wall along its outside {_how_thick(part)}, and empty "
        "inside of that; annotate structure and thickness_mm if that is wrong."
        for name, part in made
    )


def _how_thick(part: PartWords) -> str:
    """Say how thick the wall of open ware is taken to be, and why."""
    if part.thickness is None or not part.wall_usual:
        return "as thick as such walls usually are"
    why = f" ({part.wall_why})" if part.wall_why else ""
    return f"as thick as such ware usually has: {part.thickness * 1e3:.2g} mm{why}"


def has_wall(library: str, name: str) -> bool:
    """Whether a library has a wall thickness for a material; where it has neither, nobody knows."""
    try:
        return "shell_thickness" in entry_of(name, library).ranges
    except UserError:
        return True


def _density(material: str | None, library: str) -> Range | None:
    """Return what a library knows of a material's density; None: nothing."""
    try:
        return entry_of(material, library).ranges.get("density") if material else None
    except UserError:
        return None


def _stated_values(surfaces: Sequence[Surface]) -> dict[str, Ground]:
    """Return the numbers that the file states, of quantities that there are.

    Raises:
        UserError: One of them can be no material's.

    """
    found = {n: g for n, g in stated_values(surfaces).items() if n in QUANTITIES}
    for name, ground in found.items():
        quantity = QUANTITIES[name]
        if not quantity.low <= ground.value <= quantity.high:
            unit = "" if quantity.unit == "-" else f" {quantity.unit}"
            raise UserError(
                f"{surfaces[0].name}: {quantity.words.lower()} {ground.value:.4g}{unit} "
                f"({ground.range.source}): no material has less than {quantity.low:g} or more than "
                f"{quantity.high:g}{unit}. Correct the file, or its units of length and mass."
            )
    return found


def stated_material(surfaces: list[Surface], library: str) -> PartWords | None:
    """Return the material that the file states outright; None: none that the library has."""
    substance = stated_substance(surfaces)
    if substance is None:
        return None
    try:
        entry = materials.named(substance, library)
    except UnknownChoiceError:
        return None  # not in the library: names may still identify it
    return PartWords("", entry.name, margin=1.0, reason=f"The file states it: {substance!r}.")
