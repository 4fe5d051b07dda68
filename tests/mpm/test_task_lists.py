"""Tasks on particles: each is done once, and neighbours in the order of their colours."""

import numpy as np
import pytest
from point_bodies import CELL, body, problem

from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cpu.task_lists import list_particle_tasks


def box(corner, cells):
    """Fill a box of so many cells, a point to each."""
    axes = [CELL * (0.5 + np.arange(n)) for n in cells]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return body(points + corner, spacing=CELL)


def windows():
    """Of one large body and of many small ones."""
    small = [box((k, 2, 0), (6, 9, 11)) for k in range(20)]
    return CpuEngine(problem(box((0, 0, 0), (20, 14, 30)), *small), threads=1).window


WINDOWS = windows()
THREADS = pytest.mark.parametrize("threads", [1, 2, 3])


@THREADS
def test_every_block_has_one_task_and_every_task_one_chore(threads):
    tasks = list_particle_tasks(WINDOWS, threads)
    done = [
        (f, b) for first, last in tasks.chore for f, low, high, _ in tasks.row[first:last] for b in range(low, high)
    ]
    assert len(set(done)) == len(done) == sum(len(w.block) for w in WINDOWS.values())
    assert sorted(tasks.row[:, 3]) == list(range(len(tasks.row)))
    assert np.array_equal(tasks.field[tasks.row[:, 3]], tasks.row[:, 0])
    assert tasks.colours.sum() == len(tasks.chore)


def test_rows_of_the_report_are_the_same_on_any_number_of_threads():
    one, several = (list_particle_tasks(WINDOWS, threads) for threads in (1, 3))
    assert not np.array_equal(one.row, several.row), "they are done in another order"
    assert {tuple(row) for row in one.row} == {tuple(row) for row in several.row}


@THREADS
def test_neighbours_are_never_done_at_once_and_always_in_the_order_of_their_colours(threads):
    tasks = list_particle_tasks(WINDOWS, threads)
    phase = np.repeat(np.arange(len(tasks.colours)), tasks.colours)
    found = 0
    for f, window in WINDOWS.items():
        place, when, at = [], [], []
        for c, (first, last) in enumerate(tasks.chore):
            for number in range(first, last):
                field, low, _, _ = tasks.row[number]
                if field == f:
                    x, y, z = window.block[low, 2:5]
                    place.append((x, y, (z - 1) // 2))
                    at.append((phase[c], c))
                    when.append((phase[c], number))
        place = np.array(place)
        colour = place % 2 @ (2, 1, 4)
        near = (np.abs(place[:, None] - place[None]) <= 1).all(axis=2)
        for i, j in np.argwhere(near & (colour[:, None] < colour[None])):
            assert when[i] < when[j]
            assert at[i] == at[j] or at[i][0] < at[j][0], "in one chore, or in an earlier phase"
            found += 1
    assert found > 100


def test_small_fields_are_one_threads_and_large_ones_are_shared():
    tasks = list_particle_tasks(WINDOWS, 2)
    fields = [{int(f) for f in tasks.row[first:last, 0]} for first, last in tasks.chore]
    assert all(len(of) == 1 for of in fields)
    chores = np.bincount([f for of in fields for f in of])
    assert chores[0] > 20
    assert (chores[1:] == 1).all()
