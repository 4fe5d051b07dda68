"""Open ware: usual wall thickness, and vessels that are modelled as solids."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.types import PartDescription
from corporeal.discretization.drawn_thickness import is_drawn_as_lump
from corporeal.discretization.hollow_prior import usual_wall_thickness
from corporeal.recognition.head_noun import names_several_objects
from corporeal.recognition.lexicon import (
    TokenisedName,
    formed_materials,
    names_hollow_object,
    names_open_vessel,
    names_solid_object,
    wall_table_row,
)
from corporeal.recognition.metadata_recognition import FileEvidence
from corporeal.recognition.parts_by_name import name_words as written


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
    """Set the usual wall thickness of open ware, if none is stated.

    Args:
        words: Of a part.
        called: The object.

    """
    if words.thickness is not None and not words.wall_usual:
        return words
    wall = usual_vessel_wall(words.material, called)
    if wall is None:
        return words
    return replace(words, thickness=wall.thickness, wall_usual=True, wall_why=wall.why)


def usual_vessel_wall(material: str | None, called: NamedObject) -> OpenVesselWall | None:
    """Return the wall of open ware that is called so; None: not known.

    Where walls grow with the longest side they are interpolated between sizes in logarithms, and
    are those of the least and the largest beyond.

    Args:
        material: What it is of.
        called: The object.

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


def sheet_if_drawn_full(
    words: PartDescription, seen: FileEvidence, library: str
) -> PartDescription:
    """Replace open ware whose mesh fills its hollow by a sheet along its outside.

    A wall with both faces is as it is drawn, and so are a stack, what is a closed wall whatever it
    is called, and what need not be hollow: a bowl of wood, a steel plate.

    Args:
        words: What was recognised of a part.
        seen: All that the file says about it.
        library: Where materials are looked up.

    """
    closed = words.structure is not None and (words.structure != "shell" or not words.thickness)
    if closed or not seen.alone or not seen.general:
        return words
    if any(_is_no_single_vessel(name) for name in seen.general):
        return words
    named = [name.words for name in seen.general]
    known = usual_vessel_wall(words.material, NamedObject(named, seen.extent))
    wall = known.thickness if known else None
    if (
        wall is None
        and words.material in formed_materials()
        and not any(map(names_solid_object, named))
    ):
        wall = usual_wall_thickness(words.material, library)
    if not wall or not is_drawn_as_lump(seen.surfaces, wall, seen.thing.scale):
        return words
    told = "Its mesh fills its hollow: it is assumed to be a wall along its outside."
    return replace(words, structure="sheet", wall_unseen=True, reason=f"{words.reason} {told}")


def _is_no_single_vessel(name: TokenisedName) -> bool:
    """Return whether a name is not that of one piece of ware that is open by what it is."""
    tokens = name.words
    return (
        not names_open_vessel(tokens)
        or names_hollow_object(tokens)
        or names_several_objects(written(name.text))
    )
