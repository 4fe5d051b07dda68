"""Pictures of a scene are the same wherever the scene and its cameras are."""

import numpy as np
from splat_scenes import around, blobs

from corporeal.geometry.rotation import matrix
from corporeal.multiview.similarity import moved_cameras, moved_gaussians, similarity
from corporeal.reconstruction.gaussians.raster import NEAR, render


def test_pictures_before_and_after_a_similarity_are_the_same():
    rng = np.random.default_rng(1)
    scene, cameras = blobs(degree=3), around(3)
    scene.sh[:, 1:] = 0.3 * rng.normal(size=scene.sh[:, 1:].shape)
    for scale in (0.01, 1.0, 40.0):
        made = similarity(matrix(rng.normal(size=4)), scale, 3 * scale * rng.normal(size=3))
        moved = moved_gaussians(scene, made)
        for old, new in zip(cameras, moved_cameras(cameras, made), strict=True):
            before = render(scene, old, threads=1)
            after = render(moved, new, near=scale * NEAR, threads=1)
            np.testing.assert_allclose(after.rgb, before.rgb, atol=2e-4)
            np.testing.assert_allclose(after.alpha, before.alpha, atol=2e-4)
            there = np.isfinite(before.depth) & (before.alpha > 0.01)
            np.testing.assert_allclose(after.depth[there], scale * before.depth[there], rtol=2e-4)
