"""Goods as they are sold: a vessel of what such goods come in, full of them."""

import pytest

from corporeal import materials
from corporeal.pipeline.stages.describe import describe
from corporeal.recognition.packaged_goods import packaged_goods
from sample_scenes import plain, scene


def built(name):
    """Return what the only part of a thing of such a name is."""
    (part,) = describe(scene((name, [("mesh", plain(), {})]))).objects[0].parts
    return part


@pytest.mark.parametrize(
    ("name", "material", "contents"),
    [
        ("bottle_of_pesticide", "plastics-HDPE", "cleaner"),
        ("pesticide bottle", "plastics-HDPE", "cleaner"),
        ("bottle of olive oil", "glass", "olive_oil"),
        ("bottle_of_fruit_punch", "PET", "water"),
        ("cinnamon_shaker", "glass", "powder"),
        ("jar of coffee", "glass", "ground_coffee"),
        ("cream_carton", "cardboard", "dairy_cream"),
        ("tomato_sauce_jar", "glass", "sauce"),
        ("can of tuna", "steel", "packed_food"),
        ("empty pesticide bottle", "plastics-HDPE", None),
        ("jar", "glass", None),
    ],
)
def test_goods_are_in_what_they_are_sold_in(name, material, contents):
    found = built(name)
    assert (found.material, found.contents) == (material, contents)
    assert found.structure == ("filled" if contents else "shell")


def test_what_is_sold_can_be_made_and_held():
    rows = dict(packaged_goods())
    assert len(rows) > 200
    assert {row["contents"] for row in rows.values()} <= set(materials.content_materials())
    assert {row["material"] for row in rows.values()} <= set(materials.library())


@pytest.mark.parametrize(("name", "material"), [("flour", "powder"), ("rice_01", "grain")])
def test_what_lies_loose_is_known_where_nothing_else_is_named(name, material):
    assert built(name).material == material
    assert built(f"{name} sifter").material is None
