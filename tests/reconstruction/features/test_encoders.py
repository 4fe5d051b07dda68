import numpy as np
import pytest

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.reconstruction import features
from corporeal.reconstruction.features import connect_encoder
from corporeal.reconstruction.features.feature_map_cache import CachedEncoder


class Counting:
    """Gives every patch the mean of its pixels, and counts."""

    def __init__(self, name="counting@1"):
        self.called, self.asked = name, 0

    def name(self):
        return self.called

    def map(self, picture):
        self.asked += 1
        return picture.reshape(4, 2, 4, 2, 3).mean((1, 3)).astype(np.float16)


def picture(seed=0):
    return np.random.default_rng(seed).integers(0, 256, (8, 8, 3), np.uint8)


def test_a_map_that_was_made_once_is_not_made_again(tmp_path):
    encoder = Counting()
    first = CachedEncoder(encoder, tmp_path / "maps").map(picture())
    second = CachedEncoder(encoder, tmp_path / "maps").map(picture())
    assert encoder.asked == 1
    np.testing.assert_array_equal(first, second)
    assert second.dtype == np.float16


def test_another_picture_or_another_model_is_another_map(tmp_path):
    encoder, other = Counting(), Counting("counting@2")
    kept = CachedEncoder(encoder, tmp_path)
    changed = picture()
    changed[0, 0, 0] ^= 1
    for shown in (picture(), changed, picture().reshape(4, 16, 3)[:, :8].repeat(2, 0)):
        kept.map(shown)
    assert encoder.asked == 3
    assert kept.path(picture()) != kept.path(picture().reshape(4, 16, 3))
    CachedEncoder(other, tmp_path).map(picture())
    assert other.asked == 1


@pytest.mark.parametrize("damage", [b"", b"\x93NUMPY", b"no map at all"])
def test_a_damaged_map_is_made_again(tmp_path, damage):
    encoder = Counting()
    kept = CachedEncoder(encoder, tmp_path)
    first = kept.map(picture())
    kept.path(picture()).write_bytes(damage)
    np.testing.assert_array_equal(kept.map(picture()), first)
    np.testing.assert_array_equal(kept.map(picture()), first)
    assert encoder.asked == 2


def test_no_model_is_a_choice_and_an_unknown_one_is_not():
    assert connect_encoder("descriptor") is None
    with pytest.raises(UnknownChoiceError, match="clip, descriptor, dinov2"):
        connect_encoder("resnet")


def test_what_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr(features, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"needs torch and transformers.*corporeal\[learned\]"):
        connect_encoder("clip:openai/clip-vit-base-patch16")
