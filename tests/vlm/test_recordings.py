import json
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import pytest

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.vlm import AnswerSchema, Question, VlmClient, connect_vlm
from corporeal.vlm.recordings import RecordingClient, write_recording

ASKED = Question("materials", "What is it made of?", "scene/duck_0", "4 views, 512 px")


class Colour(AnswerSchema):
    SCHEMA: ClassVar[str] = "colour/1"
    name: str


class Renamed(AnswerSchema):
    """The same fields under another name of the class, and with a docstring."""

    SCHEMA: ClassVar[str] = "colour/1"
    name: str


class Wider(AnswerSchema):
    SCHEMA: ClassVar[str] = "colour/2"
    name: str
    sure: bool = True


def test_a_recorded_answer_comes_back(tmp_path):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    model = connect_vlm(f"replay:{tmp_path}")
    assert isinstance(model, VlmClient)
    assert model.ask(ASKED, Colour).answer.name == "red"


def test_a_recording_does_not_go_stale_with_the_pictures(tmp_path):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    import numpy as np

    seen = replace(ASKED, pictures=(np.zeros((2, 2, 3), np.uint8),))
    assert connect_vlm(f"replay:{tmp_path}").ask(seen, Colour).answer.name == "red"


@pytest.mark.parametrize("field", ["task", "prompt_version", "scene", "views"])
def test_a_mismatch_names_the_field_that_differs(tmp_path, field):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    other = replace(ASKED, **{field: "something else"})
    with pytest.raises(UserError, match=f"differs in '{field}'.*something else"):
        connect_vlm(f"replay:{tmp_path}").ask(other, Colour)


VERSIONED = replace(ASKED, prompt_version="colour/1", facts={"parts": "seat, legs", "count": "4"})


def test_a_reworded_prompt_of_the_same_version_finds_its_recording(tmp_path):
    write_recording(tmp_path, VERSIONED, Colour(name="red"), "some-model")
    reworded = replace(VERSIONED, prompt="Of what is it made?")
    assert connect_vlm(f"replay:{tmp_path}").ask(reworded, Colour).answer.name == "red"
    another = replace(VERSIONED, prompt_version="colour/2")
    with pytest.raises(UserError, match=r"another wording.*'prompt_version'.*colour/1.*colour/2"):
        connect_vlm(f"replay:{tmp_path}").ask(another, Colour)


def test_other_facts_in_a_prompt_are_another_question_and_the_first_is_named(tmp_path):
    write_recording(tmp_path, VERSIONED, Colour(name="red"), "some-model")
    other = replace(VERSIONED, facts={"parts": "seat", "count": "4"})
    with pytest.raises(UserError, match="differs in 'parts': recorded 'seat, legs', asked 'seat'"):
        connect_vlm(f"replay:{tmp_path}").ask(other, Colour)


def test_a_prompt_without_a_version_is_named_by_its_text(tmp_path):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    with pytest.raises(UserError, match=r"differs in 'prompt_version'.*Of what is it made"):
        connect_vlm(f"replay:{tmp_path}").ask(replace(ASKED, prompt="Of what is it made?"), Colour)


def test_a_class_of_answers_may_be_renamed(tmp_path):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    assert connect_vlm(f"replay:{tmp_path}").ask(ASKED, Renamed).answer.name == "red"


def test_a_new_shape_of_answer_never_replays_an_old_one(tmp_path):
    write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    with pytest.raises(UserError, match="differs in 'schema'"):
        connect_vlm(f"replay:{tmp_path}").ask(ASKED, Wider)


def test_answers_to_an_older_wording_are_refused_in_one_sentence(tmp_path):
    old = (Path(__file__).parent / "wording_2026_11" / "materials.md").read_text(encoding="utf-8")
    write_recording(tmp_path, replace(ASKED, prompt=old), Colour(name="red"), "some-model")
    new = old.replace("What is each of its parts made of", "What may each of its parts be made of")
    with pytest.raises(UserError) as refused:
        connect_vlm(f"replay:{tmp_path}").ask(replace(ASKED, prompt=new), Colour)
    said = str(refused.value).replace(str(tmp_path), "FOLDER")
    assert said.startswith("The answers in FOLDER are to another wording of the questions (")
    assert said.endswith("): record them again, or use --vlm metadata.")


def test_what_is_not_a_recording_is_named(tmp_path):
    (tmp_path / "notes.json").write_text(json.dumps({"task": "materials"}))
    with pytest.raises(UserError, match=r"notes.json: is not a recording"):
        connect_vlm(f"replay:{tmp_path}")
    (tmp_path / "notes.json").write_text("{")
    with pytest.raises(UserError, match=r"notes.json: is not a recording"):
        connect_vlm(f"replay:{tmp_path}")


def test_an_answer_that_does_not_fit_is_refused(tmp_path):
    path = write_recording(tmp_path, ASKED, Colour(name="red"), "some-model")
    row = json.loads(path.read_text())
    path.write_text(json.dumps(row | {"answer": {"name": 7}}))
    with pytest.raises(UserError, match="its answer does not fit: name"):
        connect_vlm(f"replay:{tmp_path}").ask(ASKED, Colour)


def test_lists_are_put_into_the_text_and_a_longer_one_does_not_make_an_answer_stale(tmp_path):
    asked = replace(ASKED, prompt="One of: {names}.", lists={"names": "red, blue"})
    assert asked.text == "One of: red, blue."
    path = write_recording(tmp_path, asked, Colour(name="red"), "some-model")
    assert json.loads(path.read_text())["lists"] == {"names": "red, blue"}
    longer = replace(asked, lists={"names": "red, blue, green"})
    model = connect_vlm(f"replay:{tmp_path}")
    assert model.ask(longer, Colour).answer.name == "red"
    with pytest.raises(UserError, match="does not fit: no longer offered"):
        model.ask(longer, Colour, lambda said: ["no longer offered"])


def test_a_recorder_keeps_what_it_passes_on(tmp_path):
    write_recording(tmp_path / "old", ASKED, Colour(name="red"), "some-model")
    recorder = RecordingClient(connect_vlm(f"replay:{tmp_path / 'old'}"), tmp_path / "new")
    assert recorder.ask(ASKED, Colour).answer.name == "red"
    again = connect_vlm(f"replay:{tmp_path / 'new'}").ask(ASKED, Colour)
    assert (again.answer.name, again.by, again.model) == ("red", "recording", "some-model")


def test_no_model_is_a_choice_and_an_unknown_name_shows_the_menu(tmp_path):
    assert connect_vlm("metadata") is None
    with pytest.raises(UnknownChoiceError, match="Choose one of: anthropic, ask, google, metadata"):
        connect_vlm("oracle")
    with pytest.raises(UserError, match="No folder of recordings"):
        connect_vlm(f"replay:{tmp_path}/nowhere")
