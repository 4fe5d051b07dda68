import re
from dataclasses import replace

import pytest

from corporeal import materials
from corporeal.core.audit_data import FindingEffect
from corporeal.core.types import (
    NO_USAGE,
    Discretization,
    Hypothesis,
    Law,
    Material,
    ModelUsage,
    Note,
    NoteKind,
    ObjectDescription,
    PartDescription,
    RangePlacement,
    Structure,
    Video,
)
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.report import (
    ReportContent,
    alternative_words,
    report,
    si_text,
    stiffness_words,
    structure_words,
    usage_words,
)
from corporeal.pipeline.stages.segment import segment
from sample_findings import audit_finding, run_audit
from sample_scenes import plain, scene


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (2e11, "Pa", "200 GPa"),
        (7e6, "Pa", "7 MPa"),
        (0.002, "m", "2 mm"),
        (1e-4, "m", "100 µm"),
        (0.0, "Pa", "0 Pa"),
        (7850.0, "kg/m³", "7850 kg/m³"),
        (0.5235987756, "rad", "30°"),
        (0.3, "", "0.3"),
    ],
)
def test_a_number_is_written_as_a_person_would(value, unit, said):
    assert si_text(value, unit) == said


def treated(kind, young_pa):
    numbers = {"poisson": 0.3, "density": 1.0, "yield_stress": None, "thickness": None}
    numbers |= {"strain": 0.0, "impact_speed": 0.0, "wave_speed": 1.0, "step": 1.0, "reason": ""}
    return Discretization(kind=kind, young_pa=1e9, simulated_young_pa=young_pa, **numbers)


def test_the_real_stiffness_stands_beside_the_simulated_one():
    assert stiffness_words(treated("rigid", 1e9)) == "rigid"
    assert stiffness_words(treated("deformable", 1e9)) == "1 GPa (as measured)"
    assert stiffness_words(treated("shell", 1e6)) == "1 MPa (0.001 × measured)"


def test_a_liquid_has_no_modulus_to_compare():
    """Water of 300 Pa was simulated with "67.9 kPa (as measured)"."""
    said = stiffness_words(replace(treated("deformable", 6e4), wave_speed=47.3), liquid=True)
    assert said == "liquid, its sound slowed to 47 m/s"


def test_what_is_inside_is_reported_with_how_it_is_built():
    soup = Material("soup", Law.NEO_HOOKEAN, 300.0, 0.49, 1050.0)
    assert structure_words(Structure("filled", 2e-4, contents=soup, fill=0.9)) == "filled with soup"
    assert structure_words(Structure("shell", 2e-4)) == "shell"


def test_what_a_part_may_be_instead_and_what_was_distinguished_in_it_is_reported():
    head = PartDescription("head", "steel", volume_share=0.25)
    words = PartDescription("hammer", "hardwood", hypotheses=(Hypothesis("ABS", "solid", 0.3),), pieces=(head,))
    assert alternative_words(words) == (" Alternatives: ABS (30%). Components: head: steel (25% of the volume).")
    assert alternative_words(PartDescription("hammer", "hardwood")) == ""


TOOK = ModelUsage(("openai:x",), 9, 11, 20500, 1200, 43.2, 0.0693, "2026-11-21")


def test_what_the_questions_took_is_reported_and_an_unknown_price_is_reported_to_be_unknown():
    assert usage_words(TOOK) == (
        "<br>9 questions to openai:x: 11 calls, 20,500 tokens in, 1,200 out, 43 s waited, "
        "about $0.069 at the list prices of 2026-11-21."
    )
    assert "price not known" in usage_words(replace(TOOK, dollars=None))
    by_hand = replace(TOOK, calls=0, models=("by hand, from the sheets",))
    assert usage_words(by_hand) == (
        "<br>9 questions, answered from the disk by recorded answers (by hand, from the sheets), at no cost."
    )
    assert usage_words(NO_USAGE) == ""


# ---------------------------------------------------------------- the whole page


@pytest.fixture
def page(tmp_path):
    """Write the page of one object of one part of which somebody said something."""

    def written(words, **audit):
        made = scene(("thing_0", [("mesh", plain(), {})]))
        told = describe(made)
        words = replace(words, name=told.objects[0].parts[0].name)
        told = replace(told, objects=(ObjectDescription("thing_0", "thing", (words,)),))
        parts = segment(made, told)
        field = ground(made, parts, told)
        video = Video(tmp_path / "video.mp4", 24, 64, 64)
        video.path.write_bytes(b"")
        particles = fill(made, parts, field)
        report(
            ReportContent(made, parts, field, particles, video, run_audit(**audit), {}, materials.cited_sources()),
            tmp_path / "report.html",
        )
        return (tmp_path / "report.html").read_text(encoding="utf-8")

    return written


def test_every_piece_of_a_mesh_has_its_values_with_range_source_and_reason(page):
    low = {"density": RangePlacement(0.25, "model", "A dense grade.")}
    head = PartDescription("head", "steel", "solid", reason="It shines.", volume_share=0.25)
    grip = PartDescription("grip", "ABS", "shell", volume_share=0.75, placements=low)
    told = page(PartDescription("", "ABS", "shell", answered_by="model", pieces=(head, grip)))
    assert "<b>head</b>: steel, 25% of the volume" in told
    assert "It shines." in told and "A dense grade." in told
    assert told.count("<td>density ρ</td>") == 2
    sources = {r.source for m in ("steel", "ABS") for r in materials.find_material(m).ranges.values()}
    assert sources <= set(re.findall("<dt>([^<]*)</dt>", told))


def test_who_looked_at_the_pictures_is_named(page):
    words = PartDescription("", "ABS", "solid", answered_by="recording")
    took = replace(TOOK, models=("by hand, from the sheets",), calls=0)
    told = page(words, questions=took)
    assert "in pictures by recorded answers (by hand, from the sheets)." in told
    assert "vision-language" not in told
    seen = replace(words, answered_by="model")
    assert "in pictures by openai:x." in page(seen, questions=TOOK)


def test_a_wall_thickness_stands_only_where_a_wall_has_it(page):
    assert "wall thickness" not in page(PartDescription("", "steel", "solid"))
    assert "<td>wall thickness</td><td>700 µm</td>" in page(PartDescription("", "steel", "shell"))
    assert "<td>wall thickness" not in page(PartDescription("", "steel", "shell", 0.002))


def test_margin_is_explained_and_an_estimate_is_no_measurement(page):
    told = page(PartDescription("", "steel", "shell"))
    assert "Margin: confidence in the material, from 0 (a guess) to 1 (stated)." in told
    (wall,) = re.findall("<tr><td>wall thickness.*?</tr>", told)
    assert "the usual value in the estimated range" in wall
    (density,) = re.findall("<tr><td>density.*?</tr>", told)
    assert "the usual value in the measured range" in density


def test_a_long_reason_that_all_values_share_is_reported_once(page):
    told = page(PartDescription("", None))
    reason = "The material of this part is unknown"
    assert told.count(f"Reason where none is stated: {reason}") == 1
    assert told.count(reason) == 1
    usual = page(PartDescription("", "steel", answered_by="metadata"))
    assert "Reason where none" not in usual and usual.count("the usual value in the") > 3


def test_the_page_begins_with_what_may_be_wrong_as_a_list(page):
    """It began with a wall of text, and doubts stood below the video."""
    warnings = (
        Note("2 of 10 photographs were left out: a.jpg.", NoteKind.LEFT_OUT),
        Note("thing_0: nobody looked into it. With --vlm somebody does.", NoteKind.ASSUMED),
        Note("The scale may be wrong. Measure it.", NoteKind.GRAVE),
    )
    told = page(PartDescription("", "steel", "solid"), warnings=warnings, hints=("Nothing moves.",))
    above = told[: told.index("<video")]
    heads = re.findall("<h3>(.*?)</h3>", above)
    assert heads == [
        "What may be wrong", "What was assumed, and what changes it", "What was left out"
    ]  # fmt: skip
    items = re.findall("<li>(.*?)</li>", above)
    assert items[0] == "The scale may be wrong. <span>Measure it.</span>"
    assert '<a href="#part-0">' in items[1] and items[2] == "Nothing moves."
    assert 'href="#said"' in told and 'id="said"' in above


def test_a_page_of_which_nothing_is_to_be_reported_has_no_lists(page):
    told = page(PartDescription("", "steel", "solid"))
    assert "<h3>What" not in told and "The audit found no violations." in told


# ---------------------------------------------------------------- whether to trust it


SOUND = "The audit found no violations."


def test_a_grave_finding_stands_under_validity_with_part_ratios_and_effect(page):
    words = PartDescription("", "ABS", "solid", answered_by="recording")
    said = page(words)
    assert SOUND in said and 'id="findings"' not in said
    found = audit_finding()
    said = page(words, findings=(found,), warnings=(Note(found.sentence, NoteKind.GRAVE),))
    validity = said[said.index("<h2>Validity</h2>") : said.index("<h2>Materials</h2>")]
    assert SOUND not in said
    assert "it deforms by 60 mm." in validity
    for cell in ("grave", "shelf_0", "boards", "5e-05", "0.0014", "<b>largest deformation</b>", "60 mm", "5 mm"):
        assert f">{cell}</td>" in validity


def test_other_values_without_a_visible_effect_are_listed_and_no_violation(page):
    words = PartDescription("", "ABS", "solid", answered_by="recording")
    energy = FindingEffect("unaccounted_energy", 0.125, 0.0, False)
    said = page(words, findings=(audit_finding(severity="minor", effects=(energy,)),))
    assert SOUND in said
    assert ">energy unaccounted for</td>" in said and ">12.5 %</td>" in said
