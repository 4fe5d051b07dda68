"""Cache of feature maps: one file per picture, named by a digest of its inputs."""

import hashlib
import io
from pathlib import Path

import numpy as np
from jaxtyping import Float16, UInt8

from corporeal.core import store
from corporeal.reconstruction.features import PictureEncoder

MAP_VERSION = 1


class CachedEncoder:
    """Shows an encoder only pictures that it has not seen before."""

    def __init__(self, encoder: PictureEncoder, folder: Path) -> None:
        self.encoder, self.folder = encoder, Path(folder)

    def name(self) -> str:
        """Name the encoder."""
        return self.encoder.name()

    def map(self, picture: UInt8[np.ndarray, "H W 3"]) -> Float16[np.ndarray, "h w D"]:
        """Return the kept map, or the encoder's, which is then kept."""
        path = self.path(picture)
        kept = _read_map(path)
        if kept is not None:
            return kept
        made = self.encoder.map(picture)
        raw = io.BytesIO()
        np.save(raw, made, allow_pickle=False)
        with store.disk_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            store.write_bytes(path, raw.getvalue())
        return made

    def path(self, picture: UInt8[np.ndarray, "H W 3"]) -> Path:
        """Name a map by version, encoder, and the picture's size and bytes."""
        key = hashlib.sha256(f"{MAP_VERSION}|{self.name()}|{picture.shape}|".encode())
        key.update(np.ascontiguousarray(picture).tobytes())
        name = key.hexdigest()
        return self.folder / name[:2] / f"{name}.npy"


def _read_map(path: Path) -> np.ndarray | None:
    """Return a kept map; a damaged file is as good as none."""
    try:
        kept = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return kept if kept.dtype == np.float16 and kept.ndim == 3 else None
