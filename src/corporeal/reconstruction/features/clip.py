"""Dense CLIP features, comparable with words.

CLIP (Radford et al. 2021) gives one vector per picture. Its last layer's value path, without the attention that would
mix the patches, gives one per patch (MaskCLIP, Zhou et al., ECCV 2022; F3RM, Shen et al., CoRL 2023).
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from jaxtyping import Float16, Float32, UInt8
from transformers import CLIPModel, CLIPTokenizer  # pyright: ignore[reportMissingImports]
from transformers.utils import logging  # pyright: ignore[reportMissingImports]

from corporeal.reconstruction.features.model_weights import PREPROCESSOR_FILE, find_weights
from corporeal.reconstruction.features.vit_pictures import feature_map, patch_grid, prepare_picture, unit_rows

DEFAULT_CLIP = "openai/clip-vit-large-patch14-336"
TOKENIZER_FILES = ("tokenizer.json", "vocab.json")
"""Files that words are cut into tokens by: one is enough."""
PROMPT_TEMPLATES = (
    "a photo of a {}.",
    "itap of a {}.",
    "a bad photo of the {}.",
    "a origami {}.",
    "a photo of the large {}.",
    "a {} in a video game.",
    "art of the {}.",
    "a photo of the small {}.",
)
"""In which names are embedded: CLIP's plain prompt and the seven that its authors kept of 80."""


class Clip:
    """CLIP with a vision transformer; ``spec`` as in ``features.connect``."""

    def __init__(self, spec: str = "") -> None:
        self.weights = find_weights("clip", spec, DEFAULT_CLIP)
        self.weights.holds(TOKENIZER_FILES)

    @cached_property
    def model(self) -> Any:
        """The loaded model, in float32 on the processor."""
        logging.disable_progress_bar()
        return self.weights.load(CLIPModel)

    @cached_property
    def _tokenizer(self) -> Any:
        return self.weights.tokenizer(CLIPTokenizer)

    def name(self) -> str:
        """Name the kind of model, and which weights very exactly."""
        return self.weights.name

    def map(self, picture: UInt8[np.ndarray, "H W 3"]) -> Float16[np.ndarray, "h w D"]:
        """Return unit features of every patch, in the space of ``words``.

        Raises:
            UserError: The weights cannot be had.
        """
        vision = self.model.config.vision_config
        rows, columns = patch_grid(picture, vision.image_size, vision.patch_size)
        size = rows * vision.patch_size, columns * vision.patch_size
        pixels = prepare_picture(picture, size, self._statistics)
        return feature_map(dense_features(self.model, pixels), (rows, columns))

    @cached_property
    def _statistics(self) -> dict[str, Any]:
        return self.weights.read(PREPROCESSOR_FILE)

    def words(self, names: Sequence[str]) -> Float32[np.ndarray, "M D"]:
        """Return one unit vector per name: the mean over ``PROMPT_TEMPLATES``.

        Raises:
            UserError: The weights cannot be had.
        """
        longest = self.model.config.text_config.max_position_embeddings
        made = np.zeros((len(names), self.model.config.projection_dim), np.float32)
        for k, name in enumerate(names):
            tokens = self._tokenizer(
                [template.format(name) for template in PROMPT_TEMPLATES],
                padding=True,
                truncation=True,
                max_length=longest,
                return_tensors="pt",
            )
            with torch.inference_mode():
                pooled = self.model.text_model(**tokens).pooler_output
                vectors = self.model.text_projection(pooled).numpy()
            made[k] = unit_rows(unit_rows(vectors).mean(axis=0)[None])[0]
        return made


@torch.inference_mode()
def dense_features(model: Any, pixels: torch.Tensor) -> torch.Tensor:
    """Return B x (h w) x D features of patches in the space that words share.

    All layers but the last as they are; of that one ``layer_norm1 → v_proj → out_proj``, then ``post_layernorm →
    visual_projection``: no residual, no MLP. Positions are interpolated for pictures of another size than the model was
    trained on.
    """
    vision = model.vision_model
    hidden = vision.pre_layrnorm(vision.embeddings(pixels, interpolate_pos_encoding=True))
    *layers, last = vision.encoder.layers
    for layer in layers:
        hidden = layer(hidden, attention_mask=None)
    value = last.self_attn.out_proj(last.self_attn.v_proj(last.layer_norm1(hidden)))
    return model.visual_projection(vision.post_layernorm(value[:, 1:]))
