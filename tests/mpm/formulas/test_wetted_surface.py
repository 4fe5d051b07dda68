"""Where a liquid meets the surface of a rigid body: the text of the fast engines is as in NumPy."""

import numpy as np
import pytest

from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.formulas import formula_options, one_lane_contact
from corporeal.mpm.physics import contact
from corporeal.mpm.problem import WettedSurface

wp.set_module_options(formula_options())
CELL, COUNT = 0.01, 60
DOUBLE = 1e-12


@wp.kernel
def faces(
    rows: wp.array(dtype=wp.vec3d),
    count: int,
    node: wp.array(dtype=wp.vec3d),
    place: wp.array(dtype=wp.vec3d),
    dx: wp.float64,
    out: wp.array2d(dtype=wp.vec4d),
):
    i = wp.tid()
    for number in range(3):
        out[i, number] = one_lane_contact.wetted_face(rows, 0, count, node[i], place[i], dx, number)


@wp.kernel
def gaps(
    mean: wp.array(dtype=wp.float32),
    h: wp.array(dtype=wp.float32),
    full: wp.array(dtype=wp.float32),
    out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    out[i] = one_lane_contact.gap_of_liquid(mean[i], h[i], full[i])


@pytest.fixture
def corner():
    """A corner of three faces, out of which each looks, and the thin wall's other side."""
    grid = np.stack(np.meshgrid(*[(np.arange(12) + 0.5) * 0.004] * 2), -1).reshape(-1, 2)
    points, normals = [], []
    for axis in range(3):
        for depth, side in ((0.0, 1.0), (-0.002, -1.0)):
            points.append(np.insert(grid, axis, depth, axis=1))
            normals.append(np.tile(side * np.eye(3)[axis], (len(grid), 1)))
    return WettedSurface(np.concatenate(points), np.concatenate(normals))


def test_faces_of_a_corner_are_found_alike_and_never_the_other_side_of_a_wall(corner):
    rng = np.random.default_rng(0)
    place = rng.uniform(0.001, 0.03, (COUNT, 3))
    node = place + rng.uniform(-1, 1, (COUNT, 3)) * CELL
    exact = contact.wetted_faces(corner, node, place, CELL)
    rows = np.stack([corner.point, corner.normal], axis=1).reshape(-1, 3)
    sent = [wp.array(x, dtype=wp.vec3d, device="cpu") for x in (rows, node, place)]
    out = wp.zeros((COUNT, 3), dtype=wp.vec4d, device="cpu")
    given = [sent[0], len(corner.point), sent[1], sent[2], CELL]
    wp.launch(faces, COUNT, given, outputs=[out], device="cpu")
    found = out.numpy()
    number = np.concatenate([np.arange((exact.node == k).sum()) for k in range(COUNT)])
    assert (np.bincount(exact.node, minlength=COUNT) == 3).sum() > 3
    assert np.abs(found[exact.node, number, :3] - exact.outward).max() < DOUBLE
    assert np.abs(found[exact.node, number, 3] - exact.height).max() < DOUBLE
    assert (found[..., 3] < 1e29).sum() == len(exact.node)
    assert (exact.outward.max(axis=1) > 0.99).all()
    # The face that is a plane is as high below the node as it is.
    axis = exact.outward.argmax(axis=1)
    assert exact.height == pytest.approx(node[exact.node, axis], abs=1e-9)


def test_gaps_of_liquids_are_as_in_numpy():
    rng = np.random.default_rng(1)
    mean, height = rng.uniform(-1.2, 0.3, 500), rng.uniform(-1.4, 1.8, 500)
    full = rng.uniform(0.2, 1.0, 500)
    out = np.tile([0.0, 0.0, 1.0], (500, 1))
    exact = contact.gap_of_liquid(mean[:, None] * out, height, out, full, 1.0)
    given = (mean, height, full)
    sent = [wp.array(x.astype(np.float32), dtype=wp.float32, device="cpu") for x in given]
    found = wp.zeros(500, dtype=wp.float32, device="cpu")
    wp.launch(gaps, 500, sent, outputs=[found], device="cpu")
    near = np.isfinite(exact)
    assert 0.2 < near.mean() < 0.95 and (near & (height > 0.51)).any()
    assert ((found.numpy() < 1e29) == near).mean() > 0.995
    both = near & (found.numpy() < 1e29)
    assert np.abs(found.numpy()[both] - exact[both]).max() < 3e-6
