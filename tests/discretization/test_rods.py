"""Rods are found with their centreline; what is none is left alone."""

import numpy as np
import pytest
import trimesh

from corporeal.discretization.mesh_measures import measure_object
from corporeal.discretization.rods import SECTION_RING_RADIUS_RATIO, Rod, find_rod, rod_section_points


def found(mesh):
    rng = np.random.default_rng(0)
    anatomy = measure_object(np.array(mesh.vertices), np.array(mesh.faces), np.zeros(len(mesh.faces), np.int64), rng)
    return find_rod(anatomy.members[0], rng)


def bow(turn, radius=0.01, length=0.5):
    """A rod along an arc that turns by so much [rad]."""
    bend = length / turn

    def bent(points):
        angle, out = points[:, 2] / bend, bend - points[:, 0]
        return np.stack([bend - out * np.cos(angle), points[:, 1], out * np.sin(angle)], axis=1)

    straight = trimesh.creation.cylinder(radius, length, sections=24)
    vertices, faces = trimesh.remesh.subdivide_to_size(straight.vertices, straight.faces, 0.03)
    z = np.linspace(-length / 2, length / 2, 60)
    path = np.stack([0 * z, 0 * z, z], axis=1)
    return trimesh.Trimesh(bent(vertices), faces), bent(path)


def test_the_centreline_of_a_straight_rod_is_its_axis():
    mesh = trimesh.creation.cylinder(0.01, 0.5, sections=24)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 0]))
    rod = found(mesh)
    assert rod is not None
    assert rod.diameter == pytest.approx(0.02, rel=0.02)
    axis = mesh.principal_inertia_vectors[np.argmin(mesh.principal_inertia_components)]
    across = rod.points - np.outer(rod.points @ axis, axis)
    assert np.abs(across).max() < 1e-3
    assert np.linalg.norm(rod.points[-1] - rod.points[0]) == pytest.approx(0.5, rel=0.02)


def test_the_centreline_of_a_bent_rod_follows_it():
    mesh, path = bow(1.2)
    rod = found(mesh)
    assert rod is not None
    assert rod.diameter == pytest.approx(0.02, rel=0.05)
    away = np.linalg.norm(rod.points[:, None] - path[None], axis=2).min(axis=1)
    assert away.max() < 0.006


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box((0.5, 0.08, 0.02)),
        trimesh.creation.cone(0.02, 0.5),
        trimesh.creation.icosphere(3, 0.1),
        trimesh.util.concatenate(
            [trimesh.creation.cylinder(0.01, 0.5), trimesh.creation.cylinder(0.01, segment=[[0, 0, 0], [0.15, 0, 0.2]])]
        ),
    ],
    ids=["strip", "cone", "ball", "fork"],
)
def test_what_is_no_rod_is_left_alone(mesh):
    assert found(mesh) is None


def test_rings_have_the_second_moment_of_the_disc_they_stand_for():
    rod = Rod(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 0.01)
    points = rod_section_points(rod, 0.04, 0.01)
    assert len(points) == 600
    assert np.mean(points[:, 1] ** 2) == pytest.approx(0.04**2 / 16, rel=0.003)
    assert np.linalg.norm(points[:, 1:], axis=1) == pytest.approx(SECTION_RING_RADIUS_RATIO * 0.04)
