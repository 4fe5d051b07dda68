"""The sort of a field's particles fills memory that an earlier sort left."""

import numpy as np
from point_bodies import CELL, ball, body, problem

from corporeal.core.types import Law
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cpu.layout import CHANNELS
from corporeal.mpm.cpu.particle_sorter import SpareMemory


def test_sort_after_sort_two_memories_take_turns():
    engine = CpuEngine(problem(body(ball((0, 0, 0.2), 0.1), Law.DRUCKER_PRAGER)), threads=1)
    window = engine.window[0]
    window.sort()
    part, history = window.part.base, window.history.base
    for k in range(6):
        window.sort()
        assert (window.part.base is part) == (window.history.base is history) == (k % 2 == 1)


def test_small_fields_never_fill_the_memory_of_a_large_one():
    spare = SpareMemory(CHANNELS)
    large, small = spare.rows(1000), spare.rows(10)
    spare.keep(large)
    spare.keep(small)
    assert spare.rows(10).base is not large.base
    assert spare.rows(900).base is large.base
    assert spare.rows(900).base is not large.base, "it is in use"


def test_a_field_that_needs_more_memory_gets_it_and_leaves_room():
    spare = SpareMemory(CHANNELS)
    spare.keep(spare.rows(100))
    first = spare.rows(120)
    assert first.shape == (120, CHANNELS, 8) and first.ctypes.data % 64 == 0
    assert not len(spare.memory), "what was too small is not kept beside it"
    spare.keep(first)
    assert spare.rows(125).base is first.base


def test_particles_keep_their_state_through_a_sort_into_used_memory():
    moving = body(ball((0, 0, 0.2), 4 * CELL), velocity=(1, 2, 3))
    engine = CpuEngine(problem(moving), threads=1)
    before = engine.snapshot()
    for _ in range(3):
        engine.window[0].sort()
    after = engine.snapshot()
    for name in ("position", "velocity", "deformation"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
