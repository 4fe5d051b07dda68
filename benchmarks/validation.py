"""Hold the engine to nature: twenty-nine experiments with known answers.

    python benchmarks/validation.py [--quick] [--case N ...] [--json FILE] [--docs]

``--quick`` runs every case coarser or shorter where that is honest; ``--docs`` also runs the
resolutions of the plots and writes docs/reference/solver-validation.md and
docs/images/validation-*.png.
"""

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from laws import convergence, page
from laws.outcome import Outcome
from laws.suite import CASES
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from corporeal.core.process_resources import usable_cores

DOCS = Path(__file__).parents[1] / "docs"


def timed(number: str, quick: bool) -> Outcome:
    """Run one case and note its time."""
    start = time.perf_counter()
    found = CASES[number].run(quick)
    return replace(found, seconds=time.perf_counter() - start)


def outcomes(numbers: list[str], quick: bool, workers: int) -> Iterator[Outcome]:
    """Run cases side by side, the longest first, and give each when it is done."""
    longest_first = sorted(numbers, key=lambda n: -CASES[n].seconds[not quick])
    with ProcessPoolExecutor(workers) as pool:
        for done in as_completed([pool.submit(timed, n, quick) for n in longest_first]):
            yield done.result()


def run(numbers: list[str], quick: bool, workers: int) -> list[Outcome]:
    """Run cases and show how far they are."""
    found: dict[str, Outcome] = {}
    cost = {n: CASES[n].seconds[not quick] for n in numbers}
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=Console(stderr=True)) as bar:
        start = time.perf_counter()
        task = bar.add_task("validation", total=sum(cost.values()), left="")
        for outcome in outcomes(numbers, quick, workers):
            found[outcome.case] = outcome
            done = sum(cost[n] for n in found)
            left = (time.perf_counter() - start) * (sum(cost.values()) / done - 1)
            words = f"case {outcome.case:>3}: {'met' if outcome.met else 'missed'}"
            bar.update(task, completed=done, description=words, left=f"{left:.0f} s left")
    return [found[n] for n in numbers]


def show(found: list[Outcome]) -> None:
    """Print the table."""
    table = Table(title="Validation against nature")
    for name in ("case", "law", "quantity", "reference", "value", "error", "target", "control"):
        table.add_column(name, justify="left" if name in ("law", "quantity") else "right")
    for outcome in found:
        for k, check in enumerate(outcome.checks):
            mark = "" if check.met else "  MISSED"
            table.add_row(
                outcome.case if k == 0 else "",
                outcome.title if k == 0 else "",
                escape(check.quantity),
                f"{check.reference:.4g}",
                f"{check.value:.4g}",
                f"{check.error:.2g} {check.unit}{mark}",
                f"{check.target:.2g} {check.unit}",
                "" if check.control is None else f"{check.control:.3g}",
            )
    Console(width=160).print(table)
    met, total = tally(found)
    print(f"{met} of {total} targets met.")


def tally(found: list[Outcome]) -> tuple[int, int]:
    """Count targets: 12 is met when 12a and 12b are."""
    targets: dict[str, bool] = {}
    for outcome in found:
        number = outcome.case.rstrip("ab")
        targets[number] = targets.get(number, True) and outcome.met
    return sum(targets.values()), len(targets)


def converge(workers: int) -> list[tuple[convergence.Plot, list[list[float]]]]:
    """Run the resolutions of all plots, the finest first; their errors [%]."""
    errors = [[[0.0] * len(s.cells) for s in plot.series] for plot in convergence.PLOTS]
    points = [
        (p, s, k)
        for p, plot in enumerate(convergence.PLOTS)
        for s, series in enumerate(plot.series)
        for k in range(len(series.cells))
    ]
    points.sort(key=lambda point: -point[2])
    with ProcessPoolExecutor(workers) as pool, Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("convergence", total=len(points))
        waiting = {
            pool.submit(convergence.measured, p, s, convergence.PLOTS[p].series[s].cells[k]): (p, s, k)
            for p, s, k in points
        }
        for done in as_completed(waiting):
            p, s, k = waiting[done]
            errors[p][s][k] = done.result()
            bar.advance(task)
    return list(zip(convergence.PLOTS, errors, strict=True))


def main() -> None:
    """Run what was asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="coarser and shorter")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    parser.add_argument("--case", nargs="+", choices=list(CASES), metavar="N", help="only these")
    parser.add_argument("--docs", action="store_true", help="write the page and its plots")
    parser.add_argument("--workers", type=int, default=min(4, usable_cores()), help="cases that run side by side")
    asked = parser.parse_args()
    if asked.docs and (asked.quick or asked.case):
        parser.error("--docs needs the whole suite in full: leave out --quick and --case")
    found = run(asked.case or list(CASES), asked.quick, asked.workers)
    show(found)
    if asked.json:
        rows = [o.row() | {"quick": asked.quick} for o in found]
        asked.json.write_text(json.dumps(rows, indent=1, allow_nan=False) + "\n")
    if asked.docs:
        page.write(DOCS, found, converge(asked.workers), tally(found))


if __name__ == "__main__":
    main()
