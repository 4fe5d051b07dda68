"""Vision-language models: one question in, one validated answer out. And what to do without one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from typing import Generic, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import BaseModel

from corporeal.core import registry
from corporeal.core.errors import UnknownChoiceError, UserError

Answer = TypeVar("Answer", bound=BaseModel)

MENU = {
    "replay": "corporeal.vlm.recordings:Recordings",
    "ask": "corporeal.vlm.by_hand:ByHand",
    "openai": "corporeal.vlm.provider:OpenAI",
    "anthropic": "corporeal.vlm.provider:Anthropic",
    "google": "corporeal.vlm.provider:Google",
    "ollama": "corporeal.vlm.provider:Ollama",
}
"""How to reach a model: name before the colon → class that takes what stands after it."""
WRAPPERS = {
    "cache": "corporeal.vlm.cache:Cached",
    "record": "corporeal.vlm.recordings:Recorder",
}
"""What stands between a question and a model."""
LIVE = ("openai", "anthropic", "google", "ollama")
"""Answered over a network, and so by a package that the core does without."""
CRITIC = "openai:gpt-5-mini"
"""Ranks where OpenAI answers and nobody else was asked for."""
NOBODY = "metadata"
"""No model: names and materials in the file decide."""


class Album(Sequence[np.ndarray]):
    """Pictures that are taken, one album at a time, when somebody first looks at them."""

    _one = Lock()

    def __init__(self, take: Callable[[], Sequence[np.ndarray]]) -> None:
        self._take, self._taken = take, None

    def _pictures(self) -> Sequence[np.ndarray]:
        with Album._one:
            if self._taken is None:
                self._taken = self._take()
            return self._taken

    def __len__(self) -> int:
        return len(self._pictures())

    def __getitem__(self, index):
        return self._pictures()[index]


@dataclass(frozen=True)
class Turn:
    """Which of several answers to a question is wanted (self-consistency: Wang et al. 2022)."""

    number: int = 1
    of: int = 1
    """So many are wanted in all; more than one are sampled at a temperature above 0."""
    alike: bool = False
    """Whether the later ones are answers to the same text, so that one request can give them."""


ONCE = Turn()


@dataclass(frozen=True)
class Question:
    """What is asked, about what, and what it was asked with."""

    task: str
    """Which of the house's questions this is ("materials")."""
    prompt: str
    """The wording; {name} stands where one of ``lists`` goes."""
    scene: str
    """What it is about: the scene's name and the object's."""
    views: str = "none"
    """How the pictures were taken, in words; pictures themselves are not compared on replay."""
    pictures: Sequence[np.ndarray] = ()
    """Each H x W x 3, uint8, sRGB."""
    lists: Mapping[str, str] = field(default_factory=dict)
    """What the library in use offers, by name. A longer list does not make an answer stale."""
    turn: Turn = ONCE

    @property
    def text(self) -> str:
        """The whole text as it is sent."""
        text = self.prompt
        for name, words in self.lists.items():
            text = text.replace(f"{{{name}}}", words)
        return text


@dataclass(frozen=True)
class Spent:
    """What an answer took."""

    calls: int = 0
    """Requests that were sent, those that failed included."""
    input_tokens: int = 0
    output_tokens: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Reply(Generic[Answer]):
    """A validated answer, and where it comes from."""

    answer: Answer
    by: Literal["model", "recording"]
    model: str
    """As a person types it: "openai:gpt-5.4"."""
    spent: Spent = Spent()


Check = Callable[[Answer], list[str]]
"""Returns what is wrong with an answer, one sentence each, as the model is to read it."""


def nothing(answer: BaseModel) -> list[str]:
    """Complain about nothing."""
    return []


class UnansweredError(UserError):
    """A model was asked, corrected and asked again, and gave no usable answer."""


@runtime_checkable
class Vlm(Protocol):
    """The whole contract."""

    looks: bool
    """Whether anybody looks at a question's pictures; without it they need not be taken."""

    def ask(
        self, question: Question, answer: type[Answer], check: Check[Answer] = nothing
    ) -> Reply[Answer]:
        """Answer ``question`` in the shape of ``answer``, with nothing left to complain about.

        Raises:
            UnansweredError: There is no usable answer to this question; others may fare better.
            UserError: No question will be answered; the message says what to do.

        """
        ...


def critic_of(spec: str, asked: str) -> str:
    """Say who ranks partitions of an object: who is ``asked`` to, a cheaper one, or the same.

    Args:
        spec: Who answers, as a person types it.
        asked: Who was asked for; "": nobody.

    """
    theirs = spec.startswith("openai:") and "@" not in spec
    return asked or (CRITIC if theirs else spec)


def connect(spec: str, record: Path | None = None) -> Vlm | None:
    """Connect to ``"openai:gpt-5.4"`` and the like; ``"metadata"`` asks nobody and gives None.

    What a live model answered once is not paid for again.

    Args:
        spec: Whom to ask, as a person types it.
        record: Folder where every answer is kept for ``"replay:FOLDER"``.

    Raises:
        UserError: The name is unknown, its package is not installed, or its key is not set.

    """
    name, _, rest = spec.partition(":")
    if name == NOBODY:
        return None
    if name not in MENU:
        raise UnknownChoiceError("vision-language model", name, [NOBODY, *MENU])
    if name in LIVE and find_spec("pydantic_ai") is None:
        raise UserError(
            f"Asking {spec!r} needs a package that is not installed. Type: pip install "
            "'corporeal[models]'. Without it there are --vlm ask:FOLDER (you answer), --vlm "
            "replay:FOLDER and --vlm metadata."
        )
    model = registry.load("vision-language model", name, MENU)(rest)
    if name in LIVE:
        model = registry.load("wrapper", "cache", WRAPPERS)(model, spec, {})
    if record is not None:
        model = registry.load("wrapper", "record", WRAPPERS)(model, Path(record))
    return model
