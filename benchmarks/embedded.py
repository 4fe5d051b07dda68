"""Measure what the embedded recogniser, which needs no model, says of real files.

    python benchmarks/embedded.py [--assets FOLDER --record] [--json FILE] [--docs]

Names and surface values of the parts are recorded in recognition/facts.json, what they are made of
in recognition/truth.toml. ``--record`` reads the files in FOLDER/objects and FOLDER/ycb again;
``--docs`` writes docs/reference/name-recognition-benchmark.md.
"""

import argparse
import json
from pathlib import Path

from recognition.facts import FACTS, SETS, facts, judge, record

from corporeal.core import store
from corporeal.lab.evaluation import material_evaluation as measured
from recognition import page

DOCS = Path(__file__).parents[1] / "docs" / "reference" / "name-recognition-benchmark.md"


def main() -> None:
    """Judge every part and write what was asked for."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--assets", type=Path)
    asked.add_argument("--record", action="store_true")
    asked.add_argument("--json", type=Path)
    asked.add_argument("--docs", action="store_true")
    given = asked.parse_args()
    if given.record and given.assets is None:
        asked.error("--record reads files: say --assets FOLDER too.")
    if given.record:
        lines = ",\n".join(json.dumps(row) for row in record(given.assets))
        FACTS.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    rows = judge(facts())
    for group in SETS:
        mine = [r for r in rows if r.group == group]
        s = measured.recognition_score(mine)
        print(
            f"{group:8} {s.parts:3} parts: right {s.right:.0%}, wrong {s.wrong:.0%}, unknown "
            f"{s.unknown:.0%}; margin orders {_number(s.ordering)}"
        )
    print(f"all: margin orders {_number(measured.margin_roc_area(rows))}")
    for row in rows:
        if row.verdict == "wrong":
            print(f"  wrong: {row.file} / {row.part}: {row.answer} ({row.margin:.2f}) {row.reason}")
    if given.json:
        store.write_json(given.json, measured.recognition_record(rows))
    if given.docs:
        DOCS.write_text(page.markdown(), encoding="utf-8")


def _number(ordering: float | None) -> str:
    """Write what needs a wrong answer and a right one, and may have none."""
    return "-" if ordering is None else f"{ordering:.2f}"


if __name__ == "__main__":
    main()
