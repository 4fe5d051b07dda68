"""Vision-language models: one question in, one validated answer out; and its replacements."""

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
    """Name and version of its fields, such as "materials/1": answers are recorded under it, not under the name of the
    class. Raise the version with every change of the fields."""


Answer = TypeVar("Answer", bound=AnswerSchema)

VLM_CLIENTS = {
    "replay": "corporeal.vlm.recordings:ReplayClient",
    "ask": "corporeal.vlm.human_client:HumanClient",
    "openai": "corporeal.vlm.api_clients:OpenAIClient",
    "anthropic": "corporeal.vlm.api_clients:AnthropicClient",
    "google": "corporeal.vlm.api_clients:GoogleClient",
    "ollama": "corporeal.vlm.api_clients:OllamaClient",
}
"""How to reach a model: name before the colon → class that takes what follows it."""
VLM_WRAPPERS = {
    "cache": "corporeal.vlm.answer_cache:CachingClient",
    "record": "corporeal.vlm.recordings:RecordingClient",
}
"""Wrappers around a client."""
LIVE_CLIENTS = ("openai", "anthropic", "google", "ollama")
"""Providers on the network, which need an optional package."""
DEFAULT_OPENAI_CRITIC = "openai:gpt-5-mini"
"""Default critic when OpenAI answers."""
NO_MODEL = "metadata"
"""No model: names and materials in the file decide."""


class OnDemandPictures(Sequence[np.ndarray]):
    """Pictures that are rendered on first access."""

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
    """A question with its subject, pictures and options."""

    task: str
    """Kind of the question ("materials")."""
    prompt: str
    """The prompt; {name} is replaced by one of ``lists``."""
    scene: str
    """Subject: the scene's name and the object's."""
    views: str = "none"
    """Description of the views; pixels are not compared on replay."""
    pictures: Sequence[np.ndarray] = ()
    """Each H x W x 3, uint8, sRGB."""
    lists: Mapping[str, str] = field(default_factory=dict)
    """Options of the library, by name. A longer list does not invalidate a recording."""
    turn: AnswerNumber = SINGLE_ANSWER
    prompt_version: str = ""
    """Names the wording, such as "materials/1"; "": identified by its text."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """Facts inserted into the prompt; part of the identity of a question."""

    @property
    def text(self) -> str:
        """The whole text as it is sent."""
        text = self.prompt
        for name, words in self.lists.items():
            text = text.replace(f"{{{name}}}", words)
        return text


@dataclass(frozen=True)
class AnswerCost:
    """Cost of an answer."""

    calls: int = 0
    """Requests that were sent, those that failed included."""
    input_tokens: int = 0
    output_tokens: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class Reply(Generic[Answer]):
    """A validated answer, and its source."""

    answer: Answer
    by: Literal["model", "recording"]
    model: str
    """As in --vlm: "openai:gpt-5.4"."""
    spent: AnswerCost = AnswerCost()


AnswerCheck = Callable[[Answer], list[str]]
"""Returns the faults of an answer, one sentence each, to be sent to the model."""


def no_complaints(answer: AnswerSchema) -> list[str]:
    """Return no faults."""
    return []


class UnansweredError(UserError):
    """A model gave no usable answer, even after corrections."""


@runtime_checkable
class VlmClient(Protocol):
    """Interface of all clients."""

    looks: bool
    """Whether the client uses a question's pictures; else they need not be rendered."""

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Answer ``question`` in the schema ``answer``, without faults.

        Raises:
            UnansweredError: There is no usable answer to this question; others may be answered.
            UserError: No question will be answered; the message says what to do.
        """
        ...


def choose_critic(spec: str, asked: str) -> str:
    """Return the critic that ranks partitions of an object: as ``asked``, a cheaper model, or the same.

    Args:
        spec: The model, as in --vlm.
        asked: The critic asked for; "": none.
    """
    theirs = spec.startswith("openai:") and "@" not in spec
    return asked or (DEFAULT_OPENAI_CRITIC if theirs else spec)


def connect_vlm(spec: str, record: Path | None = None) -> VlmClient | None:
    """Connect to ``"openai:gpt-5.4"`` and the like; ``"metadata"`` gives None.

    Answers of live models are cached.

    Args:
        spec: The model, as in --vlm.
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
