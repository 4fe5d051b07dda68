"""Tasks on particles and nodes, and their schedule on threads.

A task on particles is a piece of a column of blocks. Two that reach the same node must not run at once, and what they
add to it must come in one order, so that the result does not depend on the number of threads: that of their colours,
the parities of their z, x and y.

A phase for each colour keeps that order, and goes through all nodes once for each colour. What one thread does alone
may run in any sequence that keeps it between neighbours: layer by layer, and strip by strip in a layer, finds the nodes
where the last task left them, in a near cache.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from corporeal.mpm.cpu.field_window import FieldWindow
from corporeal.mpm.cpu.layout import COLOURS

NODE_BLOCKS_PER_TASK = 32
"""Node blocks of one task."""
PARTICLE_BLOCKS_PER_TASK = 2
"""Particle blocks, one above the other, of one task."""
ONE_THREAD_LOAD_RATIO = 8
"""A field of which each thread has at least so many times its particles to do is one thread's."""


@dataclass(frozen=True)
class ParticleTasks:
    """Tasks on particles of all fields."""

    row: np.ndarray
    """Field, first and last block, and which row of the report is its own, (T, 4)."""
    chore: np.ndarray
    """First and last task of those that are done one by one, by colour, (K, 2)."""
    colours: np.ndarray
    """How many chores each colour has, (COLOURS,)."""
    field: np.ndarray
    """Field of each row of the report, (T,)."""

    @property
    def first(self) -> list[int]:
        """First chore of each colour."""
        return (np.cumsum(self.colours) - self.colours).tolist()


def list_particle_tasks(windows: dict[int, FieldWindow], threads: int) -> ParticleTasks:
    """List tasks on particles, and how threads share them.

    The largest chores of a colour come first, so that those which end a phase are small, and no thread waits long. Rows
    of the report are in an order that the number of threads has no part in.
    """
    column = _column_pieces(windows)
    colour = column[:, 1:4] % 2 @ (2, 1, 4)
    by_colour = np.lexsort([-column[:, 6], colour])
    report = np.empty(len(column), np.int64)
    report[by_colour] = np.arange(len(column))
    alone = np.isin(column[:, 0], _one_thread_fields(windows, threads))
    walk = _task_order(column)
    order = np.concatenate([walk[alone[walk]], by_colour[~alone[by_colour]]])
    row = np.column_stack([column[:, [0, 4, 5]], report])[order].astype(np.int32)
    # One chore for each field that a thread has for itself, then one for each task.
    cuts = np.flatnonzero(np.diff(row[: alone.sum(), 0], prepend=-1, append=-1)).tolist()
    whole = np.reshape(list(pairwise(cuts)), (-1, 2)).astype(np.int32)
    size = np.add.reduceat(column[order, 6], whole[:, 0]) if len(whole) else np.zeros(0)
    single = np.arange(alone.sum(), len(row), dtype=np.int32)[:, None] + np.arange(2, dtype=np.int32)
    colours = np.bincount(colour[~alone], minlength=COLOURS)
    colours[0] += len(whole)
    chore = np.concatenate([whole[np.argsort(-size, kind="stable")], single]).astype(np.int32)
    return ParticleTasks(row, chore, colours, column[by_colour, 0])


def list_node_tasks(windows: dict[int, FieldWindow]) -> np.ndarray:
    """List tasks on nodes, (T, 4) field, first and last node block."""
    rows = [
        (f, low, min(low + NODE_BLOCKS_PER_TASK, len(window.where)), 0)
        for f, window in windows.items()
        for low in range(0, len(window.where), NODE_BLOCKS_PER_TASK)
    ]
    return np.array(rows, np.int32).reshape(-1, 4)


def _column_pieces(windows: dict[int, FieldWindow]) -> np.ndarray:
    """List pieces of columns of all fields, (T, 7): the field, then as ``Window.columns``."""
    pieces = [np.zeros((0, 7), np.int64)]
    for f, window in windows.items():
        columns = window.columns(PARTICLE_BLOCKS_PER_TASK)
        pieces.append(np.column_stack([np.full(len(columns), f), columns]))
    return np.concatenate(pieces)


def _one_thread_fields(windows: dict[int, FieldWindow], threads: int) -> list[int]:
    """Name the fields of which one thread does all tasks."""
    total = sum(window.count for window in windows.values())
    return [f for f, w in windows.items() if threads == 1 or w.count * threads * ONE_THREAD_LOAD_RATIO <= total]


def _task_order(column: np.ndarray) -> np.ndarray:
    """Order of tasks field by field, each even layer or strip before both of its odd neighbours."""
    field, x, y, z = column[:, :4].T
    return np.lexsort([y, y % 2, _even_first(x), _even_first(z), field])


def _even_first(number: np.ndarray) -> np.ndarray:
    """Sort 0, 2, 1, 4, 3, …: odd numbers right after the even one above them."""
    return 2 * number + 3 * (number % 2)
