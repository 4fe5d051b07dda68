"""Points that are bound to a mesh follow it."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.surface_binding import bind_to_surface, deform_bound_points


def plate(size, count):
    """Return a square sheet of ``size`` [m] with ``count`` squares along each side."""
    line = np.linspace(0, size, count + 1)
    x, y = (k.ravel() for k in np.meshgrid(line, line, indexing="ij"))
    number = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    a, b, c, d = (k.ravel() for k in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return Mesh(
        np.column_stack([x, y, 0 * x]), np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    )


def test_points_come_back():
    box = trimesh.creation.box((1, 2, 3)).subdivide()
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    mesh = Mesh(np.asarray(box.vertices), np.asarray(box.faces))
    assert np.abs(deform_bound_points(bind_to_surface(points, mesh), mesh.vertices) - points).max() < 1e-12


def test_a_rigid_motion_moves_them_rigidly():
    rng = np.random.default_rng(1)
    turn, way = Rotation.from_rotvec([0.5, -1.2, 2.0]), np.array([3.0, -2.0, 1.0])
    for mesh in (trimesh.creation.box((1, 2, 3)).subdivide(), trimesh.creation.icosphere(2)):
        points = np.concatenate([np.asarray(mesh.vertices) * 1.05, rng.uniform(-2, 2, (300, 3))])
        binding = bind_to_surface(points, Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
        moved = deform_bound_points(binding, turn.apply(np.asarray(mesh.vertices)) + way)
        assert np.abs(moved - turn.apply(points) - way).max() < 1e-9


def test_faces_of_a_plate_keep_their_distance_when_it_is_bent():
    """A plate of 20 mm is bent to a radius of 0.25 m: its faces lie at 0.24 and 0.26 m."""
    half, radius = 0.01, 0.25
    mesh = plate(1.0, 40)
    rng = np.random.default_rng(2)
    flat = rng.uniform(0, 1, (2000, 2))
    points = np.concatenate([np.column_stack([flat, np.full(2000, z)]) for z in (half, -half)])
    x, y, _ = mesh.vertices.T
    angle = x / radius
    bent = np.column_stack([radius * np.sin(angle), y, radius * np.cos(angle)])
    now = deform_bound_points(bind_to_surface(points, mesh), bent)
    away = np.hypot(now[:, 0], now[:, 2]).reshape(2, -1)
    assert np.abs((away[0] - away[1]) / (2 * half) - 1).max() < 0.02
    assert np.abs(away - radius - np.array([[half], [-half]])).max() < 0.1 * half
    assert np.abs(now[:, 1] - points[:, 1]).max() < 1e-9


def test_boards_at_a_junction_follow_their_own_faces():
    """Points on a shelf stay on it when the wall that it is welded to is wound either way."""
    q = plate(1.0, 4)
    wall = np.column_stack([q.vertices[:, 0], 0.5 + 0 * q.vertices[:, 0], q.vertices[:, 1] - 0.5])
    for wound in (q.triangles, q.triangles[:, ::-1]):
        both = trimesh.Trimesh(
            np.concatenate([q.vertices, wall]), np.concatenate([q.triangles, wound + len(wall)]), process=False
        )
        both.merge_vertices()
        mesh = Mesh(np.asarray(both.vertices), np.asarray(both.faces))
        points = np.array([[0.3, 0.45, 0.01], [0.3, 0.55, -0.01]])
        binding = bind_to_surface(points, mesh)
        assert np.abs(binding.rest).max() < 1e-9 and np.abs(binding.offsets).max() < 0.0101
