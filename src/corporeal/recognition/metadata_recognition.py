"""Recognition of materials from names and surface properties in the file, without a model."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from corporeal.core.types import Finish, PartDescription, Scene, SceneObject, Surface
from corporeal.recognition.head_noun import strip_whole_from_part_name
from corporeal.recognition.lexicon import (
    LOOSE_MATERIALS,
    NOUNS_SHAPED_OF_LOOSE,
    NOUNS_WHOLLY_OF_MATERIAL,
    TERM_KINDS,
    LexiconTerm,
    TokenisedName,
    colour_rules,
    emptied_words,
    have_same_walls,
    head_terms,
    hollow_wall_thickness,
    is_hollow_in_material,
    matches_colour_rule,
    metal_materials,
    multiword_names,
    name_tokens,
    names_hollow_casting,
    names_hollow_object,
    names_open_vessel,
    strip_plural_s,
    substance_terms,
)
from corporeal.recognition.parts_by_name import PartsByName
from corporeal.recognition.readable_names import everyday_words

WHOLE_OBJECT_MARGIN_FACTOR = 0.6
"""Factor on the margin of what describes the whole object when the part is only one of several."""
MIN_METALLIC_VALUE = 0.5
"""Metallic value from which most of a surface is metal: a picture's value is its mean."""
UNPAINTED_METALS = frozenset("stainless_steel clad_steel cast-iron brass bronze pewter silver".split())
"""Metals that are seldom painted: beside what is usually of them, a metal's name is no colour."""
STUFFING_MATERIALS = frozenset(("seat_foam", "memory_foam", "fibre_fill"))
"""What upholstered objects are of, behind their covers."""
COVER_MATERIALS = frozenset("leather synthetic_leather cotton synthetic_textile felt".split())
"""What comes in sheets, and covers what is upholstered: a leather sofa is no block of leather."""
MACHINERY_CONTENTS = "machinery"
"""Contents of a machine's case, which are no goods."""
MAX_SOLID_CASTING_EXTENT_M = 0.2
"""Statues of metal that are larger are cast around a core [m]."""
UNKNOWN_PART = PartDescription("", None, reason="No name in the file says what this is made of.")


@dataclass(frozen=True)
class FileEvidence:
    """All that the file says about one part."""

    surfaces: Sequence[Surface]
    finishes: Sequence[Finish]
    """Of the part."""
    thing: SceneObject
    alone: bool
    """The part is the whole object."""
    metallic_means_something: bool
    """Some surface of the object is not fully metallic: 1 is more than the exporter's default."""
    shared: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    """Leading words that all of the object's surfaces have in common, and all its finishes: they describe the whole."""
    claimed: frozenset[str] = frozenset()
    """Materials that the object's other parts name as their own."""

    @property
    def extent(self) -> float:
        """Longest side of the object [m]."""
        return self.thing.real_extent

    @property
    def own(self) -> list[TokenisedName]:
        """Names that are the part's own, without what its sibling parts are called too."""
        finishes = [_tokenise_name(f.name, self.shared[1]) for f in self.finishes]
        named = [*finishes, *(_tokenise_name(s.name, self.shared[0]) for s in self.surfaces)]
        overruled = {name_tokens(text) for text in _object_names(self.thing)} - self._heard
        return [name for name in named if name.words not in overruled]

    @property
    def general(self) -> list[TokenisedName]:
        """Names of the whole object; "desk leg" is a leg."""
        whole = (TokenisedName(n.text, strip_whole_from_part_name(n.words, multiword_names())) for n in self.called)
        return [*whole, *(TokenisedName(" ".join(w), w) for w in self.shared if w)]

    @property
    def called(self) -> list[TokenisedName]:
        """The same with what it is a part of."""
        every = (_tokenise_name(text) for text in _object_names(self.thing))
        return [name for name in every if name.words in self._heard]

    @property
    def _heard(self) -> set[tuple[str, ...]]:
        """Names of the object that are accepted: a "rubber_ball" of steel_ball.ply is no steel."""
        thing, heard = self.thing, set()
        by_file = thing.class_name == everyday_words(thing.stem)
        first = [thing.name, thing.class_name] if by_file else [thing.class_name, thing.name]
        matter: set[str] = set()
        for text in (*first, thing.stem):
            said = _named_substances([_tokenise_name(text)])
            if not matter or not said or said & matter:
                heard.add(name_tokens(text))
            matter = matter or said
        return heard


def gather_file_evidence(scene: Scene, identity: PartsByName) -> list[FileEvidence]:
    """Gather what a scene's file says about each of its parts, in the catalogue's order."""
    parts_of: dict[int, list[int]] = {}
    for number, part in enumerate(identity.catalogue):
        parts_of.setdefault(part.object, []).append(number)
    gathered: dict[int, FileEvidence] = {}
    for thing, parts in parts_of.items():
        gathered |= _evidence_of_object(scene, thing, {p: identity.surfaces(p) for p in parts})
    return [gathered[number] for number in range(len(identity.catalogue))]


def _evidence_of_object(scene: Scene, thing: int, surfaces: dict[int, list[int]]) -> dict[int, FileEvidence]:
    """Gather evidence about all parts of one object; ``surfaces`` of each part."""
    worn = {p: [scene.surfaces[k] for k in mine] for p, mine in surfaces.items()}
    finishes = {p: [scene.finishes[f] for f in dict.fromkeys(s.finish for s in mine)] for p, mine in worn.items()}
    looks = [f for mine in finishes.values() for f in mine]
    shared = (_common_prefix([s.name for mine in worn.values() for s in mine]), _common_prefix([f.name for f in looks]))
    whole = FileEvidence(
        surfaces=(),
        finishes=(),
        thing=scene.objects[thing],
        alone=len(worn) == 1,
        metallic_means_something=any(f.metallic < 1.0 for f in looks),
        shared=shared if len(worn) > 1 else ((), ()),
    )
    found = {p: replace(whole, surfaces=worn[p], finishes=finishes[p]) for p in worn}
    claims = {p: _named_substances(e.own) for p, e in found.items()}
    times = Counter(m for named in claims.values() for m in named)
    return {
        p: replace(e, claimed=frozenset(m for m, n in times.items() if n > (m in claims[p]))) for p, e in found.items()
    }


def _object_names(thing: SceneObject) -> list[str]:
    """Return what an object is called: in words, in the scene, and as its file."""
    return list(dict.fromkeys([thing.class_name, thing.name, thing.stem]))


def _named_substances(names: Sequence[TokenisedName]) -> set[str]:
    return {t.material for name in names for t in substance_terms(name.words)}


def _tokenise_name(text: str, shared: tuple[str, ...] = ()) -> TokenisedName:
    found = name_tokens(text)
    common = found[: len(shared)] == shared
    return TokenisedName(text, found[len(shared) :] if common else found)


def _common_prefix(names: Sequence[str]) -> tuple[str, ...]:
    """Return the leading words that several different names have in common."""
    tokens = list(dict.fromkeys(name_tokens(name) for name in names))
    if len(tokens) < 2:
        return ()
    same = [len(set(column)) == 1 for column in zip(*tokens, strict=False)]
    return tokens[0][: same.index(False) if False in same else len(same)]


def infer_hollow_structure(
    words: PartDescription, evidence: FileEvidence, walled: Callable[[str], bool], from_pictures: bool = False
) -> PartDescription:
    """Give parts of hollow classes a wall, if their structure is not stated.

    Args:
        words: What was recognised of a part.
        evidence: All that the file says about it.
        walled: Whether wall thicknesses of a material were measured.
        from_pictures: Whether its shape is from pictures, which need not show how deep a vessel is.
    """
    ware = from_pictures and any(names_open_vessel(name.words) for name in evidence.general)
    if ware and words.structure == "shell" and words.inflation is None:
        words = replace(words, structure=None)  # with a mouth, where the name's wall has none
    if words.structure is not None and words.thickness is not None:
        return words
    bare = words.material is not None and not walled(words.material)
    if bare and words.thickness is None:
        return replace(words, structure=None, contents=None, fill=None)
    if words.structure is not None:
        return words
    wall = _moulded_wall(words, evidence)
    if wall is not None and not from_pictures:
        return replace(
            words,
            structure="shell",
            thickness=words.thickness or wall,
            wall_usual=words.wall_usual or words.thickness is None,
        )
    if ware:
        return replace(words, structure="sheet")
    named = evidence.general
    called = evidence.alone and any("hollow" in name.words for name in named)
    is_hollow = called or any(names_hollow_object(name.words) for name in named)
    is_cast = words.material in metal_materials() and evidence.thing.real_extent > MAX_SOLID_CASTING_EXTENT_M
    if is_cast and any(names_hollow_casting(name.words) for name in named):
        is_hollow = True
    return replace(words, structure="shell") if is_hollow else words


def _moulded_wall(words: PartDescription, evidence: FileEvidence) -> float | None:
    """Return the wall thickness [m] of a part that is hollow by its class and material."""
    if words.material is None or not evidence.alone:
        return None
    walls = (hollow_wall_thickness(name.words, words.material) for name in evidence.general)
    return next((wall for wall in walls if wall is not None), None)


def substance_hint(surface: Surface, finish: Finish) -> str:
    """Return the material that a surface's own names state, "" for none: it separates parts."""
    names = [_tokenise_name(finish.name), _tokenise_name(surface.name)]
    terms, _ = _strongest_terms(names, (finish,), ("substance", "piece"), ())
    return terms[0].material if len({s.material for s in terms}) == 1 else ""


def recognise_part(evidence: FileEvidence) -> PartDescription:
    """Return a part's material with confidence and reason; unknown is a valid result."""
    for ask in (_by_own_names, _by_object_names, _by_colour, _by_surface_values):
        answer = ask(evidence)
        if answer is not None:
            return _as_solid_if_named(_without_lost_contents(_weaken_if_metallic(answer, evidence), evidence), evidence)
    return UNKNOWN_PART


def _by_own_names(evidence: FileEvidence) -> PartDescription | None:
    terms, name = _strongest_terms(evidence.own, evidence.finishes, TERM_KINDS, evidence.general, evidence.extent)
    if not terms or (terms[0].plant and not evidence.alone):
        return None  # "plant" names the pot's node as often as the leaves
    sure = terms[0].kind != "thing" or evidence.alone or terms[0].every
    return _part_from_terms(_as_metal_if_metallic(terms, evidence), name, 1.0 if sure else WHOLE_OBJECT_MARGIN_FACTOR)


def _by_object_names(evidence: FileEvidence) -> PartDescription | None:
    kinds, names = ("substance", "thing"), evidence.general
    terms, name = _strongest_terms(names, evidence.finishes, kinds, names, evidence.extent)
    if not terms and evidence.alone and names != evidence.called:  # a part by itself: "desk leg"
        called = evidence.called
        terms, name = _strongest_terms(names, evidence.finishes, ("piece",), called, evidence.extent)
    if not terms:
        return None
    if evidence.alone or terms[0].every:
        packed = terms[0].contents == MACHINERY_CONTENTS and not evidence.alone
        return _part_from_terms(
            _as_metal_if_metallic(terms, evidence), name, WHOLE_OBJECT_MARGIN_FACTOR if packed else 1.0
        )
    named = {t.material for t in terms}
    if terms[0].kind != "substance" or named & evidence.claimed:
        return None  # only its colour says which of the parts this is
    return _part_from_terms(terms, name, WHOLE_OBJECT_MARGIN_FACTOR)


def _by_colour(evidence: FileEvidence) -> PartDescription | None:
    """Recognise a part by its plain colour, where such objects have a part of that colour."""
    if evidence.alone or any(f.texture is not None for f in evidence.finishes):
        return None
    around = {w for name in evidence.general for w in name.words}
    for look in colour_rules():
        if look.of & around and all(matches_colour_rule(look, f) for f in evidence.finishes):
            reason = f"In {evidence.thing.class_name!r} what is {look.says} is usually "
            return PartDescription("", look.material, margin=look.margin, reason=f"{reason}{look.material}.")
    return None


def _by_surface_values(evidence: FileEvidence) -> PartDescription | None:
    if all(f.transmission > 0.5 for f in evidence.finishes):
        return PartDescription("", "glass", margin=0.5, reason="The surface lets light through.")
    if _is_metallic(evidence):
        reason = "The surface is metallic; steel is the likeliest metal."
        return PartDescription("", "steel", margin=0.3, reason=reason)
    return None


def _is_metallic(evidence: FileEvidence) -> bool:
    """Whether most of the surface is stated to be metal, and not by an exporter's default."""
    return evidence.metallic_means_something and all(f.metallic >= MIN_METALLIC_VALUE for f in evidence.finishes)


def _weaken_if_metallic(answer: PartDescription, evidence: FileEvidence) -> PartDescription:
    """Lower the margin where the surface contradicts the name."""
    if answer.material and _is_metallic(evidence) and answer.material not in metal_materials():
        reason = f"{answer.reason} But the surface is metallic."
        return replace(answer, margin=answer.margin * 0.5, reason=reason)
    return answer


def _without_lost_contents(answer: PartDescription, evidence: FileEvidence) -> PartDescription:
    """Leave contents only in goods that are one part and are not called empty.

    What works in a machine stays, and what stuffs upholstery.
    """
    named = {w for name in (*evidence.own, *evidence.general) for w in name.words}
    whole = evidence.alone and not named & emptied_words()
    if answer.contents in (None, MACHINERY_CONTENTS, *STUFFING_MATERIALS) or whole:
        return answer
    return replace(answer, structure="shell", contents=None, fill=None)


def _as_solid_if_named(answer: PartDescription, evidence: FileEvidence) -> PartDescription:
    """Let a ball be solid that is called so; a chest of solid oak is hollow."""
    named = [name for name in evidence.general if "solid" in name.words]
    if answer.structure != "shell" or not any(t.blown for n in named for t in head_terms(n.words)):
        return answer
    bare = replace(answer, structure="solid", thickness=None, wall_usual=False)
    return replace(bare, inflation=None, rebound=None)


def _as_metal_if_metallic(terms: list[LexiconTerm], evidence: FileEvidence) -> list[LexiconTerm]:
    """Choose the usual metal of an object that looks metallic."""
    if not _is_metallic(evidence):
        return terms
    return [replace(s, material=s.metallic or s.material) for s in terms]


def _part_from_terms(terms: list[LexiconTerm], name: str, factor: float) -> PartDescription:
    materials = sorted({s.material for s in terms})
    if len(materials) > 1:
        reason = f"{name!r} names {' and '.join(materials)}: it is not clear which one."
        return PartDescription("", None, reason=reason)
    first = terms[0]
    kinds = {"substance": "names the material", "piece": "is usually", "thing": "is usually"}
    says = kinds["thing" if first.narrowed else first.kind]
    reason = f"{' '.join(first.phrase)!r} in {name!r} {says} {first.material}."
    shell = "shell" if first.structure == "shell" else None
    return PartDescription(
        "",
        first.material,
        structure="filled" if first.contents else shell,
        thickness=first.thickness,
        wall_usual=first.thickness is not None,
        margin=round(first.margin * factor, 3),
        reason=reason,
        contents=first.contents,
        fill=first.fill,
        inflation=first.inflation,
        rebound=first.rebound,
    )


def _strongest_terms(
    names: Sequence[TokenisedName],
    finishes: Sequence[Finish],
    kinds: Sequence[str],
    thing: Sequence[TokenisedName],
    extent: float = 0.0,
) -> tuple[list[LexiconTerm], str]:
    """Find the strongest terms in any of the names, and the name they stand in.

    Longest phrase first, then substance before piece before object, then what stands beside an object. The phrase of a
    piece never ranks above a substance ("oak table top"), nor that of an object above the substance right before it
    ("steel trash can"). Several are returned when equally strong ones stand in the names.
    """
    found: list[tuple[tuple[int, int, int, bool], LexiconTerm, str]] = []
    around = {w for name in thing for w in name.words}
    things = [t for n in (*names, *thing) for t in head_terms(n.words) if t.kind != "substance"]
    every = around.union(*(name.words for name in names))
    nameless = thing and not any(_term_condition_holds(t, finishes, every) for t in things)
    shiny = any(f.metallic > MIN_METALLIC_VALUE for f in finishes)
    of_metal = {t.metallic for name in thing for t in head_terms(name.words) if t.metallic}
    bare = any(t.kind == "thing" and t.material in UNPAINTED_METALS for t in things)
    for name in names:
        for term in _terms_in_context(name):
            if term.colour and not shiny:
                if not (term.seldom and (nameless or bare or term.material in of_metal)):
                    continue
                term = replace(term, margin=term.margin * WHOLE_OBJECT_MARGIN_FACTOR)
            if not term.extents[0] <= extent < term.extents[1] or (term.lone and name not in thing):
                continue
            if term.kind in kinds and _term_condition_holds(term, finishes, around | set(name.words)):
                length = len(term.phrase)
                weight = 1 if term.kind == "piece" else max(length, term.before)
                rank = (weight, -TERM_KINDS.index(term.kind), length, term.before > 0)
                found.append((rank, term, name.text))
    if not found:
        return [], ""
    best = max(rank for rank, _, _ in found)
    strongest = [(s, n) for rank, s, n in found if rank == best]
    materials = {s.material for s, _ in strongest}
    kept = [(s, n) for s, n in strongest if not materials & set(s.gives_way)]
    kept.sort(key=lambda pair: -pair[0].margin)
    return _prefer_conditional_terms([s for s, _ in kept]), kept[0][1]


def _terms_in_context(name: TokenisedName) -> list[LexiconTerm]:
    """Find the terms in a name; a substance right beside an object is that of such an object.

    "Wooden chair", and as files are named "chair_wooden"; what lies loose is no object's material: a snow shoe, a snow
    globe. A general word means what such objects are of: a plastic duck is of PVC.
    """
    standing = head_terms(name.words)
    things = sorted((s for s in standing if s.kind == "thing"), key=lambda t: -len(t.phrase))
    for k, term in enumerate(standing):
        if term.kind != "substance":
            continue
        beside = next((t for t in things if name.says(term.phrase + t.phrase)), None)
        if beside is None and term.material not in LOOSE_MATERIALS and not term.colour:
            beside = next((t for t in things if name.says(t.phrase + term.phrase)), None)
        if beside and (beside.material in term.gives_way or (term.inflation and beside.inflation)):
            standing[k] = replace(beside, kind=term.kind, before=len(beside.phrase), narrowed=True)
        elif beside:
            standing[k] = _structured_as_object(term, beside)
    solid = any(s.kind == "substance" and s.material not in LOOSE_MATERIALS for s in standing)
    return [
        s
        for s in standing
        if not (solid and _is_loose_material(s) and len(s.phrase) == 1) and not _is_purpose(s, name, things)
    ]


def _is_loose_material(term: LexiconTerm) -> bool:
    return term.kind == "substance" and term.material in LOOSE_MATERIALS


def _is_purpose(term: LexiconTerm, name: TokenisedName, things: Sequence[LexiconTerm]) -> bool:
    """Return whether a granular material is an object's purpose, not its material."""
    return _is_loose_material(term) and any(
        t.phrase[-1] not in NOUNS_SHAPED_OF_LOOSE | NOUNS_WHOLLY_OF_MATERIAL
        or not (name.says(term.phrase + t.phrase) or name.says(t.phrase + term.phrase))
        for t in things
    )


def _structured_as_object(substance: LexiconTerm, thing: LexiconTerm) -> LexiconTerm:
    """Return a substance with the structure of an object of its class.

    A ball of rubber is blown up, and one of steel is solid. A sofa of leather is covered with it, as thick as that
    usually is. What is blown up is a skin, whatever it is.
    """
    if substance.inflation is not None:
        return replace(substance, before=len(thing.phrase))
    if substance.material in COVER_MATERIALS and thing.material in STUFFING_MATERIALS:
        return replace(substance, before=len(thing.phrase), contents=thing.material, fill=1.0, every=thing.every)
    same = have_same_walls(substance.material, thing.material)
    if not is_hollow_in_material(thing, substance.material):
        return replace(substance, before=len(thing.phrase))
    return replace(
        substance,
        before=len(thing.phrase),
        structure=thing.structure,
        contents=thing.contents,
        fill=thing.fill,
        inflation=thing.inflation,
        rebound=thing.rebound,
        thickness=thing.thickness if same else None,
        every=same and thing.every,
    )


def _prefer_conditional_terms(terms: list[LexiconTerm]) -> list[LexiconTerm]:
    """Among entries of one phrase, prefer those with a condition: it was met."""
    return terms if not any(s.alpha for s in terms) else [s for s in terms if s.alpha]


def _term_condition_holds(term: LexiconTerm, finishes: Sequence[Finish], around: set[str]) -> bool:
    if term.alpha and not all(f.alpha_mode == term.alpha for f in finishes):
        return False
    return not term.of or bool(around & {strip_plural_s(w) for w in term.of})
