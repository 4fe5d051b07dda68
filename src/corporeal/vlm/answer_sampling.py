"""Several answers to one request, which pays for the pictures once.

OpenAI's chat format has ``n``; its client hands on the first choice only, so that the others are read off the response.
A server that ignores ``n`` gives one, and is asked again.
"""

import hashlib
import json
from contextvars import ContextVar
from threading import Lock

from httpx2 import Response
from pydantic import BaseModel, ValidationError

from corporeal.vlm import Answer, AnswerCheck, AnswerSchema, Question

SAMPLING_TEMPERATURE = 0.7
"""Temperature of several answers: Wang et al. (2022, arXiv:2203.11171) took .5 to .7."""
OTHER_CHOICES: ContextVar[list[list[str]] | None] = ContextVar("heard", default=None)
"""Answers beside the first choice, by response, of the question that this task asks."""


class ToolArguments(BaseModel):
    """With what a model calls a tool: the answer, where that is how it is held to a shape."""

    arguments: str = ""


class ToolCall(BaseModel):
    """A call of a tool."""

    function: ToolArguments


class ChatMessage(BaseModel):
    """What a model says."""

    content: str | None = None
    tool_calls: list[ToolCall] | None = None


class ChatChoice(BaseModel):
    """One of the answers in a response."""

    message: ChatMessage


class ChatResponse(BaseModel):
    """A response in OpenAI's chat format, as far as it is read here."""

    choices: list[ChatChoice]


async def hear(response: Response) -> None:
    """Keep further choices of a response, if several were asked for."""
    heard = OTHER_CHOICES.get()
    if heard is None or not response.is_success:
        return
    try:
        body = ChatResponse.model_validate_json(await response.aread())
    except ValidationError:
        heard.append([])  # the client says what is wrong with it
        return
    heard.append([text for choice in body.choices[1:] if (text := _answer_text(choice.message))])


def _answer_text(message: ChatMessage) -> str:
    """Return the answer in a message: its text, or the arguments of the call that it is."""
    calls = message.tool_calls
    return (calls[0].function.arguments if calls else message.content) or ""


class SpareAnswers:
    """Further answers of a response, kept until they are asked for."""

    def __init__(self) -> None:
        self._kept: dict[str, list[str]] = {}
        self._one = Lock()

    def keep(self, question: Question, answer: type[AnswerSchema], texts: list[str]) -> None:
        """Keep the answers for equal questions."""
        with self._one:
            self._kept[_key(question, answer)] = list(texts)

    def take(self, question: Question, answer: type[Answer], check: AnswerCheck[Answer]) -> Answer | None:
        """Return the next valid one; None: none is left."""
        if question.turn.number == 1 or not question.turn.alike:
            return None
        with self._one:
            left = self._kept.get(_key(question, answer), [])
            while left:
                found = _parse_fitting_answer(left.pop(0), answer, check)
                if found is not None:
                    return found
        return None


def _key(question: Question, answer: type[AnswerSchema]) -> str:
    """Name what is asked, whichever of several answers is wanted."""
    pictures = [hashlib.sha256(p.tobytes()).hexdigest() for p in question.pictures]
    row = [question.scene, question.task, question.text, answer.SCHEMA, *pictures]
    return hashlib.sha256(json.dumps(row).encode()).hexdigest()


def _parse_fitting_answer(text: str, answer: type[Answer], check: AnswerCheck[Answer]) -> Answer | None:
    """Read an answer, whatever surrounds its braces; None where it does not fit."""
    try:
        found = answer.model_validate_json(text[text.find("{") : text.rfind("}") + 1])
    except ValidationError:
        return None
    return None if check(found) else found
