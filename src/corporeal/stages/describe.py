"""Describe: say in words what is in the scene and what each part is made of."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal import materials
from corporeal.errors import UnknownChoiceError, UserError, check_range
from corporeal.geometry.extent import oriented_size
from corporeal.geometry.identity import Identity, identify
from corporeal.geometry.identity import words as telling
from corporeal.materials.offer import Choice, contents_offered, substances_offered
from corporeal.materials.placement import (
    Judgement,
    choices,
    entry_of,
    from_fractions,
    from_values,
    odd,
    spelling,
    usual,
    wall_put,
)
from corporeal.materials.quantities import QUANTITIES
from corporeal.render.portrait import DIRECTIONS, Portrait, colour_of_part, portraits
from corporeal.types import (
    Ground,
    Inventory,
    ObjectWords,
    PartWords,
    Placement,
    Scene,
    Surface,
    in_way,
)
from corporeal.vlm import Album, Vlm, connect, critic_of
from corporeal.vlm.annotation import Annotation, built, named_pieces, read_annotations
from corporeal.vlm.answers import FractionAnswer, ValueAnswer, Vocabulary
from corporeal.vlm.by_hand import all_answered, is_more
from corporeal.vlm.interview import Interview, Offer, Subject
from corporeal.vlm.metadata import (
    as_stated,
    evidence,
    hollowed,
    matter_hint,
    recognise,
    sealed,
    stated_inflation,
    stated_substance,
    stated_thickness,
    stated_values,
    usual_inflation,
    walled,
)
from corporeal.vlm.together import together
from corporeal.vlm.words import (
    Asked,
    against,
    another,
    evidence_of,
    gathered,
    leaves,
    part_words,
    placed,
    resolved,
    sides,
    usage,
    with_extents,
)

TASKS = ("parts", "ranking", "materials", "placement", "mass", "extents")


@dataclass(frozen=True)
class DescribeConfig:
    """What recognises parts and materials."""

    annotations: Path | None = None
    """YAML file with materials of parts; it takes precedence over every other answer."""
    vlm: str = "metadata"
    """"metadata": names and materials in the file. "openai:MODEL", "anthropic:MODEL",
    "google:MODEL", "ollama:MODEL", or "openai:MODEL@http://host/v1" for any compatible server.
    "ask:FOLDER": you answer. "replay:FOLDER": recorded answers."""
    critic: str = ""
    """Model that ranks proposed decompositions into parts, as --vlm; "": the same model, or a
    cheaper one of OpenAI's."""
    record: Path | None = None
    """Folder to record every answer in, for --vlm replay:FOLDER."""
    sampling: Literal["fraction", "value"] = "fraction"
    """Ask a model for fractions of the measured ranges, or for values, which are then checked."""
    views: int = 4
    """Pictures of each object, out of 8 around it; one more shows its parts in colours."""
    view_size: int = 512
    """Their height and width [px]."""
    view_seed: int = 0
    """Chooses the views."""
    direct: bool = True
    """Also ask a model, without the library, what is printed on each object and what it weighs.
    This reweights the ways it may be, and sets no value."""
    parallel: int = 4
    """Number of objects that a model is asked about at the same time."""


DEFAULT = DescribeConfig()
SHARES = ("volume_share", "surface_share")
OPEN = ("sheet", "metadata")
"""What an open vessel is by its name, and who says so."""
Progress = Callable[[float, str], None]


def describe(
    scene: Scene,
    config: DescribeConfig = DEFAULT,
    library: str = "default",
    progress: Progress = lambda fraction, words: None,
    from_pictures: bool = False,
) -> Inventory:
    """Name every object's parts and their materials.

    Answers are taken, in this order, from the annotation file, a model (or its recorded answers)
    and the names in the file; what none of them knows is unknown. A model is also asked where in
    the measured ranges each value lies, and how large such objects usually are.

    Args:
        scene: What was assembled.
        config: Whom to ask.
        library: The library whose names and ranges a model is offered.
        progress: Told the fraction done and what is being done.
        from_pictures: Objects are one surface each; an annotation may name the pieces of one.

    Raises:
        UserError: An annotation or a recording does not fit the scene, nobody can be asked, or
            questions wait for a person's answers.

    """
    validate(config)
    identity = identify(scene, matter_hint)
    annotations = _annotations(scene, identity, config, library, from_pictures)
    file = _file_words(scene, identity, library, from_pictures)
    model = connect(config.vlm, config.record)
    if model is None:
        objects = [
            ObjectWords(
                obj.name,
                obj.class_name,
                tuple(_with_annotations(words, annotations, obj.name, config)),
            )
            for obj, words in zip(scene.objects, file, strict=True)
        ]
        return Inventory(tuple(objects), warnings=_open_ware(objects) if from_pictures else ())
    critic = connect(critic_of(config.vlm, config.critic), config.record) or model
    asking = _Asking(scene, identity, config, library, model, critic)
    return asking.inventory(file, annotations, progress)


def validate(config: DescribeConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scene."""
    for name, value, low, high in (
        ("--views", config.views, 1, DIRECTIONS),
        ("--view-size", config.view_size, 16, 2048),
        ("--parallel", config.parallel, 1, 64),
    ):
        check_range(name, value, low, high)


# ---------------------------------------------------------------- a model's answers


class _Asking:
    """One scene being asked about."""

    def __init__(
        self,
        scene: Scene,
        identity: Identity,
        config: DescribeConfig,
        library: str,
        model: Vlm,
        critic: Vlm,
    ) -> None:
        self.scene, self.identity, self.config, self.library = scene, identity, config, library
        self.model, self.critic = model, critic
        folder = files("corporeal.stages").joinpath("prompts")
        self.prompts = {t: folder.joinpath(f"{t}.md").read_text(encoding="utf-8") for t in TASKS}
        self.lists = {
            "materials": substances_offered(library),
            "contents": contents_offered(library),
        }
        self.names = Vocabulary(
            partial(spelling, library_name=library, offered=materials.substances(library)),
            partial(spelling, library_name=library, offered=materials.contents(library)),
            partial(_walled, library),
        )

    def inventory(self, file: list, annotations: Mapping, progress: Progress) -> Inventory:
        """Ask about every object, and about the sizes of all."""
        count = len(self.scene.objects)
        interviews = [self._interview(number) for number in range(count)]
        sizes = self._about(Subject(self.scene.name, self.scene.name, "", "not known"))
        named = dict.fromkeys(o.class_name or o.name for o in self.scene.objects)
        classes = [name for name in named if telling(name)]  # "object" has no usual size
        jobs: list[Callable] = [
            partial(self._object, number, interviews[number], file[number], annotations)
            for number in range(count)
        ]
        results = together(
            [*jobs, lambda: sizes.extents(classes) if classes else {}],
            self.config.parallel,
            lambda done: progress(done / (count + 1), "asking"),
            is_more,
        )
        *objects, extents = all_answered(results, self.config.vlm)
        interviews.append(sizes)
        rows = tuple(row for interview in interviews for row in interview.transcript)
        warnings = [w for interview in interviews for w in interview.warnings]
        warnings += filter(None, map(self._contradicted, range(count), objects))
        objects, doubts = with_extents(self.scene.objects, objects, extents)
        return Inventory(tuple(objects), rows, usage(rows), (*warnings, *doubts))

    def _contradicted(self, number: int, words: ObjectWords) -> str:
        """Say where a model was believed before what the file states of an object outright."""
        believed, clauses = {w.name: w for w in words.parts}, []
        for k, entry in enumerate(self.identity.catalogue):
            if entry.object == number:
                own = [self.scene.surfaces[s] for s in self.identity.surfaces(k)]
                made = _stated(own, self.library)
                name = made and entry_of(str(made.material), self.library).name
                put = wall_put(believed[entry.name], self.library)
                clauses.append(against(believed[entry.name], name, stated_thickness(own), put))
        against_file = "; ".join(filter(None, clauses))
        if not against_file:
            return ""
        return f"{words.name}: {against_file}. The latter was believed; --annotations decides."

    def _about(self, subject: Subject) -> Interview:
        return Interview(self.model, self.critic, self.prompts, subject)

    def _names(self, number: int) -> list[str]:
        return [p.name for p in self.identity.catalogue if p.object == number]

    def _interview(self, number: int) -> Interview:
        obj, parts = self.scene.objects[number], self._names(number)
        portrait = Portrait(self.config.views, self.config.view_size, self.config.view_seed)
        first = next(k for k, p in enumerate(self.identity.catalogue) if p.object == number)
        own = [
            int(part) - first if surface.object == number else None
            for part, surface in zip(
                self.identity.part_of_surface, self.scene.surfaces, strict=True
            )
        ]
        corners = [s.vertices for s in self.scene.surfaces if s.object == number]
        lengths = [side / obj.scale for side in oriented_size(np.concatenate(corners))]
        return self._about(
            Subject(
                scene=f"{self.scene.name}/{obj.name}",
                name=obj.name,
                class_name=obj.class_name,
                sides=sides(lengths),
                box=float(np.prod(lengths)),
                views=portrait.words,
                count=self.config.views + (len(parts) > 1),
                pictures=Album(partial(portraits, self.scene, own, portrait))
                if self.model.looks
                else (),
            )
        )

    def _object(
        self, number: int, interview: Interview, file: list[PartWords], annotations: Mapping
    ) -> ObjectWords:
        """Ask everything about one object."""
        obj, names = self.scene.objects[number], self._names(number)
        stated = {part: a.material for (name, part), a in annotations.items() if name == obj.name}
        words = file
        if not (all(stated.get(name) for name in names) or stated.keys() - set(names)):
            words = self._materials(interview, names, self._pieces(interview, names), file)
        words = _with_annotations(words, annotations, obj.name, self.config)
        words = self._placed(interview, words)
        weighs = interview.mass() if self.config.direct else None
        evidence = evidence_of(*weighs) if weighs else None
        return ObjectWords(obj.name, obj.class_name, tuple(words), evidence=evidence)

    def _pieces(self, interview: Interview, names: list[str]) -> list[str]:
        """Name the parts to ask about: the file's, or what a single mesh is taken apart into."""
        taken = interview.parts() if len(names) == 1 else None
        pieces = [p.name for p in taken[0].parts] if taken else names
        if len(pieces) > 1:
            return pieces
        looks = list(interview.looks.values())
        interview.looks = dict(zip(names, looks, strict=True)) if len(names) == len(looks) else {}
        return names

    def _materials(
        self, interview: Interview, names: list[str], pieces: list[str], file: list[PartWords]
    ) -> list[PartWords]:
        shared = len(pieces) > len(names)
        looks = {name: interview.looks.get(name, "") for name in pieces}
        if len(names) > 1:
            colours = zip(names, colour_of_part(len(names)), strict=True)
            looks = {name: f"{colour} in the last picture" for name, colour in colours}
        asked = interview.materials(looks, self.names, self.lists, shared)
        if asked is None:
            return file
        words = part_words(*asked, self.names)
        if len(names) == 1:
            words = [gathered(names[0], words)]
        answered = {w.name: w for w in words}
        known = list(zip(names, file, strict=True))
        found = [
            replace(resolved(answered[name], own, self.names.walled), stated=own.stated)
            for name, own in known
        ]
        # How hard it is inflated no picture shows: its name says it.
        return [sealed(w, own.inflation, None) for w, (_, own) in zip(found, known, strict=True)]

    def _placed(self, interview: Interview, words: list[PartWords]) -> list[PartWords]:
        """Ask where in its measured range each open value of each part lies, in all its ways."""
        parts = {name: way for leaf in leaves(words) for name, way in _in_all_ways(leaf).items()}
        offered = {
            name: choices(way, self.library, weighing=name != way.name)
            for name, way in parts.items()
        }
        offered = {name: found for name, found in offered.items() if found}
        if not offered:
            return words

        def problems(answer: Placed) -> list[str]:
            return [
                f"{name}: {clause}"
                for name, places in _places(answer, "model", offered).items()
                for clause in odd(parts[name], places, self.library).values()
            ]

        looks = interview.looks
        offers = {
            name: _offer(name, parts[name], looks.get(parts[name].name, ""), found)
            for name, found in offered.items()
        }
        shape = ValueAnswer if self.config.sampling == "value" else FractionAnswer
        asked = interview.placement(offers, shape, problems)
        if asked is None:
            why = "The model gave no usable answer: the usual value."
            places = {name: usual(found, why) for name, found in offered.items()}
        else:
            places = _places(*asked, offered)
        return [placed(w, places) for w in words]


def _in_all_ways(words: PartWords) -> dict[str, PartWords]:
    """Return the part in each of its ways under the name it is asked about; the first is itself."""
    others = enumerate(words.hypotheses[1:], 1)
    return {words.name: words} | {another(words.name, k): in_way(words, w) for k, w in others}


Placed = FractionAnswer | ValueAnswer
Offered = Mapping[str, Mapping[str, Choice]]
"""Part → quantity → what it can be."""


def _offer(name: str, words: PartWords, look: str, offered: Mapping[str, Choice]) -> Offer:
    made = [str(words.material), *([words.structure] if words.structure else [])]
    if words.contents is not None:
        made.append(f"{words.fill or 1.0:.0%} full of {words.contents}")
    if words.solidity is not None:
        made.append(f"{words.solidity:.0%} of it matter")
    seen = f" (it looks: {look})" if look else ""
    return Offer(
        f"{name}: {', '.join(made)}{seen}",
        {field: c.words for field, c in offered.items()},
        {field: c.bounds for field, c in offered.items()},
    )


def _places(answer: Placed, by: Asked, offered: Offered) -> dict[str, dict[str, Placement]]:
    read = from_values if isinstance(answer, ValueAnswer) else from_fractions
    return {
        p.part: read(
            {v.quantity: Judgement(v.number, v.reason) for v in p.values}, by, offered[p.part]
        )
        for p in answer.parts
    }


# ---------------------------------------------------------------- the file's own names


def _file_words(
    scene: Scene, identity: Identity, library: str, from_pictures: bool
) -> list[list[PartWords]]:
    words: list[list[PartWords]] = [[] for _ in scene.objects]
    walls = partial(_walled, library)
    for entry, seen in zip(identity.catalogue, evidence(scene, identity), strict=True):
        found = _stated(list(seen.surfaces), library) or hollowed(
            recognise(seen), seen, walls, from_pictures
        )
        by = "metadata" if found.material else "unknown"
        found = replace(found, name=entry.name, answered_by=by)
        found = walled(found, stated_thickness(seen.surfaces))
        found = replace(as_stated(found, seen.surfaces), stated=_stated_values(seen.surfaces))
        found = sealed(found, stated_inflation(seen.surfaces), usual_inflation(seen))
        built_by = "metadata" if found.structure else "unknown"
        words[entry.object].append(replace(found, built_by=built_by))
    return words


def _open_ware(objects: Sequence[ObjectWords]) -> tuple[str, ...]:
    """Say of which objects from pictures the name decided that they are no solids."""
    made = [o.name for o in objects for p in o.parts if (p.structure, p.built_by) == OPEN]
    return tuple(
        f"{name}: pictures need not show how deep it is inside. By its name it is taken for open "
        "ware, with a wall as thick as its material usually has; annotate structure and "
        "thickness_mm if that is wrong."
        for name in made
    )


def _walled(library: str, name: str) -> bool:
    """Whether a library has a wall thickness for a material."""
    return "shell_thickness" in entry_of(name, library).ranges


def _stated_values(surfaces: Sequence[Surface]) -> dict[str, Ground]:
    """Return the numbers that the file states, of quantities that there are.

    Raises:
        UserError: One of them can be no material's.

    """
    found = {n: g for n, g in stated_values(surfaces).items() if n in QUANTITIES}
    for name, ground in found.items():
        quantity = QUANTITIES[name]
        if not quantity.low <= ground.value <= quantity.high:
            unit = "" if quantity.unit == "-" else f" {quantity.unit}"
            raise UserError(
                f"{surfaces[0].name}: {quantity.words.lower()} {ground.value:.4g}{unit} "
                f"({ground.range.source}): no material has less than {quantity.low:g} or more than "
                f"{quantity.high:g}{unit}. Correct the file, or its units of length and mass."
            )
    return found


def _stated(surfaces: list[Surface], library: str) -> PartWords | None:
    substance = stated_substance(surfaces)
    if substance is None:
        return None
    try:
        entry = materials.named(substance, library)
    except UnknownChoiceError:
        return None  # not in the library: names may still identify it
    return PartWords("", entry.name, margin=1.0, reason=f"The file states it: {substance!r}.")


# ---------------------------------------------------------------- a person's annotations


def _annotations(
    scene: Scene, identity: Identity, config: DescribeConfig, library: str, from_pictures: bool
) -> dict[tuple[str, str], Annotation]:
    if config.annotations is None:
        return {}
    names = {
        obj.name: [p.name for p in identity.catalogue if p.object == number]
        for number, obj in enumerate(scene.objects)
    }
    read = read_annotations(Path(config.annotations), names, names if from_pictures else ())
    return {key: _spelt(one, library) for key, one in read.items()}


def _spelt(one: Annotation, library: str) -> Annotation:
    """Write the names of materials as the library spells them."""
    named = [n and materials.named(n, library).name for n in (one.material, one.contents)]
    return replace(one, material=named[0], contents=named[1])


def _with_annotations(
    words: list[PartWords],
    annotations: Mapping[tuple[str, str], Annotation],
    obj: str,
    config: DescribeConfig,
) -> list[PartWords]:
    own = [_annotated(annotations.get((obj, w.name)), w, config.annotations) for w in words]
    pieces = named_pieces(annotations, obj, [w.name for w in own])
    if not pieces:
        return own
    known = [_annotated(annotations[obj, p.name], p, config.annotations) for p in pieces]
    return [gathered(own[0].name, known)]


def _annotated(annotation: Annotation | None, words: PartWords, path: Path | None) -> PartWords:
    """Let an annotation replace what was found; what it leaves open stays."""
    if annotation is None:
        return words
    where = f"Stated in {Path(str(path)).name}."
    if annotation.material is not None:
        found = PartWords(words.name, annotation.material, None, None, "annotation", 1.0, where)
        words = replace(found, **{s: getattr(words, s) for s in SHARES})
    if (
        annotation.material is not None
        or annotation.structure is not None
        or annotation.contents is not None
    ):
        words = replace(words, hypotheses=())  # a person is certain
    known = ((*materials.si(key), value) for key, value in annotation.values.items())
    values = {field: value * factor for field, factor, value in known}
    return replace(built(annotation, words), values=values)
