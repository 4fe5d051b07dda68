"""Fields of our own props, asked only near their surfaces."""

import numpy as np
import pytest

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.showcase import sdf, toys
from corporeal.showcase.snowman import snowman


def everywhere(f, axes, step):
    return f(np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)).reshape([len(a) for a in axes])


def test_a_surface_is_the_same_where_its_field_is_asked_everywhere(monkeypatch):
    near = toys.rubber_duck()
    monkeypatch.setattr(sdf, "values_near_surface", everywhere)
    for a, b in zip(near.parts, toys.rubber_duck().parts, strict=True):
        assert np.array_equal(a.mesh.vertices, b.mesh.vertices)


@pytest.mark.parametrize("model", [toys.rubber_duck, snowman])
def test_no_field_is_farther_from_zero_than_its_surface_allows(model, monkeypatch):
    rng = np.random.default_rng(1)
    asked, march = [], sdf._marching_cubes

    def kept(f, sampling):
        vertices, faces = march(f, sampling)
        asked.append((f, sampling, QueryMesh(Mesh(vertices, faces.astype(np.int64)))))
        return vertices, faces

    monkeypatch.setattr(sdf, "_marching_cubes", kept)
    model()
    for f, sampling, surface in asked:
        points = rng.uniform(sampling.low, sampling.high, (3000, 3))
        far = surface.closest(points)[0] + sampling.step / 4
        assert (np.abs(f(points)) / far).max() < sdf.MAX_FIELD_SLOPE
