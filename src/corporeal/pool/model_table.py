"""CSV tables of models: class, licence, credit and size."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.errors import BadFileError

MODEL_TABLE_COLUMNS = {
    "class_name": ("class", "category"),
    "licence": ("licence", "license"),
    "attribution": ("attribution", "credit"),
    "source": ("source", "source_repo"),
    "metric": ("metric", "metric_scale"),
    "extent": ("extent_m", "max_extent_m"),
}
"""What is read, and the names that its column may have."""
YES_WORDS, NO_WORDS = ("yes", "true", "1"), ("no", "false", "0")
MODEL_TABLE_HELP = "Its first line names the columns, for example: file,class,licence,attribution."


@dataclass(frozen=True)
class ModelRow:
    """What a table says of one file; empty or None: nothing."""

    class_name: str = ""
    licence: str = ""
    attribution: str = ""
    source: str = ""
    metric: bool | None = None
    """Whether the file's lengths are metres."""
    extent: float | None = None
    """Largest extent of the mesh [m]."""


def read_model_table(path: Path, places: Sequence[Path]) -> dict[Path, ModelRow]:
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
                raise BadFileError(path, "has no column 'file'.", MODEL_TABLE_HELP)
            reader.fieldnames = heads
            lines = [(reader.line_num, line) for line in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise BadFileError(path, f"cannot be read as a table ({problem}).", MODEL_TABLE_HELP) from problem
    rows = {}
    for number, line in lines:
        name = _cell_text(line, ("file",))
        if name:
            rows[_located_file(name, places)] = _model_row(path, number, line)
    return rows


def _located_file(name: str, places: Sequence[Path]) -> Path:
    paths = [place / name for place in places]
    return next((p for p in paths if p.exists()), paths[0]).resolve()


def _model_row(path: Path, number: int, line: dict) -> ModelRow:
    words = {key: _cell_text(line, names) for key, names in MODEL_TABLE_COLUMNS.items()}
    try:
        metric, extent = _parse_yes_no(words.pop("metric")), _parse_length(words.pop("extent"))
    except ValueError as problem:
        raise BadFileError(path, f"line {number}: {problem}.", MODEL_TABLE_HELP) from None
    return ModelRow(**words, metric=metric, extent=extent)


def _cell_text(line: dict, names: tuple[str, ...]) -> str:
    return next((" ".join(v.split()) for n in names if isinstance(v := line.get(n), str) and v), "")


def _parse_yes_no(text: str) -> bool | None:
    """Read yes or no by the first word: "no (artist units)"."""
    word = (text.lower().split() or [""])[0]
    if word in YES_WORDS:
        return True
    if word in NO_WORDS or not word:
        return None if not word else False
    raise ValueError(f"{text!r} is neither yes nor no")


def _parse_length(text: str) -> float | None:
    if not text:
        return None
    try:
        metres = float(text)
    except ValueError:
        metres = -1.0
    if not 0 < metres < 1e6:
        raise ValueError(f"{text!r} is no length in metres")
    return metres
