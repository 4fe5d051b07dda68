"""Planted judges: an oracle is believed, the others are called worthless."""

import random
from fractions import Fraction

import pytest
from video_judge.detectability import (
    bootstrap_interval,
    jeffreys_interval,
    measure_detectability,
    method_mark,
    trusted_questions,
    video_verdict,
)
from video_judge.subquestions import Verdict, question_catalogue

OURS = "ours"
FAULT = {c.id: c.questions[0] for c in question_catalogue().control}
"""The one question by which an oracle reports each control."""
SCENES = [f"scene-{k}" for k in range(8)]


def answers(alarms=(), also=()):
    """Report a violation by some questions; ``also`` says other answers outright."""
    said = {q.id: q.violation if q.id in alarms else opposite(q) for q in question_catalogue().question}
    return said | dict(also)


def opposite(question):
    return "no" if question.violation == "yes" else "yes"


def verdict(alarms=(), whole=5, also=()):
    return Verdict.model_validate({"happens": "It moves.", "answers": answers(alarms, also), "whole": whole})


def oracle(condition):
    return verdict([FAULT[condition]], 1) if condition in FAULT else verdict()


def kind(condition):
    return verdict()


def stern(condition):
    return verdict([q.id for q in question_catalogue().question], 1)


def coin(dice):
    every = [q.id for q in question_catalogue().question]
    return lambda condition: verdict([q for q in every if dice.random() < 0.5], dice.randint(1, 5))


def rows_of(judge, scenes=SCENES):
    videos = [video_verdict(s, c, [judge(c)]) for s in scenes for c in (OURS, *FAULT)]
    return measure_detectability(videos, OURS, {c: c for c in FAULT})


def told(rows):
    return {(r.control, r.question) for r in rows if r.tells and r.question != "whole"}


def test_there_are_thirteen_questions_and_ten_controls_each_found_by_questions_that_exist():
    known = {q.id for q in question_catalogue().question}
    assert len(known) == 13 and len(FAULT) == 10
    assert all(known.issuperset(c.questions) and c.questions for c in question_catalogue().control)
    assert {c.questions[0] for c in question_catalogue().control} <= known


def test_an_oracle_tells_each_control_by_its_own_question_only():
    rows = rows_of(oracle)
    assert told(rows) == set(FAULT.items())
    assert all(law for law in trusted_questions(rows).values() if law)


def test_an_oracle_is_believed_of_every_law_that_its_questions_are_about():
    about = {q.law for q in question_catalogue().question if q.id in FAULT.values()}
    assert {law for law, questions in trusted_questions(rows_of(oracle)).items() if questions} == about


def test_an_oracle_on_two_scenes_is_not_yet_believed_and_on_three_it_is():
    assert told(rows_of(oracle, SCENES[:2])) == set()
    assert told(rows_of(oracle, SCENES[:3])) == set(FAULT.items())


@pytest.mark.parametrize("judge", [kind, stern], ids=["kind", "stern"])
def test_who_likes_everything_and_who_likes_nothing_is_believed_of_no_law(judge):
    rows = rows_of(judge)
    assert told(rows) == set()
    assert not any(trusted_questions(rows).values())


def test_a_coin_is_seldom_believed():
    dice = random.Random(0)
    runs = [rows_of(coin(dice)) for _ in range(40)]
    meant = [r for rows in runs for r in rows if r.meant]
    assert sum(r.tells for r in meant) / len(meant) < 0.05


def test_one_coin_of_a_fixed_seed_is_believed_of_no_law():
    assert not any(trusted_questions(rows_of(coin(random.Random(3)))).values())


def test_an_alarm_on_the_reference_too_is_no_hit():
    rows = rows_of(lambda c: stern(c) if c == OURS else oracle(c))
    assert told(rows) == set()
    pace = next(r for r in rows if (r.control, r.question) == ("slow", "pace"))
    assert (pace.hits, pace.false_alarms, pace.accuracy) == (0, len(SCENES), 0.5)


def test_unclear_raises_no_alarm_and_what_applies_in_no_look_is_not_counted():
    said = video_verdict("a", OURS, [verdict(also={"hover": "unclear", "rest": "na"})])
    assert said.alarm["hover"] == 0.0 and "rest" not in said.alarm
    both = video_verdict("a", OURS, [verdict(["rest"], 1), verdict(also={"rest": "na"})])
    assert both.alarm["rest"] == 1.0
    assert video_verdict("a", OURS, [verdict(["rest"], 1), verdict()]).alarm["rest"] == 0.5
    assert both.whole == 3.0


@pytest.mark.parametrize(
    ("wins", "count", "told"),
    [
        (3, 3, True), (2.5, 3, False), (6.5, 8, True), (6, 8, False),
        (9, 12, True), (8.5, 12, False), (26.5, 42, True), (26, 42, False),
    ],
)  # fmt: skip
def test_what_is_beyond_chance(wins, count, told):
    interval = jeffreys_interval(wins, count)
    assert interval.low < Fraction(wins) / count < interval.high or wins == count
    assert (interval.low > 0.5) == told


def test_a_mark_is_the_share_of_believed_questions_without_an_alarm():
    videos = [video_verdict(s, "single", [verdict(["stick"], 2)]) for s in SCENES]
    assert method_mark(videos, "single", "contact", ["stick", "react"]).mark == 0.5
    assert method_mark(videos, "single", "gravity", ["pace"]).mark == 1.0
    assert method_mark(videos, "capped", "gravity", ["pace"]) is None
    na = [video_verdict(s, "single", [verdict(also={"pace": "na"})]) for s in SCENES]
    assert method_mark(na, "single", "gravity", ["pace"]) is None


def test_the_interval_of_a_mean_is_repeatable_and_narrows_with_scenes():
    few, many = bootstrap_interval([0.0, 1.0] * 2), bootstrap_interval([0.0, 1.0] * 50)
    assert few == bootstrap_interval([0.0, 1.0] * 2)
    assert many.high - many.low < few.high - few.low
    assert bootstrap_interval([0.7]) == bootstrap_interval([0.7, 0.7])


@pytest.mark.parametrize(
    "wrong",
    [
        {"whole": 6},
        {"happens": ""},
        {"answers": {"hover": "yes"}},
        {"answers": answers(also={"hover": "perhaps"})},
        {"answers": answers(also={"colour": "yes"})},
    ],
)
def test_an_answer_in_another_shape_is_refused(wrong):
    good = {"happens": "It moves.", "answers": answers(), "whole": 5}
    assert Verdict.model_validate(good).whole == 5
    with pytest.raises(ValueError, match="validation error"):
        Verdict.model_validate(good | wrong)
