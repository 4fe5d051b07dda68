"""Run the main job over a folder of real objects, one by one, and table what came out.

    python benchmarks/real_objects.py FOLDER --out TABLE_FOLDER [--only duck vase] [--detail draft]
    python benchmarks/real_objects.py FOLDER --weigh [--as-they-are]

FOLDER holds GLB files at any depth and may hold a ``manifest.csv`` with the columns ``file``,
``category`` and ``metric_scale``: where the scale is said not to be metric, the object gets the
typical extent of its class, as the warning of a run proposes it; ``--as-they-are`` leaves every
size as the file has it. Each object is dropped from 0.2 of its size. Results that are there already
are kept, so an interrupted batch goes on. Beside the numbers of a run the table has the mass and
the largest extent of every object, and all that was warned of. ``--weigh`` stops before simulating.
"""

import argparse
import csv
import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.pipeline.in_memory import load_scene, prepare_scene
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.pipeline.stages.ground import grounding_warnings
from corporeal.simulation.audit_file import AUDIT_FILE, read_run_audit

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
    if done.returncode or not (out / path.stem / AUDIT_FILE).exists():
        return row | {"error": done.stderr.strip().splitlines()[-1:]}
    audit = read_run_audit(out / path.stem)
    names = ("particles", "steps", "nan_count", "particles_out_of_domain", "momentum_residual")
    names += ("energy_growth", "max_penetration_dx", "peak_memory_mb")
    materials = " + ".join(dict.fromkeys(p.material for p in audit.parts))
    treatments = " + ".join(dict.fromkeys(p.treatment for p in audit.parts))
    made = {n: getattr(audit, n) for n in names} | {"materials": materials, "treatment": treatments}
    video = (out / path.stem / "video.mp4").stat().st_size
    scene = store.load(next((out / path.stem).glob("*-assemble")) / store.DATA_FILE)
    said = {
        "mass_kg": sum(p.mass_kg for p in audit.parts),
        "extent_m": max(o.real_extent for o in scene.objects),
        "warnings": list(audit.warnings),
    }
    return row | made | said | {"video_kb": video // 1000}


def weigh(path: Path, size: float | None) -> dict:
    """Find what one object is made of, how heavy it is and what is said of it; no video."""
    start = time.perf_counter()
    extents = () if size is None else (f"{path.stem}={size}",)
    try:
        made = prepare_scene(load_scene(path, AssembleConfig(extent=extents)))
    except UserError as error:
        return {"object": path.stem, "exit": 2, "error": str(error)}
    groups = (
        made.scene.warnings,
        made.inventory.warnings,
        made.parts.warnings,
        grounding_warnings(made.field, made.parts, made.scene),
        made.particles.warnings,
    )
    return {
        "object": path.stem,
        "exit": 0,
        "seconds": time.perf_counter() - start,
        "materials": " + ".join(dict.fromkeys(m.name for m in made.field.materials)),
        "structure": " + ".join(dict.fromkeys(s.kind for s in made.field.structures)),
        "mass_kg": sum(made.particles.mass_real),
        "extent_m": max(o.real_extent for o in made.scene.objects),
        "warnings": list(dict.fromkeys(w for group in groups for w in group)),
    }


RUN = ("object", "exit", "seconds", "particles", "steps", "materials", "treatment", "mass_kg")
RUN += ("extent_m", "max_penetration_dx", "energy_growth", "nan_count", "particles_out_of_domain")
WEIGHED = ("object", "exit", "seconds", "materials", "structure", "mass_kg", "extent_m")


def table(rows: list[dict], columns: tuple[str, ...] = RUN) -> str:
    """Write the rows as Markdown, and below it what was warned of."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for row in rows:
        cells = (row.get(c, "") for c in columns)
        words = (f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells)
        lines.append("| " + " | ".join(words) + " |")
    times = [r["seconds"] for r in rows if r["exit"] == 0]
    median = statistics.median(times) if times else float("nan")
    lines.append(f"\n{len(times)} of {len(rows)} came to an end; median {median:.1f} s.\n")
    for row in rows:
        lines += [f"- {row['object']}: {said}" for said in row.get("warnings", ())]
    return "\n".join(lines)


def main() -> None:
    """Run what is asked and keep the table up to date after every object."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("folder", type=Path)
    asked.add_argument("--out", type=Path, default=Path("runs/real"))
    asked.add_argument("--only", nargs="*", default=[])
    asked.add_argument("--detail", default="draft")
    asked.add_argument("--weigh", action="store_true")
    asked.add_argument("--as-they-are", action="store_true")
    given = asked.parse_args()
    sizes = {} if given.as_they_are else extents(given.folder)
    files = [p for d in ("objects", "ycb") for p in sorted((given.folder / d).glob("*.glb"))]
    files = files or sorted(given.folder.rglob("*.glb"))
    wanted = [p for p in files if not given.only or any(w in p.stem for w in given.only)]
    if given.weigh:
        print(table([weigh(p, sizes.get(p.stem)) for p in wanted], WEIGHED))
        return
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
