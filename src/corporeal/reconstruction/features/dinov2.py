"""Patch features of DINOv2 (Oquab et al. 2024)."""

from functools import cached_property
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from jaxtyping import Float16, UInt8
from transformers import Dinov2Model  # pyright: ignore[reportMissingImports]
from transformers.utils import logging  # pyright: ignore[reportMissingImports]

from corporeal.reconstruction.features.model_weights import PREPROCESSOR_FILE, find_weights
from corporeal.reconstruction.features.vit_pictures import feature_map, patch_grid, prepare_picture

DEFAULT_DINOV2 = "facebook/dinov2-base"


class Dinov2:
    """DINOv2 without registers; ``spec`` as in ``features.connect``."""

    def __init__(self, spec: str = "") -> None:
        self.weights = find_weights("dinov2", spec, DEFAULT_DINOV2)

    @cached_property
    def model(self) -> Any:
        """The loaded model, in float32 on the processor."""
        logging.disable_progress_bar()
        return self.weights.load(Dinov2Model)

    def name(self) -> str:
        """Name the kind of model, and which weights very exactly."""
        return self.weights.name

    def map(self, picture: UInt8[np.ndarray, "H W 3"]) -> Float16[np.ndarray, "h w D"]:
        """Return unit features of every patch.

        Raises:
            UserError: The weights cannot be had.
        """
        config = self.model.config
        rows, columns = patch_grid(picture, config.image_size, config.patch_size)
        size = rows * config.patch_size, columns * config.patch_size
        pixels = prepare_picture(picture, size, self._statistics)
        with torch.inference_mode():
            tokens = self.model(pixel_values=pixels).last_hidden_state
        return feature_map(tokens[:, 1:], (rows, columns))

    @cached_property
    def _statistics(self) -> dict[str, Any]:
        return self.weights.read(PREPROCESSOR_FILE)
