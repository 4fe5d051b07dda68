import pytest

from corporeal.recognition.parts_by_name import name_words
from corporeal.recognition.readable_names import everyday_words, numbered_names, safe_name, unique_names
from corporeal.recognition.typical_extents import extent_warning, typical_extent


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
        ("мяч_01.glb", "мяч"),
        ("椅子.glb", "椅子"),
        ("木", "木"),
        ("Plu\u0308schKatze", "plüsch katze"),
        ("कुर्सी 2", "कुर्सी"),
        ("كرسي", "كرسي"),
        ("Ørsted Łódź", "ørsted łódź"),
    ],
)
def test_a_file_name_is_reduced_to_everyday_words(name, words):
    assert everyday_words(name) == words


def test_a_name_of_any_alphabet_is_kept_in_paths_and_numbered():
    assert safe_name("Plu\u0308sch/कुर्सी") == "Plüsch_कुर्सी"
    assert numbered_names(["мяч", "мяч", "椅子"]) == ["мяч_0", "мяч_1", "椅子_0"]


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("M_LeatherParts.001", ["leather", "parts"]),
        ("Plüschkatze", ["plüschkatze"]),
        ("ГрибШляпа_2", ["гриб", "шляпа"]),
        ("木", ["木"]),
        ("TVStand", ["tv", "stand"]),
        ("é", []),
    ],
)
def test_parts_are_named_in_any_alphabet(name, found):
    assert name_words(name) == found


def test_names_can_stand_in_a_path():
    assert safe_name("../../etc/passwd\n") == "_.._etc_passwd_"
    assert len(safe_name("x" * 500)) == 80


def test_names_are_counted_within_their_class():
    assert numbered_names(["duck", "soda can", "duck"]) == ["duck_0", "soda_can_0", "duck_1"]
    # The file's own numbers are kept where each has one: a scene file means them.
    blocks = [f"block_{number}" for number in (10, 11, 20)]
    assert numbered_names(["block"] * 3, blocks) == blocks
    assert numbered_names(["duck", "duck"], ["Duck", "Duck.001"]) == ["duck_0", "duck_1"]
    assert numbered_names(["duck", "duck"], ["duck 1", "mallard 1"]) == ["duck_0", "duck_1"]
    assert numbered_names(["apple"], ["013_apple_7"]) == ["apple_0"], "one alone is the first"
    assert unique_names(["duck_0", "duck_0", "duck_0"]) == ["duck_0", "duck_1", "duck_2"]
    assert len(set(unique_names(["a", "a", "a_1", "a"]))) == 4


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
    assert extent_warning("duck_0", "rubber duck", 0.1) is None
    assert extent_warning("duck_0", "rubber duck", 1.65) == (
        "duck_0 is 1.65 m large, but a rubber duck is usually about 10 cm. Set its size with --extent duck_0=0.1."
    )
    assert "an armchair" in (extent_warning("a", "armchair", 112.0) or "")
    assert extent_warning("thing", "widget", 1.0) is None
    assert extent_warning("a", "statue", 1.9) is None
    assert "usually about 40 cm" in (extent_warning("a", "statue", 2.0) or ""), "fitted into a box"
    assert extent_warning("a", "bed", 2.0) is None
    assert "metres?" in (extent_warning("thing", "widget", 250.0) or "")
