import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from fake_server import FakeServer

from corporeal.vlm import AnswerCost, AnswerSchema, Question, Reply, connect_vlm
from corporeal.vlm import answer_cache as cache_module
from corporeal.vlm.answer_cache import CachingClient
from corporeal.vlm.api_clients import OpenAIClient, RetryPolicy
from corporeal.vlm.thread_map import thread_map

PICTURE = np.zeros((4, 4, 3), np.uint8)
ASKED = Question("colours", "Which of {names}?", "s/o", "1", (PICTURE,), {"names": "red, blue"})


class Colour(AnswerSchema):
    SCHEMA: ClassVar[str] = "colour/1"
    name: str


class Other(AnswerSchema):
    SCHEMA: ClassVar[str] = "colour/2"
    name: str
    sure: bool = True


class Counting:
    """Answers, and counts how often it was asked."""

    looks = True

    def __init__(self, name="red"):
        self.count, self.name = 0, name

    def ask(self, question, answer, check=lambda said: []):
        self.count += 1
        time.sleep(0.01)
        return Reply(answer(name=self.name), "model", "m", AnswerCost(1, 10, 1, 0.1))


def test_the_same_question_is_paid_for_once(tmp_path):
    model = Counting()
    first = CachingClient(model, "m", {}, tmp_path).ask(ASKED, Colour)
    again = CachingClient(model, "m", {}, tmp_path).ask(ASKED, Colour)
    assert (model.count, first.spent.calls, again.spent.calls) == (1, 1, 0)
    assert again.answer == first.answer
    (file,) = tmp_path.rglob("*.json")
    assert json.loads(file.read_text())["answer"] == {"name": "red"}


@pytest.mark.parametrize(
    "other",
    [
        replace(ASKED, task="shapes"),
        replace(ASKED, prompt="Say which of {names}."),
        replace(ASKED, lists={"names": "red, blue, green"}),
        replace(ASKED, pictures=(PICTURE + 1,)),
        replace(ASKED, pictures=(PICTURE, PICTURE)),
        replace(ASKED, pictures=(PICTURE.reshape(2, 8, 3),)),
    ],
    ids=["task", "prompt", "list", "pixels", "number of pictures", "shape of a picture"],
)
def test_whatever_an_answer_depends_on_makes_it_another_question(tmp_path, other):
    cached = CachingClient(Counting(), "m", {}, tmp_path)
    assert cached.key(ASKED, Colour) != cached.key(other, Colour)


def test_model_settings_and_shape_make_it_another_question_and_the_scenes_name_does_not(tmp_path):
    cached = CachingClient(Counting(), "m", {}, tmp_path)
    key = cached.key(ASKED, Colour)
    assert key != cached.key(ASKED, Other)
    assert key != CachingClient(Counting(), "n", {}, tmp_path).key(ASKED, Colour)
    assert key != CachingClient(Counting(), "m", {"t": 1}, tmp_path).key(ASKED, Colour)
    assert key == cached.key(replace(ASKED, scene="another/name"), Colour)


def test_a_live_model_is_connected_with_the_cache_and_recorded_where_asked(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path / "cache"))
    with FakeServer({"content": '{"name": "red"}'}) as server:
        spec = f"openai:fake@{server.url}"
        model = connect_vlm(spec)
        assert [model.ask(ASKED, Colour).answer.name for _ in range(2)] == ["red", "red"]
        assert connect_vlm(spec, tmp_path / "kept").ask(ASKED, Colour).spent.calls == 0
    assert len(server.requests) == 1
    assert connect_vlm(f"replay:{tmp_path / 'kept'}").ask(ASKED, Colour).model == spec


def test_threads_that_ask_the_same_wait_for_one_answer(tmp_path):
    model = Counting()
    cached = CachingClient(model, "m", {}, tmp_path)
    replies = thread_map([lambda: cached.ask(ASKED, Colour)] * 20, 10)
    assert model.count == 1
    assert {r.answer.name for r in replies} == {"red"}


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"answer": {"name": 7}}', '{"answer": null}'])
def test_a_damaged_file_is_as_good_as_none(tmp_path, damage):
    model = Counting()
    cached = CachingClient(model, "m", {}, tmp_path)
    cached.ask(ASKED, Colour)
    (file,) = tmp_path.rglob("*.json")
    file.write_text(damage)
    assert cached.ask(ASKED, Colour).answer.name == "red"
    assert model.count == 2
    assert json.loads(file.read_text())["answer"] == {"name": "red"}


def test_an_answer_that_no_longer_fits_is_asked_for_again(tmp_path):
    model = Counting()
    cached = CachingClient(model, "m", {}, tmp_path)
    cached.ask(ASKED, Colour)
    cached.ask(ASKED, Colour, lambda said: ["red is out"])
    assert model.count == 2


def test_the_environment_says_where_answers_are_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path))
    assert cache_module.answer_cache_folder() == tmp_path / "answers"
    monkeypatch.delenv("CORPOREAL_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    if sys.platform.startswith("linux"):
        assert cache_module.answer_cache_folder() == tmp_path / "xdg" / "corporeal" / "answers"


# ---------------------------------------------------------------- many at once

COUNT = 100
PAUSE, DELIVERY = 1.0, 0.5
"""What the busy server asks for, and how long its answer may be on its way on a busy machine [s].
"""
AT_ONCE = 8
"""Requests that may be on their way when it is asked for."""


class Busy:
    """A slow server that fails every third time, and every so often wants to be left alone."""

    def __init__(self, every):
        self.every = every
        self.refused, self.too_early, self.good = 0, Counter(), Counter()
        self._closed_until, self._seen, self._one = 0.0, 0, threading.Lock()

    def __call__(self, request):
        with self._one:
            self._seen += 1
            now = time.monotonic()
            if self._closed_until - PAUSE + DELIVERY < now < self._closed_until - 0.02:
                self.too_early[self.refused] += 1
            if self._seen % self.every == 0:
                self.refused += 1
                self._closed_until = now + PAUSE
                return {"status": 429, "headers": {"Retry-After-Ms": str(int(1000 * PAUSE))}}
            if self._seen % 3 == 0:
                return {"status": 503, "sleep": 0.01}
            number = request.text.split("number ")[1].split("?")[0]
            self.good[number] += 1
        return {"content": json.dumps({"name": f"colour {number}"}), "sleep": 0.03}


def numbered(k):
    return Question("colours", f"Which colour has number {k}?", f"s/{k}")


@pytest.mark.slow
@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_many_estimations_against_a_slow_failing_server_lose_and_double_nothing(tmp_path, count):
    busy = Busy(every=max(count // 4, 12))
    patience = RetryPolicy(tries=12, first_wait=0.01, longest_wait=1.0, at_once=AT_ONCE)
    with FakeServer(busy) as server:
        model = OpenAIClient(f"fake@{server.url}", patience)
        cached = CachingClient(model, "m", {}, tmp_path)
        jobs = [lambda k=k: cached.ask(numbered(k), Colour) for k in range(count)]
        replies = thread_map([*jobs, *jobs], 32)
        sent = len(server.requests)
        again = thread_map(jobs, 32)
    assert [r.answer.name for r in replies] == 2 * [f"colour {k}" for k in range(count)]
    assert set(busy.good.values()) == {1}
    assert len(busy.good) == count
    assert busy.refused >= 2
    assert max(busy.too_early.values(), default=0) < AT_ONCE, "only what was on its way may come"
    assert [r.answer.name for r in again] == [f"colour {k}" for k in range(count)]
    assert len(server.requests) == sent
    assert sum(r.spent.calls for r in replies) == sent


WORKER = """
import sys
sys.path[:0] = {tests!r}
from test_answer_cache import Colour, numbered
from pathlib import Path
from corporeal.vlm.answer_cache import CachingClient
from corporeal.vlm.api_clients import RetryPolicy
from corporeal.vlm.api_clients import OpenAIClient
from corporeal.vlm.thread_map import thread_map
model = OpenAIClient("fake@{url}", RetryPolicy(tries=12, first_wait=0.01))
cached = CachingClient(model, "m", {{}}, Path({folder!r}))
thread_map([lambda k=k: cached.ask(numbered(k), Colour) for k in range({count})], 16)
"""


@pytest.mark.slow
def test_a_killed_process_leaves_a_whole_cache_that_two_others_go_on_with(tmp_path):
    def slow(request):
        number = request.text.split("number ")[1].split("?")[0]
        return {"content": json.dumps({"name": f"colour {number}"}), "sleep": 0.02}

    with FakeServer(slow) as server:
        code = WORKER.format(
            tests=[str(p) for p in Path(__file__).parents[:2]], url=server.url, folder=str(tmp_path), count=COUNT
        )
        start = [sys.executable, "-c", code]
        first = subprocess.Popen(start)
        while len(list(tmp_path.rglob("*.json"))) < 10:
            assert first.poll() is None
            time.sleep(0.005)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
        kept = list(tmp_path.rglob("*.json"))
        assert 10 <= len(kept) < COUNT
        assert all(json.loads(p.read_text())["answer"]["name"] for p in kept)
        asked = len(server.requests)
        both = [subprocess.Popen(start) for _ in range(2)]
        assert [p.wait(180) for p in both] == [0, 0]
    whole = [json.loads(p.read_text())["answer"]["name"] for p in tmp_path.rglob("*.json")]
    assert sorted(whole) == sorted(f"colour {k}" for k in range(COUNT))
    assert len(server.requests) - asked <= 2 * (COUNT - len(kept))
