"""What somebody said of the films of four scenes, blind: answers before the key was opened."""

import json
from pathlib import Path

import pytest

from corporeal.evaluation.judge.subquestions import Verdict, catalogue
from corporeal.evaluation.judge.telling import believed, film_verdict, tellings

FOLDER = Path(__file__).parents[1] / "recordings" / "dynamics"
KEY = {
    "steel-and-rubber": {
        "film-39a0fb778f90": "capped",
        "film-e78489ddf761": "frozen",
        "film-557c2e1ce981": "gain",
        "film-3671e9ecf3a0": "ghost",
        "film-6649bdf26509": "glide",
        "film-cac658e79465": "halfgravity",
        "film-bda119ce0011": "ours",
        "film-dfe962e5c188": "reversed",
        "film-23ab801c35d5": "single",
        "film-e45c4031da17": "slow",
        "film-5ce39352a06a": "wrong",
    },
    "duck-on-can": {
        "film-b0096a82d03b": "capped",
        "film-beb1a445639c": "frozen",
        "film-051a8f1ccf4e": "gain",
        "film-77afbc5a8936": "ghost",
        "film-4da9b5026854": "glide",
        "film-7e315874e194": "halfgravity",
        "film-7a2edcda8417": "ours",
        "film-f096c878cbf8": "reversed",
        "film-f59d0101a401": "single",
        "film-a30dfa3e4c6c": "slow",
        "film-bf9ccbd921df": "wrong",
    },
    "ficus-pushed": {
        "film-8111e4419ecc": "capped",
        "film-a8a609057aec": "glide",
        "film-096084fc5142": "ours",
        "film-46922a18c274": "single",
        "film-a067597b4e9f": "wrong",
    },
    "ketchup-stops": {
        "film-257a16096d10": "capped",
        "film-69e0454dd3fb": "frozen",
        "film-a5e899d4e7d0": "glide",
        "film-98f8087e151a": "halfgravity",
        "film-20109580d6dd": "ours",
        "film-2b2889eb4018": "reversed",
        "film-8f6287fe2d93": "slow",
    },
}
"""Scene → film → what it was; written down after the answers."""


@pytest.fixture(scope="module")
def films():
    rows = [json.loads(path.read_text()) for path in FOLDER.glob("*.json")]
    scene_of = {film: scene for scene, of in KEY.items() for film in of}
    return [
        film_verdict(
            scene_of[r["scene"]],
            KEY[scene_of[r["scene"]]][r["scene"]],
            [Verdict.model_validate(r["answer"])],
        )
        for r in rows
    ]


@pytest.fixture(scope="module")
def rows(films):
    return tellings(films, "ours", {c.id: c.id for c in catalogue().control})


def test_every_film_was_answered_once(films):
    wanted = [(scene, condition) for scene, of in KEY.items() for condition in of.values()]
    assert sorted((f.scene, f.condition) for f in films) == sorted(wanted)


def test_nothing_was_reported_of_our_runs_and_every_other_film_was_marked_lower(films):
    ours = [f for f in films if f.condition == "ours"]
    assert [f.whole for f in ours] == [5] * len(KEY)
    assert {alarm for f in ours for alarm in f.alarm.values()} == {0.0}
    assert max(f.whole for f in films if f not in ours) == 4


def test_which_questions_tell_a_control_they_are_meant_for(rows):
    told = {(r.control, r.question) for r in rows if r.meant and r.tells}
    assert told == {
        ("frozen", "start"),
        ("reversed", "cause"),
        ("reversed", "backwards"),
        ("slow", "pace"),
        ("glide", "rest"),
    }


def test_three_of_seven_laws_are_believed(rows):
    laws = {law for law, questions in believed(rows).items() if questions}
    assert laws == {"gravity", "inertia", "friction"}


def test_what_is_fast_in_a_film_is_not_told_by_the_question_meant_for_it_everywhere(rows):
    (gain,) = [r for r in rows if r.control == "gain" and r.question == "gain"]
    assert (gain.scenes, gain.hits) == (2, 1)
