"""A table of models (CSV): the class of each file and, where known, licence, credit and size."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.errors import BadFileError

COLUMNS = {
    "class_name": ("class", "category"),
    "licence": ("licence", "license"),
    "attribution": ("attribution", "credit"),
    "source": ("source", "source_repo"),
    "metric": ("metric", "metric_scale"),
    "extent": ("extent_m", "max_extent_m"),
}
"""What is read, and the names that its column may have."""
YES, NO = ("yes", "true", "1"), ("no", "false", "0")
EXAMPLE = "Its first line names the columns, for example: file,class,licence,attribution."


@dataclass(frozen=True)
class Row:
    """What a table says of one file; empty or None: nothing."""

    class_name: str = ""
    licence: str = ""
    attribution: str = ""
    source: str = ""
    metric: bool | None = None
    """Whether the file's lengths are metres."""
    extent: float | None = None
    """Largest extent of the mesh [m]."""


def read_table(path: Path, places: Sequence[Path]) -> dict[Path, Row]:
    """Read a table.

    Args:
        path: A CSV whose column ``file`` names files.
        places: Folders that the names may be relative to; the first that holds the file counts.

    Raises:
        BadFileError: It is no such table.

    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            heads = [h.strip().lower() for h in reader.fieldnames or ()]
            if "file" not in heads:
                raise BadFileError(path, "has no column 'file'.", EXAMPLE)
            reader.fieldnames = heads
            lines = [(reader.line_num, line) for line in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise BadFileError(path, f"cannot be read as a table ({problem}).", EXAMPLE) from problem
    rows = {}
    for number, line in lines:
        name = _cell(line, ("file",))
        if name:
            rows[_located(name, places)] = _row(path, number, line)
    return rows


def _located(name: str, places: Sequence[Path]) -> Path:
    paths = [place / name for place in places]
    return next((p for p in paths if p.exists()), paths[0]).resolve()


def _row(path: Path, number: int, line: dict) -> Row:
    words = {key: _cell(line, names) for key, names in COLUMNS.items()}
    try:
        metric, extent = _truth(words.pop("metric")), _length(words.pop("extent"))
    except ValueError as problem:
        raise BadFileError(path, f"line {number}: {problem}.", EXAMPLE) from None
    return Row(**words, metric=metric, extent=extent)


def _cell(line: dict, names: tuple[str, ...]) -> str:
    return next((" ".join(v.split()) for n in names if isinstance(v := line.get(n), str) and v), "")


def _truth(text: str) -> bool | None:
    """Read yes or no by the first word: "no (artist units)"."""
    word = (text.lower().split() or [""])[0]
    if word in YES:
        return True
    if word in NO or not word:
        return None if not word else False
    raise ValueError(f"{text!r} is neither yes nor no")


def _length(text: str) -> float | None:
    if not text:
        return None
    try:
        metres = float(text)
    except ValueError:
        metres = -1.0
    if not 0 < metres < 1e6:
        raise ValueError(f"{text!r} is no length in metres")
    return metres
