"""How blurred photographs are, and what is said where that is why no poses are found."""

import numpy as np
import pytest
from PIL import Image, ImageFilter
from scipy.ndimage import gaussian_filter, uniform_filter1d

from corporeal.core.errors import BadFileError
from corporeal.reconstruction.sfm.find_poses import find_poses
from corporeal.reconstruction.sfm.picture_blur import BLURRED_SIGMA_PX, blurred_pictures, picture_blur
from patterned_scene import photographs, ring


def page(seed=0):
    """Black and white patches, as of a newspaper."""
    made = np.random.default_rng(seed).integers(0, 2, (40, 50)) * 200.0 + 25
    return np.kron(made, np.ones((12, 12))).astype(np.float32)


@pytest.mark.parametrize("sigma", [6.0, 9.0, 14.0])
def test_the_spread_of_edges_is_found_whatever_the_contrast(sigma):
    smeared = gaussian_filter(np.kron(page(), np.ones((4, 4), np.float32)), sigma)
    assert picture_blur(smeared) == pytest.approx(sigma, rel=0.25)
    assert picture_blur(0.3 * smeared + 100) == pytest.approx(picture_blur(smeared), rel=0.01)


def test_what_is_sharp_or_dark_or_a_smooth_object_before_a_sharp_edge_is_not_blurred():
    assert picture_blur(page()) < 3
    assert picture_blur(np.full((300, 400), 90, np.float32)) == 0
    half = gaussian_filter(page(), 14)
    half[:, 300:] = page()[:, 300:]
    assert picture_blur(half) < 3, "something in the picture is in focus"
    noisy = page() + np.random.default_rng(0).normal(0, 4, page().shape).astype(np.float32)
    assert picture_blur(noisy) < 3


def test_a_hand_that_moved_is_seen_in_whichever_direction():
    large = np.kron(page(), np.ones((3, 3), np.float32))
    assert picture_blur(uniform_filter1d(large, 41, axis=1)) > BLURRED_SIGMA_PX
    assert picture_blur(uniform_filter1d(large, 41, axis=0)) > BLURRED_SIGMA_PX


def test_blurred_photographs_are_refused_as_such(tmp_path):
    pytest.importorskip("pycolmap")
    photographs(tmp_path / "photos", ring(np.arange(14) * 360 / 14, (320, 240)))
    for file in sorted((tmp_path / "photos").iterdir())[:12]:
        with Image.open(file) as picture:
            smeared = picture.filter(ImageFilter.GaussianBlur(14))
        smeared.save(file, quality=95)
    with pytest.raises(BadFileError, match=r"12 of 14 pictures are blurred \(photo_0") as why:
        find_poses(tmp_path / "photos", tmp_path / "poses", lambda share, words: None)
    assert "Hold the camera still" in str(why.value) and "\n" not in str(why.value)
    names = tuple(f"photo_{k:03d}.jpg" for k in range(14))
    assert blurred_pictures(tmp_path / "poses" / "images", names) == names[:12]
