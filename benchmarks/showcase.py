"""Simulate the showcase's scenes and say what was seen, what the audit found, how long it took.

    python benchmarks/showcase.py [SCENE ...] [--detail draft normal ...] [--no-run] [--json FILE]
                                  [--docs]

``--docs`` writes the tables into docs/reference/showcase.md; it needs all scenes at the first
detail. Runs that lie in ``--folder`` already are not repeated: remove it to measure again. They
lie there as ``corporeal evaluate dynamics showcase`` lays its own out, so that ``--folder
dynamics`` tells of those; with ``--no-run`` what was not run yet is left out.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import get_args

from rich.console import Console
from stories import Told, tell, told

from corporeal.core import store
from corporeal.core.audit_data import Audit
from corporeal.core.process_resources import usable_cores
from corporeal.discretization.discretization_plan import DetailLevel
from corporeal.lab.evaluation.dynamics.compared_methods import OURS_NAME, reference_folder, run_folder
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS, Settings
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.showcase.scene_expectations import SCENE_EXPECTATIONS
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS
from corporeal.simulation.audit_messages import breach_messages, passage_message

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "showcase.md"
BEGIN, END = "<!-- made by benchmarks/showcase.py -->", "<!-- end -->"


def faults(audit: Audit) -> list[str]:
    """Say which bounds of the audit are exceeded, and who passed through whom."""
    return [*breach_messages(audit), *(f"{passage_message(pair)}." for pair in audit.surfaces if pair.passed)]


def row(told: Told, detail: str) -> dict:
    """Give what was measured in one scene, as data."""
    audit = told.audit
    return {
        "scene": told.name,
        "detail": detail,
        "expectations": [asdict(e) for e in told.expectations()],
        "particles": audit.particles,
        "steps": audit.steps,
        "momentum_residual": audit.momentum_residual,
        "mechanical_growth": audit.mechanical_growth,
        "penetration_dx": audit.max_penetration_dx,
        "faults": faults(audit),
        "seconds": told.seconds,
    }


def seen_table(rows: list[dict], details: list[str]) -> str:
    """Tell what must be seen in every scene, and at which detail it was; –: it was not run."""
    heads = ("scene", "must show", "target", *details, "must fail")
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    found = {(r["scene"], r["detail"]): r["expectations"] for r in rows}
    for number, name in enumerate(SHOWCASE_SCENE_BUILDERS, 1):
        for k, demand in enumerate(SCENE_EXPECTATIONS[name]):
            mine = [found[name, d][k] if (name, d) in found else None for d in details]
            asked = next(e for e in mine if e is not None)
            scene = "" if k else f"{number} {name}"
            measured = map(measured_cell, mine)
            said = (scene, asked["sentence"], asked["target"], *measured, demand.spoiled_by)
            lines.append(f"| {' | '.join(said)} |")
    return "\n".join(lines)


def measured_cell(expectation: dict | None) -> str:
    """Write what was measured, and whether it is within its target."""
    if expectation is None:
        return "–"
    return f"{expectation['value']} {'✓' if expectation['met'] else '**missed**'}"


def cost_table(rows: list[dict]) -> str:
    """Tell what every scene cost and what its audit says."""
    heads = ("scene", "detail", "particles", "steps", "momentum astray", "mechanical energy gained")
    heads += ("deepest overlap [cells]", "audit", "simulated in [s]")
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    lines += [
        f"| {r['scene']} | {r['detail']} | {r['particles']:,} | {r['steps']:,} "
        f"| {r['momentum_residual']:.0e} | {r['mechanical_growth']:.0e} "
        f"| {r['penetration_dx']:.2f} "
        f"| {' '.join(r['faults']) or 'clean'} | {r['seconds']:.0f} |"
        for r in rows
    ]
    return "\n".join(lines)


def page(rows: list[dict], details: list[str]) -> None:
    """Put the tables between the marks in the page."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    tables = (
        f"Measured at detail {' and '.join(details)}, seed 0:\n\n{seen_table(rows, details)}\n\n"
        f"What it cost, on {usable_cores()} core{'s' if usable_cores() > 1 else ''}:\n\n{cost_table(rows)}\n"
    )
    PAGE.write_text(f"{before}{BEGIN}\n\n{tables}\n{END}{after}", encoding="utf-8")


def place(folder: Path, name: str, detail: DetailLevel) -> Path:
    """Return where a run lies: as an evaluation of dynamics lays out ours and its references."""
    if detail == "draft":
        return run_folder(folder, name, OURS_NAME)
    return reference_folder(folder, name, detail)


def measured(name: str, folder: Path, detail: DetailLevel, run: bool) -> dict | None:
    """Measure one scene; None: it was not run yet, and is not to be."""
    if run:
        return row(tell(name, folder, Settings(fill=FillConfig(detail=detail))), detail)
    done = (folder / STAGE_FOLDERS["simulate"] / store.META_FILE).exists()
    return row(told(name, folder), detail) if done else None


def measured_rows(asked: argparse.Namespace) -> Iterator[dict]:
    """Measure every scene at every detail, and print it."""
    console = Console()
    for detail in asked.detail:
        for name in asked.scene or SHOWCASE_SCENE_BUILDERS:
            found = measured(name, place(asked.folder, name, detail), detail, not asked.no_run)
            if found is not None:
                console.print_json(json.dumps(found), indent=None)
                yield found


def main() -> None:
    """Run what has not been run yet; print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="*", help=f"among {', '.join(SHOWCASE_SCENE_BUILDERS)}; none: all")
    parser.add_argument("--detail", nargs="+", choices=get_args(DetailLevel), default=["draft"])
    parser.add_argument("--folder", type=Path, default=Path("runs/showcase"), help="of the runs")
    parser.add_argument("--no-run", action="store_true", help="only what lies in the folder")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    parser.add_argument("--docs", action="store_true", help=f"write the tables into {PAGE.name}")
    asked = parser.parse_args()
    unknown = set(asked.scene) - set(SHOWCASE_SCENE_BUILDERS)
    if unknown:
        parser.error(f"no scene {sorted(unknown)[0]!r}: choose among {', '.join(SHOWCASE_SCENE_BUILDERS)}")
    if asked.docs and asked.scene:
        parser.error("--docs needs all scenes: name none")
    rows = list(measured_rows(asked))
    if asked.docs and len([r for r in rows if r["detail"] == asked.detail[0]]) < len(SHOWCASE_SCENE_BUILDERS):
        parser.error(f"--docs needs all scenes at detail {asked.detail[0]}")
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if asked.docs:
        page(rows, asked.detail)
    raise SystemExit(any(not e["met"] for r in rows for e in r["expectations"]))


if __name__ == "__main__":
    main()
