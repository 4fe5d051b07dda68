"""Descriptions of parts from names and metadata in the file."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

from corporeal import materials
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.types import MeasuredRange, ObjectDescription, PartDescription, Provenance, Scene, Surface
from corporeal.discretization.open_vessel_walls import (
    NamedObject,
    hollow_if_too_thick,
    sheet_if_drawn_full,
    with_usual_vessel_wall,
)
from corporeal.materials.quantities import QUANTITIES
from corporeal.materials.range_placement import library_entry
from corporeal.recognition.contents_from_name import apply_named_contents
from corporeal.recognition.metadata_recognition import gather_file_evidence, infer_hollow_structure, recognise_part
from corporeal.recognition.name_priors import usual_inflation, usual_rebound
from corporeal.recognition.parts_by_name import PartsByName
from corporeal.recognition.stated_properties import (
    apply_inflation,
    apply_stated_structure,
    apply_stated_wall,
    stated_inflation,
    stated_substance,
    stated_thickness,
    stated_values,
)
from corporeal.recognition.wet_materials import wet_material_values

OPEN_WARE_MARK = ("sheet", "metadata")
"""Open vessels by name, and the source."""


def parts_from_file(
    scene: Scene, identity: PartsByName, library: str, from_pictures: Collection[int], unasked: bool
) -> list[list[PartDescription]]:
    """Describe each part of each object by the file: stated, or recognised from names.

    Args:
        scene: What was assembled.
        identity: Its parts.
        library: Where materials are looked up.
        from_pictures: Objects, by number, whose surfaces need not show the inside of vessels.
        unasked: No model is asked: wetness in names and implausible thickness count.

    Raises:
        UserError: A number in the file can be no material's.
    """
    words: list[list[PartDescription]] = [[] for _ in scene.objects]
    walls = partial(has_wall_thickness, library)
    for entry, seen in zip(identity.catalogue, gather_file_evidence(scene, identity), strict=True):
        pictured = entry.object in from_pictures
        found = stated_material(list(seen.surfaces), library) or infer_hollow_structure(
            recognise_part(seen), seen, walls, pictured
        )
        if unasked:
            called = NamedObject([name.words for name in seen.general], seen.extent)
            found = with_usual_vessel_wall(found, called)
        if unasked and not pictured:
            found = sheet_if_drawn_full(hollow_if_too_thick(found, seen, library), seen, library)
        if not pictured:
            found = apply_named_contents(found, seen, found.material is None or walls(found.material))
        by = "metadata" if found.material else "unknown"
        found = replace(found, name=entry.name, answered_by=by)
        found = apply_stated_wall(found, stated_thickness(seen.surfaces))
        stated = _checked_values(seen.surfaces)
        if unasked:
            dry = _density(found.material, library)
            stated = wet_material_values(seen.general, found.material, dry) | stated
        found = replace(apply_stated_structure(found, seen.surfaces), stated=stated)
        found = apply_inflation(found, stated_inflation(seen.surfaces), usual_inflation(seen))
        found = replace(found, rebound=usual_rebound(seen))
        built_by = "metadata" if found.structure else "unknown"
        words[entry.object].append(replace(found, built_by=built_by))
    return words


def open_ware_notes(objects: Sequence[ObjectDescription]) -> tuple[str, ...]:
    """Return notes on objects from pictures that are open ware by name."""
    made = [(o.name, p) for o in objects for p in o.parts if (p.structure, p.built_by) == OPEN_WARE_MARK]
    return tuple(
        f"{name}: pictures may not show its inside. By its name it is open ware, with a wall along "
        f"its outside {_wall_text(part)}, and empty; annotate structure and thickness_mm if that "
        "is wrong."
        for name, part in made
    )


def _wall_text(part: PartDescription) -> str:
    """Return how thick the wall of open ware is taken to be, and why."""
    if part.thickness is None or not part.wall_usual:
        return "as thick as such walls usually are"
    why = f" ({part.wall_why})" if part.wall_why else ""
    return f"as thick as such ware usually has: {part.thickness * 1e3:.2g} mm{why}"


def has_wall_thickness(library: str, name: str) -> bool:
    """Whether a library has a wall thickness for a material."""
    try:
        return "shell_thickness" in library_entry(name, library).ranges
    except UserError:
        return True


def _density(material: str | None, library: str) -> MeasuredRange | None:
    """Return what a library knows of a material's density; None: nothing."""
    try:
        return library_entry(material, library).ranges.get("density") if material else None
    except UserError:
        return None


def _checked_values(surfaces: Sequence[Surface]) -> dict[str, Provenance]:
    """Return the values that the file states of known quantities.

    Raises:
        UserError: A value is impossible for any material.
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


def stated_material(surfaces: list[Surface], library: str) -> PartDescription | None:
    """Return the material that the file states; None: none of the library."""
    substance = stated_substance(surfaces)
    if substance is None:
        return None
    try:
        entry = materials.find_material_or_default(substance, library)
    except UnknownChoiceError:
        return None  # not in the library: names may still identify it
    return PartDescription("", entry.name, margin=1.0, reason=f"The file states it: {substance!r}.")
