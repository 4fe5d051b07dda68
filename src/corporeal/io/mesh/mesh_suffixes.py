"""Suffixes of mesh files besides glTF, and their default axes and units."""

from pathlib import Path
from typing import Literal

from corporeal.io.ply_container import MAX_PLY_HEADER_BYTES

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
MESH_SUFFIXES = (".obj", ".ply", ".stl", ".off", ".3mf", ".dae", *USD_SUFFIXES)
MAX_MESH_READ_S = 60
"""For reading one file [s]."""
MAX_MESH_READ_MEMORY_BYTES = 4 * 2**30
"""For reading one file, address space [bytes]."""
PlyKind = Literal["splat", "mesh", "points"]
SPLAT_PLY_PROPERTIES = frozenset((b"f_dc_0", b"opacity", b"scale_0", b"rot_0"))
"""Properties of a vertex that make it a Gaussian (INRIA's layout)."""


def kind_of_ply(path: Path) -> PlyKind:
    """Tell by its header what a PLY file holds; one that cannot be read is taken for a splat."""
    try:
        with path.open("rb") as stream:
            head, complete, _ = stream.read(MAX_PLY_HEADER_BYTES).partition(b"end_header")
    except OSError:
        return "splat"
    if not complete:
        return "splat"
    rows = [line.split() for line in head.splitlines()]
    counts = {r[1]: r[2] for r in rows if len(r) == 3 and r[0] == b"element"}
    if b"chunk" in counts or SPLAT_PLY_PROPERTIES <= {
        r[-1] for r in rows if r[:1] == [b"property"]
    }:
        return "splat"
    filled = any(counts.get(name, b"0") != b"0" for name in (b"face", b"tristrips"))
    return "mesh" if filled else "points"


def is_mesh_file(path: Path) -> bool:
    """Whether a file is a mesh beside glTF, by its suffix; a PLY also by its header."""
    suffix = path.suffix.lower()
    return suffix in MESH_SUFFIXES and (suffix != ".ply" or kind_of_ply(path) == "mesh")
