import pytest

from corporeal import materials
from corporeal.types import Finish, SceneObject
from corporeal.vlm.metadata import Evidence, lexicon, metals, recognise
from handmade import plain


class Named:
    def __init__(self, name):
        self.name, self.extras = name, {}


def seen(surface, thing, finish=None, alone=True, metallic=False):
    return recognise(
        Evidence(
            surfaces=[Named(surface)],  # type: ignore[list-item]
            finishes=[finish or plain()],
            thing=SceneObject(f"{thing}_0", thing, 1.0),
            alone=alone,
            metallic_means_something=metallic,
        )
    )


def test_every_material_of_the_lexicon_is_in_the_library():
    assert {s.material for s in lexicon()} <= set(materials.library())
    assert metals() <= set(materials.library())
    assert all(0 < s.margin <= 1 for s in lexicon())


def test_no_phrase_means_two_things():
    told = {}
    for s in lexicon():
        key = (s.phrase, s.kind, s.alpha)
        assert told.setdefault(key, s.material) == s.material, key


@pytest.mark.parametrize(
    ("surface", "thing", "material"),
    [
        ("mesh", "soda can", "aluminium_can_sheet"),
        ("mesh", "tomato soup can", "steel"),
        ("mesh", "trash can", "plastics-PP"),
        ("mesh", "can", None),
        ("mesh", "vase", "ceramic"),
        ("mesh", "rubber duck", "soft_PVC"),
        ("oak_table_top", "table", "hardwood"),
        ("Stainless steel pot", "pot", "stainless_steel"),
        ("mesh", "bottle", None),
        ("mesh", "wine bottle", "glass"),
        ("default", "thing", None),
    ],
)
def test_longer_phrases_say_more_and_ambiguous_words_say_nothing(surface, thing, material):
    assert seen(surface, thing).material == material


def test_two_materials_in_one_name_make_neither():
    answer = seen("RubberWood_low", "helmet", alone=False)
    assert answer.material is None
    assert "rubber and wood" in answer.reason


def test_a_particular_metal_stands_before_metal():
    assert seen("Metal.Bronze", "guitar", Finish("x", metallic=1.0)).material == "bronze"


def test_a_colour_is_not_a_metal():
    assert seen("Gold", "ribbon", Finish("gold", metallic=0.0)).material is None
    assert seen("Gold", "ring", Finish("gold", metallic=1.0)).material == "gold"


def test_the_exporters_default_metalness_says_nothing():
    shiny = Finish("white", metallic=1.0)
    assert seen("mesh", "thing", shiny, metallic=False).material is None
    assert seen("mesh", "thing", shiny, metallic=True).material == "steel"


def test_a_surface_that_contradicts_the_name_lowers_the_margin():
    calm = seen("wood", "thing", Finish("wood"), metallic=True)
    torn = seen("wood", "thing", Finish("wood", metallic=1.0), metallic=True)
    assert torn.margin < calm.margin
    assert "metallic" in torn.reason


def test_light_through_a_nameless_surface_is_glass():
    assert seen("mesh", "thing", Finish("x", transmission=1.0)).material == "glass"


def test_of_a_plants_parts_only_the_green_ones_are_leaves():
    green, brown = Finish("m", (0.2, 0.5, 0.1, 1.0)), Finish("m", (0.4, 0.1, 0.03, 1.0))
    assert seen("mesh", "potted plant", green, alone=False).material == "leaves-flowers"
    assert seen("mesh", "potted plant", brown, alone=False).material is None


def test_a_thing_of_several_parts_does_not_say_what_each_is():
    assert seen("mesh", "chair", alone=True).material == "wood"
    assert seen("mesh", "chair", alone=False).material is None
    assert seen("mesh", "soda can", alone=False).material == "aluminium_can_sheet"
