"""Report of an evaluation of dynamics."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from corporeal.core import store
from corporeal.lab.evaluation.dynamics.compared_methods import METHOD_WORDS, OURS_NAME
from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary
from corporeal.lab.evaluation.dynamics.dynamics_tables import dynamics_tables, missing_references, ranking_sentences
from corporeal.lab.evaluation.dynamics.method_ranking import MethodResult
from corporeal.lab.evaluation.figure_files import save_figure
from corporeal.lab.evaluation.mass_report import INK_COLOUR, METHOD_COLOURS
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.render.html_page import data_url_of_file, escape_html, fill_page

BAR_WIDTH_FRACTION = 0.8
"""Share of a scene's room that its bars take."""


def draw_dynamics(found: DynamicsSummary, path: Path) -> None:
    """Draw bars per scene and method; a cross marks a run whose audit is not clean.

    Raises:
        UserError: The disk refuses the file.
    """
    scenes = list(dict.fromkeys(row.scene for row in found.rows if row.numbers))
    size = (max(7.0, 1.3 * len(scenes) + 2), 6.4)
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    width = BAR_WIDTH_FRACTION / len(found.methods)
    for k, method in enumerate(found.methods):
        rows = [found.row(scene, method) for scene in scenes]
        at = np.arange(len(scenes)) + (k - (len(found.methods) - 1) / 2) * width
        colour = INK_COLOUR if method == OURS_NAME else METHOD_COLOURS[k % len(METHOD_COLOURS)]
        above.bar(at, [_met_fraction(row) for row in rows], 0.9 * width, color=colour, label=method)
        off = [row.against.path if row.against else np.nan for row in rows]
        below.bar(at, off, 0.9 * width, color=colour)
        marked = [(x, _met_fraction(r) + 0.025) for x, r in zip(at, rows, strict=True) if r.numbers and not r.clean]
        above.plot(*np.array(marked or np.zeros((0, 2))).T, "x", color=INK_COLOUR, ms=5)
    above.set_ylabel("expectations met (×: audit not clean)")
    above.set_ylim(0, 1.05)
    above.legend(frameon=False, ncols=len(found.methods), loc="lower center", bbox_to_anchor=(0.5, 1))
    below.set_ylabel(f"path off ours at {found.reference}\n[diagonals], log")
    if any(row.against for row in found.rows):
        below.set_yscale("log")
    else:
        below.set_yticks([])
        below.text(0.5, 0.5, "no reference yet", transform=below.transAxes, ha="center", color=INK_COLOUR)
    below.set_xlim(-0.5, max(len(scenes), 1) - 0.5)
    below.set_xticks(range(len(scenes)), scenes, rotation=20, ha="right")
    save_figure(figure, path)


def _met_fraction(row: MethodResult) -> float:
    count = len(row.numbers.expectations) if row.numbers else 0
    return row.met / count if count else float("nan")


COLUMN_EXPLANATIONS = {
    "expected": "expectations of the showcase that are met; none is in a run that gained energy.",
    "path": (
        "distance of the centres of mass from the reference's until .2 s after an object's first "
        "new contact, root mean square over time, over its diagonal; mean over objects. =: no "
        "farther than ours at this detail, which is as near as this comparison can tell."
    ),
    "contacts": "pairs that touched in both runs over those that touched in either (Jaccard).",
    "Δt": "mean difference of the times of first contacts.",
    "parted": "share of pairs that parted again in both runs or in neither.",
    "shape": "median of |log10| of the ratio of largest shape errors.",
    "rebound": "mean difference of rebounds, as shares of the fall.",
    "audit": "whether every bound of the audit holds; else its first sentence.",
    "τ": (
        "Kendall's rank correlation over pairs within a scene: of the real E with how little what "
        "was touched deforms, and of restitution with rebound, real balls included."
    ),
    "mean distance": "of the restitution from its published range.",
}
RANKING_RULE = (
    "Columns are expectations, audit, path, contacts and separation; ours is first where no "
    "baseline that was run is better in more of them than it is worse. What is better than ours is "
    "named. Means are over the scenes that a method was run in: compare them only where these are "
    "as many."
)


def write_dynamics_page(found: DynamicsSummary, path: Path) -> None:
    """Write a page that holds all it shows.

    Raises:
        UserError: The disk refuses it.
    """
    with TemporaryDirectory() as folder:
        drawing = Path(folder) / "figure.png"
        draw_dynamics(found, drawing)
        figure = data_url_of_file(drawing)
    missing = "".join(f'<p class="warn">{escape_html(s)}</p>' for s in missing_references(found))
    text = fill_page(
        "corporeal.lab.evaluation.dynamics",
        "dynamics.html",
        summary=escape_html(summary_sentence(found)),
        rule=escape_html(RANKING_RULE),
        verdicts="".join(f"<li>{escape_html(s)}</li>" for s in ranking_sentences(found)),
        missing=missing,
        figure=figure,
        tables="".join(_html(t) for t in dynamics_tables(found) if t.rows),
        columns="".join(f"<dt>{escape_html(k)}</dt><dd>{escape_html(v)}</dd>" for k, v in COLUMN_EXPLANATIONS.items()),
        notes="".join(f"<li>{escape_html(s)}</li>" for s in borrowed_numbers(found)),
    )
    store.write_bytes(path, text.encode())


def summary_sentence(found: DynamicsSummary) -> str:
    """Return in a sentence what was compared."""
    run = [r for r in found.rows if r.numbers is not None]
    failed = sum(r.error.startswith("failed") for r in found.rows)
    scenes = len({r.scene for r in found.rows})
    said = "; ".join(f"{m}: {METHOD_WORDS[m]}" for m in found.methods)
    return (
        f"{len(run)} of {len(found.rows)} runs of {scenes} scenes at {found.detail} are done, "
        f"{failed} failed, against ours at {found.reference}. {said}.{_outdated_runs(found)}"
    )


def _outdated_runs(found: DynamicsSummary) -> str:
    """Return how many runs the present code has not made; a finished run is kept when it changes."""
    numbers = [r.numbers for r in (*found.rows, *found.references) if r.numbers is not None]
    older = sum(n.source != store.source_digest() for n in numbers)
    if not older:
        return ""
    which = f"{older} of {len(numbers)} runs, references included,"
    return f" {which} were made by an earlier state of the code."


def borrowed_numbers(found: DynamicsSummary) -> list[str]:
    """Return which numbers of which method are ours, each sentence once."""
    said = [f"{row.method}: {note}" for row in found.rows if row.numbers for note in row.numbers.notes]
    return list(dict.fromkeys(said)) or ["Nothing: no method has its own material values."]


def _html(table: ResultTable) -> str:
    heads = "".join(f"<th>{escape_html(h)}</th>" for h in table.heads)
    rows = "".join(f"<tr>{''.join(f'<td>{escape_html(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    return f'<h2>{escape_html(table.title)}</h2><div class="wide"><table><tr>{heads}</tr>{rows}</table></div>'
