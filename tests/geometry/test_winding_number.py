"""The winding number by a plumb line and open edges."""

import igl
import numpy as np
import pytest
import trimesh

from corporeal.geometry.mesh import Mesh, join_meshes, weld_mesh
from corporeal.geometry.mesh_queries import MAX_OPEN_EDGES_BRUTE, QueryMesh
from corporeal.geometry.winding_number import unbalanced_edges, vertical_line_table, winding_without_table

BODIES = {
    "ball": trimesh.creation.icosphere(3),
    "box": trimesh.creation.box((1.5, 1.0, 0.5)),
    "ring": trimesh.creation.torus(0.8, 0.25),
    "tall": trimesh.creation.cylinder(0.02, 2.0),
}


def shown(mesh):
    return Mesh(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64))


def exact(mesh, points):
    """Sum of the solid angles of all faces."""
    found = igl.winding_number(mesh.vertices, mesh.triangles, points)
    return np.asarray(found).reshape(-1)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("missing", [0.0, 0.05, 0.6])
def test_it_is_the_sum_of_all_solid_angles(name, missing, rng):
    body = shown(BODIES[name])
    kept = rng.uniform(size=len(body.triangles)) >= missing
    mesh = body.only(kept) if kept.any() else body
    points = rng.uniform(-1.2, 1.2, (3000, 3))
    found = vertical_line_table(mesh).winding(points)
    assert np.abs(found - exact(mesh, points)).max() < 1e-9
    assert np.array_equal(winding_without_table(mesh, unbalanced_edges(mesh), points), found)


def test_faces_that_are_turned_or_doubled_count_as_often_as_they_are_there(rng):
    ball = shown(BODIES["ball"])
    turned = np.where((np.arange(len(ball.triangles)) % 7 == 0)[:, None], ball.triangles[:, ::-1],
                      ball.triangles)  # fmt: skip
    odd = Mesh(ball.vertices, np.concatenate([turned, turned[:50]]))
    points = rng.uniform(-1.2, 1.2, (3000, 3))
    assert np.abs(vertical_line_table(odd).winding(points) - exact(odd, points)).max() < 1e-9


def test_bodies_that_share_a_face_have_no_open_edge(rng):
    lower, upper = shown(BODIES["box"]), shown(BODIES["box"])
    upper = Mesh(upper.vertices + np.array([0, 0, 0.5]), upper.triangles)
    both = join_meshes([lower, upper])
    mesh, _ = weld_mesh(both.vertices, both.triangles, np.repeat([0, 1], 12))
    assert not len(unbalanced_edges(mesh)[0])
    points = rng.uniform(-1, 1, (2000, 3))
    inside = (np.abs(points - [0, 0, 0.25]) < [0.75, 0.5, 0.5]).all(axis=1)
    assert np.array_equal(vertical_line_table(mesh).winding(points), inside.astype(float))


def test_right_above_the_rim_of_an_open_box_nothing_jumps():
    """There the curtain hangs: its jump and that of the count must fall together."""
    box = shown(trimesh.creation.box((1, 1, 1)))
    bottomless = box.only(box.normals[:, 2] > -0.5)
    rim = np.linspace(-0.45, 0.45, 10)
    above = np.column_stack([np.full(10, 0.5), rim, np.full(10, 0.9)])
    found = vertical_line_table(bottomless).winding(above)
    assert np.abs(found - exact(bottomless, above)).max() < 1e-9


def test_a_tree_answers_where_many_edges_are_open(rng):
    ball = shown(trimesh.creation.icosphere(4))
    leaky = QueryMesh(ball.only(rng.uniform(size=len(ball.triangles)) > 0.3))
    assert len(unbalanced_edges(leaky.mesh)[0]) > MAX_OPEN_EDGES_BRUTE
    points = rng.uniform(-1.2, 1.2, (500, 3))
    assert np.abs(leaky.winding(points) - exact(leaky.mesh, points)).max() < 0.01


def test_nothing_winds_around_an_empty_mesh():
    nothing = QueryMesh(Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))
    assert not nothing.winding(np.zeros((4, 3))).any()


def test_a_shape_that_moved_answers_as_one_made_there(rng):
    mesh = shown(BODIES["ball"])
    holed = Mesh(mesh.vertices, mesh.triangles[3:])
    there = holed.vertices * [1.0, 2.0, 0.5] + [0.3, 0.0, -0.1]
    points = rng.uniform(-1.0, 1.0, (200, 3))
    moved, made = QueryMesh(holed).moved(there), QueryMesh(Mesh(there, holed.triangles))
    assert np.array_equal(moved.winding(points), made.winding(points))
    assert not np.array_equal(moved.winding(points), QueryMesh(holed).winding(points))


def test_few_points_get_the_answer_of_many(rng):
    ball = shown(trimesh.creation.icosphere(4))
    points = np.concatenate([rng.uniform(-1.1, 1.1, (300, 3)), ball.vertices[:20]])
    few = [QueryMesh(ball).winding(points[k : k + 40]) for k in range(0, len(points), 40)]
    many = QueryMesh(ball).winding(np.tile(points, (5, 1)))
    assert np.array_equal(np.concatenate(few), many[: len(points)])
