"""The child process that reads one mesh file, within limits of time and memory.

::

    python -m corporeal.io.mesh.mesh_reader_process MODULE:FUNCTION FILE FOLDER

calls a function of a ``registry.Reader`` with the file and writes what it returns into the folder: RAW_MESH_FILE
(``raw_mesh.RawMesh``), COMPANIONS_FILE (paths), or in place of them REFUSAL_FILE, what is wrong. The libraries that
read meshes were written for files that mean well: on others some never return, take all memory, or die.
"""

import resource
import sys
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.registry import load_function
from corporeal.io.mesh.raw_mesh import MESH_EXPORT_ADVICE, RawMesh, write_raw_mesh

RAW_MESH_FILE, COMPANIONS_FILE, REFUSAL_FILE = "raw.npz", "named.json", "refused.json"
MAX_MESH_READ_S = 60
"""For reading one file [s]."""
MAX_MESH_READ_MEMORY_BYTES = 4 * 2**30
"""For reading one file, address space [bytes]."""


def main(place: str, file: str, into: str) -> None:
    """Call the function at ``place`` with a file."""
    path, folder = Path(file), Path(into)
    _limit_resources()
    try:
        made = _call(place, path)
        if isinstance(made, RawMesh):
            write_raw_mesh(folder / RAW_MESH_FILE, made)
        else:
            store.write_json(folder / COMPANIONS_FILE, list(map(str, made)))
    except UserError as problem:
        store.write_json(folder / REFUSAL_FILE, str(problem).removeprefix(f"{path}: "))


def _call(place: str, path: Path):
    read = load_function(place)
    try:
        return read(path)
    except (UserError, MemoryError):
        raise
    except RecursionError as problem:
        raise BadFileError(path, "is nested too deeply.", MESH_EXPORT_ADVICE) from problem
    except Exception as problem:  # the readers raise almost anything on broken input
        kind = path.suffix[1:].upper()
        what = f"cannot be read as {kind} ({' '.join(str(problem).split())[:80]})."
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
    main(*sys.argv[1:])
