"""Answers of a judge as tables and as data: first what it cannot distinguish."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

from corporeal.lab.evaluation.result_table import ResultTable
from video_judge.detectability import (
    WHOLE_MARK,
    ConfidenceInterval,
    Detectability,
    MethodMark,
    VideoVerdict,
    measure_detectability,
    method_mark,
    trusted_questions,
)
from video_judge.judge_query import JudgeVerdicts
from video_judge.judge_scenes import CONTROL_NAMES, REFERENCE_METHOD, control_name
from video_judge.subquestions import question_catalogue

CANNOT_TELL_TEXT = "this judge cannot tell"


@dataclass(frozen=True)
class JudgeResult:
    """What follows from a judge's answers."""

    rows: tuple[Detectability, ...]
    """Every question against every control."""
    believed: Mapping[str, list[str]]
    """Law of physics → questions that tell a control they are meant for."""
    false_alarms: Mapping[str, float]
    """Law of physics → alarms of its questions on references, over how often they were asked."""
    by_law_of_physics: tuple[MethodMark, ...]
    by_class: tuple[MethodMark, ...]
    by_law: tuple[MethodMark, ...]
    wholes: Mapping[str, float]
    """Method → mean mark, 1 to 5."""


def weigh_judge(judged: JudgeVerdicts) -> JudgeResult:
    """Find what the judge can tell, and mark methods by that alone."""
    effective = {(e.scene, control_name(e.control)) for e in judged.videos.effects if e.effective}
    names = [control_name(c) for c in CONTROL_NAMES]
    usable = [v for v in judged.verdicts if v.condition not in names or (v.scene, v.condition) in effective]
    rows = measure_detectability(usable, REFERENCE_METHOD, dict(zip(CONTROL_NAMES, names, strict=True)))
    trusted = trusted_questions(rows)
    methods, all_questions = judged.videos.methods, [q for qs in trusted.values() for q in qs]
    by_physics = [method_mark(usable, m, law, qs) for law, qs in trusted.items() if qs for m in methods]
    groups = judged.videos.groups
    return JudgeResult(
        rows=tuple(rows),
        believed=trusted,
        false_alarms={law: _false_alarms(usable, law) for law in trusted},
        by_law_of_physics=tuple(m for m in by_physics if m),
        by_class=_grouped(usable, methods, all_questions, {s: g.classes for s, g in groups.items()}),
        by_law=_grouped(usable, methods, all_questions, {s: g.laws for s, g in groups.items()}),
        wholes={m: w for m in methods if (w := _whole(usable, m)) is not None},
    )


def _grouped(
    videos: Sequence[VideoVerdict],
    methods: Sequence[str],
    questions: Sequence[str],
    groups: Mapping[str, Sequence[str]],
) -> tuple[MethodMark, ...]:
    """Mark every method in the scenes in which something occurs."""
    found = []
    for name in sorted({g for kinds in groups.values() for g in kinds}):
        mine = [f for f in videos if name in groups.get(f.scene, ())]
        found += [method_mark(mine, m, name, questions) for m in methods]
    return tuple(m for m in found if m)


def _false_alarms(videos: Sequence[VideoVerdict], law: str) -> float:
    asked = [q.id for q in question_catalogue().question if q.law == law]
    given = [f.alarm[q] for f in videos if f.condition == REFERENCE_METHOD for q in asked if q in f.alarm]
    return fmean(given) if given else 0.0


def _whole(videos: Sequence[VideoVerdict], method: str) -> float | None:
    given = [f.whole for f in videos if f.condition == method]
    return fmean(given) if given else None


# ---------------------------------------------------------------- tables


def judge_tables(judged: JudgeVerdicts, result: JudgeResult) -> list[ResultTable]:
    """Return the tables: laws, controls, methods, classes, constitutive laws, what was left out."""
    return [
        _laws(result),
        _controls(judged, result),
        _marks("Methods by what the judge can tell", result.by_law_of_physics, result.wholes),
        _marks("Methods by class of material", result.by_class),
        _marks("Methods by constitutive law", result.by_law),
        ResultTable(
            "Not judged", ("scene", "video", "why"), [(f.scene, f.condition, f.reason) for f in judged.videos.failed]
        ),
    ]


def _laws(result: JudgeResult) -> ResultTable:
    rows = [
        (law, CANNOT_TELL_TEXT if not judges else f"trusted by: {', '.join(judges)}", f"{alarms:.0%}")
        for law, judges in result.believed.items()
        for alarms in [result.false_alarms[law]]
    ]
    return ResultTable("What this judge can tell", ("law of physics", "", "alarms on references"), rows)


def _controls(judged: JudgeVerdicts, result: JudgeResult) -> ResultTable:
    rows = []
    for control in question_catalogue().control:
        effects = [e for e in judged.videos.effects if e.control == control.id]
        effective = sum(e.effective for e in effects)
        if not effective:
            why = "not effective" if effects else "has no place in these scenes"
            rows.append((control.id, "", "0", "", "", "", why))
            continue
        rows += [_telling_row(r) for r in result.rows if r.control == control.id and _worth(r)]
    heads = ("control", "question", "scenes", "hits", "false alarms", "accuracy, 90 %", "")
    return ResultTable("Controls (* meant to be found by this question)", heads, rows)


def _worth(row: Detectability) -> bool:
    """Whether a row says anything: meant, hit, or the whole mark."""
    return row.meant or row.hits > 0 or row.question == WHOLE_MARK


def _telling_row(row: Detectability) -> tuple[str, ...]:
    return (
        row.control,
        row.question + " *" * row.meant,
        str(row.scenes),
        str(row.hits),
        f"{row.false_alarms:.3g}",
        f"{row.accuracy:.2f} {_interval(row.interval)}",
        "tells" if row.tells else "cannot tell",
    )


def _marks(title: str, marks: Sequence[MethodMark], wholes: Mapping[str, float] | None = None) -> ResultTable:
    rows = [(m.group, m.method, str(m.scenes), f"{m.mark:.2f} {_interval(m.interval)}") for m in marks]
    rows += [("whole mark, 1 to 5", m, "", f"{w:.2f}") for m, w in (wholes or {}).items()]
    return ResultTable(title, ("of", "method", "scenes", "without alarm, 90 %"), rows)


def _interval(interval: ConfidenceInterval) -> str:
    return f"[{interval.low:.2f}, {interval.high:.2f}]"


def judge_record(judged: JudgeVerdicts, result: JudgeResult) -> dict[str, Any]:
    """Return all of it as plain data."""
    return {
        "judge": judged.judge,
        "answered_by": list(judged.answered_by),
        "unanswered": judged.unanswered,
        "price": asdict(judged.price),
        **asdict(result),
        "effects": [asdict(e) for e in judged.videos.effects],
        "failed": [asdict(f) for f in judged.videos.failed],
        "videos": [asdict(v) for v in judged.verdicts],
    }
