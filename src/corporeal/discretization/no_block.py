"""What is far thicker than any wall of its substance, and called by no known name, is no block."""

from dataclasses import replace

from corporeal.core.errors import UserError
from corporeal.core.types import PartWords, Range
from corporeal.discretization.drawn import mean_thickness
from corporeal.materials.placement import entry_of
from corporeal.recognition.lexicon import formed, massive, nameless, open_ware, substances
from corporeal.recognition.metadata import Evidence

THICKEST = 5.0
"""A mean thickness over the greatest measured wall of its substance, from which a thing is drawn as
it looks from outside [-]: of things of which a name tells the substance alone, solid ones reach 3
(beams, a gun barrel), and those that turned out hollow begin at 9 (decision 110)."""


def no_block(words: PartWords, seen: Evidence, library: str) -> PartWords:
    """Let a thing of one part have a wall where only its substance is known and it is too thick.

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
    if words.material not in formed() or any(massive(tokens) for tokens in named):
        return words
    if not all(nameless(tokens) or open_ware(tokens) for tokens in named):
        return words
    if not any(substances(tokens) for tokens in named):  # a part of a machine: "link_2", of "steel"
        return words
    thickest = THICKEST * _greatest_wall(words.material, library)
    thickness = mean_thickness(seen.surfaces, seen.thing.scale)
    if not 0 < thickest < thickness:
        return words
    told = (
        f"A block {1e3 * thickness:.0f} mm thick would be more than {THICKEST:g} times as thick as "
        f"any wall of {words.material} was measured: it is taken for hollow."
    )
    return replace(words, structure="shell", reason=f"{words.reason} {told}")


def usual_wall(material: str | None, library: str) -> float:
    """Return the usual thickness of walls of a material [m]; 0: none was measured."""
    wall = _walls(material, library)
    return wall.typical if wall else 0.0


def _greatest_wall(material: str, library: str) -> float:
    """Return the greatest measured thickness of walls of a material [m]; 0: none was."""
    wall = _walls(material, library)
    return wall.high if wall else 0.0


def _walls(material: str | None, library: str) -> Range | None:
    """Return the measured thicknesses of walls of a material [m]; None: there are none."""
    try:
        return entry_of(material, library).ranges.get("shell_thickness") if material else None
    except UserError:
        return None
