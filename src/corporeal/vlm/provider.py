"""Live models through pydantic-ai: typed answers, corrections, retries, and clear words on failure.

A model is named PROVIDER:MODEL, or PROVIDER:MODEL@URL for another server that speaks the
provider's format. Keys come from the environment alone. A provider's own key goes to the provider's
own server only; what another server wants is read from ``CORPOREAL_API_KEY``.
"""

import asyncio
import io
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
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
from corporeal.vlm import (
    Answer,
    Check,
    Question,
    Reply,
    Spent,
    Turn,
    UnansweredError,
    nothing,
)
from corporeal.vlm.patience import Gate, Patience, seconds_asked_for
from corporeal.vlm.spares import HEARD, TEMPERATURE, Spares, hear

OTHER_KEY = "CORPOREAL_API_KEY"
VENDORS = ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GOOGLE_API_KEY")
"""Keys without which nobody answers."""
TOO_MANY = 429
NO_KEY = "none"
"""Sent where a server wants no key: the clients insist on one."""
OLLAMA = "http://localhost:11434/v1"
"""Where Ollama listens unless its settings say otherwise."""
INSTRUCTIONS = (
    "You help to compute how real objects move. Answer from what the pictures show and from what "
    "you know of such things; say plainly when you cannot tell."
)
IN_WORDS = ModelProfile(supports_json_object_output=False)
"""The schema of the answer is in the prompt, and nothing else is asked of the server."""
PASSING = (
    ModelRateLimitError,
    ModelUnavailableError,
    ModelServerError,
    ModelConnectionError,
    ModelRequestTimeout,
)
"""What may be over when one asks again."""


@dataclass(frozen=True)
class Address:
    """Where a model is, taken from what a person typed."""

    spec: str
    """All of it."""
    model: str
    url: str | None


@dataclass(frozen=True)
class Form:
    """How a question is put to a server."""

    mode: str
    """How the model is held to the shape of an answer: one of ``OUTPUTS``."""
    sampled: bool
    """With a temperature of our own."""
    count: int
    """Answers that one request asks for."""


class Live(ABC):
    """A model behind an API. Each question is its own conversation."""

    looks = True
    provider: ClassVar[str]
    key: ClassVar[str]
    """Environment variable of the provider's own key."""
    limits: ClassVar[ModelSettings] = {}
    several: ClassVar[bool] = False
    """Whether its format lets one request ask for several answers."""

    def __init__(self, rest: str, patience: Patience | None = None) -> None:
        model, _, url = rest.partition("@http")
        self.address = Address(f"{self.provider}:{rest}", model, f"http{url}" if url else None)
        if not model:
            raise UserError(f"Say which model: --vlm {self.provider}:MODEL.")
        self.patience = patience or Patience()
        self._gate = Gate(self.patience.at_once)
        self.model = self._model(self._secret(), ModelProfile())
        native = self.model.profile.get("supports_json_schema_output")
        self.mode = "native" if native else "tool"
        self._dice = np.random.default_rng()
        self._sampled, self._several = True, self.several
        self._spares = Spares()
        self._over: UserError | None = None
        """What ended the asking for good."""

    @abstractmethod
    def _model(self, secret: str, profile: ModelProfile) -> Model:
        """Make the client's model with this key."""

    def _where(self) -> str:
        """Say which server is asked."""
        return self.address.url or self.provider

    def _variable(self) -> str:
        """Name the environment variable of the key for the server that is asked."""
        return OTHER_KEY if self.address.url else self.key

    def _secret(self) -> str:
        secret = os.environ.get(self._variable())
        if not secret and self._variable() in VENDORS:
            raise UserError(
                f"{self.address.spec} needs a key: set the environment variable "
                f"{self._variable()}. Without one there are --vlm ask:FOLDER and --vlm metadata."
            )
        return secret or NO_KEY

    def _http(self) -> AsyncClient:
        """Make a client whose requests wait at the gate, and whose refusals close it at once."""

        async def out(request: Request) -> None:
            await self._gate.opens()

        async def back(response: Response) -> None:
            pause = seconds_asked_for(response.headers)
            if response.status_code == TOO_MANY and pause is not None:
                self._gate.close(min(pause, self.patience.longest_wait))

        client = create_async_httpx2_client(timeout=self.patience.timeout)
        hooks = client.event_hooks
        client.event_hooks = {
            "request": [*hooks["request"], out],
            "response": [*hooks["response"], back, hear],
        }
        return client

    def ask(
        self, question: Question, answer: type[Answer], check: Check[Answer] = nothing
    ) -> Reply[Answer]:
        """Ask, correct what does not fit, and try again while the failure may pass.

        Raises:
            UnansweredError: No usable answer within the patience.
            UserError: The key is refused, the model is unknown, the account is empty, or there is
                no server: no other question would be answered either.

        """
        if self._over is not None:
            raise self._over
        asking = asyncio.run_coroutine_threadsafe(self._ask(question, answer, check), _loop())
        try:
            return asking.result()
        except UnansweredError:
            raise
        except UserError as error:
            self._over = error
            raise

    async def _ask(
        self, question: Question, answer: type[Answer], check: Check[Answer]
    ) -> Reply[Answer]:
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
                spent = Spent(calls, usage.input_tokens, usage.output_tokens, seconds)
                return Reply(made, "model", self.address.spec, spent)
            await asyncio.sleep(wait)
        raise AssertionError("the last failure raises")

    async def _once(
        self,
        question: Question,
        answer: type[Answer],
        check: Check[Answer],
        usage: RunUsage,
        form: Form,
    ) -> Answer:
        agent = Agent(
            self.model,
            output_type=OUTPUTS[self.mode](answer),
            instructions=INSTRUCTIONS,
            retries=self.patience.corrections,
        )

        @agent.output_validator
        def fits(answered: Any) -> Any:
            complaints = check(answered)
            if complaints:
                raise ModelRetry("\n".join(complaints))
            return answered

        heard: list[list[str]] = []
        HEARD.set(heard if form.count > 1 else None)
        pictures = [BinaryContent(jpeg(p), media_type="image/jpeg") for p in question.pictures]
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

    def _form(self, turn: Turn) -> Form:
        """Say how a question is put, as far as the server is known to take it."""
        sampled = self._sampled and turn.of > 1
        count = turn.of - turn.number + 1 if sampled and turn.alike and self._several else 1
        return Form(self.mode, sampled, count)

    def _settings(self, form: Form, first: bool) -> ModelSettings:
        """Return what goes with a request; a correction asks for one answer."""
        longest = self.patience.timeout
        settings = ModelSettings(timeout=longest, request_timeout=longest, max_retries=0)
        settings.update(self.limits)
        if form.sampled:
            settings["temperature"] = TEMPERATURE
        if form.count > 1 and first:
            settings["extra_body"] = {"n": form.count}
        return settings

    def _what_now(self, error: ModelAPIError, sent: Form, failures: int) -> float:
        """Return how long to wait before asking again [s], or raise that it is no use."""
        self._give_up_all(error, failures)
        if isinstance(error, ModelRequestRejectedError) and self._simpler(sent):
            return 0.0
        garbled = not isinstance(error, ModelHTTPError | ModelRequestRejectedError)
        if not (garbled or isinstance(error, PASSING)) or failures >= self.patience.tries:
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

    def _simpler(self, sent: Form) -> bool:
        """Ask for less after a refusal: the server may only refuse settings, or the schema."""
        if sent.sampled:
            self._sampled = False
            return True
        if sent.mode == "prompted":
            return False
        if self.mode != "prompted":
            self.mode, self._sampled = "prompted", True
            self.model = self._model(self._secret(), IN_WORDS)
        return True

    def _give_up_all(self, error: ModelAPIError, failures: int) -> None:
        """Raise what holds for every question."""
        where = self._where()
        if isinstance(error, ModelAuthenticationError):
            raise UserError(
                f"{where} refused the key for {self.address.spec}. Check the environment variable "
                f"{self._variable()}."
            ) from None
        if isinstance(error, ModelNotFoundError):
            raise UserError(
                f"{where} knows no model {self.address.model!r}. Check the name after --vlm."
            ) from None
        if isinstance(error, ModelQuotaExceededError):
            raise UserError(
                f"{where} says that the account's credit or quota is used up. Answers so far are "
                "kept: run the same command again later."
            ) from None
        unreachable = isinstance(error, ModelConnectionError) and error.phase == "connect"
        if unreachable and failures >= self.patience.tries:
            raise UserError(
                f"Nobody answers at {where}. Check the network, and that the server runs."
            ) from None

    def _plain(self, error: Exception) -> str:
        """Say in one short line what went wrong, without the key."""
        secret = self._secret()
        words = " ".join((_unfit(error) or str(error)).split())
        words = words if secret == NO_KEY else words.replace(secret, "[key]")
        return f"{self.address.spec}: {words if len(words) <= 200 else f'{words[:197]}...'}"


def _unfit(error: Exception) -> str:
    """Say what did not fit in the last of several tries to answer; "": it failed otherwise."""
    last = error.__cause__
    if not isinstance(last, ToolRetryError):
        return ""
    said = last.tool_retry.content
    if isinstance(said, list):
        rows = [row for row in said if isinstance(row, dict)]
        said = "; ".join(f"{_place(row.get('loc', ()))}: {row.get('msg', '')}" for row in rows)
    return f"no answer fits, also when asked again; of the last: {said}"


def _place(path: Sequence[str | int]) -> str:
    """Name a place within an answer: "answer.parts.0.material"."""
    return ".".join(map(str, ("answer", *path)))


class OpenAI(Live):
    """OpenAI, and every server that speaks its chat format."""

    provider, key = "openai", "OPENAI_API_KEY"
    several = True

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.openai import OpenAIChatModel
        from pydantic_ai.providers.openai import OpenAIProvider

        provider = OpenAIProvider(
            base_url=self.address.url, api_key=secret, http_client=self._http()
        )
        return OpenAIChatModel(self.address.model, provider=provider, profile=profile)


class Anthropic(Live):
    """Anthropic."""

    provider, key = "anthropic", "ANTHROPIC_API_KEY"
    limits: ClassVar[ModelSettings] = {"max_tokens": 16000}  # more would have to be streamed

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.anthropic import AnthropicModel
        from pydantic_ai.providers.anthropic import AnthropicProvider

        provider = AnthropicProvider(
            base_url=self.address.url, api_key=secret, http_client=self._http()
        )
        return AnthropicModel(self.address.model, provider=provider, profile=profile)


class Google(Live):
    """Google's Gemini API."""

    provider, key = "google", "GOOGLE_API_KEY"

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.google import GoogleModel
        from pydantic_ai.providers.google import GoogleProvider

        provider = GoogleProvider(
            base_url=self.address.url, api_key=secret, http_client=self._http()
        )
        return GoogleModel(self.address.model, provider=provider, profile=profile)


class Ollama(Live):
    """Models on one's own machine, served by Ollama."""

    provider, key = "ollama", "OLLAMA_API_KEY"

    def _where(self) -> str:
        return self.address.url or os.environ.get("OLLAMA_BASE_URL") or OLLAMA

    def _variable(self) -> str:
        return self.key

    def _model(self, secret: str, profile: ModelProfile) -> Model:
        from pydantic_ai.models.ollama import OllamaModel
        from pydantic_ai.providers.ollama import OllamaProvider

        provider = OllamaProvider(base_url=self._where(), api_key=secret, http_client=self._http())
        return OllamaModel(self.address.model, provider=provider, profile=profile)


OUTPUTS: dict[str, Callable[[Any], Any]] = {
    "native": NativeOutput,
    "tool": ToolOutput,
    "prompted": PromptedOutput,
}
"""How a model is held to the shape of an answer, by what its server can do."""


def jpeg(picture: np.ndarray) -> bytes:
    """Encode a picture for sending: what is lost nobody sees, and it is a fifth of a PNG."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=92, subsampling=0)
    return file.getvalue()


def _loop() -> asyncio.AbstractEventLoop:
    """One loop for all connections, in a thread that does not keep the program alive."""
    with _ONE:
        return _started()


_ONE = Lock()


@cache
def _started() -> asyncio.AbstractEventLoop:
    loop = asyncio.new_event_loop()
    Thread(target=loop.run_forever, daemon=True).start()
    return loop
