"""Which things stand in a photographed scene: asked, checked, paired with what was found."""

import json

import numpy as np
import pytest
from fake_server import FakeServer

from corporeal.vlm.answer_checks import regions_complaints, things_complaints
from corporeal.vlm.answer_schemas import ObjectsAnswer, PaintedRegion, RegionsAnswer
from corporeal.vlm.photographed_objects import PhotoInterview, SeenObject

DUCK = {"class_name": "rubber duck", "look": "yellow, in front", "metres": 0.1}
CAN = {"class_name": "soda can", "look": "red, lying", "metres": 0.12}
PICTURES = [np.full((8, 8, 3), 40 * k, np.uint8) for k in range(2)]


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path / "cache"))


def answer(**said):
    return {"content": json.dumps(said)}


def test_without_a_model_there_is_no_answer():
    nobody = PhotoInterview("desk", "metadata")
    assert nobody.objects(PICTURES) == []
    assert nobody.regions(PICTURES, ["red"], [SeenObject("duck")]) is None
    assert nobody.asked().transcript == ()


def test_a_model_names_objects_and_then_the_painted_regions(tmp_path):
    regions = [{"colour": "red", "thing": 2}, {"colour": "blue", "thing": None}]
    with FakeServer(answer(things=[DUCK, CAN]), answer(regions=regions)) as server:
        viewer = PhotoInterview("desk", f"openai:fake-model@{server.url}", tmp_path / "kept")
        things = viewer.objects(PICTURES)
        found = viewer.regions([*PICTURES, *PICTURES], ["red", "blue"], things)
    assert [(t.class_name, t.extent) for t in things] == [("rubber duck", 0.1), ("soda can", 0.12)]
    assert things[0].sized_by.startswith("a model (openai:fake-model")
    assert found == [1, None]
    assert [request.pictures for request in server.requests] == [2, 4]
    assert "2. soda can: red, lying" in server.requests[1].text
    assert [row["task"] for row in viewer.asked().transcript] == ["things", "regions"]
    replayed = PhotoInterview("desk", f"replay:{tmp_path / 'kept'}")
    again = replayed.objects(PICTURES)
    assert [(t.class_name, t.extent) for t in again] == [(t.class_name, t.extent) for t in things]
    assert replayed.regions([*PICTURES, *PICTURES], ["red", "blue"], again) == [1, None]


def region(colour, thing):
    return PaintedRegion(colour=colour, thing=thing)


@pytest.mark.parametrize(
    ("regions", "told"),
    [
        ([region("red", 1)], "Answer once for each of these colours: red, blue."),
        ([region("red", 1), region("blue", 3)], "Things have numbers from 1 to 2."),
        ([region("red", 1), region("blue", 1)], "A thing can be one region only."),
    ],
)
def test_what_is_wrong_with_an_answer_is_reported(regions, told):
    assert regions_complaints(RegionsAnswer(regions=regions), ["red", "blue"], 2) == [told]


def test_a_scene_shows_something_and_not_too_much():
    assert things_complaints(ObjectsAnswer(things=[])) == ["Name 1 to 12 things; you named 0."]
    assert things_complaints(ObjectsAnswer(things=[DUCK])) == []
