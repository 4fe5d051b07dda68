"""The questions about a film, the laws they belong to, and the controls they are meant to catch."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, create_model

from corporeal.core.typed import typed

Said = Literal["yes", "no", "unclear", "na"]
MOST_WORDS = 1000
"""Longest description of a film [characters]."""
LOWEST, HIGHEST = 1, 5
"""Of the mark for a whole film."""


@dataclass(frozen=True)
class SubQuestion:
    """One question about a film."""

    id: str
    law: str
    """Of physics: "gravity"."""
    violation: Literal["yes", "no"]
    """The answer that reports one."""
    text: str


@dataclass(frozen=True)
class Control:
    """A known fault, and which questions are meant to report it."""

    id: str
    fault: str
    questions: tuple[str, ...]


@dataclass(frozen=True)
class Catalogue:
    """All of them, in order."""

    question: tuple[SubQuestion, ...]
    control: tuple[Control, ...]

    def laws(self) -> list[str]:
        """Return the laws of physics, in the order of their first question."""
        return list(dict.fromkeys(q.law for q in self.question))

    def meant(self, control: str) -> tuple[str, ...]:
        """Return the questions that are meant to report a control; none for what is none."""
        return next((c.questions for c in self.control if c.id == control), ())


@cache
def catalogue() -> Catalogue:
    """Read questions and controls."""
    file = files("corporeal.lab.evaluation.judge").joinpath("questions.toml")
    return typed(Catalogue, tomllib.loads(file.read_text(encoding="utf-8")))


class FilmAnswers(BaseModel):
    """One answer a question: the fields are those of ``catalogue()``."""

    model_config = ConfigDict(extra="forbid")


def _answers() -> type[FilmAnswers]:
    """Make a field a question: in a mapping a model could leave questions out."""
    fields: dict[str, Any] = {q.id: (Said, ...) for q in catalogue().question}
    return create_model("Answers", __base__=FilmAnswers, **fields)


class Verdict(BaseModel):
    """What is said of one film after one look."""

    happens: str = Field(min_length=1, max_length=MOST_WORDS)
    answers: _answers()  # type: ignore[valid-type]
    whole: int = Field(ge=LOWEST, le=HIGHEST)

    def said(self) -> dict[str, Said]:
        """Return question → answer."""
        return {q: a for q, a in self.answers.model_dump().items() if a in get_args(Said)}
