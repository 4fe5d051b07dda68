"""Normals of meshes that come without."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Surface
from corporeal.geometry.crease_normals import add_crease_normals


def surface(shape, **given):
    return Surface("thing", 0, 0, np.array(shape.vertices), np.array(shape.faces), **given)


def normals(one):
    assert one.normals is not None
    return one.normals


def volume(one):
    a, b, c = (one.vertices[one.triangles[:, k]] for k in range(3))
    return float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6


def test_a_box_has_six_normals_and_edges_between_them():
    made = add_crease_normals(surface(trimesh.creation.box((0.1, 0.2, 0.3))))
    assert len(made.vertices) == 24
    assert len(np.unique(np.round(normals(made), 6), axis=0)) == 6
    assert np.allclose(np.abs(normals(made)).max(axis=1), 1.0)
    assert volume(made) == pytest.approx(0.006)


def test_a_ball_is_smooth_all_over():
    shape = trimesh.creation.icosphere(3, 0.5)
    made = add_crease_normals(surface(shape))
    assert len(made.vertices) == len(shape.vertices)
    assert np.einsum("vi,vi->v", normals(made), made.vertices / 0.5).min() > 0.999


def test_the_side_of_a_cylinder_is_round_and_its_caps_are_flat():
    made = add_crease_normals(surface(trimesh.creation.cylinder(0.1, 0.4, sections=24)))
    upright = np.abs(normals(made)[:, 2])
    flat = upright > 0.999
    assert (flat | (upright < 1e-6)).all()
    side = normals(made)[~flat, :2]
    assert np.allclose(side, made.vertices[~flat, :2] / 0.1, atol=0.07)


def test_a_crowd_of_triangles_at_one_point_has_an_end():
    made = add_crease_normals(surface(trimesh.creation.cone(0.1, 0.3, sections=3000)))
    assert np.allclose(np.linalg.norm(normals(made), axis=1), 1.0)


def test_what_a_vertex_carries_goes_with_its_copies():
    shape = trimesh.creation.box((1, 1, 1))
    uv, colours = np.arange(16.0).reshape(8, 2), np.arange(24.0).reshape(8, 3) / 24
    made = add_crease_normals(surface(shape, uv=uv, colours=colours))
    was = [np.flatnonzero((shape.vertices == row).all(axis=1))[0] for row in made.vertices]
    assert made.uv is not None and made.colours is not None
    assert np.array_equal(made.uv, uv[was])
    assert np.array_equal(made.colours, colours[was])


def test_normals_of_the_file_are_kept():
    bare = surface(trimesh.creation.box((1, 1, 1)))
    dressed = replace(bare, normals=np.ones((8, 3)) / np.sqrt(3))
    assert add_crease_normals(dressed) is dressed
