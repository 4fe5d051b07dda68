"""What a name says of a vessel's contents: how full it is, and of what."""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

from corporeal.core.types import Note, NoteKind, ObjectWords, PartWords, Scene, SceneObject
from corporeal.recognition.goods import table
from corporeal.recognition.identity import words
from corporeal.recognition.lexicon import open_ware, singular
from corporeal.recognition.metadata import Evidence
from corporeal.recognition.other_languages import in_english

LEVEL = re.compile(r"(\d{1,3})\s*(?:%|percent|per cent|prozent)[\s_-]*(?:full|filled|voll)")
FRACTION = re.compile(r"\b([1-4])\s*/\s*([2-5])[\s_-]*(?:full|filled|voll)")
GOODS, WARE = 0.9, 0.8
"""How full is what is said to hold something, and not how much: bottles as they are sold, and open
ware that is carried [-]."""
FULLEST = 0.95
"""A rim stays free [-]."""
SKIPPED = 2
"""So many words may stand between "of" and the contents: "of cold water"."""

Phrase = tuple[str, ...]


@dataclass(frozen=True)
class Filling:
    """What a name says of what is in a vessel."""

    share: float | None
    """Of the room behind the wall [-]; None: it says only of what."""
    contents: str | None
    """A name from the library; None: it does not say of what, or nobody knows that word."""
    vessel: Phrase
    """The vessel's name; (): none is known."""
    drinks: bool
    """It holds water or a drink where nothing else is said."""


def said_contents(thing: SceneObject) -> Filling | None:
    """Return what an object's names say of its contents; None: nothing."""
    every = (_of_name(name) for name in dict.fromkeys([thing.name, thing.class_name, thing.stem]))
    return next((found for found in every if found), None)


def _of_name(name: str) -> Filling | None:
    english = (w for word in words(name) for w in in_english([word]))
    said = [singular(word) for word in english]
    vessel, end = _vessel(said)
    share = _share(name.lower(), said)
    contents = _contents(said, vessel, end, share is not None)
    if share is None and contents is None:
        return None
    return Filling(share, contents, vessel, vessel in _phrases("vessels", "drink"))


def _vessel(said: Sequence[str]) -> tuple[Phrase, int]:
    """Return the vessel, the last before what it is of, and where its name ends."""
    stop = next((k for k, w in enumerate(said) if k and w in _told("of")), len(said))
    known = {p for row in ("drink", "any") for p in _phrases("vessels", row)}
    found = [(k + n, n, p) for k, n, p in _standing(said[:stop], known)]
    if not found:
        return (), 0
    end, _, phrase = max(found)
    return phrase, end


def _share(name: str, said: Sequence[str]) -> float | None:
    """Return how full it is said to be [-]."""
    if level := LEVEL.search(name):
        return min(int(level[1]) / 100, FULLEST)
    if fraction := FRACTION.search(name):
        return min(int(fraction[1]) / int(fraction[2]), FULLEST)
    shares = {p: float(share) for share in table()["share"] for p in _phrases("share", share)}
    found = [(n, k, p) for k, n, p in _standing(said, shares) if _is_level(said, k, n)]
    return shares[max(found)[2]] if found else None


def _is_level(said: Sequence[str], k: int, n: int) -> bool:
    return n > 1 or k + 1 >= len(said) or said[k + 1] not in _told("no_level")


def _contents(said: Sequence[str], vessel: Phrase, end: int, levelled: bool) -> str | None:
    """Return what is in a vessel: "bottle of milk", and where its level is told "milk bottle"."""
    if not vessel:
        return None
    known = {p: name for name in table()["contents"] for p in _phrases("contents", name)}
    found = list(_standing(said, known))
    for k, n, phrase in sorted(found, key=lambda row: -row[1]):
        before = said[max(end, k - SKIPPED - 1) : k]
        free = k + n == len(said) or said[k + n] in _told("behind")
        if k >= end and free and any(w in _told("of") for w in before):
            return known[phrase]
        if levelled and k + n == end - len(vessel):
            return known[phrase]
    return None


def _standing(said: Sequence[str], known: Collection[Phrase]) -> Iterator[tuple[int, int, Phrase]]:
    """Yield where phrases stand in a name, how long they are, and which."""
    for k in range(len(said)):
        for n in (3, 2, 1):
            if tuple(said[k : k + n]) in known and k + n <= len(said):
                yield k, n, tuple(said[k : k + n])


def as_said(found: PartWords, evidence: Evidence, holds: bool) -> PartWords:
    """Fill a vessel of one part as its name says.

    Args:
        found: What was recognised of it.
        evidence: All that the file says about it.
        holds: Whether its material has walls.

    """
    said = said_contents(evidence.thing)
    if said is None or not evidence.alone or not (said.vessel and holds):
        return found
    inner = said.contents or found.contents or ("water" if said.drinks else None)
    if said.share == 0:
        empty = replace(found, structure="shell", contents=None, fill=None)
        return empty if found.contents else found
    if inner is None or inner == found.material:
        return found
    if found.contents is not None and said.share is None:
        return found  # goods are as they are sold
    is_open = said.vessel in _phrases("vessels", "open")
    usual = WARE if is_open or any(open_ware(n.words) for n in evidence.general) else GOODS
    fill = usual if said.share is None else said.share
    taken = "" if said.contents or found.contents else f", of what is not said: of {inner}"
    reason = f"{found.reason} By its name it is {fill:.0%} full of {inner}{taken}."
    return replace(found, structure="filled", contents=inner, fill=fill, reason=reason)


def not_filled(scene: Scene, objects: Sequence[ObjectWords]) -> tuple[str, ...]:
    """Say of which objects it was not used how full their names say they are."""
    said = [(o, said_contents(thing)) for o, thing in zip(objects, scene.objects, strict=True)]
    return tuple(
        Note(
            f"{o.name}: its name says how full it is ({_in_words(filling)}), and that was not used"
            f": {_why(o, filling)}. Say it with --annotations: structure filled, contents and "
            "fill.",
            NoteKind.ASSUMED,
        )
        for o, filling in said
        if filling and filling.share != 0 and not _holds(o, filling)
    )


def _in_words(said: Filling) -> str:
    level = "full" if said.share is None else f"{said.share:.0%}"
    return f"{level} of {said.contents}" if said.contents else level


def _why(thing: ObjectWords, said: Filling) -> str:
    if not said.vessel:
        return "it names no vessel that is known"
    if len(thing.parts) > 1:
        return "which of its parts holds it is not known"
    if not (said.contents or said.drinks):
        return "it does not say of what"
    material = next((p.material for p in thing.parts if p.material), "it")
    return f"{material} has no wall that is known"


def _holds(thing: ObjectWords, said: Filling) -> bool:
    """Tell whether something is in it, a part of it is that, or a person decided."""
    if said.share and said.share == FULLEST and not said.vessel:
        return True  # "full" by itself says little of what is no vessel
    inside = _phrases("contents", said.contents) if said.contents else frozenset()
    return any(
        p.contents
        or p.built_by == "annotation"
        or (p.material and p.material == said.contents)
        or any(True for _ in _standing([singular(w) for w in words(p.name)], inside))
        for p in thing.parts
    )


@cache
def _phrases(part: str, row: str) -> frozenset[Phrase]:
    rows = table()[part]
    return frozenset(tuple(singular(w) for w in p.split()) for p in rows[row])


@cache
def _told(row: str) -> frozenset[str]:
    rows = table()["words"]
    return frozenset(rows[row])


def known_contents() -> frozenset[str]:
    """Materials that names may say is in a vessel."""
    return frozenset(table()["contents"])
