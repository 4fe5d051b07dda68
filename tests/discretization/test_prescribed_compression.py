"""What prescribed motion presses is soft where it can be, and what can go away is not pressed."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.core.types import Keyframes, Wall
from corporeal.discretization.prescribed_compression import (
    PlacedObject,
    SampledObject,
    measure_clearance,
    overlap_along,
)
from corporeal.geometry.mesh import Mesh

SIDE = 0.06
CUBE = (SIDE, SIDE, SIDE)
UP = np.array([0.0, 0.0, 1.0])


def told(thing, *rows):
    """Give a thing a path of rows of t, x, y, z."""
    shift = tuple((float(x), float(y), float(z)) for _, x, y, z in rows)
    path = Keyframes(tuple(float(r[0]) for r in rows), shift, ((0.0, 0.0, 0.0),) * len(rows))
    return replace(thing, path=path)


def cube(material, at=(0.0, 0.0, SIDE / 2)):
    return co.box(material, CUBE, at=at, name="thing")


def plate(height, *rows):
    """Give a plate whose underside is so high [m]."""
    made = co.box("steel", (0.1, 0.1, 0.02), at=(0, 0, height + 0.01), name="plate")
    return told(made, (0, 0, 0, 0), *rows)


def finger(side, come):
    """Give a finger that stands 1 mm beside a cube and comes by so much [m]."""
    made = co.box("steel", (0.02, 0.07, 0.07), at=(side * 0.041, 0, 0.045), name=f"at {side}")
    return told(made, (0, 0, 0, 0), (0.1, -side * come, 0, 0))


def fingers(come):
    return finger(-1, come), finger(1, come)


def lifters():
    """Give two fingers that come down beside a cube, take hold of it, and lift it."""
    found = []
    for side in (-1, 1):
        made = co.box("steel", (0.02, 0.07, 0.07), at=(side * 0.041, 0, 0.245), name=f"at {side}")
        into = -side * 0.004
        rows = (0, 0, 0, 0), (0.3, 0, 0, -0.2), (0.4, into, 0, -0.2), (0.8, into, 0, 0)
        found.append(told(made, *rows))
    return found


def treated(*things, duration=1.0):
    return co.prepare_scene(replace(co.build_scene(*things), duration=duration)).particles


def ball(height=0.03):
    return co.ball("rubber", 0.03, (0, 0, height), name="thing")


DOWN = (0.2, 0, 0, -0.006)
PRESSED = {
    "ball on the floor": ((ball(), plate(0.06, DOWN)), 0.1),
    "ball on a block": ((ball(0.09), plate(0.12, DOWN), co.box("wood", CUBE, name="block")), 0.1),
    "cube, first after a way": ((cube("rubber"), plate(0.16, (0.2, 0, 0, -0.103))), 0.05),
    "cube in a hand": ((cube("seat_foam"), *fingers(0.004)), 0.1),
    "cube in a hand that comes down and lifts it": ((cube("seat_foam"), *lifters()), 0.1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESSED)
def test_what_cannot_go_away_is_strained_by_the_way_over_its_length(name):
    things, strain = PRESSED[name]
    first, *others = treated(*things).treatments
    assert (first.kind, {t.kind for t in others}) == ("deformable", {"rigid"})
    assert first.strain == pytest.approx(strain, rel=0.03)
    assert "prescribed motion presses it" in first.reason


BESIDE = co.box("steel", (0.02, SIDE, SIDE), at=(-0.05, 0, 0.03), name="pusher")
ABOVE = co.box("steel", (0.02, SIDE, SIDE), at=(-0.05, 0, 0.23), name="pusher")
OVER = co.box("steel", (0.02, SIDE, SIDE), at=(0, 0, 0.23), name="pusher")
FREE = {
    "pusher": (cube("rubber"), told(BESIDE, (0, 0, 0, 0), (0.5, 0.2, 0, 0))),
    "pusher that came down": (cube("rubber"), told(ABOVE, (0, 0, 0, 0), (0.5, 0, 0, -0.2), (1, 0.2, 0, -0.2))),
    "pusher that was above it, and came down beside it": (
        cube("rubber"),
        told(OVER, (0, 0, 0, 0), (0.3, -0.1, 0, 0), (0.6, -0.1, 0, -0.2), (1, 0.2, 0, -0.2)),
    ),
    "plate that ends above it": (cube("rubber"), plate(0.16, (0.2, 0, 0, -0.0999))),
    "hand that only touches": (cube("wood"), *fingers(0.00105)),
    "hand that goes both fingers the same way": (
        cube("rubber"),
        told(finger(-1, 0.0), (0, 0, 0, 0), (0.5, 0.1, 0, 0)),
        told(finger(1, 0.0), (0, 0, 0, 0), (0.5, 0.1, 0, 0)),
    ),
    "lift": (
        cube("rubber", (0, 0, 0.05)),
        told(co.box("steel", (0.1, 0.1, 0.02), name="lift"), (0, 0, 0, 0), (0.5, 0, 0, 0.1)),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FREE)
def test_what_can_go_away_or_is_only_touched_stays_rigid_and_nothing_is_reported(name):
    ready = treated(*FREE[name])
    assert {t.kind for t in ready.treatments} == {"rigid"}
    assert not [w for w in ready.warnings if "pressed" in w]
    assert max(t.strain for t in ready.treatments) < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("material", ["steel", "wood"])
def test_what_is_hard_stays_rigid_in_a_hand_and_one_sentence_says_that_no_force_is_right(material):
    ready = treated(cube(material), *fingers(0.004))
    free = treated(cube(material), *fingers(0.0))
    assert {t.kind for t in ready.treatments} == {"rigid"}
    assert ready.cell == free.cell
    (said,) = [w for w in ready.warnings if "pressed" in w]
    assert said.startswith("thing is pressed by about 0.1 of its thickness")


def test_beside_something_hard_something_soft_takes_it_all_with_its_true_stiffness():
    steel = co.box("steel", CUBE, at=(0, 0, 1.5 * SIDE), name="block")
    soft, _, hard = treated(cube("seat_foam"), plate(2 * SIDE, DOWN), steel).treatments
    assert (soft.kind, hard.kind) == ("deformable", "rigid")
    assert soft.strain == pytest.approx(0.1, rel=0.03)
    assert soft.simulated_young_pa == pytest.approx(soft.young_pa)


def test_two_alike_share_it():
    upper = co.box("seat_foam", CUBE, at=(0, 0, 1.5 * SIDE), name="upper")
    lower, _, above = treated(cube("seat_foam"), plate(2 * SIDE, DOWN), upper).treatments
    assert lower.strain == pytest.approx(0.05, rel=0.03)
    assert above.strain == pytest.approx(0.05, rel=0.03)


def test_a_wall_holds_what_is_pushed_against_it():
    """The pusher is 10 mm away and comes by 16."""
    thing = co.build_scene(cube("rubber"), told(BESIDE, (0, 0, 0, 0), (0.5, 0.016, 0, 0)))
    wall = Wall((-1.0, 0.0, 0.0), (SIDE / 2, 0.0, 0.0))
    held = co.prepare_scene(replace(thing, walls=(wall,))).particles.treatments[0]
    assert held.strain == pytest.approx(0.1, rel=0.03)
    assert co.prepare_scene(thing).particles.treatments[0].kind == "rigid"


@pytest.mark.slow
def test_a_cube_of_foam_in_a_hand_presses_back_with_its_modulus_times_area_and_strain():
    """E A ε = 60 kPa · (60 mm)² · .1 = 21.6 N; held by friction a few percent more."""
    pair = fingers(0.004)
    scene = replace(co.build_scene(cube("seat_foam"), *pair), duration=0.08, fps=100)
    held = tuple(replace(obj, path=replace(obj.path, time=(0.0, 0.05))) if obj.path else obj for obj in scene.objects)
    ledger = co.simulate_scene(replace(scene, objects=held)).trajectory.ledger
    impulse, time = np.array(ledger.external_impulse), np.array(ledger.time)
    force = (impulse[-1, 1:, 0] - impulse[-2, 1:, 0]) / (time[-1] - time[-2])
    np.testing.assert_allclose(force, [21.6, -21.6], rtol=0.15)


def test_clearance_is_the_least_way_and_what_goes_past_has_none():
    def thing(solid):
        surface = co.build_scene(solid).surfaces[0]
        mesh = Mesh(np.array(surface.vertices, float), np.array(surface.triangles))
        return PlacedObject.at_start(SampledObject.of(mesh, np.random.default_rng(0)))

    low, high = thing(cube("wood")), thing(ball(0.2))
    aside = thing(co.ball("rubber", 0.03, (0.2, 0, 0.2)))
    assert measure_clearance(low, high, UP).gap == pytest.approx(0.11, abs=1e-5)
    assert measure_clearance(high, low, UP).gap == np.inf
    assert measure_clearance(low, aside, UP).gap == np.inf
    assert overlap_along(high, low, UP) and overlap_along(low, high, UP)
    assert not overlap_along(aside, low, UP)
