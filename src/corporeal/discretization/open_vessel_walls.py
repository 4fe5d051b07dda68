"""Open ware: usual wall thickness, and vessels that are modelled as solids."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import MeasuredRange, PartDescription
from corporeal.discretization.drawn_thickness import is_drawn_as_lump, mean_drawn_thickness
from corporeal.materials.range_placement import library_entry
from corporeal.recognition.head_noun import names_several_objects
from corporeal.recognition.lexicon import (
    TokenisedName,
    formed_materials,
    names_hollow_object,
    names_open_vessel,
    names_solid_object,
    names_unknown_object,
    substance_terms,
    wall_table_row,
)
from corporeal.recognition.metadata_recognition import FileEvidence
from corporeal.recognition.parts_by_name import name_words as written

MAX_SOLID_THICKNESS_RATIO = 5.0
"""A mean thickness over the greatest measured wall of its substance, from which an object is drawn as it looks from
outside [-]: of objects of which a name tells the substance alone, solid ones reach 3 (beams, a gun barrel), and those
that turned out hollow begin at 9 (decision mass-by-name).
"""


def hollow_if_too_thick(words: PartDescription, seen: FileEvidence, library: str) -> PartDescription:
    """Give a one-part object a wall if only its substance is known and it is too thick.

    Metal, glass, plastic and ceramics come as sheets, castings and mouldings: a "brass samovar" of 17 kg is none. Open
    ware that is drawn full, as it looks from outside, is no block either.
    """
    named = [name.words for name in seen.general if name.words]
    if words.material is None or words.structure is not None or not seen.alone or not named:
        return words
    if words.material not in formed_materials() or any(names_solid_object(tokens) for tokens in named):
        return words
    if not all(names_unknown_object(tokens) or names_open_vessel(tokens) for tokens in named):
        return words
    if not any(substance_terms(tokens) for tokens in named):  # a part of a machine: "link_2", of "steel"
        return words
    thickest = MAX_SOLID_THICKNESS_RATIO * _greatest_wall(words.material, library)
    thickness = mean_drawn_thickness(seen.surfaces, seen.thing.scale)
    if not 0 < thickest < thickness:
        return words
    because = (
        f"A block {1e3 * thickness:.0f} mm thick would be more than {MAX_SOLID_THICKNESS_RATIO:g} "
        "times as thick as "
        f"any wall of {words.material} was measured: it is assumed hollow."
    )
    return replace(words, structure="shell", reason=f"{words.reason} {because}")


def usual_wall_thickness(material: str | None, library: str) -> float:
    """Return the usual thickness of walls of a material [m]; 0: none was measured."""
    wall = _wall_range(material, library)
    return wall.typical if wall else 0.0


def _greatest_wall(material: str, library: str) -> float:
    """Return the greatest measured thickness of walls of a material [m]; 0: none was."""
    wall = _wall_range(material, library)
    return wall.high if wall else 0.0


def _wall_range(material: str | None, library: str) -> MeasuredRange | None:
    """Return the measured thicknesses of walls of a material [m]; None: there are none."""
    try:
        return library_entry(material, library).ranges.get("shell_thickness") if material else None
    except UserError:
        return None


@dataclass(frozen=True)
class NamedObject:
    """What an object is called, and how large it is."""

    names: Sequence[tuple[str, ...]]
    """Words of each."""
    extent: float
    """Longest side [m]."""


@dataclass(frozen=True)
class OpenVesselWall:
    """The wall that pieces of a name, a material and a size have."""

    thickness: float
    """[m]"""
    why: str
    """Source."""


def with_usual_vessel_wall(words: PartDescription, called: NamedObject) -> PartDescription:
    """Set the usual wall thickness of open ware, if none is stated."""
    if words.thickness is not None and not words.wall_usual:
        return words
    wall = usual_vessel_wall(words.material, called)
    if wall is None:
        return words
    return replace(words, thickness=wall.thickness, wall_usual=True, wall_why=wall.why)


def usual_vessel_wall(material: str | None, called: NamedObject) -> OpenVesselWall | None:
    """Return the wall of open ware that is called so; None: not known.

    Where walls grow with the longest side they are interpolated between sizes in logarithms, and are those of the least
    and the largest beyond.
    """
    if material is None:
        return None
    rows = (wall_table_row(tokens, material, "ware") for tokens in called.names)
    row = next((r for r in rows if r is not None), None)
    if row is None:
        return None
    if "walls_mm" not in row:
        return OpenVesselWall(1e-3 * row["thickness_mm"], row["why"])
    sizes, walls = np.log(1e-3 * np.array(row["walls_mm"], dtype=float)).T
    thickness = float(np.exp(np.interp(np.log(called.extent), sizes, walls)))
    return OpenVesselWall(thickness, f"{row['why']}, at {called.extent * 100:.0f} cm")


def sheet_if_drawn_full(words: PartDescription, seen: FileEvidence, library: str) -> PartDescription:
    """Replace open ware whose mesh fills its hollow by a sheet along its outside.

    A wall with both faces is as it is drawn, and so are a stack, what is a closed wall whatever it is called, and what
    need not be hollow: a bowl of wood, a steel plate.
    """
    closed = words.structure is not None and (words.structure != "shell" or not words.thickness)
    if closed or not seen.alone or not seen.general:
        return words
    if any(_is_no_single_vessel(name) for name in seen.general):
        return words
    named = [name.words for name in seen.general]
    known = usual_vessel_wall(words.material, NamedObject(named, seen.extent))
    wall = known.thickness if known else None
    if wall is None and words.material in formed_materials() and not any(map(names_solid_object, named)):
        wall = usual_wall_thickness(words.material, library)
    if not wall or not is_drawn_as_lump(seen.surfaces, wall, seen.thing.scale):
        return words
    because = "Its mesh fills its hollow: it is assumed to be a wall along its outside."
    return replace(words, structure="sheet", wall_unseen=True, reason=f"{words.reason} {because}")


def _is_no_single_vessel(name: TokenisedName) -> bool:
    """Return whether a name is not that of one piece of ware that is open by what it is."""
    tokens = name.words
    return not names_open_vessel(tokens) or names_hollow_object(tokens) or names_several_objects(written(name.text))
