import json
import resource
import subprocess
import sys

import numpy as np
import pytest

from corporeal import cli
from corporeal.core import store
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.core.version import __version__
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.render import figures

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
SMALL = ("--width", "160", "--height", "120")
FACES = np.array([t for a, b, c, d in QUADS for t in ([a, b, c], [a, c, d])])


def a_box(size=0.1, substance="rubber", height=0.05, **said):
    vertices = CORNERS * size + [0, 0, height]
    surface = Surface("box", 0, 0, vertices, FACES, extras={"substance": substance})
    thing = SceneObject("box_0", "box", size)
    return Scene("box", "", (thing,), (surface,), (Finish("red"),), duration=0.2, fps=30, **said)


@pytest.fixture
def typed(monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figures, "PANEL_SIZE_PX", (130, 98))
    return command


def refused(said, *words):
    """One line that contains the words, exit code 2, no traceback."""
    code, text = said
    assert code == 2, text.err
    complaint = [line for line in text.err.splitlines() if line.startswith("corporeal: ")]
    assert len(complaint) == 1, text.err
    assert "Traceback" not in text.err
    for word in words:
        assert word in complaint[0]


def test_a_box_falls_and_the_run_tells_everything(typed, tmp_path):
    write_glb(tmp_path / "box.glb", a_box())
    code, text = typed("run", "box.glb", *SMALL)
    assert code == 0, text.err
    folder = tmp_path / "runs" / "box"
    for name in ("video.mp4", "report.html", "materials.json", "audit.json", "strip.png"):
        assert (folder / name).stat().st_size > 500, name
    audit = json.loads((folder / "audit.json").read_text())
    assert audit["nan_count"] == 0
    assert audit["particles_out_of_domain"] == 0
    assert audit["max_penetration_dx"] < 1
    assert abs(audit["momentum_residual"]) < 1e-3
    page = (folder / "report.html").read_text()
    assert "data:video/mp4" in page
    assert "Young" in page
    assert json.loads((folder / "run.json").read_text())["state"] == "finished"

    before = (folder / "8-simulate" / store.META_FILE).stat().st_mtime_ns
    assert typed("run", "box.glb", *SMALL)[0] == 0
    assert (folder / "8-simulate" / store.META_FILE).stat().st_mtime_ns == before, "done twice"

    assert typed("video", "runs/box", "--width", "200", "--height", "150")[0] == 0
    assert not (folder / "report.html").exists(), "a stale report was left"
    code, text = typed("status", "runs/box")
    assert "not yet" in text.out or "unfinished" in text.out
    assert typed("report", "runs/box")[0] == 0
    assert (folder / "report.html").exists()


def test_a_run_says_in_the_terminal_what_it_was_taken_for_and_that_nothing_moves(typed, tmp_path):
    write_glb(tmp_path / "box.glb", a_box(height=0.0))
    code, text = typed("run", "box.glb", *SMALL)
    assert code == 0, text.err
    row = next(line for line in text.err.splitlines() if line.strip().startswith("box_0"))
    assert row.split()[:3] == ["box_0", "box", "rubber"]
    assert "hint: Nothing moves" in text.err and "--drop 0.5" in text.err
    page = (tmp_path / "runs" / "box" / "report.html").read_text()
    assert "Nothing moves: everything stands at rest" in page


def test_the_package_runs_as_a_module():
    said = subprocess.run([sys.executable, "-m", "corporeal", "--version"], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == __version__


def test_an_unknown_verb_shows_the_menu(typed):
    refused(typed("simulat"), "Unknown command", "simulate")


def test_a_missing_file_is_named(typed):
    refused(typed("run", "nowhere.glb"), "nowhere.glb")


def test_a_run_needs_a_scene(typed):
    refused(typed("run"), "scene")


def test_a_folder_that_is_not_there_is_reported_to_be_missing(typed):
    refused(typed("status", "runs/nowhere"), "runs/nowhere is not a run", "no such folder")


def test_a_folder_that_is_no_run_is_refused(typed, tmp_path):
    (tmp_path / "x").mkdir()
    refused(typed("video", "x"), "not a run")


@pytest.mark.parametrize("content", [b"", b"glTF", b"\0" * 100, b"{}", b"not a model at all"])
def test_a_file_that_is_no_scene_is_refused(typed, tmp_path, content):
    (tmp_path / "bad.glb").write_bytes(content)
    refused(typed("run", "bad.glb"), "bad.glb")
    assert not (tmp_path / "runs" / "bad" / "video.mp4").exists()
    assert json.loads((tmp_path / "runs" / "bad" / "run.json").read_text())["state"] == "failed"


def test_an_empty_directory_is_refused(typed, tmp_path):
    (tmp_path / "empty").mkdir()
    refused(typed("run", "empty"), "empty")


def test_a_mesh_without_volume_is_run_or_refused_in_one_line(typed, tmp_path):
    scene = a_box()
    point = Surface("dot", 0, 0, np.full((3, 3), 0.1), np.array([[0, 1, 2]]))
    write_glb(tmp_path / "dot.glb", Scene("dot", "", scene.objects, (point,), scene.finishes))
    refused(typed("run", "dot.glb"), "dot")


def test_an_annotation_for_a_part_that_is_not_there_names_those_that_are(typed, tmp_path):
    write_glb(tmp_path / "box.glb", a_box())
    (tmp_path / "a.yaml").write_text("box_0:\n  parts:\n    wheel: steel\n")
    refused(typed("run", "box.glb", "--annotations", "a.yaml"), "wheel", "box")


def test_an_unknown_material_in_an_annotation_shows_the_menu(typed, tmp_path):
    write_glb(tmp_path / "box.glb", a_box())
    (tmp_path / "a.yaml").write_text("box_0: unobtainium\n")
    refused(typed("run", "box.glb", "--annotations", "a.yaml"), "unobtainium", "steel")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--speed", "nan"), "--speed is nan"),
        (("--width", "100000"), "100000 × 720"),
        (("--view", "0", "0", "0"), "not a direction"),
        (("--seed", "-1"), "--seed is -1"),
        (("--position-weight", "nan"), "--position-weight is nan"),
        (("--extent", "box"), "NAME=METRES"),
        (("--neutral", "water"), "liquid"),
    ],
)
def test_settings_that_cannot_be_right_are_refused_before_anything_is_done(typed, tmp_path, words, told):
    write_glb(tmp_path / "box.glb", a_box())
    refused(typed("run", "box.glb", *words), told)
    assert not (tmp_path / "runs").exists()


def test_a_full_disk_is_reported_and_the_run_is_not_taken_for_finished(typed, tmp_path):
    write_glb(tmp_path / "box.glb", a_box())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        said = typed("run", "box.glb", *SMALL)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    refused(said, "Cannot write")
    assert json.loads((tmp_path / "runs" / "box" / "run.json").read_text())["state"] != "finished"
    assert typed("run", "box.glb", *SMALL)[0] == 0, "it goes on once there is room"


def test_the_doctor_examines_without_failing(typed):
    code, text = typed("doctor")
    assert code == 0
    assert "cpu engine" in text.out


def test_materials_can_be_listed_and_shown(typed):
    assert "steel" in typed("materials")[1].out
    assert "GPa" in typed("materials", "show", "steel")[1].out
    refused(typed("materials", "show", "unobtainium"), "unobtainium")


def test_help_is_there_for_every_verb(typed):
    for verb in cli.COMMANDS:
        code, text = typed(verb, "--help")
        assert code == 0
        assert verb in text.out


def test_the_model_is_named_in_one_word_and_what_is_missing_in_one_line(typed, tmp_path, monkeypatch):
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    write_glb(tmp_path / "box.glb", a_box())
    ask = ("run", "box.glb", "--view-size", 32, "--vlm")
    refused(typed(*ask, "ask:answers"), "questions wait in answers/questions", "type the same")
    refused(typed(*ask, "openai:gpt-5.4"), "set the environment variable OPENAI_API_KEY")
    refused(typed(*ask, "oracle:1"), "Choose one of: anthropic, ask, google, metadata, ollama")
    refused(typed(*ask, "replay:nowhere"), "No folder of recordings")


def test_what_cannot_be_asked_is_not_remembered(typed, tmp_path, monkeypatch):
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    write_glb(tmp_path / "box.glb", a_box())
    nobody = ("--vlm", "openai:gpt-5.4")
    refused(typed("run", "box.glb", *nobody), "OPENAI_API_KEY")
    assert not (tmp_path / "runs").exists()
    run_pipeline.run([tmp_path / "box.glb"], tmp_path / "box", Settings(), quietly, "ground")
    before = (tmp_path / "box" / "run.json").read_bytes()
    wrong = [
        ("run", "box.glb", "--out", ".", *nobody),
        ("describe", "box", *nobody),
        ("describe", "box", "--critic", "anthropic:x", "--views", 99),
        ("describe", "box", "--annotations", "nowhere.yaml"),
        ("ground", "box", "--library", "nowhere.toml"),
        ("ground", "box", "--floor", "moonlight"),
        ("run", "box.glb", "--out", ".", "--semantic", "bert"),
    ]
    for words in wrong:
        refused(typed(*words))
        assert (tmp_path / "box" / "run.json").read_bytes() == before, words
    assert {row.state for row in run_pipeline.stage_states(tmp_path / "box")[:4]} == {"finished"}
    assert typed("ground", "box")[0] == 0


def quietly(verb):
    return lambda fraction, words: None
