"""What is far thicker than walls of its substance, and of unknown kind, is taken for hollow."""

import pytest
from names import weigh
from recognition.shapes import shape

DRUM = shape("drum .046 .325")
ROD = shape("drum .006 .3")


@pytest.mark.parametrize("name", ["brass samovar", "bouillotte en laiton", "titanium pot"])
def test_an_object_of_unknown_kind_is_no_block_of_metal(tmp_path, name):
    """They weighed ten to eighteen kilograms; the hot-water bottle of brass has .976 kg."""
    seen = weigh(DRUM, tmp_path / f"{name}.glb")
    assert seen.field.words[0].structure == "shell"
    assert 0.3 < sum(seen.masses) < 2


def test_it_is_reported_why(tmp_path):
    (words,) = weigh(DRUM, tmp_path / "brass samovar.glb").field.words
    assert "A block 40 mm thick would be more than 5 times as thick as any wall" in words.reason


@pytest.mark.parametrize(
    "name", ["brass", "brass cylinder", "brass bar", "solid brass samovar", "rubber samovar", "anvil"]
)
def test_what_may_well_be_solid_stays_so(tmp_path, name):
    (words,) = weigh(DRUM, tmp_path / f"{name}.glb").field.words
    assert words.material is not None
    assert words.structure is None


def test_what_is_as_thin_as_castings_are_stays_solid(tmp_path):
    (words,) = weigh(ROD, tmp_path / "brass samovar.glb").field.words
    assert (words.material, words.structure) == ("brass", None)
