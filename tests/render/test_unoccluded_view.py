"""The video looks from where things can be seen."""

import numpy as np
import pytest
import trimesh

import corporeal as co
from corporeal.render.ray_scene import RayScene
from corporeal.render.unoccluded_view import unoccluded_view

SIZE = (160, 120)
BOWL = [(0, 0), (0.04, 0), (0.08, 0.02), (0.12, 0.09), (0.115, 0.09), (0.077, 0.026), (0, 0.006)]


def bowl(material="steel"):
    """An open bowl that is 24 cm wide and 9 cm high."""
    turned = trimesh.creation.revolve(np.array(BOWL), sections=32)
    return co.solid(material, turned.vertices, turned.faces, name="bowl")


def looked_for(scene):
    """The direction for a scene that stands still, and the sine of its height."""
    owner = np.repeat([s.object for s in scene.surfaces], [len(s.vertices) for s in scene.surfaces])
    boxes = []
    for k in range(len(scene.objects)):
        all_ = np.concatenate([s.vertices for s in scene.surfaces if s.object == k])
        boxes.append([all_.min(axis=0), all_.max(axis=0)])
    return unoccluded_view([RayScene(scene)], owner, np.array([boxes]), SIZE)


def test_what_lies_in_a_bowl_is_shown_from_above():
    scene = co.build_scene(bowl(), co.ball("glass", radius=0.012, at=(0.02, 0, 0.019)))
    view = looked_for(scene)
    assert view is not None and np.degrees(np.arcsin(view[2])) > 30


@pytest.mark.parametrize("count", [1, 2])
def test_what_stands_free_is_shown_as_usual(count):
    things = [co.box("wood", (0.1, 0.1, 0.1), at=(0, 0.3 * k, 0.05)) for k in range(count)]
    assert looked_for(co.build_scene(*things)) is None


def test_what_lies_under_a_table_is_not_looked_for_from_above():
    top = trimesh.creation.box((0.6, 0.6, 0.02))
    top.apply_translation((0, 0, 0.29))
    legs = [trimesh.creation.box((0.02, 0.02, 0.28)) for _ in range(4)]
    for leg, (x, y) in zip(legs, [(1, 1), (1, -1), (-1, 1), (-1, -1)], strict=True):
        leg.apply_translation((0.28 * x, 0.28 * y, 0.14))
    table = trimesh.util.concatenate([top, *legs])
    solid = co.solid("wood", table.vertices, table.faces, name="table")
    scene = co.build_scene(solid, co.ball("rubber", radius=0.05, at=(0, 0, 0.05)))
    assert looked_for(scene) is None
