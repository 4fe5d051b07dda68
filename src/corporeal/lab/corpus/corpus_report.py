"""Report of a corpus: a self-contained page, with data as CSV and JSON."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from corporeal.core import store
from corporeal.core.progress import Progress, no_progress
from corporeal.lab.corpus.collect_results import MIN_WIND_MOTION_M, CorpusResults, SceneRecord, collect_results
from corporeal.lab.corpus.corpus_breakdown import (
    BreakdownLine,
    asset_credits,
    breakdowns,
    corpus_as_data,
    scene_materials,
    scene_rows,
    total_line,
)
from corporeal.lab.corpus.corpus_figures import corpus_figures
from corporeal.render.html_page import data_url, escape_html, fill_page, html_figure
from corporeal.simulation.audit_messages import ALLOWED_BREACHES

REPORT_PAGE_FILE, REPORT_TABLE_FILE, REPORT_DATA_FILE = "report.html", "report.csv", "report.json"
THUMBNAIL_WIDTH_PX = 840
"""Width of a video's row of frames on the page [px]."""
BREAKDOWN_COLUMNS = (
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


def report_corpus(folder: Path, progress: Progress = no_progress) -> list[Path]:
    """Write the report beside the scenes; return the files.

    Raises:
        UserError: The folder is no corpus, or the disk refuses it.
    """
    progress(0.0, "reading the runs")
    corpus = collect_results(folder)
    progress(0.3, "drawing")
    text = render_corpus_page(corpus)
    progress(0.9, "writing")
    written = [folder / name for name in (REPORT_PAGE_FILE, REPORT_TABLE_FILE, REPORT_DATA_FILE)]
    store.write_bytes(written[0], text.encode())
    store.write_bytes(written[1], _csv(scene_rows(corpus)).encode())
    store.write_json(written[2], corpus_as_data(corpus))
    return written


def render_corpus_page(corpus: CorpusResults) -> str:
    """Return the page as HTML."""
    figures = [html_figure(c, data_url(svg, "image/svg+xml")) for c, svg in corpus_figures(corpus).items()]
    return fill_page(
        "corporeal.lab.corpus",
        "corpus_report.html",
        title=escape_html(corpus.name),
        summary=_summary(corpus),
        tiles=_tiles(corpus),
        messages="".join(f'<p class="warn">{escape_html(m)}</p>' for m in corpus.plan.messages),
        composition=figures[0],
        results="".join(figures[1:]) or '<p class="none">Nothing was run yet.</p>',
        breakdowns=_breakdowns(corpus),
        failures=_failures(corpus),
        scenes="".join(_scene(s) for s in corpus.scenes),
        **{f"most_{name}": f"{limit:g}" for name, limit in ALLOWED_BREACHES.items()},
        sway=f"{MIN_WIND_MOTION_M * 1e3:g}",
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


def _summary(corpus: CorpusResults) -> str:
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


def _tiles(corpus: CorpusResults) -> str:
    whole = total_line(corpus)
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


def _assembled(corpus: CorpusResults) -> list[SceneRecord]:
    return [s for s in corpus.scenes if s.made]


def _failed(corpus: CorpusResults) -> list[SceneRecord]:
    return [s for s in corpus.scenes if s.error]


def _breakdowns(corpus: CorpusResults) -> str:
    whole = total_line(corpus)
    if whole is None:
        return '<p class="none">Nothing was run yet.</p>'
    names = {
        "interaction": "Interaction",
        "objects": "Number of objects",
        "material class": "Material class",
        "law": "Constitutive law, as simulated",
    }
    heads = "".join(f"<th>{h}</th>" for h in BREAKDOWN_COLUMNS)
    return "".join(
        f'<h3>{names[key]}</h3><div class="wide"><table class="numbers">'
        f"<tr><th></th>{heads}</tr>{''.join(map(_line, lines))}{_line(whole, 'all')}</table></div>"
        for key, lines in breakdowns(corpus).items()
    )


def _line(line: BreakdownLine, style: str = "") -> str:
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
        f"<small>{escape_html(', '.join(line.materials))}</small>",
    )
    return f'<tr class="{style}"><td>{escape_html(line.group)}</td>' + "".join(f"<td>{c}</td>" for c in cells) + "</tr>"


def _scene(scene: SceneRecord) -> str:
    planned, numbers = scene.planned, scene.numbers
    made = scene.composition
    words = "" if made is None else escape_html(made.what_happens)
    stands = planned.arrangement if made is None else made.arrangement
    objects, matter = ", ".join(planned.classes), ", ".join(scene_materials(scene))
    cells = [
        _thumbnail(scene),
        f"<b>{escape_html(scene.name)}</b><br><small>{escape_html(stands)}. {words}</small>",
        f"{escape_html(objects)}<br><small>{escape_html(matter)}</small>",
    ]
    if numbers is None:
        state = scene.error or _state(scene)
        return f'<tr>{_cells(cells)}<td colspan="7" class="none">{escape_html(state)}</td></tr>'
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
    return f'<span class="{style}" title="{escape_html(why)}">{mark}</span>'


def _thumbnail(scene: SceneRecord) -> str:
    if scene.picture is None:
        return ""
    with Image.open(scene.picture) as picture:
        small = picture.convert("RGB")
        small.thumbnail((THUMBNAIL_WIDTH_PX, THUMBNAIL_WIDTH_PX), Image.Resampling.LANCZOS)
    out = io.BytesIO()
    small.save(out, "JPEG", quality=78, optimize=True)
    style = "" if scene.numbers else ' class="still"'
    return f'<img{style} src="{data_url(out.getvalue(), "image/jpeg")}" alt="{escape_html(scene.name)}">'


def _failures(corpus: CorpusResults) -> str:
    lines = [f"<li><b>{escape_html(s.name)}</b> {escape_html(s.error)}</li>" for s in _failed(corpus)]
    measured = [(s.name, s.numbers) for s in corpus.run if s.numbers]
    unseen = [name for name, numbers in measured if not numbers.seen]
    text = f"<ul>{''.join(lines)}</ul>" if lines else '<p class="good">No scene failed.</p>'
    if unseen:
        text += f"<p>What was meant to happen did not, in: {escape_html(', '.join(unseen))}.</p>"
    breaches = [
        f"<li><b>{escape_html(name)}</b> {escape_html(' '.join(numbers.breaches))}</li>"
        for name, numbers in measured
        if numbers.breaches
    ]
    if not breaches:
        return text
    return f"{text}<p>Bounds that the audits found exceeded:</p><ul>{''.join(breaches)}</ul>"


def _credits(corpus: CorpusResults) -> str:
    used = asset_credits(corpus.scenes)
    if not used:
        return "<p>The corporeal authors, Apache-2.0.</p>"
    heads = "<tr><th>class</th><th>model</th><th>scenes</th><th>licence</th><th>by</th></tr>"
    lines = "".join(
        f"<tr><td>{escape_html(u.asset.class_name)}</td><td>{escape_html(u.asset.asset)}</td>"
        f"<td>{u.scenes}</td><td>{escape_html(u.asset.licence)}</td>"
        f"<td>{escape_html(u.asset.attribution or u.asset.source)}</td></tr>"
        for u in used
    )
    return f'<div class="wide"><table>{heads}{lines}</table></div>'


def _settings(corpus: CorpusResults) -> str:
    settings = corpus.run[0].settings if corpus.run else None
    if settings is None:
        return ""
    peak = max(s.numbers.peak_memory_mb for s in corpus.run if s.numbers)
    return (
        f"detail {escape_html(settings.fill.detail)}, engine {escape_html(settings.simulate.engine)}, "
        f"contact {escape_html(settings.simulate.contact)}, answers by {escape_html(settings.describe.vlm)}. "
        f"Largest memory of a process {peak:,.0f} MB."
    )


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole}"


def _small(value: float) -> str:
    """Write a relative error: 0 for what is nothing, two digits otherwise."""
    return "0" if value < 1e-12 else f"{value:.1e}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"
