"""Preprocessing of pictures for vision transformers, and maps of their patches."""

from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from jaxtyping import Float16, Float32, UInt8
from PIL import Image

from corporeal.reconstruction.features.unit_vectors import unit_rows

MAX_U8 = 255.0


def patch_grid(picture: UInt8[np.ndarray, "H W 3"], side: int, patch: int) -> tuple[int, int]:
    """Return how many rows and columns of patches cover a picture.

    Its shorter side becomes ``side`` pixels, the other one keeps the proportions; both are rounded
    to whole patches, so that the map covers all of the picture and nothing else.
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
    large = torch.nn.functional.interpolate(
        logits[None, None].float(), size=size, mode="bilinear", align_corners=False
    )
    return large[0, 0].numpy()
