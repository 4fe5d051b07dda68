"""Posed views: pictures, depths, normals and numbers must agree with the cameras."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.photos.transforms_json import read_views
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.render.camera_placement import fibonacci_directions

WHITE = Finish("white", (0.8, 0.8, 0.8, 1.0))
RED = Finish("red", (0.9, 0.02, 0.02, 1.0))
SMALL = CaptureConfig(views=9, size=(96, 80), threads=2)
HALF = np.array([0.3, 0.2, 0.2])
CENTRE = np.array([0.1, -0.2, 0.2])
BALL = np.array([-0.45, 0.35, 0.5])


def surface(mesh, k, finish=0, **more):
    vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
    return Surface(f"surface {k}", k, finish, vertices, triangles, **more)


def box():
    made = trimesh.creation.box(2 * HALF)
    made.apply_translation(CENTRE)
    return surface(made, 0)


def ball(radius=0.06):
    made = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    made.apply_translation(BALL)
    return surface(made, 1, 1)


def scene(*surfaces, finishes=(WHITE, RED)):
    count = max(s.object for s in surfaces) + 1
    things = tuple(SceneObject(f"thing_{k}", "thing", 1.0) for k in range(count))
    return Scene("views", "by hand", things, tuple(surfaces), finishes)


@pytest.fixture(scope="module")
def views():
    return capture(scene(box(), ball()), SMALL)


def rays(camera):
    """World directions (H, W, 3) per metre of depth through the middles of the pixels."""
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    pixels = np.stack([u, v, np.ones_like(u)], axis=-1)
    return pixels @ np.linalg.inv(camera.K).T @ camera.world_from_camera[:3, :3].T


def points(views, k):
    """What the pixels of a view show [m]; inf or nan where nothing."""
    camera = views.cameras[k]
    with np.errstate(invalid="ignore"):
        return camera.world_from_camera[:3, 3] + rays(camera) * views.depth[k][..., None]


def project(camera, x):
    local = np.linalg.inv(camera.world_from_camera) @ [*x, 1.0]
    u, v, w = camera.K @ local[:3]
    return np.array([u / w, v / w]), w


# ---------------------------------------------------------------- cameras and pictures agree


def test_a_point_is_seen_where_its_camera_says(views):
    """The red ball's middle of mass in the picture is its projection, to half a pixel."""
    for k, camera in enumerate(views.cameras):
        if (views.object_of_pixel[k] == 1).sum() < 20:
            continue
        r, g, b = np.moveaxis(views.rgb[k].astype(float), -1, 0)
        redness = np.clip(r - np.maximum(g, b) - 40, 0, None)
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        seen = np.array([(redness * x).sum() / redness.sum() for x in (u, v)])
        wanted, depth = project(camera, BALL)
        # Half of it may hide behind the box.
        whole = np.pi * (camera.K[0, 0] * 0.06 / depth) ** 2
        if (views.object_of_pixel[k] == 1).sum() > 0.97 * whole:
            np.testing.assert_allclose(seen, wanted, atol=0.5)


def test_the_ball_is_seen_whole_by_most_cameras(views):
    sizes = [(views.object_of_pixel[k] == 1).sum() for k in range(SMALL.views)]
    wholes = [np.pi * (c.K[0, 0] * 0.06 / project(c, BALL)[1]) ** 2 for c in views.cameras]
    assert sum(a > 0.97 * b for a, b in zip(sizes, wholes, strict=True)) >= SMALL.views - 2


def test_depth_leads_back_to_the_surfaces(views):
    """Each pixel's point lies on the box, the ball or the floor, to 10 µm of a 1 m scene."""
    for k in range(SMALL.views):
        x, owner = points(views, k), views.object_of_pixel[k]
        on_box = np.abs(np.abs(x[owner == 0] - CENTRE) - HALF).min(axis=1)
        assert on_box.max() < 1e-5
        assert (np.abs(x[owner == 0] - CENTRE) <= HALF + 1e-5).all()
        radius = np.linalg.norm(x[owner == 1] - BALL, axis=1)
        assert (radius < 0.06 + 1e-5).all()
        assert (radius > 0.06 * np.cos(np.radians(4))).all()  # facets cut below the sphere


def test_a_corner_falls_on_the_pixel_whose_depth_leads_to_it(views):
    """Within a pixel's footprint sideways, and within 1 mm in depth."""
    corner = CENTRE + HALF * [0, 0, 1]  # middle of the top face: every camera sees it
    for k, camera in enumerate(views.cameras):
        (u, v), depth = project(camera, corner)
        found = points(views, k)[int(v), int(u)]
        assert abs(found[2] - corner[2]) < 1e-5
        (u2, v2), _ = project(camera, found)
        assert np.hypot(u2 - u, v2 - v) <= np.sqrt(0.5) + 1e-3
        near = camera.world_from_camera[:3, 2] @ (found - corner)
        slope = abs(camera.world_from_camera[2, 2])
        assert abs(near) <= depth / camera.K[0, 0] / slope + 1e-3


def test_the_depth_of_the_floor_is_analytic(views):
    for k, camera in enumerate(views.cameras):
        floor = (views.part_of_pixel[k] < 0) & np.isfinite(views.depth[k])
        assert floor.sum() > 500
        exact = -camera.world_from_camera[2, 3] / rays(camera)[..., 2]
        np.testing.assert_allclose(views.depth[k][floor], exact[floor], rtol=3e-5)


def test_above_the_horizon_there_is_nothing():
    low = capture(scene(box()), replace(SMALL, views=40, size=(40, 40)))
    k = 39
    sky = rays(low.cameras[k])[..., 2] > 0
    assert sky.any()
    assert np.isinf(low.depth[k][sky & (low.part_of_pixel[k] < 0)]).all()
    assert (low.normals[k][~np.isfinite(low.depth[k])] == 0).all()


def test_normals_are_unit_and_face_the_camera(views):
    for k, camera in enumerate(views.cameras):
        seen = np.isfinite(views.depth[k])
        n = views.normals[k][seen]
        np.testing.assert_allclose(np.linalg.norm(n, axis=-1), 1, atol=1e-5)
        assert ((n * rays(camera)[seen]).sum(axis=-1) < 0).all()
        on_box = views.normals[k][views.object_of_pixel[k] == 0]
        np.testing.assert_allclose(np.abs(on_box).max(axis=1), 1, atol=1e-6)
        floor = seen & (views.part_of_pixel[k] < 0)
        np.testing.assert_array_equal(views.normals[k][floor], [[0, 0, 1]] * floor.sum())
        x, ball = points(views, k), views.object_of_pixel[k] == 1
        out = (x[ball] - BALL) / 0.06
        assert ((views.normals[k][ball] * out).sum(axis=1) > 0.98).all()


def test_numbers_name_objects_and_surfaces():
    top = trimesh.creation.box((0.1, 0.1, 0.1))
    top.apply_translation([0.1, -0.2, 0.45])
    s = scene(box(), ball(), surface(top, 0, 1))
    made = capture(s, replace(SMALL, views=4))
    owner = np.array([0, 1, 0, -1])
    np.testing.assert_array_equal(made.object_of_pixel, owner[made.part_of_pixel])
    for k in range(4):
        assert {-1, 0, 1, 2} == set(np.unique(made.part_of_pixel[k]))


def test_one_looks_through_holes():
    """A leaf painted on a sheet hides only what it covers."""
    picture = np.zeros((64, 64, 4), np.uint8)
    picture[..., 3] = 255
    picture[:, 32:, 3] = 0
    leaf = Finish("leaf", texture=picture, alpha_mode="MASK")
    corners = np.array([[-0.5, 0, 0.4], [0.5, 0, 0.4], [0.5, 1, 0.4], [-0.5, 1, 0.4]])
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    sheet = Surface("leaf", 0, 0, corners, np.array([[0, 1, 2], [0, 2, 3]]), uv=uv)
    made = capture(scene(sheet, finishes=(leaf,)), replace(SMALL, views=3))
    for k in range(3):
        x = points(made, k)
        leafy = made.part_of_pixel[k] == 0
        assert leafy.sum() > 200
        assert (x[leafy][:, 0] < 0.02).all()
        below = (made.part_of_pixel[k] < 0) & np.isfinite(made.depth[k])
        np.testing.assert_allclose(x[below][:, 2], 0, atol=1e-3)


# ---------------------------------------------------------------- where cameras stand


def test_everything_is_in_every_picture(views):
    for k in range(SMALL.views):
        there = views.object_of_pixel[k] >= 0
        edge = np.concatenate([there[0], there[-1], there[:, 0], there[:, -1]])
        assert not edge.any()
        assert {0, 1} <= set(np.unique(views.object_of_pixel[k]))


def test_cameras_stand_above_the_floor_and_evenly():
    ways = np.array(fibonacci_directions(24))
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 1)
    assert ways[:, 2].min() > np.sin(np.radians(9))
    angle = np.degrees(np.arccos(np.clip(ways @ ways.T, -1, 1))) + 360 * np.eye(24)
    # 24 equal discs on this part of the sphere would be 26° apart.
    assert angle.min() > 18
    assert angle.min(axis=1).max() < 36


def test_cameras_are_rotations_that_look_down_at_the_scene(views):
    for camera in views.cameras:
        turn, eye = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) > 0.999
        assert eye[2] > 0.3
        ahead = turn[:, 2]
        assert ahead @ (CENTRE - eye) / np.linalg.norm(CENTRE - eye) > 0.95
        assert turn[2, 1] < 0, "y runs down"
        assert abs(turn[2, 0]) < 1e-12, "x is level"


# ---------------------------------------------------------------- light, dice, mistakes


def test_shadows_stay_in_place_from_view_to_view(views):
    """The floor's points have one brightness, whoever looks: what reconstruction relies on."""
    a, b = 0, 5
    x = points(views, a)
    floor = (views.part_of_pixel[a] < 0) & (np.abs(x[..., :2]).max(axis=-1) < 0.8)
    gaps = []
    for row, column in np.argwhere(floor):
        (u, v), depth = project(views.cameras[b], x[row, column])
        i, j = int(v), int(u)
        inside = 0 <= i < SMALL.size[1] and 0 <= j < SMALL.size[0]
        if inside and abs(views.depth[b, i, j] - depth) < 0.02:
            difference = views.rgb[a, row, column].astype(int) - views.rgb[b, i, j]
            gaps.append(np.abs(difference).max())
    assert len(gaps) > 300
    assert np.percentile(gaps, 90) <= 12
    shades = views.rgb[a][floor].astype(int).max(axis=-1)
    assert np.percentile(shades, 95) - np.percentile(shades, 2) > 60, "there is a shadow"


def test_the_same_scene_gives_the_same_views_on_any_number_of_threads(views):
    again = capture(scene(box(), ball()), replace(SMALL, threads=1))
    for name in ("rgb", "depth", "normals", "object_of_pixel", "part_of_pixel"):
        np.testing.assert_array_equal(getattr(again, name), getattr(views, name))


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (CaptureConfig(views=0), "at least 1 view"),
        (CaptureConfig(size=(4, 100)), "at least 8 × 8"),
        (CaptureConfig(views=1000, size=(4000, 3000)), "do not fit into memory"),
    ],
)
def test_senseless_wishes_are_refused(config, said):
    with pytest.raises(UserError, match=said):
        capture(scene(box()), config)


def test_a_scene_of_nothing_has_no_views():
    with pytest.raises(UserError, match="holds no surface"):
        capture(Scene("void", "", (), (), ()), SMALL)


# ---------------------------------------------------------------- the verb


def test_a_person_can_take_views_of_a_file(command, tmp_path):
    write_glb(tmp_path / "scene.glb", scene(box(), ball()))
    out = tmp_path / "views"
    words = ("capture", tmp_path / "scene.glb", "--out", out, "--views", 2, "--size", 24, 16)
    code, said = command(*words)
    assert (code, said.out.strip()) == (0, str(out / "transforms.json"))
    made = read_views(out)
    assert made.rgb.shape == (2, 16, 24, 3)
    assert {-1, 0, 1} == set(np.unique(made.object_of_pixel))


def test_a_scene_that_is_not_there_is_one_line(command, tmp_path):
    code, said = command("capture", tmp_path / "no.glb")
    assert code == 2
    assert "no.glb: there is no such file" in said.err
