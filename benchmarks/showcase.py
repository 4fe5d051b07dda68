"""Simulate the showcase's scenes and say what was seen, what the audit found, how long it took.

    python benchmarks/showcase.py [SCENE ...] [--detail draft normal ...] [--json FILE] [--docs]

``--docs`` writes the tables into docs/showcase.md; it needs all scenes. Runs that lie in
``--folder`` already are not repeated: remove it to measure again.
"""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import get_args

from rich.console import Console
from stories import Told, tell

from corporeal.findings import Audit
from corporeal.machine import cores
from corporeal.pipeline import Settings
from corporeal.showcase.expectations import EXPECTED
from corporeal.showcase.scenes import SCENES
from corporeal.stages.fill import FillConfig
from corporeal.treatment.plan import Detail

PAGE = Path(__file__).parents[1] / "docs" / "showcase.md"
BEGIN, END = "<!-- made by benchmarks/showcase.py -->", "<!-- end -->"
MOMENTUM, ENERGY = 1e-4, 0.05
"""Largest share of momentum that may go astray, and of energy that may come from nowhere."""


def clean(audit: Audit) -> bool:
    """Say whether the simulation kept its books."""
    lost = audit.nan_count + audit.particles_out_of_domain
    return bool(lost == 0 and audit.momentum_residual < MOMENTUM and audit.energy_growth < ENERGY)


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
        "energy_growth": audit.energy_growth,
        "penetration_dx": audit.max_penetration_dx,
        "clean": clean(audit),
        "seconds": told.seconds,
    }


def seen_table(rows: list[dict]) -> str:
    """Tell what must be seen in every scene, and whether it was."""
    lines = ["| scene | must show | target | measured | | must fail |", "|---|---|---|---|---|---|"]
    for number, found in enumerate(rows, 1):
        demands = EXPECTED[found["scene"]]
        for k, (e, demand) in enumerate(zip(found["expectations"], demands, strict=True)):
            scene = "" if k else f"{number} {found['scene']}"
            met = "✓" if e["met"] else "missed"
            said = (scene, e["sentence"], e["target"], e["value"], met, demand.spoiled_by)
            lines.append(f"| {' | '.join(said)} |")
    return "\n".join(lines)


def cost_table(rows: list[dict]) -> str:
    """Tell what every scene cost and what its audit says."""
    heads = ("scene", "detail", "particles", "steps", "momentum astray", "energy gained")
    heads += ("deepest overlap [cells]", "audit", "simulated in [s]")
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    lines += [
        f"| {r['scene']} | {r['detail']} | {r['particles']:,} | {r['steps']:,} "
        f"| {r['momentum_residual']:.0e} | {r['energy_growth']:.1%} | {r['penetration_dx']:.2f} "
        f"| {'clean' if r['clean'] else 'not clean'} | {r['seconds']:.0f} |"
        for r in rows
    ]
    return "\n".join(lines)


def page(rows: list[dict], details: list[str]) -> None:
    """Put the tables between the marks in the page."""
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    first = [r for r in rows if r["detail"] == details[0]]
    tables = (
        f"At detail {details[0]}, seed 0:\n\n{seen_table(first)}\n\n"
        f"What it cost, on {cores()} core{'s' if cores() > 1 else ''}:\n\n{cost_table(rows)}\n"
    )
    PAGE.write_text(f"{before}{BEGIN}\n\n{tables}\n{END}{after}", encoding="utf-8")


def main() -> None:
    """Run what has not been run yet; print it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", nargs="*", help=f"among {', '.join(SCENES)}; none: all")
    parser.add_argument("--detail", nargs="+", choices=get_args(Detail), default=["draft"])
    parser.add_argument("--folder", type=Path, default=Path("runs/showcase"), help="of the runs")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    parser.add_argument("--docs", action="store_true", help=f"write the tables into {PAGE.name}")
    asked = parser.parse_args()
    unknown = set(asked.scene) - set(SCENES)
    if unknown:
        parser.error(f"no scene {sorted(unknown)[0]!r}: choose among {', '.join(SCENES)}")
    if asked.docs and asked.scene:
        parser.error("--docs needs all scenes: name none")
    rows = []
    console = Console()
    for detail in asked.detail:
        for name in asked.scene or SCENES:
            settings = Settings(fill=FillConfig(detail=detail))
            rows.append(row(tell(name, asked.folder / f"{name}-{detail}", settings), detail))
            console.print_json(json.dumps(rows[-1]), indent=None)
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if asked.docs:
        page(rows, asked.detail)
    raise SystemExit(any(not e["met"] for r in rows for e in r["expectations"]))


if __name__ == "__main__":
    main()
