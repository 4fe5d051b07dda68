import pytest

from corporeal.formats.typical_extents import doubt, typical_extent
from corporeal.formats.words import everyday, numbered, safe, unique


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("soda_can_coke", "soda can coke"),
        ("013_apple", "apple"),
        ("065-c_cups", "cups"),
        ("duck_khronos", "duck"),
        ("aws_ChairA_01_visual-lib", "chair"),
        ("WaterBottle", "water bottle"),
        ("teddy.obj", "teddy"),
        ("geometry_0", ""),
        ("Sketchfab_model", ""),
        ("42", ""),
        ("", ""),
    ],
)
def test_a_file_name_is_reduced_to_everyday_words(name, words):
    assert everyday(name) == words


def test_names_can_stand_in_a_path():
    assert safe("../../etc/passwd\n") == "_.._etc_passwd_"
    assert len(safe("x" * 500)) == 80


def test_names_are_counted_within_their_class():
    assert numbered(["duck", "soda can", "duck"]) == ["duck_0", "soda_can_0", "duck_1"]
    assert unique(["duck_0", "duck_0", "duck_0"]) == ["duck_0", "duck_1", "duck_2"]
    assert len(set(unique(["a", "a", "a_1", "a"]))) == 4


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        ("soda can crushed", "soda can"),
        ("cardboard boxes", None),
        ("cups", "cup"),
        ("tea set cup", "cup"),
        ("armchair", "armchair"),
        ("glass", "glass"),
        ("quantum flux", None),
    ],
)
def test_a_class_is_found_by_its_noun(name, entry):
    found = typical_extent(name)
    assert (found.words if found else None) == entry


def test_only_implausible_sizes_are_doubted():
    assert doubt("duck_0", "rubber duck", 0.1) is None
    assert doubt("duck_0", "rubber duck", 1.65) == (
        "duck_0 is 1.65 m large, but a rubber duck is usually about 10 cm. "
        "Set its size with --extent duck_0=0.1."
    )
    assert "an armchair" in (doubt("a", "armchair", 112.0) or "")
    assert doubt("thing", "widget", 1.0) is None
    assert doubt("a", "statue", 1.9) is None
    assert "usually about 40 cm" in (doubt("a", "statue", 2.0) or ""), "fitted into a box"
    assert doubt("a", "bed", 2.0) is None
    assert "metres?" in (doubt("thing", "widget", 250.0) or "")
