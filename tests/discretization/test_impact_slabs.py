"""What a sheet does that lies on a floor and is struck."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import corporeal as co
from corporeal.core.types import Push
from corporeal.discretization.layered_sheets import layered_loss_factor
from corporeal.discretization.part_geometry import ObjectLanding, PartGeometry
from corporeal.materials.loss_restitution import restitution_of_loss


def prepared_scene(material, on, size, speed=3.0, at=None):
    thing = co.ball(material, 0.016, (0, 0, size[2] + 0.02), (0, 0, -speed), "thing")
    scene = co.build_scene(thing, co.box(on, size, at=at, name="sheet"))
    first, *others = scene.surfaces
    return replace(scene, surfaces=(replace(first, extras={"substance": material}), *others))


@cache
def prepared(material, on, size, speed=3.0, at=None):
    return co.prepare_scene(prepared_scene(material, on, size, speed, at))


@pytest.mark.slow
def test_a_rubber_mat_on_the_floor_that_steps_would_soften_is_rigid():
    ready = prepared("potato", "rubber", (0.12, 0.12, 0.01), 2.0)
    assert [t.kind for t in ready.particles.treatments] == ["rigid", "rigid"]
    assert "the floor holds it" in ready.particles.treatments[1].reason
    # In the air it stays soft.
    hung = prepared("potato", "rubber", (0.12, 0.12, 0.01), 2.0, at=(0, 0, 0.007))
    assert hung.particles.treatments[1].kind == "deformable"


def test_foam_that_is_as_soft_as_in_life_stays_soft():
    ready = prepared("steel", "seat_foam", (0.1, 0.1, 0.05))
    assert ready.particles.treatments[1].kind == "deformable"


@pytest.mark.slow
def test_a_large_mat_is_a_sheet_and_rigid_as_a_sheet_of_paper_is():
    mat = prepared("potato", "rubber", (0.6, 0.6, 0.01), 2.0)
    assert mat.particles.treatments[1].kind == "rigid"
    paper = prepared("potato", "paper", (0.28, 0.21, 1e-4), 2.0)
    assert [t.kind for t in paper.particles.treatments] == ["rigid", "rigid"]


@pytest.mark.slow
@pytest.mark.parametrize("size", [(0.12, 0.12, 0.01), (0.28, 0.21, 1e-4)])
def test_what_is_pushed_stays_as_soft_as_it_is(size):
    """It may be pulled out from under what falls."""
    ready = prepared("potato", "rubber", size, 2.0)
    assert ready.particles.treatments[1].kind == "rigid"
    scene = prepared_scene("potato", "rubber", size, 2.0)
    pushed = replace(scene.objects[1], push=Push((1.0, 0.0, 0.0), 0.0, 0.1))
    scene = replace(scene, objects=(scene.objects[0], pushed))
    assert co.prepare_scene(scene).particles.treatments[1].kind != "rigid"


@pytest.mark.slow
@pytest.mark.parametrize("material", ["steel", "wood", "seat_foam"])
def test_a_ball_comes_back_from_paper_as_from_the_floor_below(material):
    """A sheet of a tenth of a millimetre was a mattress: foam came back with .1 more."""

    def left(on):
        ready = co.prepare_scene(on)
        engine = co.build_engine(co.pose_problem(ready))
        engine.advance(0.03)
        now = engine.measure()
        return now.momentum[0] / now.mass[0]

    scene = prepared_scene(material, "paper", (0.28, 0.21, 1e-4))
    bare = replace(scene, objects=scene.objects[:1], surfaces=scene.surfaces[:1])
    assert left(scene) == pytest.approx(left(bare), abs=0.04 * 3.0)


@pytest.mark.slow
def test_a_steel_ball_comes_back_from_felt_as_felt_returns_it():
    """Pressed through to the floor, a softened mat threw it higher than it fell."""
    mat = co.box("felt", (0.2, 0.2, 0.006), name="mat")
    ball = co.ball("steel", 0.015, (0, 0, 0.216), name="ball")
    played = co.simulate_scene(co.build_scene(mat, ball, duration=0.3))
    ratio = played.outcome.objects["ball"].rebound_ratio
    returned = co.material("felt").ranges["restitution"]
    assert ratio is not None
    assert returned.low**2 <= ratio <= returned.high**2


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.06, 0.3])
def test_how_wide_a_mat_is_does_not_matter(width):
    """A floor holds it, though it is many times heavier than what strikes it."""
    ready = prepared("potato", "rubber", (width, width, 0.01), 2.0)
    engine = co.build_engine(co.pose_problem(ready))
    pair = ready.field.restitution[0, 1]
    engine.advance(0.02)
    now = engine.measure()
    left = float(now.momentum[0, 2] / now.mass[0]) + 9.81 * (0.02 - float(np.nanmin(now.first_contact)))
    assert left / 2.0 == pytest.approx(pair, abs=0.05)


@pytest.mark.slow
def test_a_ball_on_cardboard_is_not_a_ball_on_a_box():
    sheet, cube = (
        co.pose_problem(prepared("rubber", "corrugated_cardboard", size))
        for size in ((0.2, 0.2, 0.008), (0.05, 0.05, 0.05))
    )
    assert sheet.restitution[0, 1] == pytest.approx(0.46, abs=0.03)
    assert cube.restitution[0, 1] == pytest.approx(0.794, abs=0.01)
    # Slower impacts lose less, and what never strikes its face is as before.
    slope, power, most = sheet.restitution_law[0, 1][[1, 2, 4]]
    assert power > 0.15 and slope == 0.0 and most > 0.8
    assert sheet.restitution[1, -1] == pytest.approx(cube.restitution[1, -1])
    assert np.allclose(sheet.restitution, sheet.restitution.T)


def test_a_soft_ball_on_cardboard_loses_as_much_as_a_rigid_one():
    ready = prepared("rubber", "corrugated_cardboard", (0.2, 0.2, 0.008))
    rubber, board = ready.field.materials
    solid = ready.field.structures[0]
    ball = PartGeometry(0, rubber, solid, (0.032,) * 3, 1.7e-5, 3.2e-3)
    below = PartGeometry(1, board, solid, (0.008, 0.2, 0.2), 3.2e-4, 0.09)
    loss = layered_loss_factor(ball, ObjectLanding(1, 3.0, 0.0189), below)
    assert restitution_of_loss(loss) == pytest.approx(0.465, abs=0.02)
    assert layered_loss_factor(ball, ObjectLanding(1, 3.0, 0.0189), replace(below, material=rubber)) is None
