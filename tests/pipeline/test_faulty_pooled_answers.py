"""Faults that weak models make in one of three answers, or in all: what is said, and what is kept.

The server gives all answers to one request, as OpenAI's ``n`` has it, or one at a time.
"""

import json
import sys
from pathlib import Path

import pytest
from test_faulty_answers import ASKED_AGAIN, JAR, TASKS, says, sound, task_of, ways

from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.stages.describe import describe
from corporeal.vlm.api_clients import RetryPolicy
from sample_scenes import scene
from scripted_model import weighs

sys.path.insert(0, str(Path(__file__).parents[1] / "vlm"))
from fake_server import FakeServer

FAULTS = {name: (task, fault) for name, (task, fault, _) in ASKED_AGAIN.items()}
FAULTS |= {
    "a list in place of an object": ("materials", says([ways(0.8)])),
    "a mass that is text": ("mass", says(weighs(likely="heavy"))),
    "nothing": ("mass", lambda text: ""),
}


CORRECTIONS = RetryPolicy().corrections
STAYING = ("density in g/cm3", "probabilities in per cent", "a mass of 0", "prose alone")


class OneOfThree:
    """A model whose second answer in one task is at fault; once, or as often as it is asked for."""

    def __init__(self, task, fault, always=False, at_once=True):
        self.task, self.fault, self.always, self.at_once = task, fault, always, at_once
        self.asked = 0

    def __call__(self, request):
        said = request.body["messages"][1]["content"]
        text = said if isinstance(said, str) else next(c["text"] for c in said if "text" in c)
        count = request.body.get("n", 1) if self.at_once else 1
        first, *more = [self.told(text) for _ in range(count)]
        return {"content": first, "more": more}

    def told(self, text):
        """Say something sound, but for the second answer, and its corrections where it never is."""
        if task_of(text) == self.task:
            self.asked += 1
            again = self.asked > 3 if self.at_once else 2 < self.asked <= 2 + CORRECTIONS
            if self.asked == 2 or (self.always and again):
                return self.fault(text)
        return json.dumps(sound(text))


@pytest.fixture
def interview(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path))

    def asked(model):
        with FakeServer(model) as server:
            spec = f"openai:weak@{server.url}"
            config = DescribeConfig(vlm=spec, view_size=32, answers=3, sampling="value")
            return describe(scene(JAR), config), [r.text for r in server.requests]

    return asked


@pytest.mark.parametrize(("name", "at_once"), [*((name, True) for name in FAULTS), ("a mass of 0", False)])
def test_a_fault_in_one_of_three_is_asked_for_again_and_all_three_count(interview, name, at_once):
    made, _ = interview(OneOfThree(*FAULTS[name], at_once=at_once))
    (jar,) = made.objects
    assert [a.parts[0].material for a in jar.answers] == ["glass"] * 3
    assert [a.evidence.likely for a in jar.answers] == pytest.approx([40.0] * 3)
    assert made.warnings == ()


@pytest.mark.parametrize("name", STAYING)
def test_a_fault_of_one_of_three_that_stays_is_reported_once_and_costs_that_one_alone(interview, name):
    task, fault = FAULTS[name]
    made, _ = interview(OneOfThree(task, fault, always=True, at_once=task != "placement"))
    (jar,) = made.objects
    said, *more = made.warnings
    assert f"jar_0: the question about {task} got no usable answer " in said
    assert "no answer fits, also when asked again; of the last: " in said
    left = 3 if task == "mass" else 2  # an answer without a mass says what it is made of still
    assert more == ([] if left == 3 else [OPEN])
    assert [a.parts[0].material for a in jar.answers] == ["glass"] * left
    assert [a.evidence.likely for a in jar.answers if a.evidence] == pytest.approx([40.0] * 2)
    assert jar.evidence.likely == pytest.approx(40.0)


OPEN = "jar_0: 2 of 3 answers count; a question to the others stayed open."


def test_a_list_of_one_answer_is_read_as_that_answer(interview):
    model = OneOfThree(*FAULTS["a list in place of an object"])
    made, requests = interview(model)
    assert made.warnings == ()
    assert len([text for text in requests if TASKS["materials"] in text]) == 1
    assert len(made.objects[0].answers) == 3


def test_prose_around_one_of_three_answers_is_no_fault(interview):
    def wordy(text):
        return f"Let me see.\n```json\n{json.dumps(sound(text))}\n```\nSo it looks."

    made, requests = interview(OneOfThree("materials", wordy))
    assert made.warnings == ()
    assert len([text for text in requests if TASKS["materials"] in text]) == 1
    assert len(made.objects[0].answers) == 3
