"""Who is refused hears what was noticed before: what was left out, why masks were doubted."""

import numpy as np
import pytest
from PIL import Image

from corporeal.cli import main
from corporeal.core.errors import UserError, noticed
from corporeal.core.types import Gaussians
from corporeal.pipeline.stages import reconstruct
from corporeal.reconstruction import picture_intake
from corporeal.reconstruction.gaussians.intake import Intake
from corporeal.reconstruction.picture_intake import take_pictures
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.sfm.pose import Posed

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
    found = picture_intake._Masks(None, (), (DOUBTED,), incomplete="not all of it can be told")
    monkeypatch.setattr(picture_intake, "_posed", lambda *_: Posed(tmp_path, (), (LEFT_OUT,)))
    monkeypatch.setattr(picture_intake, "masks_for", lambda *_: found)
    monkeypatch.setattr(picture_intake, "doubt_of_poses", lambda _: ())
    with pytest.raises(UserError, match="not all of it can be told") as refusal:
        take_pictures(tmp_path, ReconstructConfig(), None, unheard)
    assert notes_of(refusal) == [LEFT_OUT, DOUBTED]


def test_a_room_that_is_refused_says_why_masks_were_doubted(tmp_path, monkeypatch):
    none = np.zeros((0, 3))
    nothing = Gaussians(none, np.zeros((0, 4)), none, np.zeros(0), np.zeros((0, 1, 3)))
    taken = Intake(nothing, warnings=(DOUBTED,))
    room = Intake(nothing, masks=np.ones((4, 6, 8), bool))
    monkeypatch.setattr(reconstruct, "turned_upright", lambda *_: room)
    with pytest.raises(UserError, match="go on beyond the pictures") as refusal:
        reconstruct._upright(tmp_path, taken, ReconstructConfig(), None)
    assert notes_of(refusal) == [DOUBTED]


def test_nothing_is_added_to_mistakes_of_ours():
    with pytest.raises(ZeroDivisionError) as mistake, noticed([DOUBTED]):
        _ = 1 / 0
    assert not hasattr(mistake.value, "__notes__")
