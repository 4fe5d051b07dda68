import numpy as np
import pytest

from corporeal.geometry.mesh_queries import sphere_directions
from corporeal.multiview.point_cloud_geometry import medial_ball_thickness, nearest_neighbours, point_normals


def plate(count, size, rng):
    """Points on the two large faces of a plate, and their normals."""
    xy = rng.uniform(-0.5, 0.5, (count, 2))
    side = np.where(np.arange(count) % 2, 1.0, -1.0)
    normal = np.stack([np.zeros(count), np.zeros(count), side], 1)
    return np.column_stack([xy, side * size / 2]), normal


def test_a_ball_is_as_thick_as_its_diameter_and_faces_outward():
    out = sphere_directions(3000)
    position = 0.35 * out + [4, -2, 9]
    near = nearest_neighbours(position, 12)
    np.testing.assert_array_equal(near[:, 0], np.arange(3000))
    normal = point_normals(position, near, out + np.array([0.5, 0, 0]))
    assert (np.sum(normal * out, 1) > np.cos(np.radians(3))).mean() > 0.99
    np.testing.assert_allclose(medial_ball_thickness(position, out), 0.7, rtol=0.01)


@pytest.mark.parametrize("size", [0.03, 0.1, 0.3])
def test_a_plate_is_as_thick_as_it_is(size):
    position, normal = plate(20000, size, np.random.default_rng(0))
    inner = (np.abs(position[:, :2]) < 0.5 - size).all(1)
    found = medial_ball_thickness(position, normal)[inner]
    assert np.median(found) == pytest.approx(size, rel=0.03)
    assert (np.abs(found / size - 1) < 0.15).mean() > 0.97


def test_noise_does_not_make_objects_thin():
    rng = np.random.default_rng(1)
    position, normal = plate(20000, 0.2, rng)
    position[:, 2] += rng.normal(0, 0.001, 20000)
    inner = (np.abs(position[:, :2]) < 0.3).all(1)
    found = medial_ball_thickness(position, normal)[inner]
    assert (np.abs(found / 0.2 - 1) < 0.15).mean() > 0.9


def test_what_has_one_side_only_is_as_thick_as_can_be():
    xy = np.random.default_rng(2).uniform(0, 1, (500, 2))
    position = np.column_stack([xy, np.zeros(500)])
    found = medial_ball_thickness(position, np.tile([0, 0, 1.0], (500, 1)))
    np.testing.assert_allclose(found, np.linalg.norm(np.ptp(position, axis=0)))


def test_few_points_have_few_neighbours():
    assert nearest_neighbours(np.zeros((3, 3)), 16).shape == (3, 3)
    assert nearest_neighbours(np.zeros((1, 3)), 16).shape == (1, 1)
