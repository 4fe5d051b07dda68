"""Rays and meshes: against what a plane says, and against trimesh."""

import numpy as np
import pytest
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh, RayCaster, random_rotation

COUNT = 2000


def made(name, size):
    """Return a closed mesh about a place that is not the origin, turned."""
    solid = {
        "ball": lambda: trimesh.creation.icosphere(3),
        "box": lambda: trimesh.creation.box((1.0, 0.4, 0.02)),
        "tube": lambda: trimesh.creation.annulus(0.45, 0.5, 1.0),
    }[name]()
    turn = random_rotation(np.random.default_rng(4))
    vertices = size * (np.asarray(solid.vertices) @ turn.T + (0.7, -0.2, 0.4))
    return Mesh(vertices, np.asarray(solid.faces, dtype=np.int64))


def rays(mesh, rng):
    """Rays from about a mesh to all sides, a quarter of them to its corners."""
    low, span = mesh.vertices.min(axis=0), np.ptp(mesh.vertices, axis=0)
    origin = low + span * rng.uniform(-0.5, 1.5, (COUNT, 3))
    way = rng.normal(size=(COUNT, 3))
    corner = mesh.vertices[rng.integers(len(mesh.vertices), size=COUNT // 4)]
    way[: COUNT // 4] = corner - origin[: COUNT // 4]
    return origin, way / np.linalg.norm(way, axis=1, keepdims=True)


@pytest.mark.parametrize("size", [1e-3, 1.0, 50.0])
@pytest.mark.parametrize("name", ["ball", "box", "tube"])
def test_hits_are_those_of_trimesh(name, size):
    mesh = made(name, size)
    same = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    caster, sure = RayCaster(mesh), RayMeshIntersector(same)
    origin, way = rays(mesh, np.random.default_rng(5))
    ours = caster.hits(origin, way)
    place, ray, triangle = sure.intersects_location(origin, way, multiple_hits=False)
    assert len(ray) > COUNT / 4
    assert np.array_equal(ours.ray, ray) and np.array_equal(ours.triangle, triangle)
    assert np.abs(ours.place - place).max() < 1e-14 * np.abs(mesh.vertices).max()
    assert np.array_equal(caster.first(origin, way), sure.intersects_first(origin, way))


def test_a_ray_meets_a_slab_where_its_face_is():
    box = trimesh.creation.box((1.0, 1.0, 0.2))
    slab = QueryMesh(Mesh(np.asarray(box.vertices), np.asarray(box.faces)))
    origin, way = np.array([[0.1, 0.2, 1.0], [0.1, 0.2, 1.0]]), np.array([[0, 0, -1.0], [0, 0, 1]])
    assert slab.reach(origin, way) == pytest.approx([0.9, np.inf])
    assert (slab.hit(origin, way) >= 0).tolist() == [True, False]


def test_nothing_is_hit_where_there_is_nothing():
    nothing = RayCaster(Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))
    assert nothing.first(np.zeros((2, 3)), np.ones((2, 3))).tolist() == [-1, -1]
    assert [len(row) for row in nothing.hits(np.zeros((2, 3)), np.ones((2, 3)))] == [0, 0, 0]
