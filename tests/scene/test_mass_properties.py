"""Bodies rest as their mass lies, not as their pieces would."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.geometry.convex_hull import ConvexPiece
from corporeal.scene.settle_bodies import settle_bodies
from corporeal.scene.settling_body import MassProperties, SettlingBody, cubes_mass_properties


def roll(inertial=None):
    """Lie along x."""
    mesh = trimesh.creation.cylinder(0.1, 0.4, sections=36)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    return SettlingBody("roll", vertices, triangles, (ConvexPiece(vertices, triangles),), inertial=inertial)


def test_cubes_add_up_to_a_box():
    side = 0.01
    axes = [side * (np.arange(n) + 0.5 - n / 2) for n in (10, 20, 30)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    mass = np.full(len(points), 2.0 / len(points))
    made = cubes_mass_properties(points + np.array([1.0, 2.0, 3.0]), mass, np.full(len(points), side))
    assert made.mass == pytest.approx(2.0)
    assert np.allclose(made.centre, [1.0, 2.0, 3.0])
    square = np.square([0.1, 0.2, 0.3])
    assert np.allclose(made.inertia, np.diag(2.0 / 12 * (square.sum() - square)), rtol=1e-9)


def test_matter_and_body_grow_together():
    body = roll(MassProperties(2.0, np.array([0.0, 0.0, 0.1]), np.eye(3)))
    grown = body.scaled(2.0)
    assert grown.mass == pytest.approx(16.0)
    assert np.allclose(grown.centre, [0.0, 0.0, 0.2])
    assert grown.inertial is not None
    assert np.allclose(grown.inertial.inertia, 32 * np.eye(3))


def test_a_roll_lies_with_its_heavy_side_down():
    """To within a face of 36: another face is no rest for a centre off the axis."""
    off = np.array([0.0, 0.03, 0.0])
    body = roll(MassProperties(1.0, off, np.diag([0.005, 0.016, 0.016])))
    (pose,), _ = settle_bodies([body], "scatter", 1, 1e-3)
    assert abs(pose.rotation[2, 0]) < 1e-4, "it lies"
    heavy = pose.rotation @ off
    assert heavy[2] < -0.03 * np.cos(np.radians(10.0))


def test_what_matter_is_uniform_changes_nothing():
    body = roll()
    mass = body.mass
    tall, wide = mass * (3 * 0.01 + 0.16) / 12, mass * 0.01 / 2
    same = replace(body, inertial=MassProperties(mass, np.zeros(3), np.diag([wide, tall, tall])))
    rests = [settle_bodies([b], "scatter", 3, 1e-3)[0][0] for b in (body, same)]
    assert np.allclose(rests[0].rotation, rests[1].rotation, atol=0.02)
