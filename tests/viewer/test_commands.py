"""What a page may ask of a live simulation."""

import json

import pytest

from corporeal.core.errors import UserError
from corporeal.discretization.live_quality import (
    LIVE_CELLS_ACROSS,
    MAX_STEP_TIME_FRACTION,
    MAX_STEPS_PER_SECOND,
    MIN_STEPS_PER_SECOND,
    LiveDemand,
    choose_live_quality,
)
from corporeal.viewer.commands import MAX_GRAVITY_M_S2, MAX_GRIP_FREQUENCY_HZ, MAX_POINT_M, Command, parse_command


def order(**given):
    return parse_command(json.dumps(given))


def test_an_order_is_read():
    asked = order(do="grab", seq=3, object=1, point=[0, 0.1, 2], to=[1, 2, 3], firm=2)
    assert asked == Command("grab", 3, 1, (0, 0.1, 2), (1, 2, 3), 2.0)
    assert order(do="contact", single=True).single and not order(do="contact", single=1).single


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "null", "7", '"grab"', "{", '{"do": "run"}', '{"do": ["grab"]}', "[" * 3000,
        '{"do": "pull", "to": [1, 2]}', '{"do": "pull", "to": [1, 2, NaN]}',
        '{"do": "pull", "to": [1, 2, 1e999]}', '{"do": "pull", "to": [1, 2, "3"]}',
        '{"do": "pull", "to": {"0": 1}}', '{"do": "grab", "firm": -Infinity}',
        '{"do": "grab", "object": 1.5}', '{"do": "grab", "object": -1}',
        '{"do": "grab", "object": true}', '{"do": "step", "seq": 1e300}',
        '{"do": "step", "x": "' + "a" * 5000 + '"}',
    ],
)  # fmt: skip
def test_everything_else_is_refused(text):
    with pytest.raises(UserError):
        parse_command(text)


def test_numbers_are_bounded():
    assert order(do="pull", to=[1e6, -1e6, 5]).to == (MAX_POINT_M, -MAX_POINT_M, 5)
    assert order(do="gravity", to=[0, 0, -1e4]).to == (0, 0, -MAX_GRAVITY_M_S2)
    assert order(do="grab", firm=1e5).firm == MAX_GRIP_FREQUENCY_HZ


EACH = 1.5e-7
"""CPU seconds per particle and step."""


def demand(count, motion=0.0, steps=MAX_STEPS_PER_SECOND):
    """A draft of so many particles, in cells of 1 cm."""
    return LiveDemand(EACH * count, 8, 0.01, steps, motion, stiffened=1.0)


@pytest.mark.parametrize("count", [10, 2_000, 20_000, 400_000])
@pytest.mark.parametrize("threads", [1, 4])
def test_a_live_quality_fits_into_its_share_of_the_threads(count, threads):
    found = choose_live_quality(demand(count), threads)
    assert found.cells_across in LIVE_CELLS_ACROSS
    particles = count * (found.cells_across / 8) ** 3
    cost = EACH * particles * found.steps_per_second
    assert MIN_STEPS_PER_SECOND <= found.steps_per_second <= MAX_STEPS_PER_SECOND
    assert cost <= MAX_STEP_TIME_FRACTION * threads * 1.001 or (
        found.cells_across == LIVE_CELLS_ACROSS[-1] and found.steps_per_second == MIN_STEPS_PER_SECOND
    )


def test_spare_time_buys_cells_and_then_steps():
    few, many = choose_live_quality(demand(500), 4), choose_live_quality(demand(30_000), 2)
    assert few.cells_across == LIVE_CELLS_ACROSS[0] and few.steps_per_second > 2 * MIN_STEPS_PER_SECOND
    assert many.cells_across < few.cells_across
    finer = choose_live_quality(demand(30_000), 4)
    assert (finer.cells_across, finer.steps_per_second) > (many.cells_across, 0)


def test_what_moves_fast_is_simulated_coarser_as_its_steps_cannot_be_saved():
    slow, fast = (choose_live_quality(demand(2_000), 2), choose_live_quality(demand(2_000, motion=5.0), 2))
    assert fast.cells_across < slow.cells_across


def test_what_takes_few_steps_as_it_is_needs_no_coarser_cells():
    assert choose_live_quality(demand(4_000, motion=5.0, steps=500.0), 2).cells_across == LIVE_CELLS_ACROSS[0]
