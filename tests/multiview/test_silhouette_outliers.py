"""A view that shows the object elsewhere than all others is found by its silhouette."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.multiview.silhouette_outliers import compare_with_hull_of_others, outlier_views
from corporeal.render.camera_placement import camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, patterned, ring

COUNT = 16


@pytest.fixture(scope="module")
def seen():
    """Masks of a block from all around, and their cameras."""
    stage, aims = RayScene(patterned()), ring(np.arange(COUNT) * 360 / COUNT, (160, 120))
    masks = [np.uint8(255) * (identify_triangles(stage, aim)[0] >= OF_SLAB) for aim in aims]
    return np.stack(masks), tuple(camera_from_aim(aim) for aim in aims)


def test_right_views_are_kept(seen):
    overlap = compare_with_hull_of_others(*seen).overlap
    assert overlap.min() > 0.85 * np.median(overlap) and np.median(overlap) > 0.8
    assert outlier_views(*seen) == ()


def test_views_that_were_put_elsewhere_are_found(seen):
    masks, cameras = seen
    shift = np.eye(4)
    shift[:3, 3] = 0.05, 0.05, 0.0  # as on the next piece of a carpet's pattern: half a block
    put = list(cameras)
    for k in (3, 10):
        put[k] = replace(cameras[k], world_from_camera=shift @ cameras[k].world_from_camera)
    assert outlier_views(masks, tuple(put)) == (3, 10)


def test_an_inverted_mask_is_found(seen):
    masks, cameras = seen
    masks = masks.copy()
    masks[5] = 255 - masks[5]
    assert outlier_views(masks, cameras) == (5,)


def test_an_empty_mask_says_nothing(seen):
    masks, cameras = seen
    masks = masks.copy()
    masks[5] = 0
    assert np.isnan(compare_with_hull_of_others(masks, cameras).overlap[5])
    assert outlier_views(masks, cameras) == ()


def test_none_is_left_out_where_half_contradict_the_others_or_few_look(seen):
    masks, cameras = seen
    turned = np.concatenate([masks[: COUNT // 2], masks[COUNT // 2 :][::-1, ::-1]])
    assert outlier_views(turned, cameras) == ()
    assert outlier_views(masks[:7], cameras[:7]) == ()


def test_no_holes_are_seen_where_a_step_of_the_grid_is_more_than_a_pixel(seen):
    """The object fills the picture; with pictures of 128 pixels up to 8 % of a mask were holes."""
    masks, cameras = seen
    rows, columns = np.nonzero(masks.any(axis=0))
    low, high = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()]) + 1
    closer = masks[:, low[1] : high[1], low[0] : high[0]]
    closer = np.repeat(np.repeat(closer, 4, axis=1), 4, axis=2)
    assert compare_with_hull_of_others(closer, tuple(_cut(c, low, high, 4) for c in cameras)).filled.min() > 0.96


def _cut(camera, low, high, finer):
    """Give the camera of a part of its picture, with more pixels."""
    K = np.diag([finer, finer, 1.0]) @ camera.K
    K[:2, 2] -= finer * low
    width, height = (finer * (high - low)).tolist()
    return replace(camera, K=K, width=width, height=height)
