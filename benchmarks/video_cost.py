"""What a picture of a video costs, here and in another checkout, and how far both are from exact.

    git worktree add ../before COMMIT
    python benchmarks/video_cost.py RUN [RUN ...] --against ../before [--frames N] [--rounds N]
    python benchmarks/video_cost.py RUN [RUN ...] [--frames N]

RUN is the folder of a finished run. Without another checkout, what its video shows in some frames,
liquids too, is cast as the video casts it, on one thread, and its error and processor time are given
(``PYTHONPATH=../before/src`` gives those of another checkout). With one, each checkout poses and
casts the same surfaces before the same camera in a process of its own, on one thread; the two take
turns, so both meet the same machine. Given is processor time per picture, this checkout at
1280 × 720 and at 640 × 480, the other one at 640 × 480, and the ratio is the median over rounds.
The error is the root mean square difference, in steps of 255, from a picture of 3 × 3 samples a
pixel that each send 16 rays to the sky.
"""

import argparse
import pickle
import sys
import time
from collections.abc import Callable
from copy import copy
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from checkout import HERE, SERVE, Checkout, answer, import_from

SMALL, LARGE = (640, 480), (1280, 720)
TURNS = 3
"""Casts of a picture, of which the fastest counts."""


@dataclass(frozen=True)
class Set:
    """Surfaces in some poses, and a camera for each, as both checkouts understand them."""

    finishes: list[dict[str, Any]]
    surfaces: list[dict[str, Any]]
    poses: list[tuple[np.ndarray, np.ndarray]]
    """Vertices [m] and normals."""
    aims: list[dict[str, Any]]
    """For ``SMALL``; the height of what is seen is that of ``LARGE``, too."""


def taken(run: Path, frames: int) -> Set:
    """Read a run and pose its surfaces as its video does, evenly over its time."""
    from corporeal.pipeline.results import StageResults
    from corporeal.pipeline.run_pipeline import read_run
    from corporeal.pipeline.stages.video import motion_summary
    from corporeal.render.camera_track import camera_track
    from corporeal.render.skin_binding import bind_vertices
    from corporeal.simulation.moving_gaussians import granular_parts

    results: StageResults = read_run(run)
    prepared, trajectory = results.prepared, results.trajectory
    scene = prepared.scene
    skin = bind_vertices(scene, prepared.parts, prepared.particles, granular_parts(prepared.field))
    camera = camera_track("wide", motion_summary(skin, scene, prepared.particles, trajectory), SMALL, None)
    moments = [trajectory.frames[int(k)] for k in _even(frames, len(trajectory.frames))]
    return Set(
        [_plain(f) for f in scene.finishes],
        [_plain(s) for s in scene.surfaces],
        [skin.pose(frame) for frame in moments],
        [asdict(camera.at(frame.time)) for frame in moments],
    )


def _even(count: int, total: int) -> np.ndarray:
    """Numbers of so many of all frames, neither the first nor the last."""
    return np.linspace(0, total - 1, count + 2)[1:-1].round().astype(int)


def _plain(record: Any) -> dict[str, Any]:
    return {f.name: getattr(record, f.name) for f in fields(record)}


def serve(root: str, file: str) -> None:
    """Answer with what a picture costs [s of CPU time]: [width, height, where kept, quality]."""
    import_from(root)
    from corporeal.render import embree
    from corporeal.render.camera_placement import CameraAim

    made: Set = pickle.loads(Path(file).read_bytes())
    stage = _stage(made)
    embree.RAY_SAMPLING["exact"] = embree.RaySampling(3, 1, 16)
    casts: dict[int, Callable[..., np.ndarray]] = {}

    def ask(question: tuple[int, int, str, str]) -> float:
        width, height, kept, quality = question
        aims = [_fit(CameraAim, {**aim, "width": width, "height": height}) for aim in made.aims]
        exactly: Callable[..., np.ndarray] = embree.render_image
        cast = exactly if quality == "exact" else casts.setdefault(width, _caster())
        start = time.process_time()
        poses = zip(made.poses, aims, strict=True)
        pictures = [cast(stage.posed(*pose), aim, quality, 1) for pose, aim in poses]
        spent = (time.process_time() - start) / len(aims)
        np.save(kept, np.array(pictures))
        return spent

    answer(ask)


def _stage(made: Set) -> Any:
    from corporeal.core.types import Finish, Scene, SceneObject, Surface
    from corporeal.render.ray_scene import RayScene

    surfaces = tuple(_fit(Surface, s) for s in made.surfaces)
    count = 1 + max(s.object for s in surfaces)
    objects = tuple(SceneObject(f"object_{k}", "thing", 1.0) for k in range(count))
    finishes = tuple(_fit(Finish, f) for f in made.finishes)
    return RayScene(Scene("video", "", objects, surfaces, finishes))


def _caster() -> Callable[..., np.ndarray]:
    """Return what casts the pictures of one video."""
    try:
        from corporeal.render.video_raycaster import VideoRaycaster
    except ImportError:  # the other checkout may be older than that
        from corporeal.render.embree import render_image

        return render_image
    return VideoRaycaster().picture


def _fit(kind: type, values: dict[str, Any]) -> Any:
    """Make a record of what this checkout knows of."""
    return kind(**{f.name: values[f.name] for f in fields(kind) if f.name in values})


def error(pictures: Path, exact: Path) -> float:
    """Root mean square difference [steps of 255]."""
    return _rms(np.load(pictures), np.load(exact))


def _rms(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(((a.astype(np.float64) - b) ** 2).mean()))


def video_errors(run: Path, frames: int) -> list[tuple[float, float]]:
    """Return what a run's video shows in some frames, evenly over its time: its error and cost.

    The cost is the least processor time [s] of ``TURNS`` casts, the studio known already.

    Of a video of Gaussians, these are the surfaces behind them.
    """
    from corporeal.pipeline.run_pipeline import read_run, read_run_request
    from corporeal.pipeline.stages.video import frame_scenes
    from corporeal.render import embree
    from corporeal.render.video_raycaster import VideoRaycaster

    embree.RAY_SAMPLING["exact"] = embree.RaySampling(3, 1, 16)
    results, config, caster = read_run(run), read_run_request(run).settings.video, VideoRaycaster()
    exactly: Callable[..., np.ndarray] = embree.render_image
    found = []
    for stage, aim in frame_scenes(results.played, config, _even(frames, len(results.trajectory.frames))):
        caster.picture(copy(stage), aim, config.quality, 1)
        cost = []
        for _ in range(TURNS):
            start = time.process_time()
            picture = caster.picture(copy(stage), aim, config.quality, 1)
            cost.append(time.process_time() - start)
        found.append((_rms(picture, exactly(stage, aim, "exact", 1)), min(cost)))
    return found


def measure(run: Path, other: Path, frames: int, rounds: int) -> None:
    """Print the rows of one run."""
    with TemporaryDirectory() as folder:
        below = Path(folder)
        (below / "set").write_bytes(pickle.dumps(taken(run, frames)))
        here, there = (Checkout(__file__, root, below / "set") for root in (HERE, other))
        exact = {size: below / f"exact{size[0]}.npy" for size in (SMALL, LARGE)}
        for size, path in exact.items():
            here.ask((*size, str(path), "exact"))
        # A first round compiles, and is not counted.
        rows = [("here", here, LARGE), ("here", here, SMALL), ("there", there, SMALL)]
        kept = [below / f"{k}.npy" for k in range(len(rows))]
        taken_up: list[list[float]] = []
        for _ in range(rounds + 1):
            taken_up.append(
                [who.ask((*size, str(path), "draft")) for (_, who, size), path in zip(rows, kept, strict=True)]
            )
        for k, (name, _, size) in enumerate(rows):
            cost = [round_[k] for round_ in taken_up[1:]]
            ratio = median(round_[k] / round_[-1] for round_ in taken_up[1:])
            off = error(kept[k], exact[size])
            print(
                f"| {run.name} | {name}, {size[0]} × {size[1]} | {min(cost):.3f} | {ratio:.2f} | {off:.2f} |",
                flush=True,
            )
        here.close()
        there.close()


def main() -> None:
    """Measure, and print a table."""
    if sys.argv[1:2] == [SERVE]:
        serve(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--against", type=Path, help="the other checkout")
    parser.add_argument("--frames", type=int, default=2, help="pictures of each run")
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    if asked.against is None:
        print("| run | error of its video's pictures [of 255] | time of each [s] |\n|---|---|---|")
        for run in asked.runs:
            errors, costs = zip(*video_errors(run, asked.frames), strict=True)
            said = (", ".join(f"{x:.2f}" for x in what) for what in (errors, costs))
            print(f"| {run.name} | {' | '.join(said)} |", flush=True)
        return
    print("| run | picture | time [s] | ratio | error [of 255] |\n|---|---|---|---|---|")
    for run in asked.runs:
        measure(run, asked.against.resolve(), asked.frames, asked.rounds)


if __name__ == "__main__":
    main()
