"""Which pieces of a file that states no objects are things of their own."""

import numpy as np
import pytest

from corporeal.io.load_model import load_model
from corporeal.io.mesh.raw_mesh import MAX_PIECES
from glb_maker import Maker

UNDER, ON, BESIDE = (0, 0, 0), (0, 1, 0), (3, 0, 0)
"""Of unit cubes: the second stands on the first (glTF is +Y up), the third touches neither."""


def read(folder, name, *pieces):
    """A file of cubes: name and place of each, and its size."""
    made = Maker()
    mesh = made.mesh()
    for title, place, *size in pieces:
        made.node(name=title, mesh=mesh, translation=list(place), scale=list(size or (1, 1, 1)))
    return load_model(made.save(folder / name)).scene


def named(scene):
    return [o.name for o in scene.objects]


def test_what_touches_nothing_is_an_object_whatever_it_is_called(tmp_path):
    scene = read(tmp_path, "scene.glb", ("Cube", UNDER), ("Cube.001", ON), ("Sphere", BESIDE))
    assert named(scene) == ["cube_0", "sphere_0"]
    assert [o.real_extent for o in scene.objects] == pytest.approx([2, 1])
    assert [s.object for s in scene.surfaces] == [0, 0, 1]
    (said,) = scene.hints
    assert "scene.glb was split into 2 objects (cube_0, sphere_0)" in said
    assert "--objects one" in said


@pytest.mark.parametrize(
    ("file", "lower", "upper", "apart"),
    [
        ("scene.glb", "saucer", "cup", True),
        ("tea_set.glb", "tea_set_saucer_1", "tea_set_cup_1", True),
        ("scene.glb", "brick_1", "brick_2", True),
        ("bricks.glb", "brick_1", "brick_2", True),
        ("scene.glb", "teapot", "teapot_lid", False),
        ("bed.glb", "bed_1", "bed_2", False),
        ("scene.glb", "lamp glass", "lamp metal", False),
        ("chair.glb", "seat", "cushion", False),
        ("toy.glb", "car", "wheel", False),
        ("scene.glb", "Cube", "Cube.001", False),
    ],
)
def test_what_touches_is_one_unless_names_say_that_each_is_an_object(tmp_path, file, lower, upper, apart):
    scene = read(tmp_path, file, (lower, UNDER), (upper, ON))
    assert len(scene.objects) == 1 + apart


def test_what_stands_in_another_is_one_with_it(tmp_path):
    """As a plant in its pot; separate bodies there would burst apart."""
    scene = read(tmp_path, "scene.glb", ("pot", UNDER), ("plant", (0.25, 0.5, 0.25), 0.5, 1, 0.5))
    assert len(scene.objects) == 1


def test_a_gap_of_glue_is_none(tmp_path):
    """Models leave gaps between what is joined; strings hang over their guitar."""
    string = ("string", (0, 1.02, 0), 1, 0.01, 0.01)
    assert len(read(tmp_path, "scene.glb", ("body", UNDER), string).objects) == 1


def test_rods_that_cross_touch_though_their_corners_are_far(tmp_path):
    rods = ("a", (-2, 0, 0), 5, 0.1, 0.1), ("b", (0, 0.1, -2), 0.1, 0.1, 5)
    assert len(read(tmp_path, "scene.glb", *rods).objects) == 1


def test_what_a_file_states_stands(tmp_path):
    made = Maker()
    mesh = made.mesh()
    made.node(name="pair", mesh=mesh, extras={"class": "statue"})
    made.node(name="cat", mesh=mesh, translation=list(BESIDE), root=False)
    made.json["nodes"][0]["children"] = [1]
    scene = load_model(made.save(tmp_path / "scene.glb")).scene
    assert len(scene.objects) == 1 and scene.hints == ()


def test_a_machine_of_hundreds_of_pieces_stays_one(tmp_path):
    screws = [(f"m{k}", (3 * k, 0, 0)) for k in range(MAX_PIECES + 1)]
    assert len(read(tmp_path, "machine.glb", *screws).objects) == 1


def test_meshes_of_other_kinds_are_divided_alike(tmp_path):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = [[1, 2, 4], [1, 4, 3], [5, 7, 8], [5, 8, 6], [1, 5, 6], [1, 6, 2]]
    faces += [[3, 4, 8], [3, 8, 7], [1, 3, 7], [1, 7, 5], [2, 6, 8], [2, 8, 4]]
    text = []
    for k, name in enumerate(("crate", "barrel")):
        text += [f"o {name}", *(f"v {x + 3 * k} {y} {z}" for x, y, z in corners)]
        text += ["f " + " ".join(str(n + 8 * k) for n in face) for face in faces]
    (tmp_path / "scene.obj").write_text("\n".join(text))
    assert {*named(load_model(tmp_path / "scene.obj").scene)} == {"crate_0", "barrel_0"}
