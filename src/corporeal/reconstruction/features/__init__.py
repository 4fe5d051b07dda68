"""Features of pictures and points, learned or not, for part segmentation."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float16, Float32, UInt8

from corporeal.core import registry
from corporeal.core.errors import UnknownChoiceError, UserError

ENCODER_REGISTRY = {
    "clip": "corporeal.reconstruction.features.clip:Clip",
    "dinov2": "corporeal.reconstruction.features.dinov2:Dinov2",
}
"""Models that look at pictures: name before the colon → class that takes what follows it."""
NO_ENCODER = "descriptor"
"""No model: colour and shape decide, see ``features.descriptor``."""
ENCODER_PACKAGES = ("torch", "transformers")
"""Which the core does without."""


@runtime_checkable
class PictureEncoder(Protocol):
    """The whole contract: one picture in, one map out."""

    def name(self) -> str:
        """All that a map depends on beside its picture: model, revision, size."""
        ...

    def map(self, picture: UInt8[np.ndarray, "H W 3"]) -> Float16[np.ndarray, "h w D"]:
        """Return unit features of a grid of patches that covers the whole picture."""
        ...


@runtime_checkable
class TextPictureEncoder(PictureEncoder, Protocol):
    """An encoder whose features are comparable with words."""

    def words(self, names: Sequence[str]) -> Float32[np.ndarray, "M D"]:
        """Return one unit vector per name."""
        ...


def connect_encoder(spec: str, folder: Path | None = None) -> PictureEncoder | None:
    """Connect to ``"clip"`` and the like; ``"descriptor"`` is no model and gives None.

    Args:
        spec: ``"clip"`` or ``"dinov2"``; then, after a colon, other weights of that kind: a folder, OWNER/NAME on the
            hub, or OWNER/NAME@REVISION.
        folder: Where maps that were made once are kept.

    Raises:
        UserError: The name is unknown, its packages are not installed, or there is no such folder.
    """
    name, _, rest = spec.partition(":")
    if name == NO_ENCODER:
        return None
    if name not in ENCODER_REGISTRY:
        raise UnknownChoiceError("picture encoder", name, [NO_ENCODER, *ENCODER_REGISTRY])
    missing = [package for package in ENCODER_PACKAGES if find_spec(package) is None]
    if missing:
        raise UserError(
            f"The picture encoder {spec!r} needs {' and '.join(missing)}, not installed here. "
            "Type: pip install 'corporeal[learned]'. Without it there is 'descriptor', which needs "
            "no model."
        )
    encoder = registry.load_backend("picture encoder", name, ENCODER_REGISTRY)(rest)
    if folder is None:
        return encoder
    return registry.load_backend(
        "wrapper", "kept", {"kept": "corporeal.reconstruction.features.feature_map_cache:CachedEncoder"}
    )(encoder, folder)
