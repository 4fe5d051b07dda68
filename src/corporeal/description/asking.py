"""One scene asked about: every object by an interview of a model that looks."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from importlib.resources import files

import numpy as np

from corporeal import materials
from corporeal.core.types import (
    Inventory,
    Note,
    NoteKind,
    ObjectWords,
    PartWords,
    Scene,
)
from corporeal.description.annotated import with_annotations
from corporeal.description.describe_config import DescribeConfig
from corporeal.description.file_words import has_wall, stated_material
from corporeal.description.offers import Placed, in_all_ways, offer, places_of
from corporeal.description.pooled import pooled
from corporeal.description.several import told_several_times
from corporeal.discretization.drawn import drawn
from corporeal.discretization.extent import oriented_size
from corporeal.materials.offer import contents_offered, substances_offered
from corporeal.materials.placement import (
    choices,
    entry_of,
    odd,
    spelling,
    usual,
    wall_put,
)
from corporeal.recognition.identity import Identity
from corporeal.recognition.identity import words as telling
from corporeal.recognition.stated import (
    sealed,
    stated_thickness,
)
from corporeal.render.portrait import Portrait, colour_of_part, portraits
from corporeal.vlm import Album, Vlm
from corporeal.vlm.answers import FractionAnswer, ValueAnswer, Vocabulary
from corporeal.vlm.by_hand import all_answered, is_more
from corporeal.vlm.interview import Interview, Subject
from corporeal.vlm.together import together
from corporeal.vlm.words import (
    against,
    drawn_by_scan,
    gathered,
    leaves,
    part_words,
    placed,
    resolved,
    sides,
    swollen,
    usage,
    with_extents,
)

TASKS = ("parts", "ranking", "materials", "thickness", "placement", "mass", "extents")
Progress = Callable[[float, str], None]


class Asking:
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
        folder = files("corporeal.description").joinpath("prompts")
        self.prompts = {t: folder.joinpath(f"{t}.md").read_text(encoding="utf-8") for t in TASKS}
        self.lists = {
            "materials": substances_offered(library),
            "contents": contents_offered(library),
        }
        self.names = Vocabulary(
            partial(spelling, library_name=library, offered=materials.substances(library)),
            partial(spelling, library_name=library, offered=materials.contents(library)),
            partial(has_wall, library),
        )

    def inventory(self, file: list, annotations: Mapping, progress: Progress) -> Inventory:
        """Ask about every object, and about the sizes of all."""
        count = len(self.scene.objects)
        interviews = [self._interview(number) for number in range(count)]
        sizes = self._about(Subject(self.scene.name, self.scene.name, "", "not known"))
        named = dict.fromkeys(o.class_name or o.name for o in self.scene.objects)
        classes = [name for name in named if telling(name)]  # "object" has no usual size
        times = self.config.answers
        doing = "asking" if times == 1 else f"asking, {times} answers each"
        jobs: list[Callable] = [
            partial(self._object, number, interviews[number], file[number], annotations)
            for number in range(count)
        ]
        results = together(
            [*jobs, lambda: sizes.extents(classes) if classes else {}],
            self.config.parallel,
            lambda done: progress(done / (count + 1), doing),
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
                made = stated_material(own, self.library)
                name = made and entry_of(str(made.material), self.library).name
                put = wall_put(believed[entry.name], self.library)
                clauses.append(against(believed[entry.name], name, stated_thickness(own), put))
        against_file = "; ".join(filter(None, clauses))
        if not against_file:
            return ""
        return Note(
            f"{words.name}: {against_file}. The latter was believed; --annotations decides.",
            NoteKind.ASSUMED,
        )

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
        surfaces = [s for s in self.scene.surfaces if s.object == number]
        corners = np.concatenate([s.vertices for s in surfaces])
        lengths = [side / obj.scale for side in oriented_size(corners)]
        return self._about(
            Subject(
                scene=f"{self.scene.name}/{obj.name}",
                name=obj.name,
                class_name=obj.class_name,
                sides=sides(lengths),
                box=float(np.prod(lengths)),
                drawn=drawn(surfaces, obj.scale),
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
        asks = not (all(stated.get(name) for name in names) or stated.keys() - set(names))
        pieces = self._pieces(interview, names) if asks else []

        def described() -> list[PartWords]:
            words = file
            if asks:
                words = self._materials(interview, names, pieces, file)
                words = self._swollen(interview, words)
            words = with_annotations(words, annotations, obj.name, self.config, obj.real_extent)
            return self._placed(interview, words)

        answers = told_several_times(interview, self.config.answers, described, self.config.direct)
        first, *others = answers
        thing = ObjectWords(obj.name, obj.class_name, first.parts, evidence=first.evidence)
        return pooled(thing, answers) if others else thing

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
        return [
            replace(sealed(w, own.inflation, None), rebound=own.rebound)
            for w, (_, own) in zip(found, known, strict=True)
        ]

    def _swollen(self, interview: Interview, words: list[PartWords]) -> list[PartWords]:
        """Ask how much of a thin scan is real, of what fills it; a scan is one mesh."""
        thin, filling = interview.subject.drawn.thin, drawn_by_scan(words)
        if thin is None or len(words) > 1 or not filling:
            return words
        asked = interview.thickness([leaf.name for leaf in filling], thin)
        return [swollen(w, *asked) for w in words] if asked else words

    def _placed(self, interview: Interview, words: list[PartWords]) -> list[PartWords]:
        """Ask where in its measured range each open value of each part lies, in all its ways."""
        parts = {name: way for leaf in leaves(words) for name, way in in_all_ways(leaf).items()}
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
                for name, places in places_of(answer, "model", offered).items()
                for clause in odd(parts[name], places, self.library).values()
            ]

        looks = interview.looks
        offers = {
            name: offer(name, parts[name], looks.get(parts[name].name, ""), found)
            for name, found in offered.items()
        }
        shape = ValueAnswer if self.config.sampling == "value" else FractionAnswer
        asked = interview.placement(offers, shape, problems)
        if asked is None:
            why = "The model gave no usable answer: the usual value."
            places = {name: usual(found, why) for name, found in offered.items()}
        else:
            places = places_of(*asked, offered)
        return [placed(w, places) for w in words]
