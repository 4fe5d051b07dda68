"""What exports cost, and whether what was settled stays where it is in other engines.

    python benchmarks/exports.py cost RUN [--json FILE]
    python benchmarks/exports.py rest SCENE ... [--seconds 2] [--newton PYTHON] [--physx PYTHON]

``cost`` writes every target of a finished run in a process of its own, and then all of them in one,
on one thread: CPU seconds (bounds: 15 s each but HDF5, 60 s for all) and peak memory (2 GB).

``rest`` exports scenes that ``corporeal assemble`` settled as MJCF and as USD and leaves them
alone: in MuJoCo (MJCF), and in Newton's MuJoCo solver and PhysX on the processor (USD) where the
Python of an environment with them is named, such as ``.readers/newton/bin/python``. What can
deform is left out; a thing that touches it, itself or through others, is named and does not count.
Bound: 1 mm in MuJoCo.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

import corporeal
from corporeal.export.check_exports import drift_in_mujoco
from corporeal.export.export_target import EXPORT_WRITERS, ExportConfig, ExportRequest, read_record
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.mjcf_writer import write_mjcf
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_scene
from corporeal.export.usd_writer import write_usd
from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.pipeline.in_memory import load_scene, prepare_scene

EACH, ALL, MEMORY = 15.0, 60.0, 2e9
"""Bounds: CPU seconds of a target but HDF5, of all, and bytes."""
STILL = 1e-3
"""Largest drift at rest in MuJoCo [m]."""
NEAR = 2e-3
"""What is no farther apart at the start touches [m]."""
THREADS = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
Placed = tuple[np.ndarray, QueryMesh]
READERS = Path(__file__).parents[1] / "tests" / "export" / "programs"
PROGRAMS = ("newton", "physx")


def main() -> int:
    """Measure what is asked; 1: a bound is broken."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    kinds = parser.add_subparsers(dest="kind", required=True)
    cost = kinds.add_parser("cost")
    cost.add_argument("run", type=Path)
    rest = kinds.add_parser("rest")
    rest.add_argument("scenes", type=Path, nargs="+")
    rest.add_argument("--seconds", type=float, default=2.0)
    for name in PROGRAMS:
        rest.add_argument(f"--{name}", type=Path)
    for kind in (cost, rest):
        kind.add_argument("--json", type=Path)
    asked = parser.parse_args()
    rows = costs(asked.run) if asked.kind == "cost" else rests(asked)
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))
    return 0 if all(row["met"] for row in rows) else 1


# ---------------------------------------------------------------- what it costs


def costs(run: Path) -> list[dict]:
    """Export one target after the other, then all."""
    rows = []
    print(f"{'target':8} {'CPU s':>7} {'wall s':>7} {'peak MB':>8} {'files MB':>9}")
    for name, targets in [*((t, (t,)) for t in EXPORT_WRITERS), ("all", tuple(EXPORT_WRITERS))]:
        row = {"target": name, **cost_of(run, targets)}
        bound = ALL if name == "all" else np.inf if name == "h5" else EACH
        row["met"] = row["cpu_s"] < bound and row["peak_bytes"] < MEMORY
        rows.append(row)
        if row.get("skipped"):
            print(f"{name:8} {row['skipped']}")
            continue
        print(
            f"{name:8} {row['cpu_s']:7.1f} {row['wall_s']:7.1f} {row['peak_bytes'] / 1e6:8.0f} "
            f"{row['bytes'] / 1e6:9.1f}{'' if row['met'] else '  ✗'}"
        )
    return rows


def cost_of(run: Path, targets: tuple[str, ...]) -> dict:
    """Run ``corporeal export`` in a process of its own, and ask the system what it took."""
    with tempfile.TemporaryDirectory(prefix="corporeal-") as out:
        command = [sys.executable, "-m", "corporeal.cli", "export", str(run), "--to", *targets]
        source = str(Path(corporeal.__file__).parents[1])
        begun = time.perf_counter()
        process = subprocess.Popen(
            [*command, "--out", out],
            env=os.environ | THREADS | {"PYTHONPATH": source},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begun
        record = Path(out) / "export.json"
        said = read_record(record).targets if record.exists() else {}
        skipped = [row.skipped for row in said.values() if row.skipped]
        if not skipped and os.waitstatus_to_exitcode(status):
            raise SystemExit(f"{' '.join(command)} failed")
        size = sum(p.stat().st_size for p in Path(out).rglob("*") if p.is_file())
    return {
        "cpu_s": used.ru_utime + used.ru_stime,
        "wall_s": wall,
        "peak_bytes": 1024 * used.ru_maxrss,
        "bytes": size,
        "skipped": skipped[0] if len(skipped) == len(targets) else "",
    }


# ---------------------------------------------------------------- whether it stays


def rests(asked: argparse.Namespace) -> list[dict]:
    """Export every scene and leave it alone."""
    rows = []
    for path in asked.scenes:
        prepared = prepare_scene(load_scene(path))
        motion = motion_of_scene(prepared)
        scene = physical_scene(prepared, motion)
        with tempfile.TemporaryDirectory(prefix="corporeal-") as name:
            given = ExportRequest(scene, motion, ExportConfig(soft="none"))
            write_mjcf(given, Path(name))
            model = mujoco.MjModel.from_xml_path(str(Path(name) / "scene.xml"))
            rigid = [s for s in scene.solids if s.rigid]
            found = {"mujoco": drift_in_mujoco(model, rigid, asked.seconds)}
            write_usd(given, Path(name))
            for program in PROGRAMS:
                python = getattr(asked, program)
                if python and rigid:
                    found[program] = elsewhere(python, program, Path(name), asked.seconds)
        leaning = held_by_what_deforms(scene)
        for solid in rigid:
            row: dict = {"scene": path.parent.name, "object": solid.name}
            row |= {f"{e}_mm": 1e3 * drift[solid.name] for e, drift in found.items()}
            row["counts"] = solid.name not in leaning
            row["met"] = not row["counts"] or found["mujoco"][solid.name] < STILL
            rows.append(row)
            numbers = "  ".join(f"{e} {row[f'{e}_mm']:8.4f} mm" for e in found)
            why = "" if row["counts"] else "  (lies on what can deform)"
            print(f"{row['scene']:16} {solid.title:20} {numbers}{why}{'' if row['met'] else '  ✗'}")
    return rows


def elsewhere(python: Path, program: str, folder: Path, seconds: float) -> dict[str, float]:
    """How far things go in another program, by their names [m]."""
    script = READERS / f"{program}_usd.py"
    command = [str(python), str(script), str(seconds), str(folder / "sim.usda")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (said,) = json.loads(done.stdout.strip().splitlines()[-1])
    return {label.rsplit("/", 1)[-1]: moved for label, moved in said["drift"].items()}


def held_by_what_deforms(scene: PhysicalScene) -> set[str]:
    """Names of rigid solids that touch what can deform, themselves or through one another."""
    shapes = {s.name: placed(s) for s in scene.solids}
    soft = {s.name for s in scene.solids if not s.rigid}
    reached: set[str] = set()
    while True:
        free = [s.name for s in scene.solids if s.name not in soft | reached]
        more = {n for n in free if any(near(shapes[n], shapes[o]) for o in soft | reached)}
        if not more:
            return reached
        reached |= more


def placed(solid: ExportedSolid) -> Placed:
    """Vertices of a solid in the world, and its surface."""
    mesh = join_meshes(list(solid.surfaces))
    vertices = mesh.vertices + solid.origin
    return vertices, QueryMesh(Mesh(vertices, mesh.triangles))


def near(one: Placed, other: Placed) -> bool:
    """Whether two surfaces are no farther apart than ``NEAR``, vertices of each from the other."""
    for (points, _), (_, shape) in ((one, other), (other, one)):
        close = shape.may_be_within(NEAR, points)
        if close.any() and shape.closest(points[close])[0].min() < NEAR:
            return True
    return False


if __name__ == "__main__":
    sys.exit(main())
