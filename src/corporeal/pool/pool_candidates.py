"""Candidates for a pool: files, and what is declared about them beside their own metadata."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from corporeal.core.errors import UserError
from corporeal.io.input_files import is_model_file
from corporeal.pool.model_table import ModelRow, read_model_table
from corporeal.recognition.readable_names import everyday_words

MANIFEST_FILE = "manifest.csv"
"""Table that is picked up where it lies in an indexed folder or right above it."""
CONTAINER_FOLDER_NAMES = frozenset(
    "models objects assets files meshes scenes glbs original originals source binary embedded draco".split()
)
"""Folders of these names say nothing about what lies in them."""


@dataclass(frozen=True)
class PoolCandidate:
    """A model file with declared metadata; empty or None: nothing."""

    file: Path
    declared: ModelRow = field(default_factory=ModelRow)
    name: str = ""


def candidates_in(folders: Sequence[Path], table: Path | None = None, pool: Path | None = None) -> list[PoolCandidate]:
    """Return every model below the folders, each once, in the order of their paths.

    A file's class is what a table says; else the name of the folder it lies in, right below the indexed one; else
    nothing, and the file's own name will do.

    Args:
        folders: Searched with all their folders below.
        table: CSV of classes; what it says goes before a manifest. What it names and is missing is a candidate too, so
            that it is reported.
        pool: A folder whose own copies are no candidates.

    Raises:
        UserError: A folder is absent, or a table cannot be used.
    """
    declared = {} if table is None else read_model_table(table, [table.parent, *folders])
    found: dict[Path, PoolCandidate] = {}
    for folder in folders:
        rows = _manifest_of_folder(folder) | declared
        for file in model_files_below(folder, pool):
            row = rows.get(file.resolve()) or ModelRow(class_name=_class_by_folder(file, folder))
            found.setdefault(file.resolve(), PoolCandidate(file, row, _model_name(file, folder)))
    for path, row in declared.items():
        if not path.exists():
            found.setdefault(path, PoolCandidate(path, row))
    return [found[path] for path in sorted(found)]


def model_files_below(folder: Path, pool: Path | None = None) -> list[Path]:
    """Return all model files below a folder, by path; nothing hidden, nothing of the pool's own.

    Raises:
        UserError: There is no such folder.
    """
    if not folder.is_dir():
        raise UserError(f"{folder}: there is no such folder. Name a folder that holds models.")
    own = pool.resolve() if pool is not None else None
    return [
        path
        for path in sorted(folder.rglob("*"))
        if is_model_file(path)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.is_file()
        and (own is None or not path.resolve().is_relative_to(own))
    ]


def _manifest_of_folder(folder: Path) -> dict[Path, ModelRow]:
    for place in (folder, folder.resolve().parent):
        path = place / MANIFEST_FILE
        if path.is_file():
            return read_model_table(path, [place])
    return {}


def _class_by_folder(file: Path, folder: Path) -> str:
    words = (everyday_words(part) for part in file.relative_to(folder).parts[:-1])
    return next((w for w in words if w and w not in CONTAINER_FOLDER_NAMES), "")


def _model_name(file: Path, folder: Path) -> str:
    """Return what to call a model: its file, with the folder of one that is called model.glb."""
    if everyday_words(file.stem) or file.parent == folder:
        return file.stem
    return f"{file.parent.name}_{file.stem}"
