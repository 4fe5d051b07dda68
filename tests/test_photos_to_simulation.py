"""The whole way from photographs: written as other programs do, run, killed, gone on with."""

import json
from functools import partial

import numpy as np
import pytest
from colmap_writer import write_colmap
from PIL import Image
from scipy.spatial.transform import Rotation

from corporeal.core import store
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.photos.transforms_json import write_views
from corporeal.multiview.similarity_transform import apply_similarity_to_cameras, similarity_matrix
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.reconstruction import gaussian_source
from corporeal.reconstruction.gaussians import train_gaussians, training_schedule
from corporeal.render import figures

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([t for a, b, c, d in QUADS for t in ([a, b, c], [a, c, d])])
SIDES = ((0.3, 0.2, 0.15), (0.1, 0.1, 0.2))
PLACES = ((0.0, 0.0, 0.0), (0.35, 0.05, 0.0))
NAMES = ("crate", "brick")
SMALL = ("--width", "128", "--height", "96", "--detail", "draft", "--training", "draft")
BRIEF = ("--duration", "0.05", "--fps", "20")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def views():
    """Photographs of a red crate and a blue brick beside it."""
    colours = ((0.6, 0.05, 0.04, 1.0), (0.05, 0.1, 0.6, 1.0))
    surfaces = tuple(Surface(name, k, k, CORNERS * SIDES[k] + PLACES[k], FACES) for k, name in enumerate(NAMES))
    things = tuple(SceneObject(n, n, max(s)) for n, s in zip(NAMES, SIDES, strict=True))
    finishes = tuple(Finish(n, c) for n, c in zip(NAMES, colours, strict=True))
    scene = Scene("pair", "", things, surfaces, finishes)
    return capture(scene, CaptureConfig(views=20, size=(128, 128)))


@pytest.fixture
def typed(monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(figures, "PANEL_SIZE_PX", (130, 98))
    monkeypatch.setitem(
        training_schedule.TRAINING_PRESETS, "draft", training_schedule.TrainingPreset(4000, 1, 300, 128)
    )
    return command


def colmap(folder, views, matrix):
    """Write photographs and masks with a COLMAP model, elsewhere, turned and in another unit."""
    names = tuple(f"{k:03}.png" for k in range(len(views.rgb)))
    for sub in ("images", "masks", "sparse"):
        (folder / sub).mkdir(parents=True)
    for name, rgb, owner in zip(names, views.rgb, views.object_of_pixel, strict=True):
        Image.fromarray(rgb).save(folder / "images" / name)
        Image.fromarray(np.uint8(255) * (owner >= 0)).save(folder / "masks" / name)
    write_colmap(folder / "sparse", apply_similarity_to_cameras(views.cameras, matrix), names)
    return folder


def test_photographs_become_a_video_of_objects_that_fall(typed, views, tmp_path):
    write_views(tmp_path / "photos", views)
    code, said = typed("run", "photos", "--object-names", *NAMES, "--drop", "0.3", "--fps", "12", *SMALL)
    assert code == 0, said.err
    run = tmp_path / "runs" / "photos"
    report, audit = (run / "report.html").read_text(), json.loads((run / "audit.json").read_text())
    assert "Gaussians were learned from 20 photographs" in report
    assert "discs were laid along the closed surface" in report
    assert (run / "video.mp4").stat().st_size > 1000
    assert (run / "0-reconstruct" / "gaussians.ply").stat().st_size > 10_000
    moved = audit["outcome"]["objects"]
    assert list(moved) == list(NAMES)
    assert all(-0.2 < o["moved_m"][2] < -0.02 for o in moved.values()), "they fell, to the floor"
    assert audit["nan_count"] == 0
    _, said = typed("status", run)
    assert "reconstruct" in said.out
    code, said = typed("reconstruct", run, "--count", "1")
    assert code == 2
    assert "--object-names names 2" in said.err


def test_a_colmap_model_gets_up_and_metres(typed, views, tmp_path):
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    moved = similarity_matrix(turn, 3.7, (5.0, -2.0, 1.0))
    colmap(tmp_path / "scan", views, moved)
    words = ("--object-names", *NAMES, "--extent", "crate=0.3", *BRIEF)
    code, said = typed("run", "scan", *words, *SMALL)
    assert code == 0, said.err
    found = store.load(tmp_path / "runs/scan/0-reconstruct/data.npz")
    # However the crate is turned about what is up. Pictures of 128 pixels: one is 4 mm wide.
    unit = np.cbrt(np.linalg.det((found.world_from_file @ moved)[:3, :3]))
    assert unit == pytest.approx(1, abs=0.08)
    parts = json.loads((tmp_path / "runs/scan/audit.json").read_text())["outcome"]["objects"]
    assert parts["brick"]["length_m"] == pytest.approx(0.2, abs=0.02)
    for name in NAMES:
        assert abs(parts[name]["moved_m"][2]) < 0.02, "it stood on the floor from the start"


def test_a_training_that_is_stopped_goes_on(typed, views, tmp_path, monkeypatch):
    """What comes of it to the last bit: see tests/reconstruction/gaussians/test_train_gaussians.py."""
    write_views(tmp_path / "photos", views)
    often = partial(training_schedule.TrainConfig, checkpoint_interval_s=0.0)
    monkeypatch.setattr(gaussian_source, "TrainConfig", often)
    steps, step = [], train_gaussians._step

    def stopping(training, *rest):
        steps.append(training.step)
        if len(steps) in (60, 63):
            raise KeyboardInterrupt
        return step(training, *rest)

    monkeypatch.setattr(train_gaussians, "_step", stopping)
    words = ("run", "photos", "--object-names", *NAMES, *BRIEF, *SMALL)
    for _ in range(2):
        code, _ = typed(*words)
        assert code == 130
    first = steps[60]
    assert first in (58, 59)
    assert steps[60:] == [first, first + 1, first + 2]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda folder: (folder / "transforms.json").write_text("{"), ("transforms.json",)),
        (lambda folder: [p.unlink() for p in (folder / "rgb").glob("*.png")], ("20 of 20",)),
    ],
)
def test_what_cannot_be_used_is_named(typed, views, tmp_path, spoil, words):
    write_views(tmp_path / "photos", views)
    spoil(tmp_path / "photos")
    code, said = typed("run", "photos", *SMALL)
    assert code == 2
    assert "Traceback" not in said.err
    for word in words:
        assert word in said.err
