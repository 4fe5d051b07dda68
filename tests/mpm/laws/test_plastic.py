"""Where matter yields, and how it flows."""

import numpy as np
import pytest
from scipy.optimize import brentq

from corporeal.mpm.laws import drucker_prager as cone
from corporeal.mpm.laws import hencky
from corporeal.mpm.laws import von_mises as cylinder
from corporeal.mpm.laws.constitutive_law import YieldParameters, lame_parameters

MU, LAM = lame_parameters(1e3, 0.3)
YOUNG_PA = 1e3
ONE = np.ones(1)
SHEARED = np.array([[-0.06, -0.01, 0.04]])
"""Squeezed, and sheared in a plane without volume: the middle stress is the mean of the others."""


def principal_tau(strain):
    return 2 * MU * strain + LAM * strain.sum(axis=-1, keepdims=True)


def von_mises(strain, yield_stress, hardening=0.0, plastic=0.0):
    return cylinder.return_von_mises(strain, MU * ONE, yield_stress * ONE, hardening * ONE, plastic * ONE)


def drucker_prager(strain, degrees, cohesion=0.0, volume=0.0):
    n = numbers(len(strain), friction_angle=np.radians(degrees), cohesion=cohesion)
    back = cone.return_drucker_prager
    return back(strain, n.mu, n.lam, n.cone, n.apex, volume * np.ones(len(strain)))


def numbers(count, yield_stress=0.0, friction_angle=0.5, cohesion=0.0):
    """What return maps read, the same for ``count`` particles that do not harden."""
    one = np.ones(count)
    slope, apex = (cone.cone_slope(friction_angle), cone.apex_strain(friction_angle, cohesion, MU, LAM))
    given = (MU, LAM, yield_stress, 0.0, slope, apex, 0.0, 1.0)
    return YieldParameters(*(value * one for value in given))


def pull(total, steps, yield_stress, hardening=0.0):
    """Uniaxial tension: the axial stress and plastic strain after each step."""
    strain, plastic, history = np.zeros((1, 3)), 0.0, []
    for _ in range(steps):

        def squeezed(side, strain=strain, plastic=plastic):
            trial = strain + np.array([[total / steps, side, side]])
            return von_mises(trial, yield_stress, hardening, plastic)

        # The sides are free: find the lateral step that leaves no lateral stress.
        side = brentq(lambda s: principal_tau(squeezed(s).strain)[0, 1], -0.01, 0.01, xtol=1e-16)
        back = squeezed(side)
        strain, plastic = back.strain, plastic + back.plastic_strain[0]
        history.append((principal_tau(strain)[0, 0], plastic))
    return np.array(history)


def test_a_bar_in_uniaxial_tension_yields_exactly_at_the_yield_stress():
    stress, plastic = pull(0.03, 60, yield_stress=10.0).T
    elastic = plastic == 0.0
    assert elastic.sum() >= 18
    assert np.allclose(np.diff(stress[elastic]), YOUNG_PA * 0.03 / 60, rtol=1e-9)
    assert stress[-1] == pytest.approx(10.0, rel=1e-9)
    assert stress.max() <= 10.0 * (1 + 1e-9)


def test_hardening_raises_the_stress_by_its_modulus_times_the_plastic_strain():
    stress, plastic = pull(0.03, 60, yield_stress=10.0, hardening=200.0).T
    assert plastic[-1] > 0.01
    assert stress[-1] == pytest.approx(10.0 + 200.0 * plastic[-1], rel=1e-9)


def test_von_mises_flow_keeps_the_volume_and_the_pressure():
    strain = np.random.default_rng(0).normal(0, 0.1, (50, 3)) + np.array([0.2, 0.0, 0.0])
    one = np.ones(50)
    back = cylinder.return_von_mises(strain, MU * one, 5.0 * one, 0.0 * one, 0.0 * one)
    assert np.allclose(back.strain.sum(1), strain.sum(1), atol=1e-15)
    assert np.all(back.plastic_strain > 0)


def test_a_second_return_changes_nothing():
    strain = np.random.default_rng(1).normal(-0.02, 0.05, (50, 3))
    for cohesion in (0.0, 2.0):
        once = drucker_prager(strain, np.degrees(0.5), cohesion)
        again = drucker_prager(once.strain, np.degrees(0.5), cohesion)
        assert np.allclose(again.strain, once.strain, atol=1e-14)


@pytest.mark.parametrize("degrees", [20.0, 30.0, 40.0])
def test_sand_in_plane_strain_fails_at_its_friction_angle(degrees):
    back = drucker_prager(SHEARED, degrees)
    tau = principal_tau(back.strain)[0]
    assert back.plastic_strain[0] > 0
    sine = (tau.max() - tau.min()) / -(tau.max() + tau.min())
    assert np.degrees(np.arcsin(sine)) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize("degrees", [20.0, 35.0])
def test_cohesion_moves_the_cone_as_mohr_and_coulomb_say(degrees):
    cohesion, phi = 3.0, np.radians(degrees)
    back = drucker_prager(SHEARED, degrees, cohesion)
    tau = principal_tau(back.strain)[0]
    strength = -(tau.max() + tau.min()) * np.sin(phi) + 2 * cohesion * np.cos(phi)
    assert tau.max() - tau.min() == pytest.approx(strength, rel=1e-9)


def test_soil_pulled_apart_keeps_the_tension_of_the_apex_and_no_more():
    cohesion, degrees = 3.0, 25.0
    back = drucker_prager(np.array([[0.1, 0.08, 0.05]]), degrees, cohesion)
    apex = cohesion / np.tan(np.radians(degrees))
    assert np.allclose(principal_tau(back.strain), apex, rtol=1e-9)


def test_dry_sand_bears_no_tension():
    back = drucker_prager(np.array([[0.02, 0.01, -0.005]]), 30.0)
    assert np.abs(back.strain).max() == 0.0


def test_loose_sand_carries_stress_again_only_when_its_volume_is_back():
    opened = drucker_prager(np.full((1, 3), 0.01), 30.0)
    assert opened.volume[0] == pytest.approx(0.03)
    half = drucker_prager(opened.strain - 0.005, 30.0, volume=opened.volume[0])
    assert np.abs(half.strain).max() == 0.0
    assert half.volume[0] == pytest.approx(0.015)
    closed = drucker_prager(half.strain - 0.006, 30.0, volume=half.volume[0])
    assert closed.strain.sum() == pytest.approx(-0.003)
    assert closed.volume[0] == pytest.approx(0.0, abs=1e-15)


def test_sand_shaken_open_and_shut_gains_no_volume():
    strain, volume, total = np.zeros((1, 3)), 0.0, 0.0
    for step in [0.01, -0.01] * 20:
        back = drucker_prager(strain + step / 3, 30.0, volume=volume)
        strain, volume, total = back.strain, back.volume[0], total + step
        assert strain.sum() + volume == pytest.approx(total, abs=1e-14)


def test_flow_leaves_elastic_matter_untouched_and_loses_energy_elsewhere():
    rng = np.random.default_rng(2)
    F = np.eye(3) + rng.normal(0, 0.03, (200, 3, 3))
    flow = cylinder.flow(F, numbers(200, yield_stress=25.0), np.zeros(200), np.zeros(200))
    still = flow.plastic_strain == 0
    assert 0 < still.sum() < 200
    assert np.array_equal(flow.F[still], F[still])
    assert np.all(flow.loss[still] == 0) and np.all(flow.loss[~still] > 0)
    before, after = np.linalg.det(F), np.linalg.det(flow.F)
    assert np.allclose(before, after, rtol=1e-12)


def test_flow_of_sand_carries_the_friction_limit_back_to_f():
    rng = np.random.default_rng(3)
    F = (np.eye(3) + rng.normal(0, 0.03, (100, 3, 3))) * 0.97
    one, none = np.ones(100), np.zeros(100)
    flow = cone.flow(F, numbers(100, friction_angle=0.6), none, none)
    tau = hencky.tau(flow.F, MU * one, LAM * one)
    pressure = np.trace(tau, axis1=1, axis2=2) / 3
    shear = np.linalg.norm(tau - pressure[:, None, None] * np.eye(3), axis=(1, 2))
    limit = -3 * cone.cone_slope(0.6) * pressure
    assert np.all(shear <= limit * (1 + 1e-9) + 1e-9)
    assert np.any(flow.plastic_strain > 0)


def test_what_lies_open_at_rest_pays_nothing_more():
    """A soil torn open books its opening once, however many steps it then lies still."""
    torn = drucker_prager(np.full((1, 3), 0.05), 30, cohesion=1.0)
    again = drucker_prager(torn.strain, 30, cohesion=1.0, volume=torn.volume[0])
    assert torn.plastic_strain[0] > 1e-3
    assert again.plastic_strain[0] < 1e-12
    np.testing.assert_allclose(again.volume, torn.volume)


@pytest.mark.parametrize(("degrees", "cohesion"), [(20.0, 0.0), (30.0, 3.0), (40.0, 1.0)])
def test_soil_in_a_triaxial_cell_fails_on_its_cone(degrees, cohesion):
    """σ₁ - σ₃ = √3 sin φ (p + c cot φ), squeezed along one axis at a constant pressure around."""
    around, sine = 5.0, np.sin(np.radians(degrees))
    strain, volume, stress = np.full((1, 3), -around / (3 * LAM + 2 * MU)), 0.0, []
    for _ in range(80):

        def squeezed(side, strain=strain, volume=volume):
            step = np.array([[-1e-3, side, side]])
            return drucker_prager(strain + step, degrees, cohesion, volume)

        def excess(side, squeezed=squeezed):
            return principal_tau(squeezed(side).strain)[0, 1] + around

        back = squeezed(brentq(excess, -0.01, 0.01, xtol=1e-16))
        strain, volume = back.strain, back.volume[0]
        stress.append(-principal_tau(strain)[0, 0])
    pressure = (stress[-1] + 2 * around) / 3
    strength = np.sqrt(3.0) * sine * (pressure + cohesion / np.tan(np.radians(degrees)))
    assert stress[0] - around < 0.5 * strength
    assert stress[-1] - around == pytest.approx(strength, rel=1e-9)
    assert stress[-1] == pytest.approx(stress[-20], rel=1e-9)


@pytest.mark.parametrize("cohesion", [0.0, 2.0])
def test_soil_sheared_to_and_fro_gains_neither_volume_nor_pressure(cohesion):
    F, volume, slipped = np.eye(3)[None] * 0.99, np.zeros(1), 0.0
    for shear in [0.06, -0.06, -0.06, 0.06] * 25:
        step = np.eye(3)
        step[0, 1] = shear
        flow = cone.flow(step @ F, numbers(1, cohesion=cohesion), 0.0 * ONE, volume)
        F, volume = flow.F, flow.volume
        slipped += float(flow.plastic_strain[0])
    assert slipped > 0.5
    assert np.linalg.det(F)[0] == pytest.approx(0.99**3, rel=1e-12)
    assert volume[0] == pytest.approx(0.0, abs=1e-12)
