"""The report of a corpus: one page that holds all it shows, and its numbers as CSV and JSON."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from corporeal.core import store
from corporeal.jobs.jobs import Progress
from corporeal.lab.corpus.breakdown import (
    Line,
    as_data,
    breakdowns,
    credits,
    materials_of,
    rows,
    total,
)
from corporeal.lab.corpus.collect import SWAY, Collected, SceneRecord, collect
from corporeal.lab.corpus.drawings import drawings
from corporeal.render.page import figure, held, page, safe
from corporeal.simulation.audit_words import ALLOWED

PAGE, TABLE, DATA = "report.html", "report.csv", "report.json"
THUMB = 840
"""Width of a film's row of frames on the page [px]."""
NUMBERS = (
    "scenes",
    "objects",
    "clean audit",
    "seen",
    "at rest",
    "impacts",
    "parted of met",
    "momentum",
    "energy",
    "penetration [dx]",
    "time [s]",
    "memory [MB]",
    "materials",
)


def report_corpus(folder: Path, progress: Progress = lambda fraction, words: None) -> list[Path]:
    """Write the report beside the scenes; return the files.

    Raises:
        UserError: The folder is no corpus, or the disk refuses it.

    """
    progress(0.0, "reading the runs")
    corpus = collect(folder)
    progress(0.3, "drawing")
    text = render_page(corpus)
    progress(0.9, "writing")
    written = [folder / name for name in (PAGE, TABLE, DATA)]
    store.write_bytes(written[0], text.encode())
    store.write_bytes(written[1], _csv(rows(corpus)).encode())
    store.write_json(written[2], as_data(corpus))
    return written


def render_page(corpus: Collected) -> str:
    """Return the page as HTML."""
    figures = [figure(c, held(svg, "image/svg+xml")) for c, svg in drawings(corpus).items()]
    return page(
        "corporeal.lab.corpus",
        "report.html",
        title=safe(corpus.name),
        summary=_summary(corpus),
        tiles=_tiles(corpus),
        messages="".join(f'<p class="warn">{safe(m)}</p>' for m in corpus.plan.messages),
        composition=figures[0],
        results="".join(figures[1:]) or '<p class="none">Nothing was run yet.</p>',
        breakdowns=_breakdowns(corpus),
        failures=_failures(corpus),
        scenes="".join(_scene(s) for s in corpus.scenes),
        **{f"most_{name}": f"{limit:g}" for name, limit in ALLOWED.items()},
        sway=f"{SWAY * 1e3:g}",
        credits=_credits(corpus),
        settings=_settings(corpus),
    )


def _csv(table: Sequence[dict[str, Any]]) -> str:
    out = io.StringIO()
    names = list(dict.fromkeys(name for row in table for name in row))
    writer = csv.DictWriter(out, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return out.getvalue()


# ---------------------------------------------------------------- at the top


def _summary(corpus: Collected) -> str:
    scenes, config = corpus.scenes, corpus.plan.config
    classes = {c for s in scenes for c in s.planned.classes}
    assets = {a for s in scenes for a in s.planned.assets}
    objects = sum(s.planned.count for s in scenes)
    of_assets = f" from {len(assets)} models" if assets else ""
    return (
        f"{_count(len(scenes), 'scene')} with {_count(objects, 'object')} of {len(classes)} "
        f"classes{of_assets}, planned by {config.words}. "
        f"{len(_assembled(corpus))} assembled, {len(corpus.run)} run, "
        f"{len(_failed(corpus))} failed."
    )


def _tiles(corpus: Collected) -> str:
    whole = total(corpus)
    tiles = [
        (f"{len(corpus.run)} / {len(corpus.scenes)}", "scenes run"),
        (f"{len(_assembled(corpus))} / {len(corpus.scenes)}", "scenes assembled"),
    ]
    if whole is not None:
        numbers = [s.numbers for s in corpus.run if s.numbers]
        hours = sum(n.seconds for n in numbers) / 3600
        tiles += [
            (f"{whole.clean} / {whole.scenes}", "with a clean audit"),
            (f"{whole.seen} / {whole.scenes}", "show their interaction"),
            (f"{sum(n.particles for n in numbers):,}", "particles in all"),
            (f"{sum(n.duration_s for n in numbers):.0f} s", "of motion simulated"),
            (f"{whole.penetration_median:.2f} dx", "deepest penetration, median"),
            (f"{hours:.2f} h", "of computing, all processes"),
        ]
    return "".join(f'<div class="tile"><b>{n}</b><span>{words}</span></div>' for n, words in tiles)


def _assembled(corpus: Collected) -> list[SceneRecord]:
    return [s for s in corpus.scenes if s.made]


def _failed(corpus: Collected) -> list[SceneRecord]:
    return [s for s in corpus.scenes if s.error]


# ---------------------------------------------------------------- groups


def _breakdowns(corpus: Collected) -> str:
    whole = total(corpus)
    if whole is None:
        return '<p class="none">Nothing was run yet.</p>'
    names = {
        "interaction": "Interaction",
        "objects": "Number of objects",
        "material class": "Material class",
        "law": "Constitutive law, as simulated",
    }
    heads = "".join(f"<th>{h}</th>" for h in NUMBERS)
    return "".join(
        f'<h3>{names[key]}</h3><div class="wide"><table class="numbers">'
        f"<tr><th></th>{heads}</tr>{''.join(map(_line, lines))}{_line(whole, 'all')}</table></div>"
        for key, lines in breakdowns(corpus).items()
    )


def _line(line: Line, style: str = "") -> str:
    cells = (
        line.scenes,
        line.objects,
        _share(line.clean, line.scenes),
        _share(line.seen, line.scenes),
        _share(line.at_rest, line.objects),
        line.impacts,
        f"{line.separated} of {line.met}",
        f"{_small(line.momentum_median)} | {_small(line.momentum_worst)}",
        f"{_small(line.energy_median)} | {_small(line.energy_worst)}",
        f"{line.penetration_median:.2f} | {line.penetration_worst:.2f}",
        f"{line.seconds_median:.0f}",
        f"{line.memory_worst_mb:,.0f}",
        f"<small>{safe(', '.join(line.materials))}</small>",
    )
    return (
        f'<tr class="{style}"><td>{safe(line.group)}</td>'
        + "".join(f"<td>{c}</td>" for c in cells)
        + "</tr>"
    )


# ---------------------------------------------------------------- scenes


def _scene(scene: SceneRecord) -> str:
    planned, numbers = scene.planned, scene.numbers
    made = scene.composition
    words = "" if made is None else safe(made.what_happens)
    stands = planned.arrangement if made is None else made.arrangement
    objects, matter = ", ".join(planned.classes), ", ".join(materials_of(scene))
    cells = [
        _thumbnail(scene),
        f"<b>{safe(scene.name)}</b><br><small>{safe(stands)}. {words}</small>",
        f"{safe(objects)}<br><small>{safe(matter)}</small>",
    ]
    if numbers is None:
        state = scene.error or _state(scene)
        return f'<tr>{_cells(cells)}<td colspan="7" class="none">{safe(state)}</td></tr>'
    judged = numbers.expected
    seen = f"{numbers.expected_met} of {judged}" if judged else _tick(numbers.seen)
    cells += [
        f"{numbers.particles:,}",
        f"{numbers.max_penetration_dx:.2f}",
        _small(numbers.momentum_residual),
        _small(numbers.mechanical_growth),
        f"{numbers.seconds:.0f} s",
        _tick(numbers.clean, "; ".join(numbers.breaches)),
        seen,
    ]
    return f"<tr>{_cells(cells)}</tr>"


def _cells(cells: Sequence[str]) -> str:
    return "".join(f"<td>{c}</td>" for c in cells)


def _state(scene: SceneRecord) -> str:
    row = scene.ran or scene.assembled
    verb = "run" if scene.ran else "assemble"
    return "not begun" if row is None else f"{verb}: {row.status}"


def _tick(good: bool, why: str = "") -> str:
    mark, style = ("✓", "yes") if good else ("✗", "no")
    return f'<span class="{style}" title="{safe(why)}">{mark}</span>'


def _thumbnail(scene: SceneRecord) -> str:
    if scene.picture is None:
        return ""
    with Image.open(scene.picture) as picture:
        small = picture.convert("RGB")
        small.thumbnail((THUMB, THUMB), Image.Resampling.LANCZOS)
    out = io.BytesIO()
    small.save(out, "JPEG", quality=78, optimize=True)
    style = "" if scene.numbers else ' class="still"'
    return f'<img{style} src="{held(out.getvalue(), "image/jpeg")}" alt="{safe(scene.name)}">'


def _failures(corpus: Collected) -> str:
    lines = [f"<li><b>{safe(s.name)}</b> {safe(s.error)}</li>" for s in _failed(corpus)]
    measured = [(s.name, s.numbers) for s in corpus.run if s.numbers]
    unseen = [name for name, numbers in measured if not numbers.seen]
    text = f"<ul>{''.join(lines)}</ul>" if lines else '<p class="good">No scene failed.</p>'
    if unseen:
        text += f"<p>What was meant to happen did not, in: {safe(', '.join(unseen))}.</p>"
    breaches = [
        f"<li><b>{safe(name)}</b> {safe(' '.join(numbers.breaches))}</li>"
        for name, numbers in measured
        if numbers.breaches
    ]
    if not breaches:
        return text
    return f"{text}<p>Bounds that the audits found exceeded:</p><ul>{''.join(breaches)}</ul>"


# ---------------------------------------------------------------- at the end


def _credits(corpus: Collected) -> str:
    used = credits(corpus.scenes)
    if not used:
        return "<p>The corporeal authors, Apache-2.0.</p>"
    heads = "<tr><th>class</th><th>model</th><th>scenes</th><th>licence</th><th>by</th></tr>"
    lines = "".join(
        f"<tr><td>{safe(u.asset.class_name)}</td><td>{safe(u.asset.asset)}</td>"
        f"<td>{u.scenes}</td><td>{safe(u.asset.licence)}</td>"
        f"<td>{safe(u.asset.attribution or u.asset.source)}</td></tr>"
        for u in used
    )
    return f'<div class="wide"><table>{heads}{lines}</table></div>'


def _settings(corpus: Collected) -> str:
    settings = corpus.run[0].settings if corpus.run else None
    if settings is None:
        return ""
    peak = max(s.numbers.peak_memory_mb for s in corpus.run if s.numbers)
    return (
        f"detail {safe(settings.fill.detail)}, engine {safe(settings.simulate.engine)}, "
        f"contact {safe(settings.simulate.contact)}, answers by {safe(settings.describe.vlm)}. "
        f"Largest memory of a process {peak:,.0f} MB."
    )


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole}"


def _small(value: float) -> str:
    """Write a relative error: 0 for what is nothing, two digits otherwise."""
    return "0" if value < 1e-12 else f"{value:.1e}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"
