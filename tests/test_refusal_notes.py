"""Who is refused hears what was noticed before: what was left out, why masks were doubted."""

import numpy as np
import pytest
from PIL import Image

from corporeal.cli import main
from corporeal.core.errors import UserError, notes_on_error
from corporeal.core.types import Gaussians
from corporeal.pipeline.stages import reconstruct
from corporeal.reconstruction import gaussian_source
from corporeal.reconstruction.gaussian_source import gaussians_from_source
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.sfm.find_poses import FoundPoses

DOUBTED = "No masks were grown from what all photographs show: it reaches beyond."
LEFT_OUT = "1 of 9 photographs do not fit the others and were left out: a.jpg."


def unheard(fraction, words):
    """Progress that nobody is told of."""


def notes_of(refusal):
    return list(refusal.value.__notes__)


def test_notes_follow_the_sentence_of_a_run_that_is_refused(tmp_path, monkeypatch, capsys):
    rng = np.random.default_rng(0)
    (tmp_path / "photos").mkdir()
    for k in range(5):
        picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
        Image.fromarray(picture).save(tmp_path / "photos" / f"{k}.png")
    (tmp_path / "photos" / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0 no more")
    monkeypatch.setattr("sys.argv", ["corporeal", "run", str(tmp_path / "photos")])
    monkeypatch.chdir(tmp_path)
    for _ in "found", "kept":
        with pytest.raises(SystemExit) as stopped:
            main()
        assert stopped.value.code == 2
        said = capsys.readouterr().err.splitlines()
        assert "5 photographs are too few" in said[-2] and said[-2].startswith("corporeal: ")
        assert said[-1].startswith("  Noticed before: 1 of 6") and "broken.jpg" in said[-1]


def test_masks_that_are_refused_say_what_was_doubted_before(tmp_path, monkeypatch):
    found = gaussian_source._MasksFound(None, (), (DOUBTED,), incomplete="not all of it can be told")
    monkeypatch.setattr(gaussian_source, "_find_source_poses", lambda *_: FoundPoses(tmp_path, (), (LEFT_OUT,)))
    monkeypatch.setattr(gaussian_source, "find_or_grow_masks", lambda *_: found)
    monkeypatch.setattr(gaussian_source, "pose_warnings", lambda _: ())
    with pytest.raises(UserError, match="not all of it can be told") as refusal:
        gaussians_from_source(tmp_path, ReconstructConfig(), None, unheard)
    assert notes_of(refusal) == [LEFT_OUT, DOUBTED]


def test_a_room_that_is_refused_says_why_masks_were_doubted(tmp_path, monkeypatch):
    none = np.zeros((0, 3))
    nothing = Gaussians(none, np.zeros((0, 4)), none, np.zeros(0), np.zeros((0, 1, 3)))
    taken = GaussianScene(nothing, warnings=(DOUBTED,))
    room = GaussianScene(nothing, masks=np.ones((4, 6, 8), bool))
    monkeypatch.setattr(reconstruct, "turn_upright", lambda *_: room)
    with pytest.raises(UserError, match="extend beyond the pictures") as refusal:
        reconstruct._align_upright(tmp_path, taken, ReconstructConfig(), None)
    assert notes_of(refusal) == [DOUBTED]


def test_nothing_is_added_to_mistakes_of_ours():
    with pytest.raises(ZeroDivisionError) as mistake, notes_on_error([DOUBTED]):
        _ = 1 / 0
    assert not hasattr(mistake.value, "__notes__")
