"""What nobody saw of a surface goes on as what is about it does."""

import numpy as np
import pytest
from skimage.measure import marching_cubes

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.surface.fairing import fair_unobserved_patches, neighbour_mean_matrix, smooth_taubin

CELL = 0.04
MIDDLE = np.array([0.0, 0.0, 2.0])


def ball(cap: float) -> tuple[Mesh, np.ndarray]:
    """A unit ball about (0, 0, 2), flat below an angle from its lowest point [deg], and that."""
    axis = np.arange(-1.3, 1.3, CELL)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    cut = -np.cos(np.radians(cap))
    inside = np.maximum(np.sqrt(x * x + y * y + z * z) - 1, cut - z)
    v, f, _, _ = marching_cubes(inside, 0.0, spacing=(CELL,) * 3, gradient_direction="descent")
    mesh = Mesh(v.astype(np.float64) + axis[0], f.astype(np.int64))
    mesh = smooth_taubin(mesh, -9.0, 4, neighbour_mean_matrix(mesh))
    unknown = mesh.vertices[:, 2] < cut + CELL
    return Mesh(mesh.vertices + MIDDLE, mesh.triangles), unknown


def off(mesh: Mesh, cap: float) -> tuple[float, float]:
    """Return how far out the cap is in the mean, and how much it is tilted [rad]."""
    out = mesh.vertices - MIDDLE
    far = np.linalg.norm(out, axis=1)
    low = -out[:, 2] / far > np.cos(np.radians(cap))
    flat = np.column_stack([out[low, :2], np.ones(low.sum())])
    x, y, mean = np.linalg.lstsq(flat, far[low] - 1, rcond=None)[0]
    return float(mean), float(np.hypot(x, y))


def test_the_underside_of_a_ball_is_round():
    mesh, unknown = ball(25)
    none = np.zeros(len(unknown), bool)
    assert off(mesh, 15)[0] < -0.05
    made = fair_unobserved_patches(mesh, unknown, none, CELL, 0.0, neighbour_mean_matrix(mesh))
    mean, tilt = off(made, 15)
    assert abs(mean) < 0.01 and tilt < 0.003
    np.testing.assert_array_equal(made.triangles, mesh.triangles)


def test_noise_about_it_hardly_tilts_it():
    """A control that trusts what is about the patch is tilted several times as much."""
    mesh, unknown = ball(25)
    mean, normals = neighbour_mean_matrix(mesh), mesh.vertex_normals
    noise = np.random.default_rng(0).normal(size=len(unknown))
    for _ in range(4):
        noise = mean @ noise
    noise *= np.where(unknown, 0, 0.003 / noise.std())
    rough = Mesh(mesh.vertices + noise[:, None] * normals, mesh.triangles)
    none = np.zeros(len(unknown), bool)
    tilt = off(fair_unobserved_patches(rough, unknown, none, CELL, 0.0, neighbour_mean_matrix(mesh)), 15)[1]
    control = off(fair_unobserved_patches(rough, unknown, ~unknown, CELL, 0.0, neighbour_mean_matrix(mesh)), 15)[1]
    assert tilt < control / 2


def test_sides_that_fold_onto_themselves_do_no_harm():
    mesh, unknown = ball(25)
    v = mesh.vertices.copy()
    for a, b, _ in mesh.triangles[unknown[mesh.triangles].all(axis=1)][:20]:
        v[b] = v[a]
    none = np.zeros(len(unknown), bool)
    made = fair_unobserved_patches(Mesh(v, mesh.triangles), unknown, none, CELL, 0.0, neighbour_mean_matrix(mesh))
    assert abs(off(made, 15)[0]) < 0.02


def test_the_known_about_a_large_patch_stays_where_it_is():
    """A ball hardly seen: its sides are smoothed over two cells and not over a tenth of it."""
    mesh, unknown = ball(80)
    made = fair_unobserved_patches(mesh, unknown, np.zeros(len(unknown), bool), CELL, 0.0, neighbour_mean_matrix(mesh))
    away = np.linalg.norm(made.vertices - MIDDLE, axis=1)[~unknown] - 1
    assert np.abs(away).mean() < 0.003 and np.abs(away).max() < 0.03


def test_it_stays_above_the_floor_and_what_is_still_stays():
    mesh, unknown = ball(25)
    still = ~unknown & (mesh.vertices[:, 0] > 0)
    made = fair_unobserved_patches(mesh, unknown, still, CELL, 1.05, neighbour_mean_matrix(mesh))
    assert made.vertices[:, 2].min() == pytest.approx(1.05)
    np.testing.assert_array_equal(made.vertices[still, :2], mesh.vertices[still, :2])


def test_a_patch_that_faces_elsewhere_stays():
    """Below a half ball, as below a table, nobody knows."""
    mesh, unknown = ball(90)
    none = np.zeros(len(unknown), bool)
    made = fair_unobserved_patches(mesh, unknown, none, CELL, 0.0, neighbour_mean_matrix(mesh))
    np.testing.assert_allclose(made.vertices, mesh.vertices)
