"""What somebody said of the films of steel-and-rubber, blind: answers before the key was opened."""

import json
from pathlib import Path

import pytest

from corporeal.evaluation.judge.subquestions import Verdict, catalogue
from corporeal.evaluation.judge.telling import believed, film_verdict, tellings

FOLDER = Path(__file__).parents[1] / "recordings" / "dynamics"
KEY = {
    "film-bc5fdc6475b0": "ours",
    "film-e78489ddf761": "frozen",
    "film-e09ad861e1dc": "reversed",
    "film-6c927a100e1a": "slow",
    "film-3671e9ecf3a0": "ghost",
    "film-fa44e499db14": "gain",
    "film-952c759bdf40": "glide",
    "film-d61d6fcef0bb": "halfgravity",
    "film-60ad32eb4a88": "wrong",
    "film-23ab801c35d5": "single",
    "film-39a0fb778f90": "capped",
}
"""Written down after the answers."""


@pytest.fixture(scope="module")
def films():
    rows = [json.loads(path.read_text()) for path in FOLDER.glob("*.json")]
    return [
        film_verdict("steel-and-rubber", KEY[r["scene"]], [Verdict.model_validate(r["answer"])])
        for r in rows
    ]


def test_every_film_was_answered_once(films):
    assert sorted(f.condition for f in films) == sorted(KEY.values())


def test_nothing_was_reported_of_our_run_and_every_other_film_was_marked_lower(films):
    (ours,) = [f for f in films if f.condition == "ours"]
    assert set(ours.alarm.values()) == {0.0} and ours.whole == 5
    assert max(f.whole for f in films if f is not ours) == 3


def test_nine_of_ten_controls_were_reported_by_a_question_meant_for_them(films):
    rows = tellings(films, "ours", {c.id: c.id for c in catalogue().control})
    assert {r.control for r in rows if r.meant and r.hits} == {*KEY.values()} - {"ours", "single"}


def test_one_scene_is_not_enough_to_be_believed(films):
    rows = tellings(films, "ours", {c.id: c.id for c in catalogue().control})
    assert not any(believed(rows).values())
