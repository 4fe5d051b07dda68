"""What lies inside a mesh along parallel columns."""

import numpy as np
import pytest
import trimesh

from corporeal.geometry.mesh import Mesh, join_meshes, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import column_crossings, points_wound_around
from corporeal.geometry.rotation import matrix_from_quaternion

TURN = matrix_from_quaternion(np.array([0.9, 0.1, 0.2, 0.3]))


def shown(mesh):
    return Mesh(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64))


def asked(mesh, columns, layers):
    """Columns of a lattice and whether points in the middle of its cubes are found."""
    met = column_crossings(mesh.vertices, mesh.triangles, columns)
    count = columns.shape[0] * columns.shape[1]
    heights = np.tile(np.arange(layers) + 0.5, (count, 1))
    found = np.zeros((count, layers), bool)
    found[points_wound_around(met, heights)] = True
    places = np.concatenate([np.repeat(columns.reshape(-1, 1, 2), layers, axis=1), heights[..., None]], axis=-1)
    return met, found.reshape(-1), places.reshape(-1, 3)


@pytest.fixture
def columns(rng):
    return np.indices((40, 40)).transpose(1, 2, 0) + rng.uniform(0, 1, (40, 40, 2))


def test_a_column_that_enters_leaves_where_two_bodies_share_a_face(columns):
    """Rays that are shot one after the other miss the second of two faces in one plane."""
    lower, upper = (trimesh.creation.box((20, 20, 10)) for _ in range(2))
    upper.apply_translation((0, 0, 10))
    both = join_meshes([shown(lower), shown(upper)])
    welded, _ = weld_mesh(both.vertices @ TURN.T + 20, both.triangles, np.repeat([0, 1], 12))
    assert len(welded.triangles) == 24
    met, found, places = asked(welded, columns, 40)
    assert not met.open.any()
    assert np.array_equal(found, (np.abs((places - 20) @ TURN - [0, 0, 5]) < 10).all(axis=1))


def test_no_column_passes_between_triangles_even_on_their_edges():
    """Columns stand on the edges and corners of a body whose faces are cut along the lattice."""
    ball = shown(trimesh.creation.icosphere(3, 8.0))
    cube = shown(trimesh.creation.box((16, 16, 16)).subdivide().subdivide())
    on_lines = np.indices((20, 20)).transpose(1, 2, 0).astype(float)
    for mesh in (ball, cube):
        mesh = Mesh(mesh.vertices + 10, mesh.triangles)
        met, found, places = asked(mesh, on_lines, 20)
        assert not met.open.any()
        clear = QueryMesh(mesh).closest(places)[0] > 1e-6
        assert np.array_equal(found[clear], QueryMesh(mesh).inside(places)[clear])


def test_bodies_within_each_other_count_once_and_cavities_not_at_all(columns):
    shells = [shown(trimesh.creation.icosphere(3, r)) for r in (15.0, 10.0, 5.0)]
    around = join_meshes([shells[0], shells[1], shells[2]])
    hollow = join_meshes([shells[0], Mesh(shells[1].vertices, shells[1].triangles[:, ::-1])])
    for mesh, low in ((around, 0.0), (hollow, 10.0)):
        _, found, places = asked(Mesh(mesh.vertices + 20, mesh.triangles), columns, 40)
        radius = np.linalg.norm(places - 20, axis=1)
        assert found[(radius > low + 0.1) & (radius < 14.8)].all()
        assert not found[(radius < low - 0.3) | (radius > 15)].any()


def test_a_surface_that_is_wound_both_ways_is_reported(columns):
    ball = shown(trimesh.creation.icosphere(3, 15.0))
    lid = ball.corners[:, :, 2].min(axis=1) > 0
    turned = np.where(lid[:, None], ball.triangles[:, ::-1], ball.triangles)
    met, _, _ = asked(Mesh(ball.vertices + 20, turned), columns, 40)
    assert met.open.sum() == pytest.approx(np.pi * 15**2, rel=0.1)
