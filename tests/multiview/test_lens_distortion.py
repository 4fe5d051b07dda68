"""Straightened pictures bent back."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from corporeal.multiview.lens_distortion import (
    Lens,
    distort_directions,
    redistort_image,
    undistort_image,
    undistort_points,
)


@pytest.mark.parametrize("radial", [(), (-0.2,), (0.15, -0.05)])
def test_bending_undoes_straightening(radial):
    K = np.array([[90.0, 0, 50], [0, 92.0, 38], [0, 0, 1]])
    lens = Lens(K, 100, 76, radial, (0.002, -0.001) if radial else (0.0, 0.0))
    smooth = gaussian_filter(np.random.default_rng(0).random((76, 100)), 5)
    picture = np.round(255 * (smooth - smooth.min()) / np.ptp(smooth)).astype(np.uint8)
    straight = undistort_image(picture[..., None], lens)[0][..., 0].astype(np.float32)
    back = redistort_image(straight, lens)
    middle = np.s_[12:-12, 15:-15]
    assert np.abs(back[middle] - picture[middle]).max() < 4


def test_directions_are_unbent():
    lens = Lens(np.array([[80.0, 0, 50], [0, 80.0, 40], [0, 0, 1]]), 100, 80, (-0.2, 0.03))
    points = np.array([[50.0, 40.0], [5.0, 70.0], [95.0, 12.0]])
    np.testing.assert_allclose(
        distort_directions(lens, undistort_points(lens, points)) @ lens.K[:2, :2].T + lens.K[:2, 2], points, atol=1e-6
    )
