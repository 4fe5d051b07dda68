"""What carries weight: cases 12 to 14 of the validation suite."""

import pytest
from laws import statics

ONE_FIELD = 4.72e-3
"""Sink of the block in one field on the same grid [m]."""


def test_a_heavy_body_sinks_into_a_soft_one_as_in_one_field():
    found = statics.heavy_on_foam(8, True, time=0.2)
    assert found.mean == pytest.approx(ONE_FIELD, rel=0.05)
    assert found.period == pytest.approx(0.1366, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["12a", "12b"])
def test_a_heavy_body_sinks_alike_wherever_the_face_lies_on_the_grid(holds, case):
    holds(case, quick=case == "12b")


def test_a_confined_column_settles_under_its_weight_as_hooke_says(holds):
    holds("13", quick=True)


@pytest.mark.slow
def test_a_cantilever_bends_and_swings_as_beams_do(holds):
    holds("14", quick=True)
