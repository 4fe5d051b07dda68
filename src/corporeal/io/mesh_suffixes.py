"""Mesh files beside glTF: their suffixes, and what is taken for granted where they are silent."""

from pathlib import Path
from typing import Literal

from corporeal.io.ply import LONGEST_HEADER

USD = (".usd", ".usda", ".usdc", ".usdz")
MESHES = (".obj", ".ply", ".stl", ".off", ".3mf", ".dae", *USD)
MOST_SECONDS = 60
"""For reading one file [s]."""
MOST_MEMORY = 4 * 2**30
"""For reading one file, address space [bytes]."""
PlyKind = Literal["splat", "mesh", "points"]
SPLAT = frozenset((b"f_dc_0", b"opacity", b"scale_0", b"rot_0"))
"""Properties of a vertex that make it a Gaussian (INRIA's layout)."""


def kind_of_ply(path: Path) -> PlyKind:
    """Tell by its header what a PLY file holds; one that cannot be read is taken for a splat."""
    try:
        with path.open("rb") as stream:
            head, complete, _ = stream.read(LONGEST_HEADER).partition(b"end_header")
    except OSError:
        return "splat"
    if not complete:
        return "splat"
    rows = [line.split() for line in head.splitlines()]
    counts = {r[1]: r[2] for r in rows if len(r) == 3 and r[0] == b"element"}
    if b"chunk" in counts or SPLAT <= {r[-1] for r in rows if r[:1] == [b"property"]}:
        return "splat"
    filled = any(counts.get(name, b"0") != b"0" for name in (b"face", b"tristrips"))
    return "mesh" if filled else "points"


def is_mesh(path: Path) -> bool:
    """Whether a file is a mesh beside glTF, by its suffix; a PLY also by its header."""
    suffix = path.suffix.lower()
    return suffix in MESHES and (suffix != ".ply" or kind_of_ply(path) == "mesh")
