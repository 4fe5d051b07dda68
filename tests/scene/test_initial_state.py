"""Objects begin raised and moving, as a person says."""

import pytest

import corporeal as co
from corporeal.core.errors import UserError
from corporeal.geometry.scene_transforms import object_boxes
from corporeal.scene.initial_state import parse_initial_velocity, parse_lift, with_initial_state


def two():
    one = co.ball("steel", radius=0.05, at=(0, 0, 0.05), name="one")
    other = co.ball("steel", radius=0.05, at=(0.5, 0, 0.05), name="other")
    return co.build_scene(one, other, duration=0.1, fps=30)


def test_only_what_is_named_is_raised_and_thrown():
    before, scene = two(), with_initial_state(two(), ("other=0.25",), ("other=1,0,-2.5",))
    rise = object_boxes(scene) - object_boxes(before)
    assert rise[0].max() == 0 and rise[1, :, 2] == pytest.approx(0.25, abs=1e-6)
    assert scene.objects[0].velocity == before.objects[0].velocity
    assert scene.objects[1].velocity == (1.0, 0.0, -2.5)


@pytest.mark.parametrize("text", ["", "0.5", "duck=", "duck=-1", "duck=nan", "duck=1e9", "duck=1,2"])
def test_a_lift_that_is_none_is_refused_with_an_example(text):
    with pytest.raises(UserError, match=r"duck=0\.5"):
        parse_lift(text)


@pytest.mark.parametrize("text", ["", "duck=1", "duck=1,2", "duck=a,b,c", "duck=inf,0,0", "d=90,90,0"])
def test_a_velocity_that_is_none_is_refused_with_an_example(text):
    with pytest.raises(UserError, match="duck=1,0,-2"):
        parse_initial_velocity(text)


def test_an_object_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(UserError, match="one, other"):
        with_initial_state(two(), (), ("duck=1,0,0",))
