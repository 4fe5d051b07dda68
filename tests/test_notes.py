"""A sentence keeps the kind that it was given where something was noticed."""

import copy
import json
import pickle

import numpy as np
import pytest

from corporeal.core import store
from corporeal.core.types import Inventory, Note, NoteKind, kind_of, kinds_of, reworded, with_kinds
from corporeal.io.shots import left_out
from corporeal.io.sources import not_read_below
from corporeal.multiview.metric import chosen, of_distance, of_file
from corporeal.pipeline.stages.fill import by_name
from corporeal.recognition.likely_unit import LikelyUnit, sentences
from corporeal.recognition.typical_extents import doubt
from handmade import scene

GONE = Note("a.jpg was left out.", NoteKind.LEFT_OUT)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda n: pickle.loads(pickle.dumps(n))])
def test_a_copy_has_the_kind(again):
    assert (again(GONE), kind_of(again(GONE))) == (GONE, NoteKind.LEFT_OUT)
    large = doubt("duck_0", "duck", 100.0)
    assert again(large).size_of == "duck_0"


def test_what_a_verb_keeps_has_the_kinds(tmp_path):
    store.save(tmp_path / "data.npz", Inventory((), warnings=(GONE, "It sinks.")))
    kept = store.load(tmp_path / "data.npz").warnings
    assert kept == (GONE, "It sinks.")
    assert kinds_of(kept) == (NoteKind.LEFT_OUT, NoteKind.DOUBT)
    large = doubt("duck_0", "duck", 100.0)
    store.save(tmp_path / "data.npz", Inventory((), warnings=(large,)))
    assert store.load(tmp_path / "data.npz").warnings[0].size_of == "duck_0"


def test_what_was_kept_before_there_were_kinds_is_a_doubt(tmp_path):
    row = {"list": [{"value": "a.jpg was left out."}], "tuple": True}
    none = {"list": [], "tuple": True}
    tree = {"type": "Inventory", "fields": {"objects": none, "warnings": row}}
    np.savez(tmp_path / "data.npz", **{store.TREE: np.frombuffer(json.dumps(tree).encode(), "u1")})
    assert kinds_of(store.load(tmp_path / "data.npz").warnings) == (NoteKind.DOUBT,)


def test_kinds_beside_plain_sentences_are_put_to_them_again():
    told = (GONE, "It sinks.", "It swims.")
    kinds = kinds_of(told)
    assert kinds_of(with_kinds(tuple(map(str, told)), kinds)) == kinds
    assert kinds_of(with_kinds(("It sinks.",), ())) == (NoteKind.DOUBT,)
    assert with_kinds((), kinds) == ()


def test_another_text_has_the_same_kind_and_a_sentence_made_of_it_has_none():
    assert kind_of(reworded(GONE, f"can_0: {GONE}")) is NoteKind.LEFT_OUT
    assert kind_of(f"can_0: {GONE}") is NoteKind.DOUBT
    made = scene()
    (named,) = by_name((Note("object 1 was made hollow.", NoteKind.ASSUMED),), made)
    assert kind_of(named) is NoteKind.ASSUMED


def test_each_is_of_the_kind_that_it_is_meant_to_be(tmp_path):
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "b.jpg").touch()
    unit = LikelyUnit(tmp_path / "a.obj", 0.1, 0.01, "cm")
    measured = of_distance((0, 0, 0), (2, 0, 0), 0.1)
    told = {
        NoteKind.ASSUMED: [
            doubt("duck_0", "duck", 100.0), *sentences([unit]), *chosen(size=10.0).warnings
        ],
        NoteKind.LEFT_OUT: [
            *left_out(9, [("a.jpg", "is black")]), *not_read_below(tmp_path, [tmp_path / "a.jpg"])
        ],
        NoteKind.GRAVE: [*chosen(measured, (), of_file("A capture"), ()).warnings],
    }  # fmt: skip
    for kind, notes in told.items():
        assert notes and kinds_of(notes) == (kind,) * len(notes)
