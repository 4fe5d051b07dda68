"""Keyframes of prescribed motion: rows of time, position and optionally orientation.

A row is ``t, x, y, z`` [s, m]; with three more numbers a rotation vector since the first row [degrees] (for a turn
about one axis: the angle about it, as many times around as wanted), with four more a unit quaternion w, x, y, z of
which the change since the first row counts.
"""

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np
from jaxtyping import Float

from corporeal.core.errors import BadFileError
from corporeal.core.types import Keyframes, Vector
from corporeal.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix

ROW_LENGTH_POSITION, ROW_LENGTH_ROTATION_VECTOR, ROW_LENGTH_QUATERNION = 4, 7, 8
"""Numbers in a row without orientation, with a rotation vector, and with a quaternion."""
MAX_KEYFRAMES = 100_000
"""Rows of a path, and of a file of them."""
MAX_KEYFRAME_DISTANCE_M, MAX_KEYFRAME_SPEED_M_S, MAX_KEYFRAME_TIME_S = 1000.0, 1000.0, 3600.0
"""Beyond these distances [m], speeds [m/s] and times [s] an entry is taken for a slip."""
MAX_PARALLEL_AXES_SINE = 1e-6
"""Sine of the angle between rotation vectors that have one axis."""
KEYFRAME_ROWS_ADVICE = (
    "Give rows of t, x, y, z; or seven numbers with a rotation vector in degrees, or eight with a "
    "quaternion w, x, y, z."
)

FailCallback = Callable[[str, str], NoReturn]
"""Raises an error: what is wrong, what to do next."""


def keyframes_from_rows(rows: Sequence[Sequence[object]], fail: FailCallback) -> tuple[Vector, Keyframes]:
    """Return where a path begins [m], and how it goes on from there."""
    table = _checked_rows(rows, fail)
    time, place = table[:, 0], table[:, 1:4]
    if time[0] < 0.0 or time[-1] > MAX_KEYFRAME_TIME_S:
        fail(f"its times run from {time[0]:g} to {time[-1]:g} s.", f"Give 0 to {MAX_KEYFRAME_TIME_S:g} s.")
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if len(late):
        k = int(late[0]) + 1
        fail(f"row {k + 1} at {time[k]:g} s comes after {time[k - 1]:g} s.", "Let times rise.")
    if np.abs(place).max() > MAX_KEYFRAME_DISTANCE_M:
        fail("it leads farther away than a kilometre.", "Give metres.")
    _refuse_fast(time, np.linalg.norm(np.diff(place, axis=0), axis=1), fail)
    turn = _row_rotation_vectors(table[:, 4:], fail)
    shift = place - place[0]
    return _vector(place[0]), Keyframes(
        time=tuple(time.tolist()), shift=tuple(_vector(row) for row in shift), turn=tuple(_vector(row) for row in turn)
    )


def read_keyframe_file(file: Path, fail: FailCallback) -> tuple[Vector, Keyframes]:
    """Return the path in a CSV file; a first line without numbers is a heading.

    Raises:
        BadFileError: It cannot be read, or a line is none.
    """
    if not file.is_file():
        fail(f"there is no file {str(file)!r}.", "Check the path: it counts from the scene file.")
    rows: list[list[object]] = []
    try:
        with file.open(encoding="utf-8-sig", newline="") as lines:
            for number, line in enumerate(csv.reader(lines), 1):
                if any(cell.strip() for cell in line) and len(rows) <= MAX_KEYFRAMES:
                    rows += _numbers(file, number, line)
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise BadFileError(file, f"cannot be read ({problem}).", "Save it as CSV text.") from None

    def refuse(what: str, step: str) -> NoReturn:
        raise BadFileError(file, what, step)

    return keyframes_from_rows(rows, refuse)


def _numbers(file: Path, number: int, line: list[str]) -> Iterator[list[object]]:
    """Return the numbers of one line; none for a heading."""
    try:
        yield [float(cell) for cell in line]
    except ValueError:
        if number > 1:
            what = f"line {number} holds {','.join(line)[:40]!r}, not numbers."
            raise BadFileError(file, what, KEYFRAME_ROWS_ADVICE) from None


def _checked_rows(rows: Sequence[Sequence[object]], fail: FailCallback) -> Float[np.ndarray, "N C"]:
    """Return rows as numbers, of one length that means something."""
    if not 1 <= len(rows) <= MAX_KEYFRAMES:
        fail(f"it has {len(rows)} rows.", f"Give 1 to {MAX_KEYFRAMES}.")
    for k, row in enumerate(rows):
        number = isinstance(row, list) and all(
            isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in row
        )
        if not number or len(row) not in (ROW_LENGTH_POSITION, ROW_LENGTH_ROTATION_VECTOR, ROW_LENGTH_QUATERNION):
            fail(f"row {k + 1} is {str(row)[:40]}.", KEYFRAME_ROWS_ADVICE)
        if len(row) != len(rows[0]):
            fail(f"row {k + 1} has {len(row)} numbers, the first {len(rows[0])}.", KEYFRAME_ROWS_ADVICE)
    return np.array(rows, float)


def _refuse_fast(time: Float[np.ndarray, " N"], way: Float[np.ndarray, " N1"], fail: FailCallback) -> None:
    speed = way / np.diff(time)
    if len(speed) and speed.max() > MAX_KEYFRAME_SPEED_M_S:
        k = int(np.argmax(speed))
        what = f"it goes at {speed[k]:.3g} m/s from row {k + 1} to row {k + 2}."
        fail(what, f"Give metres and seconds, at most {MAX_KEYFRAME_SPEED_M_S:g} m/s.")


def _row_rotation_vectors(columns: Float[np.ndarray, "N O"], fail: FailCallback) -> Float[np.ndarray, "N 3"]:
    """Rotation vector of every row from the row before [rad]; that of the first is zero."""
    turn = np.zeros((len(columns), 3))
    if columns.shape[1] == ROW_LENGTH_ROTATION_VECTOR - ROW_LENGTH_POSITION:
        vectors = np.radians(columns - columns[0])
        for k in range(1, len(columns)):
            turn[k] = _relative_rotation_vector(vectors[k - 1], vectors[k])
    elif columns.shape[1] == ROW_LENGTH_QUATERNION - ROW_LENGTH_POSITION:
        size = np.linalg.norm(columns, axis=1)
        if np.abs(size - 1.0).max() > 0.01:
            k = int(np.argmax(np.abs(size - 1.0)))
            fail(f"the quaternion of row {k + 1} has length {size[k]:.3g}.", "Give unit ones.")
        frames = [matrix_from_quaternion(q) for q in columns]
        for k in range(1, len(columns)):
            turn[k] = _rotation_vector(frames[k] @ frames[k - 1].T)
    return turn


def _relative_rotation_vector(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Turn from one rotation vector to another: their difference, where they have one axis."""
    if np.linalg.norm(np.cross(a, b)) <= MAX_PARALLEL_AXES_SINE * np.linalg.norm(a) * np.linalg.norm(b):
        return b - a
    return _rotation_vector(_rotation_matrix(b) @ _rotation_matrix(a).T)


def _rotation_matrix(turn: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else turn
    return matrix_from_quaternion(np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)]))


def _rotation_vector(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Rotation vector by at most half a turn [rad]."""
    q = quaternion_from_matrix(rotation)
    size = float(np.linalg.norm(q[1:]))
    return q[1:] * (2.0 * math.atan2(size, q[0]) / size if size > 0.0 else 2.0)


def _vector(row: Float[np.ndarray, "3"]) -> Vector:
    x, y, z = row.tolist()
    return (x, y, z)


def rows_from_keyframes(start: Vector, path: Keyframes) -> tuple[tuple[float, ...], ...]:
    """Write a path that begins somewhere [m] as rows that ``keyframes_from_rows`` reads back."""
    place = np.array(start) + np.array(path.shift)
    turn = np.array(path.turn)
    columns = [np.array(path.time)[:, None], place]
    whole = np.cumsum(turn, axis=0)
    if turn.any():
        about = turn[np.argmax(np.linalg.norm(turn, axis=1))]
        askew = np.linalg.norm(np.cross(turn, about), axis=1)
        if np.all(askew <= MAX_PARALLEL_AXES_SINE * np.linalg.norm(turn, axis=1) * np.linalg.norm(about)):
            columns.append(np.degrees(whole))
        else:
            columns.append(_row_quaternions(turn))
    return tuple(tuple(row) for row in np.hstack(columns).tolist())


def _row_quaternions(turn: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 4"]:
    """Quaternion of every row since the first."""
    frame, found = np.eye(3), []
    for by in turn:
        frame = _rotation_matrix(by) @ frame
        found.append(quaternion_from_matrix(frame))
    return np.array(found)
