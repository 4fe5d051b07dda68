"""Write docs/reference/solver-validation.md and its plots from what the cases found."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

from laws.convergence import Plot
from laws.outcome import Check, Outcome

mpl.use("Agg")
from matplotlib import pyplot as plt  # the backend comes first

MISSED = {
    "12b": "The reference depends on where the face lies on the grid: one field on this grid sinks "
    "by 5.25 mm with the face on a grid plane and by 5.82 mm off it, and tends to 5.6 mm with 12 "
    "and 16 cells across the foam. That is 1 % more than ours and 4 % less than the reference."
}
"""Why a target is missed where it is."""


def number(value: float, digits: int = 4) -> str:
    """Write some digits, or a power of ten for what is tiny."""
    return f"{value:.1e}" if 0 < abs(value) < 1e-3 else f"{value:.{digits}g}"


def line(outcome: Outcome, check: Check, first: bool) -> str:
    """Write one line of the table."""
    cells = (
        f"**{outcome.case}**" if first else "",
        outcome.title if first else "",
        check.quantity,
        number(check.reference),
        number(check.value),
        f"{number(check.error, 2)} {check.unit}".strip(),
        f"{number(check.target, 3)} {check.unit}".strip(),
        "—" if check.control is None else number(check.control),
        "met" if check.met else "**missed**",
    )
    return "| " + " | ".join(cells) + " |"


def table(found: Sequence[Outcome]) -> list[str]:
    """Write the table, all checks."""
    lines = [
        "| case | law | quantity | reference | our value | error | target | one field | |",
        "|---|---|---|---:|---:|---:|---:|---:|---|",
    ]
    for outcome in found:
        lines += [line(outcome, check, k == 0) for k, check in enumerate(outcome.checks)]
    return lines


def settings(found: Sequence[Outcome]) -> list[str]:
    """Say how each case was set up."""
    return [f"- **{o.case}** {o.title}: {o.setting}." for o in found]


def misses(found: Sequence[Outcome]) -> list[str]:
    """Write a sentence for each target that is missed."""
    missed = [o for o in found if not o.met]
    if not missed:
        return ["None."]
    return [
        f"- **{o.case}** {c.quantity}: {number(c.value)} instead of {number(c.reference)}. "
        f"{MISSED.get(o.case, '')}".rstrip()
        for o in missed
        for c in o.checks
        if not c.met
    ]


def draw(plot: Plot, errors: Sequence[Sequence[float]], path: Path) -> None:
    """Draw one convergence plot, both axes logarithmic."""
    figure, axes = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
    for series, values, mark in zip(plot.series, errors, "osD^v", strict=False):
        axes.loglog(series.cells, values, marker=mark, label=series.name)
    cells = sorted({n for s in plot.series for n in s.cells})
    top = max(max(v) for v in errors)
    for order, style in ((1, ":"), (2, "--")):
        guide = [top * (cells[0] / n) ** order for n in cells]
        axes.loglog(cells, guide, style, color="0.6", lw=1, label=f"order {order}")
    if plot.target is not None:
        axes.axhline(plot.target, color="tab:red", lw=1, label=f"target {plot.target:g} %")
    axes.set_xticks(cells, [str(n) for n in cells], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_xlabel(plot.along)
    axes.set_ylabel(plot.error)
    axes.set_title(f"Case {plot.case}: {plot.title}", fontsize=11)
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write(
    docs: Path,
    found: Sequence[Outcome],
    plots: Sequence[tuple[Plot, Sequence[Sequence[float]]]],
    tally: tuple[int, int],
) -> None:
    """Write the page and its pictures.

    Args:
        docs: The folder of the documentation.
        found: All cases, in order.
        plots: Each with the errors [%] of its series.
        tally: How many targets were met, of how many.

    """
    images = docs / "images"
    images.mkdir(parents=True, exist_ok=True)
    pictures = []
    for plot, errors in plots:
        name = f"validation-{plot.case}.png"
        draw(plot, errors, images / name)
        pictures += [f"![Error over cells: {plot.title}](../images/{name})", "", plot.words, ""]
    met, total = tally
    text = [
        "# Solver validation",
        "",
        "Written by `python benchmarks/validation.py --docs`; every number below comes from that "
        "run of the production engine (the exact rows also from its double-precision twin). "
        "`--quick` takes under a minute on two cores, `--case 7 9` runs only what is named, and "
        "`--json FILE` keeps the rows.",
        "",
        f"**{met} of {total} targets are met** (12 counts once, for 12a and 12b).",
        "",
        "Errors are distances from the reference in the unit of the target. *One field* is the "
        "same experiment with one velocity field for all bodies, as most material point codes have "
        "it: where bodies must slide or part it has to fail.",
        "",
        *table(found),
        "",
        "## Targets missed",
        "",
        *misses(found),
        "",
        "## Convergence",
        "",
        *pictures,
        "## Settings",
        "",
        *settings(found),
        "",
    ]
    (docs / "reference" / "solver-validation.md").write_text("\n".join(text))
