"""SAM 2 (Ravi et al. 2024): segmentation by prompts. Apache-2.0; without text."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from jaxtyping import UInt8
from transformers import Sam2Model  # pyright: ignore[reportMissingImports]
from transformers.utils import logging  # pyright: ignore[reportMissingImports]

from corporeal.reconstruction.features.mask_models import MaskInstance
from corporeal.reconstruction.features.model_weights import picture_statistics, weights_in_folder
from corporeal.reconstruction.features.vit_pictures import enlarge_logits, prepare_picture

SAM2_KINDS = ("sam2", "sam2_video")
"""What its checkpoints call themselves: those for videos hold the same model."""


class Sam2:
    """SAM 2 on the processor."""

    needs_words = False

    def __init__(self, folder: Path) -> None:
        self.weights = weights_in_folder(folder, SAM2_KINDS)
        self.statistics = picture_statistics(self.weights)

    def name(self) -> str:
        """Name the weights exactly."""
        return self.weights.name

    @cached_property
    def model(self) -> Any:
        """The loaded model, in float32."""
        logging.disable_progress_bar()
        return self.weights.load(Sam2Model)

    def instances(
        self, picture: UInt8[np.ndarray, "H W 3"], words: Sequence[str], at: tuple[float, float]
    ) -> list[MaskInstance]:
        """Return what is at a place: of the model's three answers the one that it is surest of.

        Raises:
            UserError: The weights cannot be loaded.
        """
        height, width = picture.shape[:2]
        side = self.model.prompt_encoder.image_embedding_size[0] * self._patch
        pixels = prepare_picture(picture, (side, side), self.statistics)
        place = torch.tensor([[[[at[0] * side / width, at[1] * side / height]]]])
        with torch.inference_mode():
            said = self.model(pixel_values=pixels, input_points=place.float())
        best = int(said.iou_scores[0, 0].argmax())
        mask = enlarge_logits(said.pred_masks[0, 0, best], (height, width)) > 0
        return [MaskInstance(mask, float(said.iou_scores[0, 0, best].clamp(0, 1)))]

    @property
    def _patch(self) -> int:
        return int(self.model.config.prompt_encoder_config.patch_size)
