"""What the embedded recogniser says of real files, from facts recorded about them."""

import json
from pathlib import Path

import pytest
from recognition.facts import FACTS, SETS, facts, judge, read
from recognition.page import margin_bands

from corporeal import materials
from corporeal.lab.evaluation.material_evaluation import (
    RecognitionRow,
    margin_roc_area,
    recognition_score,
)
from recognition import page

DOCS = Path(__file__).parents[1] / "docs" / "reference" / "name-recognition-benchmark.md"
SEEN_AGAIN = ("armchair_kaolin", "plant_potted_market", "guitar_market")


@pytest.fixture(scope="module")
def rows():
    return judge(facts())


def of(rows, group):
    return [r for r in rows if r.group == group]


def test_every_part_is_labelled_with_materials_of_the_library(rows):
    assert [len(of(rows, g)) for g in SETS] == [58, 21, 88, 95]
    known = set(materials.part_materials())
    assert all(r.accepted and set(r.accepted) <= known for r in rows)


def test_a_wrong_answer_is_rare_and_unknown_is_normal(rows):
    objects = recognition_score(of(rows, "objects"))
    assert objects.wrong <= 0.05
    assert objects.right >= 0.75
    assert objects.right + objects.wrong + objects.unknown == pytest.approx(1.0)
    for group in SETS:
        assert recognition_score(of(rows, group)).wrong <= 0.15
    assert recognition_score(of(rows, "unseen")).right >= 0.6
    assert recognition_score(of(rows, "fresh")).right >= 0.4


def test_the_margin_knows_right_from_wrong(rows):
    assert margin_roc_area(rows) > 0.7
    assert margin_roc_area(of(rows, "unseen")) > 0.8
    shares = [band.right for band in margin_bands(rows)]
    assert shares[-1] > 0.9
    assert min(shares) == min(shares[:2]), "small margins are the doubtful ones"


def test_the_order_is_measured_as_stated():
    def row(answer, margin):
        return RecognitionRow("a", "b", answer, margin, ("steel",))

    perfect = [row("steel", 0.8), row("steel", 0.7), row("wood", 0.3)]
    assert margin_roc_area(perfect) == 1.0
    assert margin_roc_area([*perfect, row("wood", 0.9)]) == 0.5
    assert margin_roc_area([row("steel", 0.5), row("wood", 0.5)]) == 0.5
    assert margin_roc_area([*perfect, row(None, 0.0)]) == 1.0, "unknown is no answer"


def test_the_page_says_what_was_measured():
    assert DOCS.read_text(encoding="utf-8") == page.markdown(), "python benchmarks/embedded.py --docs"


@pytest.mark.parametrize("stem", SEEN_AGAIN)
def test_the_recorded_facts_are_those_of_the_file(shared_assets, stem):
    recorded = {row["file"]: row for row in json.loads(FACTS.read_text(encoding="utf-8"))}
    again = json.loads(json.dumps(read("objects", shared_assets / "objects" / f"{stem}.glb")))
    assert again == recorded[stem]
