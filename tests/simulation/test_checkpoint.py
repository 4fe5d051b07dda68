"""What is cut off goes on exactly as if nothing had happened, or begins again and says so."""

import logging
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from corporeal.simulation import checkpoint, trajectory_files
from corporeal.simulation.checkpoint import CHECKPOINT_FILE, PREVIOUS_CHECKPOINT_FILE, Checkpoints, fingerprint

STATE = {"place": np.arange(12.0).reshape(4, 3), "clock": np.float64(0.5)}


def a_folder(path, done):
    """A run with ``done`` frames."""
    for number in range(done):
        trajectory_files.write_arrays(trajectory_files.frame_path(path, number), {"time": np.float64(number)})
    return path


def kept(path, *dones, name="scene"):
    """Checkpoints after so many frames, written one after the other."""
    found = Checkpoints(a_folder(path, max(dones)), name)
    for done in dones:
        found.keep(STATE | {"done_too": np.array(done)}, done)
    return found


def test_the_newest_state_comes_back_bit_by_bit(tmp_path):
    newest = kept(tmp_path, 2, 5).newest()
    done, state = newest.done, newest.state
    assert done == 5
    assert state["done_too"] == 5
    for name, value in STATE.items():
        np.testing.assert_array_equal(state[name], value)


def test_there_are_never_more_than_two_and_none_at_the_end(tmp_path):
    found = kept(tmp_path, 1, 2, 3, 4)
    assert sorted(p.name for p in tmp_path.glob("*.npz")) == sorted([CHECKPOINT_FILE, PREVIOUS_CHECKPOINT_FILE])
    found.forget()
    assert not list(tmp_path.glob("*.npz"))


@pytest.mark.parametrize("harm", ["half", "empty", "flipped"])
def test_a_damaged_one_is_named_and_the_one_before_is_used(tmp_path, caplog, harm):
    found = kept(tmp_path, 2, 5)
    data = bytearray((tmp_path / CHECKPOINT_FILE).read_bytes())
    if harm == "flipped":
        data[data.index(STATE["place"].tobytes()) + 9] ^= 0x01
    (tmp_path / CHECKPOINT_FILE).write_bytes({"half": data[: len(data) // 2], "empty": b""}.get(harm, data))
    newest = found.newest()
    done, state = newest.done, newest.state
    assert done == 2
    assert state["done_too"] == 2
    assert CHECKPOINT_FILE in caplog.text
    assert "cannot be read" in caplog.text


def test_without_a_usable_one_it_begins_again_and_says_so(tmp_path, caplog):
    found = kept(tmp_path, 2, 5)
    for name in (CHECKPOINT_FILE, PREVIOUS_CHECKPOINT_FILE):
        (tmp_path / name).write_bytes(b"not a checkpoint")
    assert found.newest() == checkpoint.CheckpointState()
    assert len(caplog.records) == 2
    assert "starting again" in caplog.text


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_no_damage_is_taken_for_a_state(tmp_path_factory, data):
    logging.getLogger("corporeal.simulation.checkpoint").disabled = True
    path = tmp_path_factory.mktemp("harmed")
    found = kept(path, 1)
    whole = (path / CHECKPOINT_FILE).read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    harmed = bytearray(whole)
    harmed[place] ^= data.draw(st.integers(1, 255))
    (path / CHECKPOINT_FILE).write_bytes(harmed)
    newest = found.newest()
    done, state = newest.done, newest.state
    if done:  # a byte that nobody reads
        for name, value in STATE.items():
            np.testing.assert_array_equal(state[name], value)
    logging.getLogger("corporeal.simulation.checkpoint").disabled = False


def test_one_of_other_inputs_is_not_used(tmp_path, caplog):
    kept(tmp_path, 3)
    assert Checkpoints(tmp_path, "another scene").newest() == checkpoint.CheckpointState()
    assert "another scene or other settings" in caplog.text


def test_one_whose_frames_are_gone_is_not_used(tmp_path, caplog):
    found = kept(tmp_path, 2, 5)
    trajectory_files.frame_path(tmp_path, 3).unlink()
    assert found.newest().done == 2
    assert "frame 3 is missing" in caplog.text


def test_writing_them_takes_a_small_share_of_the_time(tmp_path, monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: clock[0])

    def slow(*_):
        clock[0] += 4.0

    monkeypatch.setattr(checkpoint, "write_arrays", slow)
    found = Checkpoints(tmp_path, "scene")
    clock[0] = 9.9
    assert not found.due
    clock[0] = 10.0
    assert found.due
    found.keep(STATE, 1)
    clock[0] += 79.0
    assert not found.due
    clock[0] += 1.0
    assert found.due


@dataclass(frozen=True)
class Thing:
    """Anything."""

    first: object
    second: object = None


def test_objects_have_the_same_name_only_when_they_are_the_same():
    long = np.arange(5000.0)
    changed = long.copy()
    changed[2500] += 1e-12
    things = [
        Thing(long), Thing(changed), Thing(long.astype(np.float32)), Thing(long.reshape(50, 100)),
        Thing((Thing(long),)), Thing((Thing(changed),)), Thing({"a": long}), Thing({"b": long}),
        Thing("ab", "c"), Thing("a", "bc"), Thing((1, 2), (3,)), Thing((1,), (2, 3)), Thing(None),
    ]  # fmt: skip
    names = [fingerprint(thing) for thing in things]
    assert len(set(names)) == len(names)
    assert fingerprint(Thing(long.copy())) == names[0]
