"""Vessels whose names say how full they are, and of what: without a model they were empty."""

import pytest

from corporeal import materials
from corporeal.pipeline.stages.describe import describe
from corporeal.recognition.lexicon import contents_table
from sample_scenes import plain, scene


def told(name, *parts):
    """Return the words of an object's first part, and what is said of the object."""
    rows = [(p, plain("ab"[k]), {}) for k, p in enumerate(parts or ("mesh",))]
    made = describe(scene((name, rows)))
    return made.objects[0].parts[0], [w for w in made.warnings if "full" in w]


@pytest.mark.parametrize(
    ("name", "contents", "fill"),
    [
        ("half full bottle", "water", 0.5),
        ("bottle half full of water", "water", 0.5),
        ("plastic_bottle_half_full", "water", 0.5),
        ("half empty wine bottle", "water", 0.5),
        ("glass of milk", "milk", 0.8),
        ("full glass of milk", "milk", 0.95),
        ("jar of honey", "honey", 0.9),
        ("jar of honey half full", "honey", 0.5),
        ("bucket full of sand", "sand", 0.95),
        ("bucket of cold water", "water", 0.8),
        ("three quarters full milk bottle", "milk", 0.75),
        ("glass 30% full", "water", 0.3),
        ("mug 1/3 full of coffee", "water", 1 / 3),
        ("halbvolle flasche", None, None),
        ("flasche halb voll mit wasser", "water", 0.5),
        ("box of rice", "grain", 0.9),
        ("ketchup bottle half full", "ketchup", 0.5),
        ("ketchup bottle", "sauce", 0.9),
        ("empty bottle of milk", None, None),
        ("bottle", None, None),
        ("water bottle", None, None),
        ("full size bottle", None, None),
        ("bottle of aluminium", None, None),
        ("glass with milk label", None, None),
        ("glass of water melon", None, None),
    ],
)
def test_a_vessel_is_as_full_as_its_name_says(name, contents, fill):
    words, warned = told(name)
    assert (words.contents, words.fill) == (contents, pytest.approx(fill))
    assert warned == []
    if contents:
        assert words.structure == "filled"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("half full box", "contents are not named"),
        ("half full thingamajig", "no known vessel"),
        ("plasticine mug half full", "no wall thickness of plasticine is known"),
    ],
)
def test_what_a_name_says_of_contents_and_is_not_used_is_reported(name, why):
    words, warned = told(name)
    assert words.contents is None
    assert len(warned) == 1
    assert why in warned[0]
    assert "--annotations" in warned[0]


def test_it_is_unknown_which_of_several_parts_holds_it():
    words, (warned,) = told("bottle half full of water", "cap", "body")
    assert words.contents is None
    assert "the part that holds it" in warned


def test_contents_that_are_a_part_are_there():
    assert told("glass half full of honey", "glass", "honey")[1] == []


def test_contents_are_in_the_library():
    assert set(contents_table()["contents"]) <= set(materials.library())
