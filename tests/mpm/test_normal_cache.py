"""Which of three normals is taken is kept for some steps, and all engines keep the same."""

import numpy as np
import pytest
from laws.asked import in_fixed_order, on_device
from point_bodies import CELL, ball, body, problem, step_together

from corporeal.mpm.constants import NORMAL_CACHE_STEPS
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.reference.engine import ReferenceEngine

ENGINES = {"cpu": lambda given: CpuEngine(given, threads=1), "reference": ReferenceEngine, "cuda": on_device}
ROUND_OFF = {"position": 2e-6 * CELL, "velocity": 2e-5, "deformation": 2e-6}
"""What runs on a card may differ by: as from the reference."""
SAVED = {"cpu": "choices", "reference": "kept.candidate", "cuda": "choices"}


def touching(speed=0.0):
    """Two balls that all but touch, come nearer, and travel side by side."""
    bodies = (
        body(ball((0.0, 0.0, 0.0)), velocity=(0.0, speed, 0.0)),
        body(ball((0.1, 0.0, 0.0)), velocity=(-0.02, speed, 0.0)),
    )
    return problem(*bodies, planes=(), gravity=(0.0, 0.0, 0.0))


def test_where_nothing_new_touches_only_every_eighth_step_looks_at_particles():
    engine = CpuEngine(touching(), threads=1)
    looked = []
    for _ in range(3 * NORMAL_CACHE_STEPS):
        engine.step(1e-4)
        assert engine.contact.stage["touches"][0] > 20
        looked.append(bool(engine.world["reaches"].any()))
    assert looked == [k % NORMAL_CACHE_STEPS == 0 for k in range(3 * NORMAL_CACHE_STEPS)]


@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_bodies_that_pass_from_cell_to_cell_keep_what_the_reference_keeps(engine):
    """They cross two cells, are sorted meanwhile, and touch new nodes all the time."""
    given = touching(3.0)
    ours, sure = step_together(ENGINES[engine](given), ReferenceEngine(given), 40)
    moved = np.abs(sure.snapshot().position - np.concatenate([b.position for b in given.bodies]))
    assert moved.max() > 2.0 * CELL
    assert sure.measure().pair_impulse[0, 1] > 0
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-4 * CELL
    theirs = sure.measure().pair_impulse
    assert ours.measure().pair_impulse == pytest.approx(theirs, rel=1e-3)


@pytest.mark.parametrize("engine", list(ENGINES))
def test_choices_are_saved_and_going_on_from_them_changes_nothing(engine):
    straight, broken, again = (ENGINES[engine](touching(1.0)) for _ in range(3))
    for one in (straight, broken):
        for _ in range(NORMAL_CACHE_STEPS + 3):
            one.step(2e-4)
    saved = broken.save()
    assert len(saved[SAVED[engine]]) > 20
    again.restore(saved)
    for one in (straight, again):
        for _ in range(NORMAL_CACHE_STEPS):
            one.step(2e-4)
    same = engine != "cuda" or in_fixed_order()
    for name, apart in ROUND_OFF.items():
        ours, theirs = getattr(straight.snapshot(), name), getattr(again.snapshot(), name)
        assert np.abs(ours - theirs).max() <= (0.0 if same else apart), name
    ours, theirs = straight.save()[SAVED[engine]], again.save()[SAVED[engine]]
    if not same:
        ours, theirs = (rows[np.lexsort(rows.T)] for rows in (ours, theirs))
    assert np.array_equal(ours, theirs)


def test_room_for_more_contacts_does_not_lose_choices():
    small, roomy = ENGINES["cuda"](touching(1.0)), ENGINES["cuda"](touching(1.0))
    for engine in (small, roomy):
        for _ in range(3):
            engine.step(2e-4)
    kept = small._choices()
    small._make_room_for_contacts(2 * small.arrays.contacts.room)
    small.program.forget()
    assert np.array_equal(small._choices(), kept)
    for engine in (small, roomy):
        engine.step(2e-4)
    assert np.array_equal(small.snapshot().position, roomy.snapshot().position)
