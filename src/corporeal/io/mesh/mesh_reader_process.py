"""The child process that reads one mesh file, within limits of time and memory.

::

    python -m corporeal.io.mesh.mesh_reader_process [--companions] FILE FOLDER

writes RAW (``mesh_raw.RawMesh``) or NAMED (paths of companions) into the folder, or in place of it
REFUSED, what is wrong. The libraries that read meshes were written for files that mean well: on
others some never return, take all memory, or die.
"""

import resource
import sys
from pathlib import Path

from corporeal.core import registry, store
from corporeal.core.errors import BadFileError, UserError
from corporeal.io.mesh.mesh_suffixes import (
    MAX_MESH_READ_MEMORY_BYTES,
    MAX_MESH_READ_S,
    USD_SUFFIXES,
)
from corporeal.io.mesh.raw_mesh import MESH_EXPORT_ADVICE, write_raw_mesh

RAW_MESH_FILE, COMPANIONS_FILE, REFUSAL_FILE = "raw.npz", "named.json", "refused.json"
LIST_COMPANIONS_FLAG = "--companions"
MESH_READERS: dict[str, str] = {
    **{f".{kind}": f"corporeal.io.mesh.mesh_trimesh:read_{kind}" for kind in ("obj", "ply", "stl")},
    **{f".{kind}": f"corporeal.io.mesh.mesh_trimesh:read_{kind}" for kind in ("off", "3mf", "dae")},
    **dict.fromkeys(USD_SUFFIXES, "corporeal.io.usd.usd_meshes:read_usd"),
}
"""Suffix → reader: a path in, a RawMesh out."""
COMPANION_LISTERS: dict[str, str] = dict.fromkeys(
    USD_SUFFIXES, "corporeal.io.usd.usd_meshes:usd_companions"
)
"""Suffix → what names the files that a file is made of, where only its library can tell."""


def main(words: list[str]) -> None:
    """Read one file as ``words`` say."""
    listing = words[0] == LIST_COMPANIONS_FLAG
    path, folder = (Path(word) for word in words[-2:])
    _limit_resources()
    try:
        made = _run_reader(COMPANION_LISTERS if listing else MESH_READERS, path)
        if listing:
            store.write_json(folder / COMPANIONS_FILE, made)
        else:
            write_raw_mesh(folder / RAW_MESH_FILE, made)
    except UserError as problem:
        store.write_json(folder / REFUSAL_FILE, str(problem).removeprefix(f"{path}: "))


def _run_reader(menu: dict[str, str], path: Path):
    kind = path.suffix.lower()
    read = registry.load_backend("reader of", kind, menu)
    try:
        return read(path)
    except (UserError, MemoryError):
        raise
    except RecursionError as problem:
        raise BadFileError(path, "is nested too deeply.", MESH_EXPORT_ADVICE) from problem
    except Exception as problem:  # the readers raise almost anything on broken input
        what = f"cannot be read as {kind[1:].upper()} ({' '.join(str(problem).split())[:80]})."
        raise BadFileError(path, what, MESH_EXPORT_ADVICE) from problem


def _limit_resources() -> None:
    """Let the system end this process rather than wait for it."""
    for kind, most in (
        (resource.RLIMIT_AS, MAX_MESH_READ_MEMORY_BYTES),
        (resource.RLIMIT_FSIZE, MAX_MESH_READ_MEMORY_BYTES),
        (resource.RLIMIT_CPU, 2 * MAX_MESH_READ_S),  # of all threads; the parent looks at the clock
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(kind, (most, most))


if __name__ == "__main__":
    main(sys.argv[1:])
