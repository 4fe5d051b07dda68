"""Feature matching of two pictures without poses (ORB).

Rublee et al., "ORB: an efficient alternative to SIFT or SURF" (ICCV 2011).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image
from skimage.color import rgb2gray

FEATURE_IMAGE_SIDE_PX = 320
"""Longer side at which features are looked for [px]."""
THUMBNAIL_SIDE_PX = 16
"""Edge of the thumbnails that tell which pictures are alike [px]."""
MAX_ORB_FEATURES_PER_IMAGE = 800
"""Features per picture."""
MIN_CORNER_CONTRAST = 0.02
"""Least difference of a corner from its surroundings, of white: matte objects have no more."""
LOWE_MATCH_RATIO = 0.85
"""A match must be so much better than the next best (Lowe)."""


@dataclass(frozen=True)
class ImageFeatures:
    """Where the corners of a picture are, and what they look like."""

    points: Float[np.ndarray, "N 2"]
    """(u, v) [px] of the picture as given."""
    descriptors: np.ndarray


def detect_features(picture: UInt8[np.ndarray, "H W 3"]) -> ImageFeatures:
    """Return the corners of a picture; none where it is smooth."""
    from skimage.feature import ORB  # brings a second of start-up with it

    share = min(1.0, FEATURE_IMAGE_SIDE_PX / max(picture.shape[:2]))
    size = (round(picture.shape[1] * share), round(picture.shape[0] * share))
    grey = rgb2gray(_resized_picture(picture, size))
    finder = ORB(n_keypoints=MAX_ORB_FEATURES_PER_IMAGE, fast_threshold=MIN_CORNER_CONTRAST)
    try:
        finder.detect_and_extract(grey)
    except RuntimeError:  # it found none
        return ImageFeatures(np.zeros((0, 2)), np.zeros((0, 256), bool))
    scale = np.array(picture.shape[1::-1]) / grey.shape[::-1]
    points = (np.asarray(finder.keypoints)[:, ::-1] + 0.5) * scale
    return ImageFeatures(points, np.asarray(finder.descriptors))


def match_features(a: ImageFeatures, b: ImageFeatures) -> tuple[np.ndarray, np.ndarray]:
    """Return points of two pictures that look the same, (N, 2) each.

    Each must be the other's nearest, and clearly nearer than the next.
    """
    if min(len(a.points), len(b.points)) < 2:
        return np.zeros((0, 2)), np.zeros((0, 2))
    x, y = (f.descriptors.astype(np.float32) * 2 - 1 for f in (a, b))
    distance = (x.shape[1] - x @ y.T) / 2  # Hamming
    nearest = distance.argmin(axis=1)
    mutual = distance.argmin(axis=0)[nearest] == np.arange(len(x))
    best, second = np.partition(distance, 1, axis=1)[:, :2].T
    good = np.flatnonzero(mutual & (best < LOWE_MATCH_RATIO * second))
    return a.points[good], b.points[nearest[good]]


def image_likeness(pictures: UInt8[np.ndarray, "V H W 3"]) -> Float[np.ndarray, "V V"]:
    """Return how alike pictures are as a whole, at most 1; a picture is not like itself."""
    thumbs = np.stack([_resized_picture(p, (THUMBNAIL_SIDE_PX, THUMBNAIL_SIDE_PX)).ravel() for p in pictures]).astype(
        np.float64
    )
    thumbs -= thumbs.mean(axis=0)
    thumbs /= np.maximum(np.linalg.norm(thumbs, axis=1, keepdims=True), 1e-9)
    alike = thumbs @ thumbs.T
    np.fill_diagonal(alike, -np.inf)
    return alike


def _resized_picture(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX))
