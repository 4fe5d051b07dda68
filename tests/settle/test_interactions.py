"""An interaction moves as little as it can, through free space, at a speed that arrives."""

from math import sqrt

import numpy as np
import pytest

from corporeal.settle.interactions import FALL, KINDS, NEEDS, SPEED, act

NAMES = ["a", "b", "c"]


def box(x, y, size, base=0.0):
    half = size / 2
    return [[x - half, y - half, base], [x + half, y + half, base + size]]


ROW = np.array([box(-0.4, 0, 0.2), box(0, 0, 0.3), box(0.5, 0, 0.4)])


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_finds_room_in_a_row_and_none_in_too_few(kind):
    action = act(ROW, NAMES, kind, np.random.default_rng(0))
    assert action is not None and action.kind == kind and 0.5 <= action.duration <= 3
    few = NEEDS[kind] - 1
    assert act(ROW[:few], NAMES[:few], kind, np.random.default_rng(0)) is None


def test_the_same_seed_begins_the_same_and_another_one_differs():
    first, again, other = (act(ROW, NAMES, "wind", np.random.default_rng(k)) for k in (1, 1, 2))
    assert first == again != other


def test_what_falls_hangs_above_its_own_place_and_what_lay_on_it_stays_above():
    pile = np.array([box(0, 0, 0.4), box(0, 0, 0.2, base=0.4)])
    action = act(pile, NAMES[:2], "fall", np.random.default_rng(3))
    low, high = (e.position for e in action.entries)
    assert low[:2] == high[:2] == (0, 0)
    assert FALL[0] * 0.4 <= low[2] <= FALL[1] * 0.4
    assert high[2] >= low[2] + 0.4 + FALL[0] * 0.2


def test_a_thing_falls_onto_another_from_above_its_top():
    action = act(ROW[:2], NAMES[:2], "fall-onto", np.random.default_rng(0))
    (entry,) = action.entries
    assert entry.name == "a" and entry.position[:2] == (0, 0)
    assert 0.3 + FALL[0] * 0.2 <= entry.position[2] <= 0.3 + FALL[1] * 0.2


def test_what_something_rests_on_is_not_taken_away():
    pile = np.array([box(0, 0, 0.1), box(0, 0, 0.3, base=0.1), box(1, 0, 0.5)])
    for seed in range(20):
        for kind in ("fall-onto", "collision"):
            action = act(pile, NAMES, kind, np.random.default_rng(seed))
            assert action is None or action.entries[0].name != "a"


def test_a_thing_that_slides_arrives_at_the_speed_that_was_drawn():
    action = act(ROW[:2], NAMES[:2], "collision", np.random.default_rng(4))
    (entry,) = action.entries
    gap = 0.4 - 0.1 - 0.15
    start = entry.velocity[0]
    arrival = sqrt(start**2 - 2 * 0.6 * 9.81 * gap)
    assert entry.name == "a" and entry.velocity[1:] == (0, 0)
    assert SPEED[0] <= arrival / sqrt(9.81 * 0.3) <= SPEED[1]


def test_nothing_is_sent_through_what_stands_between():
    for seed in range(20):
        action = act(ROW, NAMES, "collision", np.random.default_rng(seed))
        name, v = action.entries[0].name, action.entries[0].velocity
        assert (name, np.sign(v[0])) in (("a", 1), ("b", 1), ("b", -1), ("c", -1))
        assert "sent into" in action.words and not {"a", "c"} <= set(action.words.split())


def test_a_chain_starts_at_an_end_of_the_row():
    turned = ROW[[1, 0, 2]]
    action = act(turned, ["b", "a", "c"], "chain", np.random.default_rng(0))
    assert action.entries[0].name in ("a", "c")
    assert "into b" in action.words


def test_wind_blows_on_everything_alike_and_along_the_floor():
    action = act(ROW, NAMES, "wind", np.random.default_rng(0))
    winds = {e.wind for e in action.entries}
    assert [e.name for e in action.entries] == NAMES and len(winds) == 1
    assert winds.pop().velocity[2] == 0
