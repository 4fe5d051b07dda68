"""Contents that flow and do not fill their vessel become an object; all others stay."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import Law, Push, Structure
from corporeal.discretization.mobile_contents import contents_move
from corporeal.pipeline import in_memory
from corporeal.pipeline.stages.fill import fill
from corporeal.scene.vessel_contents import add_vessel_contents
from corporeal.showcase import showcase_scenes


@pytest.fixture(scope="module")
def glass():
    """A glass, three fifths full of water."""
    return in_memory.prepare_scene(showcase_scenes.prop_scene("tumbler"))


@pytest.mark.slow
def test_the_water_in_a_glass_is_an_object_of_its_own(glass):
    assert [o.name for o in glass.scene.objects] == ["tumbler_0", "tumbler_0_water"]
    assert [p.name for p in glass.parts.catalogue] == ["glass", "water"]
    assert [t.kind for t in glass.particles.treatments] == ["rigid", "deformable"]
    assert glass.field.materials[1].law is Law.FLUID
    assert glass.field.structures[0].contents is None
    assert glass.field.structures[0].holds == "water"
    assert glass.field.friction.shape == (3, 3)
    assert np.array_equal(glass.field.friction, glass.field.friction.T)


def test_its_mass_and_level_are_those_of_its_share(glass):
    water = glass.particles.mass_real[1]
    room = np.pi * 0.0315**2 * 0.092
    assert water == pytest.approx(998 * 0.6 * room, rel=0.05)
    assert glass.particles.mass[glass.particles.object == 1].sum() == pytest.approx(water)
    top = glass.particles.position[glass.particles.object == 1, 2].max()
    level = glass.scene.surfaces[-1].vertices[:, 2].max()
    assert level - 0.008 == pytest.approx(0.6 * 0.092, rel=0.04)
    assert top == pytest.approx(level - glass.particles.cell / 4, abs=glass.particles.cell / 4)


def test_liquids_find_points_on_both_faces_of_the_wall(glass):
    particles = glass.particles
    assert set(particles.object_of_wetted) == {0}
    r = np.hypot(*particles.wetted_point[:, :2].T)
    outward = np.sum(particles.wetted_point[:, :2] * particles.wetted_normal[:, :2], axis=1)
    height = particles.wetted_point[:, 2]
    side = (np.abs(particles.wetted_normal[:, 2]) < 0.3) & (height > 0.02) & (height < 0.09)
    assert (outward[side & (r > 0.0335)] > 0).all()
    assert (outward[side & (r < 0.0325)] < 0).all()


def test_a_vessel_that_is_filled_again_stays_as_it_is(glass):
    again = fill(glass.scene, glass.parts, glass.field)
    assert again.contents == ()
    assert again.treatments[0].kind == "rigid"
    assert again.count == glass.particles.count


def test_a_push_acts_on_all_that_it_was_to_move():
    scene = showcase_scenes.prop_scene("tumbler")
    pushed = replace(scene.objects[0], push=Push((2.0, 0.0, 0.0)), mass=0.5)
    whole = in_memory.prepare_scene(replace(scene, objects=(pushed,)))
    wall, water = whole.particles.mass_real
    assert wall + water == pytest.approx(0.5, rel=0.01)
    (x, _, _) = whole.scene.objects[0].push.acceleration
    assert x * wall == pytest.approx(2.0 * (wall + water), rel=0.02)
    assert whole.scene.objects[1].push is None


def test_a_pushed_vessel_and_what_is_in_it_are_expected_to_move_as_prescribed():
    scene = showcase_scenes.prop_scene("tumbler")
    pushed = replace(scene.objects[0], push=Push((2.0, 0.0, 0.0), 0.0, 0.5), mass=0.5)
    whole = in_memory.prepare_scene(replace(scene, objects=(pushed,)))
    for treatment in whole.particles.treatments:
        assert treatment.impact_speed == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("change", "does"), [({}, True), ({"fill": 0.95}, False), ({"loose": False}, False), ({"inflated": True}, False)]
)
def test_what_is_full_or_keeps_its_shape_stays_in_its_vessel(glass, change, does):
    water = glass.field.materials[1]
    usual = {"contents": water, "fill": 0.6, "loose": True}
    assert contents_move(Structure("filled", 0.003, **{**usual, **change})) is does
    sponge = replace(water, law=Law.NEO_HOOKEAN)
    assert not contents_move(Structure("filled", 0.003, **{**usual, "contents": sponge}))


def test_without_contents_nothing_changes(glass):
    same = add_vessel_contents(glass.scene, glass.parts, glass.field, ())
    assert same.scene is glass.scene and same.field is glass.field
