import errno
import json
import os
import threading
from contextlib import ExitStack
from dataclasses import dataclass, is_dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from corporeal.core import store, types
from corporeal.core.errors import UserError
from corporeal.core.types import (
    KIND_OF,
    STORED_KINDS,
    Finish,
    Hypothesis,
    Law,
    Material,
    MeasuredRange,
    PartDescription,
    Scene,
    SceneObject,
    Structure,
    Surface,
)


def a_scene():
    surface = Surface("s", 0, 0, np.eye(3), np.array([[0, 1, 2]]), extras={"substance": "steel"})
    picture = np.zeros((2, 2, 3), np.uint8)
    thing = SceneObject("box_0", "box", 1.0, velocity=(0.0, 0.0, -2.0))
    return Scene("s", "s.glb", (thing,), (surface,), (Finish("red", texture=picture),))


def test_a_scene_comes_back_as_it_was(tmp_path):
    store.save(tmp_path / "scene.npz", a_scene())
    again = store.load(tmp_path / "scene.npz")
    assert again.objects == a_scene().objects
    np.testing.assert_array_equal(again.surfaces[0].vertices, np.eye(3))
    assert again.surfaces[0].extras == {"substance": "steel"}
    assert again.finishes[0].texture.dtype == np.uint8


def test_enums_nothing_and_infinity_come_back(tmp_path):
    material = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0)
    store.save(tmp_path / "m.npz", {"m": material, "limit": float("inf")})
    again = store.load(tmp_path / "m.npz")
    assert again == {"m": material, "limit": float("inf")}


def test_what_is_filled_comes_back_with_its_contents(tmp_path):
    syrup = Material("syrup", Law.NEO_HOOKEAN, 1e4, 0.49, 1330.0)
    made = Structure("filled", 4e-4, "said", contents=syrup, fill=0.9)
    words = PartDescription("jar", "glass", "filled", contents="syrup", hypotheses=(Hypothesis("PET", "filled", 0.25),))
    store.save(tmp_path / "x.npz", {"made": made, "words": words})
    assert store.load(tmp_path / "x.npz") == {"made": made, "words": words}


STORED = [
    found
    for found in vars(types).values()
    if isinstance(found, type) and (is_dataclass(found) or issubclass(found, Enum))
]


def test_every_type_that_is_stored_has_a_kind_of_its_own():
    assert len(STORED) > 40
    assert {KIND_OF.get(kind) for kind in STORED} - {None} == set(STORED_KINDS)
    assert len(KIND_OF) == len(STORED_KINDS)
    # The kind of a note is stored with the note.
    assert {kind.__name__ for kind in STORED if kind not in KIND_OF} == {"NoteKind"}


def test_a_renamed_class_reads_what_was_stored_under_its_kind(tmp_path, monkeypatch):
    stuff = type("Stuff", (Material,), {})
    store.save(tmp_path / "m.npz", Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0))
    monkeypatch.setattr(store, "STORED_KINDS", STORED_KINDS | {"material": stuff})
    monkeypatch.setattr(store, "KIND_OF", KIND_OF | {stuff: "material"})
    again = store.load(tmp_path / "m.npz")
    assert type(again) is stuff and again.name == "steel"
    store.save(tmp_path / "n.npz", again)
    assert tree_of(tmp_path / "n.npz") == tree_of(tmp_path / "m.npz")
    assert tree_of(tmp_path / "n.npz")["fields"]["law"]["type"] == "law"


def tree_of(path):
    """What a file says of the structure of its value."""
    with np.load(path) as file:
        return json.loads(bytes(file[store.TREE_ARRAY]).decode())


def test_what_has_no_kind_is_not_stored(tmp_path):
    with pytest.raises(TypeError, match="Alien has no kind"):
        store.save(tmp_path / "x.npz", Alien())


def test_a_file_with_other_fields_or_kinds_is_named_in_one_sentence(tmp_path):
    for tree in ({"type": "wall", "fields": {"colour": {"value": 1}}}, {"type": "x", "fields": {}}):
        text = np.frombuffer(json.dumps(tree).encode(), np.uint8)
        np.savez(tmp_path / "x.npz", **{store.TREE_ARRAY: text})
        with pytest.raises(store.BadFileError, match="Delete the folder"):
            store.load(tmp_path / "x.npz")


@dataclass(frozen=True)
class Alien:
    """Not among the types that flow."""


def test_json_never_contains_nan(tmp_path):
    store.write_json(tmp_path / "x.json", {"a": np.float64("nan"), "b": [np.inf, 1]})
    assert store.read_json(tmp_path / "x.json") == {"a": None, "b": [None, 1]}


def test_a_damaged_result_is_named_in_one_sentence(tmp_path):
    store.save(tmp_path / "scene.npz", a_scene())
    data = (tmp_path / "scene.npz").read_bytes()
    (tmp_path / "scene.npz").write_bytes(data[: len(data) // 2])
    with pytest.raises(store.BadFileError, match="Delete the folder"):
        store.load(tmp_path / "scene.npz")


def test_a_folder_is_finished_only_once_it_says_so(tmp_path):
    name = store.result_key("fill", {"detail": "draft"}, ["abc"])
    store.begin_result(tmp_path)
    store.save(tmp_path / store.DATA_FILE, a_scene())
    assert not store.is_fresh(tmp_path, name)
    store.finish_result(tmp_path, name, {"detail": "draft"}, 1.0)
    assert store.is_fresh(tmp_path, name)
    assert not store.is_fresh(tmp_path, store.result_key("fill", {"detail": "fine"}, ["abc"]))


def test_a_full_disk_is_one_clear_error_and_leaves_no_half_file(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(store.DiskError, match="disk is full"):
        store.write_bytes(tmp_path / "video.mp4", b"x")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_of_a_folder_is_one_clear_error(tmp_path):
    (tmp_path / "runs").write_text("")
    for folder in (tmp_path / "runs", tmp_path / "runs" / "scene"):
        with pytest.raises(store.DiskError, match="a file is in its way"), store.lock_folder(folder):
            pass
    nowhere = Path("/proc/nowhere")
    with pytest.raises(store.DiskError, match="no folder can be made"), store.lock_folder(nowhere):
        pass


def test_a_range_knows_what_it_contains():
    assert 2.0 in MeasuredRange(1.0, 2.0, 3.0, "book")
    assert 4.0 not in MeasuredRange(1.0, 2.0, 3.0, "book")


def test_who_has_patience_waits_until_a_folder_is_let_go_of(tmp_path):
    with ExitStack() as held:
        held.enter_context(store.lock_folder(tmp_path))
        with pytest.raises(UserError, match="works in"), store.lock_folder(tmp_path, 0.1):
            pass
        let_go = threading.Event()
        folder = held.pop_all()
        folder.callback(let_go.set)  # what came last is called first
        threading.Timer(0.2, folder.close).start()
        with store.lock_folder(tmp_path, 120.0):
            assert let_go.is_set()
