"""Vision-language models: one question in, one validated answer out. And what to do without one."""

from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from pydantic import BaseModel

from corporeal import backends
from corporeal.errors import UnknownChoiceError, UserError

Answer = TypeVar("Answer", bound=BaseModel)

MENU = {"replay": "corporeal.vlm.recordings:Recordings"}
"""How to reach a model: name before the colon → class that takes what stands after it."""
LIVE = ("openai", "anthropic", "google", "ollama")
"""Providers that a later version will connect."""
NOBODY = "metadata"
"""No model: names and materials in the file decide."""


@dataclass(frozen=True)
class Question:
    """What is asked, about what, and what it was asked with."""

    task: str
    """Which of the house's questions this is ("materials")."""
    prompt: str
    """The whole text."""
    scene: str
    """What it is about: the scene's name and the object's."""
    views: str = "none"
    """How the pictures were taken, in words; pictures themselves are not compared on replay."""
    pictures: tuple[np.ndarray, ...] = ()
    """Each H x W x 3, uint8, sRGB."""


@runtime_checkable
class Vlm(Protocol):
    """The whole contract."""

    def ask(self, question: Question, answer: type[Answer]) -> Answer:
        """Answer ``question`` in the shape of ``answer``."""
        ...


def connect(spec: str) -> Vlm | None:
    """Connect to ``"replay:FOLDER"``; ``"metadata"`` means nobody is asked and gives None.

    Raises:
        UserError: The name is unknown, or a live model, which this version cannot reach yet.

    """
    name, _, rest = spec.partition(":")
    if name == NOBODY:
        return None
    if name in LIVE:
        raise UserError(
            f"Live models are not connected in this version, so {spec!r} cannot be asked. Use "
            "recorded answers (--vlm replay:FOLDER), an annotation file (--annotations FILE), or "
            "the names in the scene file (--vlm metadata)."
        )
    if name not in MENU:
        raise UnknownChoiceError("vision-language model", name, [NOBODY, *MENU])
    return backends.load("vision-language model", name, MENU)(rest)
