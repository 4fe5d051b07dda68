"""Every mistake that a person can make in a library of their own is found, placed and explained."""

import random

import pytest

from corporeal import materials
from corporeal.core.errors import BadFileError
from corporeal.materials.library_entry import data_file_text, source_table
from corporeal.materials.library_lint import lint_library

SOUND = """
[sources.my-bench]
cite = "Our tensile test of 2026-03-14, five specimens"

[lamp_steel]
law = "von_mises"
group = "metal"
young_GPa = { low = 195, typical = 205, high = 210, source = "my-bench" }
poisson = { low = 0.28, typical = 0.29, high = 0.3, source = "elastic-tables" }
density_kg_m3 = { low = 7800, typical = 7850, high = 7900, source = "my-bench+elastic-tables" }
yield_MPa = { low = 240, typical = 260, high = 300, source = "my-bench" }
shell_thickness_mm = { low = 0.5, typical = 0.8, high = 1, source = "my-bench" }
"""

PLANTED = {
    "swapped": (
        ("low = 195, typical = 205, high = 210", "low = 210, typical = 205, high = 195"),
        "line 8, [lamp_steel] young_GPa: is out of order: 210, 205, 195. Swap low and high.",
    ),
    "typical outside": (
        ("low = 240, typical = 260", "low = 240, typical = 360"),
        "yield_MPa: is out of order: 240, 360, 300. Put them in order.",
    ),
    "incompressible": (("high = 0.3,", "high = 0.5,"), "poisson: reaches 0.5: 0.5 is incompressible."),
    "no source": ((', source = "my-bench" }\npoisson', " }\npoisson"), "young_GPa: has no source."),
    "empty source": (
        ('source = "my-bench" }\npoisson', 'source = "" }\npoisson'),
        "young_GPa: has no source. Cite its source",
    ),
    "hearsay": (('"elastic-tables"', '"hearsay"'), "cites 'hearsay', which is not defined."),
    "GPa for MPa": (("yield_MPa", "yield_GPa"), "In MPa it would fit: check the unit."),
    "MPa for GPa": (("young_GPa", "young_MPa"), "In GPa it would fit: check the unit."),
    "grams for kilograms": (
        ("low = 7800, typical = 7850, high = 7900", "low = 7.8, typical = 7.85, high = 7.9"),
        "In g_cm3 it would fit: check the unit.",
    ),
    "metres for millimetres": (
        ("low = 0.5, typical = 0.8, high = 1,", "low = 5e-4, typical = 8e-4, high = 1e-3,"),
        "shell_thickness_mm: 5e-07 to 1e-06 m is outside of what any metal has",
    ),
    "one end in another unit": (("low = 195,", "low = 0.195,"), "is outside of what any metal has"),
    "weaker than it can be": (
        ("low = 240, typical = 260, high = 300", "low = 4, typical = 5, high = 6"),
        "yields at a strain of 2.4e-05",
    ),
    "unknown key": (("young_GPa", "yuong_GPa"), "Unknown key; the unit is in the key. Did you"),
    "unknown unit": (("young_GPa", "young_psi"), "young_psi: Unknown key; the unit is in the key."),
    "said twice": (
        ("poisson =", "young_MPa = { low = 1, typical = 1, high = 1, source = 'b' }\npoisson ="),
        "young_MPa: says young's modulus a second time. Keep young_GPa or young_MPa.",
    ),
    "no density": (("density_kg_m3", "note = 'x' #"), "has no density. Add density_kg_m3."),
    "no yield stress": (("yield_MPa", "note = 'x' #"), "no yield stress (von_mises reads it)."),
    "never read": (("von_mises", "hencky"), "hencky never reads yield stress."),
    "no law": (('law = "von_mises"', ""), "has no law. Add law = one of: corotated"),
    "strange law": (("von_mises", "hooke"), "law: 'hooke' is not a constitutive law."),
    "no group": (('group = "metal"', ""), "has no group, so its values cannot be compared"),
    "strange group": (('"metal"', '"metals"'), "group: 'metals' is not a group."),
    "not a range": (("{ low = 0.28, typical = 0.29, high = 0.3,", "0.3 #"), "is 0.3, not a range."),
    "a word for a number": (("low = 0.28", 'low = "0.28"'), "poisson: 'low' is missing or not a nu"),
    "not a number": (("low = 0.28", "low = nan"), "poisson: 'low' is missing or not a number."),
    "strange entry": (("low = 0.28", "min = 0.1, low = 0.28"), "an unknown entry 'min'."),
    "strange base": (("\n[sources", "extends = 'mine'\n[sources"), "extends: 'mine' is not a library"),
    "no citation": (('cite = "Our', 'site = "Our'), "has no citation."),
    "two of one name": (
        ("[lamp_steel]", "[other]\nlaw = 'hencky'\naliases = ['Lamp_Steel']\n[lamp_steel]"),
        "'lamp_steel' also names other.",
    ),
    "an empty note": (("low = 0.28", 'note = " ", low = 0.28'), "poisson: has the note ' '. Write"),
    "broken": (("[lamp_steel]", "[lamp_steel"), "This is not TOML:"),
    "empty": ((SOUND, ""), "There is no material in the file."),
}


def found(said):
    return [str(p) for p in lint_library(said, source_table(), ("default", "reference"))]


def test_nothing_is_found_in_a_sound_library():
    assert found(SOUND) == []


@pytest.mark.parametrize("mistake", PLANTED)
def test_a_planted_mistake_is_found_and_explained(mistake):
    (before, after), told = PLANTED[mistake]
    assert before in SOUND
    said = found(SOUND.replace(before, after, 1))
    assert any(told in one for one in said), said


def test_one_mistake_makes_one_complaint():
    for name in ("swapped", "incompressible", "MPa for GPa", "grams for kilograms", "hearsay"):
        (before, after), _ = PLANTED[name]
        assert len(found(SOUND.replace(before, after, 1))) == 1, name


def test_all_mistakes_are_reported_at_once_in_the_order_of_the_file():
    said = SOUND
    for name in ("no group", "swapped", "incompressible"):
        said = said.replace(*PLANTED[name][0], 1)
    lines = [p.line for p in lint_library(said, source_table(), ("default",))]
    assert len(lines) == 3
    assert lines == sorted(lines)


def test_a_known_name_is_held_to_what_we_know_of_it():
    said = SOUND.replace("[lamp_steel]", "[Mild_Steel]").replace("195", "60")
    assert "outside of what our steel has" in found(said)[0]


def test_what_is_true_but_unusual_can_be_marked_as_such():
    said = SOUND.replace("high = 210,", "high = 1050, unusual = true,")
    assert found(said) == []
    assert "any metal" in found(said.replace("unusual = true,", ""))[0]


SOFT = """
[sources.bench]
cite = "Our own bench"

[squashy]
law = "neo_hookean"
group = "foam"
young_kPa = { low = 20, typical = 50, high = 100, source = "bench" }
poisson = { low = 0, typical = 0.1, high = 0.2, source = "bench" }
density_kg_m3 = { low = 20, typical = 30, high = 40, source = "bench" }
restitution = { low = 0.1, typical = 0.3, high = 0.5, source = "bench" }
loss = { low = 0.1, typical = 0.2, high = 0.3, source = "bench" }
"""


def test_a_restitution_that_contradicts_the_loss_factor_is_reported_with_what_would_fit():
    assert found(SOFT) == [
        "line 11, [squashy] restitution: 0.1 to 0.5 contradicts the loss factor: with 0.1 to 0.3 a "
        "ball keeps 0.67 to 0.87 of its speed. Correct one of the two, or explain with note = '...' "
        "what else dissipates the energy."
    ]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("high = 0.5,", "high = 0.7,"),
        ("high = 0.3,", "high = 0.6,"),
        ('high = 0.5, source = "bench"', 'high = 0.5, source = "bench", note = "It creases."'),
        ('"foam"', '"mineral"'),
    ],
)
def test_ranges_that_meet_a_note_or_another_group_part_loss_and_restitution(before, after):
    """Of minerals nothing is lost in the bulk, so that one does not tell of the other."""
    assert before in SOFT
    assert not [said for said in found(SOFT.replace(before, after, 1)) if "contradicts" in said]


def test_a_wrong_range_is_reported_before_it_is_compared():
    swapped = SOFT.replace("typical = 0.3, high = 0.5", "typical = 0.5, high = 0.3")
    assert len(found(swapped)) == 1


def test_the_default_library_is_sound():
    assert found(data_file_text("library.toml")) == []


def test_what_is_wrong_in_the_published_vocabulary_is_found_and_nothing_else():
    said = lint_library(data_file_text("reference.toml"), source_table(), ())
    assert [(p.table, p.key) for p in said] == [
        ("soil_clay", "poisson"),
        ("plastics-HDPE", "poisson"),
        ("foam", "young_GPa"),
        ("rubber", "young_GPa"),
    ]


def test_no_file_makes_the_check_itself_fail():
    """Characters are lost, doubled and exchanged at random; whatever comes out is told or sound."""
    chance = random.Random(5)
    for _ in range(400):
        letters = list('extends = "default"\n' + SOUND)
        for _ in range(chance.randrange(1, 6)):
            at = chance.randrange(len(letters))
            letters[at] = chance.choice(["", letters[at] * 2, *'[]{}="\n,.-0e5x#'])
        assert all(isinstance(line, str) and line for line in found("".join(letters)))
    for value in ("[]", "{}", "5", "true", "[[1]]", "1979-05-27", "inf", '""'):
        for key in ("law", "group", "aliases", "id", "young_GPa", "extends", "sources"):
            said = SOUND.replace("[lamp_steel]", f"[lamp_steel]\nfamily = 'x'\n{key} = {value}")
            found(said)
            found(f"{key} = {value}\n{SOUND}")
            found(SOUND.replace("low = 195", f"low = {value}").replace('"my-bench" }', f"{value} }}"))


# ---------------------------------------------------------------- used


def test_a_library_with_a_mistake_is_refused(tmp_path):
    (tmp_path / "mine.toml").write_text(SOUND.replace("von_mises", "hooke"))
    with pytest.raises(BadFileError, match=r"mine.toml: line 6, .*'hooke' is not a constitutive law"):
        materials.library(str(tmp_path / "mine.toml"))
    with pytest.raises(BadFileError, match="cannot be read"):
        materials.library(str(tmp_path / "absent.toml"))


def test_a_library_replaces_ours_unless_it_extends_it(tmp_path):
    alone, merged = tmp_path / "alone.toml", tmp_path / "merged.toml"
    alone.write_text(SOUND)
    merged.write_text('extends = "default"\n' + SOUND.replace("[lamp_steel]", "[steel]"))
    assert list(materials.library(str(alone))) == ["lamp_steel"]
    both = materials.library(str(merged))
    assert list(both) == list(materials.library())
    assert both["steel"].ranges["young_pa"].low == pytest.approx(195e9)
    assert "friction" not in both["steel"].ranges, "a table replaces its namesake whole"
    assert both["glass"] is materials.library()["glass"]


def test_a_changed_file_is_read_again(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SOUND)
    before = materials.library(str(path))["lamp_steel"].ranges["density"].high
    path.write_text(SOUND.replace("high = 7900", "high = 7950.0"))
    after = materials.library(str(path))["lamp_steel"].ranges["density"].high
    assert (before, after) == (7900, 7950)


def test_a_source_of_ones_own_is_written_out(tmp_path):
    (tmp_path / "mine.toml").write_text(SOUND)
    ranges = materials.library(str(tmp_path / "mine.toml"))["lamp_steel"].ranges
    assert materials.citation(ranges["young_pa"].source).startswith("Our tensile test")
    both = materials.citation(ranges["density"].source)
    assert both.startswith("Our tensile test")
    assert both.endswith(materials.citation("elastic-tables"))
