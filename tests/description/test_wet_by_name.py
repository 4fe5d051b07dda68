"""What is wet by its name weighs more and falls dead: a wet sponge weighed as a dry one."""

import pytest

from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import ground, grounding_warnings
from corporeal.pipeline.stages.segment import segment
from sample_scenes import plain, scene


def density(name):
    """Return what the name says of the density [kg/m3]; None: the library's is meant."""
    (part,) = describe(scene((name, [("mesh", plain(), {})]))).objects[0].parts
    found = part.stated.get("density")
    return found and found.value


def made(name):
    """Return what a thing of such a name is made of."""
    named = scene((name, [("mesh", plain(), {})]))
    inventory = describe(named)
    return ground(named, segment(named, inventory), inventory).materials[0]


def test_a_wet_sponge_holds_water_and_a_soaked_one_more():
    wet, soaked = density("wet sponge"), density("soaked_sponge")
    assert wet == pytest.approx(3 * 30)
    assert soaked == pytest.approx(5.7 * 30)
    assert density("damp towel") == pytest.approx(2 * 400)


def test_the_water_in_a_sponge_does_not_make_its_foam_doubtful():
    wet = scene(("wet sponge", [("mesh", plain(), {})]))
    inventory = describe(wet)
    parts = segment(wet, inventory)
    assert grounding_warnings(ground(wet, parts, inventory), parts, wet) == ()


@pytest.mark.parametrize("name", ["dry sponge", "sponge", "wet stone", "wet steel ball", "wet thingamajig"])
def test_what_is_dry_or_holds_no_water_weighs_what_it_did(name):
    assert density(name) is None


def test_a_wet_sponge_rebounds_less_than_a_dry_one_and_a_soaked_one_least():
    """Water that is pumped through pores takes what the cells would give back."""
    dry, wet, soaked = (made(name) for name in ("sponge", "wet sponge", "soaked sponge"))
    assert soaked.restitution < wet.restitution < 0.6 * dry.restitution
    assert soaked.loss > wet.loss > 2 * dry.loss
