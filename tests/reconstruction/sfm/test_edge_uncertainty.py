"""Points on straight edges, such as gaps between planks, which are found anywhere along them."""

from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from corporeal.core.types import Camera
from corporeal.reconstruction.sfm.model_refinement import adjust_bundle, adjust_bundle_by_edges, whitening_matrices
from corporeal.render.camera_placement import camera_from_aim
from patterned_scene import pose_errors, ring

COUNT, SIZE, PLANK = 10, (320, 240), 0.05
EXACT, ALONG = 0.2, 3.0
"""How far points are off across and along an edge [px]."""


def striped(angle, side=64):
    """A picture of planks whose edges lie at an angle to its rows."""
    y, x = np.indices((side, side))
    return 128 + 100 * np.sin((y * np.cos(angle) - x * np.sin(angle)) * 0.6)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.2])
def test_an_error_counts_along_an_edge_for_less(angle):
    white = whitening_matrices(striped(angle), np.array([[30.0, 34.0]]))[0]
    edge, normal = (np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)]))
    assert np.linalg.norm(white @ normal) == pytest.approx(1.0, abs=0.02)
    assert np.linalg.norm(white @ edge) < 0.3


def test_errors_count_alike_where_there_is_no_edge():
    rng = np.random.default_rng(0)
    white = whitening_matrices(rng.uniform(0, 255, (64, 64)), rng.uniform(16, 48, (50, 2)))
    lengths = np.linalg.svd(white, compute_uv=False)
    assert lengths[:, 0] == pytest.approx(1.0) and np.median(lengths[:, 1]) > 0.85
    assert whitening_matrices(np.full((9, 9), 7.0), np.full((1, 2), 4.0))[0] @ [1, 2] == pytest.approx([1, 2])


def floor_of(camera: Camera):
    """Where on the floor each pixel looks (H, W, 2)."""
    y, x = np.indices((camera.height, camera.width)) + 0.5
    ray = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(camera.K).T
    ray = ray @ camera.world_from_camera[:3, :3].T
    eye = camera.world_from_camera[:3, 3]
    return (eye - ray * (eye[2] / ray[..., 2:]))[..., :2]


@pytest.fixture
def planked(tmp_path):
    """A model of a floor of planks from half around, points being off along their gaps."""
    pycolmap = pytest.importorskip("pycolmap")
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.2, 0.2, (250, 2)), np.zeros(250)])
    points[:, 2] = 0.03 * (np.arange(250) % 3 == 0)  # a third lies on planks that are higher
    true = [camera_from_aim(aim) for aim in ring(np.arange(COUNT) * 180 / COUNT, SIZE)]
    made = pycolmap.Reconstruction()
    focal, middle = true[0].K[0, 0], true[0].K[:2, 2]
    made.add_camera_with_trivial_rig(
        pycolmap.Camera(model="SIMPLE_RADIAL", width=SIZE[0], height=SIZE[1], params=[focal, *middle, 0.0], camera_id=1)
    )
    tracks = [pycolmap.Track() for _ in points]
    for k, camera in enumerate(true):
        grey = 128 + 100 * np.sin(2 * np.pi * floor_of(camera)[..., 0] / PLANK)
        Image.fromarray(grey.astype(np.uint8)).save(tmp_path / f"{k}.png")
        pose = np.linalg.inv(camera.world_from_camera)[:3]

        def seen(where, pose=pose):
            local = where @ pose[:, :3].T + pose[:, 3]
            return focal * local[:, :2] / local[:, 2:] + middle

        edge = seen(points + np.array([0, 1e-4, 0])) - seen(points)
        edge /= np.linalg.norm(edge, axis=1, keepdims=True)
        pixel = seen(points) + rng.normal(0, EXACT, (len(points), 2))
        pixel += edge * rng.normal(0, ALONG, (len(points), 1))
        image = pycolmap.Image(name=f"{k}.png", keypoints=pixel, camera_id=1, image_id=k + 1)
        made.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
        for n, track in enumerate(tracks):
            track.add_element(k + 1, n)
    for point, track in zip(points, tracks, strict=True):
        made.add_point3D(point, track)
    return SimpleNamespace(pycolmap=pycolmap, model=made, true=true, images=tmp_path)


def off(planked):
    """Median rotation [deg] and place of the model's cameras against the true ones."""
    found = []
    for number in range(1, COUNT + 1):
        pose = planked.model.images[number].cam_from_world().matrix()
        found.append(Camera(np.eye(3), np.linalg.inv(np.vstack([pose, [0, 0, 0, 1]])), *SIZE))
    return np.array([np.median(error) for error in pose_errors(found, planked.true)])


def test_points_that_slide_along_edges_do_not_turn_cameras(planked):
    adjust_bundle(planked.pycolmap, planked.model)
    before = off(planked)
    adjust_bundle_by_edges(planked.pycolmap, planked.model, planked.images)
    assert (off(planked) < 0.75 * before).all()
