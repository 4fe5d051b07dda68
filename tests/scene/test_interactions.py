"""An interaction moves as little as it can, through free space, at a speed that arrives."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from bodies import ball, box

from corporeal.mpm.physics import wind_pressure
from corporeal.scene.interactions import (
    FALL_HEIGHT_SIZES_RANGE,
    IMPACT_SPEED_RATIO_RANGE,
    INTERACTION_KINDS,
    MAX_WIND_SPEED_M_S,
    MIN_APPROACH_SIZE_FRACTION,
    MIN_OBJECTS_OF_KIND,
    WIND_DURATION_S,
    WIND_SPEED_RATIO_RANGE,
    begin_interaction,
)
from corporeal.scene.settling_body import UNKNOWN_FRICTION, BodyPose
from corporeal.scene.wind_threshold import (
    AIR_DENSITY_KG_M3,
    FLAT_PLATE_DRAG_COEFFICIENT,
    ROUND_FOOT_SIZE_FRACTION,
    drag_areas,
    wind_threshold,
)

GRAVITY = 9.81


def cube(name, size, density=200.0):
    return replace(box(size, size, size, name=name), density=density)


def stood(*things):
    """Bodies and poses of (body, x, height above the floor)."""
    bodies = [b for b, _, _ in things]
    return bodies, [BodyPose((x, 0.0, base + b.extent / 2)) for b, x, base in things]


ROW = stood((cube("a", 0.2), -0.4, 0), (cube("b", 0.3), 0, 0), (cube("c", 0.4), 0.5, 0))


def begun(scene, kind, seed):
    return begin_interaction(*scene, kind, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", INTERACTION_KINDS)
def test_every_kind_finds_room_in_a_row_and_none_in_too_few(kind):
    action = begun(ROW, kind, 0)
    assert action is not None and action.kind == kind and 0.5 <= action.duration <= 3
    few = MIN_OBJECTS_OF_KIND[kind] - 1
    assert begun((ROW[0][:few], ROW[1][:few]), kind, 0) is None


def test_the_same_seed_begins_the_same_and_another_one_differs():
    first, again, other = (begun(ROW, "wind", k) for k in (1, 1, 2))
    assert first == again != other


def test_what_falls_hangs_above_its_own_place_and_what_lay_on_it_stays_above():
    pile = stood((cube("a", 0.4), 0, 0), (cube("b", 0.2), 0, 0.4))
    low, high = (e.position for e in begun(pile, "fall", 3).entries)
    assert low[:2] == high[:2] == (0, 0)
    assert FALL_HEIGHT_SIZES_RANGE[0] * 0.4 <= low[2] <= FALL_HEIGHT_SIZES_RANGE[1] * 0.4
    assert high[2] >= low[2] + 0.4 + FALL_HEIGHT_SIZES_RANGE[0] * 0.2


def test_an_object_falls_onto_another_from_above_its_top():
    (entry,) = begun((ROW[0][:2], ROW[1][:2]), "fall-onto", 0).entries
    assert entry.name == "a" and entry.position[:2] == (0, 0)
    assert 0.3 + FALL_HEIGHT_SIZES_RANGE[0] * 0.2 <= entry.position[2] <= 0.3 + FALL_HEIGHT_SIZES_RANGE[1] * 0.2


def test_what_something_rests_on_is_not_taken_away():
    pile = stood((cube("a", 0.1), 0, 0), (cube("b", 0.3), 0, 0.1), (cube("c", 0.5), 1, 0))
    for seed in range(20):
        for kind in ("fall-onto", "collision"):
            action = begun(pile, kind, seed)
            assert action is None or action.entries[0].name != "a"


def test_an_object_that_slides_arrives_at_the_speed_that_was_drawn():
    pair = stood((cube("a", 0.2, 2000.0), -0.4, 0), (cube("b", 0.3), 0, 0))
    (entry,) = begun(pair, "collision", 4).entries
    gap = 0.4 - 0.1 - 0.15
    start = entry.velocity[0]
    arrival = sqrt(start**2 - 2 * UNKNOWN_FRICTION * GRAVITY * gap)
    assert entry.name == "a" and entry.velocity[1:] == (0, 0)
    assert IMPACT_SPEED_RATIO_RANGE[0] <= arrival / sqrt(GRAVITY * 0.3) <= IMPACT_SPEED_RATIO_RANGE[1]


def test_what_is_sent_is_heavy_enough_to_be_felt():
    """The small one is no heavier than a twentieth of the large one, unless it is of iron."""
    light, iron = (stood((cube("a", 0.15, d), -0.4, 0), (cube("b", 0.4), 0, 0)) for d in (500, 8e3))
    for seed in range(5):
        assert begun(light, "collision", seed).entries[0].name == "b"
        assert begun(iron, "collision", seed).entries[0].name == "a"


def test_nothing_is_sent_through_what_stands_between():
    for seed in range(20):
        action = begun(ROW, "collision", seed)
        name, v = action.entries[0].name, action.entries[0].velocity
        assert (name, np.sign(v[0])) in (("a", 1), ("b", 1), ("b", -1), ("c", -1))
        assert "sent into" in action.words and not {"a", "c"} <= set(action.words.split())


@pytest.mark.parametrize(("gap", "found"), [(0.9, False), (1.1, True)])
def test_nothing_is_sent_into_what_its_own_weight_may_spread_onto(gap, found):
    between = 0.1 + 0.15 + gap * MIN_APPROACH_SIZE_FRACTION * 0.3
    pair = stood((cube("a", 0.2), 0, 0), (cube("b", 0.3), between, 0))
    assert (begun(pair, "collision", 0) is not None) is found


def test_wind_blows_on_everything_alike_along_the_floor_and_abates():
    action = begun(ROW, "wind", 0)
    winds = {e.wind for e in action.entries}
    assert [e.name for e in action.entries] == ["a", "b", "c"] and len(winds) == 1
    (blown,) = winds
    assert blown.velocity[2] == 0 and blown.end == WIND_DURATION_S < action.duration


@pytest.mark.parametrize(("height", "way"), [(0.1, "slides"), (1.0, "falls over")])
def test_a_box_moves_in_the_wind_that_friction_or_its_foot_cannot_hold(height, way):
    side, rough = 0.2, UNKNOWN_FRICTION
    thing = box(side, side, height, name="thing")
    pose, heading = BodyPose((3.0, 0.0, height / 2)), np.array([1.0, 0.0])
    weight = thing.mass * GRAVITY
    pressure = {
        "slides": rough * weight / (FLAT_PLATE_DRAG_COEFFICIENT * side * height),
        "falls over": weight * (side / 2) / (FLAT_PLATE_DRAG_COEFFICIENT * side * height * height / 2),
    }
    assert pressure[way] == min(pressure.values())
    expected = sqrt(2 * pressure[way] / AIR_DENSITY_KG_M3)
    assert wind_threshold(thing, pose, heading) == pytest.approx(expected, rel=1e-9)


def test_a_ball_needs_a_wind_that_rolls_it_on_a_grid():
    """Its drag at its middle, 0.47 of its cross-section, against a foot of a tenth of its size."""
    thing, size = ball(0.25, name="ball"), 0.5
    speed = wind_threshold(thing, BodyPose((0, 0, 0.25)), np.array([1.0, 0.0]))
    drag = 0.5 * AIR_DENSITY_KG_M3 * speed**2 * 0.47 * np.pi * 0.25**2
    rolls = thing.mass * GRAVITY * ROUND_FOOT_SIZE_FRACTION * size / 0.25
    assert drag == pytest.approx(min(rolls, UNKNOWN_FRICTION * thing.mass * GRAVITY), rel=0.05)


def test_the_air_presses_as_in_the_simulation():
    rng = np.random.default_rng(0)
    area, heading, speed, dt = rng.normal(size=(50, 3)), np.array([0.6, 0.0, 0.8]), 7.0, 1e-3
    seen = np.tile(speed * heading, (50, 1))
    impulse = wind_pressure.wind_impulses(area, seen, np.full(50, 1e9), dt)
    expected = 0.5 * AIR_DENSITY_KG_M3 * speed**2 * drag_areas(area, heading) * dt
    assert np.allclose(impulse, expected, rtol=1e-6)


def test_wind_is_as_strong_as_the_easiest_object_needs_and_no_storm_is_too_strong():
    foam, stone = cube("foam", 0.2, 20.0), cube("stone", 0.2, 2500.0)
    action = begun(stood((stone, 0, 0), (foam, 1, 0)), "wind", 0)
    velocity = np.array(action.entries[0].wind.velocity)
    speed = np.linalg.norm(velocity)
    needed = wind_threshold(foam, BodyPose((1, 0, 0.1)), velocity[:2] / speed)
    assert WIND_SPEED_RATIO_RANGE[0] <= speed / needed <= WIND_SPEED_RATIO_RANGE[1] and speed < MAX_WIND_SPEED_M_S / 2
    assert begun(stood((stone, 0, 0)), "wind", 0) is None


def test_what_carries_something_is_not_expected_to_be_blown_away():
    tray, weight = replace(box(0.5, 0.5, 0.5, name="tray"), density=1.0), cube("weight", 0.2, 2e3)
    pile = ([tray, weight], [BodyPose((0, 0, 0.25)), BodyPose((0, 0, 0.6))])
    assert begun(pile, "wind", 0) is None
