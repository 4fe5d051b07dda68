"""What stands a little before a known face, where photographs do not see it, is laid on it."""

import numpy as np
import pytest
import trimesh

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.surface.flatten_bumps import flatten_bumps
from corporeal.reconstruction.surface.photo_consistency import AgreedSurface

PIXEL, FLOOR = 0.02, -10.0
KNOWN = 4
"""Photographs know a face from so many pixels below its upper edge on."""


def body(made):
    fine = made.subdivide_to_size(0.8 * PIXEL)
    return Mesh(np.asarray(fine.vertices), np.asarray(fine.faces))


def bumped(mesh, way, where, high):
    """Move vertices by so many pixels along a way."""
    vertices = mesh.vertices.copy()
    vertices[where] += high * PIXEL * np.asarray(way)[where]
    return Mesh(vertices, mesh.triangles)


def laid(mesh, unknown):
    belief = np.where(unknown, 0.0, 1.0)
    every = np.ones(len(belief), bool)
    return flatten_bumps(AgreedSurface(mesh, belief), every, PIXEL, PIXEL, FLOOR).mesh


@pytest.fixture
def box():
    return body(trimesh.creation.box([0.6, 0.6, 0.6]))


def strip(mesh):
    """Vertices of the face +x that are next to its upper edge, and a smooth bump in it."""
    x, y, z = mesh.vertices.T
    unknown = z > 0.3 - KNOWN * PIXEL
    shape = np.cos(np.clip(y / (10 * PIXEL), -1, 1) * np.pi / 2)
    return unknown, unknown & (x > 0.299) & (z < 0.299), shape[:, None] * [1.0, 0.0, 0.0]


def test_a_bump_beside_a_known_face_is_laid_on_it(box):
    unknown, there, way = strip(box)
    begun = bumped(box, way, there, 1.0)
    assert begun.vertices[:, 0].max() > 0.3 + 0.9 * PIXEL
    made = laid(begun, unknown)
    assert made.vertices[:, 0].max() < 0.3 + 0.35 * PIXEL
    assert made.vertices[:, 0].min() == pytest.approx(-0.3, abs=0.1 * PIXEL)


def test_what_stands_far_before_a_face_stays(box):
    """A ledge of three pixels is a part of the thing."""
    unknown, there, way = strip(box)
    begun = bumped(box, way, there, 3.0)
    made = laid(begun, unknown)
    assert made.vertices[:, 0].max() > 0.3 + 2.5 * PIXEL


def test_what_is_hollow_beside_a_face_is_not_filled(box):
    unknown, there, way = strip(box)
    begun = bumped(box, way, there, -1.0)
    made = laid(begun, unknown)
    assert np.abs(made.vertices - begun.vertices)[there].max() < 0.5 * PIXEL
    deep = there & (begun.vertices[:, 0] < 0.3 - 0.9 * PIXEL)
    assert made.vertices[deep, 0].max() < 0.3 - 0.5 * PIXEL


def test_a_surface_of_which_photographs_know_nothing_stays(box):
    _, there, way = strip(box)
    begun = bumped(box, way, there, 1.0)
    made = laid(begun, np.ones(len(begun.vertices), bool))
    np.testing.assert_array_equal(made.vertices, begun.vertices)


def test_a_ball_stays_a_ball():
    """Planes through known places of it have all else behind them."""
    ball = body(trimesh.creation.icosphere(4, 0.4))
    made = laid(ball, ball.vertices[:, 2] > 0.35)
    away = np.linalg.norm(made.vertices, axis=1) / 0.4
    assert np.abs(away - 1).max() < 0.2 * PIXEL / 0.4
