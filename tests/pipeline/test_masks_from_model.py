"""Masks by a model: of one thing, or of nothing."""

import numpy as np
import pytest

from corporeal.core.errors import BadFileError
from corporeal.core.types import Views
from corporeal.io.photos.transforms_json import write_views
from corporeal.reconstruction import masks_from_model as module
from corporeal.reconstruction.features.mask_models import MaskInstance
from corporeal.reconstruction.masks_from_model import masks_from_model, several_objects_reason
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.render.camera_placement import CameraAim, camera_from_aim

WIDE, HIGH, VIEWS = 64, 48, 12


@pytest.fixture
def cameras():
    turns = np.linspace(0, 2 * np.pi, VIEWS, endpoint=False)
    eyes = [(2 * np.cos(t), 2 * np.sin(t), 1.0) for t in turns]
    return tuple(camera_from_aim(CameraAim(e, (0.0, 0.0, 0.0), 40.0, WIDE, HIGH)) for e in eyes)


def disc(x, y, radius=9.0):
    row, column = np.mgrid[:HIGH, :WIDE]
    return np.hypot(column + 0.5 - x, row + 0.5 - y) < radius


def ball(k):
    """What a ball in the middle looks like from anywhere."""
    return disc(WIDE / 2, HIGH / 2)


def anything(k):
    """Something else in each picture, that pictures hold."""
    return disc(12 + 40 * (k % 2), 12 + 24 * (k // 2 % 2))


def half(k):
    """What random weights find: half of the picture, whose hull fills it from everywhere."""
    return np.arange(HIGH)[:, None] + np.zeros(WIDE) > HIGH / 2


def drawn(of):
    return np.stack([255 * of(k).astype(np.uint8) for k in range(VIEWS)])


def test_a_ball_is_one_object(cameras):
    why, share = several_objects_reason(drawn(ball), cameras)
    assert why is None and share > 0.95


@pytest.mark.parametrize(
    ("of", "said"), [(anything, "they contradict one another"), (half, "in 12 of 12 photographs they end at")]
)
def test_what_is_of_no_object_is_reported(cameras, of, said):
    why, _ = several_objects_reason(drawn(of), cameras)
    assert why is not None and said in why


class Finds:
    """Stands for a model."""

    needs_words = False

    def __init__(self, of):
        self.of, self.asked = of, 0

    def name(self):
        return f"found@{self.of.__name__}"

    def instances(self, picture, words, at):
        self.asked += 1
        return [MaskInstance(self.of(self.asked - 1), 0.9)]


@pytest.fixture
def asked(cameras, tmp_path, monkeypatch):
    rgb = np.random.default_rng(0).integers(0, 256, (VIEWS, HIGH, WIDE, 3), np.uint8)
    write_views(tmp_path / "photos", Views(rgb, cameras))

    def ask(of, **config):
        monkeypatch.setattr(module, "connect_mask_model", lambda spec: Finds(of))
        config = ReconstructConfig(masks="sam2:folder", **config)
        return masks_from_model(config, tmp_path / "photos", tmp_path / "run", lambda f, w: None)

    return ask


@pytest.mark.parametrize("of", [anything, half])
def test_nonsense_is_refused_with_where_it_lies_unless_forced(asked, of):
    """Half of each picture ended as "the poses do not agree", after a training."""
    with pytest.raises(BadFileError, match=r"found@.* are not of one object.*masks.*--force") as told:
        asked(of)
    assert any("were found by found@" in note for note in told.value.__notes__)
    folder, _, doubts = asked(of, force=True)
    assert (folder / "masks").is_dir() and "not of one object" in doubts[0]


def test_masks_of_an_object_are_taken_without_a_doubt(asked):
    _, said, doubts = asked(ball)
    assert not doubts and "12 of 12 photographs" in said[0] and "corrected there" in said[1]
