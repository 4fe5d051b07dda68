"""Questions to a vision-language model on every object of a scene.

Repeated interviews on one object; each answer is a complete interview.

Questions on values depend on the answers on materials, so complete interviews are pooled.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.resources import files

import numpy as np

from corporeal import materials
from corporeal.core.progress import Progress
from corporeal.core.types import (
    Inventory,
    MassEvidence,
    Note,
    NoteKind,
    ObjectAnswer,
    ObjectDescription,
    PartDescription,
    RangePlacement,
    Scene,
    apply_hypothesis,
)
from corporeal.description.apply_annotations import apply_annotations
from corporeal.description.describe_config import DescribeConfig
from corporeal.description.describe_from_file import has_wall_thickness, stated_material
from corporeal.description.pool_answers import pool_answers
from corporeal.discretization.drawn_thickness import measure_drawn_shape
from corporeal.discretization.mesh_measures import oriented_box_size
from corporeal.materials.material_candidates import QuantityChoice, content_materials_text, part_materials_text
from corporeal.materials.quantities import question_name
from corporeal.materials.range_placement import (
    QuantityJudgement,
    library_entry,
    library_spelling,
    placed_wall_thickness,
    placement_contradictions,
    placements_from_fractions,
    placements_from_values,
    quantity_choices,
    usual_placements,
)
from corporeal.recognition.parts_by_name import PartsByName
from corporeal.recognition.parts_by_name import name_words as telling
from corporeal.recognition.stated_properties import apply_inflation, stated_thickness
from corporeal.render.object_portrait import PortraitOptions, part_colour_names, render_portraits
from corporeal.vlm import SINGLE_ANSWER, AnswerNumber, OnDemandPictures, VlmClient
from corporeal.vlm.answer_schemas import AllowedNames, FractionAnswer, ValueAnswer
from corporeal.vlm.human_client import PendingQuestionsError, is_not_pending, refuse_pending
from corporeal.vlm.interpret_answers import (
    LookingSource,
    apply_placements,
    apply_real_shares,
    box_sides_text,
    complete_from_file,
    contradiction_with_file,
    evidence_from_answer,
    hypothesis_name,
    leaf_parts,
    merge_pieces,
    parts_filling_scan,
    parts_from_answer,
    sum_usage,
    with_usual_extents,
)
from corporeal.vlm.interview import Interview, InterviewSubject, PlacementOffer
from corporeal.vlm.prompt_files import read_prompt
from corporeal.vlm.thread_map import thread_map


def repeat_interview(
    interview: Interview, count: int, described: Callable[[], list[PartDescription]], direct: bool
) -> list[ObjectAnswer]:
    """Return the descriptions of one object by ``count`` answers.

    Answers with an unusable reply are left out with a warning; if all are, the first is used, completed from the file.

    Raises:
        WaitingError: Questions wait for a person: as many as can be asked now.
    """
    if count == 1:
        return [ObjectAnswer(tuple(described()), _judge_mass(interview, direct))]
    interpreted, whole, waiting = [], [], []
    for number in range(1, count + 1):
        interview.turn = AnswerNumber(number, count)
        before = len(interview.transcript)
        parts = _ask_unless_pending(described, waiting)
        fits = _is_complete(interview.transcript[before:])
        evidence = _ask_unless_pending(partial(_judge_mass, interview, direct), waiting)
        if parts is not None:
            interpreted.append(ObjectAnswer(tuple(parts), evidence))
            whole += [interpreted[-1]] if fits else []
    interview.turn = SINGLE_ANSWER
    if waiting:
        raise PendingQuestionsError(str(waiting[0]), sum(error.count for error in waiting))
    _warn_of_left_out_answers(interview, whole, count)
    return whole or interpreted[:1]


def _ask_unless_pending(ask: Callable, waiting: list[PendingQuestionsError]):
    """Ask; if a person has yet to answer, continue with other questions."""
    try:
        return ask()
    except PendingQuestionsError as error:
        waiting.append(error)
        return None


def _is_complete(rows: Sequence[Mapping]) -> bool:
    """Return whether every question was answered at least once."""
    answered = {row["task"] for row in rows if row["answer"] is not None}
    return all(row["task"] in answered for row in rows)


def _judge_mass(interview: Interview, direct: bool) -> MassEvidence | None:
    weighs = interview.mass() if direct else None
    return evidence_from_answer(*weighs) if weighs else None


def _warn_of_left_out_answers(interview: Interview, whole: Sequence[ObjectAnswer], count: int) -> None:
    """Warn of answers that are left out, without repetition."""
    warnings = list(dict.fromkeys(interview.warnings))
    if len(whole) < count:
        kept = f"{len(whole)} of {count} answers count" if whole else "the first answer counts"
        warnings.append(f"{interview.subject.name}: {kept}; a question to the others stayed open.")
    interview.warnings[:] = warnings


PlacementAnswer = FractionAnswer | ValueAnswer
OfferedChoices = Mapping[str, Mapping[str, QuantityChoice]]
"""Part → quantity → its range."""


def hypotheses_by_name(words: PartDescription) -> dict[str, PartDescription]:
    """Return the hypotheses of a part by the names used in questions; the first is the part."""
    others = enumerate(words.hypotheses[1:], 1)
    return {words.name: words} | {hypothesis_name(words.name, k): apply_hypothesis(words, w) for k, w in others}


def make_placement_offer(
    name: str, words: PartDescription, look: str, offered: Mapping[str, QuantityChoice]
) -> PlacementOffer:
    """Return the facts on one part that precede the question on its values."""
    made = [str(words.material), *([words.structure] if words.structure else [])]
    if words.contents is not None:
        made.append(f"{words.fill or 1.0:.0%} full of {words.contents}")
    if words.solidity is not None:
        made.append(f"{words.solidity:.0%} of it matter")
    seen = f" (it looks: {look})" if look else ""
    return PlacementOffer(
        f"{name}: {', '.join(made)}{seen}",
        {question_name(field): c.words for field, c in offered.items()},
        {question_name(field): c.bounds for field, c in offered.items()},
    )


def placements_from_answer(
    answer: PlacementAnswer, by: LookingSource, offered: OfferedChoices
) -> dict[str, dict[str, RangePlacement]]:
    """Read an answer: part → quantity → where in its range the value lies."""
    read = placements_from_values if isinstance(answer, ValueAnswer) else placements_from_fractions
    found = {}
    for p in answer.parts:
        fields = {question_name(field): field for field in offered[p.part]}
        judged = {fields[v.quantity]: QuantityJudgement(v.number, v.reason) for v in p.values}
        found[p.part] = read(judged, by, offered[p.part])
    return found


INTERVIEW_TASKS = ("parts", "ranking", "materials", "thickness", "placement", "mass", "extents")


class SceneQuery:
    """Questions on one scene."""

    def __init__(
        self,
        scene: Scene,
        identity: PartsByName,
        config: DescribeConfig,
        library: str,
        model: VlmClient,
        critic: VlmClient,
    ) -> None:
        self.scene, self.identity, self.config, self.library = scene, identity, config, library
        self.model, self.critic = model, critic
        folder = files("corporeal.description").joinpath("prompts")
        self.prompts = {t: read_prompt(folder.joinpath(f"{t}.md")) for t in INTERVIEW_TASKS}
        self.lists = {"materials": part_materials_text(library), "contents": content_materials_text(library)}
        self.names = AllowedNames(
            partial(library_spelling, library_name=library, offered=materials.part_materials(library)),
            partial(library_spelling, library_name=library, offered=materials.content_materials(library)),
            partial(has_wall_thickness, library),
        )

    def inventory(self, file: list, annotations: Mapping, progress: Progress) -> Inventory:
        """Ask about every object, and about the sizes of all."""
        count = len(self.scene.objects)
        interviews = [self._interview(number) for number in range(count)]
        sizes = self._about(InterviewSubject(self.scene.name, self.scene.name, "", "not known"))
        named = dict.fromkeys(o.class_name or o.name for o in self.scene.objects)
        classes = [name for name in named if telling(name)]  # "object" has no usual size
        times = self.config.answers
        doing = "asking" if times == 1 else f"asking, {times} answers each"
        jobs: list[Callable] = [
            partial(self._object, number, interviews[number], file[number], annotations) for number in range(count)
        ]
        results = thread_map(
            [*jobs, lambda: sizes.extents(classes) if classes else {}],
            self.config.parallel,
            lambda done: progress(done / (count + 1), doing),
            is_not_pending,
        )
        *objects, extents = refuse_pending(results, self.config.vlm)
        interviews.append(sizes)
        rows = tuple(row for interview in interviews for row in interview.transcript)
        warnings = [w for interview in interviews for w in interview.warnings]
        warnings += filter(None, map(self._contradicted, range(count), objects))
        objects, doubts = with_usual_extents(self.scene.objects, objects, extents)
        return Inventory(tuple(objects), rows, sum_usage(rows), (*warnings, *doubts))

    def _contradicted(self, number: int, words: ObjectDescription) -> str:
        """Return warnings where a model's answer overrides what the file states of an object."""
        believed, clauses = {w.name: w for w in words.parts}, []
        for k, entry in enumerate(self.identity.catalogue):
            if entry.object == number:
                own = [self.scene.surfaces[s] for s in self.identity.surfaces(k)]
                made = stated_material(own, self.library)
                name = made and library_entry(str(made.material), self.library).name
                put = placed_wall_thickness(believed[entry.name], self.library)
                clauses.append(contradiction_with_file(believed[entry.name], name, stated_thickness(own), put))
        against_file = "; ".join(filter(None, clauses))
        if not against_file:
            return ""
        return Note(f"{words.name}: {against_file}. The latter was used; --annotations decides.", NoteKind.ASSUMED)

    def _about(self, subject: InterviewSubject) -> Interview:
        return Interview(self.model, self.critic, self.prompts, subject)

    def _names(self, number: int) -> list[str]:
        return [p.name for p in self.identity.catalogue if p.object == number]

    def _interview(self, number: int) -> Interview:
        obj, parts = self.scene.objects[number], self._names(number)
        portrait = PortraitOptions(self.config.views, self.config.view_size, self.config.view_seed)
        first = next(k for k, p in enumerate(self.identity.catalogue) if p.object == number)
        own = [
            int(part) - first if surface.object == number else None
            for part, surface in zip(self.identity.part_of_surface, self.scene.surfaces, strict=True)
        ]
        surfaces = [s for s in self.scene.surfaces if s.object == number]
        corners = np.concatenate([s.vertices for s in surfaces])
        lengths = [side / obj.scale for side in oriented_box_size(corners)]
        return self._about(
            InterviewSubject(
                scene=f"{self.scene.name}/{obj.name}",
                name=obj.name,
                class_name=obj.class_name,
                sides=box_sides_text(lengths),
                box=float(np.prod(lengths)),
                drawn=measure_drawn_shape(surfaces, obj.scale),
                views=portrait.words,
                count=self.config.views + (len(parts) > 1),
                pictures=OnDemandPictures(partial(render_portraits, self.scene, own, portrait))
                if self.model.looks
                else (),
            )
        )

    def _object(
        self, number: int, interview: Interview, file: list[PartDescription], annotations: Mapping
    ) -> ObjectDescription:
        """Ask all questions on one object."""
        obj, names = self.scene.objects[number], self._names(number)
        stated = {part: a.material for (name, part), a in annotations.items() if name == obj.name}
        asks = not (all(stated.get(name) for name in names) or stated.keys() - set(names))
        pieces = self._pieces(interview, names) if asks else []

        def described() -> list[PartDescription]:
            words = file
            if asks:
                words = self._materials(interview, names, pieces, file)
                words = self._swollen(interview, words)
            words = apply_annotations(words, annotations, obj.name, self.config, obj.real_extent)
            return self._placed(interview, words)

        answers = repeat_interview(interview, self.config.answers, described, self.config.direct)
        first, *others = answers
        thing = ObjectDescription(obj.name, obj.class_name, first.parts, evidence=first.evidence)
        return pool_answers(thing, answers) if others else thing

    def _pieces(self, interview: Interview, names: list[str]) -> list[str]:
        """Return the parts to ask about: the file's, or the decomposition of a single mesh."""
        taken = interview.parts() if len(names) == 1 else None
        pieces = [p.name for p in taken[0].parts] if taken else names
        if len(pieces) > 1:
            return pieces
        looks = list(interview.looks.values())
        interview.looks = dict(zip(names, looks, strict=True)) if len(names) == len(looks) else {}
        return names

    def _materials(
        self, interview: Interview, names: list[str], pieces: list[str], file: list[PartDescription]
    ) -> list[PartDescription]:
        shared = len(pieces) > len(names)
        looks = {name: interview.looks.get(name, "") for name in pieces}
        if len(names) > 1:
            colours = zip(names, part_colour_names(len(names)), strict=True)
            looks = {name: f"{colour} in the last picture" for name, colour in colours}
        asked = interview.materials(looks, self.names, self.lists, shared)
        if asked is None:
            return file
        words = parts_from_answer(*asked, self.names)
        if len(names) == 1:
            words = [merge_pieces(names[0], words)]
        answered = {w.name: w for w in words}
        known = list(zip(names, file, strict=True))
        found = [
            replace(complete_from_file(answered[name], own, self.names.walled), stated=own.stated)
            for name, own in known
        ]
        # Pictures do not show the pressure: the name does.
        return [
            replace(apply_inflation(w, own.inflation, None), rebound=own.rebound)
            for w, (_, own) in zip(found, known, strict=True)
        ]

    def _swollen(self, interview: Interview, words: list[PartDescription]) -> list[PartDescription]:
        """Ask for the ratio of real to scanned volume of a thin scan, which is one mesh."""
        thin, filling = interview.subject.drawn.thin, parts_filling_scan(words)
        if thin is None or len(words) > 1 or not filling:
            return words
        asked = interview.thickness([leaf.name for leaf in filling], thin)
        return [apply_real_shares(w, *asked) for w in words] if asked else words

    def _placed(self, interview: Interview, words: list[PartDescription]) -> list[PartDescription]:
        """Ask for the place of each open value in its measured range, for all hypotheses."""
        parts = {name: way for leaf in leaf_parts(words) for name, way in hypotheses_by_name(leaf).items()}
        offered = {name: quantity_choices(way, self.library, weighing=name != way.name) for name, way in parts.items()}
        offered = {name: found for name, found in offered.items() if found}
        if not offered:
            return words

        def problems(answer: PlacementAnswer) -> list[str]:
            return [
                f"{name}: {clause}"
                for name, places in placements_from_answer(answer, "model", offered).items()
                for clause in placement_contradictions(parts[name], places, self.library).values()
            ]

        looks = interview.looks
        offers = {
            name: make_placement_offer(name, parts[name], looks.get(parts[name].name, ""), found)
            for name, found in offered.items()
        }
        shape = ValueAnswer if self.config.sampling == "value" else FractionAnswer
        asked = interview.placement(offers, shape, problems)
        if asked is None:
            why = "The model gave no usable answer: typical value."
            places = {name: usual_placements(found, why) for name, found in offered.items()}
        else:
            places = placements_from_answer(*asked, offered)
        return [apply_placements(w, places) for w in words]
