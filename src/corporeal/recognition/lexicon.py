"""Lexicon of materials: words and plain colours."""

import colorsys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from math import inf

from corporeal.core.types import Finish
from corporeal.recognition.compound_words import (
    KnownWords,
    correct_doubled_letters,
    index_without_doubled_letters,
    normalise_compounds,
    remove_unknown_accents,
    singularise_words,
)
from corporeal.recognition.head_noun import move_head_noun_last, part_nouns
from corporeal.recognition.parts_by_name import name_words
from corporeal.recognition.translation import OF_PREPOSITIONS, translate_words
from corporeal.recognition.typical_extents import sized_classes


@cache
def contents_table() -> dict:
    """Return what names say of vessels: how full they are, of what, and what goods come in."""
    path = files("corporeal.recognition").joinpath("contents_from_name.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def packaged_goods() -> Iterator[tuple[str, dict]]:
    """Yield every vessel with goods as a phrase, and what it is: "pesticide bottle".

    The first row that names one counts: oil is oil, and in a bottle of glass.
    """
    inside = {good: name for name, goods in contents_table()["contents"].items() for good in goods}
    named: set[str] = set()
    for row in contents_table()["sold"]:
        goods = [*row["of"], *(g for kind in row.get("kinds", ()) for g in contents_table()["kinds"][kind])]
        for phrase, good in ((f"{good} {v}", good) for v in row["vessels"] for good in goods):
            if phrase not in named:
                named.add(phrase)
                contents = row.get("contents") or inside[good]
                yield phrase, {**row, "contents": contents, "of": ()}


LOOSE_MATERIALS = frozenset("potting_soil soil_clay mud sand gravel snow ice".split())
"""Materials of contents, never of containers: a compost bin."""
NOUNS_SHAPED_OF_LOOSE = frozenset(("statue", "sculpture", "bust", "figure", "castle", "ball"))
"""Objects that are made of it: a snow shoe is not."""
NOUNS_WHOLLY_OF_MATERIAL = frozenset(("block", "ring", "bag"))
"""What is all of it even so: a bag of sand is sand."""
FUEL_MATERIALS = frozenset("wood hardwood softwood coal charcoal".split())
"""What is burnt."""
TERM_KINDS = ("substance", "piece", "thing")
"""The most specific first: "oak", "table leg", "table"."""


@dataclass(frozen=True)
class LexiconTerm:
    """One term of the lexicon: a phrase and what it states."""

    phrase: tuple[str, ...]
    kind: str
    material: str
    margin: float
    structure: str | None = None
    thickness: float | None = None
    """[m]"""
    gives_way: tuple[str, ...] = ()
    of: tuple[str, ...] = ()
    colour: bool = False
    seldom: bool = False
    """It is rarely meant as a colour."""
    every: bool = False
    plant: bool = False
    alpha: str = ""
    metallic: str = ""
    contents: str | None = None
    fill: float | None = None
    inflation: float | None = None
    """Gauge pressure of the air sealed in it [Pa]."""
    rebound: float | None = None
    """Restitution on a hard floor that its rules ask for [-]."""
    moulded: bool = False
    """It is hollow only where it is of one of the ``mouldable_materials`` materials, or ``fired_materials``."""
    blown: bool = False
    """It is hollow only where it is of one of the ``mouldable_materials`` materials."""
    extents: tuple[float, float] = (0.0, inf)
    """It tells of objects only whose longest side is at least and below that [m]."""
    lone: bool = False
    """It counts only where it is all that an object is called."""
    before: int = 0
    """Words of the object that a substance stands right before."""
    narrowed: bool = False
    """A general substance, of which the object beside it tells the kind."""


@dataclass(frozen=True)
class ColourRule:
    """What a part's colour indicates in certain objects."""

    hue: tuple[float, float]
    """[degrees]"""
    saturation: tuple[float, float]
    value: tuple[float, float]
    of: frozenset[str]
    says: str
    material: str
    margin: float


@dataclass(frozen=True)
class TokenisedName:
    """A name as the file has it, and the words of it that count."""

    text: str
    words: tuple[str, ...]

    def says(self, phrase: tuple[str, ...]) -> bool:
        """Return whether these words follow one another in it."""
        n = len(phrase)
        return any(self.words[k : k + n] == phrase for k in range(len(self.words) - n + 1))


def head_terms(tokens: tuple[str, ...]) -> list[LexiconTerm]:
    """Find the terms in a name; of compound nouns the last one is the object.

    A shoe rack is a rack, and a TV cabinet is a cabinet.
    """
    found = list(_terms_with_position(tokens))
    purposes = [(k, t) for k, t in found if not _is_material_of_following(t, _word_after(tokens, k, t))]
    standing = [
        (k, term)
        for k, term in found
        if not any(p <= k and k + len(term.phrase) <= p + len(t.phrase) for p, t in purposes)
        and not (term.lone and tokens != term.phrase)
    ]
    head = _head_noun_index(tokens)
    if head is not None and tokens[head] in _container_nouns():
        standing = [(k, s) for k, s in standing if s.kind != "thing" or k + len(s.phrase) > head]
    last: dict[int, int] = {}
    for k, term in standing:
        if term.kind == "thing":
            last[len(term.phrase)] = k
    return [s for k, s in standing if s.kind != "thing" or k == last[len(s.phrase)]]


def _head_noun_index(tokens: tuple[str, ...]) -> int | None:
    """Return the place of the last noun of a name, which is the object; None: no noun is known."""
    nouns = _noun_words() - _describing_words()
    return next((k for k in range(len(tokens) - 1, -1, -1) if tokens[k] in nouns), None)


def _is_material_of_following(term: LexiconTerm, following: str) -> bool:
    """Return whether what follows a word may be of what it names: a steel bin, but no sand bin.

    What burns is no stove's material: a coal stove, but a wooden oven.
    """
    if term.material in FUEL_MATERIALS and term.phrase != ("wooden",) and following in _burner_nouns():
        return False
    if following not in _container_nouns():
        return True
    if term.kind != "substance":
        return False
    return term.material not in LOOSE_MATERIALS or following in NOUNS_WHOLLY_OF_MATERIAL


def _word_after(tokens: tuple[str, ...], k: int, term: LexiconTerm) -> str:
    following = k + len(term.phrase)
    return tokens[following] if following < len(tokens) else ""


def _terms_with_position(tokens: tuple[str, ...]) -> Iterator[tuple[int, LexiconTerm]]:
    hushed = _silent_spans(tokens)
    for k, token in enumerate(tokens):
        for term in _terms_by_first_word().get(token, ()):
            mine = set(range(k, k + len(term.phrase)))
            said = tokens[k : k + len(mine)] == term.phrase
            if said and all(words <= mine or not words & mine for words in hushed):
                yield k, term


def _silent_spans(tokens: tuple[str, ...]) -> list[set[int]]:
    """Return which words say nothing of material where they stand: there is no ice in ice cream.

    What is known of the whole phrase, or of a longer one, counts: a wood stove is of iron.
    """
    return [
        set(range(k, k + len(phrase)))
        for phrase in _table_phrases("silent")
        for k in range(len(tokens))
        if tokens[k : k + len(phrase)] == phrase
    ]


@cache
def _terms_by_first_word() -> dict[str, list[LexiconTerm]]:
    index: dict[str, list[LexiconTerm]] = {}
    for term in lexicon_terms():
        index.setdefault(term.phrase[0], []).append(term)
    return index


@lru_cache(maxsize=10_000)
def name_tokens(name: str) -> tuple[str, ...]:
    """Return a name's words in English and the singular, without what exporters write."""
    known = _vocabulary()
    english = translate_words(name_words(name, multiword_names()))
    said = [correct_doubled_letters(remove_unknown_accents(w, known.words), known) for w in english]
    return tuple(
        move_head_noun_last(
            normalise_compounds(singularise_words(said, known, strip_plural_s), known), known, multiword_names()
        )
    )


@cache
def multiword_names() -> frozenset[tuple[str, ...]]:
    """Return every name of an object that is more than one word."""
    listed = (phrase for table in ("hollow", "open", "cast") for phrase in _table_phrases(table))
    sizes = (tuple(strip_plural_s(w) for w in name.split()) for name in sized_classes())
    named = (*(term.phrase for term in lexicon_terms()), *listed, *sizes)
    return frozenset(phrase for phrase in named if len(phrase) > 1)


@cache
def _single_sized_nouns() -> frozenset[str]:
    """Return every single noun of the tables of sizes."""
    return frozenset(strip_plural_s(name) for name in sized_classes() if " " not in name)


@cache
def _vocabulary() -> KnownWords:
    """Return the words of the lexicon and of the tables of sizes, for compounds and slips."""
    sizes = _single_sized_nouns()
    known, joined = _lexicon_words() | sizes, _compounds_of_lexicon()
    return KnownWords(
        words=known,
        first=_single_words("substance"),
        last=_single_words("thing") | _single_words("substance") | sizes,
        joined=joined,
        squeezed=index_without_doubled_letters([*known, *joined]),
    )


@cache
def _lexicon_words() -> frozenset[str]:
    """Return every word of the lexicon by itself or in a phrase."""
    return frozenset(w for term in lexicon_terms() for w in term.phrase) | _container_nouns()


@cache
def _compounds_of_lexicon() -> dict[str, tuple[str, ...]]:
    """Return every phrase by how it looks when it is written as one word."""
    return {"".join(s.phrase): s.phrase for s in lexicon_terms() if len(s.phrase) > 1}


@cache
def _single_words(kind: str) -> frozenset[str]:
    return frozenset(s.phrase[0] for s in lexicon_terms() if s.kind == kind and len(s.phrase) == 1)


def names_hollow_object(tokens: tuple[str, ...]) -> bool:
    """Return whether a name is that of something hollow: its last noun is what it names."""
    return _head_noun_in_table(tokens, "hollow")


def hollow_wall_thickness(tokens: tuple[str, ...], material: str) -> float | None:
    """Return the wall [m] of what is hollow where it is of such a material; None: of none.

    A chair of plastic is moulded, one of steel is of tubes.
    """
    row = wall_table_row(tokens, material, "walls")
    return None if row is None else row["thickness_mm"] * 1e-3


def wall_table_row(tokens: tuple[str, ...], material: str | None, table: str) -> dict | None:
    """Return what a table says of the walls of objects of such a material; None: nothing."""
    for row in _table()[table]:
        if material in row["of"] and _head_noun_among(tokens, _singular_phrases(row["words"])):
            other = _head_noun_among(tokens, _singular_phrases(row.get("but", ())))
            return None if other else row
    return None


def names_open_vessel(tokens: tuple[str, ...]) -> bool:
    """Return whether a name is that of an open vessel: its last noun is what it names."""
    return _head_noun_in_table(tokens, "open")


def names_hollow_casting(tokens: tuple[str, ...]) -> bool:
    """Return whether a name is that of what is cast hollow where it is large and of metal."""
    return _head_noun_in_table(tokens, "cast")


def _head_noun_in_table(tokens: tuple[str, ...], table: str) -> bool:
    """Return whether a table has a name's last noun: "bin" in "bin old green"."""
    return _head_noun_among(tokens, _table_phrases(table))


def head_noun_in(tokens: tuple[str, ...], named: Sequence[str]) -> bool:
    """Return whether a name's last noun is one of these names of objects."""
    return _head_noun_among(tokens, _singular_phrases(named))


def _head_noun_among(tokens: tuple[str, ...], named: frozenset[tuple[str, ...]]) -> bool:
    """Return whether a name's last noun is one of these, whatever describes it behind."""
    first = _head_noun_index(tokens) or 0
    ends = range(len(tokens), first, -1)
    return any(tokens[:end][-len(phrase) :] == phrase for end in ends for phrase in named)


@cache
def _noun_words() -> frozenset[str]:
    """Return words that name an object: what follows the last of them only describes it."""
    tables = {phrase[-1] for table in ("hollow", "open", "cast") for phrase in _table_phrases(table)}
    things = {term.phrase[-1] for term in lexicon_terms() if term.kind != "substance"}
    return frozenset(tables | things | {name[-1] for name in multiword_names()}) | _container_nouns() | part_nouns()


@cache
def _describing_words() -> frozenset[str]:
    """Return words after a noun that only say what it is like: of what, how large, how old."""
    return _single_words("substance") | _colour_words() | emptied_words()


@cache
def _table_phrases(table: str) -> frozenset[tuple[str, ...]]:
    return _singular_phrases(_table()[table])


def _singular_phrases(named: Sequence[str]) -> frozenset[tuple[str, ...]]:
    return frozenset(tuple(strip_plural_s(w) for w in phrase.split()) for phrase in named)


def strip_plural_s(word: str) -> str:
    """Cut a plural's s; it need not be English, only the same on both sides."""
    keep = len(word) <= 3 or word.endswith(("ss", "us", "is"))
    return word[:-1] if word.endswith("s") and not keep else word


def matches_colour_rule(look: ColourRule, finish: Finish) -> bool:
    """Return whether a finish's colour factor, as an eye sees it, lies within a look."""
    red, green, blue = (_srgb_of_linear(c) for c in finish.colour[:3])
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    seen = (360.0 * hue, saturation, value)
    bounds = (look.hue, look.saturation, look.value)
    return all(low <= x <= high for x, (low, high) in zip(seen, bounds, strict=True))


def _srgb_of_linear(light: float) -> float:
    """Linear light to sRGB (IEC 61966-2-1)."""
    c = min(max(light, 0.0), 1.0)
    return 12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055


def have_same_walls(one: str, other: str) -> bool:
    """Return whether objects of either of two materials have walls of the same thickness."""
    return one == other or any({one, other} <= set(alike) for alike in _table()["kin"])


@cache
def mouldable_materials() -> frozenset[str]:
    """Materials of which blown and moulded objects are hollow: blown, moulded or sewn."""
    return frozenset(_table()["mouldable"])


@cache
def fired_materials() -> frozenset[str]:
    """Materials of which moulded objects are hollow, and balls are not: slip-cast."""
    return frozenset(_table()["fired"])


@cache
def formed_materials() -> frozenset[str]:
    """Return materials that objects of any kind are sheets, castings or mouldings of."""
    return (metal_materials() | mouldable_materials() | fired_materials() | {"glass"}) - frozenset(_table()["solid"])


def names_unknown_object(tokens: tuple[str, ...]) -> bool:
    """Return whether a name has a word for an object without a known material."""
    standing = head_terms(tokens)
    known = {w for term in standing for w in term.phrase} | _describing_words() | OF_PREPOSITIONS
    return all(t.kind == "substance" for t in standing) and any(w not in known for w in tokens)


def substance_terms(tokens: tuple[str, ...]) -> list[LexiconTerm]:
    """Return the words of a name that name the object's material."""
    return [t for t in head_terms(tokens) if t.kind == "substance"]


def names_solid_object(tokens: tuple[str, ...]) -> bool:
    """Return whether a word of a name says that the object is solid all through."""
    return bool(set(tokens) & frozenset(map(strip_plural_s, _table()["massive"])))


def is_hollow_in_material(thing: LexiconTerm, material: str) -> bool:
    """Return whether an object is hollow in a named material."""
    if not (thing.moulded or thing.blown) or material in mouldable_materials():
        return True
    return thing.moulded and material in fired_materials()


@cache
def metal_materials() -> frozenset[str]:
    """Materials whose surface is metallic."""
    general = next(s for s in lexicon_terms() if s.phrase == ("metal",))
    others = ("hardened_steel", "magnesium", "zinc", "lead")
    return frozenset((general.material, *others, *general.gives_way))


@cache
def lexicon_terms() -> tuple[LexiconTerm, ...]:
    """Every phrase of the lexicon with what it states."""
    named = [_term(kind, phrase, row) for kind in TERM_KINDS for row in _table()[kind] for phrase in row["words"]]
    known = {term.phrase for term in named if term.kind == "thing"}
    goods = (_term("thing", phrase, row) for phrase, row in packaged_goods())
    return (*named, *(term for term in goods if term.phrase not in known))


@cache
def colour_rules() -> tuple[ColourRule, ...]:
    """Every plain colour that indicates a part, with the objects in which it does."""
    return tuple(
        ColourRule(
            hue=tuple(row["hue"]),
            saturation=tuple(row["saturation"]),
            value=tuple(row["value"]),
            of=frozenset(strip_plural_s(w) for w in row["of"]),
            says=row["says"],
            material=row["material"],
            margin=row["margin"],
        )
        for row in _table()["look"]
    )


@cache
def _container_nouns() -> frozenset[str]:
    """Nouns that make the noun before them a mere purpose.

    Beside those of the table every object that has a usual size and no usual material: a bowl is a bowl, whatever is in
    it.
    """
    single = _single_sized_nouns()
    material = {w for term in lexicon_terms() for w in term.phrase if len(term.phrase) == 1}
    return frozenset(map(strip_plural_s, _table()["holders"])) | (single - material - _colour_words())


@cache
def _burner_nouns() -> frozenset[str]:
    return frozenset(map(strip_plural_s, _table()["burners"]))


@cache
def _colour_words() -> frozenset[str]:
    return frozenset(map(strip_plural_s, _table()["describing"]))


@cache
def emptied_words() -> frozenset[str]:
    """Words that say of goods that they are not full any more."""
    return frozenset(map(strip_plural_s, _table()["emptied"]))


@cache
def _table() -> dict[str, list]:
    return tomllib.loads(files("corporeal.recognition").joinpath("lexicon.toml").read_text(encoding="utf-8"))


def _term(kind: str, phrase: str, row: dict) -> LexiconTerm:
    thickness, pressure = row.get("thickness_mm"), row.get("inflation_kPa")
    return LexiconTerm(
        phrase=tuple(strip_plural_s(w) for w in phrase.split()),
        kind=kind,
        material=row["material"],
        margin=row["margin"],
        structure=row.get("structure"),
        thickness=None if thickness is None else thickness * 1e-3,
        gives_way=tuple(row.get("gives_way", ())),
        of=tuple(row.get("of", ())),
        colour=row.get("colour", False),
        seldom=row.get("seldom", False),
        every=row.get("every", False),
        plant=row.get("plant", False),
        alpha=row.get("alpha", ""),
        metallic=row.get("metallic", ""),
        contents=row.get("contents"),
        fill=row.get("fill"),
        inflation=None if pressure is None else pressure * 1e3,
        rebound=row.get("rebound"),
        moulded=row.get("moulded", False),
        blown=row.get("blown", False),
        extents=(row.get("longer_m", 0.0), row.get("shorter_m", inf)),
        lone=row.get("lone", False),
    )
