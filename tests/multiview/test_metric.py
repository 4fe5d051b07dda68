"""A scale in metres says where it is from."""

import math

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.multiview.metric import (
    Extent,
    chosen,
    implausible,
    measured,
    of_distance,
    of_extent,
    of_extents,
    of_file,
)


def test_a_scale_states_its_source():
    assert (of_file("GLB").metres_per_unit, of_file("GLB").source) == (1.0, "file")
    far = of_distance((0, 0, 0), (3, 0, 4), 0.5)
    assert (far.metres_per_unit, far.source) == (pytest.approx(0.1), "distance")
    assert far.reason == "Two points 5 units apart are 0.5 m apart."
    large = of_extent((-1, -1, -2), (1, 1, 2), 0.2, "a model")
    assert (large.metres_per_unit, large.source) == (pytest.approx(0.05), "extent")
    assert "4 units" in large.reason and "0.2 m in reality, a model said" in large.reason


def test_a_person_measures_the_unit_or_a_distance():
    assert measured(None, None, "he") is None
    unit = measured(0.5, None, "he")
    assert (unit.metres_per_unit, unit.reason) == (0.5, "One unit of the file is 0.5 m, he said.")
    far = measured(None, (1, 1, 1, 4, 1, 5, 0.5), "he")
    assert far.metres_per_unit == pytest.approx(0.1)
    assert far.reason == "Two points 5 units apart are 0.5 m apart, he said."
    assert {unit.source, far.source} == {"distance"}
    for per_unit, points, said in (
        (0.5, (0, 0, 0, 1, 0, 0, 1), "Give one of them"),
        (-1.0, None, "--metres-per-unit is -1 m"),
        (math.nan, None, "--metres-per-unit is nan m"),
        (None, (0, 0, 0, 1, 0, 0, 1e7), r"--known-distance: one unit is 1e\+07 m"),
        (None, (0, 0, 0, 0, 0, 0, 1), "distance of the two points is 0 units"),
    ):
        with pytest.raises(UserError, match=said):
            measured(per_unit, points, "he")


def test_scenes_as_large_as_towns_or_as_small_as_dust_are_told():
    assert implausible(0.01) is None is implausible(20.0)
    assert "would be 1.5e+05 m large" in implausible(1.5e5)
    assert "--extent" in implausible(1e-4)


@pytest.mark.parametrize("metres", [0.0, -1.0, math.nan, math.inf])
def test_no_scale_comes_of_nonsense(metres):
    with pytest.raises(UserError, match="Both must be positive"):
        of_distance((0, 0, 0), (1, 0, 0), metres)
    with pytest.raises(UserError, match="Both must be positive"):
        of_extent((1, 1, 1), (1, 1, 1), 1.0, "a model")


# ---------------------------------------------------------------- whom to believe

MEASURED = of_distance((0, 0, 0), (2, 0, 0), 1.0)
FILE = of_file("A capture")
STATED = (Extent("duck", 4.0, 0.2, "the command line"),)
USUAL = (
    Extent("duck", 4.0, 0.4, "the table"),
    Extent("can", 1.0, 0.12, "the table"),
    Extent("chair", 2.0, 0.22, "a model"),
)


def test_the_best_witness_is_believed_and_the_others_are_heard():
    all_of_them = chosen(MEASURED, STATED, FILE, USUAL)
    assert (all_of_them.metres_per_unit, all_of_them.source) == (0.5, "distance")
    assert len(all_of_them.warnings) == 2, "the file is off by a factor of 2 only"
    assert "4 units, 0.2 m (the command line)" in all_of_them.warnings[0]
    assert "0.1 times as large" in all_of_them.warnings[0]
    assert chosen(None, STATED, FILE, USUAL).metres_per_unit == pytest.approx(0.05)
    assert chosen(None, (), FILE, USUAL).source == "file"
    assert chosen(None, (), None, USUAL).metres_per_unit == pytest.approx(0.11)


def test_a_thing_that_disagrees_with_the_others_is_named():
    odd = (*USUAL, Extent("ant", 1.0, 0.003, "the table"))
    found = of_extents(odd)
    assert found.metres_per_unit == pytest.approx(np.sqrt(0.1 * 0.11))
    assert "sizes of ant are off" in found.warnings[0]
    assert "--extent NAME=METRES" in found.warnings[0]
    assert of_extents(USUAL).warnings == ()
    assert of_extents(()) is None


def test_where_nobody_knows_a_stand_in_is_named():
    found = chosen(size=10.0)
    assert (found.metres_per_unit, found.source) == (pytest.approx(0.05), "nobody")
    assert "Nobody knows how large it is" in found.warnings[0]


@pytest.mark.parametrize("metres", [0.0, -1.0, math.nan, math.inf])
def test_nonsense_is_refused_by_the_name_of_the_thing(metres):
    with pytest.raises(UserError, match="The extent of duck"):
        chosen(stated=[Extent("duck", 1.0, metres, "the command line")])
