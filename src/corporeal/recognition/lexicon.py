"""The lexicon: what words, and plain colours, tell about matter."""

import colorsys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from math import inf

from corporeal.core.types import Finish
from corporeal.recognition.goods import sold
from corporeal.recognition.identity import words
from corporeal.recognition.other_languages import OF, in_english
from corporeal.recognition.spelling import (
    Vocabulary,
    by_squeezing,
    mended,
    singulars,
    spelt,
    unaccented,
)
from corporeal.recognition.typical_extents import classes
from corporeal.recognition.word_order import part_words, thing_last

LOOSE = frozenset("potting_soil soil_clay mud sand gravel snow ice".split())
"""What no container is made of: a compost bin has some in it."""
SHAPED = frozenset(("statue", "sculpture", "bust", "figure", "castle", "ball"))
"""Things that are made of it: a snow shoe is not."""
OF_IT = frozenset(("block", "ring", "bag"))
"""What is all of it even so: a bag of sand is sand."""
FUELS = frozenset("wood hardwood softwood coal charcoal".split())
"""What is burnt."""
KINDS = ("substance", "piece", "thing")
"""The most specific first: "oak", "table leg", "table"."""


@dataclass(frozen=True)
class Term:
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
    """It is hollow only where it is of one of the ``mouldable`` materials, or ``fired``."""
    blown: bool = False
    """It is hollow only where it is of one of the ``mouldable`` materials."""
    extents: tuple[float, float] = (0.0, inf)
    """It tells of things only whose longest side is at least and below that [m]."""
    lone: bool = False
    """It counts only where it is all that a thing is called."""
    before: int = 0
    """Words of the object that a substance stands right before."""
    narrowed: bool = False
    """A general substance, of which the object beside it tells the kind."""


@dataclass(frozen=True)
class Look:
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
class Name:
    """A name as it stands in the file, and the words of it that count."""

    text: str
    words: tuple[str, ...]

    def says(self, phrase: tuple[str, ...]) -> bool:
        """Tell whether these words follow one another in it."""
        n = len(phrase)
        return any(self.words[k : k + n] == phrase for k in range(len(self.words) - n + 1))


def heads(tokens: tuple[str, ...]) -> list[Term]:
    """Find what stands in a name; of compound nouns the last one is the object.

    A shoe rack is a rack, and a TV cabinet is a cabinet.
    """
    found = list(_standing_in(tokens))
    purposes = [(k, t) for k, t in found if not _is_of_it(t, _after(tokens, k, t))]
    standing = [
        (k, term)
        for k, term in found
        if not any(p <= k and k + len(term.phrase) <= p + len(t.phrase) for p, t in purposes)
        and not (term.lone and tokens != term.phrase)
    ]
    head = _head(tokens)
    if head is not None and tokens[head] in _holders():
        standing = [(k, s) for k, s in standing if s.kind != "thing" or k + len(s.phrase) > head]
    last: dict[int, int] = {}
    for k, term in standing:
        if term.kind == "thing":
            last[len(term.phrase)] = k
    return [s for k, s in standing if s.kind != "thing" or k == last[len(s.phrase)]]


def _head(tokens: tuple[str, ...]) -> int | None:
    """Return where the last noun of a name stands, which is the thing; None: no noun is known."""
    nouns = _nouns() - _describing()
    return next((k for k in range(len(tokens) - 1, -1, -1) if tokens[k] in nouns), None)


def _is_of_it(term: Term, following: str) -> bool:
    """Tell whether what follows a word may be of what it names: a steel bin, but no sand bin.

    What burns is no stove's matter: a coal stove, but a wooden oven.
    """
    if term.material in FUELS and term.phrase != ("wooden",) and following in _burners():
        return False
    if following not in _holders():
        return True
    if term.kind != "substance":
        return False
    return term.material not in LOOSE or following in OF_IT


def _after(tokens: tuple[str, ...], k: int, term: Term) -> str:
    following = k + len(term.phrase)
    return tokens[following] if following < len(tokens) else ""


def _standing_in(tokens: tuple[str, ...]) -> Iterator[tuple[int, Term]]:
    hushed = _hushed(tokens)
    for k, token in enumerate(tokens):
        for term in _by_first_word().get(token, ()):
            mine = set(range(k, k + len(term.phrase)))
            said = tokens[k : k + len(mine)] == term.phrase
            if said and all(words <= mine or not words & mine for words in hushed):
                yield k, term


def _hushed(tokens: tuple[str, ...]) -> list[set[int]]:
    """Return which words say nothing of matter where they stand: there is no ice in ice cream.

    What is known of the whole phrase, or of a longer one, counts: a wood stove is of iron.
    """
    return [
        set(range(k, k + len(phrase)))
        for phrase in _listed("silent")
        for k in range(len(tokens))
        if tokens[k : k + len(phrase)] == phrase
    ]


@cache
def _by_first_word() -> dict[str, list[Term]]:
    index: dict[str, list[Term]] = {}
    for term in lexicon():
        index.setdefault(term.phrase[0], []).append(term)
    return index


@lru_cache(maxsize=10_000)
def tokens_of(name: str) -> tuple[str, ...]:
    """Return a name's words in English and the singular, without what exporters write."""
    known = _vocabulary()
    english = in_english(words(name, phrases()))
    said = [mended(unaccented(w, known.words), known) for w in english]
    return tuple(thing_last(spelt(singulars(said, known, singular), known), known, phrases()))


@cache
def phrases() -> frozenset[tuple[str, ...]]:
    """Return every name of a thing that is more than one word."""
    listed = (phrase for table in ("hollow", "open", "cast") for phrase in _listed(table))
    sizes = (tuple(singular(w) for w in name.split()) for name in classes())
    named = (*(term.phrase for term in lexicon()), *listed, *sizes)
    return frozenset(phrase for phrase in named if len(phrase) > 1)


@cache
def _sizes() -> frozenset[str]:
    """Return every single noun of the tables of sizes."""
    return frozenset(singular(name) for name in classes() if " " not in name)


@cache
def _vocabulary() -> Vocabulary:
    """Return the words of the lexicon and of the tables of sizes, for compounds and slips."""
    sizes = _sizes()
    known, joined = _known() | sizes, _joined()
    return Vocabulary(
        words=known,
        first=_single("substance"),
        last=_single("thing") | _single("substance") | sizes,
        joined=joined,
        squeezed=by_squeezing([*known, *joined]),
    )


@cache
def _known() -> frozenset[str]:
    """Return every word that stands in the lexicon by itself or in a phrase."""
    return frozenset(w for term in lexicon() for w in term.phrase) | _holders()


@cache
def _joined() -> dict[str, tuple[str, ...]]:
    """Return every phrase by how it looks when it is written as one word."""
    return {"".join(s.phrase): s.phrase for s in lexicon() if len(s.phrase) > 1}


@cache
def _single(kind: str) -> frozenset[str]:
    return frozenset(s.phrase[0] for s in lexicon() if s.kind == kind and len(s.phrase) == 1)


def hollow(tokens: tuple[str, ...]) -> bool:
    """Tell whether a name is that of something hollow: its last noun is what it names."""
    return _is_one(tokens, "hollow")


def wall_of(tokens: tuple[str, ...], material: str) -> float | None:
    """Return the wall [m] of what is hollow where it is of such a material; None: of none.

    A chair of plastic is moulded, one of steel is of tubes.

    Args:
        tokens: Of a name.
        material: What the thing is of.

    """
    row = wall_row(tokens, material, "walls")
    return None if row is None else row["thickness_mm"] * 1e-3


def wall_row(tokens: tuple[str, ...], material: str | None, table: str) -> dict | None:
    """Return what a table says of the walls of things of such a material; None: nothing."""
    for row in _table()[table]:
        if material in row["of"] and _ends_in(tokens, _singulars(row["words"])):
            other = _ends_in(tokens, _singulars(row.get("but", ())))
            return None if other else row
    return None


def open_ware(tokens: tuple[str, ...]) -> bool:
    """Tell whether a name is that of an open vessel: its last noun is what it names."""
    return _is_one(tokens, "open")


def cast(tokens: tuple[str, ...]) -> bool:
    """Tell whether a name is that of what is cast hollow where it is large and of metal."""
    return _is_one(tokens, "cast")


def _is_one(tokens: tuple[str, ...], table: str) -> bool:
    """Tell whether a name's last noun stands in a table: "bin" in "bin old green"."""
    return _ends_in(tokens, _listed(table))


def ends_in(tokens: tuple[str, ...], named: Sequence[str]) -> bool:
    """Tell whether a name's last noun is one of these names of things."""
    return _ends_in(tokens, _singulars(named))


def _ends_in(tokens: tuple[str, ...], named: frozenset[tuple[str, ...]]) -> bool:
    """Tell whether a name's last noun is one of these, whatever describes it behind."""
    first = _head(tokens) or 0
    ends = range(len(tokens), first, -1)
    return any(tokens[:end][-len(phrase) :] == phrase for end in ends for phrase in named)


@cache
def _nouns() -> frozenset[str]:
    """Return words that name a thing: what stands behind the last of them only describes it."""
    tables = {phrase[-1] for table in ("hollow", "open", "cast") for phrase in _listed(table)}
    things = {term.phrase[-1] for term in lexicon() if term.kind != "substance"}
    return frozenset(tables | things | {name[-1] for name in phrases()}) | _holders() | part_words()


@cache
def _describing() -> frozenset[str]:
    """Return words after a noun that only say what it is like: of what, how large, how old."""
    return _single("substance") | _colours() | emptied()


@cache
def _listed(table: str) -> frozenset[tuple[str, ...]]:
    return _singulars(_table()[table])


def _singulars(named: Sequence[str]) -> frozenset[tuple[str, ...]]:
    return frozenset(tuple(singular(w) for w in phrase.split()) for phrase in named)


def singular(word: str) -> str:
    """Cut a plural's s; it need not be English, only the same on both sides."""
    keep = len(word) <= 3 or word.endswith(("ss", "us", "is"))
    return word[:-1] if word.endswith("s") and not keep else word


def seen_as(look: Look, finish: Finish) -> bool:
    """Tell whether a finish's colour factor, as an eye sees it, lies within a look."""
    red, green, blue = (_as_seen(c) for c in finish.colour[:3])
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    seen = (360.0 * hue, saturation, value)
    bounds = (look.hue, look.saturation, look.value)
    return all(low <= x <= high for x, (low, high) in zip(seen, bounds, strict=True))


def _as_seen(light: float) -> float:
    """Linear light to sRGB (IEC 61966-2-1)."""
    c = min(max(light, 0.0), 1.0)
    return 12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055


def kin(one: str, other: str) -> bool:
    """Tell whether things of either of two materials have walls of the same thickness."""
    return one == other or any({one, other} <= set(alike) for alike in _table()["kin"])


@cache
def mouldable() -> frozenset[str]:
    """Materials of which blown and moulded things are hollow: blown, moulded or sewn."""
    return frozenset(_table()["mouldable"])


@cache
def fired() -> frozenset[str]:
    """Materials of which moulded things are hollow, and balls are not: slip-cast."""
    return frozenset(_table()["fired"])


@cache
def formed() -> frozenset[str]:
    """Return materials that things of any kind are sheets, castings or mouldings of."""
    return (metals() | mouldable() | fired() | {"glass"}) - frozenset(_table()["solid"])


def nameless(tokens: tuple[str, ...]) -> bool:
    """Tell whether a name has a word for a thing, of whose matter no table knows anything."""
    standing = heads(tokens)
    known = {w for term in standing for w in term.phrase} | _describing() | OF
    return all(t.kind == "substance" for t in standing) and any(w not in known for w in tokens)


def substances(tokens: tuple[str, ...]) -> list[Term]:
    """Return the words of a name that say what the thing is made of."""
    return [t for t in heads(tokens) if t.kind == "substance"]


def massive(tokens: tuple[str, ...]) -> bool:
    """Tell whether a word of a name says that the thing is solid all through."""
    return bool(set(tokens) & frozenset(map(singular, _table()["massive"])))


def made_hollow(thing: Term, material: str) -> bool:
    """Tell whether a thing has its wall where it is of a material that somebody names."""
    if not (thing.moulded or thing.blown) or material in mouldable():
        return True
    return thing.moulded and material in fired()


@cache
def metals() -> frozenset[str]:
    """Materials whose surface is metallic."""
    general = next(s for s in lexicon() if s.phrase == ("metal",))
    others = ("hardened_steel", "magnesium", "zinc", "lead")
    return frozenset((general.material, *others, *general.gives_way))


@cache
def lexicon() -> tuple[Term, ...]:
    """Every phrase of the lexicon with what it states."""
    named = [
        _term(kind, phrase, row)
        for kind in KINDS
        for row in _table()[kind]
        for phrase in row["words"]
    ]
    known = {term.phrase for term in named if term.kind == "thing"}
    goods = (_term("thing", phrase, row) for phrase, row in sold())
    return (*named, *(term for term in goods if term.phrase not in known))


@cache
def lookbook() -> tuple[Look, ...]:
    """Every plain colour that indicates a part, with the objects in which it does."""
    return tuple(
        Look(
            hue=tuple(row["hue"]),
            saturation=tuple(row["saturation"]),
            value=tuple(row["value"]),
            of=frozenset(singular(w) for w in row["of"]),
            says=row["says"],
            material=row["material"],
            margin=row["margin"],
        )
        for row in _table()["look"]
    )


@cache
def _holders() -> frozenset[str]:
    """Nouns that make the noun before them a mere purpose.

    Beside those of the table every thing that has a usual size and no usual material: a bowl is a
    bowl, whatever is in it.
    """
    single = _sizes()
    material = {w for term in lexicon() for w in term.phrase if len(term.phrase) == 1}
    return frozenset(map(singular, _table()["holders"])) | (single - material - _colours())


@cache
def _burners() -> frozenset[str]:
    return frozenset(map(singular, _table()["burners"]))


@cache
def _colours() -> frozenset[str]:
    return frozenset(map(singular, _table()["describing"]))


@cache
def emptied() -> frozenset[str]:
    """Words that say of goods that they are not full any more."""
    return frozenset(map(singular, _table()["emptied"]))


@cache
def _table() -> dict[str, list]:
    return tomllib.loads(
        files("corporeal.recognition").joinpath("lexicon.toml").read_text(encoding="utf-8")
    )


def _term(kind: str, phrase: str, row: dict) -> Term:
    thickness, pressure = row.get("thickness_mm"), row.get("inflation_kPa")
    return Term(
        phrase=tuple(singular(w) for w in phrase.split()),
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
