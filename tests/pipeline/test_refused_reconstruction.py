"""What somebody is told whose photographs do not say what the thing is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud, Gaussians, Reconstruction, Views
from corporeal.pipeline.run_files import sort_warnings
from corporeal.pipeline.stages import reconstruct as stage
from corporeal.reconstruction.found_objects import FoundObjects
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.masks.grown_masks import describe_masks_in
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.surface.closed_surface import ClosedSurface
from corporeal.reconstruction.surface.object_surfaces import ObjectSurfaces
from corporeal.render.camera_placement import cameras_around

ONE = Gaussians(
    np.zeros((1, 3), np.float32),
    np.float32([[1, 0, 0, 0]]),
    np.ones((1, 3), np.float32),
    np.ones(1, np.float32),
    np.zeros((1, 1, 3), np.float32),
)

NONE = np.zeros((0, 3))
NOTHING = FeatureCloud(NONE, NONE, NONE, NONE, np.zeros(0, int))


@pytest.mark.parametrize("doubted", [True, False])
def test_who_must_give_masks_hears_where_doubted_ones_lie(tmp_path, monkeypatch, doubted):
    """Of a bottle hung before shelves these had .91 of the true masks, and nobody was told."""
    taken = GaussianScene(ONE)
    room = np.ones((4, 6, 8), np.bool_)
    monkeypatch.setattr(stage, "gaussians_from_source", lambda *_: (taken, False))
    monkeypatch.setattr(stage, "turn_upright", lambda *_: replace(taken, masks=room))
    if doubted:
        (tmp_path / "doubted" / "masks").mkdir(parents=True)
    with pytest.raises(UserError, match="would extend beyond the pictures") as said:
        stage.reconstruct(Path("photos"), ReconstructConfig(), folder=tmp_path)
    place = tmp_path / "doubted"
    assert (f"lie in {place / 'masks'}: check and correct them" in str(said.value)) == doubted
    assert str(said.value).endswith(f"--masks {place}.") == doubted


def test_who_must_correct_grown_masks_hears_where_they_lie(tmp_path):
    assert describe_masks_in(None) == describe_masks_in(tmp_path) == ""
    (tmp_path / "doubted" / "masks").mkdir(parents=True)
    assert f"rejected, lie in {tmp_path / 'doubted' / 'masks'}" in describe_masks_in(tmp_path)
    (tmp_path / "masks").mkdir()
    assert f"colours lie in {tmp_path / 'masks'}" in describe_masks_in(tmp_path), "those that were used"
    assert describe_masks_in(tmp_path).endswith(f"--masks {tmp_path}.")


def test_where_shapes_are_made_up_is_read_first_and_reported_before_a_refusal(tmp_path, monkeypatch):
    """It was the ninth warning of a helmet before a wall; the terminal shows five."""
    half = "Its shape is known from one side only: there is no other."
    doubted = Reconstruction(
        ONE, np.zeros(1, int), NOTHING, np.zeros(0, int), (), np.zeros((0, 2, 3)), 1.0, np.eye(4),
        warnings=("It has no size.", half), doubts=(half,),
    )  # fmt: skip
    others = ("What is it?", *doubted.warnings)
    assert sort_warnings(doubted, others) == (half, "What is it?", "It has no size.")
    assert sort_warnings(None, others[:1]) == others[:1]

    taken = replace(GaussianScene(ONE), doubts=(half,))
    room = replace(taken, masks=np.ones((4, 6, 8), np.bool_))
    monkeypatch.setattr(stage, "gaussians_from_source", lambda *_: (taken, False))
    monkeypatch.setattr(stage, "turn_upright", lambda *_: room)
    with pytest.raises(UserError, match="would extend beyond") as said:
        stage.reconstruct(Path("photos"), ReconstructConfig(), folder=tmp_path)
    assert half in said.value.__notes__


def test_who_goes_on_without_masks_hears_where_doubted_ones_lie(tmp_path, monkeypatch):
    """Of a box of sugar these had .93 of the true masks, its surface .83: nothing named them."""
    cut = np.zeros((4, 60, 80), np.bool_)
    cut[:, 20:40, 30:50] = True
    views = Views(np.zeros((*cut.shape, 3), np.uint8), ())
    room = GaussianScene(ONE, views=views, masks=cut, coloured=cut)
    (tmp_path / "doubted" / "masks").mkdir(parents=True)
    monkeypatch.setattr(stage, "gaussians_from_source", lambda *_: (GaussianScene(ONE), False))
    monkeypatch.setattr(stage, "turn_upright", lambda *_: room)
    monkeypatch.setattr(stage, "cameras_around", lambda *_: ())
    went_on = []
    monkeypatch.setattr(stage, "foreground_of", lambda _, taken: went_on.append(taken) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        stage.reconstruct(Path("photos"), ReconstructConfig(), folder=tmp_path)
    (said,) = went_on[0].doubts
    assert "Without masks" in said and said.endswith(f"--masks {tmp_path / 'doubted'}.")


@pytest.mark.parametrize(("count", "refused"), [(None, True), (2, False)])
def test_two_pieces_seen_from_one_side_are_believed_if_two_were_stated(monkeypatch, count, refused):
    """Apart from each other, either may be a piece of the wall behind."""
    views = cameras_around(np.eye(3), 20, (8, 6))[:10]
    mesh = trimesh.creation.box()
    solid = ClosedSurface(np.asarray(mesh.vertices), np.asarray(mesh.faces), np.zeros((8, 3)), np.zeros(8, int), 0.1)
    taken = GaussianScene(ONE, masks=np.ones((len(views), 6, 8), np.bool_))
    found = FoundObjects(taken, NOTHING, ObjectSurfaces((solid, solid), np.zeros(1, int), np.zeros(0, int)))
    for other in ("boxes_rejection_reason", "overlap_rejection_reason"):
        monkeypatch.setattr(stage, other, lambda *_, **__: None)
    monkeypatch.setattr(
        "corporeal.reconstruction.surface.reconstruction_acceptance.widest_unseen_angle", lambda _: 200.0
    )
    assert (stage._reason_not_worth(found, views, False, count) is not None) == refused
    assert stage._reason_not_worth(found, views, True, None) is None, "somebody gave masks"
