"""The page of a judged evaluation: first what the judge cannot tell, at the end every film."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.evaluation.judge.film_question import FilmAsked
from corporeal.evaluation.judge.judge_tables import JudgeResult, tables
from corporeal.evaluation.judge.put_to_judge import Judged
from corporeal.evaluation.judge.staging import DATED
from corporeal.evaluation.judge.telling import FilmVerdict
from corporeal.evaluation.result_table import Table
from corporeal.render.page import figure, held, page, safe
from corporeal.store import write_bytes

ROW = 6
"""Pictures of a film on the page."""
QUALITY = 80
"""Of their JPEG."""


def write_page(judged: Judged, result: JudgeResult, path: Path) -> None:
    """Write the page; the pictures of every film's first look are rendered for it.

    Raises:
        UserError: The file cannot be written.

    """
    trusted = {q for questions in result.believed.values() for q in questions}
    looked = {(a.scene, a.condition): a for a in judged.films.asked if a.look == 0}
    films = [_film(v, looked[v.scene, v.condition], trusted) for v in judged.verdicts]
    text = page(
        "corporeal.evaluation.judge",
        "judge.html",
        summary=safe(_summary(judged)),
        cannot=safe(cannot_tell(result)),
        tables="\n".join(_table(t) for t in tables(judged, result) if t.rows),
        films="\n".join(films),
        footer=safe(f"Judge: {judged.judge}"),
    )
    write_bytes(path, text.encode())


def cannot_tell(result: JudgeResult) -> str:
    """Say in a sentence which laws of physics the judge cannot tell."""
    none = [law for law, questions in result.believed.items() if not questions]
    if not none:
        return "Of each law of physics at least one question tells a control it is meant for."
    return (
        f"Of {', '.join(none)} this judge cannot tell: no question about them reports the faults "
        "it is meant for more often than on the reference, so no method is marked there."
    )


def _summary(judged: Judged) -> str:
    by = ", ".join(judged.answered_by) or "nobody"
    scenes = len({v.scene for v in judged.verdicts})
    missing = f" {judged.unanswered} looks have no usable answer." if judged.unanswered else ""
    return f"{len(judged.verdicts)} films of {scenes} scenes, answered by {by}.{missing}"


def _table(table: Table) -> str:
    heads = "".join(f"<th>{safe(h)}</th>" for h in table.heads)
    rows = "".join(
        f"<tr>{''.join(f'<td>{safe(cell)}</td>' for cell in row)}</tr>" for row in table.rows
    )
    return f"<h2>{safe(table.title)}</h2><table><tr>{heads}</tr>{rows}</table>"


def _film(verdict: FilmVerdict, asked: FilmAsked, trusted: set[str]) -> str:
    alarms = [
        f"<b>{safe(q)}</b>" if q in trusted else safe(q)
        for q, share in verdict.alarm.items()
        if share > 0
    ]
    said = "; ".join(safe(words) for words in verdict.happens)
    name = f"{verdict.scene}: {verdict.condition}"
    strip = figure(name, held(_strip(asked.question.pictures), "image/jpeg"))
    reported = ", ".join(alarms) or "no violation"
    return f"{strip}<p>{reported}; whole {verdict.whole:.1f} of 5. “{said}”</p>"


def _strip(pictures: Sequence[np.ndarray]) -> bytes:
    chosen = np.linspace(0, DATED - 1, ROW).round().astype(int)
    out = io.BytesIO()
    row = np.hstack([pictures[int(k)] for k in chosen])
    Image.fromarray(row).save(out, "JPEG", quality=QUALITY)
    return out.getvalue()
