"""Questions to a surface along ways."""

import numpy as np
import trimesh

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh


def ball(turned=False):
    made = trimesh.creation.icosphere(4)
    faces = np.asarray(made.faces, dtype=np.int64)
    return QueryMesh(Mesh(np.asarray(made.vertices, dtype=float), faces[:, ::-1] if turned else faces))


def test_a_way_through_a_ball_goes_in_and_out_where_the_ball_begins_and_ends(rng):
    starts = 2.0 * (a := rng.normal(size=(200, 3))) / np.linalg.norm(a, axis=1)[:, None]
    ends = -starts + rng.uniform(-0.05, 0.05, (200, 3))
    met = ball().crossings(starts, ends)
    for side, expected in ((1, 0.25), (-1, 0.75)):
        way, share = met.way[met.side == side], met.share[met.side == side]
        assert np.array_equal(np.sort(way), np.arange(200))
        assert np.abs(share - expected).max() < 0.03
        there = starts[way] + share[:, None] * (ends - starts)[way]
        assert np.abs(np.linalg.norm(there, axis=1) - 1).max() < 0.005
    centre = ball().mesh.corners[met.triangle].mean(axis=1)
    there = starts[met.way] + met.share[:, None] * (ends - starts)[met.way]
    assert np.linalg.norm(centre - there, axis=1).max() < 0.1


def test_ways_that_end_before_a_ball_or_pass_it_meet_nothing(rng):
    starts = rng.normal(size=(100, 3)) * 0.1 + [0, 0, 3]
    assert not len(ball().crossings(starts, starts - [0, 0, 1.0]).way)
    assert not len(ball().crossings(starts, starts - [-3.0, 0, 3.0]).way)


def test_a_ball_turned_inside_out_is_left_first():
    met = ball(turned=True).crossings(np.array([[0.01, 0.02, 3.0]]), np.array([[0.01, 0.02, -3.0]]))
    assert met.side[np.argsort(met.share)].tolist() == [-1, 1]
