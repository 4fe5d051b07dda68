"""A material field as a table: x, y, z and any of E, nu, density, with a line of names."""

import csv
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.fields.sampled_field import SampledField

TABLE_COLUMNS = {"young": "E", "poisson": "nu", "density": "density"}
TABLE_HEADER_HELP = "Its first line names the columns: x,y,z and any of E,nu,density (SI)."


def read_field_table(path: Path) -> SampledField:
    """Read a CSV file.

    Raises:
        BadFileError: A column is missing, or a cell is no number.

    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = [[cell.strip() for cell in line] for line in csv.reader(file) if any(line)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadFileError(path, "is no CSV file in UTF-8.", TABLE_HEADER_HELP) from error
    names, body = (lines[0], lines[1:]) if lines else ([], [])
    told = {ours: theirs for ours, theirs in TABLE_COLUMNS.items() if theirs in names}
    if not told or not {"x", "y", "z"} <= set(names):
        raise BadFileError(path, "lacks columns.", TABLE_HEADER_HELP)
    rows = np.array(
        [_line_numbers(path, k, line, len(names)) for k, line in enumerate(body, start=2)]
    )
    rows = rows.reshape(-1, len(names))
    column = {name: rows[:, k] for k, name in enumerate(names)}
    return SampledField(
        method="the table",
        path=path,
        position=np.stack([column[axis] for axis in "xyz"], axis=1),
        values={ours: column[theirs] for ours, theirs in told.items()},
    )


def _line_numbers(path: Path, number: int, line: list[str], width: int) -> list[float]:
    try:
        values = [float(cell) for cell in line]
    except ValueError as error:
        raise BadFileError(
            path, f"line {number} holds a cell that is no number.", TABLE_HEADER_HELP
        ) from error
    if len(values) != width:
        raise BadFileError(
            path, f"line {number} has {len(values)} cells, not {width}.", TABLE_HEADER_HELP
        )
    return values
