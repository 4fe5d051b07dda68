"""A scale in metres says where it is from."""

import math

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.multiview.metric_scale import (
    ObjectExtent,
    choose_metric_scale,
    implausible_scene_extent,
    scale_from_distance,
    scale_from_extents,
    scale_from_file,
    stated_metric_scale,
)


def test_a_scale_states_its_source():
    assert (scale_from_file("GLB").metres_per_unit, scale_from_file("GLB").source) == (1.0, "file")
    far = scale_from_distance((0, 0, 0), (3, 0, 4), 0.5)
    assert (far.metres_per_unit, far.source) == (pytest.approx(0.1), "distance")
    assert far.reason == "Two points 5 units apart are 0.5 m apart."


def test_a_person_measures_the_unit_or_a_distance():
    assert stated_metric_scale(None, None, "he") is None
    unit = stated_metric_scale(0.5, None, "he")
    assert (unit.metres_per_unit, unit.reason) == (0.5, "One unit of the file is 0.5 m, he said.")
    far = stated_metric_scale(None, (1, 1, 1, 4, 1, 5, 0.5), "he")
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
            stated_metric_scale(per_unit, points, "he")


def test_scenes_as_large_as_towns_or_as_small_as_dust_are_reported():
    assert implausible_scene_extent(0.01) is None is implausible_scene_extent(20.0)
    assert "would be 1.5e+05 m large" in implausible_scene_extent(1.5e5)
    assert "--extent" in implausible_scene_extent(1e-4)


@pytest.mark.parametrize("metres", [0.0, -1.0, math.nan, math.inf])
def test_no_scale_comes_of_nonsense(metres):
    with pytest.raises(UserError, match="Both must be positive"):
        scale_from_distance((0, 0, 0), (1, 0, 0), metres)


# ---------------------------------------------------------------- whom to believe

MEASURED = scale_from_distance((0, 0, 0), (2, 0, 0), 1.0)
FILE = scale_from_file("A capture")
STATED = (ObjectExtent("duck", 4.0, 0.2, "the command line"),)
USUAL = (
    ObjectExtent("duck", 4.0, 0.4, "the table"),
    ObjectExtent("can", 1.0, 0.12, "the table"),
    ObjectExtent("chair", 2.0, 0.22, "a model"),
)


def test_the_best_witness_is_believed_and_the_others_are_heard():
    all_of_them = choose_metric_scale(MEASURED, STATED, FILE, USUAL)
    assert (all_of_them.metres_per_unit, all_of_them.source) == (0.5, "distance")
    assert len(all_of_them.warnings) == 2, "the file is off by a factor of 2 only"
    assert "4 units, 0.2 m (the command line)" in all_of_them.warnings[0]
    assert "0.1 times as large" in all_of_them.warnings[0]
    assert choose_metric_scale(None, STATED, FILE, USUAL).metres_per_unit == pytest.approx(0.05)
    assert choose_metric_scale(None, (), FILE, USUAL).source == "file"
    assert choose_metric_scale(None, (), None, USUAL).metres_per_unit == pytest.approx(0.11)


def test_an_object_that_disagrees_with_the_others_is_named():
    odd = (*USUAL, ObjectExtent("ant", 1.0, 0.003, "the table"))
    found = scale_from_extents(odd)
    assert found.metres_per_unit == pytest.approx(np.sqrt(0.1 * 0.11))
    assert "sizes of ant are off" in found.warnings[0]
    assert "--extent NAME=METRES" in found.warnings[0]
    assert scale_from_extents(USUAL).warnings == ()
    assert scale_from_extents(()) is None


def test_an_unknown_size_gets_a_named_substitute():
    found = choose_metric_scale(size=10.0)
    assert (found.metres_per_unit, found.source) == (pytest.approx(0.05), "default")
    assert "Its scale is unknown" in found.warnings[0]


@pytest.mark.parametrize("metres", [0.0, -1.0, math.nan, math.inf])
def test_nonsense_is_refused_by_the_name_of_the_object(metres):
    with pytest.raises(UserError, match="The extent of duck"):
        choose_metric_scale(stated=[ObjectExtent("duck", 1.0, metres, "the command line")])
