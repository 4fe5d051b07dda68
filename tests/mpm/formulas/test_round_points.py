"""Where rounded surface points touch: the text of the fast engines, and what a support is."""

import numpy as np
import pytest

from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.formulas import formula_options, one_lane_contact
from corporeal.mpm.physics.curved_surface import support_point_shift

wp.set_module_options(formula_options())
COUNT = 300


@wp.kernel
def shifts(rows: wp.array(dtype=wp.float64), towards: wp.array(dtype=wp.vec3d), out: wp.array(dtype=wp.vec4d)):
    i = wp.tid()
    out[i] = one_lane_contact.shift_to_contact(rows, i, towards[i])


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def some(seed=0):
    """Rounded points of every kind, and a direction for each, most of them near its normal."""
    rng = np.random.default_rng(seed)
    normal = unit(rng.normal(size=(COUNT, 3)))
    along = unit(np.cross(normal, rng.normal(size=(COUNT, 3))))
    ball, arc = rng.uniform(0, 0.3, (2, COUNT)) * rng.integers(0, 2, (2, COUNT))
    reach = rng.uniform(0.01, 0.2, COUNT)
    lean = rng.choice([0.0, 0.1, 0.5, 5.0], (COUNT, 1)) * rng.normal(size=(COUNT, 3))
    inside = rng.integers(0, 2, COUNT)
    curved = np.zeros((COUNT, 2))
    return np.column_stack([normal, along, ball, arc, reach, inside, curved]), unit(normal + lean)


@pytest.mark.slow
def test_the_fast_engines_shift_as_numpy_does():
    rows, towards = some()
    flat = wp.array(rows.reshape(-1), dtype=wp.float64, device="cpu")
    ways = wp.array(towards, dtype=wp.vec3d, device="cpu")
    out = wp.zeros(COUNT, dtype=wp.vec4d, device="cpu")
    wp.launch(shifts, COUNT, inputs=[flat, ways, out], device="cpu")
    shift, own = support_point_shift(rows, towards)
    assert out.numpy()[:, :3] == pytest.approx(shift, abs=1e-13)
    assert (out.numpy()[:, 3] == own).all()
    assert 20 < (~own).sum() < COUNT - 20


def test_a_shift_goes_forwards_and_no_farther_than_each_part_reaches():
    rows, towards = some(1)
    shift, _ = support_point_shift(rows, towards)
    facing = np.sum(towards * rows[:, :3], axis=1) > 0.1
    assert (np.sum(shift * towards, axis=1)[facing] > -1e-12).all()
    assert (np.linalg.norm(shift, axis=1) <= 2 * rows[:, 8] + 1e-12).all()
    assert np.abs(shift[(rows[:, 6] == 0) & (rows[:, 7] == 0)]).max() == 0.0


def test_every_point_of_a_ball_that_reaches_the_lowest_point_gives_that():
    rng = np.random.default_rng(2)
    normal = unit(np.array([0.0, 0.0, -1.0]) + rng.uniform(-0.6, 0.6, (COUNT, 3)))
    radii = np.tile([0.5, 0.0, 0.25, 1.0], (COUNT, 1))
    rows = np.column_stack([normal, np.zeros((COUNT, 3)), radii])
    down = np.tile([0.0, 0.0, -1.0], (COUNT, 1))
    shift, own = support_point_shift(rows, down)
    assert (0.5 * normal + shift)[own] == pytest.approx(0.5 * down[own], abs=1e-12)
    assert (own == (np.arccos(-normal[:, 2]) <= 0.5)).all()
