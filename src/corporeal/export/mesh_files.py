"""Meshes and pictures beside an MJCF or a URDF."""

from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.types import Finish
from corporeal.export.exported_solids import ExportedSolid
from corporeal.geometry.convex_hull import ConvexPiece
from corporeal.io.mesh.obj_writer import format_obj

MESH_FOLDER = "meshes"


def write_surfaces(solid: ExportedSolid, folder: Path) -> dict[str, int]:
    """Write what is seen of a solid; return file name without suffix → finish."""
    found = {}
    for number, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
        if not len(surface.triangles):
            continue
        name = f"{solid.name}_surface_{number}"
        _write_mesh(folder, name, format_obj(surface.vertices, surface.triangles, surface.uv))
        found[name] = surface.finish
    return found


def write_collider(name: str, shape: ConvexPiece, folder: Path) -> None:
    """Write a convex shape."""
    _write_mesh(folder, name, format_obj(shape.vertices, shape.triangles))


def write_picture(name: str, finish: Finish, folder: Path) -> None:
    """Write the colours of a finish that has a texture, without transparency."""
    assert finish.texture is not None, "only textures are written"
    (folder / MESH_FOLDER).mkdir(exist_ok=True)
    picture = np.ascontiguousarray(finish.texture[..., :3])
    Image.fromarray(picture).save(folder / MESH_FOLDER / f"{name}.png")


def _write_mesh(folder: Path, name: str, text: str) -> None:
    (folder / MESH_FOLDER).mkdir(exist_ok=True)
    (folder / MESH_FOLDER / f"{name}.obj").write_text(text, encoding="ascii", newline="\n")
