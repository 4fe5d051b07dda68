"""The page of the dynamics benchmark: motion of the showcase against baselines and a finer run.

    python benchmarks/dynamics_docs.py [--against single capped one omniphysgs] [--out dynamics] [--no-run]

Does what ``corporeal evaluate dynamics showcase`` does, and writes the measured rows to
docs/reference/dynamics-benchmark.md. Finished runs in ``--out`` are not done again.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from corporeal.core import store
from corporeal.core.terminal import progress_bars
from corporeal.jobs.local_workers import local_executor
from corporeal.lab.evaluation.dynamics.dynamics_evaluation import DynamicsConfig, evaluate_dynamics
from corporeal.lab.evaluation.dynamics.dynamics_page import COLUMN_EXPLANATIONS, RANKING_RULE, summary_sentence
from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary
from corporeal.lab.evaluation.dynamics.dynamics_tables import dynamics_tables, missing_references, ranking_sentences
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.pipeline.settings import Settings

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "dynamics-benchmark.md"
BASELINES = ("single", "capped", "one", "omniphysgs")


def main() -> None:
    """Run what has not been run, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", nargs="+", default=BASELINES, help="baselines")
    parser.add_argument("--out", type=Path, default=Path("dynamics"), help="folder of the runs")
    parser.add_argument("--no-run", action="store_true", help="sum up what is there")
    asked = parser.parse_args()
    config = DynamicsConfig(against=tuple(asked.against), run=not asked.no_run)
    with progress_bars() as tell:
        hands = local_executor(asked.out, progress=tell("evaluate"))
        found = evaluate_dynamics("showcase", asked.out, config, Settings(), hands)
    write_dynamics_docs(found, f"python benchmarks/dynamics_docs.py --against {' '.join(asked.against)}", PAGE)


def write_dynamics_docs(found: DynamicsSummary, command: str, path: Path) -> None:
    """Write the measured rows as a page of the documentation; what was not run is left out.

    Args:
        found: The evaluation.
        command: That made it.
        path: Of the page (Markdown).

    """
    lines = ["# Dynamics benchmark", "", f"Written by `{command}`. {summary_sentence(found)}", ""]
    lines += [RANKING_RULE, "", *(f"- {s}" for s in ranking_sentences(found)), ""]
    lines += [f"- {s}" for s in missing_references(found)] + [""]
    done = {(r.scene, r.method) for r in found.rows if r.numbers or r.error.startswith("failed")}
    for table in dynamics_tables(found):
        rows = [r for r in table.rows if table.heads[0] != "scene" or (r[0], r[1]) in done]
        if rows:
            text = markdown_table(ResultTable(table.title, table.heads, rows))
            lines += [f"## {table.title}", "", text, ""]
    lines += ["## Columns", "", *(f"- **{k}**: {v}" for k, v in COLUMN_EXPLANATIONS.items()), ""]
    store.write_bytes(path, "\n".join(lines).encode())


def markdown_table(table: ResultTable) -> str:
    """Write a table for the documentation."""
    lines: list[Sequence[str]] = [table.heads, ["---"] * len(table.heads), *table.rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "/") for cell in x) + " |" for x in lines)


if __name__ == "__main__":
    main()
