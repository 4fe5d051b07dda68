"""Things whose walls are thinner than a cell touch others at their surfaces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import corporeal as co
from corporeal.mpm.physics import rigid
from corporeal.mpm.state import surface_curvature

HIGH, GAP = 0.25, 0.02
FAR = co.box("wood", (0.3, 0.3, 0.2), at=(1.0, 0.0, 0.1), name="far")
"""What makes the scene so large that a cell is 2 cm."""


def mug(base=0.004, wall=0.003, low=HIGH + GAP):
    outline = [[0, 0], [0.04, 0], [0.04, 0.095], [0.04 - wall, 0.095], [0.04 - wall, base], [0, base]]
    shape = trimesh.creation.revolve(np.array(outline), sections=48)
    corners = np.array(shape.vertices) + np.array([0.0513, 0.0071, low])
    return co.solid("porcelain", corners, shape.faces, name="mug")


def block(wall=None):
    """Give a block of wood, or a crate of such walls, as high as the mug is above the floor."""
    if wall is None:
        return co.box("wood", (0.4, 0.3, HIGH), at=(0.0, 0.0, HIGH / 2), name="block")
    inside = trimesh.creation.box(np.array([0.4, 0.3, HIGH]) - 2 * wall)
    inside.invert()
    shape = trimesh.util.concatenate([trimesh.creation.box([0.4, 0.3, HIGH]), inside])
    corners = np.array(shape.vertices) + np.array([0.0, 0.0, HIGH / 2])
    return co.solid("wood", corners, shape.faces, name="crate")


def posed(*solids):
    problem = co.pose_problem(co.prepare_scene(co.build_scene(*solids, duration=0.35)))
    return replace(problem, gravity_ramp=0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("wall", "most"), [(None, 0.01), (0.01, 0.3)], ids=["block", "crate"])
def test_a_mug_stands_on_what_is_under_it(wall, most):
    """It stayed .46 cells above the block, and .98, where it had begun, above the crate."""
    problem = posed(mug(), block(wall), FAR)
    engine = co.build_engine(problem)
    start = engine.measure().centre[0, 2]
    engine.advance(0.3)
    found = engine.measure()
    fallen = start - found.centre[0, 2]
    assert GAP - most * problem.cell < fallen < GAP + 0.01 * problem.cell
    assert np.abs(found.momentum[0] / found.mass[0]).max() < 0.01


def test_what_lies_in_a_crate_is_not_held_by_its_lid():
    """Seen from the bottom the lid lies behind. It counted: the cube hung where it was let go."""
    low, size = 0.01, 0.08
    at = (0.0213, 0.0071, low + GAP + size / 2)
    problem = posed(co.box("wood", (size, size, size), at=at, name="cube"), block(low), FAR)
    engine = co.build_engine(problem)
    engine.advance(0.3)
    height = engine.measure().centre[0, 2] - low - size / 2
    assert abs(height) < 0.2 * problem.cell


@pytest.mark.parametrize(
    ("solid", "thin"),
    [(mug(low=0.0), 1), (block(0.01), 1), (block(), 0), (mug(base=0.06, wall=0.035, low=0.0), 0)],
    ids=["mug", "crate", "block", "thick mug"],
)
def test_what_has_thin_walls_is_recognised_by_its_surface(solid, thin):
    (body,) = posed(solid).bodies
    normal = surface_curvature(body)[:, :3]
    assert rigid.thinness(body.surface, normal, 0.015) == thin
    assert rigid.thinness(body.surface, 0.0 * normal, 0.015) == 0
