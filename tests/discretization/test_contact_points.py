"""Points through which rigid things touch the floor."""

import numpy as np
import trimesh

from corporeal.discretization.contact_points import EXTREME_DIRECTIONS_COUNT, extreme_corners


def resting(mesh, tilt):
    """Turn a mesh so that its first face lies flat, and then by a small angle [rad]."""
    turn = trimesh.geometry.align_vectors(mesh.face_normals[0], [0, 0, -1])
    mesh = mesh.copy().apply_transform(turn)
    return mesh.apply_transform(trimesh.transformations.rotation_matrix(tilt, [1, 0.3, 0]))


def test_what_is_round_keeps_all_corners_that_it_may_stand_on():
    ball = resting(trimesh.creation.icosphere(4), 1e-3)
    assert len(ball.vertices) > 4 * EXTREME_DIRECTIONS_COUNT
    points = {tuple(p) for p in extreme_corners(np.asarray(ball.vertices))}
    low = ball.vertices[ball.vertices[:, 2] < ball.vertices[:, 2].min() + 0.03]
    assert 10 < len(low)
    assert all(tuple(v) in points for v in low)


def test_a_fine_disc_stands_on_all_sides_of_its_rim():
    disc = trimesh.creation.cylinder(1.0, 0.1, sections=2500)
    points = extreme_corners(np.asarray(disc.vertices))
    low = points[points[:, 2] < -0.05 + 1e-12]
    angle = np.sort(np.arctan2(low[:, 1], low[:, 0]))
    assert np.diff(angle, append=angle[0] + 2 * np.pi).max() < np.radians(1)
    assert len(points) < 5000
