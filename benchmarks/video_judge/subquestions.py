"""The questions about a video, their laws, and the controls they detect."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, ClassVar, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, create_model

from corporeal.core.deserialize import from_plain
from corporeal.vlm import AnswerSchema

QuestionAnswer = Literal["yes", "no", "unclear", "na"]
MAX_DESCRIPTION_CHARACTERS = 1000
"""Longest description of a video [characters]."""
MIN_MARK, MAX_MARK = 1, 5
"""Of the mark for a whole video."""


@dataclass(frozen=True)
class SubQuestion:
    """One question about a video."""

    id: str
    law: str
    """Of physics: "gravity"."""
    violation: Literal["yes", "no"]
    """The answer that reports one."""
    text: str


@dataclass(frozen=True)
class ControlFault:
    """A known fault, and which questions are meant to report it."""

    id: str
    fault: str
    questions: tuple[str, ...]


@dataclass(frozen=True)
class QuestionCatalogue:
    """All of them, in order."""

    question: tuple[SubQuestion, ...]
    control: tuple[ControlFault, ...]

    def laws(self) -> list[str]:
        """Return the laws of physics, in the order of their first question."""
        return list(dict.fromkeys(q.law for q in self.question))

    def meant(self, control: str) -> tuple[str, ...]:
        """Return the questions that are meant to report a control; none for what is none."""
        return next((c.questions for c in self.control if c.id == control), ())


@cache
def question_catalogue() -> QuestionCatalogue:
    """Read questions and controls."""
    file = files("video_judge").joinpath("questions.toml")
    return from_plain(QuestionCatalogue, tomllib.loads(file.read_text(encoding="utf-8")))


class VideoAnswers(BaseModel):
    """One answer a question: the fields are those of ``catalogue()``."""

    model_config = ConfigDict(extra="forbid")


def _answers() -> type[VideoAnswers]:
    """Make a field a question: in a mapping a model could leave questions out."""
    fields: dict[str, Any] = {q.id: (QuestionAnswer, ...) for q in question_catalogue().question}
    return create_model("Answers", __base__=VideoAnswers, **fields)


class Verdict(AnswerSchema):
    """Answers about one video after one look."""

    SCHEMA: ClassVar[str] = "verdict/1"
    happens: str = Field(min_length=1, max_length=MAX_DESCRIPTION_CHARACTERS)
    answers: _answers()  # type: ignore[valid-type]
    whole: int = Field(ge=MIN_MARK, le=MAX_MARK)

    def said(self) -> dict[str, QuestionAnswer]:
        """Return question → answer."""
        return {q: a for q, a in self.answers.model_dump().items() if a in get_args(QuestionAnswer)}
