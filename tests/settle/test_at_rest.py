"""Bodies come to rest where statics says they must."""

import numpy as np
import pytest
import trimesh

from corporeal.errors import UserError
from corporeal.settle.body import Body
from corporeal.settle.decompose import decompose
from corporeal.settle.rest import at_rest


def body(mesh, name="body"):
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    return Body(name, vertices, triangles, decompose(vertices, triangles))


def box(*sides):
    return body(trimesh.creation.box(sides), "box")


def test_a_box_rests_at_half_its_height():
    poses, certificate = at_rest([box(0.5, 0.4, 0.3)], "scatter", 1, 1e-3)
    assert poses[0].position[2] == pytest.approx(0.15, abs=1e-4)
    assert certificate.attempts == 1
    assert certificate.drift_m < 1e-4


def test_what_cannot_be_settled_says_so():
    with pytest.raises(UserError, match="nothing to settle"):
        at_rest([], "scatter", 1, 1e-3)
