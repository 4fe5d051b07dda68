"""Clients of live models through pydantic-ai: typed answers, corrections, retries, error messages.

A model is named PROVIDER:MODEL, or PROVIDER:MODEL@URL for another server that speaks the
provider's format. Keys come from the environment alone. A provider's own key goes to the provider's
own server only; what another server wants is read from ``CORPOREAL_API_KEY``.
"""

import asyncio
import io
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from threading import Lock, Thread
from typing import Any, ClassVar

import numpy as np
from httpx2 import AsyncClient, Request, Response
from PIL import Image
from pydantic_ai import Agent, BinaryContent, ModelRetry, NativeOutput, PromptedOutput, ToolOutput
from pydantic_ai.exceptions import (
    AgentRunError,
    ModelAPIError,
    ModelAuthenticationError,
    ModelConnectionError,
    ModelHTTPError,
    ModelNotFoundError,
    ModelQuotaExceededError,
    ModelRateLimitError,
    ModelRequestRejectedError,
    ModelRequestTimeout,
    ModelServerError,
    ModelUnavailableError,
    ToolRetryError,
)
from pydantic_ai.models import Model, create_async_httpx2_client
from pydantic_ai.profiles import ModelProfile
from pydantic_ai.settings import ModelSettings
from pydantic_ai.usage import RunUsage

from corporeal.core.errors import UserError
from corporeal.vlm import Answer, AnswerCheck, AnswerCost, AnswerNumber, Question, Reply, UnansweredError, no_complaints
from corporeal.vlm.answer_sampling import OTHER_CHOICES, SAMPLING_TEMPERATURE, SpareAnswers, hear


@dataclass(frozen=True)
class RetryPolicy:
    """Limits of waiting and trying."""

    tries: int = 6
    """Requests for one question that may fail on the way, the first included."""
    corrections: int = 3
    """Answers that do not fit which a model may correct."""
    timeout: float = 180.0
    """For one answer [s]."""
    first_wait: float = 1.0
    """After the first failure, where the server names no time; doubled each time [s]."""
    longest_wait: float = 60.0
    """Maximum wait; a server that asks for more ends the run [s]."""
    at_once: int = 8
    """Requests under way at the same time."""

    def wait(self, failures: int, dice: np.random.Generator) -> float:
        """Return how long to wait after so many failures [s], spread so that not all come back."""
        return min(self.first_wait * 2 ** (failures - 1), self.longest_wait) * dice.uniform(0.5, 1)


class RequestGate:
    """Lets so many questions be under way, and no request out while the server asks for a pause."""

    def __init__(self, at_once: int) -> None:
        self.places = asyncio.Semaphore(at_once)
        self._closed_until = 0.0

    def close(self, seconds: float) -> None:
        """Let nothing out for a while [s]."""
        self._closed_until = max(self._closed_until, time.monotonic() + seconds)

    async def opens(self) -> None:
        """Wait as long as the gate is closed."""
        while (left := self._closed_until - time.monotonic()) > 0:
            await asyncio.sleep(left)


def retry_after_seconds(headers: Mapping[str, str]) -> float | None:
    """Return the pause that a response's headers ask for [s], where they say it in figures."""
    for name, unit in (("retry-after-ms", 1e-3), ("retry-after", 1.0)):
        try:
            return max(float(headers[name]) * unit, 0.0)
        except (KeyError, ValueError):
            continue
    return None


GENERIC_KEY_VARIABLE = "CORPOREAL_API_KEY"
VENDOR_KEY_VARIABLES = ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GOOGLE_API_KEY")
"""Environment variables of required keys."""
HTTP_TOO_MANY_REQUESTS = 429
PLACEHOLDER_KEY = "none"
"""Key for servers without one, since the clients require it."""
OLLAMA_DEFAULT_URL = "http://localhost:11434/v1"
"""Default address of Ollama."""
SYSTEM_PROMPT = (
    "You help to compute how real objects move. Answer from what the pictures show and from what "
    "you know of such things; say plainly when you cannot tell."
)
PROMPTED_SCHEMA_PROFILE = ModelProfile(supports_json_object_output=False)
"""The schema of the answer is in the prompt, and nothing else is asked of the server."""
TRANSIENT_ERRORS = (
    ModelRateLimitError,
    ModelUnavailableError,
    ModelServerError,
    ModelConnectionError,
    ModelRequestTimeout,
)
"""HTTP status codes that are retried."""


@dataclass(frozen=True)
class ModelAddress:
    """Address of a model, parsed from the command line."""

    spec: str
    """All of it."""
    model: str
    url: str | None


@dataclass(frozen=True)
class RequestForm:
    """Form of a request."""

    mode: str
    """How the model is held to the shape of an answer: one of ``OUTPUT_MODES``."""
    sampled: bool
    """With a temperature of our own."""
    count: int
    """Answers that one request asks for."""


class ApiClient(ABC):
    """A model behind an API. Each question is its own conversation."""

    looks = True
    provider: ClassVar[str]
    key: ClassVar[str]
    """Environment variable of the provider's own key."""
    limits: ClassVar[ModelSettings] = {}
    several: ClassVar[bool] = False
    """Whether its format lets one request ask for several answers."""

    def __init__(self, rest: str, patience: RetryPolicy | None = None) -> None:
        model, _, url = rest.partition("@http")
        self.address = ModelAddress(f"{self.provider}:{rest}", model, f"http{url}" if url else None)
        if not model:
            raise UserError(f"Name the model: --vlm {self.provider}:MODEL.")
        self.patience = patience or RetryPolicy()
        self._gate = RequestGate(self.patience.at_once)
        self.model = self._model(self._secret(), ModelProfile())
        native = self.model.profile.get("supports_json_schema_output")
        self.mode = "native" if native else "tool"
        self._dice = np.random.default_rng()
        self._sampled, self._several = True, self.several
        self._spares = SpareAnswers()
        self._over: UserError | None = None
        """What ended the asking for good."""

    @abstractmethod
    def _model(self, secret: str, profile: ModelProfile) -> Model:
        """Make the client's model with this key."""

    def _where(self) -> str:
        """Return which server is asked."""
        return self.address.url or self.provider

    def _variable(self) -> str:
        """Name the environment variable of the key for the server that is asked."""
        return GENERIC_KEY_VARIABLE if self.address.url else self.key

    def _secret(self) -> str:
        secret = os.environ.get(self._variable())
        if not secret and self._variable() in VENDOR_KEY_VARIABLES:
            raise UserError(
                f"{self.address.spec} needs a key: set the environment variable "
                f"{self._variable()}. Without one there are --vlm ask:FOLDER and --vlm metadata."
            )
        return secret or PLACEHOLDER_KEY

    def _http(self) -> AsyncClient:
        """Make a client whose requests wait at the gate, and whose refusals close it at once."""

        async def out(request: Request) -> None:
            await self._gate.opens()

        async def back(response: Response) -> None:
            pause = retry_after_seconds(response.headers)
            if response.status_code == HTTP_TOO_MANY_REQUESTS and pause is not None:
                self._gate.close(min(pause, self.patience.longest_wait))

        client = create_async_httpx2_client(timeout=self.patience.timeout)
        hooks = client.event_hooks
        client.event_hooks = {"request": [*hooks["request"], out], "response": [*hooks["response"], back, hear]}
        return client

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Ask, correct what does not fit, and try again while the failure may pass.

        Raises:
            UnansweredError: No usable answer within the patience.
            UserError: The key is refused, the model is unknown, the account is empty, or there is no server: no other
                question would be answered either.
        """
        if self._over is not None:
            raise self._over
        asking = asyncio.run_coroutine_threadsafe(self._ask(question, answer, check), _event_loop())
        try:
            return asking.result()
        except UnansweredError:
            raise
        except UserError as error:
            self._over = error
            raise

    async def _ask(self, question: Question, answer: type[Answer], check: AnswerCheck[Answer]) -> Reply[Answer]:
        usage, start = RunUsage(), time.monotonic()
        spare = self._spares.take(question, answer, check)
        if spare is not None:
            return Reply(spare, "model", self.address.spec)
        for failures in range(1, self.patience.tries + 1):
            sent = self._form(question.turn)
            try:
                async with self._gate.places:
                    made = await self._once(question, answer, check, usage, sent)
            except ModelAPIError as error:
                wait = self._what_now(error, sent, failures)
            except AgentRunError as error:
                raise UnansweredError(self._plain(error)) from error
            else:
                seconds = time.monotonic() - start
                calls = usage.requests + failures - 1
                spent = AnswerCost(calls, usage.input_tokens, usage.output_tokens, seconds)
                return Reply(made, "model", self.address.spec, spent)
            await asyncio.sleep(wait)
        raise AssertionError("the last failure raises")

    async def _once(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer], usage: RunUsage, form: RequestForm
    ) -> Answer:
        agent = Agent(
            self.model,
            output_type=OUTPUT_MODES[self.mode](answer),
            instructions=SYSTEM_PROMPT,
            retries=self.patience.corrections,
        )

        @agent.output_validator
        def fits(answered: Any) -> Any:
            complaints = check(answered)
            if complaints:
                raise ModelRetry("\n".join(complaints))
            return answered

        heard: list[list[str]] = []
        OTHER_CHOICES.set(heard if form.count > 1 else None)
        pictures = [BinaryContent(encode_jpeg(p), media_type="image/jpeg") for p in question.pictures]
        try:
            asked = await agent.run(
                [question.text, *pictures],
                model_settings=lambda context: self._settings(form, context.run_step <= 1),
                usage=usage,
                infer_name=False,
            )
        finally:
            if heard:
                self._several = bool(heard[0])
                self._spares.keep(question, answer, heard[0])
        return asked.output

    def _form(self, turn: AnswerNumber) -> RequestForm:
        """Return how a question is put, as far as the server is known to take it."""
        sampled = self._sampled and turn.of > 1
        count = turn.of - turn.number + 1 if sampled and turn.alike and self._several else 1
        return RequestForm(self.mode, sampled, count)

    def _settings(self, form: RequestForm, first: bool) -> ModelSettings:
        """Return what goes with a request; a correction asks for one answer."""
        longest = self.patience.timeout
        settings = ModelSettings(timeout=longest, request_timeout=longest, max_retries=0)
        settings.update(self.limits)
        if form.sampled:
            settings["temperature"] = SAMPLING_TEMPERATURE
        if form.count > 1 and first:
            settings["extra_body"] = {"n": form.count}
        return settings

    def _what_now(self, error: ModelAPIError, sent: RequestForm, failures: int) -> float:
        """Return how long to wait before asking again [s], or raise that it is no use."""
        self._give_up_all(error, failures)
        if isinstance(error, ModelRequestRejectedError) and self._simpler(sent):
            return 0.0
        garbled = not isinstance(error, ModelHTTPError | ModelRequestRejectedError)
        if not (garbled or isinstance(error, TRANSIENT_ERRORS)) or failures >= self.patience.tries:
            raise UnansweredError(self._plain(error)) from error
        asked_for = error.retry_after
        if asked_for is not None and asked_for > self.patience.longest_wait:
            raise UserError(
                f"{self.address.spec} asks to wait {asked_for:.0f} s. Answers so far are kept: run "
                "the same command again later."
            ) from error
        wait = asked_for if asked_for is not None else self.patience.wait(failures, self._dice)
        if isinstance(error, ModelRateLimitError):
            self._gate.close(wait)
        return wait

    def _simpler(self, sent: RequestForm) -> bool:
        """Ask for less after a refusal: the server may only refuse settings, or the schema."""
        if sent.sampled:
            self._sampled = False
            return True
        if sent.mode == "prompted":
            return False
        if self.mode != "prompted":
            self.mode, self._sampled = "prompted", True
            self.model = self._model(self._secret(), PROMPTED_SCHEMA_PROFILE)
        return True

    def _give_up_all(self, error: ModelAPIError, failures: int) -> None:
        """Raise what holds for every question."""
        where = self._where()
        if isinstance(error, ModelAuthenticationError):
            raise UserError(
                f"{where} refused the key for {self.address.spec}. Check the environment variable {self._variable()}."
            ) from None
        if isinstance(error, ModelNotFoundError):
            raise UserError(f"{where} knows no model {self.address.model!r}. Check the name after --vlm.") from None
        if isinstance(error, ModelQuotaExceededError):
            raise UserError(
                f"{where} says that the account's credit or quota is used up. Answers so far are "
                "kept: run the same command again later."
            ) from None
        unreachable = isinstance(error, ModelConnectionError) and error.phase == "connect"
        if unreachable and failures >= self.patience.tries:
            raise UserError(f"There is no answer from {where}. Check the network, and that the server runs.") from None

    def _plain(self, error: Exception) -> str:
        """Return an error in one line, without the key."""
        secret = self._secret()
        words = " ".join((_validation_failure_text(error) or str(error)).split())
        words = words if secret == PLACEHOLDER_KEY else words.replace(secret, "[key]")
        return f"{self.address.spec}: {words if len(words) <= 200 else f'{words[:197]}...'}"


def _validation_failure_text(error: Exception) -> str:
    """Describe what did not fit in the last of several tries to answer; "": it failed otherwise."""
    last = error.__cause__
    if not isinstance(last, ToolRetryError):
        return ""
    said = last.tool_retry.content
    if isinstance(said, list):
        rows = [row for row in said if isinstance(row, dict)]
        said = "; ".join(f"{_answer_path_text(row.get('loc', ()))}: {row.get('msg', '')}" for row in rows)
    return f"no answer fits, also when asked again; of the last: {said}"


def _answer_path_text(path: Sequence[str | int]) -> str:
    """Name a place within an answer: "answer.parts.0.material"."""
    return ".".join(map(str, ("answer", *path)))


class OpenAIClient(ApiClient):
    """OpenAI, and every server that speaks its chat format."""

    provider, key = "openai", "OPENAI_API_KEY"
    several = True

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.openai import OpenAIChatModel
        from pydantic_ai.providers.openai import OpenAIProvider

        provider = OpenAIProvider(base_url=self.address.url, api_key=secret, http_client=self._http())
        return OpenAIChatModel(self.address.model, provider=provider, profile=profile)


class AnthropicClient(ApiClient):
    """Anthropic."""

    provider, key = "anthropic", "ANTHROPIC_API_KEY"
    limits: ClassVar[ModelSettings] = {"max_tokens": 16000}  # more would have to be streamed

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.anthropic import AnthropicModel
        from pydantic_ai.providers.anthropic import AnthropicProvider

        provider = AnthropicProvider(base_url=self.address.url, api_key=secret, http_client=self._http())
        return AnthropicModel(self.address.model, provider=provider, profile=profile)


class GoogleClient(ApiClient):
    """Google's Gemini API."""

    provider, key = "google", "GOOGLE_API_KEY"

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.google import GoogleModel
        from pydantic_ai.providers.google import GoogleProvider

        provider = GoogleProvider(base_url=self.address.url, api_key=secret, http_client=self._http())
        return GoogleModel(self.address.model, provider=provider, profile=profile)


class OllamaClient(ApiClient):
    """Models on one's own machine, served by Ollama."""

    provider, key = "ollama", "OLLAMA_API_KEY"

    def _where(self) -> str:
        return self.address.url or os.environ.get("OLLAMA_BASE_URL") or OLLAMA_DEFAULT_URL

    def _variable(self) -> str:
        return self.key

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.ollama import OllamaModel
        from pydantic_ai.providers.ollama import OllamaProvider

        provider = OllamaProvider(base_url=self._where(), api_key=secret, http_client=self._http())
        return OllamaModel(self.address.model, provider=provider, profile=profile)


OUTPUT_MODES: dict[str, Callable[[Any], Any]] = {"native": NativeOutput, "tool": ToolOutput, "prompted": PromptedOutput}
"""How a model is held to the shape of an answer, by what its server can do."""


def encode_jpeg(picture: np.ndarray) -> bytes:
    """Encode a picture for sending: the loss is invisible, at a fifth of a PNG."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=92, subsampling=0)
    return file.getvalue()


def _event_loop() -> asyncio.AbstractEventLoop:
    """One loop for all connections, in a thread that does not keep the program alive."""
    with _EVENT_LOOP_LOCK:
        return _start_event_loop()


_EVENT_LOOP_LOCK = Lock()


@cache
def _start_event_loop() -> asyncio.AbstractEventLoop:
    loop = asyncio.new_event_loop()
    Thread(target=loop.run_forever, daemon=True).start()
    return loop
