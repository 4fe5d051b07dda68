"""Silhouettes of surfaces are those that masks show, or it is known how far they differ."""

import numpy as np
import pytest

from corporeal.geometry.mesh import Mesh
from corporeal.multiview.silhouette_overlap import compare_silhouettes, sample_meshes
from corporeal.render.camera_placement import camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, box, patterned, ring


@pytest.fixture(scope="module")
def seen():
    stage, aims = RayScene(patterned()), ring(np.arange(6) * 60, (320, 240))
    masks = [np.uint8(255) * (identify_triangles(stage, aim)[0] >= OF_SLAB) for aim in aims]
    return masks, tuple(camera_from_aim(aim) for aim in aims)


def block(scale=1.0):
    vertices, triangles, _ = box((-0.05, -0.04, 0), (0.05, 0.04, 0.12))
    return Mesh(vertices * scale, triangles)


def overlaps(mesh, seen):
    return compare_silhouettes([mesh], seen[1], seen[0], np.random.default_rng(0)).overlap


def test_the_right_surface_fills_its_masks_and_a_small_one_does_not(seen):
    assert overlaps(block(), seen).min() > 0.96
    small = overlaps(block(0.8), seen)
    assert 0.5 < small.min() and small.max() < 0.75, "0.64 of the area, a little off by perspective"


def test_what_is_no_object_at_all_overlaps_nothing(seen):
    mesh = block()
    away = Mesh(mesh.vertices + np.array([0.3, 0, 0]), mesh.triangles)
    assert overlaps(away, seen).max() < 0.1


def test_an_empty_mask_is_no_number(seen):
    masks = [np.zeros_like(seen[0][0]), *seen[0][1:]]
    found = compare_silhouettes([block()], seen[1], masks, np.random.default_rng(0)).overlap
    assert np.isnan(found[0]) and not np.isnan(found[1:]).any()


def test_points_fall_evenly_on_surfaces():
    points = sample_meshes([block()], 60_000, np.random.default_rng(0))
    top = points[:, 2] > 0.12 - 1e-9
    assert top.mean() == pytest.approx(0.008 / (2 * (0.008 + 0.012 + 0.0096)), rel=0.05)
    assert points[top][:, 0].mean() == pytest.approx(0, abs=1e-3)
