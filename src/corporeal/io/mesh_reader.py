"""The child process that reads one mesh file, within limits of time and memory.

::

    python -m corporeal.io.mesh_reader [--companions] FILE FOLDER

writes RAW (``mesh_raw.RawMesh``) or NAMED (paths of companions) into the folder, or in place of it
REFUSED, what is wrong. The libraries that read meshes were written for files that mean well: on
others some never return, take all memory, or die.
"""

import resource
import sys
from pathlib import Path

from corporeal.core import registry, store
from corporeal.core.errors import BadFileError, UserError
from corporeal.io.mesh_raw import EXPORT_AGAIN, write_raw
from corporeal.io.mesh_suffixes import MOST_MEMORY, MOST_SECONDS, USD

RAW, NAMED, REFUSED = "raw.npz", "named.json", "refused.json"
LISTING = "--companions"
READERS: dict[str, str] = {
    **{f".{kind}": f"corporeal.io.mesh_trimesh:read_{kind}" for kind in ("obj", "ply", "stl")},
    **{f".{kind}": f"corporeal.io.mesh_trimesh:read_{kind}" for kind in ("off", "3mf", "dae")},
    **dict.fromkeys(USD, "corporeal.io.mesh_usd:read_usd"),
}
"""Suffix → reader: a path in, a RawMesh out."""
LISTERS: dict[str, str] = dict.fromkeys(USD, "corporeal.io.mesh_usd:companions")
"""Suffix → what names the files that a file is made of, where only its library can tell."""


def main(words: list[str]) -> None:
    """Read one file as ``words`` say."""
    listing = words[0] == LISTING
    path, folder = (Path(word) for word in words[-2:])
    _limited()
    try:
        made = _called(LISTERS if listing else READERS, path)
        if listing:
            store.write_json(folder / NAMED, made)
        else:
            write_raw(folder / RAW, made)
    except UserError as problem:
        store.write_json(folder / REFUSED, str(problem).removeprefix(f"{path}: "))


def _called(menu: dict[str, str], path: Path):
    kind = path.suffix.lower()
    read = registry.load("reader of", kind, menu)
    try:
        return read(path)
    except (UserError, MemoryError):
        raise
    except RecursionError as problem:
        raise BadFileError(path, "is nested too deeply.", EXPORT_AGAIN) from problem
    except Exception as problem:  # the readers raise almost anything on broken input
        what = f"cannot be read as {kind[1:].upper()} ({' '.join(str(problem).split())[:80]})."
        raise BadFileError(path, what, EXPORT_AGAIN) from problem


def _limited() -> None:
    """Let the system end this process rather than wait for it."""
    for kind, most in (
        (resource.RLIMIT_AS, MOST_MEMORY),
        (resource.RLIMIT_FSIZE, MOST_MEMORY),
        (resource.RLIMIT_CPU, 2 * MOST_SECONDS),  # of all threads; the parent looks at the clock
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(kind, (most, most))


if __name__ == "__main__":
    main(sys.argv[1:])
