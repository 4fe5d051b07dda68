"""Spread of an ensemble as a table and a figure."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from corporeal.lab.evaluation.figure_files import save_figure
from corporeal.lab.evaluation.outcome_ensemble import SPREAD_QUANTITIES, Ensemble
from corporeal.render.glyphs import drawable_name

SPREAD_HEADS = ("object", "quantity", "as chosen", "5 %", "median", "95 %", "members")
NEGLIGIBLE_SPREAD = 1e-9
"""A spread below this is none."""
FIGURE_COLUMNS = 4
INK_COLOUR, MEMBER_COLOUR, CHOSEN_COLOUR = "#222222", "#9fb8c4", "#c8553d"


def spread_rows(result: Ensemble) -> list[tuple[str, ...]]:
    """Return one row per object and quantity that anything can be said of."""
    return [
        (
            name,
            SPREAD_QUANTITIES[quantity],
            *map(_number, (s.chosen, s.low, s.median, s.high)),
            str(s.count),
        )
        for name, own in result.spread.items()
        for quantity, s in own.items()
        if s.count
    ]


def failed_members(result: Ensemble) -> list[str]:
    """Return which members could not be simulated to the end."""
    return [
        f"Member {member.number} stopped: {member.error}"
        for member in result.members
        if member.error
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def spread_figure(result: Ensemble, path: Path) -> None:
    """Draw a panel per quantity: every member, the interval, and what was chosen."""
    shown = [q for q in SPREAD_QUANTITIES if _varies(result, q)]
    names = list(result.spread)
    lines = -(-max(len(shown), 1) // FIGURE_COLUMNS)
    size = (2.6 * FIGURE_COLUMNS, lines * (0.3 * len(names) + 0.9))
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    panels = figure.subplots(lines, FIGURE_COLUMNS, sharey=True, squeeze=False).ravel()
    for axes, quantity in zip(panels, shown, strict=False):
        for k, name in enumerate(names):
            _draw(axes, result, name, quantity, k)
        axes.set_xlabel(SPREAD_QUANTITIES[quantity], fontsize=8)
        axes.tick_params(labelsize=7)
        axes.margins(x=0.12)
    for axes in panels[len(shown) :]:
        axes.axis("off")
    called = [drawable_name(n.replace("_", " "), f"object {k + 1}") for k, n in enumerate(names)]
    panels[0].set_yticks(range(len(names)), called, fontsize=7)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    save_figure(figure, path)


def _varies(result: Ensemble, quantity: str) -> bool:
    found = [result.of(name, quantity) for name in result.spread]
    return any((s.largest or 0.0) - (s.smallest or 0.0) > NEGLIGIBLE_SPREAD for s in found)


def _draw(axes: Any, result: Ensemble, name: str, quantity: str, k: int) -> None:
    own = result.of(name, quantity)
    if not own.count:
        return
    values = [member.objects[name][quantity] for member in result.members if member.objects]
    values = [v for v in values if v is not None]
    axes.plot([own.low, own.high], [k, k], color=MEMBER_COLOUR, lw=7, solid_capstyle="butt")
    axes.plot(values, [k] * len(values), "o", color=INK_COLOUR, ms=2.5, alpha=0.6, mew=0)
    if own.chosen is not None:
        axes.plot([own.chosen], [k], "D", color=CHOSEN_COLOUR, ms=5, mew=0)
