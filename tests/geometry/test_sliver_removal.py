"""Slivers are removed and the rest of a mesh stays."""

import numpy as np
import trimesh

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.sliver_removal import MAX_ASPECT_RATIO, aspect_ratios, without_slivers


def test_an_equilateral_triangle_has_ratio_one():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]]])
    assert abs(aspect_ratios(corners)[0] - 1) < 1e-12


def test_a_flat_triangle_divides_its_neighbour():
    x = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.01, 0], [0.5, -0.8, 0], [0.5, 0.8, 0]])
    mesh = Mesh(x, np.array([[0, 1, 2], [1, 0, 3], [0, 2, 4], [2, 1, 4]]))
    clean, source = without_slivers(mesh)
    assert aspect_ratios(clean.corners).max() < MAX_ASPECT_RATIO
    assert abs(clean.areas.sum() - mesh.areas.sum()) < 1e-12
    assert sorted(source) == [1, 1, 2, 3]


def test_needles_of_a_ball_are_collapsed():
    ball = trimesh.creation.icosphere(3)
    x, t = np.asarray(ball.vertices), np.asarray(ball.faces)
    # An edge is divided next to its end: four needles.
    a, b = t[0, :2]
    new = np.array([x[a] + 0.01 * (x[b] - x[a])])
    split = []
    for triangle in t:
        if {a, b} <= set(triangle):
            (c,) = set(triangle) - {a, b}
            at = list(triangle).index(a)
            way = triangle[(at + 1) % 3] == b
            split += [(a, len(x), c), (len(x), b, c)] if way else [(len(x), a, c), (b, len(x), c)]
        else:
            split.append(tuple(triangle))
    mesh = Mesh(np.concatenate([x, new]), np.array(split))
    assert aspect_ratios(mesh.corners).max() > 20
    clean, _ = without_slivers(mesh)
    assert aspect_ratios(clean.corners).max() < 2
    assert len(clean.triangles) == len(t)
    assert trimesh.Trimesh(clean.vertices, clean.triangles, process=False).is_watertight


def test_a_good_mesh_stays_as_it_is():
    ball = trimesh.creation.icosphere(2)
    clean, source = without_slivers(Mesh(np.asarray(ball.vertices), np.asarray(ball.faces)))
    assert (clean.triangles == ball.faces).all() and (source == np.arange(len(ball.faces))).all()
