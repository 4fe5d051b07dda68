"""Colours change what is reflected, not what arrives."""

import numpy as np
import trimesh

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.render.camera_placement import fit_camera
from corporeal.render.embree import render_image
from corporeal.render.figures import render_recoloured
from corporeal.render.ray_scene import RayScene, StudioLight


def two_blocks():
    made = [trimesh.creation.box(bounds=[[0, k, 0], [0.7, k + 0.7, 0.7]]) for k in (0, 1)]
    surfaces = tuple(
        Surface(f"block_{k}", 0, 0, np.asarray(m.vertices), np.asarray(m.faces)) for k, m in enumerate(made)
    )
    return Scene("row", "", (SceneObject("row_0", "row", 1.0),), surfaces, (Finish("plain"),))


def test_pictures_in_several_sets_of_colours_are_those_that_are_rendered_alone():
    stage, rng = RayScene(two_blocks()), np.random.default_rng(0)
    count = len(stage.look.triangles)
    each = np.arange(count)
    stages = [stage.painted(rng.uniform(0.05, 0.9, (count, 3)), each, StudioLight()) for _ in range(3)]
    camera = fit_camera(stage.boxes()[None] + stage.origin, (96, 72))
    together = render_recoloured(stages, camera, "draft")
    for one, picture in zip(stages, together, strict=True):
        np.testing.assert_array_equal(picture, render_image(one, camera, "draft"))
    assert np.abs(together[0].astype(int) - together[1]).max() > 50
