"""The reference engine keeps the engine's contract and its own bookkeeping."""

import dataclasses
from math import sqrt

import numpy as np
import pytest
from point_bodies import CELL, body, problem

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.grid_spline import stencil
from corporeal.mpm.physics.maxwell_branches import fit_branches
from corporeal.mpm.reference.engine import ReferenceEngine

LOSSLESS = {
    "name": "cube",
    "yield_stress": 500.0,
    "hardening": 0.0,
    "friction_angle": 0.5,
    "cohesion": 0.0,
    "loss": 0.0,
}
"""Of a cube's points: neither losses nor hardening."""


def cube(centre, side=0.04, law=Law.NEO_HOOKEAN, velocity=(0.0, 0.0, 0.0), **given):
    axis = (np.arange(4) + 0.5) / 4 * side - side / 2
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3) + centre
    return body(points, law, velocity, side / 4, **(LOSSLESS | given))


# ---------------------------------------------------------------- splines


def test_weights_add_up_to_one_and_carry_linear_fields_exactly():
    rng = np.random.default_rng(0)
    position = rng.uniform(-0.1, 0.1, (50, 3))
    grid = stencil(position, np.zeros(50, int), CELL)
    assert grid.weight.sum(axis=1) == pytest.approx(np.ones(50), abs=1e-14)
    A, b = rng.standard_normal((3, 3)), rng.standard_normal(3)
    values = grid.index * CELL @ A.T + b
    assert grid.gather(values) == pytest.approx(position @ A.T + b, abs=1e-13)
    assert grid.gather_gradient(values) == pytest.approx(np.tile(A, (50, 1, 1)), abs=1e-11)


def test_the_gradient_is_the_derivative_of_the_weight():
    rng = np.random.default_rng(1)
    position, h = rng.uniform(0.021, 0.029, (20, 3)), 1e-7
    particle, near = np.repeat(np.arange(20), 27), np.tile(np.arange(27), 20)
    field = np.zeros(20, int)
    slope = stencil(position, field, CELL).gradient(particle, near)
    for axis in range(3):
        step = h * np.eye(3)[axis]
        up = stencil(position + step, field, CELL).weight[particle, near]
        down = stencil(position - step, field, CELL).weight[particle, near]
        assert slope[:, axis] == pytest.approx((up - down) / (2 * h), abs=1e-4)


def test_fields_have_their_own_slots_at_the_same_node():
    position = np.array([[0.01, 0.01, 0.01], [0.011, 0.01, 0.01]])
    apart = stencil(position, np.array([0, 1]), CELL)
    assert apart.count == 54
    assert np.array_equal(apart.index[:27], apart.index[27:])
    assert stencil(position, np.array([0, 0]), CELL).count == 27


def test_scattering_keeps_mass_momentum_and_angular_momentum():
    rng = np.random.default_rng(2)
    position, velocity = rng.uniform(-0.05, 0.05, (40, 3)), rng.standard_normal((40, 3))
    mass, C = rng.uniform(0.5, 2.0, 40), rng.standard_normal((40, 3, 3))
    grid = stencil(position, np.zeros(40, int), CELL)
    p = mass[:, None]
    momentum = grid.scatter(p * velocity) + grid.scatter_moment(p[:, :, None] * C)
    assert grid.scatter(mass).sum() == pytest.approx(mass.sum(), rel=1e-13)
    assert momentum.sum(0) == pytest.approx(mass @ velocity, rel=1e-12)
    swirl = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], 1)
    whole = np.sum(p * (np.cross(position, velocity) + CELL**2 / 4 * swirl), axis=0)
    assert np.cross(grid.index * CELL, momentum).sum(0) == pytest.approx(whole, rel=1e-12)


# ---------------------------------------------------------------- contract


def test_time_is_reached_exactly_and_steps_are_counted():
    engine = ReferenceEngine(problem(cube((0.0, 0.0, 0.2))))
    for until in (0.0, 0.003, 0.0071):
        engine.advance(until)
        assert engine.time == until
    assert engine.steps.count > 0
    assert 0 < engine.steps.smallest <= engine.steps.largest <= engine.stable_step() * 1.5


def test_the_step_respects_the_wave_and_the_motion():
    slow = ReferenceEngine(problem(cube((0.0, 0.0, 0.2))))
    fast = ReferenceEngine(problem(cube((0.0, 0.0, 0.2), velocity=(20.0, 0.0, 0.0))))
    wave = np.sqrt(1e5 * 0.7 / (1000 * 1.3 * 0.4))
    assert slow.stable_step() == pytest.approx(0.4 * CELL / wave)
    assert fast.stable_step() == pytest.approx(0.4 * CELL / (wave + 20.0))
    lossy = ReferenceEngine(problem(cube((0.0, 0.0, 0.2), loss=0.3)))
    at_once = sqrt(1.0 + sum(fit_branches(0.3).strength))
    assert lossy.stable_step() == pytest.approx(slow.stable_step() / at_once, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("law", list(Law))
def test_every_law_survives_a_hard_fall(law):
    engine = ReferenceEngine(problem(cube((0.0, 0.0, 0.0205), law=law, velocity=(0.0, 0.0, -2.0))))
    energy = []
    for until in np.linspace(0.002, 0.03, 8):
        engine.advance(until)
        m = engine.measure()
        losses = m.friction_loss + m.plastic_loss + m.viscous_loss
        energy.append(m.kinetic.sum() + m.elastic.sum() + m.potential.sum() + losses)
    start = 0.5 * 0.064 * 4.0 + 0.064 * 9.81 * 0.0205
    assert max(energy) < 1.02 * start
    assert engine.measure().plane_impulse[0, 0, 2] > 0.064 * 1.0
    plastic = engine.snapshot().plastic_strain.max()
    assert (plastic > 0.01) == CONSTITUTIVE_LAWS[law].flows


def test_motion_includes_what_yielded_and_deformation_does_not():
    metal = cube((0.0, 0.0, 0.0205), law=Law.VON_MISES, velocity=(0.0, 0.0, -2.0))
    engine = ReferenceEngine(problem(metal))
    engine.advance(0.02)
    s = engine.snapshot()
    squashed = np.linalg.det(s.motion), np.linalg.det(s.deformation)
    assert squashed[0] == pytest.approx(squashed[1], rel=1e-9)
    assert np.abs(s.motion - np.eye(3)).max() > 3 * np.abs(s.deformation - np.eye(3)).max()


def test_saving_and_restoring_changes_nothing():
    given = problem(
        cube((0.0, 0.0, 0.0205), law=Law.DRUCKER_PRAGER, velocity=(0.3, 0.0, -1.0)),
        cube((0.01, 0.0, 0.064), velocity=(0.0, 0.0, -1.0), rigid=True),
    )
    one, two = ReferenceEngine(given), ReferenceEngine(given)
    one.advance(0.01)
    two.restore(one.save())
    for engine in (one, two):
        engine.advance(0.02)
    for left, right in ((one.snapshot(), two.snapshot()), (one.measure(), two.measure())):
        for field in dataclasses.fields(left):
            assert np.array_equal(getattr(left, field.name), getattr(right, field.name), equal_nan=True), field.name
    assert one.steps == two.steps


def test_a_body_that_bursts_is_named_and_the_last_good_state_is_kept():
    bad = cube((0.0, 0.0, 0.2), name="vase")
    bad.velocity[0] = np.inf
    engine = ReferenceEngine(problem(cube((0.3, 0.0, 0.2)), bad))
    with np.errstate(all="ignore"), pytest.raises(SimulationError, match="'vase'"):
        engine.step(1e-4)
    assert engine.time == 0.0
    assert np.isfinite(engine.snapshot().position).all()
    assert engine.measure().lost.any()


def test_a_body_behind_a_wall_has_left_the_domain():
    sunk = problem(cube((0.0, 0.0, -0.5), rigid=True, surface=np.array([[0, 0, -0.5]])))
    engine = ReferenceEngine(sunk)
    with pytest.raises(SimulationError, match="left the domain"):
        engine.advance(0.01)


def test_the_books_balance():
    """Impulses add up to momentum; work and losses to energy."""
    given = problem(
        cube((0.0, 0.0, 0.021), law=Law.VON_MISES, velocity=(0.5, 0.0, -1.0), loss=0.1),
        cube((0.005, 0.0, 0.0635), velocity=(0.0, 0.0, -1.0)),
    )
    engine = ReferenceEngine(given)
    before = engine.measure()
    engine.advance(0.03)
    after = engine.measure()
    walls = after.plane_impulse.sum(axis=(0, 1))
    gained = after.momentum.sum(0) - before.momentum.sum(0)
    assert gained == pytest.approx(after.external_impulse.sum(0) + walls, abs=1e-12)
    total = [m.kinetic.sum() + m.elastic.sum() + m.potential.sum() for m in (before, after)]
    losses = after.friction_loss + after.plastic_loss + after.viscous_loss
    assert min(after.friction_loss, after.plastic_loss, after.viscous_loss) > 0
    assert total[1] + losses <= total[0] * 1.001
    assert after.first_contact[0, 1] == after.first_contact[1, 0] <= after.last_contact[0, 1]
    assert np.isnan(after.first_contact[0, 0])
    assert np.abs(after.contact_point[0, 2][2]) < CELL
