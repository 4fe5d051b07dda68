"""Meshes and pictures beside an MJCF or a URDF."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import cast

import numpy as np
from jaxtyping import Float, Int
from PIL import Image

from corporeal.core.types import Finish
from corporeal.export.exported_solids import ExportedSolid
from corporeal.geometry.convex_hull import ConvexPiece


def format_obj(
    vertices: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "T 3"], uv: Float[np.ndarray, "V 2"] | None = None
) -> str:
    """Return the file's text.

    Args:
        vertices: [m]
        triangles: Vertex numbers.
        uv: Texture coordinates, v running down as in glTF; OBJ's run up.
    """
    rows = ["v %.9g %.9g %.9g\n" * len(vertices) % _flat(vertices)]
    corners = np.asarray(triangles) + 1
    if uv is None:
        return "".join([*rows, "f %d %d %d\n" * len(corners) % _flat(corners)])
    rows.append("vt %.7g %.7g\n" * len(uv) % _flat(np.column_stack([uv[:, 0], 1 - uv[:, 1]])))
    twice = np.repeat(corners, 2, axis=1)
    return "".join([*rows, "f %d/%d %d/%d %d/%d\n" * len(twice) % _flat(twice)])


def _flat(values: np.ndarray) -> tuple:
    return tuple(np.asarray(values).ravel().tolist())


def xml_numbers(values: Iterable[float] | np.ndarray) -> str:
    """Write numbers in twelve digits with spaces between."""
    return " ".join(f"{x:.12g}" for x in np.ravel(np.asarray(values, dtype=float)))


def write_xml(path: Path, root: ET.Element) -> None:
    """Write a document, indented."""
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n', encoding="utf-8")


def xml_comment(text: str) -> ET.Element:
    """Return a comment; two dashes, which XML forbids in one, are parted."""
    while "--" in text:
        text = text.replace("--", "- -")
    closed = text.rstrip("-")
    return cast(ET.Element, ET.Comment(f" {closed} "))


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
