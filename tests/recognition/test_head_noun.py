"""A name says the same whatever order its words have, and whatever is wrapped around them."""

import pytest

from corporeal.recognition.head_noun import names_several_objects, strip_whole_from_part_name
from corporeal.recognition.lexicon import (
    head_terms,
    hollow_wall_thickness,
    multiword_names,
    name_tokens,
    names_hollow_object,
)
from corporeal.recognition.typical_extents import typical_extent


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("prop_barrel_oil_rusty_LOD0", "oil barrel rusty"),
        ("can_of_coke", "coke can"),
        ("set of dinner plates", "dinner plate"),
        ("Stuhl aus Metall", "metal chair"),
        ("vase in bronze", "bronze vase"),
        ("bottle with cork", "bottle"),
        ("plant in pot", "plant"),
        ("hand-painted-barrel-game-asset", "barrel"),
        ("seau_métal", "bucket metal"),
        ("bar of soap", "bar of soap"),
        ("made_in_china", "made in china"),
        ("office chair desk", "office chair desk"),
    ],
)
def test_the_object_stands_last(said, words):
    assert " ".join(name_tokens(said)) == words


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("jar lid metal", "lid metal"),
        ("lid jar metal", "lid metal"),
        ("lid trash can", "lid"),
        ("tire car", "tire"),
        ("door handle", "door handle"),
        ("glass jar", "glass jar"),
    ],
)
def test_a_part_is_not_the_object_that_it_is_of(said, words):
    assert " ".join(strip_whole_from_part_name(said.split(), multiword_names())) == words


@pytest.mark.parametrize("said", ["jar_lid", "lid_jar", "tire_car"])
def test_a_part_is_not_as_large_as_the_object(said):
    whole = {"jar", "car"}
    known = typical_extent(said)
    assert known is None or known.words not in whole


def test_a_pile_of_objects_is_not_as_large_as_one():
    assert names_several_objects("pile of bricks".split())
    assert typical_extent("pile of bricks") is None
    assert typical_extent("brick") is not None


@pytest.mark.parametrize(
    ("said", "is_hollow"),
    [
        ("Treasure_Chest_Bavarian", True),
        ("cooler tundra", True),
        ("barrel gun", False),
        ("box cutter", False),
        ("bucket hat", False),
    ],
)
def test_what_describes_an_object_behind_it_leaves_it_hollow(said, is_hollow):
    assert names_hollow_object(name_tokens(said)) is is_hollow


def test_goods_before_the_vessel_are_not_the_object():
    assert [t.material for t in head_terms(name_tokens("olive oil extra virgin bottle"))] == []


@pytest.mark.parametrize(
    ("said", "material", "wall"),
    [
        ("garden chair plastic white", "hard_plastic", 3.5e-3),
        ("office chair", "hard_plastic", None),
        ("chair metal", "steel", 1.4e-3),
        ("chair", "wood", None),
    ],
)
def test_furniture_is_moulded_of_plastic_and_of_tubes_where_it_is_of_metal(said, material, wall):
    assert hollow_wall_thickness(name_tokens(said), material) == (None if wall is None else pytest.approx(wall))


def test_what_only_describes_stays_in_front_of_what_an_object_is_of():
    """A full bottle of wine was a wine full bottle, and no wine bottle."""
    assert name_tokens("full bottle of red wine") == ("full", "red", "wine", "bottle")
    assert name_tokens("wooden bowl of cherries") == ("cherry", "wooden", "bowl")
