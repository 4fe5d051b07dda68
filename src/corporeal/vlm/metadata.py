"""Recognition without a model: what the file's own names and surface values tell."""

import colorsys
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from math import isfinite

from corporeal.geometry.identity import Identity, words
from corporeal.types import Finish, PartWords, Scene, SceneObject, Surface

KINDS = ("substance", "piece", "thing")
WEAKER = 0.6
"""Factor on the margin of what is said of the whole when the part is only one of several."""
METALLIC = 0.5
"""Metallic value from which most of a surface is metal: a picture's value is its mean."""
LONGEST_WALL = 10.0
"""No wall of a thing is thicker [m]."""
UNKNOWN = PartWords("", None, reason="No name in the file says what this is made of.")


@dataclass(frozen=True)
class Saying:
    """One entry of the lexicon: what a phrase tells."""

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
    every: bool = False
    plant: bool = False
    alpha: str = ""
    metallic: str = ""


@dataclass(frozen=True)
class Look:
    """What a part's colour tells in certain things."""

    hue: tuple[float, float]
    """[degrees]"""
    saturation: tuple[float, float]
    value: tuple[float, float]
    of: frozenset[str]
    says: str
    material: str
    margin: float


@dataclass(frozen=True)
class Evidence:
    """All that the file says about one part."""

    surfaces: Sequence[Surface]
    finishes: Sequence[Finish]
    """Of the part."""
    thing: SceneObject
    alone: bool
    """The part is the whole object."""
    metallic_means_something: bool
    """Some surface of the object is not fully metallic: 1 is more than the exporter's default."""

    @property
    def own(self) -> tuple[str, ...]:
        """Names that are the part's own."""
        return tuple(
            dict.fromkeys([*(f.name for f in self.finishes), *(s.name for s in self.surfaces)])
        )

    @property
    def general(self) -> tuple[str, ...]:
        """Names of the whole object."""
        stem = self.thing.source.replace("\\", "/").rsplit("/", 1)[-1].rsplit(".", 1)[0]
        return tuple(dict.fromkeys([self.thing.class_name, self.thing.name, stem]))


def evidence(scene: Scene, identity: Identity, part: int) -> Evidence:
    """Gather what a scene's file says about one of its parts."""
    number = identity.catalogue[part].object
    surfaces = [scene.surfaces[k] for k in identity.surfaces(part)]
    worn = [scene.finishes[s.finish] for s in scene.surfaces if s.object == number]
    return Evidence(
        surfaces=surfaces,
        finishes=[scene.finishes[f] for f in dict.fromkeys(s.finish for s in surfaces)],
        thing=scene.objects[number],
        alone=sum(p.object == number for p in identity.catalogue) == 1,
        metallic_means_something=any(f.metallic < 1.0 for f in worn),
    )


def stated_substance(surfaces: Iterable[Surface]) -> str | None:
    """Return what the nodes state outright in their extras, or None."""
    said = {str(s.extras["substance"]) for s in surfaces if s.extras.get("substance")}
    return said.pop() if len(said) == 1 else None


def stated_thickness(surfaces: Iterable[Surface]) -> float | None:
    """Return the wall thickness [m] that the nodes state; 0: stated solid; None: not said."""
    said = {_length(s.extras.get("shell_thickness_m")) for s in surfaces}
    return said.pop() if len(said) == 1 else None


def _length(said: object) -> float | None:
    """Return a foreign file's number where it can be a length [m]."""
    if isinstance(said, bool) or not isinstance(said, int | float):
        return None
    return float(said) if isfinite(said) and 0 <= said < LONGEST_WALL else None


def matter_hint(surface: Surface, finish: Finish) -> str:
    """Return the material that a surface's own names state, "" for none: tells parts apart."""
    sayings, _ = _told((finish.name, surface.name), (finish,), ("substance", "piece"), ())
    return sayings[0].material if len({s.material for s in sayings}) == 1 else ""


def recognise(evidence: Evidence) -> PartWords:
    """Say what a part is made of, how sure, and why; unknown is a normal answer."""
    for ask in (_own_names, _general_names, _looks, _surface_values):
        answer = ask(evidence)
        if answer is not None:
            return _weighed(answer, evidence)
    return UNKNOWN


def _own_names(evidence: Evidence) -> PartWords | None:
    sayings, name = _told(evidence.own, evidence.finishes, KINDS, evidence.general)
    if not sayings or (sayings[0].plant and not evidence.alone):
        return None  # "plant" names the pot's node as often as the leaves
    whole = sayings[0].kind != "thing" or evidence.alone or sayings[0].every
    return _answer(_of_metal(sayings, evidence), name, 1.0 if whole else WEAKER)


def _general_names(evidence: Evidence) -> PartWords | None:
    sayings, name = _told(evidence.general, evidence.finishes, ("substance", "thing"), ())
    if not sayings:
        return None
    if evidence.alone or sayings[0].every:
        return _answer(_of_metal(sayings, evidence), name, 1.0)
    if sayings[0].plant:
        return None  # which of its parts this is, only the colour tells
    return _answer(sayings, name, WEAKER) if sayings[0].kind == "substance" else None


def _looks(evidence: Evidence) -> PartWords | None:
    """Tell a part by its plain colour where the thing has a part that looks so."""
    if evidence.alone or any(f.texture is not None for f in evidence.finishes):
        return None
    around = {w for name in evidence.general for w in _tokens(name)}
    for look in _lookbook():
        if look.of & around and all(_seen_as(look, f) for f in evidence.finishes):
            reason = f"In {evidence.thing.class_name!r} what is {look.says} is usually "
            return PartWords(
                "", look.material, margin=look.margin, reason=f"{reason}{look.material}."
            )
    return None


def _surface_values(evidence: Evidence) -> PartWords | None:
    if all(f.transmission > 0.5 for f in evidence.finishes):
        return PartWords("", "glass", margin=0.5, reason="The surface lets light through.")
    if _metallic(evidence):
        reason = "The surface is metallic; steel is the likeliest metal."
        return PartWords("", "steel", margin=0.3, reason=reason)
    return None


def _metallic(evidence: Evidence) -> bool:
    """Tell whether most of the surface is metal, and says so on purpose."""
    return evidence.metallic_means_something and all(
        f.metallic >= METALLIC for f in evidence.finishes
    )


def _weighed(answer: PartWords, evidence: Evidence) -> PartWords:
    """Lower the margin where the surface contradicts the name."""
    if answer.material and _metallic(evidence) and answer.material not in metals():
        reason = f"{answer.reason} But the surface is metallic."
        return replace(answer, margin=answer.margin * 0.5, reason=reason)
    return answer


def _of_metal(sayings: list[Saying], evidence: Evidence) -> list[Saying]:
    """Let a thing that looks metallic be of the metal that such things are made of."""
    if not _metallic(evidence):
        return sayings
    return [replace(s, material=s.metallic or s.material) for s in sayings]


def _answer(sayings: list[Saying], name: str, factor: float) -> PartWords:
    materials = sorted({s.material for s in sayings})
    if len(materials) > 1:
        reason = f"{name!r} speaks of {' and '.join(materials)}; which one is not said."
        return PartWords("", None, reason=reason)
    said = sayings[0]
    kinds = {"substance": "names the material", "piece": "is usually", "thing": "is usually"}
    reason = f"{' '.join(said.phrase)!r} in {name!r} {kinds[said.kind]} {said.material}."
    structure = "shell" if said.structure == "shell" else None
    return PartWords(
        "",
        said.material,
        structure=structure,
        thickness=said.thickness,
        margin=round(said.margin * factor, 3),
        reason=reason,
    )


def _told(
    names: Sequence[str], finishes: Sequence[Finish], kinds: Sequence[str], thing: Sequence[str]
) -> tuple[list[Saying], str]:
    """Find the strongest sayings in any of the names, and the name they stand in.

    Longest phrase first, then substance before piece before thing; a piece's phrase is never more
    telling than a substance ("oak table top"). Several are returned when equally strong ones
    stand in the names.
    """
    found: list[tuple[tuple[int, int, int], Saying, str]] = []
    around = {w for n in thing for w in _tokens(n)}
    for name in names:
        tokens = _tokens(name)
        for saying in _standing_in(tokens):
            if saying.kind in kinds and _fits(saying, finishes, around | set(tokens)):
                length = len(saying.phrase)
                said = 1 if saying.kind == "piece" else length
                rank = (said, -KINDS.index(saying.kind), length)
                found.append((rank, saying, name))
    if not found:
        return [], ""
    best = max(rank for rank, _, _ in found)
    strongest = [(s, n) for rank, s, n in found if rank == best]
    materials = {s.material for s, _ in strongest}
    kept = [(s, n) for s, n in strongest if not materials & set(s.gives_way)]
    kept.sort(key=lambda told: -told[0].margin)
    return _particular([s for s, _ in kept]), kept[0][1]


def _particular(sayings: list[Saying]) -> list[Saying]:
    """Among entries of one phrase, the one with a condition speaks; it was met."""
    return sayings if not any(s.alpha for s in sayings) else [s for s in sayings if s.alpha]


def _fits(saying: Saying, finishes: Sequence[Finish], around: set[str]) -> bool:
    if saying.colour and not any(f.metallic > 0.5 for f in finishes):
        return False
    if saying.alpha and not all(f.alpha_mode == saying.alpha for f in finishes):
        return False
    return not saying.of or bool(around & {_singular(w) for w in saying.of})


def _standing_in(tokens: list[str]) -> Iterator[Saying]:
    for k, token in enumerate(tokens):
        for saying in _by_first_word().get(token, ()):
            if tuple(tokens[k : k + len(saying.phrase)]) == saying.phrase:
                yield saying


@cache
def _by_first_word() -> dict[str, list[Saying]]:
    index: dict[str, list[Saying]] = {}
    for saying in lexicon():
        index.setdefault(saying.phrase[0], []).append(saying)
    return index


def _tokens(name: str) -> list[str]:
    return [_singular(w) for w in words(name)]


def _singular(word: str) -> str:
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word


def _seen_as(look: Look, finish: Finish) -> bool:
    red, green, blue = (_as_seen(c) for c in finish.colour[:3])
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    seen = (360.0 * hue, saturation, value)
    bounds = (look.hue, look.saturation, look.value)
    return all(low <= x <= high for x, (low, high) in zip(seen, bounds, strict=True))


def _as_seen(light: float) -> float:
    """Linear light to sRGB (IEC 61966-2-1)."""
    c = min(max(light, 0.0), 1.0)
    return 12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055


@cache
def metals() -> frozenset[str]:
    """Materials whose surface is metallic."""
    general = next(s for s in lexicon() if s.phrase == ("metal",))
    return frozenset(
        (
            general.material,
            "aluminium_can_sheet",
            "hardened_steel",
            "zinc",
            "lead",
            *general.gives_way,
        )
    )


@cache
def lexicon() -> tuple[Saying, ...]:
    """Every phrase of the lexicon with what it tells."""
    return tuple(
        _saying(kind, phrase, row)
        for kind in KINDS
        for row in _table()[kind]
        for phrase in row["words"]
    )


@cache
def _lookbook() -> tuple[Look, ...]:
    return tuple(
        Look(
            hue=tuple(row["hue"]),
            saturation=tuple(row["saturation"]),
            value=tuple(row["value"]),
            of=frozenset(_singular(w) for w in row["of"]),
            says=row["says"],
            material=row["material"],
            margin=row["margin"],
        )
        for row in _table()["look"]
    )


@cache
def _table() -> dict[str, list[dict]]:
    return tomllib.loads(
        files("corporeal.vlm").joinpath("lexicon.toml").read_text(encoding="utf-8")
    )


def _saying(kind: str, phrase: str, row: dict) -> Saying:
    thickness = row.get("thickness_mm")
    return Saying(
        phrase=tuple(_singular(w) for w in phrase.split()),
        kind=kind,
        material=row["material"],
        margin=row["margin"],
        structure=row.get("structure"),
        thickness=None if thickness is None else thickness * 1e-3,
        gives_way=tuple(row.get("gives_way", ())),
        of=tuple(row.get("of", ())),
        colour=row.get("colour", False),
        every=row.get("every", False),
        plant=row.get("plant", False),
        alpha=row.get("alpha", ""),
        metallic=row.get("metallic", ""),
    )
