"""Six degrees of freedom made from particles."""

import numpy as np
import pytest

from corporeal.mpm.physics import rigid


def bricks(size, counts):
    axes = [((np.arange(n) + 0.5) / n - 0.5) * s for n, s in zip(counts, size, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def test_cubes_stacked_to_a_block_have_the_inertia_of_the_block_exactly():
    size, density = np.array([0.3, 0.2, 0.1]), 700.0
    points = bricks(size, (6, 4, 2)) + np.array([1.0, 2.0, 3.0])
    volume = np.full(len(points), size.prod() / len(points))
    mass = rigid.mass_and_inertia(points, density * volume, volume)
    whole = density * size.prod()
    expected = whole / 12 * (np.sum(size**2) * np.eye(3) - np.diag(size**2))
    assert mass.total == pytest.approx(whole)
    assert mass.centre == pytest.approx([1.0, 2.0, 3.0])
    assert mass.inertia == pytest.approx(expected, rel=1e-12)


def test_a_rotation_turns_by_its_angle_about_its_axis():
    R = rigid.rotation_matrix(np.array([0.0, 0.0, np.pi / 2]))
    assert R @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    tiny = np.array([1e-9, 2e-9, -1e-9])
    assert rigid.rotation_matrix(tiny) == pytest.approx(np.eye(3) + rigid.cross_matrix(tiny), abs=1e-17)
    for turn in np.random.default_rng(0).normal(0, 2, (20, 3)):
        R = rigid.rotation_matrix(turn)
        assert R @ R.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert R @ turn == pytest.approx(turn, abs=1e-14)


def test_a_free_spin_keeps_its_energy_and_stays_a_rotation():
    inertia, momentum = np.diag([1.0, 2.0, 3.0]), np.array([0.1, 4.0, 0.2])
    R, energies = np.eye(3), []
    for _ in range(2000):
        R = rigid.integrate_rotation(R, inertia, momentum, 0.01)
        spin = rigid.world_inverse_inertia(R, inertia) @ momentum
        energies.append(0.5 * spin @ momentum)
    assert R @ R.T == pytest.approx(np.eye(3), abs=1e-13)
    assert max(energies) - min(energies) < 1e-3 * energies[0]


def test_rigidly_moving_particles_are_fitted_exactly():
    rng = np.random.default_rng(1)
    points = rng.normal(0, 1, (30, 3))
    particle_mass, volume = rng.uniform(0.1, 2.0, 30), np.full(30, 1e-3)
    mass = rigid.mass_and_inertia(points, particle_mass, volume)
    V, w = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.1, -0.7])
    velocity = V + np.cross(w, points - mass.centre)
    linear, angular = rigid.fit_motion(mass, points, particle_mass, velocity)
    assert linear == pytest.approx(V, rel=1e-12)
    assert angular == pytest.approx(mass.inertia @ w, rel=1e-9)


def test_a_wedge_is_thin_where_it_is_thin():
    """It is a block as a whole: a share of its walls cannot tell its thin end."""
    slope, cell = np.radians(15), 0.011
    x, y = np.meshgrid(np.arange(0.0025, 0.5, 0.005), np.arange(-0.0975, 0.1, 0.005))
    x, y, face = x.ravel(), y.ravel(), np.ones((x.size, 3))
    above = np.column_stack([x, y, (0.5 - x) * np.tan(slope)])
    points = np.concatenate([above, above * [1, 1, 0]])
    out = np.array([np.sin(slope), 0.0, np.cos(slope)])
    normals = np.concatenate([out * face, [0.0, 0.0, -1.0] * face])
    assert rigid.thinness(points, normals, cell) == 0
    height = (0.5 - points[:, 0]) * np.tan(slope)
    thin = rigid.thin_places(points, normals, cell)
    assert thin[height < 1.5 * cell].mean() > 0.97
    assert not thin[height > 2.5 * cell].any()
    assert not rigid.thin_places(points * [1, 1, 0.1], normals, cell).any(), "it is thin as a whole"
