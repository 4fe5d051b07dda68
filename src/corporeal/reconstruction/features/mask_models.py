"""Learned segmentation models: SAM 3, SAM 2, BiRefNet. Weights lie in a folder."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, UInt8

from corporeal.core import registry
from corporeal.core.errors import UnknownChoiceError, UserError

MASK_MODEL_REGISTRY = {
    "sam3": "corporeal.reconstruction.features.sam3:Sam3",
    "sam2": "corporeal.reconstruction.features.sam2:Sam2",
    "birefnet": "corporeal.reconstruction.features.birefnet:BiRefNet",
}
"""Name before the colon → class that takes the folder after it."""
MASK_MODEL_PACKAGES = {
    "sam3": ("torch", "transformers"),
    "sam2": ("torch", "transformers"),
    "birefnet": ("onnxruntime",),
}
"""Which the core does without."""
MASK_MODEL_EXTRAS = {"sam3": "learned", "sam2": "learned", "birefnet": "birefnet"}


@dataclass(frozen=True)
class MaskInstance:
    """One object in one picture."""

    mask: Bool[np.ndarray, "H W"]
    score: float
    """0 to 1."""
    word: str = ""
    """What it was found by; "": a place."""


@runtime_checkable
class MaskModel(Protocol):
    """The whole contract: one picture in, objects out."""

    needs_words: bool
    """Whether it finds what words name; others find what is at a place."""

    def name(self) -> str:
        """All that masks depend on beside the picture, words and place."""
        ...

    def instances(
        self, picture: UInt8[np.ndarray, "H W 3"], words: Sequence[str], at: tuple[float, float]
    ) -> list[MaskInstance]:
        """Return objects, the surest first.

        Args:
            picture: sRGB.
            words: Names of what is looked for.
            at: Column and row of a pixel on it [px].
        """
        ...


def split_model_spec(spec: str) -> tuple[str, str] | None:
    """Return kind and folder of ``"sam2:FOLDER"``; None: it names no kind of model."""
    kind, colon, place = spec.partition(":")
    if not colon or not kind.isalnum() or len(kind) == 1 or Path(spec).exists():
        return None
    if kind not in MASK_MODEL_REGISTRY:
        raise UnknownChoiceError("kind of masks", kind, [*MASK_MODEL_REGISTRY, "or a folder of masks"])
    return kind, place


def connect_mask_model(spec: str) -> MaskModel:
    """Connect to ``"sam3:FOLDER"`` and the like.

    Raises:
        UserError: The name is unknown, its packages are not installed, or the folder holds no such weights. Nothing is
            fetched.
    """
    named = split_model_spec(spec)
    if named is None:
        raise UnknownChoiceError("kind of masks", spec, list(MASK_MODEL_REGISTRY))
    kind, place = named
    missing = [package for package in MASK_MODEL_PACKAGES[kind] if find_spec(package) is None]
    if missing:
        raise UserError(
            f"--masks {kind} needs {' and '.join(missing)}, not installed here. Type: pip install "
            f"'corporeal[{MASK_MODEL_EXTRAS[kind]}]'. Without it: corporeal masks PHOTOS --at X Y."
        )
    folder = Path(place).expanduser()
    if not place or not folder.is_dir():
        raise UserError(
            f"There is no folder {place!r} with weights of {kind}, and none are downloaded. Use "
            f"--masks {kind}:FOLDER, where FOLDER holds what the model's authors publish."
        )
    return registry.load_backend("kind of masks", kind, MASK_MODEL_REGISTRY)(folder)
