"""How thick the wall of open ware is taken to be, by its material and size, and why."""

import tomllib
from importlib.resources import files

import pytest
from names import weigh
from published import MORE_WARE
from recognition.shapes import shape

from corporeal.description.describe_config import DescribeConfig
from corporeal.discretization.open_vessel_walls import NamedObject, usual_vessel_wall
from corporeal.pipeline.stages.describe import describe
from corporeal.recognition.lexicon import name_tokens
from sample_scenes import plain, scene

ROWS = tomllib.loads(MORE_WARE.read_text(encoding="utf-8"))["things"]
LEXICON = files("corporeal.recognition").joinpath("lexicon.toml").read_text(encoding="utf-8")
PAN = "turned 0 0 .1 0 .1 .1 0 .1"
BASKET = "turned 0 0 .13 0 .15 .2 0 .2"


def wall(name, material, extent):
    found = usual_vessel_wall(material, NamedObject([name_tokens(name)], extent))
    assert found is not None
    return found


@pytest.mark.parametrize("name", ["copper saucepan", "copper frying pan", "copper pot"])
def test_a_copper_pan_is_of_copper(tmp_path, name):
    """It was of aluminium, which such pans usually are of, and a pot of terracotta."""
    seen = weigh(shape(PAN), tmp_path / f"{name}.glb", from_pictures=True)
    assert seen.field.words[0].material == "copper"


def test_a_wicker_basket_from_pictures_is_no_block(tmp_path):
    """It was full of leaves: walls of leaves were measured by nobody."""
    path = tmp_path / "wicker basket.glb"
    seen = weigh(shape(BASKET), path, from_pictures=True)
    words = seen.field.words[0]
    assert (words.material, words.structure, words.thickness) == ("bamboo", "sheet", 2.5e-3)
    assert 0.2 < sum(seen.masses) < 0.8


def test_a_named_wall_outlives_that_its_material_has_none(tmp_path):
    """A straw basket is of leaves, whose walls no table has; its own is 2.5 mm."""
    seen = weigh(shape(BASKET), tmp_path / "straw basket.glb", from_pictures=True)
    assert seen.field.words[0].structure == "sheet"
    assert sum(seen.masses) < 0.2


def test_walls_of_wooden_bowls_grow_with_them():
    small, large = wall("wooden bowl", "wood", 0.152), wall("wooden bowl", "wood", 0.406)
    assert (small.thickness, large.thickness) == pytest.approx((4.8e-3, 9.5e-3))
    between = wall("wooden bowl", "wood", (0.203 * 0.406) ** 0.5).thickness
    assert between == pytest.approx((6.4e-3 * 9.5e-3) ** 0.5)
    beyond = [wall("wooden bowl", "wood", extent).thickness for extent in (0.01, 2.0)]
    assert beyond == pytest.approx([4.8e-3, 9.5e-3])
    cups = [wall("porcelain cup", "porcelain", extent).thickness for extent in (0.05, 0.2)]
    assert cups[0] == cups[1]


def test_a_bowl_that_a_person_says_is_of_wood_has_the_wall_of_its_size(tmp_path):
    (tmp_path / "said.yaml").write_text("bowl_0: wood\n")
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    bowl = scene(("bowl_0", [("mesh", plain(), {})]))
    (thing,) = describe(bowl, config, from_pictures=[0]).objects
    expected = wall("bowl", "wood", bowl.objects[0].real_extent)
    assert thing.parts[0].thickness == expected.thickness


def test_it_is_reported_how_thick_a_wall_is_taken_to_be_and_why(tmp_path):
    mug = scene(("stoneware mug", [("mesh", plain(), {})]))
    (warning,) = describe(mug, from_pictures=[0]).warnings
    assert "4.6 mm (the median of two weighed ones)" in warning
    cup = scene(("titanium cup", [("mesh", plain(), {})]))
    (warning,) = describe(cup, from_pictures=[0]).warnings
    assert "as thick as such walls usually are" in warning
    seen = weigh(shape(PAN), tmp_path / "copper saucepan.glb", from_pictures=True)
    reason = seen.field.structures[0].reason
    assert "2.5 mm, is usual of such objects: the gauges of such pans." in reason


def test_every_wall_of_ware_says_where_it_is_from():
    rows = tomllib.loads(LEXICON)["ware"]
    assert all(row["why"] for row in rows)
    assert all(("thickness_mm" in row) != ("walls_mm" in row) for row in rows)
    for sizes in (row["walls_mm"] for row in rows if "walls_mm" in row):
        assert sizes == sorted(sizes)


def test_more_ware_has_sources_and_most_of_it_is_held():
    assert sum(row["half"] == "held" for row in ROWS) >= 20
    assert all(row["source"] and row["kg"] > 0 for row in ROWS)
    assert [row["name"] for row in ROWS if not shape(row["shape"]).is_watertight] == []
