"""Real sizes come from the file, a model, a recording or the table; and it is told from which."""

import csv
import json
import re
from pathlib import Path

import pytest
from fake_server import FakeServer

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import NO_USAGE
from corporeal.recognition.typical_extents import typical_extent
from corporeal.vlm.answer_checks import size_complaints
from corporeal.vlm.answer_schemas import SizeAnswer
from corporeal.vlm.human_client import PendingQuestionsError
from corporeal.vlm.real_sizes import UNKNOWN_EXTENT_M, ClassSize, ClassSizes, estimate_real_extent, find_class_sizes

RECORDED = Path(__file__).parents[1] / "recordings" / "sizes"
COUCH = {"smallest": 1.3, "usual": 2.1, "largest": 3.2, "reason": "Three people sit on it."}


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path / "cache"))


def answer(**changed):
    return {"content": json.dumps(COUCH | changed)}


def ask(server, *classes, record=None):
    return find_class_sizes(classes, f"openai:fake-model@{server.url}", record)


# ---------------------------------------------------------------- who says it


def test_without_a_model_the_table_says_it():
    sizes = find_class_sizes(["soda can", "widget", "soda can"])
    assert list(sizes.usual) == ["soda can"]
    can = sizes.usual["soda can"]
    assert (can.low, can.usual, can.high, can.said_by) == (0.08, 0.12, 0.16, "table")
    assert (sizes.transcript, sizes.usage, sizes.warnings) == ((), NO_USAGE, ())


def test_a_model_is_asked_about_each_class_once_in_words_alone():
    with FakeServer(answer()) as server:
        sizes = ask(server, "couch", "wide couch", "couch")
        again = ask(server, "couch")
    assert len(server.requests) == 2, "what was answered once is not asked again"
    assert again.usual["couch"] == sizes.usual["couch"]
    assert all(request.pictures == 0 for request in server.requests)
    asked = sorted(re.search(r'called \\\\?"([\w ]+)', r.text)[1] for r in server.requests)
    assert asked == ["couch", "wide couch"]
    couch = sizes.usual["couch"]
    assert (couch.low, couch.usual, couch.high) == (1.3, 2.1, 3.2)
    assert (couch.said_by, couch.reason) == ("model", COUCH["reason"])
    assert couch.who.startswith("openai:fake-model@")
    assert sizes.usage.calls == 2
    assert [row["task"] for row in sizes.transcript] == ["sizes", "sizes"]


def test_what_was_recorded_is_replayed_without_anybody(tmp_path):
    with FakeServer(answer()) as server:
        live = ask(server, "couch", "sofa", record=tmp_path / "kept")
    replayed = find_class_sizes(["sofa"], f"replay:{tmp_path / 'kept'}").usual["sofa"]
    assert (replayed.said_by, replayed.who) == ("recording", live.usual["sofa"].who)
    assert (replayed.low, replayed.usual, replayed.high) == (1.3, 2.1, 3.2)


def test_a_class_that_was_not_recorded_is_reported(tmp_path):
    with FakeServer(answer()) as server:
        ask(server, "couch", record=tmp_path / "kept")
    with pytest.raises(UserError, match=r"No recording in .* answers 'sizes' about 'vase'"):
        find_class_sizes(["couch", "vase"], f"replay:{tmp_path / 'kept'}")


def test_a_question_that_stays_open_leaves_the_table_and_a_warning():
    nonsense = {"content": "It depends."}
    with FakeServer(nonsense) as server:
        sizes = ask(server, "couch", "widget")
    assert {k: s.said_by for k, s in sizes.usual.items()} == {"couch": "table"}
    assert len(sizes.warnings) == 2
    assert "couch: the question about sizes got no usable answer" in sizes.warnings[0]


def test_questions_can_wait_for_a_person(tmp_path):
    with pytest.raises(PendingQuestionsError, match="2 questions wait"):
        find_class_sizes(["couch", "vase"], f"ask:{tmp_path}")
    for page in (tmp_path / "questions").glob("*.json"):
        page.write_text(json.dumps(COUCH))
    sizes = find_class_sizes(["couch", "vase"], f"ask:{tmp_path}")
    assert {s.who for s in sizes.usual.values()} == {"by hand"}
    assert sorted(p.name[:5] for p in tmp_path.glob("*.json")) == ["sizes", "sizes"]


def test_a_model_that_differs_from_the_table_is_believed_and_reported():
    with FakeServer(answer(usual=0.5, smallest=0.4)) as server:
        sizes = ask(server, "couch")
    assert sizes.usual["couch"].usual == 0.5
    (warning,) = sizes.warnings
    assert ", 50 cm is usual for objects like this: couch; the table" in warning
    assert "knows 1 m to 4 m. The former was used." in warning


# ---------------------------------------------------------------- what is no answer


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"smallest": 5e-4}, "between 0.001 and 100 metres"),
        ({"largest": 101.0}, "between 0.001 and 100 metres"),
        ({"smallest": 2.2}, "in this order"),
        ({"largest": 2.0}, "in this order"),
        ({"usual": 90.0, "largest": 99.0}, "Answer in metres"),
        ({"usual": 0.02, "smallest": 0.01}, "Answer in metres"),
    ],
)
def test_sizes_of_no_object_or_in_no_metres_are_sent_back(changed, words):
    assert size_complaints(SizeAnswer(**COUCH), "couch") == []
    (complaint,) = size_complaints(SizeAnswer(**COUCH | changed), "couch")
    assert words in complaint


def test_a_slip_of_the_unit_is_put_right_by_the_model_itself():
    slip = answer(smallest=50, usual=95.0, largest=99.0)
    with FakeServer(slip, answer()) as server:
        sizes = ask(server, "couch")
    assert "Answer in metres" in server.requests[1].text
    assert (sizes.usual["couch"].usual, sizes.usage.calls) == (2.1, 2)


def test_a_recording_is_checked_like_a_model(tmp_path):
    (row,) = [p for p in RECORDED.glob("*.json") if '"scene": "couch"' in p.read_text()]
    said = json.loads(row.read_text())
    said["answer"]["usual"] = 2100.0
    (tmp_path / row.name).write_text(json.dumps(said))
    with pytest.raises(BadFileError, match=r"between 0\.001 and 100 metres"):
        find_class_sizes(["couch"], f"replay:{tmp_path}")


# ---------------------------------------------------------------- file, class, or nobody


DUCKS = ClassSizes({"duck": ClassSize("duck", 0.05, 0.12, 0.6, "recording", "by hand", "A bath toy.")})


def test_a_file_in_metres_is_believed():
    real = estimate_real_extent("duck_khronos", "duck", 0.3, True, DUCKS)
    assert (real.extent, real.said_by, real.warnings) == (0.3, "file", ())


def test_a_file_in_metres_is_doubted_and_yet_believed():
    real = estimate_real_extent("duck_khronos", "duck", 1.65, True, DUCKS)
    assert (real.extent, real.said_by) == (1.65, "file")
    (warning,) = real.warnings
    assert "duck_khronos is 1.65 m large in its file" in warning
    assert "a recorded answer (by hand) knows such objects (duck) from 5 cm to 60 cm" in warning


def test_a_file_in_other_units_says_nothing_of_its_size():
    for extent in (1.65, 112.0):
        real = estimate_real_extent("duck_khronos", "duck", extent, False, DUCKS)
        assert (real.extent, real.said_by, real.warnings) == (0.12, "recording", ())
        assert (real.by, real.reason) == ("a recorded answer (by hand)", "A bath toy.")


def test_an_unknown_size_gets_a_substitute_and_a_warning():
    real = estimate_real_extent("thing_7", "widget", 41.0, False, DUCKS)
    assert (real.extent, real.said_by) == (UNKNOWN_EXTENT_M, "default")
    assert "The size of thing_7 (widget) is unknown" in real.warnings[0]
    metric = estimate_real_extent("thing_7", "widget", 0.7, True, DUCKS)
    assert (metric.extent, metric.said_by, metric.warnings) == (0.7, "file", ())


# ---------------------------------------------------------------- what lies in the repository


def test_the_recorded_answers_fit_the_question_of_today():
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in RECORDED.glob("*.json")]
    assert {row["schema"] for row in rows} == {SizeAnswer.SCHEMA}
    classes = [row["scene"] for row in rows]
    sizes = find_class_sizes(classes, f"replay:{RECORDED}")
    assert sorted(sizes.usual) == sorted(classes)
    assert sizes.warnings == ()
    assert {(s.said_by, s.who) for s in sizes.usual.values()} == {("recording", "by hand")}


def test_the_table_knows_every_class_of_the_real_assets(shared_assets):
    """In metres they lie within what it calls common, give or take its margin."""
    with (shared_assets / "manifest.csv").open(encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r["file"].startswith(("objects/", "ycb/"))]
    assert len(rows) > 50
    for row in rows:
        known = typical_extent(row["category"])
        assert known is not None, row["category"]
        if row["metric_scale"].startswith("yes"):
            size = ClassSize("", known.low, known.usual, known.high, "table", "", "")
            sizes = ClassSizes({row["category"]: size})
            real = estimate_real_extent("x", row["category"], float(row["max_extent_m"]), True, sizes)
            assert real.warnings == (), row["file"]
