"""The same question asked for several answers: in one request where a server can, else in more."""

import json
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from fake_server import FakeServer

from corporeal.core.errors import UserError
from corporeal.vlm import AnswerCost, AnswerNumber, AnswerSchema, Question
from corporeal.vlm.answer_cache import CachingClient
from corporeal.vlm.api_clients import AnthropicClient, OpenAIClient, RetryPolicy
from corporeal.vlm.recordings import RecordingClient, ReplayClient, write_recording

QUICK = RetryPolicy(tries=4, corrections=2, timeout=30.0, first_wait=0.02, longest_wait=5.0)
ASKED = Question("materials", "How heavy?", "s/chair", "1", (np.full((8, 8, 3), 100, np.uint8),))


class Heavy(AnswerSchema):
    SCHEMA: ClassVar[str] = "heavy/1"
    kilograms: float


def said(kilograms):
    return json.dumps({"kilograms": kilograms})


def check(answer):
    return [] if answer.kilograms > 0 else ["Nothing weighs less than nothing."]


def asked(number, of=3, alike=True):
    return replace(ASKED, turn=AnswerNumber(number, of, alike))


def told(model, of=3, alike=True):
    """Ask for every answer in turn."""
    return [model.ask(asked(k, of, alike), Heavy, check) for k in range(1, of + 1)]


def numbers(replies):
    return [r.answer.kilograms for r in replies]


def several(request):
    """Answer as often as is asked for: 1, 2, 3 ... kg."""
    return {"content": said(1), "more": [said(k) for k in range(2, request.body.get("n", 1) + 1)]}


def counting():
    """Answer once a request, whatever it asks for: 1, 2, 3 ... kg."""
    return [{"content": said(k)} for k in range(1, 6)]


def test_a_server_that_knows_n_is_asked_once_and_sees_each_picture_once():
    with FakeServer(several) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [1, 2, 3]
    (request,) = server.requests
    assert (request.body["n"], request.body["temperature"], request.pictures) == (3, 0.7, 1)
    assert [r.spent.calls for r in replies] == [1, 0, 0]
    assert [r.spent for r in replies[1:]] == [AnswerCost(), AnswerCost()]


def test_a_server_that_ignores_n_is_asked_as_often_and_not_for_n_again():
    with FakeServer(*counting()) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [1, 2, 3]
    assert [r.body.get("n") for r in server.requests] == [3, None, None]
    assert {r.body["temperature"] for r in server.requests} == {0.7}
    assert [r.spent.calls for r in replies] == [1, 1, 1]


def test_a_server_that_refuses_the_settings_is_asked_without_them():
    def strict(request):
        return {"status": 400} if "n" in request.body else {"content": said(2)}

    with FakeServer(strict) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [2, 2, 2]
    assert ["response_format" in r.body for r in server.requests] == [True] * 4
    assert [r.body.get("temperature") for r in server.requests] == [0.7, None, None, None]


def test_a_server_that_refuses_the_schema_still_gives_several():
    def wordy(request):
        return {"status": 400} if "response_format" in request.body else several(request)

    with FakeServer(wordy) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [1, 2, 3]
    assert [r.body.get("n") for r in server.requests] == [3, None, 3]


@pytest.mark.parametrize("broken", ["so heavy", said(-1), ""])
def test_one_broken_of_three_is_asked_for_anew(broken):
    first = {"content": said(1), "more": [broken, said(3)]}
    with FakeServer(first, {"content": said(4)}) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [1, 3, 4]
    assert [r.body.get("n") for r in server.requests] == [3, None]


def test_a_correction_asks_for_one_answer():
    first = {"content": said(-1), "more": [said(2), said(3)]}
    with FakeServer(first, {"content": said(1)}) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK))
    assert numbers(replies) == [1, 2, 3]
    assert [r.body.get("n") for r in server.requests] == [3, None]


def test_what_hangs_on_an_earlier_answer_is_asked_for_one_by_one():
    with FakeServer(*counting()) as server:
        replies = told(OpenAIClient(f"fake-model@{server.url}", QUICK), alike=False)
    assert numbers(replies) == [1, 2, 3]
    assert [(r.body.get("n"), r.body["temperature"]) for r in server.requests] == [(None, 0.7)] * 3


def test_one_answer_is_asked_for_as_ever():
    with FakeServer(several) as server:
        OpenAIClient(f"fake-model@{server.url}", QUICK).ask(ASKED, Heavy, check)
    assert not {"n", "temperature"} & server.requests[0].body.keys()


def test_a_format_without_n_is_asked_as_often():
    with FakeServer(*counting()) as server:
        replies = told(AnthropicClient(f"fake-model@{server.root}", QUICK))
    assert numbers(replies) == [1, 2, 3]
    assert ["n" in r.body for r in server.requests] == [False] * 3


def test_each_answer_is_paid_for_once_and_the_first_is_that_of_one(tmp_path):
    with FakeServer(several) as server:

        def model():
            return CachingClient(OpenAIClient(f"fake-model@{server.url}", QUICK), "fake", {}, tmp_path)

        assert numbers([model().ask(ASKED, Heavy, check)]) == [1]
        more = model()
        assert numbers(told(more)) == [1, 1, 2]  # the others are asked for: two at once
        assert numbers(told(model())) == [1, 1, 2]
    assert [r.body.get("n") for r in server.requests] == [None, 2]


def test_recordings_keep_each_answer_and_the_first_under_the_name_of_one(tmp_path):
    with FakeServer(several) as server:
        model = OpenAIClient(f"fake-model@{server.url}", QUICK)
        told(RecordingClient(model, tmp_path / "three"))
    replayed = ReplayClient(str(tmp_path / "three"))
    assert numbers(told(replayed)) == [1, 2, 3]
    assert replayed.ask(ASKED, Heavy).answer.kilograms == 1
    one = write_recording(tmp_path / "one", ASKED, Heavy(kilograms=1), model.address.spec)
    assert (tmp_path / "three" / one.name).read_bytes() == one.read_bytes()
    with pytest.raises(UserError, match="is answer 4 to 'materials' about 's/chair'; it holds 3"):
        replayed.ask(asked(4), Heavy)
