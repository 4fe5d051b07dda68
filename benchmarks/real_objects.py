"""Run the main job over a folder of real objects, one by one, and table what came out.

    python benchmarks/real_objects.py FOLDER --out TABLE_FOLDER [--only duck vase] [--detail draft]

FOLDER holds GLB files at any depth and may hold a ``manifest.csv`` with the columns ``file``,
``category`` and ``metric_scale``: where the scale is said not to be metric, the object gets the
typical extent of its class, as the warning of a run proposes it. Each object is dropped from 0.2
of its size. Results that are there already are kept, so an interrupted batch goes on.
"""

import argparse
import csv
import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

EXTENTS = {
    "duck": 0.13,
    "soda can": 0.122,
    "armchair": 0.95,
    "potted plant": 0.8,
    "tree": 5.0,
    "statue": 0.5,
    "instrument": 1.0,
    "plush toy": 0.35,
    "ground/soil": 1.0,
}
"""Largest extent of the real thing [m], for files in artist units."""


def extents(folder: Path) -> dict[str, float]:
    """Return the size to give to each file whose own scale is not metric."""
    manifest = folder / "manifest.csv"
    if not manifest.exists():
        return {}
    with manifest.open(newline="", encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r["metric_scale"].startswith("no")]
    return {Path(r["file"]).stem: EXTENTS[r["category"]] for r in rows}


def run(path: Path, out: Path, size: float | None, detail: str) -> dict:
    """Run one object in a process of its own; return a row of the table."""
    command = [sys.executable, "-m", "corporeal.cli", "run", str(path), "--out", str(out)]
    command += ["--name", path.stem, "--detail", detail, "--drop", "0.2"]
    command += [] if size is None else ["--extent", f"{path.stem}={size}"]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800)
    row = {"object": path.stem, "seconds": time.perf_counter() - start, "exit": done.returncode}
    audit = out / path.stem / "audit.json"
    if done.returncode or not audit.exists():
        return row | {"error": done.stderr.strip().splitlines()[-1:]}
    said = json.loads(audit.read_text())
    names = ("particles", "steps", "nan_count", "particles_out_of_domain", "momentum_residual")
    names += ("energy_growth", "max_penetration_dx", "peak_memory_mb")
    materials = " + ".join(dict.fromkeys(p["material"] for p in said["parts"]))
    treatments = " + ".join(dict.fromkeys(p["treatment"] for p in said["parts"]))
    made = {n: said[n] for n in names} | {"materials": materials, "treatment": treatments}
    film = (out / path.stem / "film.mp4").stat().st_size
    mass = sum(p["mass_kg"] for p in said["parts"])
    return row | made | {"mass_kg": mass, "film_kb": film // 1000}


def table(rows: list[dict]) -> str:
    """Write the rows as Markdown."""
    columns = ("object", "exit", "seconds", "particles", "steps", "materials", "treatment")
    columns += ("mass_kg", "max_penetration_dx", "energy_growth", "nan_count")
    columns += ("particles_out_of_domain",)
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for row in rows:
        cells = (row.get(c, "") for c in columns)
        words = (f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells)
        lines.append("| " + " | ".join(words) + " |")
    times = [r["seconds"] for r in rows if r["exit"] == 0]
    median = statistics.median(times) if times else float("nan")
    lines.append(f"\n{len(times)} of {len(rows)} ended with a film; median {median:.1f} s.")
    return "\n".join(lines)


def main() -> None:
    """Run what is asked and keep the table up to date after every object."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("folder", type=Path)
    asked.add_argument("--out", type=Path, default=Path("runs/real"))
    asked.add_argument("--only", nargs="*", default=[])
    asked.add_argument("--detail", default="draft")
    given = asked.parse_args()
    sizes = extents(given.folder)
    files = [p for d in ("objects", "ycb") for p in sorted((given.folder / d).glob("*.glb"))]
    files = files or sorted(given.folder.rglob("*.glb"))
    wanted = [p for p in files if not given.only or any(w in p.stem for w in given.only)]
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for path in wanted:
        rows.append(run(path, given.out, sizes.get(path.stem), given.detail))
        (given.out / "table.json").write_text(json.dumps(rows, indent=1))
        (given.out / "table.md").write_text(table(rows))
        print(rows[-1], flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
