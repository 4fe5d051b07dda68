"""The files beside an OBJ, a PLY or a DAE that it is made of, or that these name in turn."""

import re
from pathlib import Path

from corporeal.io.referenced_files import path_beside

MAX_COMPANION_TEXT_BYTES = 2**26
"""Of a text that is looked through for companions [bytes]."""
MTL_KEYWORDS = r"map_\w+|bump|norm|disp|decal"
"""Before the names of pictures."""


def obj_companions(path: Path) -> list[Path]:
    """Return the materials of an OBJ, and their pictures."""
    materials = _named_after("mtllib", path)
    return [file for m in materials for file in (m, *_named_after(MTL_KEYWORDS, m))]


def ply_companions(path: Path) -> list[Path]:
    """Return the picture of a PLY."""
    return _named_after(r"comment[ \t]+TextureFile", path)


def dae_companions(path: Path) -> list[Path]:
    """Return the pictures of a COLLADA."""
    return _files_beside(path, re.findall(r"<init_from>\s*(?:<ref>)?([^<]+?)\s*<", _text(path)))


def _named_after(keywords: str, path: Path) -> list[Path]:
    """Return what follows keywords at the beginnings of lines."""
    pattern = rf"(?mi)^[ \t]*(?:{keywords})[ \t]+(?:-\w+[ \t]+\S+[ \t]+)*(.+?)[ \t\r]*$"
    return _files_beside(path, re.findall(pattern, _text(path)))


def _files_beside(path: Path, names: list[str]) -> list[Path]:
    return [file for name in names if (file := path_beside(path.parent, name)) is not None]


def _text(path: Path) -> str:
    with path.open("rb") as stream:
        return stream.read(MAX_COMPANION_TEXT_BYTES).decode(errors="replace")
