"""What the triangles of a mesh stand for: something round, or faces and edges."""

import numpy as np
import pytest
import trimesh

from corporeal.discretization.surface_curvature import curve_points, is_round
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.point_sampling import sample_surface


def covered(shape, count=600):
    """Points on a mesh, its corners first, and how it curves there."""
    mesh = Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))
    samples = sample_surface(mesh, count, np.random.default_rng(0))[0]
    return curve_points(mesh, np.concatenate([mesh.vertices, samples]))


@pytest.mark.parametrize("fineness", [2, 3])
def test_a_drawn_ball_is_round_with_its_radius_everywhere(fineness):
    points, rows = covered(trimesh.creation.icosphere(fineness, 0.3))
    assert is_round(rows).all()
    assert rows[:, 6] == pytest.approx(0.3, rel=1e-3)
    assert rows[:, 7] == pytest.approx(0.0, abs=1e-3)
    middle = points - rows[:, :3] * rows[:, 6:7]
    assert np.abs(middle).max() < 1e-3 * 0.3  # its flat faces lie 13e-3 and 3e-3 deep


@pytest.mark.parametrize("fineness", [0, 1])
def test_twenty_or_eighty_faces_are_a_polyhedron(fineness):
    shape = trimesh.creation.icosphere(fineness)
    points, rows = covered(shape)
    assert not is_round(rows).any()
    assert points[: len(shape.vertices)] == pytest.approx(np.asarray(shape.vertices))


def test_a_drawn_cylinder_is_round_about_its_axis_alone():
    points, rows = covered(trimesh.creation.cylinder(0.2, 0.5, sections=32))
    curved = is_round(rows)
    side = np.abs(points[:, 2]) < 0.2499
    assert curved[side].all()
    assert not curved[~side & (np.hypot(*points.T[:2]) < 0.19)].any()
    assert rows[curved, 7] == pytest.approx(0.2, rel=1e-6)
    assert rows[curved, 6] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(rows[curved][:, [2, 5]]).max() < 1e-9  # normal and arc lie across the axis
    assert np.hypot(*points[side].T[:2]) == pytest.approx(0.2, rel=1e-4)


def test_a_box_has_no_round_corners():
    points, rows = covered(trimesh.creation.box((0.3, 0.2, 0.1)))
    assert not is_round(rows).any()
    assert np.abs(np.abs(points) / [0.15, 0.1, 0.05]).max() == pytest.approx(1.0)


def test_a_rounded_edge_leaves_the_faces_beside_it_flat():
    """Shading normals that lean over at the edge would make a bulge of the whole face."""
    angle = np.linspace(0, np.pi / 2, 9)
    arc = np.stack([0.45 + 0.05 * np.sin(angle), 0.45 + 0.05 * np.cos(angle)], axis=1)
    outline = np.concatenate([[[-0.5, -0.5], [-0.5, 0.5]], arc, [[0.5, -0.5]]])
    shape = trimesh.creation.extrude_triangulation(
        outline, np.array([[0, k, k + 1] for k in range(1, len(outline) - 1)]), 1.0
    )
    points, rows = covered(shape, 3000)
    curved = is_round(rows)
    on_edge = np.all(points[:, :2] > 0.45 + 1e-6, axis=1) & (np.abs(points[:, 2] - 0.5) < 0.49)
    assert curved[on_edge].mean() > 0.9
    inner = curved & on_edge & (rows[:, :2].min(axis=1) > np.sin(np.pi / 16))
    assert rows[inner, 7] == pytest.approx(0.05, rel=0.02)
    assert rows[curved, 7].max() < 0.101  # the first and last of them bend at one side alone
    assert not curved[points[:, :2].min(axis=1) < 0.449].any()


def test_the_inside_of_a_bowl_is_hollow_with_its_radius_and_has_no_ball():
    angle = np.linspace(0, 1.2, 24)
    profile = 0.3 * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1)
    shape = trimesh.creation.revolve(profile, sections=60)
    if np.mean(shape.face_normals[:, 2]) < 0:
        shape.invert()
    points, rows = covered(shape, 900)
    inner = (points[:, 2] > 0.005) & (points[:, 2] < 0.17)
    assert rows[inner][:, 10:] == pytest.approx(-1 / 0.3, rel=0.03)
    assert not is_round(rows[inner]).any()
    middle = points[inner] + 0.3 * rows[inner, :3]
    assert np.abs(middle - [0.0, 0.0, 0.3]).max() < 2e-3 * 0.3
