"""BiRefNet (Zheng et al. 2024): the foreground object of a picture. MIT; read as ONNX.

Its code for torch comes with its weights and would have to be run; the ONNX file is data.
"""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime  # pyright: ignore[reportMissingImports]
from jaxtyping import Float32, UInt8
from PIL import Image

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.process_resources import usable_cores
from corporeal.reconstruction.features.mask_models import MaskInstance

MODEL_FILES = ("model.onnx", "onnx/model.onnx")
IMAGENET_MEAN = np.array([0.485, 0.456, 0.406], np.float32)
IMAGENET_DEVIATION = np.array([0.229, 0.224, 0.225], np.float32)
"""Of ImageNet, in which its authors state colours."""
TRAINED_SIDE_PX = 1024
"""Of the pictures it was trained on [px], where the file does not fix it."""
MAX_U8, MASK_THRESHOLD = 255.0, 0.5


class BiRefNet:
    """BiRefNet on the processor."""

    needs_words = False

    def __init__(self, folder: Path) -> None:
        found = [folder / name for name in MODEL_FILES if (folder / name).is_file()]
        if not found:
            raise BadFileError(folder, f"there is no {' or '.join(MODEL_FILES)}.", "Fetch BiRefNet as ONNX.")
        self.file = found[0]

    def name(self) -> str:
        """Name the weights exactly."""
        return f"birefnet@{store.path_digest(self.file)}"

    @cached_property
    def session(self) -> Any:
        """The loaded model."""
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = usable_cores()
        providers = ["CPUExecutionProvider"]
        try:
            return onnxruntime.InferenceSession(str(self.file), options, providers=providers)
        except Exception as error:  # of protobuf and of the library
            reason = str(error).strip().splitlines()[0]
            what = f"{self.file}: its weights cannot be loaded ({reason}). Fetch it again."
            raise UserError(what) from error

    def instances(
        self, picture: UInt8[np.ndarray, "H W 3"], words: Sequence[str], at: tuple[float, float]
    ) -> list[MaskInstance]:
        """Return the foreground; words and place are not looked at.

        Raises:
            UserError: The file is no such model.
        """
        height, width = picture.shape[:2]
        entry = self.session.get_inputs()[0]
        side = entry.shape[-1] if isinstance(entry.shape[-1], int) else TRAINED_SIDE_PX
        said = self.session.run(None, {entry.name: _prepare_picture(picture, side)})[-1]
        if said.ndim != 4 or said.shape[:2] != (1, 1):
            what = f"its last output has the shape {list(said.shape)}, not 1 × 1 × H × W."
            raise BadFileError(self.file, what, "Name BiRefNet as ONNX.")
        share = _sigmoid(said[0, 0].astype(np.float32))
        large = Image.fromarray(share).resize((width, height), Image.Resampling.BILINEAR)
        inside = np.asarray(large)
        mask = inside > MASK_THRESHOLD
        return [MaskInstance(mask, float(inside[mask].mean()))] if mask.any() else []


def _prepare_picture(picture: np.ndarray, side: int) -> Float32[np.ndarray, "1 3 h w"]:
    small = Image.fromarray(picture).resize((side, side), Image.Resampling.BILINEAR)
    values = (np.asarray(small, np.float32) / MAX_U8 - IMAGENET_MEAN) / IMAGENET_DEVIATION
    return np.ascontiguousarray(values.transpose(2, 0, 1)[None])


def _sigmoid(logits: Float32[np.ndarray, "H W"]) -> Float32[np.ndarray, "H W"]:
    """Return shares; a file that ends in a sigmoid says them already."""
    if logits.min() >= 0 and logits.max() <= 1:
        return logits
    return 1 / (1 + np.exp(-np.clip(logits, -30, 30)))
