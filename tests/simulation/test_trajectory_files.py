"""Frames on disk say what was simulated."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from corporeal.core.errors import BadFileError
from corporeal.core.types import Frame
from corporeal.simulation.trajectory_files import (
    FrameLayout,
    FrameSequence,
    frame_path,
    gather_ledgers,
    read_arrays,
    read_trajectory,
    write_arrays,
    write_frame,
    write_layout,
)
from sample_ledger import ledger

LAYOUT = FrameLayout(object=np.array([0, 1, 1, 0, 2]), rigid=np.array([False, True, False]))


def written(folder, count=3):
    rng = np.random.default_rng(1)
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    write_layout(folder, LAYOUT)
    frames = []
    for k in range(count):
        deformation = np.eye(3) + 0.2 * rng.standard_normal((5, 3, 3))
        deformation[[1, 2]] = turn
        frame = Frame(time=k / 60, position=rng.standard_normal((5, 3)), deformation=deformation)
        write_frame(folder, k, frame, LAYOUT, ledger(frame.time, 3, kinetic=np.array([1.0, 2.0, k])))
        frames.append(frame)
    return frames


def test_what_is_written_is_read_back(tmp_path):
    frames = written(tmp_path)
    trajectory = gather_ledgers(tmp_path, 3)
    assert len(trajectory.frames) == 3
    for wrote, read in zip(frames, trajectory.frames, strict=True):
        assert read.time == wrote.time
        np.testing.assert_allclose(read.position, wrote.position, atol=1e-6)
        np.testing.assert_allclose(read.deformation, wrote.deformation, atol=2e-3)
    assert trajectory.ledger.kinetic.shape == (3, 3)
    assert trajectory.frames[-1].time == frames[-1].time
    assert [f.time for f in trajectory.frames[1:]] == [f.time for f in frames[1:]]


def test_a_rigid_objects_rotation_survives_exactly(tmp_path):
    written(tmp_path)
    R = gather_ledgers(tmp_path, 3).frames[0].deformation[1].astype(float)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-6)


def test_an_unfinished_or_damaged_trajectory_is_named(tmp_path):
    with pytest.raises(BadFileError, match="ledger"):
        read_trajectory(tmp_path)
    written(tmp_path)
    gather_ledgers(tmp_path, 3)
    frame_path(tmp_path, 1).write_bytes(b"PK\x03\x04 half a file")
    with pytest.raises(BadFileError, match="00001"):
        FrameSequence(tmp_path, 3)[1]


def test_a_frame_that_was_read_is_kept_as_long_as_there_is_room(tmp_path):
    written(tmp_path)
    size = sum(a.nbytes for a in read_arrays(frame_path(tmp_path, 0), without="ledger.").values())
    frames = FrameSequence(tmp_path, 3, 2 * size)
    before = [frame.position for frame in frames]
    frames[0].position[:] = np.nan
    for k in range(3):
        frame_path(tmp_path, k).unlink()
    assert all(np.array_equal(frames[k].position, before[k]) for k in range(2))
    with pytest.raises(BadFileError, match="00002"):
        frames[2]


@pytest.mark.parametrize("gone", ["overlap", "dt_max"])
def test_a_ledger_of_a_version_that_had_other_fields_is_refused_in_one_sentence(tmp_path, gone):
    written(tmp_path)
    gather_ledgers(tmp_path, 3)
    path = tmp_path / "ledger.npz"
    known = read_arrays(path)
    write_arrays(path, known | {"of_a_later_version": np.zeros(3)})
    assert read_trajectory(tmp_path).ledger.kinetic.shape == (3, 3)
    write_arrays(path, {name: array for name, array in known.items() if name != gone})
    with pytest.raises(BadFileError, match=f"without {gone}. Run corporeal simulate again"):
        read_trajectory(tmp_path)


def test_a_failed_write_leaves_no_file(tmp_path, monkeypatch):
    written(tmp_path, 1)

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="No space"):
        written(tmp_path / "other", 1)
    assert not [p for p in (tmp_path / "other").rglob("*") if p.is_file()]
