"""Points inside a shape are spread evenly, at the price of as few questions as will do."""

import numpy as np
import pytest
import trimesh

from corporeal.geometry import point_relaxation
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

SPACING = 0.05


@pytest.fixture
def ball():
    made = trimesh.creation.icosphere(3, 0.5)
    return QueryMesh(Mesh(np.array(made.vertices, float), np.array(made.faces, np.int64)))


def spread(shape, deepest=None):
    """Relax a jittered lattice; return where its points end, and how many were asked each time."""
    line = np.arange(-0.475, 0.5, SPACING)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    points += np.random.default_rng(1).uniform(-0.2, 0.2, points.shape) * SPACING
    points = points[np.linalg.norm(points, axis=1) < 0.48]
    limit = None if deepest is None else np.full(len(points), deepest)
    asked = []

    class Counted(QueryMesh):
        def closest(self, points):
            asked.append(len(points))
            return super().closest(points)

    return point_relaxation.relax_points(points, shape, Counted(shape.mesh), SPACING, limit), asked


def test_what_cannot_feel_the_surface_is_not_asked_again_and_ends_in_the_same_place(ball, monkeypatch):
    found, asked = spread(ball)
    monkeypatch.setattr(point_relaxation.FreeDistances, "still", lambda self, points, which: which < 0)
    every, all_asked = spread(ball)
    assert found.tobytes() == every.tobytes()
    assert sum(asked) < 0.95 * sum(all_asked)


def test_in_a_wall_with_a_depth_every_point_is_asked(ball, monkeypatch):
    found, asked = spread(ball, 0.3)
    monkeypatch.setattr(point_relaxation.FreeDistances, "still", lambda self, points, which: which < 0)
    every, all_asked = spread(ball, 0.3)
    assert found.tobytes() == every.tobytes()
    assert asked == all_asked


def test_no_point_ends_shallower_than_half_a_spacing(ball):
    found, _ = spread(ball)
    assert ball.closest(found)[0].min() > 0.45 * SPACING
    assert ball.inside(found).all()
