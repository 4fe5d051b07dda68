"""Faults that weak models make, planted behind a server: each ends in a second question or a word.

The server answers as a sound model does but for one fault, once or always.
"""

import json
import re
import sys
from pathlib import Path

import pytest

from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.stages.describe import describe
from sample_scenes import plain, scene
from scripted_model import decomposed, part, weighs, whole

sys.path.insert(0, str(Path(__file__).parents[1] / "vlm"))
from fake_server import FakeServer

JAR = ("jar_0", [("mesh", plain(), {})])
TASKS = {
    "parts": "Which parts does it have?",
    "materials": "What may each of its parts be made of",
    "mass": "Then judge what the whole object weighs",
    "extents": "How large is the real thing",
    "placement": "a range was measured on samples",
}
"""Words by which a question is told."""
SHARES = {"volume_share": 1.0, "surface_share": 1.0}


def task_of(text):
    return next(task for task, words in TASKS.items() if words in text)


def values(text, factor=None):
    """Place every quantity in the middle, or give its high end times a factor."""
    parts = []
    for block in re.split(r"^Part ", text, flags=re.MULTILINE)[1:]:
        name, rows = block.split(":\n", 1)
        found = re.findall(r"^- (\w+): .*?: ([\d.e+-]+) to ([\d.e+-]+)", rows, flags=re.MULTILINE)
        key = "fraction" if factor is None else "value"
        said = [{"quantity": q, key: 0.5 if factor is None else float(high) * scale(q, factor)} for q, _, high in found]
        parts.append({"part": name, "values": [row | {"reason": "Usual."} for row in said]})
    return {"parts": parts}


def scale(quantity, factor):
    """Factor of a value: only the density is in another unit."""
    return factor if quantity == "density" else 1.0


def sound(text, parts=("jar",), materials=None):
    """Answer a question as a sound model does."""
    task = task_of(text)
    if task == "parts":
        return decomposed(list(parts)) if len(parts) > 1 else whole("jar")
    if task == "materials":
        return materials or {"parts": [part("jar", "glass", "hollow")]}
    if task == "mass":
        return weighs(20.0, 40.0, 80.0)
    if task == "extents":
        return {"classes": [{"class_name": "jar", "metres": 1.0}]}
    return values(text, 1.0 if "Answer with a value" in text else None)


class Faulty:
    """A model that errs in one task, the first time or always."""

    def __init__(self, task, fault, always=False, **right):
        self.task, self.fault, self.always, self.right, self.erred = task, fault, always, right, 0

    def __call__(self, request):
        said = request.body["messages"][1]["content"]
        text = said if isinstance(said, str) else next(c["text"] for c in said if "text" in c)
        if task_of(text) == self.task and (self.always or not self.erred):
            self.erred += 1
            return {"content": self.fault(text)}
        return {"content": json.dumps(sound(text, **self.right))}


@pytest.fixture
def interview(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path))

    def asked(model, **config):
        with FakeServer(model) as server:
            spec = f"openai:weak@{server.url}"
            made = describe(scene(JAR), DescribeConfig(vlm=spec, view_size=32, **config))
            return made, [r.text for r in server.requests]

    return asked


def says(answer):
    return lambda text: json.dumps(answer)


def ways(*probabilities):
    way = {"material": "glass", "built": "hollow", "reason": "Clear."}
    return {"parts": [{"part": "jar", "ways": [way | {"probability": p} for p in probabilities]}]}


def printed(number, unit):
    fact = {"kind": "net weight", "number": number, "unit": unit, "words": f"{number} {unit}"}
    return weighs(20.0, 40.0, 80.0, printed=[fact])


COVERED = {
    "parts": [
        part("cover", "leather", "sheet", **SHARES),
        part("shell", "rubber", "hollow", volume_share=0.9, surface_share=0.9, inside="cover"),
    ]
}
COVERED_BY_NOTHING = json.loads(json.dumps(COVERED))
COVERED_BY_NOTHING["parts"][1]["surface_share"] = 0.0
MOST = {"volume_share": 0.9, "surface_share": 0.9}
FULL = part("jar", "glass", "filled", contents="sauce", fill=0.9, **MOST)
CONTENTS = {"parts": [FULL, part("sauce", "soft_plastic", volume_share=0.1, surface_share=0.1)]}
ASKED_AGAIN = {
    "density in g/cm3": ("placement", lambda text: json.dumps(values(text, 1e-3)), "density is"),
    "probabilities in per cent": ("materials", says(ways(60, 40)), "less than or equal to 1"),
    "a mass of 0": ("mass", says(weighs(0.0, 0.0, 0.0)), "greater than 0"),
    "a mass in grams": ("mass", says(weighs(2e7, 4e7, 8e7)), "Answer in kilograms"),
    "a printed weight in another unit": ("mass", says(printed(5e7, "g")), "Check the unit"),
    "words for a unit": ("mass", says(printed(50, "grams")), "unit"),
    "another word for how it is built": ("materials", says({"parts": [part("jar", "glass", "shell")]}), "built"),
    "prose alone": ("materials", lambda text: "A jar of glass, I should say.", ""),
}


@pytest.mark.parametrize(("task", "fault", "told"), ASKED_AGAIN.values(), ids=ASKED_AGAIN)
def test_a_fault_is_reported_and_asked_for_again(interview, task, fault, told):
    model = Faulty(task, fault)
    made, requests = interview(model, sampling="value")
    assert model.erred == 1
    again = [text for text in requests if TASKS[task] in text]
    assert len(again) == 2
    assert told in again[1].replace("\\", "")
    (jar,) = made.objects
    assert jar.parts[0].material == "glass"
    assert jar.evidence.likely == 40.0
    assert not any("no usable answer" in w for w in made.warnings)


def test_what_a_container_holds_is_asked_for_again(interview):
    sheet = part("jar", "glass", "sheet", **MOST)
    right = {"parts": [sheet, CONTENTS["parts"][1]]}
    told = "sauce is what jar holds, and would weigh twice"
    self_mended(interview, ("jar", "sauce"), CONTENTS, right, told)


def test_a_shell_in_a_cover_without_area_is_asked_for_again(interview):
    told = "shell: give surface_share, above 0"
    self_mended(interview, ("cover", "shell"), COVERED_BY_NOTHING, COVERED, told)


def self_mended(interview, parts, wrong, right, told):
    made, requests = interview(Faulty("materials", says(wrong), parts=parts, materials=right))
    again = [text for text in requests if TASKS["materials"] in text]
    assert len(again) == 2
    assert told in again[1]
    pieces = made.objects[0].parts[0].pieces
    assert [p.name for p in pieces] == list(parts)


SAID = {
    "probabilities that add up to 3": (
        "materials",
        says(ways(1, 1, 1)),
        "the probabilities of jar add up to 3 and were divided by it",
    ),
    "one way only": ("materials", says(ways(1.0)), "one way only was given for every part"),
    "never a mass above 0": ("mass", says(weighs(0.0, 0.0, 0.0)), "about mass got no usable"),
    "never a density in range": (
        "placement",
        lambda text: json.dumps(values(text, 1e-3)),
        "about placement got no usable",
    ),
    "never JSON": ("materials", lambda text: "Glass.", "about materials got no usable"),
}


@pytest.mark.parametrize(("task", "fault", "told"), SAID.values(), ids=SAID)
def test_a_fault_that_stays_is_reported(interview, task, fault, told):
    made, _ = interview(Faulty(task, fault, always=True), sampling="value")
    assert any(told in warning for warning in made.warnings)


def test_prose_around_an_answer_is_no_fault(interview):
    good = json.dumps(ways(0.8))
    model = Faulty("materials", lambda text: f"Let me see.\n```json\n{good}\n```\nSo it looks.")
    made, _ = interview(model)
    assert made.objects[0].parts[0].material == "glass"
    assert not any("no usable answer" in w for w in made.warnings)
