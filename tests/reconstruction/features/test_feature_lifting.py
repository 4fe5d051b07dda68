import tracemalloc

import numpy as np
import pytest
from box_scenes import TWO, around, cast, on_faces, one_hot, unhidden
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud, Gaussians
from corporeal.reconstruction.features.feature_lifting import (
    LiftedFeatures,
    back_projection,
    fill_unseen_points,
    lift_features,
    uplift_features,
    visible_points,
)
from corporeal.reconstruction.gaussians.rasteriser_numba import gaussian_weights

PIXEL = 2.2 / 120
"""Width of a pixel at the middle of the boxes [m]."""


@pytest.fixture(scope="module")
def boxes():
    cameras = around(12)
    depth, which = (np.stack(part) for part in zip(*(cast(TWO, c) for c in cameras), strict=True))
    return cameras, depth, which, *on_faces(TWO, 4000, np.random.default_rng(0))


def test_points_that_something_stands_before_are_not_seen(boxes):
    cameras, depth, _, position, normal, owner = boxes
    missed, falsely = [], []
    for camera, picture in zip(cameras, depth, strict=True):
        free = unhidden(TWO, position, normal, owner, camera)
        said = visible_points(position, camera, picture)
        missed.append(np.mean(~said[free]))
        behind, _ = KDTree(position[free]).query(position[said & ~free])
        assert behind.max() < 5.5 * PIXEL
        falsely.append(np.sum(behind > 2 * PIXEL) / len(position))
    assert np.mean(falsely) < 0.002
    assert np.mean(missed) < 0.07


def test_what_is_hidden_takes_nothing_from_what_hides_it():
    """The far box stands in the near one's shadow; only the view from the side shows it."""
    near, far = ((-0.4, -0.4, 0.0), (0.4, -0.3, 0.8)), ((-0.1, 0.2, 0.3), (0.1, 0.3, 0.5))
    front, side = around(1)[0], around(1)[0]
    front.world_from_camera[:3] = [[1, 0, 0, 0], [0, 0, 1, -2.2], [0, -1, 0, 0.4]]
    side.world_from_camera[:3] = [[0, 0, -1, 2.2], [1, 0, 0, 0], [0, -1, 0, 0.4]]
    views = [cast((near, far), camera) for camera in (front, side)]
    depth = np.stack([d for d, _ in views])
    maps = [one_hot(which, 2, 2) for _, which in views]
    position = np.stack([np.full(5, 0.1), np.linspace(0.23, 0.26, 5), np.full(5, 0.4)], 1)
    lifted = back_projection(position, (front,), depth[:1], maps[:1])
    assert (lifted.seen == 0).all() and (lifted.mean == 0).all()
    lifted = back_projection(position, (front, side), depth, maps)
    np.testing.assert_array_equal(lifted.seen, 1)
    np.testing.assert_allclose(lifted.mean, np.tile([0, 0, 1.0], (5, 1)), atol=1e-6)


def test_boxes_that_touch_are_distinguished_by_where_their_points_fall(boxes):
    """On maps of 12 × 12 patches; what no view shows (the undersides) included."""
    cameras, depth, which, position, _, owner = boxes
    maps = [one_hot(w, 8, 2) for w in which]
    lifted = back_projection(position, cameras, depth, maps)
    told = fill_unseen_points(position, lifted).mean[:, 1:].argmax(1)
    assert np.mean(lifted.seen == 0) > 0.1
    assert np.mean(told == owner) >= 0.92
    assert np.mean((told == owner)[lifted.seen > 3]) >= 0.98


def test_uplift_gives_every_gaussian_what_its_pixels_show():
    rng = np.random.default_rng(1)
    truth = rng.integers(0, 5, 300)
    cells = (12, 12)
    shares, maps = [], []
    for _ in range(6):
        shown = np.where(rng.random(144) < 0.9, rng.integers(0, 300, 144), -1)
        at = np.flatnonzero(shown >= 0)
        share = rng.uniform(0.5, 4, len(at))
        shares.append(csr_array((share, (shown[at], at)), shape=(300, 144)))
        codes = np.zeros((144, 6))
        codes[at, truth[shown[at]]] = 1
        codes[shown < 0, 5] = 1
        maps.append(codes.reshape(12, 12, 6))
    lifted = uplift_features(shares.__getitem__, cells, maps, 300)
    known = lifted.seen > 0
    assert 0.9 < known.mean() < 1
    assert (lifted.mean.argmax(1) == truth)[known].all()
    np.testing.assert_allclose(lifted.mean[known].sum(1), 1, rtol=1e-6)


def test_uplift_is_the_weighted_mean():
    rng = np.random.default_rng(2)
    dense = rng.random((3, 7, 20)) * (rng.random((3, 7, 20)) < 0.5)
    maps = rng.normal(size=(3, 4, 5, 9))
    shares = [csr_array(w) for w in dense]
    expected = np.einsum("vnc,vcd->nd", dense, maps.reshape(3, 20, 9))
    expected /= dense.sum((0, 2))[:, None]
    lifted = uplift_features(shares.__getitem__, (4, 5), list(maps), 7)
    np.testing.assert_allclose(lifted.mean, expected, rtol=2e-5, atol=1e-6)
    np.testing.assert_array_equal(lifted.seen, (dense.sum(2) > 0.01).sum(0))


def test_cells_need_not_be_patches():
    """A map that is linear over the picture stays so, whatever its resolution."""
    y, x = (np.mgrid[:6, :8] + 0.5) / [[[6]], [[8]]]
    coarse = np.stack([x, y, np.ones_like(x)], -1)
    row, column = 20, 27
    share = csr_array(([2.0], ([0], [row * 64 + column])), shape=(2, 48 * 64))
    lifted = uplift_features([share].__getitem__, (48, 64), [coarse], 2)
    np.testing.assert_allclose(lifted.mean[0], [27.5 / 64, 20.5 / 48, 1], rtol=1e-6)
    np.testing.assert_array_equal(lifted.seen, [1, 0])


def test_a_sliver_of_a_gaussian_has_no_say():
    share = [csr_array([[1.0], [0.005]]), csr_array([[1.0], [1.0]])]
    maps = [np.array([[[1.0, 0.0]]]), np.array([[[0.0, 1.0]]])]
    lifted = uplift_features(share.__getitem__, (1, 1), maps, 2)
    np.testing.assert_allclose(lifted.mean, [[0.5, 0.5], [0, 1]])
    np.testing.assert_array_equal(lifted.seen, [2, 1])


def test_an_unseen_place_looks_like_its_neighbours():
    position = np.array([[0, 0, 0], [1, 0, 0], [0.25, 0, 0], [9, 0, 0.0]])
    before = LiftedFeatures(np.array([[1, 0], [0, 1], [0, 0], [0, 0]], np.float32), np.array([2, 1, 0, 0]))
    after = fill_unseen_points(position, before)
    np.testing.assert_allclose(after.mean[2], [0.9, 0.1], rtol=1e-6)
    np.testing.assert_allclose(after.mean[3], np.array([64, 81]) / 145, rtol=1e-6)
    np.testing.assert_array_equal(after.seen, before.seen)
    np.testing.assert_array_equal(after.mean[:2], before.mean[:2])


def test_unit_features_are_unit():
    mean = np.random.default_rng(3).normal(size=(9000, 12)).astype(np.float32)
    mean[17] = 0
    unit = LiftedFeatures(mean, np.ones(9000, int)).unit()
    assert unit.dtype == np.float16
    length = np.linalg.norm(unit.astype(np.float64), axis=1)
    assert length[17] == 0
    np.testing.assert_allclose(np.delete(length, 17), 1, atol=1e-3)
    FeatureCloud(np.zeros((9000, 3)), np.zeros((9000, 3)), unit, unit, np.ones(9000, int))


def test_memory_is_one_number_per_point_and_channel():
    """20000 points × 256 channels from 4 views: 20 MB, and less than twice that while at work."""
    maps = [np.random.default_rng(4).normal(size=(16, 16, 256)).astype(np.float16)] * 4
    rows = np.arange(20000)
    share = csr_array((np.ones(20000), (rows, rows % 256)), shape=(20000, 256))
    tracemalloc.start()
    try:
        lift_features(lambda view: share, maps, 20000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2.2 * 20000 * 256 * 4


def test_maps_that_do_not_agree_are_refused():
    share = csr_array(np.ones((2, 4)))
    with pytest.raises(UserError, match="View 1's map is 2 x 3 x 5"):
        lift_features(lambda view: share, [np.ones((2, 2, 5)), np.ones((2, 3, 5))], 2)
    with pytest.raises(UserError, match="the first map has 5 channels"):
        lift_features(lambda view: share, [np.ones((2, 2, 5)), np.ones((2, 2, 4))], 2)
    with pytest.raises(UserError, match="weights for 4 cells, not 3 x 3"):
        uplift_features(lambda view: share, (3, 3), [np.ones((2, 2, 5))], 2)
    with pytest.raises(UserError, match="at least one picture"):
        lift_features(lambda view: share, [], 2)


def test_points_and_cameras_of_different_frames_are_refused(boxes):
    cameras, depth, which, position, _, _ = boxes
    away = position + np.array([50, 0, 0])
    lifted = back_projection(away, cameras, depth, [one_hot(w, 8, 2) for w in which])
    with pytest.raises(UserError, match="one frame and one unit"):
        fill_unseen_points(away, lifted)


def test_gaussians_take_what_the_rasteriser_blended_them_into(boxes):
    """Discs on the boxes' faces, pictured; each takes the label that its pixels show."""
    cameras, _, which, position, normal, owner = boxes
    rows = np.arange(0, len(position), 2)
    turn = np.column_stack([1 + normal[rows, 2], -normal[rows, 1], normal[rows, 0], 0 * rows])
    turn[normal[rows, 2] == -1] = [0, 1, 0, 0]
    scale = np.tile([0.018, 0.018, 0.001], (len(rows), 1))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    sh = np.zeros((len(rows), 1, 3))
    discs = Gaussians(position[rows], turn, scale, np.full(len(rows), 0.95), sh)
    maps = [np.eye(3)[w + 1] for w in which]
    lifted = uplift_features(lambda view: gaussian_weights(discs, cameras[view], 1, 1), (96, 96), maps, len(rows))
    right = lifted.mean[:, 1:].argmax(1) == owner[rows]
    free = sum(unhidden(TWO, position[rows], normal[rows], owner[rows], c) for c in cameras) > 2
    assert free.mean() > 0.6
    assert np.mean(lifted.seen[free] > 2) > 0.99
    assert np.mean(right[free]) > 0.99
    assert np.mean(right[lifted.seen > 2]) > 0.985
