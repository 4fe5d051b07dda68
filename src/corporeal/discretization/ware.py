"""Open ware: how thick such a wall usually is, and what of it is drawn full."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.types import PartWords
from corporeal.discretization.drawn import drawn_full
from corporeal.discretization.no_block import usual_wall
from corporeal.recognition.identity import words as written
from corporeal.recognition.lexicon import Name, formed, hollow, massive, open_ware, wall_row
from corporeal.recognition.metadata import Evidence
from corporeal.recognition.word_order import is_several


@dataclass(frozen=True)
class Called:
    """What a thing is called, and how large it is."""

    names: Sequence[tuple[str, ...]]
    """Words of each."""
    extent: float
    """Longest side [m]."""


@dataclass(frozen=True)
class WareWall:
    """The wall that pieces of a name, a material and a size have."""

    thickness: float
    """[m]"""
    why: str
    """What says so."""


def with_usual_wall(words: PartWords, called: Called) -> PartWords:
    """Give open ware the wall that such pieces have, where nobody states one.

    Args:
        words: Of a part.
        called: The thing.

    """
    if words.thickness is not None and not words.wall_usual:
        return words
    wall = ware_wall(words.material, called)
    if wall is None:
        return words
    return replace(words, thickness=wall.thickness, wall_usual=True, wall_why=wall.why)


def ware_wall(material: str | None, called: Called) -> WareWall | None:
    """Return the wall of open ware that is called so; None: not known.

    Where walls grow with the longest side they are interpolated between sizes in logarithms, and
    are those of the least and the largest beyond.

    Args:
        material: What it is of.
        called: The thing.

    """
    if material is None:
        return None
    rows = (wall_row(tokens, material, "ware") for tokens in called.names)
    row = next((r for r in rows if r is not None), None)
    if row is None:
        return None
    if "walls_mm" not in row:
        return WareWall(1e-3 * row["thickness_mm"], row["why"])
    sizes, walls = np.log(1e-3 * np.array(row["walls_mm"], dtype=float)).T
    thickness = float(np.exp(np.interp(np.log(called.extent), sizes, walls)))
    return WareWall(thickness, f"{row['why']}, at {called.extent * 100:.0f} cm")


def sheet_if_full(words: PartWords, seen: Evidence, library: str) -> PartWords:
    """Let open ware whose mesh fills its hollow be a sheet along its outside, as from pictures.

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
    if any(_is_else(name) for name in seen.general):
        return words
    named = [name.words for name in seen.general]
    known = ware_wall(words.material, Called(named, seen.extent))
    wall = known.thickness if known else None
    if wall is None and words.material in formed() and not any(map(massive, named)):
        wall = usual_wall(words.material, library)
    if not wall or not drawn_full(seen.surfaces, wall, seen.thing.scale):
        return words
    told = "Its mesh fills its hollow: it is taken for a wall along its outside."
    return replace(words, structure="sheet", wall_unseen=True, reason=f"{words.reason} {told}")


def _is_else(name: Name) -> bool:
    """Tell whether a name is not that of one piece of ware that is open by what it is."""
    tokens = name.words
    return not open_ware(tokens) or hollow(tokens) or is_several(written(name.text))
