import pytest

from corporeal.vlm.answers import (
    ExtentsAnswer,
    FractionAnswer,
    MaterialsAnswer,
    PartsAnswer,
    RankingAnswer,
    ValueAnswer,
    Vocabulary,
    extents_complaints,
    materials_complaints,
    parts_complaints,
    placement_complaints,
    ranking_complaints,
)
from corporeal.vlm.by_hand import shape
from corporeal.vlm.recordings import schema_digest
from oracle import decomposed, part

SHAPES = {
    PartsAnswer: "0c018274966abe56",
    RankingAnswer: "0de5a5ac1e2c7e36",
    MaterialsAnswer: "49eb5498af281863",
    FractionAnswer: "794e664fac65535a",
    ValueAnswer: "057ed7557cba3a69",
    ExtentsAnswer: "4f540081939633e4",
}
NAMES = Vocabulary(
    {"steel": "steel", "Steel": "steel", "sand": "sand"}.get,
    {"water": "water"}.get,
    lambda name: name == "steel",
)


@pytest.mark.parametrize("answer", SHAPES, ids=lambda a: a.__name__)
def test_the_shapes_are_those_that_recordings_were_made_with(answer):
    """Changing a shape, or its docstring, makes every recorded answer stale: mean it."""
    assert schema_digest(answer) == SHAPES[answer]


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([["a"]], None),
        ([["a"], ["a", "b"], ["a", "b", "c"]], None),
        ([], "at least one"),
        ([["a", "b"], ["c", "d"]], "differ in their number"),
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
        (part("a", "Steel", "shell"), None),
        (part("a", None, None), None),
        (part("a", "steel", "filled", contents="water", fill=0.5), None),
        (part("b", "steel"), "exactly these names"),
        (part("a", "stone"), "'stone' is not in the list of materials"),
        (part("a", "water"), "'water' is not in the list of materials"),
        (part("a", "sand", "shell"), "Nobody makes walls of sand"),
        (part("a", "steel", "filled"), "needs contents"),
        (part("a", "steel", "filled", contents="water", fill=0.0), "a fill above 0"),
        (part("a", "steel", "filled", contents="beer", fill=1.0), "'beer' is not in the list"),
        (part("a", "steel", contents="water"), "Only a part whose structure is 'filled'"),
        (
            part("a", "steel", alternatives=[{"material": "sand", "probability": 0.4}]),
            "exceed 1",
        ),
        (
            part("a", "steel", alternatives=[{"material": "stone", "probability": 0.1}]),
            "'stone' is not",
        ),
    ],
)
def test_materials_are_from_the_lists_and_structures_make_sense(said, complaint):
    found = complaints(said)
    assert bool(found) == bool(complaint)
    assert complaint is None or complaint in found[0]


def test_parts_that_share_a_mesh_share_all_of_it():
    def two(a, b):
        halves = ((n, {"volume_share": x, "surface_share": x}) for n, x in (("a", a), ("b", b)))
        return complaints(*(part(n, "steel", **s) for n, s in halves), wanted="ab", shared=True)

    assert two(0.3, 0.7) == []
    assert two(0.31, 0.66) == []
    assert "volume_share must add up to 1, not 1.20" in two(0.5, 0.7)[0]
    assert "Give volume_share for every part" in two(0.5, None)[0]


def test_places_are_asked_for_once_each_and_values_stay_inside():
    wanted, bounds = {"a": ("young", "density")}, {("a", "young"): (1.0, 3.0)}
    bounds |= {("a", "density"): (10.0, 30.0)}

    def values(*said):
        rows = [{"quantity": q, "value": v, "reason": ""} for q, v in said]
        answer = ValueAnswer.model_validate({"parts": [{"part": "a", "values": rows}]})
        return placement_complaints(answer, wanted, bounds)

    assert values(("young", 1.0), ("density", 30.0)) == []
    assert values(("young", 1.0 - 1e-7), ("density", 30.0)) == []
    assert (
        "young is 3.1, outside the measured range 1 to 3"
        in values(("young", 3.1), ("density", 30))[0]
    )
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
    assert shape(schema, schema["$defs"]).split() == (
        '{ "ranking": [{ "number": integer, "reason": string }, ...] }'.split()
    )
    schema = MaterialsAnswer.model_json_schema()
    written = shape(schema, schema["$defs"])
    assert '"structure": "solid" | "shell" | "filled" or null' in written
    assert '"probability": number 0–1' in written
