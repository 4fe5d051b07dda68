"""SAM 3 (Carion et al. 2025): segmentation of all objects named by a text. Under the SAM License."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from jaxtyping import UInt8
from transformers import CLIPTokenizer, Sam3Model  # pyright: ignore[reportMissingImports]
from transformers.utils import logging  # pyright: ignore[reportMissingImports]

from corporeal.reconstruction.features.clip import TOKENIZER_FILES
from corporeal.reconstruction.features.mask_models import MaskInstance
from corporeal.reconstruction.features.model_weights import picture_statistics, weights_in_folder
from corporeal.reconstruction.features.vit_pictures import enlarge_logits, prepare_picture

SAM3_KINDS = ("sam3", "sam3_video")
"""What its checkpoints call themselves: those for videos hold the same detector."""
MIN_SCORE = 0.3
"""Score from which on an answer counts, as its authors have it."""


class Sam3:
    """SAM 3 on the processor."""

    needs_words = True

    def __init__(self, folder: Path, min_score: float = MIN_SCORE) -> None:
        self.min_score = min_score
        self.weights = weights_in_folder(folder, SAM3_KINDS)
        self.weights.holds(TOKENIZER_FILES)
        self.statistics = picture_statistics(self.weights)

    def name(self) -> str:
        """Name the weights exactly."""
        return self.weights.name

    @cached_property
    def model(self) -> Any:
        """The loaded model, in float32."""
        logging.disable_progress_bar()
        return self.weights.load(Sam3Model)

    @cached_property
    def _tokenizer(self) -> Any:
        return self.weights.tokenizer(CLIPTokenizer)

    def instances(
        self, picture: UInt8[np.ndarray, "H W 3"], words: Sequence[str], at: tuple[float, float]
    ) -> list[MaskInstance]:
        """Return all objects that words name, the surest first; the place is not looked at.

        Raises:
            UserError: The weights cannot be loaded.
        """
        side = self.model.config.image_size
        pixels = prepare_picture(picture, (side, side), self.statistics)
        with torch.inference_mode():
            seen = self.model.get_vision_features(pixel_values=pixels)
            found = [i for word in words for i in self._named(seen, word, picture.shape[:2])]
        return sorted(found, key=lambda instance: -instance.score)

    def _named(self, seen: Any, word: str, size: tuple[int, int]) -> list[MaskInstance]:
        longest = self.model.config.text_config.max_position_embeddings
        tokens = self._tokenizer([word], padding="max_length", truncation=True, max_length=longest, return_tensors="pt")
        said = self.model(vision_embeds=seen, **tokens)
        score = said.pred_logits[0].sigmoid()
        if said.presence_logits is not None:
            score = score * said.presence_logits[0].sigmoid()
        found = torch.nonzero(score > self.min_score)[:, 0].tolist()
        return [MaskInstance(enlarge_logits(said.pred_masks[0, k], size) > 0, float(score[k]), word) for k in found]
