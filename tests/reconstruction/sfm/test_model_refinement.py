"""Which pictures were cropped, by their sizes; how far each was reduced."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from corporeal.reconstruction.sfm import model_refinement
from corporeal.reconstruction.sfm.model_refinement import cropped_cameras
from corporeal.reconstruction.sfm.prepare_images import MAX_PICTURE_PX, prepare_images


def model_of(sizes):
    """A model with a camera for each picture."""
    cameras = {k: SimpleNamespace(width=w, height=h) for k, (w, h) in enumerate(sizes)}
    images = {k: SimpleNamespace(camera_id=k) for k in cameras}
    return SimpleNamespace(cameras=cameras, images=images, reg_image_ids=lambda: list(images))


def test_pictures_that_a_camera_wrote_are_not_taken_for_cropped():
    assert cropped_cameras(model_of([(640, 480)] * 2 + [(480, 640)] + [(800, 600)] * 3)) == set()


def test_pictures_of_sizes_of_their_own_were_cropped():
    assert cropped_cameras(model_of([(640, 480)] * 9 + [(633, 471), (620, 466)])) == {9, 10}


def test_how_far_a_photograph_was_reduced_is_kept(tmp_path):
    rng = np.random.default_rng(0)
    for k, size in enumerate(
        [(MAX_PICTURE_PX * 2, MAX_PICTURE_PX), (MAX_PICTURE_PX, 900), (MAX_PICTURE_PX * 2, MAX_PICTURE_PX * 4)]
    ):
        noise = Image.fromarray(rng.integers(0, 256, (30, 40, 3), np.uint8))
        noise.resize(size).save(tmp_path / f"{k}.jpg", quality=40)
    for k in range(3, 6):
        noise = rng.integers(0, 256, (300, 400, 3), np.uint8)
        Image.fromarray(noise).save(tmp_path / f"{k}.png")
    kept = prepare_images(tmp_path, tmp_path / "made", lambda share, words: None)
    assert kept.reduced == (0.5, 1.0, 0.25, 1.0, 1.0, 1.0)


def test_a_point_that_passed_behind_a_camera_is_not_counted(tmp_path, monkeypatch):
    """Its reprojection error may be any number: 3e150 px in the mean of a model's 1257 points."""
    pycolmap = pytest.importorskip("pycolmap")
    model = pycolmap.Reconstruction()
    lens = {"model": "SIMPLE_RADIAL", "width": 40, "height": 30, "params": [40.0, 20.0, 15.0, 0.0]}
    model.add_camera_with_trivial_rig(pycolmap.Camera(**lens, camera_id=1))
    points = np.array([[0.1, 0.0, 2.0], [0.0, 0.2, 3.0]])
    for k in range(4):
        eye = np.array([0.1 * k, 0.0, 0.0])
        pixel = 40 * (points - eye)[:, :2] / points[:, 2:] + [20, 15]
        image = pycolmap.Image(f"{k}.png", pixel, camera_id=1, image_id=k + 1)
        pose = pycolmap.Rigid3d(np.column_stack([np.eye(3), -eye]))
        model.add_image_with_trivial_frame(image, pose)
        Image.fromarray(np.zeros((30, 40), np.uint8)).save(tmp_path / f"{k}.png")
    for k, point in enumerate(points):
        track = pycolmap.Track()
        for image in range(1, 5):
            track.add_element(image, k)
        model.add_point3D(point, track, np.zeros(3, np.uint8))
    behind = np.array([[0.1, 0.0, 2.0], [0.0, 0.2, -1e-9]])
    monkeypatch.setattr(model_refinement, "solve_bundle", lambda bundle, exact: replace(bundle, points=behind))
    model_refinement.adjust_bundle_by_edges(pycolmap, model, tmp_path)
    assert model.num_points3D() == 1
    assert model.compute_mean_reprojection_error() < 1e-6
