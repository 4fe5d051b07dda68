"""Vision-language models: one question in, one validated answer out. And what to do without one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from typing import ClassVar, Generic, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import BaseModel

from corporeal.core import registry
from corporeal.core.errors import UnknownChoiceError, UserError


class AnswerSchema(BaseModel):
    """Base of the answers to questions."""

    SCHEMA: ClassVar[str]
    """Name and version of its fields, such as "materials/1": answers are recorded under it, not
    under the name of the class. Raise the version with every change of the fields."""


Answer = TypeVar("Answer", bound=AnswerSchema)

VLM_CLIENTS = {
    "replay": "corporeal.vlm.recordings:ReplayClient",
    "ask": "corporeal.vlm.human_client:HumanClient",
    "openai": "corporeal.vlm.api_clients:OpenAIClient",
    "anthropic": "corporeal.vlm.api_clients:AnthropicClient",
    "google": "corporeal.vlm.api_clients:GoogleClient",
    "ollama": "corporeal.vlm.api_clients:OllamaClient",
}
"""How to reach a model: name before the colon → class that takes what stands after it."""
VLM_WRAPPERS = {
    "cache": "corporeal.vlm.answer_cache:CachingClient",
    "record": "corporeal.vlm.recordings:RecordingClient",
}
"""What stands between a question and a model."""
LIVE_CLIENTS = ("openai", "anthropic", "google", "ollama")
"""Answered over a network, and so by a package that the core does without."""
DEFAULT_OPENAI_CRITIC = "openai:gpt-5-mini"
"""Ranks where OpenAI answers and nobody else was asked for."""
NO_MODEL = "metadata"
"""No model: names and materials in the file decide."""


class OnDemandPictures(Sequence[np.ndarray]):
    """Pictures that are taken, one album at a time, when somebody first looks at them."""

    _one = Lock()

    def __init__(self, take: Callable[[], Sequence[np.ndarray]]) -> None:
        self._take, self._taken = take, None

    def _pictures(self) -> Sequence[np.ndarray]:
        with OnDemandPictures._one:
            if self._taken is None:
                self._taken = self._take()
            return self._taken

    def __len__(self) -> int:
        return len(self._pictures())

    def __getitem__(self, index):
        return self._pictures()[index]


@dataclass(frozen=True)
class AnswerNumber:
    """Which of several answers to a question is wanted (self-consistency: Wang et al. 2022)."""

    number: int = 1
    of: int = 1
    """So many are wanted in all; more than one are sampled at a temperature above 0."""
    alike: bool = False
    """Whether the later ones are answers to the same text, so that one request can give them."""


SINGLE_ANSWER = AnswerNumber()


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
    turn: AnswerNumber = SINGLE_ANSWER
    prompt_version: str = ""
    """Names the wording, such as "materials/1"; "": the wording is named by its text."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """What was put into the wording of a version: an answer to other facts is another answer."""

    @property
    def text(self) -> str:
        """The whole text as it is sent."""
        text = self.prompt
        for name, words in self.lists.items():
            text = text.replace(f"{{{name}}}", words)
        return text


@dataclass(frozen=True)
class AnswerCost:
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
    spent: AnswerCost = AnswerCost()


AnswerCheck = Callable[[Answer], list[str]]
"""Returns what is wrong with an answer, one sentence each, as the model is to read it."""


def no_complaints(answer: AnswerSchema) -> list[str]:
    """Complain about nothing."""
    return []


class UnansweredError(UserError):
    """A model was asked, corrected and asked again, and gave no usable answer."""


@runtime_checkable
class VlmClient(Protocol):
    """The whole contract."""

    looks: bool
    """Whether anybody looks at a question's pictures; without it they need not be taken."""

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Answer ``question`` in the shape of ``answer``, with nothing left to complain about.

        Raises:
            UnansweredError: There is no usable answer to this question; others may fare better.
            UserError: No question will be answered; the message says what to do.

        """
        ...


def choose_critic(spec: str, asked: str) -> str:
    """Return who ranks partitions of an object: who is ``asked`` to, a cheaper one, or the same.

    Args:
        spec: Who answers, as a person types it.
        asked: Who was asked for; "": nobody.

    """
    theirs = spec.startswith("openai:") and "@" not in spec
    return asked or (DEFAULT_OPENAI_CRITIC if theirs else spec)


def connect_vlm(spec: str, record: Path | None = None) -> VlmClient | None:
    """Connect to ``"openai:gpt-5.4"`` and the like; ``"metadata"`` asks nobody and gives None.

    What a live model answered once is not paid for again.

    Args:
        spec: Whom to ask, as a person types it.
        record: Folder where every answer is kept for ``"replay:FOLDER"``.

    Raises:
        UserError: The name is unknown, its package is not installed, or its key is not set.

    """
    name, _, rest = spec.partition(":")
    if name == NO_MODEL:
        return None
    if name not in VLM_CLIENTS:
        raise UnknownChoiceError("vision-language model", name, [NO_MODEL, *VLM_CLIENTS])
    if name in LIVE_CLIENTS and find_spec("pydantic_ai") is None:
        raise UserError(
            f"Asking {spec!r} needs a package that is not installed. Type: pip install "
            "'corporeal[models]'. Without it there are --vlm ask:FOLDER (you answer), --vlm "
            "replay:FOLDER and --vlm metadata."
        )
    model = registry.load_backend("vision-language model", name, VLM_CLIENTS)(rest)
    if name in LIVE_CLIENTS:
        model = registry.load_backend("wrapper", "cache", VLM_WRAPPERS)(model, spec, {})
    if record is not None:
        model = registry.load_backend("wrapper", "record", VLM_WRAPPERS)(model, Path(record))
    return model
