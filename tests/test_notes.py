"""A sentence keeps the kind that it was given where something was noticed."""

import copy
import pickle

import pytest

from corporeal.core import store
from corporeal.core.types import Inventory, Note, NoteKind, note_kind, note_kinds, notes_with_kinds, with_text
from corporeal.io.input_files import unused_nested_images_note
from corporeal.io.photos.image_loader import unusable_photos_notes
from corporeal.multiview.metric_scale import choose_metric_scale, scale_from_distance, scale_from_file
from corporeal.pipeline.stages.fill import name_objects
from corporeal.recognition.length_unit_inference import InferredUnit, unit_notes
from corporeal.recognition.typical_extents import extent_warning
from sample_scenes import scene

GONE = Note("a.jpg was left out.", NoteKind.LEFT_OUT)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda n: pickle.loads(pickle.dumps(n))])
def test_a_copy_has_the_kind(again):
    assert (again(GONE), note_kind(again(GONE))) == (GONE, NoteKind.LEFT_OUT)
    large = extent_warning("duck_0", "duck", 100.0)
    assert again(large).size_of == "duck_0"


def test_what_a_verb_keeps_has_the_kinds(tmp_path):
    store.save(tmp_path / "data.npz", Inventory((), warnings=(GONE, "It sinks.")))
    kept = store.load(tmp_path / "data.npz").warnings
    assert kept == (GONE, "It sinks.")
    assert note_kinds(kept) == (NoteKind.LEFT_OUT, NoteKind.DOUBT)
    large = extent_warning("duck_0", "duck", 100.0)
    store.save(tmp_path / "data.npz", Inventory((), warnings=(large,)))
    assert store.load(tmp_path / "data.npz").warnings[0].size_of == "duck_0"


def test_kinds_beside_plain_sentences_are_put_to_them_again():
    told = (GONE, "It sinks.", "It swims.")
    kinds = note_kinds(told)
    assert note_kinds(notes_with_kinds(tuple(map(str, told)), kinds)) == kinds
    assert note_kinds(notes_with_kinds(("It sinks.",), ())) == (NoteKind.DOUBT,)
    assert notes_with_kinds((), kinds) == ()


def test_another_text_has_the_same_kind_and_a_sentence_made_of_it_has_none():
    assert note_kind(with_text(GONE, f"can_0: {GONE}")) is NoteKind.LEFT_OUT
    assert note_kind(f"can_0: {GONE}") is NoteKind.DOUBT
    made = scene()
    (named,) = name_objects((Note("object 1 was made hollow.", NoteKind.ASSUMED),), made)
    assert note_kind(named) is NoteKind.ASSUMED


def test_each_is_of_the_kind_that_it_is_meant_to_be(tmp_path):
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "b.jpg").touch()
    unit = InferredUnit(tmp_path / "a.obj", 0.1, 0.01, "cm")
    measured = scale_from_distance((0, 0, 0), (2, 0, 0), 0.1)
    told = {
        NoteKind.ASSUMED: [
            extent_warning("duck_0", "duck", 100.0), *unit_notes([unit]), *choose_metric_scale(size=10.0).warnings
        ],
        NoteKind.LEFT_OUT: [
            *unusable_photos_notes(9, [("a.jpg", "is black")]),
            *unused_nested_images_note(tmp_path, [tmp_path / "a.jpg"]),
        ],
        NoteKind.GRAVE: [*choose_metric_scale(measured, (), scale_from_file("A capture"), ()).warnings],
    }  # fmt: skip
    for kind, notes in told.items():
        assert notes and note_kinds(notes) == (kind,) * len(notes)
