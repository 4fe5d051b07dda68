"""Report of a judged evaluation: detection rates first, then all videos."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.progress import Progress, no_progress
from corporeal.core.store import write_bytes
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.render.html_page import data_url, escape_html, fill_page, html_figure
from video_judge.camera_staging import DATED_PICTURES
from video_judge.detectability import VideoVerdict
from video_judge.judge_query import JudgeVerdicts
from video_judge.judge_tables import JudgeResult, judge_tables

PICTURES_PER_VIDEO = 6
"""Pictures of a video on the page."""
JPEG_QUALITY = 80
"""Of their JPEG."""


def write_judge_page(judged: JudgeVerdicts, result: JudgeResult, path: Path, progress: Progress = no_progress) -> None:
    """Write the page; ``PICTURES_PER_VIDEO`` pictures of every video's first look are rendered for it.

    Args:
        judged: Answers about each video.
        result: What follows.
        path: Of the page.
        progress: Called with the fraction done and which video is rendered.

    Raises:
        UserError: The file cannot be written.

    """
    trusted = {q for questions in result.believed.values() for q in questions}
    looked = {(a.scene, a.condition): a for a in judged.videos.asked if a.look == 0}
    videos = []
    strips: dict[tuple[str, str], bytes] = {}
    for number, verdict in enumerate(judged.verdicts):
        progress(number / len(judged.verdicts), f"{verdict.scene} {verdict.condition}")
        question = looked[verdict.scene, verdict.condition].question
        # A baseline that is also a control is one motion, and is rendered once.
        motion = question.scene, question.prompt
        if motion not in strips:
            strips[motion] = _strip(question.pictures)
        videos.append(_video_section(verdict, strips[motion], trusted))
    text = fill_page(
        "video_judge",
        "judge.html",
        summary=escape_html(_summary(judged)),
        cannot=escape_html(blind_spots_sentence(result)),
        tables="\n".join(_table(t) for t in judge_tables(judged, result) if t.rows),
        videos="\n".join(videos),
        footer=escape_html(f"Judge: {judged.judge}"),
    )
    write_bytes(path, text.encode())


def blind_spots_sentence(result: JudgeResult) -> str:
    """Return in a sentence which laws of physics the judge cannot tell."""
    none = [law for law, questions in result.believed.items() if not questions]
    if not none:
        return "Of each law of physics at least one question tells a control it is meant for."
    return (
        f"Of {', '.join(none)} this judge cannot tell: no question about them reports the faults "
        "it is meant for more often than on the reference, so no method is marked there."
    )


def _summary(judged: JudgeVerdicts) -> str:
    by = ", ".join(judged.answered_by) or "no model"
    scenes = len({v.scene for v in judged.verdicts})
    missing = f" {judged.unanswered} looks have no usable answer." if judged.unanswered else ""
    return f"{len(judged.verdicts)} videos of {scenes} scenes, answered by {by}.{missing}"


def _table(table: ResultTable) -> str:
    heads = "".join(f"<th>{escape_html(h)}</th>" for h in table.heads)
    rows = "".join(f"<tr>{''.join(f'<td>{escape_html(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    return f"<h2>{escape_html(table.title)}</h2><table><tr>{heads}</tr>{rows}</table>"


def _video_section(verdict: VideoVerdict, row: bytes, trusted: set[str]) -> str:
    alarms = [
        f"<b>{escape_html(q)}</b>" if q in trusted else escape_html(q)
        for q, share in verdict.alarm.items()
        if share > 0
    ]
    said = "; ".join(escape_html(words) for words in verdict.happens)
    name = f"{verdict.scene}: {verdict.condition}"
    strip = html_figure(name, data_url(row, "image/jpeg"))
    reported = ", ".join(alarms) or "no violation"
    return f"{strip}<p>{reported}; whole {verdict.whole:.1f} of 5. “{said}”</p>"


def _strip(pictures: Sequence[np.ndarray]) -> bytes:
    chosen = np.linspace(0, DATED_PICTURES - 1, PICTURES_PER_VIDEO).round().astype(int)
    out = io.BytesIO()
    row = np.hstack([pictures[int(k)] for k in chosen])
    Image.fromarray(row).save(out, "JPEG", quality=JPEG_QUALITY)
    return out.getvalue()
