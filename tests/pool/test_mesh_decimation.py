"""Fewer triangles, the same shape, the same look."""

import numpy as np
import pytest

from corporeal.core.types import Scene
from corporeal.geometry.mesh import boundary_edges, signed_volume, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.pool.mesh_decimation import decimate_scene
from pool_models import ball, checks, scene

RADIUS = 0.1


@pytest.fixture(scope="module")
def dressed():
    """A textured ball of 22,200 triangles with a seam, and the same with 3,000."""
    vertices, triangles, uv = ball(75, RADIUS)
    picture = checks(512, 512)
    whole = scene(vertices, triangles, uv, picture, vertices / RADIUS)
    return whole, decimate_scene(whole, 3000)


def only(scene: Scene):
    (surface,) = scene.surfaces
    return surface


def test_as_many_triangles_as_asked_for_and_the_surface_stays_closed(dressed):
    few = only(dressed[1])
    assert 2900 <= len(few.triangles) <= 3000
    mesh, _ = weld_mesh(few.vertices, few.triangles)
    assert not len(boundary_edges(mesh)[0])
    assert signed_volume(mesh) == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=5e-3)


def test_no_vertex_is_farther_off_than_a_thousandth_of_the_size(dressed):
    many, few = (weld_mesh(only(s).vertices, only(s).triangles)[0] for s in dressed)
    assert QueryMesh(many).closest(few.vertices)[0].max() < 1e-3 * 2 * RADIUS
    assert QueryMesh(few).closest(many.vertices)[0].max() < 1.5e-3 * 2 * RADIUS


@pytest.mark.parametrize("unit", [1e-4, 1e4])
def test_the_unit_of_length_changes_nothing(unit):
    vertices, triangles, _ = ball(40)
    few, other = (only(decimate_scene(scene(vertices * u, triangles), 500)) for u in (1.0, unit))
    assert len(other.triangles) == pytest.approx(len(few.triangles), abs=4)
    volumes = [signed_volume(weld_mesh(s.vertices, s.triangles)[0]) for s in (few, other)]
    assert volumes[1] / unit**3 == pytest.approx(volumes[0], rel=1e-3)


def wanted_uv(points):
    """Texture coordinates that the ball was made with; u has a seam at angle 0."""
    u = np.arctan2(points[..., 1], points[..., 0]) / (2 * np.pi) % 1
    v = np.arccos(np.clip(points[..., 2] / np.linalg.norm(points, axis=-1), -1, 1)) / np.pi
    return np.stack([u, v], -1)


def off_pole(triangles_of_points):
    """Triangles away from the poles, where u means nothing."""
    return (np.abs(triangles_of_points[..., 2]) < 0.85 * RADIUS).all(axis=1)


def test_the_picture_stays_where_it_was(dressed):
    few = only(dressed[1])
    corners, uv = few.vertices[few.triangles], few.uv[few.triangles]
    kept = off_pole(corners)
    middle, expected = uv.mean(axis=1)[kept], wanted_uv(corners.mean(axis=1))[kept]
    off = np.abs((middle - expected + 0.5) % 1 - 0.5)
    assert np.median(off) < 1e-3
    assert off.max() < 0.03, "no more than a step across, beside the seam"


def test_no_triangle_smears_the_picture_across_its_seam(dressed):
    few = only(dressed[1])
    kept = off_pole(few.vertices[few.triangles])
    span = np.ptp(few.uv[few.triangles][kept], axis=1)
    assert span.max() < 0.2


def test_normals_stay_smooth_and_unit(dressed):
    few = only(dressed[1])
    np.testing.assert_allclose(np.linalg.norm(few.normals, axis=1), 1, atol=1e-6)
    outward = few.vertices / np.linalg.norm(few.vertices, axis=1, keepdims=True)
    cosine = np.einsum("nk,nk->n", few.normals, outward)
    assert np.quantile(cosine, 0.01) > np.cos(np.radians(3))


def test_vertices_are_shared_where_they_look_the_same(dressed):
    few = only(dressed[1])
    assert len(few.vertices) < 0.75 * len(few.triangles)


def test_a_surface_of_loose_triangles_is_welded_first():
    """Exporters that share nothing must not end as confetti."""
    vertices, triangles, _ = ball(40)
    loose = scene(vertices[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3))
    few = only(decimate_scene(loose, 800))
    assert 700 <= len(few.triangles) <= 800
    assert not len(boundary_edges(weld_mesh(few.vertices, few.triangles)[0])[0])


def test_triangles_are_shared_out_as_they_were():
    from dataclasses import replace

    vertices, triangles, _ = ball(40)
    many = scene(vertices, triangles)
    small, least, _ = ball(20)
    two = replace(only(many), vertices=small + 1, triangles=least)
    speck = replace(only(many), vertices=np.eye(3), triangles=np.array([[0, 1, 2]]))
    few = decimate_scene(replace(many, surfaces=(only(many), two, speck)), 1600)
    counts = [len(s.triangles) for s in few.surfaces]
    assert sum(counts) <= 1600
    assert counts[0] / counts[1] == pytest.approx(len(triangles) / len(least), rel=0.05)
    assert counts[2] == 1, "what has next to nothing keeps it"


def test_a_scene_that_is_small_enough_stays_as_it_is():
    vertices, triangles, uv = ball(10)
    whole = scene(vertices, triangles, uv)
    assert only(decimate_scene(whole, 10_000)) is only(whole)
