"""Maxwell branches lose what they should: fit, relaxation, creep, oscillation, and free energy."""

import numpy as np
import pytest

from corporeal.mpm.constants import LOSS_BAND_HIGH_RATIO, LOSS_BAND_LOW_RATIO
from corporeal.mpm.physics.maxwell_branches import (
    BranchMemory,
    MaxwellBranches,
    advance_branches,
    branch_free_energy,
    complex_modulus,
    fit_branches,
    maxwell_stress,
)

BAND = np.geomspace(LOSS_BAND_LOW_RATIO, LOSS_BAND_HIGH_RATIO, 200)


def blank(count=1):
    return BranchMemory(np.zeros((count, 2, 3, 3)), np.zeros((count, 2)))


def sheared(gamma):
    return gamma * np.array([[[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]])


def of(shear, bulk=(0.0, 0.0), time=(1.0, 1.0)):
    return MaxwellBranches(*(np.array([row], float) for row in (shear, bulk, time)))


@pytest.mark.parametrize("loss", [0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0])
def test_the_loss_factor_is_flat_over_the_band_within_three_per_cent(loss):
    share = fit_branches(loss)
    modulus = complex_modulus(np.array(share.strength), np.array(share.time), BAND)
    found = modulus.imag / modulus.real
    assert np.abs(found / loss - 1).max() < 0.033
    assert share.time[0] > share.time[1]


def test_one_branch_alone_would_not_be_flat():
    share = fit_branches(0.3)
    one = complex_modulus(np.array([share.strength[0]]), np.array([share.time[0]]), BAND)
    assert np.abs(one.imag / one.real / 0.3 - 1).max() > 0.3


@pytest.mark.parametrize(("loss", "times"), [(0.1, 1.17), (0.3, 1.54), (0.6, 2.1), (1.0, 2.76)])
def test_loss_over_a_band_stiffens(loss, times):
    assert fit_branches(loss).stiffening == pytest.approx(times, rel=0.02)


@pytest.mark.parametrize("gamma", [0.01, 0.5])
@pytest.mark.parametrize("dt", [0.01, 1.0, 10.0])
def test_a_sudden_shear_relaxes_exponentially_whatever_the_step(gamma, dt):
    memory = advance_branches(blank(), sheared(gamma), np.ones((1, 2)), 1e-12)
    start, steps = memory.strain[0, 0, 0, 1], round(10.0 / dt)
    for _ in range(steps):
        memory = advance_branches(memory, np.zeros((1, 3, 3)), np.ones((1, 2)), dt)
    assert memory.strain[0, 0, 0, 1] == pytest.approx(start * np.exp(-10.0), rel=1e-9)


def test_a_branch_that_forgets_within_a_step_is_a_viscosity():
    # σ = G T γ' exactly, with a step of a hundred relaxation times.
    dt, rate, time = 1.0, 0.003, 0.01
    memory, branch = blank(), of((5.0, 0.0), time=(time, time))
    for _ in range(3):
        memory = advance_branches(memory, sheared(rate * dt), branch.time, dt)
    assert maxwell_stress(branch, memory)[0, 0, 1] == pytest.approx(5.0 * time * rate, rel=1e-9)


@pytest.mark.parametrize("steps", [2000, 200])
def test_a_stepped_oscillation_has_the_loss_of_the_fit(steps):
    share, frequency = fit_branches(0.5), 0.7
    branch = of(share.strength, time=share.time)
    dt = 2 * np.pi / frequency / steps
    time, memory, found = np.arange(8 * steps) * dt, blank(), []
    for now in time:
        rate = 1e-3 * frequency * np.cos(frequency * (now + 0.5 * dt))
        memory = advance_branches(memory, sheared(dt * rate), branch.time, dt)
        found.append(1e-3 * np.sin(frequency * (now + dt)) + maxwell_stress(branch, memory)[0, 0, 1])
    last, phase = np.array(found[-steps:]), frequency * (time[-steps:] + dt)
    loss = (last @ np.cos(phase)) / (last @ np.sin(phase))
    modulus = complex_modulus(np.array(share.strength), np.array(share.time), np.array([frequency]))[0]
    assert loss == pytest.approx(modulus.imag / modulus.real, rel=2e-3)


def test_creep_follows_the_standard_linear_solid():
    # Strain under constant stress of a unit spring beside one branch of strength 1 and T = 1.
    dt, gamma, memory, branch = 0.002, 0.0, blank(), of((1.0, 0.0))
    old, new = np.exp(-dt), (1 - np.exp(-dt)) / dt
    for step in range(1, 2001):
        more = (0.01 - gamma - old * memory.strain[0, 0, 0, 1]) / (1 + new)
        memory, gamma = advance_branches(memory, sheared(more), branch.time, dt), gamma + more
        if step in (500, 2000):
            exact = 0.01 * (1 - 0.5 * np.exp(-step * dt / 2))
            assert gamma == pytest.approx(exact, rel=1e-3)


def test_branches_do_not_depend_on_the_frame():
    rng = np.random.default_rng(1)
    A = 0.02 * rng.normal(size=(1, 3, 3))
    memory = advance_branches(blank(), 0.1 * rng.normal(size=(1, 3, 3)), np.ones((1, 2)), 1e-12)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned = BranchMemory(Q @ memory.strain @ Q.T, memory.volume)
    branch = of((1.0, 0.5), (2.0, 1.0))
    here = maxwell_stress(branch, advance_branches(memory, A, branch.time, 0.1))
    there = maxwell_stress(branch, advance_branches(turned, Q @ A @ Q.T, branch.time, 0.1))
    np.testing.assert_allclose(there, Q @ here @ Q.T, atol=1e-15)


def test_forgetting_never_makes_energy():
    rng = np.random.default_rng(2)
    memory, branch = (blank(50), MaxwellBranches(*(np.tile(v, (50, 1)) for v in ([1.0, 2.0], [1.0, 3.0], [1.0, 0.1]))))
    for _ in range(200):
        held = advance_branches(memory, 0.05 * rng.normal(size=(50, 3, 3)), branch.time, 1e-12)
        memory = advance_branches(held, np.zeros((50, 3, 3)), branch.time, 0.05)
        assert (branch_free_energy(branch, memory) <= branch_free_energy(branch, held)).all()
        assert (branch_free_energy(branch, memory) >= 0).all()


def test_work_is_free_energy_where_nothing_is_forgotten():
    memory, branch, work = blank(), of((3.0, 0.0), (2.0, 0.0), (1e9, 1e9)), 0.0
    A = np.array([[[1.0, 0.4, 0.0], [0.2, -0.5, 0.3], [0.0, 0.1, 0.2]]]) * 1e-4
    for _ in range(2000):
        after = advance_branches(memory, A, branch.time, 1.0)
        middle = 0.5 * (maxwell_stress(branch, memory) + maxwell_stress(branch, after))
        work += float(np.sum(middle * A))
        memory = after
    assert branch_free_energy(branch, memory)[0] == pytest.approx(work, rel=2e-4)
