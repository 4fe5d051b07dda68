"""Preprocessing of pictures for vision transformers, and maps of their patches."""

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Float16, Float32, UInt8
from PIL import Image

ROWS_PER_BATCH = 8192
"""Rows that are worked on at a time: what bounds the memory beside the rows themselves."""


def row_batches(count: int) -> list[slice]:
    """Cut 0 … count into spans of at most ``ROWS_PER_BATCH``."""
    return [slice(k, min(k + ROWS_PER_BATCH, count)) for k in range(0, count, ROWS_PER_BATCH)]


def unit_rows(rows: Float[np.ndarray, "N D"]) -> Float32[np.ndarray, "N D"]:
    """Return rows at unit length; rows of zeros stay zeros."""
    rows = np.asarray(rows, np.float32)
    length = np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def cosine_similarity(
    features: Float[np.ndarray, "N D"], words: Float[np.ndarray, "M D"]
) -> Float32[np.ndarray, "N M"]:
    """Return the cosine of every point with every name; features and words are unit vectors."""
    made = np.empty((len(features), len(words)), np.float32)
    for rows in row_batches(len(features)):
        made[rows] = features[rows].astype(np.float32) @ words.T.astype(np.float32)
    return made


MAX_U8 = 255.0


def patch_grid(picture: UInt8[np.ndarray, "H W 3"], side: int, patch: int) -> tuple[int, int]:
    """Return how many rows and columns of patches cover a picture.

    Its shorter side becomes ``side`` pixels, the other one keeps the proportions; both are rounded to whole patches, so
    that the map covers all of the picture and nothing else.
    """
    high, wide = picture.shape[:2]
    scale = side / min(high, wide) / patch
    return max(1, round(high * scale)), max(1, round(wide * scale))


def prepare_picture(
    picture: UInt8[np.ndarray, "H W 3"], size: tuple[int, int], statistics: dict[str, Any]
) -> torch.Tensor:
    """Return a picture as the model was trained on such: 1 x 3 x rows x columns.

    Args:
        picture: sRGB.
        size: Rows and columns [px].
        statistics: ``image_mean`` and ``image_std`` of its ``preprocessor_config.json``.
    """
    resized = Image.fromarray(picture).resize((size[1], size[0]), Image.Resampling.BICUBIC)
    values = np.asarray(resized, np.float32) / MAX_U8
    values = (values - np.float32(statistics["image_mean"])) / np.float32(statistics["image_std"])
    return torch.from_numpy(np.ascontiguousarray(values.transpose(2, 0, 1)))[None]


def feature_map(patches: torch.Tensor, size: tuple[int, int]) -> Float16[np.ndarray, "h w D"]:
    """Return 1 x (h w) x D patches as a map of unit features."""
    rows = unit_rows(patches[0].float().numpy())
    return rows.reshape(*size, -1).astype(np.float16)


def enlarge_logits(logits: torch.Tensor, size: tuple[int, int]) -> Float32[np.ndarray, "H W"]:
    """Return a map of logits at a picture's size (rows, columns), interpolated."""
    large = torch.nn.functional.interpolate(logits[None, None].float(), size=size, mode="bilinear", align_corners=False)
    return large[0, 0].numpy()
