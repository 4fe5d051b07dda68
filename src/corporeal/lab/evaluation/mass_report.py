"""Comparison of masses as tables and a figure."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from corporeal.core.errors import UserError
from corporeal.lab.evaluation.figure_files import save_figure
from corporeal.lab.evaluation.mass_evaluation import MassComparison, MassPrediction
from corporeal.lab.evaluation.result_table import ResultTable

METHOD_COLOURS = ("#1f6f8b", "#c8553d", "#588157", "#7b5ea7", "#b08900", "#555555")
INK_COLOUR = "#222222"


def mass_tables(result: MassComparison) -> list[ResultTable]:
    """Return what a person wants to read of ``compare``'s result."""
    evidence = [_with_evidence(result)] if any(r.direct for r in result.rows) else []
    return [_masses(result), *evidence, *(_errors(result, group) for group in result.metrics)]


def _masses(result: MassComparison) -> ResultTable:
    """Every object's predicted mass beside the measured one."""
    heads = ("object", "filled", "measured [kg]", "predicted", "from", "to", "taken for")
    rows = [
        (r.object, r.fill, _kg(r.mass_true), _kg(r.mass), _kg(r.low), _kg(r.high), r.described) for r in result.rows
    ]
    return ResultTable("Masses", heads, rows)


def _with_evidence(result: MassComparison) -> ResultTable:
    """Every object's mass with and without an estimate made without the library."""
    heads = ("object", "predicted [kg]", "without evidence", "from", "to", "asked directly")
    rows = [
        (r.object, _kg(r.mass), _kg(r.mixture), _kg(r.mixture_low), _kg(r.mixture_high), _kg(r.direct))
        for r in result.rows
    ]
    return ResultTable("With and without outside evidence", heads, rows)


def _errors(result: MassComparison, group: str) -> ResultTable:
    """Errors of all methods on one group of objects."""
    heads = ("method", "objects", "ADE [kg]", "ALDE", "APE", "MnRE", "within 2×")
    lines = [
        (
            result.methods[method],
            str(e.count),
            f"{e.ade:.3f}",
            f"{e.alde:.3f}",
            f"{e.ape:.3f}",
            f"{e.mnre:.3f}",
            f"{e.within_2:.0%}",
        )
        for method, e in result.metrics[group].items()
    ]
    inside = (
        f"{result.coverage[group]:.0%} of the measured masses lie in their intervals, whose "
        f"median width is a factor {result.width[group]:.2f} (without outside evidence "
        f"{result.coverage_without[group]:.0%}, {result.width_without[group]:.2f})"
    )
    return ResultTable(f"Errors, {group}: {inside}", heads, lines)


def _kg(mass: float | None) -> str:
    return "–" if mass is None else f"{mass:.3g}"


def mass_figure(rows: Sequence[MassPrediction], path: Path) -> None:
    """Draw each object with its interval, the line of truth, and a factor of two on either side.

    Raises:
        UserError: No object's mass is known.
    """
    known = [r for r in rows if r.mass_true is not None]
    if not known:
        raise UserError("There is nothing to plot: no measured masses. Give --truth FILE.")
    figure = Figure(figsize=(7.2, 6.4), dpi=150, layout="constrained")
    axes = figure.add_subplot()
    every = [v for r in known for v in (r.mass_true or 0.0, r.low, r.high, r.mass)]
    ends = np.array([min(v for v in every if v > 0) / 2, max(every) * 2])
    axes.plot(ends, ends, color=INK_COLOUR, lw=1)
    axes.fill_between(ends, ends / 2, ends * 2, color=INK_COLOUR, alpha=0.07, lw=0, label="factor of 2")
    for k, fill in enumerate(sorted({r.fill for r in known})):
        colour = METHOD_COLOURS[k % len(METHOD_COLOURS)]
        own = [r for r in known if r.fill == fill]
        true, mass, low, high = (
            np.array([getattr(r, name) for r in own]) for name in ("mass_true", "mass", "low", "high")
        )
        reach = [np.maximum(mass - low, 0), np.maximum(high - mass, 0)]
        axes.errorbar(true, mass, reach, fmt="o", ms=5, lw=1, color=colour, label=fill)
    for row in known:
        axes.annotate(
            row.object, (row.mass_true, row.mass), (4, 4), textcoords="offset points",
            fontsize=6, color=INK_COLOUR,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.set_xlabel("measured mass [kg]")
    axes.set_ylabel("predicted mass, with the interval of 90 % of the samples [kg]")
    axes.set_aspect("equal")
    axes.legend(frameon=False, loc="upper left")
    save_figure(figure, path)
