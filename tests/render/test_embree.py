import numpy as np
import pytest
import trimesh

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.render.camera_placement import CameraAim, camera_axes, fit_camera
from corporeal.render.embree import identify_triangles, render_image
from corporeal.render.ray_scene import RayScene

SIZE = (96, 72)
RED = Finish("red", (0.8, 0.05, 0.05, 1.0), roughness=0.5)


def ball(centre=(0, 0, 0.5), radius=0.4, finish=0, normals=True, k=0):
    m = trimesh.creation.icosphere(subdivisions=3)
    v = np.asarray(m.vertices)
    faces, smooth = np.asarray(m.faces), v if normals else None
    return Surface(f"ball_{k}", k, finish, v * radius + centre, faces, smooth)


def sheet(y, finish, width=1.0):
    x = np.array([[-1, 0], [1, 0], [1, 1], [-1, 1]], float) * [width / 2, width]
    v = np.column_stack([x[:, 0], np.full(4, y), x[:, 1]])
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    return Surface("sheet", 0, finish, v, np.array([[0, 1, 2], [0, 2, 3]]), None, uv)


def scene(surfaces, finishes=(RED,)):
    count = max(s.object for s in surfaces) + 1 if surfaces else 0
    things = tuple(SceneObject(f"thing_{k}", "thing", 1.0) for k in range(count))
    return Scene("test", "here", things, tuple(surfaces), tuple(finishes))


def front(z=0.5, distance=3.0):
    return CameraAim((0.0, -distance, z + 0.3), (0.0, 0.0, z), 30.0, *SIZE)


def look(s, camera=None, quality="draft", **kwargs):
    return render_image(RayScene(s), camera or front(), quality, threads=2, **kwargs).astype(int)


def test_the_same_scene_gives_the_same_bytes_with_any_number_of_threads():
    s = RayScene(scene([ball()]))
    assert np.array_equal(render_image(s, front(), "draft", threads=1), render_image(s, front(), "draft", threads=3))


def test_a_ball_is_red_lit_from_above_and_stands_in_its_own_shadow():
    image = look(scene([ball()]))
    r, g, b = image[25, 48]
    assert r > 2 * g and r > 2 * b
    assert image[22, 48].sum() > image[45, 52].sum() + 60
    bare = look(scene([ball(radius=0.01, centre=(0, 0, 0.01))]), front())
    assert (bare - image)[50:].max() > 40, "the floor should be darker in the shadow"


def test_a_scene_looks_the_same_at_any_size_and_place():
    here = look(scene([ball()]))
    for factor, shift in ((1e-3, (0, 0, 0)), (1e4, (0, 0, 0)), (1.0, (5000.0, -800.0, 0))):
        b = ball()
        moved = Surface(b.name, 0, 0, b.vertices * factor + shift, b.triangles, b.normals)
        eye, target = (np.array(x) * factor + shift for x in (front().eye, front().target))
        there = look(scene([moved]), CameraAim(tuple(eye), tuple(target), 30.0, *SIZE))
        assert np.percentile(np.abs(there - here), 99) <= 4


def test_a_floating_object_without_normals_is_smooth_and_an_edge_stays_sharp():
    stage = RayScene(scene([ball(normals=False)]))
    smooth = render_image(stage, front(), "draft").astype(int)
    assert np.abs(smooth - look(scene([ball()]))).mean() < 0.5
    box = trimesh.creation.box((0.6, 0.6, 0.6))
    v = np.asarray(box.vertices) + np.array([0, 0, 0.5])
    image = look(scene([Surface("box", 0, 0, v, np.asarray(box.faces))]))
    top, side = image[22, 48], image[40, 48]
    assert top.sum() > side.sum() + 30


def test_texture_rows_run_down_as_in_gltf():
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:32] = (255, 0, 0)
    texture[32:] = (0, 0, 255)
    image = look(scene([sheet(0.0, 0)], [Finish("flag", texture=texture)]))
    assert image[24, 48, 0] > image[24, 48, 2] + 60
    assert image[46, 48, 2] > image[46, 48, 0] + 60


def test_a_texture_is_seen_in_its_own_colour():
    """Between sRGB and light and back nothing may shift: a mid grey stays grey, in order."""
    greys = []
    for level in (40, 120, 220):
        texture = np.full((8, 8, 3), level, np.uint8)
        greys.append(look(scene([sheet(0.0, 0)], [Finish("grey", texture=texture)]))[40, 48])
    assert np.all(np.diff([g.sum() for g in greys]) > 60)
    assert max(np.ptp(g) for g in greys) < 40


def test_holes_show_what_is_behind_and_let_the_sun_through():
    texture = np.full((64, 64, 4), 255, np.uint8)
    texture[:, 16:48, 3] = 0
    green = Finish("wall", (0.02, 0.7, 0.02, 1.0))
    leaf = Finish("leaf", texture=texture, alpha_mode="MASK")
    image = look(scene([sheet(0.0, 0), sheet(0.8, 1, 3.0)], [leaf, green]))
    r, g, b = image[36, 48]
    assert g > 1.5 * r and g > 1.5 * b
    r, g, b = image[36, 36]
    assert g < 1.2 * r


def test_glass_mixes_with_what_is_behind():
    green = Finish("wall", (0.02, 0.7, 0.02, 1.0))
    half = Finish("pane", (0.9, 0.05, 0.05, 0.5), alpha_mode="BLEND")
    image = look(scene([sheet(0.0, 0), sheet(0.8, 1, 3.0)], [half, green]))
    r, g, b = image[36, 48]
    assert r > b + 30 and g > b + 30


def test_no_triangle_breaks_the_picture():
    b = ball()
    v = np.vstack([b.vertices, [[np.nan] * 3, [0, 0, 0.2], [0, 0, 0.2]]])
    n = len(b.vertices)
    broken = np.array([[0, 0, 1], [n, 1, 2], [n + 1, n + 2, n + 1]])
    normals = np.vstack([b.normals, np.zeros((3, 3))])
    normals[5] = np.nan
    s = Surface("broken", 0, 0, v, np.vstack([b.triangles, broken]), normals)
    image = look(scene([s]))
    assert np.abs(image - look(scene([b]))).mean() < 3
    assert look(scene([])).std() > 1, "an empty stage still has its floor"


def test_moved_vertices_move_the_picture():
    stage = RayScene(scene([ball()]))
    before, _ = identify_triangles(stage, front())
    there = stage.posed(stage.vertices + stage.origin + np.array([0.3, 0, 0]), stage.normals)
    after, _ = identify_triangles(there, front())
    shift = np.nonzero(after >= 0)[1].mean() - np.nonzero(before >= 0)[1].mean()
    assert 10 < shift < 25


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("size", [(640, 480), (1280, 720), (300, 600)])
def test_the_camera_sees_everything_large_and_from_above_the_floor(scale, size):
    rng = np.random.default_rng(int(scale * 100))
    low = rng.random((6, 2, 3)) * scale
    boxes = np.stack([low, low + rng.random((6, 2, 3)) * scale], axis=2)
    camera = fit_camera(boxes, size)
    assert camera.eye[2] > 0
    p = boxes.reshape(-1, 3) - camera.eye
    local = p @ camera_axes(np.subtract(camera.eye, camera.target)).T
    flat = local[:, :2] / -local[:, 2:] / np.tan(np.radians(15)) / [size[0] / size[1], 1]
    assert (local[:, 2] < 0).all()
    assert np.abs(flat).max() < 0.9
    assert np.ptp(flat, axis=0).max() > 1.3, "the things should fill the picture"


def test_the_camera_stands_where_it_is_asked_to_but_never_under_the_floor():
    boxes = np.array([[[[-1, -1, 0], [1, 1, 1]]]], float)
    camera = fit_camera(boxes, (640, 480), view=(0.0, -1.0, -3.0))
    assert camera.eye[2] > 0 and camera.eye[1] < -1


def test_objects_in_a_row_are_not_seen_one_behind_the_other():
    low = np.array([[0.0, 0, 0], [0.8, -0.62, 0], [1.6, -1.24, 0]])
    boxes = np.stack([low, low + 0.5], axis=1)[None]
    camera = fit_camera(boxes, (640, 480))
    back = np.subtract(camera.eye, camera.target)
    assert abs(np.dot(back[:2], (0.8, -0.62))) / np.linalg.norm(back[:2]) < 0.97
