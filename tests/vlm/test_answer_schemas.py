import pytest

from corporeal.vlm.answer_checks import (
    extents_complaints,
    mass_complaints,
    materials_complaints,
    parts_complaints,
    placement_complaints,
    ranking_complaints,
    weakness_notes,
)
from corporeal.vlm.answer_schemas import (
    AllowedNames,
    ExtentsAnswer,
    FractionAnswer,
    MassAnswer,
    MaterialsAnswer,
    PartsAnswer,
    RankingAnswer,
    ValueAnswer,
)
from corporeal.vlm.human_client import schema_example
from corporeal.vlm.interpret_answers import evidence_from_answer, part_hypotheses
from scripted_model import decomposed, part

NAMES = AllowedNames(
    {"steel": "steel", "Steel": "steel", "sand": "sand"}.get, {"water": "water"}.get, lambda name: name == "steel"
)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([["a"]], None),
        ([["a"], ["a", "b"], ["a", "b", "c"]], None),
        ([["a", "b"], ["c", "d"]], None),
        ([], "at least one"),
        ([["a", "A"]], "Part names must differ"),
        ([list("abcdefg")], "1 to 6 parts"),
        ([[]], "1 to 6 parts"),
    ],
)
def test_decompositions_are_real_alternatives(options, complaint):
    found = parts_complaints(PartsAnswer.model_validate(decomposed(*options)))
    assert bool(found) == bool(complaint)
    assert complaint is None or complaint in found[0]


@pytest.mark.parametrize(("order", "fits"), [([2, 1], True), ([1], False), ([1, 1], False)])
def test_every_alternative_is_ranked_once(order, fits):
    answer = {"ranking": [{"number": n, "reason": ""} for n in order]}
    assert (ranking_complaints(RankingAnswer.model_validate(answer), 2) == []) == fits


def complaints(*parts, wanted=("a",), shared=False):
    answer = MaterialsAnswer.model_validate({"parts": list(parts)})
    return materials_complaints(answer, wanted, NAMES, shared)


@pytest.mark.parametrize(
    ("said", "complaint"),
    [
        (part("a", "steel"), None),
        (part("a", "Steel", "hollow"), None),
        (part("a", None, None), None),
        (part("a", "steel", "filled", contents="water", fill=0.5), None),
        (part("a", "steel", "packed", solidity=0.5), None),
        (part("b", "steel"), "exactly these names"),
        (part("a", "stone"), "'stone' is not in the list of materials"),
        (part("a", "water"), "'water' is not in the list of materials"),
        (part("a", "sand", "hollow"), "Nobody makes walls of sand"),
        (part("a", "sand", "sheet"), "Nobody makes walls of sand"),
        (part("a", "steel", "filled"), "needs contents"),
        (part("a", "steel", "filled", contents="water", fill=0.0), "a fill above 0"),
        (part("a", "steel", "filled", contents="beer", fill=1.0), "'beer' is not in the list"),
        (part("a", "steel", contents="water"), "Only what is built 'filled'"),
        (part("a", "steel", "packed"), "needs a solidity"),
        (part("a", "steel", "packed", solidity=0.01), "needs a solidity"),
        (part("a", "steel", probability=0.0), "must be above 0"),
        ({"part": "a", "ways": []}, "Give 1 to 6 ways"),
        (part("a", "steel", alternatives=[{"material": "stone", "probability": 0.1}]), "'stone' is not"),
    ],
)
def test_materials_are_from_the_lists_and_builds_make_sense(said, complaint):
    found = complaints(said)
    assert bool(found) == bool(complaint)
    assert complaint is None or complaint in found[0]


def test_parts_that_share_a_mesh_share_all_of_it():
    def two(a, b, **more):
        halves = ((n, {"volume_share": x, "surface_share": x}) for n, x in (("a", a), ("b", b)))
        rows = [part(n, "steel", **s) for n, s in halves]
        rows[1] |= more
        return complaints(*rows, wanted="ab", shared=True)

    assert two(0.3, 0.7) == []
    assert two(0.31, 0.66) == []
    assert "volume_share of the parts that lie at the surface must add up to 1" in two(0.5, 0.7)[0]
    assert "b: give volume_share, above 0" in two(0.5, None)[0]
    assert two(1.0, 0.9, inside="a") == []
    assert "must take up less volume" in two(1.0, 1.0, inside="a")[0]
    assert "no other part 'c'" in two(1.0, 0.5, inside="c")[0]
    assert two(1.0, 0.2, missing=True) == []


def test_places_are_asked_for_once_each_and_values_stay_inside():
    wanted, bounds = {"a": ("young", "density")}, {("a", "young"): (1.0, 3.0)}
    bounds |= {("a", "density"): (10.0, 30.0)}

    def values(*said):
        rows = [{"quantity": q, "value": v, "reason": ""} for q, v in said]
        answer = ValueAnswer.model_validate({"parts": [{"part": "a", "values": rows}]})
        return placement_complaints(answer, wanted, bounds)

    assert values(("young", 1.0), ("density", 30.0)) == []
    assert values(("young", 1.0 - 1e-7), ("density", 30.0)) == []
    assert "young is 3.1, outside the measured range 1 to 3" in values(("young", 3.1), ("density", 30))[0]
    assert "give exactly these quantities" in values(("young", 2.0))[0]
    assert "give exactly these quantities" in values(("young", 2.0), ("young", 2.0))[0]
    with pytest.raises(ValueError, match="less than or equal to 1"):
        FractionAnswer.model_validate(
            {"parts": [{"part": "a", "values": [{"quantity": "x", "fraction": 1.1, "reason": ""}]}]}
        )


def test_every_class_gets_a_size_that_is_one():
    sizes = ExtentsAnswer.model_validate({"classes": [{"class_name": "cup", "metres": 0.1}]})
    assert extents_complaints(sizes, ["cup"]) == []
    assert extents_complaints(sizes, ["cup", "duck"])
    for metres in (0.0, -1.0, float("nan"), 1e4):
        with pytest.raises(ValueError, match="metres"):
            ExtentsAnswer.model_validate({"classes": [{"class_name": "cup", "metres": metres}]})


def test_a_shape_is_written_as_a_person_reads_it():
    schema = RankingAnswer.model_json_schema()
    assert schema_example(schema, schema["$defs"]).split() == (
        '{ "ranking": [{ "number": integer, "reason": string }, ...] }'.split()
    )
    schema = MaterialsAnswer.model_json_schema()
    written = schema_example(schema, schema["$defs"])
    assert '"built": "solid" | "sheet" | "hollow" | "filled" | "packed" or null' in written
    assert '"probability": number 0–1' in written


# ---------------------------------------------------------------- weak models, planted faults


def ways(*probabilities):
    rows = [{"material": "steel", "built": "solid", "probability": p} for p in probabilities]
    return {"part": "a", "ways": [row | {"reason": ""} for row in rows]}


@pytest.mark.parametrize(("probabilities", "shares"), [((1, 1, 1), (1 / 3,) * 3), ((0.6, 0.4), (0.6, 0.4))])
def test_probabilities_that_add_up_to_3_are_divided_by_it_and_that_is_reported(probabilities, shares):
    answer = MaterialsAnswer.model_validate({"parts": [ways(*probabilities)]})
    assert materials_complaints(answer, ["a"], NAMES, False) == []
    found = [way.probability for way in part_hypotheses(answer.parts[0], NAMES)]
    assert found == pytest.approx(shares)
    said = [] if sum(probabilities) <= 1 else ["the probabilities of a add up to 3 and were"]
    assert [clause[: len(told)] for clause, told in zip(weakness_notes(answer), said, strict=True)] == said


def test_one_way_only_given_as_certain_is_reported():
    (said,) = weakness_notes(MaterialsAnswer.model_validate({"parts": [ways(1.0)]}))
    assert "one way only was given" in said
    assert weakness_notes(MaterialsAnswer.model_validate({"parts": [ways(0.8)]})) == []


def test_what_a_container_holds_is_no_part():
    names = AllowedNames(NAMES.material, {"water": "water", "sand": "sand"}.get, NAMES.walled)
    can = part("can", "steel", "filled", contents="sand", fill=0.9)
    answer = MaterialsAnswer.model_validate({"parts": [can, part("filling", "sand")]})
    (said,) = materials_complaints(answer, ["can", "filling"], names, False)
    assert said.startswith("filling is what can holds, and would weigh twice")
    apart = MaterialsAnswer.model_validate({"parts": [can, part("lid", "steel")]})
    assert materials_complaints(apart, ["can", "lid"], names, False) == []


def test_an_inner_shell_with_a_share_of_0_is_asked_for_again():
    cover = part("a", "steel", "sheet", volume_share=1.0, surface_share=1.0)
    shell = part("b", "steel", "hollow", volume_share=0.9, surface_share=0.0, inside="a")
    (said,) = complaints(cover, shell, wanted="ab", shared=True)
    assert "b: give surface_share, above 0" in said


@pytest.mark.parametrize(
    ("said", "complaint"),
    [
        ((0.3, 0.4, 0.5), None),
        ((0.5, 0.4, 0.6), "in this order"),
        ((300.0, 400.0, 500.0), "Answer in kilograms"),  # grams, of a cup
        ((3e-5, 4e-5, 5e-5), "Answer in kilograms"),
    ],
)
def test_a_mass_is_in_kilograms_and_above_zero(said, complaint):
    low, likely, high = said
    answer = MassAnswer(low_kg=low, likely_kg=likely, high_kg=high, reason="")
    found = mass_complaints(answer, 1e-3)
    assert bool(found) == bool(complaint)
    assert complaint is None or complaint in found[0]
    with pytest.raises(ValueError, match="greater than 0"):
        MassAnswer(low_kg=0.0, likely_kg=0.0, high_kg=1.0, reason="")


def test_a_density_in_grams_a_cubic_centimetre_is_asked_for_again():
    bounds = {("a", "density"): (7800.0, 7900.0)}
    rows = [{"quantity": "density", "value": 7.85, "reason": ""}]
    answer = ValueAnswer.model_validate({"parts": [{"part": "a", "values": rows}]})
    (said,) = placement_complaints(answer, {"a": ("density",)}, bounds)
    assert "density is 7.85, outside the measured range 7800 to 7900" in said


def bottle(*printed):
    judged = {"low_kg": 1.1, "likely_kg": 1.2, "high_kg": 1.4, "reason": "So."}
    return MassAnswer.model_validate(judged | {"printed": list(printed)})


def test_what_is_printed_comes_in_si():
    said = bottle(
        {"kind": "net weight", "number": 10.75, "unit": "oz", "words": "10 3/4 OZ"},
        {"kind": "volume", "number": 330, "unit": "ml", "words": "330 ml"},
        {"kind": "other", "number": 14.4, "unit": "", "words": "14.4 V"},
    )
    weight, volume, other = evidence_from_answer(said, "model").printed
    assert weight.value == pytest.approx(0.30476, rel=1e-4)
    assert volume.value == pytest.approx(3.3e-4)
    assert other.value is None


@pytest.mark.parametrize(
    ("number", "unit", "litres"),
    [(75, "cl", 0.75), (2.5, "dl", 0.25), (1, "L", 1.0), (330, "mL", 0.33), (750, " CL. ", 7.5)],
)
def test_print_in_a_unit_that_the_question_does_not_list_is_converted(number, unit, litres):
    row = {"kind": "volume", "number": number, "unit": unit, "words": f"{number} {unit}"}
    (volume,) = evidence_from_answer(bottle(row), "model").printed
    assert volume.value == pytest.approx(litres * 1e-3)
    assert volume.words == row["words"]


@pytest.mark.parametrize(("number", "unit"), [("75", "cl"), (75, "bushels")])
def test_print_that_cannot_be_converted_is_refused(number, unit):
    row = {"kind": "volume", "number": number, "unit": unit, "words": ""}
    with pytest.raises(ValueError, match="unit"):
        bottle(row)
