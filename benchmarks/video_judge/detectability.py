"""Detection rates of a judge: every question against every control, with intervals.

A question tells a control where it raises an alarm on the control more often than on the reference
of the same scene, beyond chance. Of a law of physics a judge is trusted only through questions
that tell a control they are meant for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np
from scipy.stats import beta

from video_judge.subquestions import MAX_MARK, QuestionCatalogue, Verdict, question_catalogue

INTERVAL_LEVEL = 0.90
"""Of intervals [-]."""
CHANCE_ACCURACY = 0.5
"""Accuracy of a coin [-]."""
WHOLE_MARK = "whole"
"""The mark for the whole video, beside the questions."""
BOOTSTRAP_DRAWS = 2000
"""Of scenes, for the interval of a mean."""


@dataclass(frozen=True)
class VideoVerdict:
    """Answers about one video: means over looks."""

    scene: str
    condition: str
    alarm: Mapping[str, float]
    """Question → share of looks that report a violation [-]; absent: it applies in no look."""
    whole: float
    """Mark, 1 to 5."""
    happens: tuple[str, ...]
    """In the judge's words, a look each."""


def video_verdict(scene: str, condition: str, looks: Sequence[Verdict]) -> VideoVerdict:
    """Take the mean of the looks at one video; "unclear" reports nothing."""
    said = [look.said() for look in looks]
    alarm = {}
    for q in question_catalogue().question:
        given = [answers[q.id] for answers in said if answers[q.id] != "na"]
        if given:
            alarm[q.id] = fmean(float(a == q.violation) for a in given)
    happens = tuple(look.happens for look in looks)
    return VideoVerdict(scene, condition, alarm, fmean(look.whole for look in looks), happens)


# ---------------------------------------------------------------- controls


@dataclass(frozen=True)
class ConfidenceInterval:
    """From the 5th to the 95th percentile."""

    low: float
    high: float


def jeffreys_interval(wins: float, count: int) -> ConfidenceInterval:
    """Interval of a share by Jeffreys' prior, 90 %; a tie is half a win."""
    tail = (1 - INTERVAL_LEVEL) / 2
    low, high = beta.ppf([tail, 1 - tail], wins + 0.5, count - wins + 0.5)
    return ConfidenceInterval(float(low), float(high))


@dataclass(frozen=True)
class Detectability:
    """How one question compares one control with the reference."""

    control: str
    question: str
    meant: bool
    """Whether the question is meant to report this control."""
    scenes: int
    hits: int
    """Scenes in which the control raises the greater alarm."""
    false_alarms: float
    """Alarms on the references of these scenes."""
    accuracy: float
    """Share of scenes in which the control raises the greater alarm, ties half [-]."""
    interval: ConfidenceInterval
    tells: bool


def measure_detectability(
    videos: Sequence[VideoVerdict], reference: str, controls: Mapping[str, str]
) -> list[Detectability]:
    """Compare every control with the reference by every question and by the whole mark.

    Args:
        videos: Of controls only those that differ from the reference enough to be distinguished.
        reference: Name of the reference among the conditions.
        controls: Control → its name among the conditions.

    """
    by_condition = {(f.scene, f.condition): f for f in videos}
    scenes = sorted({f.scene for f in videos if f.condition == reference})
    rows = []
    for control, name in controls.items():
        pairs = [(by_condition[s, name], by_condition[s, reference]) for s in scenes if (s, name) in by_condition]
        for question in (*(q.id for q in question_catalogue().question), WHOLE_MARK):
            both = [
                (question_alarm(a, question), question_alarm(b, question))
                for a, b in pairs
                if question_alarm(a, question) is not None and question_alarm(b, question) is not None
            ]
            if both:
                rows.append(_measure_detectability(control, question, np.array(both, dtype=float)))
    return rows


def question_alarm(video: VideoVerdict, question: str) -> float | None:
    """Return a question's alarm, or how far the whole mark is from the best; None: not asked."""
    return MAX_MARK - video.whole if question == WHOLE_MARK else video.alarm.get(question)


def _measure_detectability(control: str, question: str, both: np.ndarray) -> Detectability:
    worse, better = both.T
    hits, ties = int((worse > better).sum()), int((worse == better).sum())
    wins = hits + 0.5 * ties
    interval = jeffreys_interval(wins, len(both))
    return Detectability(
        control=control,
        question=question,
        meant=question in question_catalogue().meant(control),
        scenes=len(both),
        hits=hits,
        false_alarms=float(better.sum()),
        accuracy=wins / len(both),
        interval=interval,
        tells=interval.low > CHANCE_ACCURACY,
    )


def trusted_questions(rows: Sequence[Detectability], known: QuestionCatalogue | None = None) -> dict[str, list[str]]:
    """Return law of physics → questions that tell a control they are meant for; laws in order."""
    known = known or question_catalogue()
    telling = {r.question for r in rows if r.tells and r.meant}
    return {law: [q.id for q in known.question if q.law == law and q.id in telling] for law in known.laws()}


# ---------------------------------------------------------------- methods


@dataclass(frozen=True)
class MethodMark:
    """How well one method does in a group of scenes, by questions that are trusted."""

    method: str
    group: str
    """A law of physics, a class of materials or a constitutive law."""
    scenes: int
    mark: float
    """Share of questions without an alarm, mean over scenes [-]."""
    interval: ConfidenceInterval
    """By drawing scenes with replacement, 90 %."""


def method_mark(videos: Sequence[VideoVerdict], method: str, group: str, questions: Sequence[str]) -> MethodMark | None:
    """Mark a method by some questions; None: none of them applies to any of its videos.

    Args:
        videos: Of the group's scenes.
        method: Name among the conditions.
        group: What the scenes or questions have in common.
        questions: That are trusted.

    """
    shares = []
    for video in videos:
        given = [video.alarm[q] for q in questions if q in video.alarm]
        if video.condition == method and given:
            shares.append(1.0 - fmean(given))
    if not shares:
        return None
    return MethodMark(method, group, len(shares), fmean(shares), bootstrap_interval(shares))


def bootstrap_interval(values: Sequence[float]) -> ConfidenceInterval:
    """Interval of a mean by drawing values with replacement, 90 %; equal input, equal result."""
    dice = np.random.default_rng(0)
    means = np.array(values)[dice.integers(0, len(values), (BOOTSTRAP_DRAWS, len(values)))].mean(axis=1)
    tail = 100 * (1 - INTERVAL_LEVEL) / 2
    low, high = np.percentile(means, [tail, 100 - tail])
    return ConfidenceInterval(float(low), float(high))
