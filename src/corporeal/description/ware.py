"""Open ware: how thick such a wall usually is, and what of it is drawn full."""

from collections.abc import Sequence
from dataclasses import replace

from corporeal.description.no_block import usual_wall
from corporeal.formats.word_order import is_several
from corporeal.geometry.drawn import drawn_full
from corporeal.geometry.identity import words as written
from corporeal.types import PartWords
from corporeal.vlm.lexicon import Name, formed, hollow, massive, open_ware, wall_of
from corporeal.vlm.metadata import Evidence


def with_usual_wall(words: PartWords, names: Sequence[tuple[str, ...]]) -> PartWords:
    """Give open ware the wall that pieces of its name and material have, where nobody states one.

    Args:
        words: Of a part.
        names: What it is called.

    """
    if words.thickness is not None and not words.wall_usual:
        return words
    wall = _wall(words.material, names)
    return words if wall is None else replace(words, thickness=wall, wall_usual=True)


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
    wall = _wall(words.material, named)
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


def _wall(material: str | None, names: Sequence[tuple[str, ...]]) -> float | None:
    """Return the wall of open ware that is called so, of such a material [m]; None: not known."""
    walls = (wall_of(tokens, material, "ware") for tokens in names if material is not None)
    return next((w for w in walls if w is not None), None)
