"""The verb: whole or not at all, one sentence for every mistake, nothing of the run changed."""

import errno
import json
import os
import resource
import shutil

import pytest

import corporeal as co
from corporeal.core import store
from corporeal.core.registry import load_function
from corporeal.export import export_scene as verb
from corporeal.export.export_target import EXPORT_WRITERS, read_record


def contents(folder):
    return {str(p.relative_to(folder)): p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}


def left(folder):
    """What lies in a folder beside what was finished."""
    return [p.name for p in folder.iterdir() if p.name.startswith(".") and p.name != store.LOCK_FILE]


def complaints(said):
    """What is said of a mistake, beside the verb that was begun."""
    lines = [line for line in said.err.splitlines() if line != "export"]
    return [line.removeprefix("corporeal: ") for line in lines]


@pytest.mark.slow
def test_a_run_is_exported_from_the_command_line(command, run_folder, tmp_path):
    before = contents(run_folder)
    out = tmp_path / "для других"
    code, said = command("export", run_folder, "--to", "usd", "mjcf", "urdf", "glb", "--out", out, "--check")
    assert code == 0, said.err
    assert contents(run_folder) == before
    record = read_record(out / "export.json")
    assert set(record.targets) == {"usd", "mjcf", "urdf", "glb"}
    for name, row in record.targets.items():
        assert row.files and not row.skipped
        assert all((out / f).is_file() for f in row.files)
        assert name in said.out
    assert record.targets["mjcf"].checked["mass_and_inertia_off"] < 1e-6
    assert left(out) == []


def test_without_a_place_it_goes_into_the_run(run_folder, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(run_folder, run)
    verb.export_scene(run, ["glb"])
    assert (run / "export" / "glb" / "video.glb").exists()
    # The run is none the staler for it.
    from corporeal.pipeline.run_pipeline import stage_states

    assert ("simulate", "finished") in {(s.verb, s.state) for s in stage_states(run)}


def test_the_same_run_gives_the_same_bytes(run_folder, tmp_path):
    for name in ("a", "b"):
        verb.export_scene(run_folder, ["usd", "mjcf", "urdf", "glb"], tmp_path / name)
    files = [p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file()]
    different = [f for f in files if (tmp_path / "a" / f).read_bytes() != (tmp_path / "b" / f).read_bytes()]
    assert [f.name for f in different if f.name != store.LOCK_FILE] == []


def test_what_has_no_word_in_a_format_is_skipped_with_a_sentence(command, run_folder, tmp_path):
    code, said = command("export", run_folder, "--to", "glb", "splats", "--out", tmp_path)
    assert code == 0
    assert "splats: The scene was made of surfaces" in said.out
    assert not (tmp_path / "splats").exists()


def test_where_nothing_can_be_written_it_fails(command, run_folder, tmp_path):
    code, said = command("export", run_folder, "--to", "splats", "--out", tmp_path)
    assert code == 2
    assert complaints(said) == ["The scene was made of surfaces: it has no Gaussians."]


MISTAKES = {
    "no such target": (("--to", "dwg"), "invalid choice"),
    "no such instant": (("--to", "glb", "--at", "9"), "--at is 9 s. The run lasts from 0 to 0.1 s"),
    "no tolerance": (("--to", "glb", "--tolerance", "0"), "--tolerance is 0 m. Give a length"),
}


@pytest.mark.parametrize(("words", "told"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_one_sentence(command, run_folder, tmp_path, words, told):
    code, said = command("export", run_folder, *words, "--out", tmp_path / "out")
    assert code == 2
    assert told in said.err + said.out
    assert not list(tmp_path.glob("out/*/*"))


def test_what_is_no_scene_is_reported(command, tmp_path):
    code, said = command("export", tmp_path / "absent", "--to", "glb")
    assert code == 2 and "No such file" in said.err


def test_a_run_without_matter_is_reported_with_how_to_go_on(command, run_folder, tmp_path):
    run = tmp_path / "a run"
    shutil.copytree(run_folder, run)
    (run / "7-fill" / "meta.json").unlink()
    code, said = command("export", run, "--to", "glb")
    assert code == 2
    # As a shell takes it, blanks and all.
    assert said.err.strip().endswith(f"has no particles yet. Next: corporeal fill '{run}'")


def test_a_scene_can_leave_before_it_was_simulated(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = co.build_scene(co.box("steel", (0.1, 0.1, 0.1), (0, 0, 0.05), name="cube"))
    co.write_glb(tmp_path / "сцена.glb", scene)
    record = verb.export_scene("сцена.glb", ["usd", "mjcf", "glb"])
    assert not any(row.skipped for row in record.targets.values())
    assert (tmp_path / "сцена-export" / "usd" / "sim.usda").exists()
    assert not (tmp_path / "сцена-export" / "usd" / "video.usda").exists()
    with pytest.raises(co.UserError, match="only start is known"):
        verb.export_scene("сцена.glb", ["usd"], config=verb.ExportConfig(at="end"))


# ---------------------------------------------------------------- nothing half-written


def broken(error):
    def write(asked, folder):
        (folder / "half.txt").write_text("half")
        raise error

    return write


@pytest.fixture
def breaking(monkeypatch):
    """Let the writer of GLB fail in the middle."""

    def set_(error):
        monkeypatch.setattr("corporeal.export.animated_glb_writer.write_animated_glb", broken(error))

    return set_


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "told"),
    [
        (errno.ENOSPC, "the disk is full. Free some space"),
        (errno.EROFS, "the disk is read-only. Choose another folder with --out"),
        (errno.EACCES, "permission denied. Choose another folder with --out"),
    ],
)
def test_a_disk_that_refuses_leaves_what_was_there(command, run_folder, tmp_path, breaking, number, told):
    out = tmp_path / "out"
    verb.export_scene(run_folder, ["glb"], out)
    before = contents(out / "glb")
    breaking(OSError(number, os.strerror(number)))
    code, said = command("export", run_folder, "--to", "glb", "--out", out)
    assert code == 2
    (complaint,) = complaints(said)
    assert told in complaint
    assert contents(out / "glb") == before
    assert left(out) == []


def test_a_file_that_may_not_grow_is_reported(command, run_folder, tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        code, said = command("export", run_folder, "--to", "usd", "--out", tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert code == 2 and "exceed the allowed size" in said.err
    assert not (tmp_path / "usd").exists() and left(tmp_path) == []


def test_a_file_in_the_way_is_reported(command, run_folder, tmp_path):
    (tmp_path / "out").write_text("mine")
    code, said = command("export", run_folder, "--to", "glb", "--out", tmp_path / "out")
    assert code == 2 and "a file is in its way" in said.err
    assert (tmp_path / "out").read_text() == "mine"


def test_what_a_killed_export_left_is_cleared_away(run_folder, tmp_path):
    verb.export_scene(run_folder, ["glb"], tmp_path)
    # Killed between the two renamings: the old folder is aside, the new one not yet there.
    (tmp_path / "glb").rename(tmp_path / ".glb.before")
    (tmp_path / ".glb.part").mkdir()
    (tmp_path / ".glb.part" / "half.glb").write_text("half")
    with pytest.raises(KeyboardInterrupt), store.whole_folder(tmp_path / "glb") as folder:
        (folder / "half.glb").write_text("half")
        raise KeyboardInterrupt
    assert [p.name for p in (tmp_path / "glb").iterdir()] == ["video.glb"]
    assert left(tmp_path) == []


def test_two_exports_at_once_do_not_mix(command, run_folder, tmp_path):
    with store.lock_folder(tmp_path):
        code, said = command("export", run_folder, "--to", "glb", "--out", tmp_path)
    assert code == 2 and "Another corporeal" in said.err


def test_a_missing_library_is_named_with_its_cure(command, run_folder, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "h5py", None)
    code, said = command("export", run_folder, "--to", "h5", "--out", tmp_path)
    assert code == 2
    cure = "HDF5 needs h5py. Install it with: pip install 'corporeal[export]'."
    assert complaints(said) == [cure]
    assert left(tmp_path) == []


def test_earlier_targets_stay_in_the_record(run_folder, tmp_path):
    verb.export_scene(run_folder, ["glb"], tmp_path)
    verb.export_scene(run_folder, ["npz"], tmp_path)
    assert set(read_record(tmp_path / "export.json").targets) == {"glb", "npz"}
    shutil.rmtree(tmp_path / "glb")
    verb.export_scene(run_folder, ["npz"], tmp_path)
    assert set(read_record(tmp_path / "export.json").targets) == {"npz"}


def test_the_menu_has_a_writer_for_every_target():
    for row in EXPORT_WRITERS.values():
        for place in filter(None, (row.write, row.check, row.write_dataset)):
            assert callable(load_function(place))


# ---------------------------------------------------------------- many scenes


@pytest.mark.slow
def test_a_corpus_becomes_one_data_set(run_folder, tmp_path):
    import numpy as np

    corpus = tmp_path / "corpus"
    (corpus / "runs").mkdir(parents=True)
    (corpus / "corpus.json").write_text("{}")
    for name in ("scene_0", "scene_1"):
        shutil.copytree(run_folder, corpus / "runs" / name)
    (corpus / "runs" / "unfinished").mkdir()
    record = verb.export_scene(corpus, ["npz", "glb"])
    assert record.targets["npz"].measured["runs"] == 2
    with np.load(corpus / "export" / "npz" / "train.npz", allow_pickle=True) as file:
        assert len(file["gns_data"]) == 2
    for name in ("scene_0", "scene_1"):
        assert (corpus / "export" / name / "glb" / "video.glb").exists()
        assert set(read_record(corpus / "export" / name / "export.json").targets) == {"glb"}
    assert "scene_0, scene_1" in json.dumps(record.targets["npz"].unsaid)


def test_a_corpus_without_a_finished_run_is_reported(command, tmp_path):
    (tmp_path / "corpus.json").write_text("{}")
    code, said = command("export", tmp_path, "--to", "npz")
    assert code == 2 and "has no finished run" in said.err
