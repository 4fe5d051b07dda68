"""Read a Wavefront OBJ with its materials as a Scene of one object; +Y in the file is up.

trimesh reads the file; companions (.mtl, pictures) are taken from its own folder only.
"""

import re
from pathlib import Path

import numpy as np
import trimesh
from trimesh.resolvers import Resolver
from trimesh.visual.material import SimpleMaterial

from corporeal.errors import BadFileError
from corporeal.formats.gltf_container import MAX_FILE, read_whole
from corporeal.formats.gltf_finishes import PLAIN
from corporeal.formats.images import decode_image
from corporeal.formats.resources import beside, read_beside
from corporeal.formats.words import everyday, safe
from corporeal.types import Finish, Scene, SceneObject, Surface

OBJ = (".obj",)
EXPORT_AGAIN = "Export the model again, best as .glb."
MOST_TEXT = 2**26
"""Of an .mtl file that is looked through for pictures [bytes]."""


class _Beside(Resolver):
    """Companions of a file: from its folder, and never from elsewhere."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, key: str) -> bytes:
        return read_beside(self.folder, key.strip(), MAX_FILE)

    def write(self, name: str, data) -> None:
        raise PermissionError(f"{name} is not written: companions are only read")

    def namespaced(self, namespace: str) -> "_Beside":
        return self

    def keys(self) -> list[str]:
        return [p.name for p in self.folder.iterdir()]


def read_obj(path: Path) -> Scene:
    """Read one file as one object.

    Raises:
        BadFileError: The file cannot be used.

    """
    path = Path(path)
    data = read_whole(path)
    try:
        loaded = trimesh.load_scene(
            trimesh.util.wrap_as_stream(bytes(data)),
            file_type="obj",
            resolver=_Beside(path.parent),
            process=False,
        )
        meshes = {name: m for name, m in loaded.geometry.items() if isinstance(m, trimesh.Trimesh)}
    except MemoryError:
        raise
    except Exception as problem:  # the reader raises almost anything on broken input
        words = f"cannot be read as OBJ ({str(problem)[:80]})."
        raise BadFileError(path, words, EXPORT_AGAIN) from problem
    surfaces, finishes = _dressed(path, meshes)
    if not surfaces:
        raise BadFileError(path, "holds no triangles.", EXPORT_AGAIN)
    extent = _extent(path, surfaces)
    name = safe(path.stem) or "object"
    words = everyday(path.stem) or "object"
    thing = SceneObject(name, words, real_extent=extent, source=str(path))
    return Scene(name, str(path), (thing,), tuple(surfaces), tuple(finishes))


def companions(path: Path) -> list[Path]:
    """Return the material libraries that a file names, and the pictures that those name."""
    found: list[Path] = []
    for library in _named(path, r"mtllib"):
        found.append(library)
        found += _named(library, r"map_\w+|bump|norm|disp|decal")
    return list(dict.fromkeys(found))


def _named(path: Path, keyword: str) -> list[Path]:
    with path.open("rb") as stream:
        text = stream.read(MOST_TEXT).decode(errors="replace")
    names = re.findall(
        rf"(?mi)^[ \t]*(?:{keyword})[ \t]+(?:-\w+[ \t]+\S+[ \t]+)*(.+?)[ \t\r]*$", text
    )
    return [file for name in names if (file := beside(path.parent, name)) is not None]


def _dressed(path: Path, meshes: dict[str, trimesh.Trimesh]) -> tuple[list[Surface], list[Finish]]:
    surfaces, finishes = [], []
    for name, mesh in meshes.items():
        if not len(mesh.faces):
            continue
        if mesh.vertices.shape[1] != 3 or mesh.faces.max() >= len(mesh.vertices):
            raise BadFileError(
                path, "cannot be read as OBJ (a face without corners).", EXPORT_AGAIN
            )
        finishes.append(_finish(path, mesh.visual))
        uv = getattr(mesh.visual, "uv", None)
        surfaces.append(
            Surface(
                name=safe(str(name)) or "surface",
                object=0,
                finish=len(finishes) - 1,
                vertices=_upright(mesh.vertices),
                triangles=np.ascontiguousarray(mesh.faces, np.int64),
                # glTF's v runs down, OBJ's up.
                uv=None if uv is None or len(uv) != len(mesh.vertices) else _turned(uv),
            )
        )
    return surfaces, finishes


def _finish(path: Path, visual) -> Finish:
    material = getattr(visual, "material", None)
    if not isinstance(material, SimpleMaterial):
        return PLAIN
    name = str(material.name or PLAIN.name)[:120]
    picture = _picture(path, material)
    if picture is not None:
        return Finish(name, texture=picture, roughness=PLAIN.roughness)
    r, g, b, a = (float(c) / 255 for c in material.diffuse)
    return Finish(name, colour=(r, g, b, a), roughness=PLAIN.roughness)


def _picture(path: Path, material: SimpleMaterial) -> np.ndarray | None:
    """Return the picture of the diffuse colour; None where there is none that can be read."""
    name = getattr(material.image, "info", {}).get("file_path")
    if name is None:
        return None
    try:
        return decode_image(read_beside(path.parent, name, MAX_FILE))
    except ValueError:
        return None


def _upright(vertices: np.ndarray) -> np.ndarray:
    """Turn +Y up into +Z up: (x, y, z) → (x, -z, y)."""
    x, y, z = np.asarray(vertices, np.float64).T
    return np.stack([x, -z, y], axis=1)


def _turned(uv: np.ndarray) -> np.ndarray:
    return np.asarray(uv, np.float64) * (1, -1) + (0, 1)


def _extent(path: Path, surfaces: list[Surface]) -> float:
    corners = np.concatenate([s.vertices for s in surfaces])
    if not np.isfinite(corners).all():
        raise BadFileError(path, "has vertices that are not finite numbers.", EXPORT_AGAIN)
    extent = float(np.ptp(corners, axis=0).max())
    if not 0 < extent < np.inf:
        raise BadFileError(path, "has no size.", EXPORT_AGAIN)
    return extent
