"""Files on a composed scene: its composition and the certificate of rest.

``composition.json`` and ``certificate.json`` are written and read here alone.
"""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.discretization.object_scaling import SceneSizing
from corporeal.scene.rest_certificate import RestCertificate

COMPOSITION_FILE, CERTIFICATE_FILE = "composition.json", "certificate.json"
ASSEMBLE_AGAIN = "Assemble the scene again."


@dataclass(frozen=True)
class ComposedObject:
    """One object of a composed scene."""

    name: str
    class_name: str
    """On disk under ``class``."""
    asset: str
    """Its name in the pool."""
    source: str
    sha256: str
    """Of the asset's file."""
    licence: str
    attribution: str
    real_extent_m: float
    """Largest extent of the real object [m]."""
    said_by: str
    """Where that size is from."""
    reason: str
    extent_m: float
    """Largest extent in the scene [m]."""


@dataclass(frozen=True)
class SceneComposition:
    """What a composed scene consists of, and why its objects are so large."""

    seed: int
    arrangement: str
    settled_with: str
    """The rigid-body engine."""
    interaction: str
    """One of ``settle.interactions.KINDS``, or "none"."""
    what_happens: str
    """In words."""
    objects: tuple[ComposedObject, ...]
    sizing: SceneSizing = field(default_factory=SceneSizing)
    warnings: tuple[str, ...] = ()


def write_composition(folder: Path, composition: SceneComposition) -> None:
    """Write ``composition.json`` into a scene's folder.

    Raises:
        DiskError: The disk refuses it.
    """
    rows = [_composed_object(asdict(one)) for one in composition.objects]
    store.write_json(folder / COMPOSITION_FILE, asdict(composition) | {"objects": rows})


def read_composition(folder: Path) -> SceneComposition:
    """Read ``composition.json`` of a scene's folder.

    Raises:
        BadFileError: The file is absent, damaged, or of a version that had other fields.
    """
    path = folder / COMPOSITION_FILE
    data = store.read_json(path)
    try:
        rows = [{"class_name": row["class"], **row} for row in data["objects"]]
        return from_plain(SceneComposition, {"settled_with": "mujoco", **data, "objects": rows})
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise BadFileError(path, f"is not a composition of this version ({error}).", ASSEMBLE_AGAIN) from error


def _composed_object(row: dict[str, Any]) -> dict[str, Any]:
    return {"class" if name == "class_name" else name: value for name, value in row.items()}


def write_certificate(folder: Path, certificate: RestCertificate) -> None:
    """Write ``certificate.json`` into a scene's folder.

    Raises:
        DiskError: The disk refuses it.
    """
    store.write_json(folder / CERTIFICATE_FILE, asdict(certificate))


def read_certificate(folder: Path) -> RestCertificate:
    """Read ``certificate.json`` of a scene's folder.

    Raises:
        BadFileError: The file is absent, damaged, or of a version that had other fields.
    """
    path = folder / CERTIFICATE_FILE
    data = store.read_json(path)
    try:
        return from_plain(RestCertificate, data)
    except (ValueError, TypeError, AttributeError) as error:
        raise BadFileError(path, f"is not a certificate of this version ({error}).", ASSEMBLE_AGAIN) from error
