"""What every elastic law owes to its energy."""

import numpy as np
import pytest

from corporeal.core.types import Law
from corporeal.mpm import laws
from corporeal.mpm.laws import kinematics
from corporeal.mpm.laws.constitutive_law import lame_parameters

MU, LAM = lame_parameters(1e3, 0.3)


def some_rotations(count, rng):
    q, r = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    q *= np.sign(np.diagonal(r, axis1=1, axis2=2))[:, None, :]
    q[:, :, 0] *= np.linalg.det(q)[:, None]
    return q


def some_deformations(count=40, seed=0):
    """Random rotations and stretches between 0.4 and 2.5."""
    rng = np.random.default_rng(seed)
    stretch = np.exp(rng.uniform(-0.9, 0.9, (count, 3)))
    return kinematics.from_stretches(some_rotations(count, rng), stretch, some_rotations(count, rng))


def constants(count):
    return np.full(count, MU), np.full(count, LAM)


@pytest.mark.parametrize("law", Law)
def test_stress_is_the_derivative_of_the_energy(law):
    F, h = some_deformations(), 1e-5
    pk1 = laws.CONSTITUTIVE_LAWS[law].pk1(F, *constants(len(F)))
    slope = np.zeros_like(F)
    for i in range(3):
        for j in range(3):
            step = np.zeros((3, 3))
            step[i, j] = h
            up = laws.CONSTITUTIVE_LAWS[law].psi(F + step, *constants(len(F)))
            down = laws.CONSTITUTIVE_LAWS[law].psi(F - step, *constants(len(F)))
            slope[:, i, j] = (up - down) / (2 * h)
    error = np.abs(slope - pk1).max(axis=(1, 2)) / np.abs(pk1).max(axis=(1, 2))
    assert error.max() < 1e-6


@pytest.mark.parametrize("law", Law)
def test_kirchhoff_stress_is_pk1_times_f_transposed_and_symmetric(law):
    F = some_deformations()
    tau = laws.CONSTITUTIVE_LAWS[law].tau(F, *constants(len(F)))
    pk1 = laws.CONSTITUTIVE_LAWS[law].pk1(F, *constants(len(F)))
    scale = np.abs(tau).max()
    assert np.abs(tau - pk1 @ kinematics.transpose(F)).max() < 1e-11 * scale
    assert np.abs(tau - kinematics.transpose(tau)).max() < 1e-11 * scale


@pytest.mark.parametrize("law", Law)
def test_principal_stresses_are_those_of_the_kirchhoff_stress(law):
    """At large strains, and at some of 1e-4, whose stresses nearly cancel."""
    large = some_deformations()
    for F in (large, np.eye(3) + 1e-4 * (large - np.eye(3))):
        number = np.full(len(F), law.value)
        found = laws.principal_tau(number, F, *constants(len(F)))
        right = np.linalg.eigvalsh(laws.tau(number, F, *constants(len(F))))
        error = np.abs(np.sort(found, axis=1) - right)
        assert error.max() < 1e-5 * np.abs(right).max()


@pytest.mark.parametrize("law", Law)
def test_a_pure_rotation_costs_neither_stress_nor_energy(law):
    R = some_rotations(40, np.random.default_rng(1))
    assert np.abs(laws.CONSTITUTIVE_LAWS[law].tau(R, *constants(len(R)))).max() < 1e-11 * MU
    assert np.abs(laws.CONSTITUTIVE_LAWS[law].psi(R, *constants(len(R)))).max() < 1e-11 * MU


@pytest.mark.parametrize("law", Law)
def test_turning_the_observer_turns_the_stress_and_keeps_the_energy(law):
    F = some_deformations()
    Q = some_rotations(len(F), np.random.default_rng(2))
    tau = laws.CONSTITUTIVE_LAWS[law].tau(F, *constants(len(F)))
    turned = laws.CONSTITUTIVE_LAWS[law].tau(Q @ F, *constants(len(F)))
    expected = Q @ tau @ kinematics.transpose(Q)
    assert np.abs(turned - expected).max() < 1e-10 * np.abs(tau).max()


@pytest.mark.parametrize("law", Law)
def test_all_laws_agree_with_linear_elasticity_at_small_strain(law):
    rng = np.random.default_rng(3)
    gradient = 1e-6 * rng.standard_normal((20, 3, 3))
    strain = 0.5 * (gradient + kinematics.transpose(gradient))
    linear = 2 * MU * strain + LAM * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    tau = laws.CONSTITUTIVE_LAWS[law].tau(np.eye(3) + gradient, *constants(20))
    assert np.abs(tau - linear).max() < 2e-5 * np.abs(linear).max()


def test_mixed_laws_are_answered_particle_by_particle():
    F = some_deformations(len(Law))
    law = np.array([law.value for law in Law])
    tau = laws.tau(law, F, *constants(len(F)))
    psi = laws.psi(law, F, *constants(len(F)))
    for i, rule in enumerate(Law):
        assert np.allclose(tau[i], laws.CONSTITUTIVE_LAWS[rule].tau(F[i : i + 1], *constants(1))[0])
        assert np.allclose(psi[i], laws.CONSTITUTIVE_LAWS[rule].psi(F[i : i + 1], *constants(1))[0])


def test_the_decomposition_is_accurate_for_flat_and_mirrored_matter():
    rng = np.random.default_rng(4)
    for stretch in ([1.0, 0.5, 1e-4], [1.0, 0.8, -0.3], [3.0, 1.0, 0.3], [1.0, 1.0, 1.0]):
        F = kinematics.from_stretches(
            some_rotations(50, rng), np.tile(np.array(stretch), (50, 1)), some_rotations(50, rng)
        )
        U, found, V = kinematics.signed_svd(F)
        assert np.abs(kinematics.from_stretches(U, found, V) - F).max() < 1e-13
        assert np.allclose(found, stretch, atol=1e-13)
        for rotation in (U, V, kinematics.polar(F)[0]):
            assert np.allclose(np.linalg.det(rotation), 1.0)
            assert np.abs(rotation @ kinematics.transpose(rotation) - np.eye(3)).max() < 1e-13
        R, S = kinematics.polar(F)
        assert np.abs(R @ S - F).max() < 1e-13
        assert np.abs(S - kinematics.transpose(S)).max() < 1e-13


@pytest.mark.parametrize(
    "stretch",
    [[2.0, 1.0, 0.5], [1.0, 1.0, 0.5], [0.7, 0.7, 0.7], [1.0, 1.0, 1e-6], [1.0, 0.8, -0.3]],
    ids=["all differ", "two alike", "all alike", "flat", "mirrored"],
)
def test_stretches_without_a_decomposition_store_the_same_energy(stretch):
    rng = np.random.default_rng(5)
    F = kinematics.from_stretches(
        some_rotations(200, rng), np.tile(np.array(stretch), (200, 1)), some_rotations(200, rng)
    )
    found, exact = kinematics.stretches(F), kinematics.signed_svd(F)[1]
    np.testing.assert_allclose(found, exact, atol=1e-7)
    for energy in (np.square, lambda x: (x - 1.0) ** 2, lambda x: np.log(np.abs(x)) ** 2):
        a, b = energy(found).sum(axis=1), energy(exact).sum(axis=1)
        np.testing.assert_allclose(a, b, rtol=1e-9)


def test_small_strains_store_the_energy_of_linear_elasticity():
    rng = np.random.default_rng(6)
    mu, lam = constants(200)
    for size in (1e-3, 1e-5):
        E = size * rng.normal(size=(200, 3, 3))
        E = 0.5 * (E + kinematics.transpose(E))
        trace = np.trace(E, axis1=1, axis2=2)
        linear = mu * np.sum(E * E, axis=(1, 2)) + 0.5 * lam * trace**2
        for law in Law:
            psi = laws.CONSTITUTIVE_LAWS[law].psi(np.eye(3) + E, mu, lam)
            np.testing.assert_allclose(psi, linear, rtol=30 * size)


def test_a_confined_bar_shortens_by_the_p_wave_modulus():
    strain = 1e-7
    F = np.diag([1.0, 1.0, 1.0 - strain])[None]
    for law in Law:
        tau = laws.CONSTITUTIVE_LAWS[law].tau(F, *constants(1))[0]
        assert tau[2, 2] == pytest.approx(-(LAM + 2 * MU) * strain, rel=1e-6)
        assert tau[0, 0] == pytest.approx(-LAM * strain, rel=1e-6)


@pytest.mark.parametrize("law", Law)
def test_no_wave_along_a_principal_axis_is_faster_than_its_bound(law):
    """And at rest the bound is the P-wave modulus, which no smaller one would be."""
    rng, h = np.random.default_rng(6), 1e-6
    F = np.exp(rng.uniform(-0.6, 0.9, (400, 3)))[:, None, :] * np.eye(3)
    rule, numbers = laws.CONSTITUTIVE_LAWS[law], constants(400)
    bound = rule.wave_modulus(F, *numbers)
    for d in range(3):
        stretched = F.copy()
        stretched[:, d, d] *= 1.0 + h
        rise = (rule.tau(stretched, *numbers) - rule.tau(F, *numbers))[:, d, d] / h
        assert (rise < bound * (1.0 + 1e-4)).all()
    rest = rule.wave_modulus(np.eye(3)[None], *constants(1))
    assert rest == pytest.approx(LAM + 2 * MU)
