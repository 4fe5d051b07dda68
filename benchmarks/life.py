"""Drop real things and hold their rebound to what was published.

    python benchmarks/life.py [--quick] [--row NAME ...] [--json FILE [--resume]] [--docs]

Every thing goes through the verbs as a scene of a person would: names or materials, walls, the air
in balls, one word of detail; nothing else can be set. ``--quick`` drops each once, at draft;
``--docs`` writes docs/reference/restitution-validation.md. Every drop is written to FILE as it
ends; ``--resume`` goes on from what is there, which holds as long as the code is the same. Ranges
and sources: src/corporeal/lab/evaluation/life.toml.
"""

import argparse
import json
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import mean

from rich.console import Console
from rich.progress import track
from rich.table import Table

from corporeal.core.errors import BadFileError, SimulationError
from corporeal.core.process_resources import usable_cores
from corporeal.lab.evaluation.drop_test import DropResult, simulate_drop
from corporeal.lab.evaluation.rebound_data import (
    MeasuredRebound,
    measured_rebounds,
    rebound_sources,
)
from corporeal.pipeline.run_pipeline import Settings
from corporeal.recognition.lexicon import head_terms, name_tokens

DOCS = Path(__file__).parents[1] / "docs" / "reference"
DETAILS, SEEDS = ("draft", "normal"), (0, 1, 2)
LEEWAY = 0.03
"""How far from the published range still counts as inside [-]."""
FARTHEST, APART = 0.1, 0.05
"""No thing may be farther from its range, and draft from normal [-]."""
INSIDE = 0.85
"""Least share of rows inside."""
AT_FIRST = 20
"""So many of the blind rows were in their range ± ``LEEWAY`` when they were tried first, at draft."""
UNBOOKED = 0.08
"""Most that may be lost unbooked at draft, over the energy of the impact [-]."""


def tried(row: MeasuredRebound, detail: str, seed: int) -> DropResult | str:
    """Drop one thing; say in a sentence what went wrong."""
    usual = Settings()
    settings = replace(usual, fill=replace(usual.fill, detail=detail, seed=seed))
    try:
        return simulate_drop(row, settings)
    except SimulationError as error:
        return f"{row.name}, {detail}, seed {seed}: {error}"


# ---------------------------------------------------------------- results


@dataclass(frozen=True)
class Result:
    """One thing at one detail: the mean over its seeds."""

    row: MeasuredRebound
    detail: str
    drops: tuple[DropResult, ...]

    @property
    def restitution(self) -> float:
        """Mean over the seeds [-]."""
        return mean(d.restitution for d in self.drops)

    @property
    def off(self) -> float:
        """Distance from the published range [-]."""
        return self.row.off(self.restitution)

    @property
    def unbooked(self) -> float:
        """Mean over the seeds [-]."""
        return mean(d.unbooked for d in self.drops)


def results(rows: Sequence[MeasuredRebound], drops: Iterable[DropResult]) -> Iterator[Result]:
    """Gather drops by thing and detail."""
    every = list(drops)
    for row in rows:
        for detail in DETAILS:
            own = tuple(d for d in every if (d.name, d.detail) == (row.name, detail))
            if own:
                yield Result(row, detail, own)


def apart(found: Sequence[Result]) -> dict[str, float]:
    """Name of each thing dropped at both details → how far they are apart [-]."""
    at = {(r.row.name, r.detail): r.restitution for r in found}
    names = [n for n, d in at if d == "draft" and (n, "normal") in at]
    return {n: abs(at[n, "draft"] - at[n, "normal"]) for n in names}


def verdicts(found: Sequence[Result], wrong: Sequence[str]) -> list[tuple[str, bool]]:
    """State every target with what was found, and whether it is met."""
    inside = sum(r.off <= LEEWAY for r in found)
    far = [f"{r.row.name} ({r.detail}, {r.off:.2f})" for r in found if r.off > FARTHEST]
    split = [f"{n} ({d:.2f})" for n, d in apart(found).items() if d > APART]
    leaky = [f"{r.row.name} ({r.unbooked:.0%})" for r in found if r.detail == "draft" and r.unbooked > UNBOOKED]
    return [
        (
            f"at least {INSIDE:.0%} of rows in their range ± {LEEWAY}: {inside} of {len(found)}",
            inside >= INSIDE * len(found),
        ),
        (f"none farther off than {FARTHEST}: {_list(far)}", not far),
        (f"draft within {APART} of normal: {_list(split)}", not split),
        (f"less than {UNBOOKED:.0%} lost unbooked at draft: {_list(leaky)}", not leaky),
        (f"every drop ends: {_list(wrong)}", not wrong),
    ]


def _list(names: Sequence[str]) -> str:
    return ("not " + ", ".join(names)) if names else "all"


HEADS = ("object", "detail", "published", "e", "spread", "off", "touches [ms]", "as", "E", "unbooked")


def cells(result: Result) -> tuple[str, ...]:
    """One row of the table, as text."""
    row, one = result.row, result.drops[0]
    values = [d.restitution for d in result.drops]
    return (
        row.name,
        result.detail,
        f"{row.low:.2f}–{row.high:.2f}",
        f"{result.restitution:.3f}",
        f"{max(values) - min(values):.3f}",
        "" if result.off == 0 else f"{result.off:.3f}",
        f"{1e3 * mean(d.contact for d in result.drops):.2g}" if one.treatment != "rigid" else "",
        one.treatment,
        "" if one.treatment == "rigid" else f"{one.young_ratio:.2g}",
        "" if one.treatment == "rigid" else f"{result.unbooked:.0%}",
    )


def show(found: Sequence[Result], met: Sequence[tuple[str, bool]]) -> None:
    """Print the table and what is met."""
    table = Table(title="Restitution validation")
    for name in HEADS:
        table.add_column(name, justify="left" if name in ("object", "detail", "as") else "right")
    for result in found:
        table.add_row(*cells(result), style=None if result.off <= LEEWAY else "red")
    console = Console()
    console.print(table)
    for sentence, good in met:
        console.print(f"{'met' if good else 'MISSED'}: {sentence}", highlight=False)


INTRODUCTION = f"""\
Written by `python benchmarks/life.py --docs`: real objects, dropped through the usual stages with
nothing set but the detail, {len(SEEDS)} seeds each. *e* is the speed after over the speed before,
*spread* how far the seeds are apart, *off* the distance from the published range, *E* the simulated
over the real modulus (of a thickened wall much less), *unbooked* what the impact lost to transfers
between particles and grid, beyond all booked losses. Rigid objects rebound by the
coefficient of restitution that was measured of the pair, else by those of their materials. Where a
height was published, the range is of speeds at the floor: the drag of a sphere in air is taken off
on both ways. Ranges and sources: `src/corporeal/lab/evaluation/life.toml`."""


def blind(found: Sequence[Result]) -> str:
    """Say how what was written down before it was tried came out, at first and now."""
    rows = [r for r in found if r.row.blind and r.detail == "draft"]
    names = ", ".join(r.row.name for r in rows)
    inside = sum(r.off <= LEEWAY for r in rows)
    return (
        f"{len(rows)} of the objects were written down before they were tried ({names}): "
        f"{AT_FIRST} were in their range ± {LEEWAY} at draft at the first try, "
        f"{inside} are now."
    )


def told(name: str) -> bool:
    """Tell whether a name gives the restitution that the rules of a sport ask for."""
    terms = [term for term in head_terms(name_tokens(name)) if term.kind == "thing"]
    return max(terms, key=lambda term: len(term.phrase)).rebound is not None if terms else False


def foretold(found: Sequence[Result]) -> str:
    """Say how many rows are in their range that are not there because a rule was read for both."""
    rows = [r for r in found if not told(r.row.name)]
    inside = sum(r.off <= LEEWAY for r in rows)
    names = ", ".join(dict.fromkeys(r.row.name for r in found if told(r.row.name)))
    return (
        f"The names of some balls ({names}) imply the rebound that the rules of their sport ask "
        f"for, and their rows test that it comes out. Of the {len(rows)} other rows {inside} are "
        f"in their range ± {LEEWAY}."
    )


def contradictory_rebounds(rows: Sequence[MeasuredRebound], leeway: float) -> Iterator[tuple[MeasuredRebound, ...]]:
    """Yield the rows of each scene that no value can meet, each within a leeway [-].

    Raises:
        BadFileError: Rows of one scene are not the same thing on the same.

    """
    for scene in dict.fromkeys(row.scene for row in rows if row.scene):
        alike = tuple(row for row in rows if row.scene == scene)
        if len({(r.material, r.wall, r.diameter, r.speed, r.floor, r.on) for r in alike}) > 1:
            raise BadFileError("life.toml", f"{scene}: its rows differ.", "Mend the rows.")
        if max(r.low for r in alike) - leeway > min(r.high for r in alike) + leeway:
            yield alike


def contradicted(found: Sequence[Result]) -> Iterator[str]:
    """Say which rows measured the same and contradict each other: no value is in all of them."""
    for rows in contradictory_rebounds(tuple(dict.fromkeys(r.row for r in found)), LEEWAY):
        low, high = max(r.low for r in rows), min(r.high for r in rows)
        names = ", ".join(f"{r.name} {r.low:.2f}–{r.high:.2f}" for r in rows)
        yield (
            f"These measured the same and contradict each other: {names}. No value is within "
            f"{LEEWAY} of all; {0.5 * (low + high):.3f} would be off by {0.5 * (low - high):.3f}. "
            "They are counted as all others are "
            "([contact decision](../decisions/contact-rigid-faces.md))."
        )


def page(found: Sequence[Result], met: Sequence[tuple[str, bool]]) -> str:
    """Write the page of the documentation."""
    cited = rebound_sources()
    used = dict.fromkeys(r.row.source for r in found)
    number = {key: k + 1 for k, key in enumerate(used)}
    lines = [
        "# Restitution validation",
        "",
        INTRODUCTION,
        "",
        *(f"- {'met' if good else '**missed**'}: {sentence}" for sentence, good in met),
        "",
        foretold(found),
        "",
        *(line for said in contradicted(found) for line in (said, "")),
        *((blind(found), "") if any(r.row.blind for r in found) else ()),
        "| " + " | ".join((*HEADS, "source")) + " |",
        "|---|---|" + "---:|" * 5 + "---|---:|---:|---:|",
        *(
            "| " + " | ".join((*cells(r), str(number[r.row.source]))) + " |"
            for r in found
        ),
        "",
        "Sources:",
        "",
        *(f"{k}. {cited[key]}" for key, k in number.items()),
        "",
    ]  # fmt: skip
    return "\n".join(lines)


def keep(drops: Sequence[DropResult], path: Path) -> None:
    """Write drops to a file."""
    path.write_text(json.dumps([asdict(d) for d in drops], indent=1) + "\n", encoding="utf-8")


def kept(path: Path) -> list[DropResult]:
    """Read drops from a file; none where there is no file."""
    return [DropResult(**row) for row in json.loads(path.read_text())] if path.exists() else []


def asked_for() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one seed, draft only")
    parser.add_argument("--json", type=Path, help="write every drop to this file")
    parser.add_argument("--resume", action="store_true", help="keep the drops that it holds")
    parser.add_argument("--row", nargs="+", metavar="NAME", help="only these things")
    parser.add_argument("--docs", action="store_true", help="write the page of results")
    parser.add_argument("--workers", type=int, default=min(4, usable_cores()), help="drops side by side")
    asked = parser.parse_args()
    if asked.docs and (asked.quick or asked.row):
        parser.error("--docs needs all of it: leave out --quick and --row")
    if asked.resume and not asked.json:
        parser.error("--resume needs --json: the file to go on from")
    return asked


def main() -> None:
    """Run what was asked."""
    asked = asked_for()
    rows = [r for r in measured_rebounds() if not asked.row or r.name in asked.row]
    details, seeds = (DETAILS[:1], SEEDS[:1]) if asked.quick else (DETAILS, SEEDS)
    drops = kept(asked.json) if asked.resume else []
    there = {(d.name, d.detail, d.seed) for d in drops}
    jobs = [(r, d, s) for r in rows for d in details for s in seeds if (r.name, d, s) not in there]
    wrong = []
    with ProcessPoolExecutor(asked.workers) as pool:
        made = pool.map(tried, *zip(*jobs, strict=True)) if jobs else ()
        for one in track(made, "dropping", len(jobs)):
            if isinstance(one, str):
                wrong.append(one)
                continue
            drops.append(one)
            if asked.json:
                keep(drops, asked.json)
    found = list(results(rows, drops))
    met = verdicts(found, wrong)
    show(found, met)
    if asked.docs:
        (DOCS / "restitution-validation.md").write_text(page(found, met), encoding="utf-8")


if __name__ == "__main__":
    main()
