"""Contents of vessels from names: fill level and material."""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

from corporeal.core.types import Note, NoteKind, ObjectDescription, PartDescription, Scene, SceneObject
from corporeal.recognition.lexicon import contents_table, names_open_vessel, strip_plural_s
from corporeal.recognition.metadata_recognition import FileEvidence
from corporeal.recognition.parts_by_name import name_words
from corporeal.recognition.translation import translate_words

PERCENT_FULL_PATTERN = re.compile(r"(\d{1,3})\s*(?:%|percent|per cent|prozent)[\s_-]*(?:full|filled|voll)")
FRACTION_FULL_PATTERN = re.compile(r"\b([1-4])\s*/\s*([2-5])[\s_-]*(?:full|filled|voll)")
GOODS_FILL_FRACTION, OPEN_WARE_FILL_FRACTION = 0.9, 0.8
"""Fill of what is stated to hold something, without an amount: bottles as they are sold, and open ware that is carried
[-]."""
MAX_FILL_FRACTION = 0.95
"""A rim stays free [-]."""
MAX_SKIPPED_WORDS = 2
"""So many words may stand between "of" and the contents: "of cold water"."""

WordPhrase = tuple[str, ...]


@dataclass(frozen=True)
class NamedContents:
    """What a name says of what is in a vessel."""

    share: float | None
    """Of the cavity inside the wall [-]; None: it says only of what."""
    contents: str | None
    """Material of the library; None: not named or unknown."""
    vessel: WordPhrase
    """The vessel's name; (): none is known."""
    drinks: bool
    """It holds water or a drink where nothing else is stated."""


def contents_from_name(thing: SceneObject) -> NamedContents | None:
    """Return what an object's names say of its contents; None: nothing."""
    every = (_of_name(name) for name in dict.fromkeys([thing.name, thing.class_name, thing.stem]))
    return next((found for found in every if found), None)


def _of_name(name: str) -> NamedContents | None:
    english = (w for word in name_words(name) for w in translate_words([word]))
    said = [strip_plural_s(word) for word in english]
    vessel, end = _find_vessel(said)
    share = _fill_fraction(name.lower(), said)
    contents = _find_contents(said, vessel, end, share is not None)
    if share is None and contents is None:
        return None
    return NamedContents(share, contents, vessel, vessel in _phrases("vessels", "drink"))


def _find_vessel(said: Sequence[str]) -> tuple[WordPhrase, int]:
    """Return the vessel, the last before what it is of, and where its name ends."""
    stop = next((k for k, w in enumerate(said) if k and w in _marker_words("of")), len(said))
    known = {p for row in ("drink", "any") for p in _phrases("vessels", row)}
    found = [(k + n, n, p) for k, n, p in _phrases_with_position(said[:stop], known)]
    if not found:
        return (), 0
    end, _, phrase = max(found)
    return phrase, end


def _fill_fraction(name: str, said: Sequence[str]) -> float | None:
    """Return the stated fill [-]."""
    if level := PERCENT_FULL_PATTERN.search(name):
        return min(int(level[1]) / 100, MAX_FILL_FRACTION)
    if fraction := FRACTION_FULL_PATTERN.search(name):
        return min(int(fraction[1]) / int(fraction[2]), MAX_FILL_FRACTION)
    shares = {p: float(share) for share in contents_table()["share"] for p in _phrases("share", share)}
    found = [(n, k, p) for k, n, p in _phrases_with_position(said, shares) if _is_level(said, k, n)]
    return shares[max(found)[2]] if found else None


def _is_level(said: Sequence[str], k: int, n: int) -> bool:
    return n > 1 or k + 1 >= len(said) or said[k + 1] not in _marker_words("no_level")


def _find_contents(said: Sequence[str], vessel: WordPhrase, end: int, levelled: bool) -> str | None:
    """Return a vessel's contents: "bottle of milk", and with a fill level "milk bottle"."""
    if not vessel:
        return None
    known = {p: name for name in contents_table()["contents"] for p in _phrases("contents", name)}
    found = list(_phrases_with_position(said, known))
    for k, n, phrase in sorted(found, key=lambda row: -row[1]):
        before = said[max(end, k - MAX_SKIPPED_WORDS - 1) : k]
        free = k + n == len(said) or said[k + n] in _marker_words("behind")
        if k >= end and free and any(w in _marker_words("of") for w in before):
            return known[phrase]
        if levelled and k + n == end - len(vessel):
            return known[phrase]
    return None


def _phrases_with_position(said: Sequence[str], known: Collection[WordPhrase]) -> Iterator[tuple[int, int, WordPhrase]]:
    """Yield where phrases stand in a name, how long they are, and which."""
    for k in range(len(said)):
        for n in (3, 2, 1):
            if tuple(said[k : k + n]) in known and k + n <= len(said):
                yield k, n, tuple(said[k : k + n])


def apply_named_contents(found: PartDescription, evidence: FileEvidence, holds: bool) -> PartDescription:
    """Fill a vessel of one part as its name says."""
    said = contents_from_name(evidence.thing)
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
    usual = (
        OPEN_WARE_FILL_FRACTION
        if is_open or any(names_open_vessel(n.words) for n in evidence.general)
        else GOODS_FILL_FRACTION
    )
    fill = usual if said.share is None else said.share
    taken = "" if said.contents or found.contents else f", contents not named: {inner}"
    reason = f"{found.reason} By its name it is {fill:.0%} full of {inner}{taken}."
    return replace(found, structure="filled", contents=inner, fill=fill, reason=reason)


def unused_contents_notes(scene: Scene, objects: Sequence[ObjectDescription]) -> tuple[str, ...]:
    """Return notes on fill levels in names that were not used."""
    said = [(o, contents_from_name(thing)) for o, thing in zip(objects, scene.objects, strict=True)]
    return tuple(
        Note(
            f"{o.name}: the fill level in its name ({_contents_text(filling)}) was not used: "
            f"{_unused_reason(o, filling)}. State it with --annotations: structure filled, contents "
            "and fill.",
            NoteKind.ASSUMED,
        )
        for o, filling in said
        if filling and filling.share != 0 and not _is_accounted_for(o, filling)
    )


def _contents_text(said: NamedContents) -> str:
    level = "full" if said.share is None else f"{said.share:.0%}"
    return f"{level} of {said.contents}" if said.contents else level


def _unused_reason(thing: ObjectDescription, said: NamedContents) -> str:
    if not said.vessel:
        return "it names no known vessel"
    if len(thing.parts) > 1:
        return "the part that holds it is unknown"
    if not (said.contents or said.drinks):
        return "its contents are not named"
    material = next((p.material for p in thing.parts if p.material), "it")
    return f"no wall thickness of {material} is known"


def _is_accounted_for(thing: ObjectDescription, said: NamedContents) -> bool:
    """Return whether something is in it, a part of it is that, or a person decided."""
    if said.share and said.share == MAX_FILL_FRACTION and not said.vessel:
        return True  # "full" by itself says little of what is no vessel
    inside = _phrases("contents", said.contents) if said.contents else frozenset()
    return any(
        p.contents
        or p.built_by == "annotation"
        or (p.material and p.material == said.contents)
        or any(True for _ in _phrases_with_position([strip_plural_s(w) for w in name_words(p.name)], inside))
        for p in thing.parts
    )


@cache
def _phrases(part: str, row: str) -> frozenset[WordPhrase]:
    rows = contents_table()[part]
    return frozenset(tuple(strip_plural_s(w) for w in p.split()) for p in rows[row])


@cache
def _marker_words(row: str) -> frozenset[str]:
    rows = contents_table()["words"]
    return frozenset(rows[row])
