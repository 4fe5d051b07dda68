"""The questions to a vision-language model in order, with the transcript of answers."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from string import Template

import numpy as np

from corporeal.discretization.drawn_thickness import NO_DRAWN_SHAPE, DrawnShape, ThinScan
from corporeal.vlm import SINGLE_ANSWER, Answer, AnswerCheck, AnswerNumber, Question, Reply, UnansweredError, VlmClient
from corporeal.vlm.answer_checks import (
    MAX_OBJECTS_IN_SCENE,
    MAX_PARTS,
    REAL_VOLUME_SHARE_RANGE,
    extents_complaints,
    mass_complaints,
    materials_complaints,
    parts_complaints,
    placement_complaints,
    ranking_complaints,
    regions_complaints,
    size_complaints,
    thickness_complaints,
    things_complaints,
    weakness_notes,
)
from corporeal.vlm.answer_schemas import (
    AllowedNames,
    Decomposition,
    ExtentsAnswer,
    FractionAnswer,
    MassAnswer,
    MaterialsAnswer,
    ObjectsAnswer,
    PartsAnswer,
    RankingAnswer,
    RegionsAnswer,
    SeenPart,
    SizeAnswer,
    ThicknessAnswer,
    ValueAnswer,
)
from corporeal.vlm.interpret_answers import LookingSource, millimetres_text, strange_share_notes
from corporeal.vlm.prompt_files import Prompt

SHARES_INSTRUCTION = (
    "The parts share one model, so say for each what it takes up of the object as the pictures "
    "show it, thickened or not:\n"
    "- inside: the part that encloses it, where it is hidden within another (a core within its "
    "cover), otherwise null;\n"
    "- missing: true only for what the real object has and the model lacks, as a scanner does not "
    "see glass;\n"
    "- volume_share: what lies within the part's own outer shape, with all that is inside it, over "
    "what lies within the whole object's; a part is stated so whether others enclose it or not. "
    "Over the parts with inside null (what is missing apart) they add up to 1;\n"
    "- surface_share: the area of the part's own outer face over that of the whole object's outer "
    "surface, never 0, also for what lies inside. Over the parts with inside null (what is missing "
    "apart) they add up to 1."
)
UNSEEN_CLAUSE = " that the model does not show"
MODELLED_HOLES_CLAUSE = (
    "; holes, gaps and hollows that the pictures show are modelled: they are already taken off, "
    "and solidity is of what is left"
)
NO_SHARES_INSTRUCTION = "- inside, volume_share and surface_share: null; missing: false."
FRACTION_INSTRUCTION = (
    "Answer with a fraction for each quantity: 0 is the low end of its range, 1 the high end, 0.5 "
    "the middle; on a logarithmic scale, where one is named, 0.5 is the geometric middle."
)
VALUE_INSTRUCTION = "Answer with a value for each quantity, in the unit and inside the range that it names."
REVISION_INSTRUCTION = (
    "\n\nYou answered this before, and your values do not fit each other:\n\n$answer\n\n"
    "$problems\n\nAnswer again, for all parts. Keep a value only if it is meant so, and say why."
)
SENTENCES: Mapping[str, Mapping[str, str]] = {
    "shares": {"shared": SHARES_INSTRUCTION, "own": NO_SHARES_INSTRUCTION},
    "unseen": {"hollowed": UNSEEN_CLAUSE, "whole": ""},
    "holes": {"hollowed": MODELLED_HOLES_CLAUSE, "whole": ""},
    "how": {"fraction": FRACTION_INSTRUCTION, "value": VALUE_INSTRUCTION},
}
"""Fact → its value → what the prompt has for it; other facts are used as they are."""

TASKS_WITH_FIXED_TEXT = ("materials", "mass")
"""Questions whose text hangs on question 1 only, so that each of several answers is to the same."""


@dataclass(frozen=True)
class InterviewSubject:
    """Subject of the questions."""

    scene: str
    """The scene's name and the object's."""
    name: str
    class_name: str
    sides: str
    """The three sides of its smallest box, in words."""
    box: float = 0.0
    """Their product [m³]; 0: not known."""
    drawn: DrawnShape = NO_DRAWN_SHAPE
    """What its mesh shows."""
    views: str = "none"
    count: int = 0
    """Pictures that are shown, or were when the answers were recorded."""
    pictures: Sequence[np.ndarray] = ()


@dataclass(frozen=True)
class PlacementOffer:
    """What one part's quantities can be, for question 3."""

    facts: str
    """The part, its material and its build, in one line."""
    ranges: Mapping[str, str]
    """Quantity → its range in words."""
    bounds: Mapping[str, tuple[float, float]]
    """Quantity → low and high in the unit that the words name."""


@dataclass
class Interview:
    """Asks questions on one subject; keeps the transcript and warnings."""

    model: VlmClient
    critic: VlmClient
    prompts: Mapping[str, Prompt]
    """By task."""
    subject: InterviewSubject
    seen: str = ""
    """What question 1 found it to be; "": it was not asked."""
    looks: dict[str, str] = field(default_factory=dict)
    """Part → how question 1 found it to look."""
    transcript: list[dict] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    turn: AnswerNumber = SINGLE_ANSWER
    """Number of the answer, if several are sampled."""

    def parts(self) -> tuple[Decomposition, PartsAnswer] | None:
        """Ask question 1, and the critic if there is a choice; None: no answer.

        Returns:
            The best decomposition, and the whole answer.
        """
        asked = self._question("parts", most=str(MAX_PARTS))
        reply = self._ask(self.model, asked, PartsAnswer, parts_complaints)
        if reply is None:
            return None
        options = reply.answer.decompositions
        self.seen = reply.answer.object
        best = options[self._best(options) if len(options) > 1 else 0]
        self.looks = {p.name: _look_text(p) for p in best.parts}
        return best, reply.answer

    def _best(self, options: Sequence[Decomposition]) -> int:
        lines = (
            f"{k}. {'; '.join(f'{p.name} ({p.look})' for p in d.parts)}. Reason: {d.why}"
            for k, d in enumerate(options, 1)
        )
        asked = self._question("ranking", decompositions="\n".join(lines), alternatives=str(len(options)))
        reply = self._ask(self.critic, asked, RankingAnswer, lambda a: ranking_complaints(a, len(options)))
        return reply.answer.ranking[0].number - 1 if reply else 0

    def materials(
        self, parts: Mapping[str, str], names: AllowedNames, lists: Mapping[str, str], shared: bool
    ) -> tuple[MaterialsAnswer, LookingSource] | None:
        """Ask question 2; None: no answer.

        Args:
            parts: Name → how to tell it in the pictures, "" where nothing needs saying.
            names: What may be answered.
            lists: What can be chosen, in words: "materials" and "contents".
            shared: The parts share one mesh.

        Returns:
            The answer, and who gave it: "model" or "recording".
        """
        named = _part_list(parts)
        hollowed = "hollowed" if self.subject.drawn.hollowed else "whole"
        asked = self._question(
            "materials", parts=named, unseen=hollowed, holes=hollowed, shares="shared" if shared else "own"
        )
        asked = replace(asked, lists=lists)
        reply = self._ask(
            self.model, asked, MaterialsAnswer, lambda a: materials_complaints(a, list(parts), names, shared)
        )
        if reply is None:
            return None
        self.warnings += [f"{self.subject.name}: {clause}." for clause in weakness_notes(reply.answer)]
        return reply.answer, reply.by

    def thickness(self, parts: Sequence[str], thin: ThinScan) -> tuple[ThicknessAnswer, LookingSource] | None:
        """Ask for the ratio of real to scanned volume of a thin scan; None: no answer.

        Args:
            parts: Those whose material fills what is drawn.
            thin: How coarse the scan is, and how thick it draws the object.
        """
        tenth, quarter, half = map(millimetres_text, thin.behind)
        least, greatest = (f"{share:g}" for share in REAL_VOLUME_SHARE_RANGE)
        asked = self._question(
            "thickness",
            parts=_part_list({name: self.looks.get(name, "") for name in parts}),
            edge=millimetres_text(thin.edge),
            tenth=tenth,
            quarter=quarter,
            half=half,
            least=least,
            greatest=greatest,
        )
        reply = self._ask(self.model, asked, ThicknessAnswer, lambda a: thickness_complaints(a, parts))
        if reply is None:
            return None
        about = f"{self.subject.name}: "
        self.warnings += [about + sentence for sentence in strange_share_notes(reply.answer, thin.doubt)]
        return reply.answer, reply.by

    def mass(self) -> tuple[MassAnswer, LookingSource] | None:
        """Ask for print and mass of the object, without the library; None: no answer."""
        box = self.subject.box
        asked = self._question("mass")
        reply = self._ask(self.model, asked, MassAnswer, lambda a: mass_complaints(a, box))
        return (reply.answer, reply.by) if reply else None

    def placement(
        self,
        offers: Mapping[str, PlacementOffer],
        shape: type[FractionAnswer] | type[ValueAnswer],
        odd: Callable[[FractionAnswer | ValueAnswer], Sequence[str]],
    ) -> tuple[FractionAnswer | ValueAnswer, LookingSource] | None:
        """Ask question 3, once more where the values do not fit each other; None: no answer."""
        reply = self._placement(offers, shape, {})
        problems = odd(reply.answer) if reply else ()
        if reply and problems:
            again = {"answer": json.dumps(reply.answer.model_dump()), "problems": "\n".join(f"- {p}" for p in problems)}
            reply = self._placement(offers, shape, again) or reply
        return (reply.answer, reply.by) if reply else None

    def _placement(
        self,
        offers: Mapping[str, PlacementOffer],
        shape: type[FractionAnswer] | type[ValueAnswer],
        again: Mapping[str, str],
    ) -> Reply[FractionAnswer | ValueAnswer] | None:
        asked = self._question(
            "placement",
            parts="\n".join(f"- {offer.facts}" for offer in offers.values()),
            how="fraction" if shape is FractionAnswer else "value",
        )
        asked = replace(
            asked,
            prompt=asked.prompt + (Template(REVISION_INSTRUCTION).substitute(again) if again else ""),
            facts={**asked.facts, **again},
            lists={"ranges": _range_list(offers)},
        )
        wanted: dict[str, Collection[str]] = {part: list(o.ranges) for part, o in offers.items()}
        bounds = {(p, q): b for p, o in offers.items() for q, b in o.bounds.items()}
        return self._ask(self.model, asked, shape, lambda a: placement_complaints(a, wanted, bounds))

    def extents(self, classes: Sequence[str]) -> dict[str, float]:
        """Ask question 4: class → usual longest side [m]; empty: no answer."""
        asked = self._question("extents", classes="\n".join(f"- {c}" for c in classes))
        asked = replace(asked, views="none", pictures=())
        reply = self._ask(self.model, asked, ExtentsAnswer, lambda a: extents_complaints(a, classes))
        return {c.class_name: c.metres for c in reply.answer.classes} if reply else {}

    def size(self) -> Reply[SizeAnswer] | None:
        """Ask how large the real object is, in words alone; None: no answer."""
        kind = self.subject.class_name
        asked = self._question("sizes")
        return self._ask(self.model, asked, SizeAnswer, lambda a: size_complaints(a, kind))

    def things(self) -> Reply[ObjectsAnswer] | None:
        """Ask which objects stand in a scene; None: no answer."""
        asked = self._question("things", most=str(MAX_OBJECTS_IN_SCENE))
        return self._ask(self.model, asked, ObjectsAnswer, things_complaints)

    def regions(self, colours: Sequence[str], things: Sequence[str]) -> Reply[RegionsAnswer] | None:
        """Ask which object each painted region is; None: no answer."""
        lines = "\n".join(f"{k}. {words}" for k, words in enumerate(things, 1))
        asked = self._question("regions", colours=", ".join(colours), things=lines)
        return self._ask(self.model, asked, RegionsAnswer, lambda a: regions_complaints(a, colours, len(things)))

    def _question(self, task: str, **facts: str) -> Question:
        about = self.subject
        common = {
            "count": str(about.count),
            "name": about.name,
            "class_name": about.class_name,
            "sides": about.sides,
            "seen": self.seen,
        }
        prompt = self.prompts[task]
        put = {name: (common | facts)[name] for name in prompt.names()}
        return Question(
            task,
            Template(prompt.text).substitute({n: _in_words(n, put[n]) for n in put}).strip(),
            about.scene,
            about.views,
            about.pictures,
            turn=replace(self.turn, alike=task in TASKS_WITH_FIXED_TEXT and self.turn.of > 1),
            prompt_version=prompt.version,
            facts=put,
        )

    def _ask(
        self, whom: VlmClient, question: Question, shape: type[Answer], check: AnswerCheck[Answer]
    ) -> Reply[Answer] | None:
        try:
            reply = whom.ask(question, shape, check)
        except UnansweredError as error:
            self.warnings.append(
                f"{self.subject.name}: the question about {question.task} got no usable answer "
                f"{_answer_number_text(question.turn)}({error})"
            )
            self.transcript.append(_transcript_row(question) | {"answer": None, "error": str(error)})
            return None
        self.transcript.append(_transcript_row(question) | _answered(reply))
        return reply


def _in_words(name: str, fact: str) -> str:
    """Return a fact as it is written in a prompt."""
    if name == "seen":
        return f"It was found to be: {fact}." if fact else ""
    return SENTENCES[name][fact] if name in SENTENCES else fact


def _part_list(parts: Mapping[str, str]) -> str:
    """List parts, each with how to tell it in the pictures."""
    return "; ".join(f"{name} ({look})" if look else name for name, look in parts.items())


def _look_text(part: SeenPart) -> str:
    """Return the look and the visibility of a part."""
    where = {"yes": "", "hidden": "; hidden", "missing": "; the model lacks it"}
    return f"{part.look}{where[part.seen]}"


def _range_list(offers: Mapping[str, PlacementOffer]) -> str:
    blocks = []
    for part, offer in offers.items():
        lines = (f"- {name}: {words}" for name, words in offer.ranges.items())
        blocks.append("\n".join([f"Part {part}:", *lines]))
    return "\n\n".join(blocks)


def _answer_number_text(turn: AnswerNumber) -> str:
    """Return which of several answers is meant; "" where one only is wanted."""
    return f"{turn.number} of {turn.of} " if turn.of > 1 else ""


def _transcript_row(question: Question) -> dict:
    turn = question.turn
    return {
        "task": question.task,
        "scene": question.scene,
        "views": question.views,
        "prompt": question.text,
        **({"answer_number": turn.number} if turn.of > 1 else {}),
    }


def _answered(reply: Reply) -> dict:
    spent = reply.spent
    return {
        "answer": reply.answer.model_dump(),
        "by": reply.by,
        "model": reply.model,
        "calls": spent.calls,
        "input_tokens": spent.input_tokens,
        "output_tokens": spent.output_tokens,
        "seconds": round(spent.seconds, 3),
    }
