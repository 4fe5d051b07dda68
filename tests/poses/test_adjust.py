"""Which pictures were cropped, by their sizes; how far each was reduced."""

from types import SimpleNamespace

import numpy as np
from PIL import Image

from corporeal.poses.adjust import cropped
from corporeal.poses.gather import LONGEST, gather


def model_of(sizes):
    """A model with a camera for each picture."""
    cameras = {k: SimpleNamespace(width=w, height=h) for k, (w, h) in enumerate(sizes)}
    images = {k: SimpleNamespace(camera_id=k) for k in cameras}
    return SimpleNamespace(cameras=cameras, images=images, reg_image_ids=lambda: list(images))


def test_pictures_that_a_camera_wrote_are_not_taken_for_cropped():
    assert cropped(model_of([(640, 480)] * 2 + [(480, 640)] + [(800, 600)] * 3)) == set()


def test_pictures_of_sizes_of_their_own_were_cropped():
    assert cropped(model_of([(640, 480)] * 9 + [(633, 471), (620, 466)])) == {9, 10}


def test_how_far_a_photograph_was_reduced_is_kept(tmp_path):
    rng = np.random.default_rng(0)
    for k, size in enumerate([(LONGEST * 2, LONGEST), (LONGEST, 300), (400, LONGEST * 4)]):
        noise = Image.fromarray(rng.integers(0, 256, (30, 40, 3), np.uint8))
        noise.resize(size).save(tmp_path / f"{k}.jpg", quality=40)
    for k in range(3, 6):
        noise = rng.integers(0, 256, (300, 400, 3), np.uint8)
        Image.fromarray(noise).save(tmp_path / f"{k}.png")
    kept = gather(tmp_path, tmp_path / "made", lambda share, words: None)
    assert kept.reduced == (0.5, 1.0, 0.25, 1.0, 1.0, 1.0)
