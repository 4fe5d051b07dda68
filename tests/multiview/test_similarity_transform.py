"""Scenes are turned, scaled and moved as one."""

import numpy as np
import pytest

from corporeal.core.types import Camera, Gaussians
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.multiview.similarity_transform import (
    apply_similarity_to_cameras,
    apply_similarity_to_gaussians,
    apply_similarity_to_points,
    decompose_similarity,
    similarity_matrix,
)


def some(rng):
    """Return a similarity, its inverse, and the parts it was made of."""
    parts = (matrix_from_quaternion(rng.normal(size=4)), float(np.exp(rng.normal())), rng.normal(size=3))
    made = similarity_matrix(*parts)
    return made, np.linalg.inv(made), parts


def test_a_similarity_comes_apart_as_it_was_put_together(rng):
    made, _, (rotation, scale, shift) = some(rng)
    found = decompose_similarity(made)
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-12)
    assert found.scale == pytest.approx(scale, rel=1e-12)
    np.testing.assert_allclose(found.shift, shift)


@pytest.mark.parametrize(
    "bad",
    [
        np.diag([1.0, 1, -1, 1]),
        np.diag([1.0, 1, 1.1, 1]),
        np.zeros((4, 4)),
        np.full((4, 4), np.nan),
        np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]),
    ],
)
def test_what_mirrors_shears_or_projects_is_refused(bad):
    with pytest.raises(ValueError, match="not a similarity"):
        decompose_similarity(bad)


def test_a_moved_camera_sees_a_moved_point_where_it_was(rng):
    made, back, (_, scale, _) = some(rng)
    pose = similarity_matrix(matrix_from_quaternion(rng.normal(size=4)), 1.0, rng.normal(size=3))
    camera = Camera(np.array([[80.0, 0, 32], [0, 90, 24], [0, 0, 1]]), pose, 64, 48)
    points = pose[:3, 3] + rng.normal(size=(20, 3)) + 4 * pose[:3, 2]
    (after,) = apply_similarity_to_cameras([camera], made)

    def seen(camera, points):
        from_world = np.linalg.inv(camera.world_from_camera)
        return apply_similarity_to_points(points, from_world)

    np.testing.assert_allclose(
        seen(after, apply_similarity_to_points(points, made)), scale * seen(camera, points), atol=1e-10
    )
    np.testing.assert_allclose(np.linalg.det(after.world_from_camera), 1)
    (again,) = apply_similarity_to_cameras([after], back)
    np.testing.assert_allclose(again.world_from_camera, camera.world_from_camera, atol=1e-10)


def test_gaussians_there_and_back_are_the_same(rng):
    made, back, _ = some(rng)
    rotation = rng.normal(size=(9, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    before = Gaussians(
        rng.normal(size=(9, 3)), rotation, rng.uniform(0.1, 1, (9, 3)), rng.uniform(size=9), rng.normal(size=(9, 16, 3))
    )
    after = apply_similarity_to_gaussians(apply_similarity_to_gaussians(before, made), back)
    for name in ("mean", "scale", "opacity", "sh"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-9)
    same = np.abs(np.einsum("nd,nd->n", after.rotation, before.rotation))
    np.testing.assert_allclose(same, 1, atol=1e-12)
