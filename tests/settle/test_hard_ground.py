"""Settled things rest where hard things rest that nothing keeps from rolling."""

import numpy as np
import pytest
import trimesh

from corporeal.settle.body import Body
from corporeal.settle.decompose import decompose
from corporeal.settle.rest import at_rest


def body(mesh, name):
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    return Body(name, vertices, triangles, decompose(vertices, triangles))


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_round_rests_flat_on_a_face(seed):
    ball = body(trimesh.creation.icosphere(2, radius=0.2), "ball")
    (pose,), certificate = at_rest([ball], "scatter", seed, 1e-3)
    height = np.sort(pose.world(ball.vertices)[:, 2])
    assert abs(height[0]) < 1e-5
    assert height[2] - height[0] < 1e-5
    assert height[3] > 1e-3
    assert certificate.drift_m < 1e-4


def test_what_is_stacked_hardly_sinks():
    things = [body(trimesh.creation.box(s), "box") for s in [(0.5, 0.4, 0.2), (0.3, 0.3, 0.2)]]
    _, certificate = at_rest(things, "stack", 0, 1e-5)
    assert certificate.penetration_m < 5e-6
