"""Figure of an evaluation of dynamics: expectations met and path errors, by scene."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from corporeal.lab.evaluation.dynamics.dynamics_folders import OURS_NAME
from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary
from corporeal.lab.evaluation.dynamics.method_ranking import MethodResult
from corporeal.lab.evaluation.figure_files import save_figure
from corporeal.lab.evaluation.mass_report import INK_COLOUR, METHOD_COLOURS

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
        marked = [
            (x, _met_fraction(r) + 0.025)
            for x, r in zip(at, rows, strict=True)
            if r.numbers and not r.clean
        ]
        above.plot(*np.array(marked or np.zeros((0, 2))).T, "x", color=INK_COLOUR, ms=5)
    above.set_ylabel("expectations met (×: audit not clean)")
    above.set_ylim(0, 1.05)
    above.legend(
        frameon=False, ncols=len(found.methods), loc="lower center", bbox_to_anchor=(0.5, 1)
    )
    below.set_ylabel(f"path off ours at {found.reference}\n[diagonals], log")
    if any(row.against for row in found.rows):
        below.set_yscale("log")
    else:
        below.set_yticks([])
        below.text(
            0.5, 0.5, "no reference yet", transform=below.transAxes, ha="center", color=INK_COLOUR
        )
    below.set_xlim(-0.5, max(len(scenes), 1) - 0.5)
    below.set_xticks(range(len(scenes)), scenes, rotation=20, ha="right")
    save_figure(figure, path)


def _met_fraction(row: MethodResult) -> float:
    count = len(row.numbers.expectations) if row.numbers else 0
    return row.met / count if count else float("nan")
