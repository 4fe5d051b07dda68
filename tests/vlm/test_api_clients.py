import json
import time
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from fake_server import FakeServer
from pydantic import BaseModel

import corporeal
from corporeal.core.errors import UserError
from corporeal.vlm import AnswerSchema, Question, UnansweredError, VlmClient, connect_vlm
from corporeal.vlm.api_clients import AnthropicClient, GoogleClient, OllamaClient, OpenAIClient, RetryPolicy

QUICK = RetryPolicy(tries=3, corrections=2, timeout=30.0, first_wait=0.02, longest_wait=5.0)
PICTURES = tuple(np.full((8, 8, 3), shade, np.uint8) for shade in (0, 100, 200))
ASKED = Question("colours", "What colour is each part? Parts: seat, legs.", "s/chair", "3", PICTURES)
NAMES = ("legs", "seat")
COLOURS = ("red", "blue")


class Part(BaseModel):
    part: str
    colour: str
    share: float


class Colours(AnswerSchema):
    SCHEMA: ClassVar[str] = "colours/1"
    parts: list[Part]


def said(**changed):
    seat = {"part": "seat", "colour": "red", "share": 0.4} | changed
    return json.dumps({"parts": [seat, {"part": "legs", "colour": "blue", "share": 0.6}]})


def check(answer):
    """Complain about names, words outside the list, and values out of range."""
    found = [f"{p.colour!r} is not in the list." for p in answer.parts if p.colour not in COLOURS]
    found += [f"share is {p.share}." for p in answer.parts if not 0 <= p.share <= 1]
    names = tuple(sorted(p.part for p in answer.parts))
    return found + ([] if names == NAMES else [f"Names must be {NAMES}, not {names}."])


GOOD = {"content": said()}


def openai(server, patience=QUICK):
    return OpenAIClient(f"fake-model@{server.url}", patience)


def test_a_typed_answer_about_several_pictures_comes_back_with_what_it_took():
    with FakeServer(GOOD) as server:
        model = openai(server)
        assert isinstance(model, VlmClient)
        reply = model.ask(ASKED, Colours, check)
    assert [p.colour for p in reply.answer.parts] == ["red", "blue"]
    assert (reply.by, reply.model) == ("model", f"openai:fake-model@{server.url}")
    assert (reply.spent.calls, reply.spent.input_tokens, reply.spent.output_tokens) == (1, 1200, 80)
    assert 0 < reply.spent.seconds < 10
    (request,) = server.requests
    assert request.pictures == 3
    assert ASKED.prompt in request.text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "told"),
    [
        ({"content": said()[:40]}, None),
        ({"content": f"```json\n{said()}\n```"}, None),
        ({"content": ""}, None),
        ({"content": "I would say that the seat is red."}, None),
        ({"content": said(part="cushion")}, "Names must be"),
        ({"content": said(colour="crimson")}, "'crimson' is not in the list."),
        ({"content": said(share=1.7)}, "share is 1.7."),
        ({"content": '{"parts": [{"part": "seat"}]}'}, "colour"),
        ({"raw": "<html>busy</html>"}, None),
        ({"status": 503}, None),
        ({"status": 500}, None),
        ({"status": 429, "headers": {"Retry-After": "0"}}, None),
        ({"status": 429}, None),
        ({"status": 400, "error": "response_format is not supported"}, None),
        ({"sleep": 3.0, "content": said()}, None),
    ],
    ids=[
        "half a JSON",
        "fenced JSON",
        "empty",
        "prose",
        "wrong part names",
        "outside the vocabulary",
        "out of range",
        "fields missing",
        "not an answer at all",
        "503",
        "500",
        "429 with Retry-After",
        "429 without",
        "400 on the schema",
        "timeout",
    ],
)
def test_one_failure_is_survived(first, told):
    patience = RetryPolicy(tries=3, corrections=2, timeout=1.5 if "sleep" in first else 30.0)
    patience = RetryPolicy(**{**vars(patience), "first_wait": 0.02})
    with FakeServer(first, GOOD) as server:
        reply = openai(server, patience).ask(ASKED, Colours, check)
    assert [p.part for p in reply.answer.parts] == ["seat", "legs"]
    assert len(server.requests) <= 2
    if told:
        assert told in server.requests[1].text


def test_a_server_that_refuses_schemas_is_asked_in_words_from_then_on():
    def picky(request):
        refuses = "response_format" in request.body or "tools" in request.body
        return {"status": 400, "error": "unknown field"} if refuses else GOOD

    with FakeServer(picky) as server:
        model = openai(server)
        model.ask(ASKED, Colours, check)
        model.ask(ASKED, Colours, check)
    assert len(server.requests) == 3
    assert '"share"' in server.requests[-1].text.replace("\\", "")


@pytest.mark.parametrize(
    "always",
    [
        {"content": said(share=2.0)},
        {"content": ""},
        {"status": 503},
        {"status": 429, "headers": {"Retry-After": "0"}},
        {"status": 400, "error": "no"},
        {"content": "no idea"},
    ],
    ids=["out of range", "empty", "503", "429", "400", "prose"],
)
def test_patience_ends_with_a_question_unanswered(always):
    with FakeServer(always) as server, pytest.raises(UnansweredError, match="openai:fake-model"):
        openai(server).ask(ASKED, Colours, check)
    assert len(server.requests) <= 4


def test_a_refused_key_stops_everything_at_once_and_is_never_shown(monkeypatch):
    monkeypatch.setenv("CORPOREAL_API_KEY", "sk-very-secret")
    refused = {"status": 401, "error": "Incorrect API key provided: sk-very-secret"}
    with FakeServer(refused) as server:
        with pytest.raises(UserError, match="environment variable CORPOREAL_API_KEY") as failure:
            openai(server).ask(ASKED, Colours, check)
        assert not isinstance(failure.value, UnansweredError)
        assert len(server.requests) == 1
        assert server.requests[0].headers["authorization"] == "Bearer sk-very-secret"
    assert "secret" not in str(failure.value)
    with FakeServer({"status": 400, "error": "bad sk-very-secret"}) as server:
        with pytest.raises(UnansweredError) as failure:
            openai(server).ask(ASKED, Colours, check)
    assert "secret" not in str(failure.value)
    assert "[key]" in str(failure.value)


def test_the_key_for_ollama_is_its_own_and_is_not_shown_either(monkeypatch):
    monkeypatch.setenv("OLLAMA_API_KEY", "k-ollama")
    with FakeServer({"status": 401}) as server:
        with pytest.raises(UserError, match="environment variable OLLAMA_API_KEY"):
            OllamaClient(f"llava@{server.url}", QUICK).ask(ASKED, Colours, check)
        assert server.requests[0].headers["authorization"] == "Bearer k-ollama"
    with FakeServer({"status": 400, "error": "odd k-ollama"}) as server:
        with pytest.raises(UnansweredError, match=r"odd \[key\]"):
            OllamaClient(f"llava@{server.url}", QUICK).ask(ASKED, Colours, check)


def test_the_providers_own_key_never_goes_to_another_server(monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", "sk-openai")
    monkeypatch.delenv("CORPOREAL_API_KEY", raising=False)
    with FakeServer(GOOD) as server:
        openai(server).ask(ASKED, Colours, check)
    assert "sk-openai" not in str(server.requests[0].headers)


@pytest.mark.parametrize(
    ("step", "match"),
    [
        ({"status": 404, "error": "no such model"}, "knows no model 'fake-model'"),
        ({"status": 429, "code": "insufficient_quota", "error": "no money"}, "used up"),
        ({"status": 429, "headers": {"Retry-After": "3600"}}, "asks to wait 3600 s"),
    ],
)
def test_what_holds_for_every_question_ends_the_run(step, match):
    with FakeServer(step) as server:
        model = openai(server)
        for _ in range(3):
            with pytest.raises(UserError, match=match) as failure:
                model.ask(ASKED, Colours, check)
    assert not isinstance(failure.value, UnansweredError)
    assert len(server.requests) == 1


def test_no_server_at_all_is_reported_plainly():
    model = OpenAIClient("fake-model@http://127.0.0.1:9/v1", QUICK)
    with pytest.raises(UserError, match=r"There is no answer from http://127\.0\.0\.1:9/v1"):
        model.ask(ASKED, Colours, check)


def test_ollama_is_looked_for_where_it_usually_listens_or_where_the_environment_says(monkeypatch):
    monkeypatch.delenv("OLLAMA_BASE_URL", raising=False)
    assert str(OllamaClient("llava").model.base_url).startswith("http://localhost:11434/v1")
    monkeypatch.setenv("OLLAMA_BASE_URL", "http://127.0.0.1:9/v1")
    with pytest.raises(UserError, match=r"There is no answer from http://127\.0\.0\.1:9/v1"):
        OllamaClient("llava", QUICK).ask(ASKED, Colours, check)


def test_a_pause_that_the_server_asks_for_is_kept():
    with FakeServer({"status": 429, "headers": {"Retry-After": "1"}}, GOOD) as server:
        start = time.monotonic()
        openai(server).ask(ASKED, Colours, check)
    assert server.requests[1].time - start >= 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (OpenAIClient, "gpt-5.4"),
        (OpenAIClient, "gpt-5-mini"),
        (AnthropicClient, "claude-sonnet-5-5"),
        (AnthropicClient, "claude-haiku-4-5"),
        (AnthropicClient, "fake-model"),
        (GoogleClient, "gemini-3.1-pro-preview"),
        (GoogleClient, "fake-model"),
        (OllamaClient, "qwen3-vl"),
    ],
)
def test_every_provider_answers_in_its_own_format(kind, name, monkeypatch):
    monkeypatch.setenv("CORPOREAL_API_KEY", "k-other")
    monkeypatch.delenv("OLLAMA_API_KEY", raising=False)
    with FakeServer(GOOD) as server:
        url = server.url if kind in (OpenAIClient, OllamaClient) else server.root
        model = kind(f"{name}@{url}", QUICK)
        reply = model.ask(ASKED, Colours, check)
    assert [p.colour for p in reply.answer.parts] == ["red", "blue"]
    assert (reply.spent.input_tokens, reply.spent.output_tokens) == (1200, 80)
    (request,) = server.requests
    assert request.pictures == 3
    assert ("k-other" in str(request.headers)) == (kind is not OllamaClient)


@pytest.mark.parametrize(
    ("kind", "name"), [(AnthropicClient, "claude-sonnet-5-5"), (GoogleClient, "gemini-3.1-pro-preview")]
)
@pytest.mark.parametrize(
    "first",
    [{"content": said(share=1.7)}, {"status": 429, "headers": {"Retry-After": "0"}}, {"status": 503}],
    ids=["out of range", "429", "503"],
)
def test_the_other_providers_recover_too(kind, name, first):
    with FakeServer(first, GOOD) as server:
        model = kind(f"{name}@{server.root}", QUICK)
        reply = model.ask(ASKED, Colours, check)
    assert reply.answer.parts[0].share == 0.4
    assert len(server.requests) == 2


@pytest.mark.parametrize("spec", ["openai:gpt-5.4", "anthropic:claude", "google:gemini"])
def test_a_missing_key_is_named(spec, monkeypatch):
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GOOGLE_API_KEY", "GEMINI_API_KEY"):
        monkeypatch.delenv(name, raising=False)
    name = f"{spec.partition(':')[0].upper()}_API_KEY"
    with pytest.raises(UserError, match=f"needs a key: set the environment variable {name}"):
        connect_vlm(spec)
    with pytest.raises(UserError, match="Name the model"):
        connect_vlm("openai:")


def test_only_one_file_needs_the_package():
    source = Path(corporeal.__file__).parent
    needing = [p.name for p in source.rglob("*.py") if "import pydantic_ai" in p.read_text()]
    needing += [p.name for p in source.rglob("*.py") if "from pydantic_ai" in p.read_text()]
    assert needing == ["api_clients.py"]


def test_without_the_package_the_way_to_install_it_is_reported(monkeypatch):
    monkeypatch.setattr("corporeal.vlm.find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"pip install 'corporeal\[models\]'"):
        connect_vlm("openai:gpt-5.4")
