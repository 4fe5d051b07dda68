"""Mesh data passed from the reader process to its parent."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from corporeal.core import store
from corporeal.core.types import Finish, Surface
from corporeal.geometry.gaussian_transforms import UpAxis

NODE_NAMES_KEY = "along"
"""Key in a surface's extras under which the names from the file's root to it stand."""
MAX_PIECES = 300
"""Files with more pieces stay one object: a building, or a machine with its screws."""
MESH_EXPORT_ADVICE = "Export the model again, best as .glb."


@dataclass(frozen=True)
class RawMesh:
    """Surfaces in the file's own axes and unit."""

    surfaces: tuple[Surface, ...]
    """All of object 0; ``extras[NODE_NAMES_KEY]``: names from the file's root to the surface."""
    finishes: tuple[Finish, ...]
    up: UpAxis | None = None
    """Axis of the file that points up, as it states; None: it states none."""
    up_note: str = ""
    """What to say of ``up`` where it is read out of words."""
    unit: float | None = None
    """What one unit is [m], as the file states; None: it states none."""
    lost: tuple[str, ...] = ()
    """What was left out, such as "pictures (2)"."""
    bodies: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """Path of each body that the file states → ``title``, ``mass`` [kg], ``velocity`` [m/s, the file's axes], and
    ``custom``, what our own writer states of it."""
    custom: Mapping[str, Any] = field(default_factory=dict)
    """Scene data of files written here; empty for other files."""


def write_raw_mesh(path: Path, raw: RawMesh) -> None:
    """Write what ``read_raw_mesh`` reads back."""
    store.save(path, {f.name: getattr(raw, f.name) for f in fields(RawMesh)})


def read_raw_mesh(path: Path) -> RawMesh:
    """Read what a child wrote.

    Raises:
        BadFileError: The file is absent or damaged.
    """
    return RawMesh(**store.load(path))
