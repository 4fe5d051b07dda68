"""Prior for hollow objects: implausibly thick objects without a known name are hollow."""

from dataclasses import replace

from corporeal.core.errors import UserError
from corporeal.core.types import MeasuredRange, PartDescription
from corporeal.discretization.drawn_thickness import mean_drawn_thickness
from corporeal.materials.range_placement import library_entry
from corporeal.recognition.lexicon import (
    formed_materials,
    names_open_vessel,
    names_solid_object,
    names_unknown_object,
    substance_terms,
)
from corporeal.recognition.metadata_recognition import FileEvidence

MAX_SOLID_THICKNESS_RATIO = 5.0
"""A mean thickness over the greatest measured wall of its substance, from which an object is drawn
as it looks from outside [-]: of objects of which a name tells the substance alone, solid ones reach
3 (beams, a gun barrel), and those that turned out hollow begin at 9 (decision 110).
"""


def hollow_if_too_thick(
    words: PartDescription, seen: FileEvidence, library: str
) -> PartDescription:
    """Give a one-part object a wall if only its substance is known and it is too thick.

    Metal, glass, plastic and ceramics come as sheets, castings and mouldings: a "brass samovar" of
    17 kg is none. Open ware that is drawn full, as it looks from outside, is no block either.

    Args:
        words: What was recognised of a part.
        seen: All that the file says about it.
        library: Where materials are looked up.

    """
    named = [name.words for name in seen.general if name.words]
    if words.material is None or words.structure is not None or not seen.alone or not named:
        return words
    if words.material not in formed_materials() or any(
        names_solid_object(tokens) for tokens in named
    ):
        return words
    if not all(names_unknown_object(tokens) or names_open_vessel(tokens) for tokens in named):
        return words
    if not any(
        substance_terms(tokens) for tokens in named
    ):  # a part of a machine: "link_2", of "steel"
        return words
    thickest = MAX_SOLID_THICKNESS_RATIO * _greatest_wall(words.material, library)
    thickness = mean_drawn_thickness(seen.surfaces, seen.thing.scale)
    if not 0 < thickest < thickness:
        return words
    told = (
        f"A block {1e3 * thickness:.0f} mm thick would be more than {MAX_SOLID_THICKNESS_RATIO:g} "
        "times as thick as "
        f"any wall of {words.material} was measured: it is assumed hollow."
    )
    return replace(words, structure="shell", reason=f"{words.reason} {told}")


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
