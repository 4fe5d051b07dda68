"""Pictures of a scene are the same wherever the scene and its cameras are."""

import numpy as np
from splat_scenes import around, blobs

from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.multiview.similarity_transform import (
    apply_similarity_to_cameras,
    apply_similarity_to_gaussians,
    similarity_matrix,
)
from corporeal.reconstruction.gaussians.rasteriser_numba import NEAR_DEPTH_M, render


def test_pictures_before_and_after_a_similarity_are_the_same():
    rng = np.random.default_rng(1)
    scene, cameras = blobs(degree=3), around(3)
    scene.sh[:, 1:] = 0.3 * rng.normal(size=scene.sh[:, 1:].shape)
    for scale in (0.01, 1.0, 40.0):
        made = similarity_matrix(matrix_from_quaternion(rng.normal(size=4)), scale, 3 * scale * rng.normal(size=3))
        moved = apply_similarity_to_gaussians(scene, made)
        for old, new in zip(cameras, apply_similarity_to_cameras(cameras, made), strict=True):
            before = render(scene, old, threads=1)
            after = render(moved, new, near=scale * NEAR_DEPTH_M, threads=1)
            np.testing.assert_allclose(after.rgb, before.rgb, atol=2e-4)
            np.testing.assert_allclose(after.alpha, before.alpha, atol=2e-4)
            there = np.isfinite(before.depth) & (before.alpha > 0.01)
            np.testing.assert_allclose(after.depth[there], scale * before.depth[there], rtol=2e-4)
