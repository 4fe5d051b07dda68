"""What is said of masses that cannot be, and of walls that only a drawing made so thick."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Scene, SceneObject, Surface
from corporeal.geometry.scene_transforms import scale_scene
from corporeal.pipeline.in_memory import prepare_scene
from sample_scenes import plain


def a_bin(wall):
    """Return a bin of 28 cm with a floor, drawn with both faces of its wall."""
    outer, tall = 0.14, 0.34
    profile = [(0, 0), (outer, 0), (outer, tall), (outer - wall, tall), (outer - wall, wall)]
    mesh = trimesh.creation.revolve([*profile, (0, wall)], sections=48)
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    surface = Surface("bin", 0, 0, points, triangles)
    thing = SceneObject("trash_can_0", "trash can", tall)
    return Scene("one-bin", "", (thing,), (surface,), (plain(),))


def said_of(scene, words):
    return [w for w in prepare_scene(scene).particles.warnings if words in w]


@pytest.fixture(scope="module")
def thick():
    return said_of(a_bin(0.009), "draws a wall")


def test_a_wall_drawn_thicker_than_any_of_its_material_is_reported(thick):
    (sentence,) = thick
    assert sentence.startswith("trash_can_0: the mesh of trash can draws a wall ")
    assert "0.64 to 3.8 mm, usually 1.5" in sentence
    assert "--annotations" in sentence


def test_a_wall_as_thick_as_such_walls_are_is_not():
    assert said_of(a_bin(0.004), "draws a wall") == []


def test_a_wall_is_judged_as_thick_as_it_is_in_life(thick):
    """A scene may show its things larger."""
    larger = scale_scene(a_bin(0.009), 10.0)
    assert larger.objects[0].scale == pytest.approx(10.0)
    assert said_of(larger, "draws a wall") == thick


def test_a_face_is_judged_as_large_as_it_is_in_life():
    mesh = trimesh.creation.icosphere(3, 0.31).apply_translation((0, 0, 0.31))
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    surface = Surface("ball", 0, 0, points, triangles)
    ball = Scene("one-ball", "", (SceneObject("ball_0", "ball", 0.62),), (surface,), (plain(),))
    (life,) = said_of(ball, "ball_0 weighs")
    assert "kg per square metre of its largest side" in life
    assert "a ball longer than 0.4 m has 0.5 to 5" in life
    assert said_of(scale_scene(ball, 0.1), "ball_0 weighs") == [life]
    golf = replace(ball.objects[0], class_name="golf ball")
    assert "cubic metre" in said_of(replace(ball, objects=(golf,)), "ball_0 weighs")[0]


def test_a_block_of_what_comes_in_sheets_is_reported():
    """A pouf of leather weighed 70 kg without a word; a strap is as thick as it is drawn."""
    for side, told in ((0.4, 1), (0.01, 0)):
        mesh = trimesh.creation.box((0.4, side, side)).apply_translation((0, 0, side / 2))
        points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
        surface = Surface("thing", 0, 0, points, triangles)
        thing = SceneObject("leather_thing_0", "leather thing", 0.4)
        scene = Scene("one", "", (thing,), (surface,), (plain(),))
        assert len(said_of(scene, "that comes in sheets of up to 5 mm")) == told
