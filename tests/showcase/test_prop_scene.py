"""The showcase's models are a pool of their own."""

import pytest

from corporeal.core.errors import UnknownChoiceError
from corporeal.showcase.showcase_scenes import prop_scene


def test_a_prop_stands_alone_on_the_floor_and_says_what_it_is_made_of():
    scene = prop_scene("steel_ball")
    (thing,) = scene.objects
    lowest = min(s.vertices[:, 2].min() for s in scene.surfaces)
    assert thing.class_name == "steel ball" and lowest == pytest.approx(0, abs=1e-5)
    assert {s.extras["substance"] for s in scene.surfaces} == {"steel"}


def test_an_unknown_prop_is_refused_with_the_menu():
    with pytest.raises(UnknownChoiceError, match="rubber_duck"):
        prop_scene("elephant")
