"""How liquids and pastes flow: against Newton, Bingham, Herschel and Bulkley."""

import numpy as np
import pytest

from corporeal.mpm.laws import fluid, hencky
from corporeal.mpm.laws.constitutive_law import YieldParameters

MU, LAM = 100.0, 750.0
ONE = np.ones(1)


def numbers(dt, consistency, index=1.0, yield_shear=0.0):
    """What the law reads, for particles and steps of dt [s]; one number, or one per particle."""
    drag = consistency * np.asarray(dt) ** -np.asarray(index)
    given = (MU, LAM, np.sqrt(3.0) * yield_shear, 0.0, 0.0, 0.0, drag, index)
    return YieldParameters(*(value * np.ones(np.size(drag)) for value in given))


def sheared(rate, dt, steps, given):
    """Shear stress τ_xy [Pa] of every particle after simple shear at a rate [1/s], from rest."""
    every = np.ones(len(given.mu))
    step = np.eye(3) * every[:, None, None]
    F = step.copy()
    step[:, 0, 1] = rate * dt
    for _ in range(steps):
        F = fluid.flow(step @ F, given, 0.0 * every, 0.0 * every).F
    return hencky.tau(F, MU * every, LAM * every)[:, 0, 1]


@pytest.mark.parametrize("over", [0.01, 1.0, 100.0])
def test_a_newtonian_liquid_resists_by_its_viscosity_however_long_the_step(over):
    """τ = η γ̇ in steady shear at steps of a hundredth and of a hundred relaxation times η/G."""
    viscosity = 2.0
    dt = over * viscosity / MU
    rate = 1e-4 / dt if over > 1 else 1e-4 * MU / viscosity
    stress = sheared(rate, dt, int(30 / min(over, 1.0)) + 3, numbers(dt, viscosity))
    assert stress == pytest.approx(viscosity * rate, rel=1e-3)


@pytest.mark.slow
def test_a_paste_resists_as_herschel_and_bulkley_say():
    """Every index at every rate: a particle each, since thousands of steps cost as much for one."""
    index, rate = (grid.ravel() for grid in np.meshgrid([0.3, 0.5, 1.0, 1.6], [0.1, 3.0, 20.0]))
    consistency, yield_shear, dt = 0.05, 2.0, 1e-3 / rate
    given = numbers(dt, consistency, index, yield_shear)
    expected = yield_shear + consistency * rate**index
    assert sheared(rate, dt, 6000, given) == pytest.approx(expected, rel=0.02)


def test_a_paste_below_its_yield_stress_does_not_flow():
    given, F = numbers(1e-3, 5.0, yield_shear=10.0), np.eye(3)[None].copy()
    F[0, 0, 1] = 0.99 * 10.0 / MU
    back = fluid.flow(F, given, 0.0 * ONE, 0.0 * ONE)
    assert np.array_equal(back.F, F)
    F[0, 0, 1] = 1.02 * 10.0 / MU
    assert fluid.flow(F, given, 0.0 * ONE, 0.0 * ONE).loss[0] > 0.0


def test_a_liquid_forgets_its_shape_and_never_its_volume():
    rng = np.random.default_rng(0)
    F = np.eye(3) + 0.1 * rng.normal(size=(1, 3, 3))
    before = np.linalg.det(F[0])
    for _ in range(200):
        F = fluid.flow(F, numbers(1e-3, 1e-2), 0.0 * ONE, 0.0 * ONE).F
    assert np.linalg.det(F[0]) == pytest.approx(before, rel=1e-12)
    tau = hencky.tau(F, MU * ONE, LAM * ONE)[0]
    assert np.abs(tau - np.trace(tau) / 3 * np.eye(3)).max() < 1e-9 * MU


@pytest.mark.parametrize("index", [0.2, 0.4, 0.9, 1.0, 1.8])
def test_the_slip_of_a_step_balances_its_stress(index):
    rng, count = np.random.default_rng(1), 500
    mu, drag = 10.0 ** rng.uniform(1, 5, count), 10.0 ** rng.uniform(-2, 6, count)
    excess = mu * 10.0 ** rng.uniform(-6, 0, count)
    n = np.full(count, index)
    slip = fluid.shear_slip(excess, mu, drag, n)
    seen = slip > 1e-25
    assert seen.mean() > 0.5
    bears = (mu * slip + drag * slip**n)[seen]
    assert bears == pytest.approx(excess[seen], rel=1e-6)
    assert not fluid.shear_slip(-excess, mu, drag, n).any()


def test_no_step_makes_energy():
    """Plastic work of a step is never negative, and what is stored never more than before it."""
    rng = np.random.default_rng(2)
    F = np.eye(3) + 0.05 * rng.normal(size=(300, 3, 3))
    given = numbers(1e-3, 3.0, 0.5, 2.0)
    many = YieldParameters(*(np.repeat(getattr(given, f), 300) for f in given.__dataclass_fields__))
    none = np.zeros(300)
    back = fluid.flow(F, many, none, none)
    stored = [hencky.psi(x, many.mu, many.lam) for x in (F, back.F)]
    assert (back.loss >= 0.0).all()
    assert (stored[0] - stored[1] >= back.loss * (1 - 1e-9) - 1e-12).all()
