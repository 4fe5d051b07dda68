"""Simulate settled scenes on which nothing pushes, and say whether they stay at rest.

    python benchmarks/rest.py FOLDER [--out runs/rest] [--only S] [--processes 2] [--json FILE]
                              [--settled said|yes|no]

FOLDER holds one folder per scene with a ``scene.glb`` inside, as ``corporeal assemble`` and
``corporeal corpus assemble`` write them; forces of a ``scene.toml`` beside it are left out. Every
scene is simulated for half a second. An object drifts as far as its centre of mass ever gets from
where it started; a scene is at rest when none of its objects drifts by half a cell (dx). Scenes
that say they had settled find their balance before that; ``--settled no`` is the control without,
``yes`` is for older files that don't say it. What moved meanwhile stands under "sank". Every
process keeps to one core and one thread. Scenes that lie in ``--out`` already are not simulated
again: remove it to measure anew.
"""

import argparse
import json
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import get_args

import numpy as np
from rich.console import Console

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.discretization.discretization_plan import DetailLevel
from corporeal.geometry.rotation import fit_rigid_motion
from corporeal.io.scene_toml import SceneFile, write_scene_file
from corporeal.pipeline.run_pipeline import Settings, open_run
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.simulation_result import SimulationResult

STILL = 0.5
"""Largest drift of what is at rest [dx]."""
FPS = 20
LATE = 0.1
"""The end of the simulation, over which is measured whether a thing is still on its way [s]."""


def measure(path: Path, out: Path, detail: DetailLevel, seconds: float, settled: str = "said") -> dict:
    """Simulate one scene; return what became of its objects, as data."""
    settings = Settings(assemble=AssembleConfig(duration=seconds, fps=FPS), fill=FillConfig(detail=detail))
    row: dict = {"scene": path.parent.name}
    start = time.process_time()
    if settled != "said":
        scene_file = out / f"{row['scene']}.toml"
        out.mkdir(parents=True, exist_ok=True)
        said = SceneFile(scene_file, file=path.resolve(), settled=settled == "yes")
        write_scene_file(scene_file, said)
        path = scene_file
    try:
        with open_run([path], out / row["scene"], settings, _quietly, "simulate") as run:
            played = run.made.played
    except UserError as error:
        return row | {"error": str(error)}
    return row | scene_row(played) | {"cpu_s": time.process_time() - start}


def _quietly(verb: str) -> Progress:
    return lambda fraction, words: None


def scene_row(played: SimulationResult) -> dict:
    """Measure a whole scene."""
    scene, particles = played.prepared.scene, played.prepared.particles
    objects = [object_row(b, played) for b in range(len(scene.objects))]
    ledger, settling = played.trajectory.ledger, read_audit(played.trajectory.folder).settling
    for k, row in enumerate(objects):
        row["sank_dx"] = settling.objects[k].moved_dx if settling else 0.0
    return {
        "settling_s": settling.seconds if settling else 0.0,
        "settled": settling.found if settling else None,
        "cell_m": particles.cell,
        "particles": particles.count,
        "steps": int(ledger.steps[-1]),
        "drift_dx": max(o["drift_dx"] for o in objects),
        "warnings": list(dict.fromkeys((*scene.warnings, *particles.warnings))),
        "objects": objects,
    }


def object_row(body: int, played: SimulationResult) -> dict:
    """Measure one object."""
    prepared, trajectory = played.prepared, played.trajectory
    scene, parts, field = prepared.scene, prepared.parts, prepared.field
    particles = prepared.particles
    own = [k for k, p in enumerate(parts.catalogue) if p.object == body]
    path = trajectory.ledger.centre[:, body] - trajectory.ledger.centre[0, body]
    late = trajectory.time >= trajectory.time[-1] - LATE - 1e-9
    mine = particles.object == body
    first, last = (trajectory.frames[k].position[mine].astype(float) for k in (0, -1))
    turn = fit_rigid_motion(first, last, np.ones(len(first))).rotation
    cosine = np.clip((np.trace(turn) - 1) / 2, -1, 1)
    return {
        "object": scene.objects[body].name,
        "class": scene.objects[body].class_name,
        "materials": list(dict.fromkeys(field.materials[k].name for k in own)),
        "laws": list(dict.fromkeys(field.materials[k].law.name.lower() for k in own)),
        "treatments": list(dict.fromkeys(particles.treatments[k].kind for k in own)),
        "drift_dx": float(np.linalg.norm(path, axis=1).max() / particles.cell),
        "moved_dx": (path[-1] / particles.cell).tolist(),
        "late_dx": float(np.linalg.norm(np.ptp(path[late], axis=0)) / particles.cell),
        "turned_deg": float(np.degrees(np.arccos(cosine))),
    }


# ------------------------------------------------------------------ all of them


def keep_to_one_core(free: "multiprocessing.Queue[int]") -> None:
    """Give a process of the pool a core of its own."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {free.get()})


def measure_all(paths: list[Path], out: Path, asked: argparse.Namespace, console: Console) -> None:
    """Simulate what is not there yet."""
    missing = [p for p in paths if not kept(out, p).exists()]
    context = multiprocessing.get_context("spawn")
    free = context.Queue()
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    for k in range(asked.processes):
        free.put(cores[k % len(cores)])
    with ProcessPoolExecutor(
        asked.processes, mp_context=context, initializer=keep_to_one_core, initargs=(free,)
    ) as pool:
        jobs = {
            pool.submit(measure, path, out / "runs", asked.detail, asked.seconds, asked.settled): path
            for path in missing
        }
        for job in as_completed(jobs):
            row = job.result()
            kept(out, jobs[job]).write_text(json.dumps(row, indent=1), encoding="utf-8")
            console.print("\n".join(lines(row)), markup=False, highlight=False)


def kept(out: Path, path: Path) -> Path:
    """Where a scene's row is kept."""
    return out / f"{path.parent.name}.json"


def at_rest(row: dict) -> bool:
    """Whether all objects of a scene stay."""
    return row.get("drift_dx", np.inf) < STILL


HEADS = ("scene", "object", "materials", "laws", "treatments", "sank [dx]", "drift [dx]")
HEADS = (*HEADS, "late [dx]", "turned [°]", "settled [s]", "particles", "steps", "CPU [s]")


def lines(row: dict) -> list[str]:
    """Give the rows of the table for one scene."""
    if "error" in row:
        return [f"| {row['scene']} | {row['error']} |" + " |" * (len(HEADS) - 2)]
    settled = f"{row['settling_s']:.2f}" + (" **never**" if row["settled"] is False else "")
    whole = [settled, f"{row['particles']:,}", f"{row['steps']:,}", f"{row['cpu_s']:.0f}"]
    found = []
    for k, o in enumerate(row["objects"]):
        words = [" + ".join(o[n]) for n in ("materials", "laws", "treatments")]
        drift = f"{o['drift_dx']:.2f}" + ("" if o["drift_dx"] < STILL else " **moves**")
        sank = f"{o['sank_dx']:.2f}"
        cells = ["" if k else row["scene"], o["object"], *words, sank, drift]
        cells += [f"{o['late_dx']:.2f}", f"{o['turned_deg']:.1f}", *([""] * 4 if k else whole)]
        found.append("| " + " | ".join(cells) + " |")
    return found


def summary(rows: list[dict]) -> str:
    """Say how many scenes stay at rest, and name the others."""
    still = [r for r in rows if at_rest(r)]
    things = [o for r in rows for o in r.get("objects", ())]
    drifts = np.sort([o["drift_dx"] for o in things])
    told = [f"{len(still)} of {len(rows)} scenes at rest (drift < {STILL:g} dx)."]
    if len(drifts):
        few = int((drifts < STILL).sum())
        median, most = np.median(drifts), drifts[int(0.9 * (len(drifts) - 1))]
        told.append(
            f"{few} of {len(drifts)} objects; drift {median:.2f} dx in the median, {most:.2f} dx "
            f"for nine of ten, {drifts[-1]:.2f} dx at most."
        )
    for row in rows:
        if not at_rest(row):
            moved = [o for o in row.get("objects", ()) if o["drift_dx"] >= STILL]
            who = (f"{o['object']} {o['drift_dx']:.2f} dx" for o in moved)
            told.append(f"- {row['scene']}: {row.get('error') or ', '.join(who)}")
    return "\n".join(told)


def main() -> None:
    """Measure what has not been measured yet; print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the scenes")
    parser.add_argument("--out", type=Path, default=Path("runs/rest"))
    parser.add_argument("--only", nargs="*", default=[], help="scenes whose names contain this")
    parser.add_argument("--detail", choices=get_args(DetailLevel), default="draft")
    parser.add_argument("--seconds", type=float, default=0.5, help="how long to watch")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--settled", choices=("said", "yes", "no"), default="said")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    asked = parser.parse_args()
    paths = sorted(asked.folder.rglob("scene.glb"))
    paths = [p for p in paths if not asked.only or any(w in p.parent.name for w in asked.only)]
    if not paths:
        parser.error(f"{asked.folder} holds no scene.glb")
    asked.out.mkdir(parents=True, exist_ok=True)
    console = Console(width=250)
    head = [f"| {' | '.join(HEADS)} |", "|" + "---|" * len(HEADS)]
    console.print("\n".join(head), markup=False, highlight=False)
    measure_all(paths, asked.out, asked, console)
    rows = [json.loads(kept(asked.out, p).read_text(encoding="utf-8")) for p in paths]
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    console.print("\n" + summary(rows), markup=False, highlight=False)


if __name__ == "__main__":
    main()
