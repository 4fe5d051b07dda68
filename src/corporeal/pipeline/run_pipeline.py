"""The stages of a run in order, with caching of their results.

A run is a folder. Each stage stores its result in a numbered folder, under a key that covers all its inputs: fresh
results are read, stale ones recomputed, interrupted ones resumed. ``run.json`` holds the state of the run.

What does a stage is imported when it is done: a run that is read back, or not begun, waits for none.
"""

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.core.setting_types import paths_read
from corporeal.core.types import Inventory, MaterialField, Particles, Parts, Reconstruction, Scene, Trajectory, Video
from corporeal.geometry.gaussian_transforms import chosen_up_axis
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.input_files import (
    input_kind,
    is_scene_file,
    list_input_files,
    photographed_input,
    read_scene,
    scene_name,
)
from corporeal.io.scene_toml import write_scene_file
from corporeal.pipeline.results import RUN_FILES, StageResults
from corporeal.pipeline.settings import GroundConfig, Settings
from corporeal.recognition.readable_names import safe_name

ProgressOfStage = Callable[[str], Progress]
"""Returns the progress callback of a stage."""

STAGE_FOLDERS = {
    "reconstruct": "0-reconstruct",
    "assemble": "1-assemble",
    "describe": "4-describe",
    "segment": "5-segment",
    "ground": "6-ground",
    "fill": "7-fill",
    "simulate": "8-simulate",
    "video": "9-video",
    "report": "10-report",
}
STAGES = tuple(STAGE_FOLDERS)
RUN_FILE = "run.json"
GAUSSIANS_FILE = "gaussians.ply"


DEFAULT_SETTINGS = Settings()


def no_progress_of_stage(verb: str) -> Progress:
    """Ignore progress."""
    return lambda fraction, words: None


def run(
    inputs: Sequence[str | Path],
    folder: str | Path,
    settings: Settings = DEFAULT_SETTINGS,
    tell: ProgressOfStage = no_progress_of_stage,
    until: str = "report",
) -> Path:
    """Run every stage up to ``until``; return the run's folder.

    Args:
        inputs: Scene files, a folder of photographs, or a splat.
        folder: The run's folder; made when absent.
        settings: Configuration of every stage.
        tell: Progress callback of each stage.
        until: The last stage to run.

    Raises:
        UserError: An input cannot be used, the disk is full, another process works in the folder, or the simulation
            cannot go on.
    """
    folder = Path(folder)
    with open_run([Path(path) for path in inputs], folder, settings, tell, until):
        return folder


@dataclass(frozen=True)
class OpenRun:
    """A run whose stages are finished."""

    made: StageResults
    key: str
    """Key of the last stage's result."""


@contextmanager
def open_run(
    inputs: list[Path], folder: Path, settings: Settings, tell: ProgressOfStage, until: str
) -> Iterator[OpenRun]:
    """Run every stage up to ``until``, with the run's folder locked.

    Yields:
        The results and their key.
    """
    with store.lock_folder(folder), store.disk_errors(folder):
        work = _Run(inputs, folder, settings, tell)
        work.through(until)
        yield OpenRun(work.made, work.key)


@dataclass(frozen=True)
class RunRequest:
    """Inputs and settings of a run."""

    inputs: list[Path]
    settings: Settings


def read_run_request(folder: Path) -> RunRequest:
    """Read the inputs and settings of a run.

    Raises:
        UserError: The folder is not a run.
    """
    if not folder.exists():
        raise UserError(f"{folder} is not a run: there is no such folder. Check the path.")
    if not (folder / RUN_FILE).exists():
        raise UserError(f"{folder} is not a run: it has no {RUN_FILE}. Start one with: corporeal run.")
    return from_plain(RunRequest, store.read_json(folder / RUN_FILE))


def read_run(folder: Path) -> StageResults:
    """Read the results of the finished stages of a run.

    Raises:
        UserError: The folder is not a run.
    """
    read_run_request(folder)
    made = StageResults()
    for verb, name in STAGE_FOLDERS.items():
        if (folder / name / store.META_FILE).exists():
            made = made.having(verb, _read_stage_result(verb, folder / name))
    return made


def _read_stage_result(verb: str, folder: Path) -> Any:
    if verb == "simulate":
        from corporeal.simulation.trajectory_files import read_trajectory

        return read_trajectory(folder)
    if verb == "report":
        return None
    found = store.load(folder / store.DATA_FILE)
    # paths in the results may be stale: the run may have been moved
    return replace(found, path=folder / found.path.name) if verb == "video" else found


def digests_of_named_files(config: Any) -> list[str]:
    """Return digests of the files that a configuration declares as inputs."""
    paths = paths_read(config) if config else []
    return [store.path_digest(path) for path in paths if path.exists()]


@dataclass(frozen=True)
class StageState:
    """State of one stage of a run."""

    verb: str
    state: Literal["finished", "unfinished", "not yet"]
    seconds: float | None = None
    """Duration [s]; None: not finished."""


def stage_states(folder: Path) -> list[StageState]:
    """Return the states of all stages of a run.

    Raises:
        UserError: The folder is not a run.
    """
    inputs = read_run_request(folder).inputs
    rows = []
    for verb in stages_for(inputs):
        name = STAGE_FOLDERS[verb]
        if (folder / name / store.META_FILE).exists():
            rows.append(StageState(verb, "finished", store.read_meta(folder / name).seconds))
        else:
            begun = (folder / name).exists()
            rows.append(StageState(verb, "unfinished" if begun else "not yet"))
    return rows


def stages_for(inputs: list[Path]) -> tuple[str, ...]:
    """Return the stages for an input: models need no reconstruction.

    Raises:
        UserError: The inputs cannot be combined.
    """
    return STAGES[1:] if input_kind(inputs) == "model" else STAGES


def invalidate_stage(folder: Path, verb: str) -> None:
    """Mark one stage's result as stale."""
    with store.lock_folder(folder):
        (folder / STAGE_FOLDERS[verb] / store.META_FILE).unlink(missing_ok=True)


def delete_simulation(folder: Path) -> None:
    """Delete a simulation, finished or not."""
    with store.lock_folder(folder):
        shutil.rmtree(folder / STAGE_FOLDERS["simulate"], ignore_errors=True)


def write_showcase(name: str, folder: Path) -> Path:
    """Write a showcase scene as a GLB; return its path.

    Raises:
        UnknownChoiceError: There is no such scene.
    """
    from corporeal.showcase.showcase_scenes import build_showcase_scene

    path = folder / f"{name}.glb"
    with store.disk_errors(path):
        folder.mkdir(parents=True, exist_ok=True)
        write_glb(path, build_showcase_scene(name))
    return path


SHOWCASE_PACKAGES = ("numpy", "scipy", "manifold3d", "scikit-image", "fast-simplification", "pillow")
"""Packages whose versions are part of the cache key of a showcase scene."""


def write_cached_showcase(name: str, folder: Path) -> Path:
    """Write a showcase scene as ``write_showcase`` does, from a cache.

    The cache is in ``store.cache_folder``; if it is not writable, the scene is built each time.

    Raises:
        UnknownChoiceError: There is no such scene.
    """
    recipe = store.result_key("showcase", {p: version(p) for p in SHOWCASE_PACKAGES}, [name, store.source_digest()])
    kept = store.cache_folder("scenes") / f"{name}-{recipe}.glb"
    try:
        data = kept.read_bytes()
    except OSError:
        path = write_showcase(name, folder)
        with suppress(OSError, store.DiskError):
            for old in kept.parent.glob(f"{name}-*.glb"):
                old.unlink()
            store.write_bytes(kept, path.read_bytes())
        return path
    path = folder / f"{name}.glb"
    store.write_bytes(path, data)
    return path


class _Run:
    """One pass over the stages; holds their results."""

    def __init__(self, inputs: list[Path], folder: Path, settings: Settings, tell: ProgressOfStage) -> None:
        self.inputs, self.folder, self.settings, self.tell = inputs, folder, settings, tell
        self.key = ""
        self.seconds: dict[str, float] = {}
        self.made = StageResults()

    def through(self, until: str) -> None:
        """Run all stages up to ``until`` and write the state to ``run.json``."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._declare("running")
        try:
            todo = stages_for(self.inputs)
            if until not in todo:
                raise UserError("A model needs no reconstruction: run the other stages.")
            for verb in todo[: todo.index(until) + 1]:
                self._do(verb)
        except KeyboardInterrupt:
            self._declare("interrupted")
            raise
        except Exception as error:
            self._declare("failed", str(error))
            raise
        last = self.folder / STAGE_FOLDERS["report"] / store.META_FILE
        self._declare("finished" if last.exists() else f"done up to {until}")

    def _declare(self, state: str, error: str = "") -> None:
        settings = {f.name: asdict(getattr(self.settings, f.name)) for f in fields(Settings)}
        asked = {"inputs": [str(path.resolve()) for path in self.inputs], "settings": settings}
        store.write_json(self.folder / RUN_FILE, {"state": state, **asked, "error": error})

    def _do(self, verb: str) -> None:
        config = getattr(self.settings, verb, None)
        before = [self.key] if self.key else [store.path_digest(p) for p in self._files()]
        self.key = store.result_key(verb, config, before + digests_of_named_files(config) + self._borrowed(verb))
        folder = self.folder / STAGE_FOLDERS[verb]
        step = getattr(self, f"_{verb}")
        if store.is_fresh(folder, self.key):
            self.made = self.made.having(verb, _read_stage_result(verb, folder))
            self.seconds[verb] = store.read_meta(folder).seconds
            return
        self._clear(verb, folder)
        store.begin_result(folder)
        start = time.perf_counter()
        self.made = self.made.having(verb, step(folder, self.tell(verb)))
        self.seconds[verb] = time.perf_counter() - start
        store.finish_result(folder, self.key, config, self.seconds[verb])

    def _borrowed(self, verb: str) -> list[str]:
        """Name what a stage takes from another stage's settings."""
        if verb == "reconstruct":
            from corporeal.io.photos.mask_files import edited_masks

            asked = [] if self.settings.reconstruct.object_names else [self.settings.describe.vlm]
            by_hand = sorted(edited_masks(self.folder / STAGE_FOLDERS[verb]).items())
            return [*self.settings.assemble.extent, *asked, *(" ".join(mask) for mask in by_hand)]
        if verb == "assemble":
            return [up for up in [self.settings.reconstruct.up] if up != "auto"]
        if verb != "describe":
            return []
        library = self.settings.ground.library
        return [library, *digests_of_named_files(GroundConfig(library=library))]

    def _files(self) -> list[Path]:
        missing = [str(p) for p in self.inputs if not p.exists()]
        if missing:
            raise UserError(f"No such file: {', '.join(missing)}. Check the path.")
        return list_input_files(self.inputs)

    def _clear(self, verb: str, folder: Path) -> None:
        """Remove results that no longer follow from the settings.

        An unfinished simulation is kept, and what a reconstruction learned: both go on from there, a training only if
        it is of the same pictures.
        """
        for name in RUN_FILES:
            (self.folder / name).unlink(missing_ok=True)
        for later in STAGES[STAGES.index(verb) + 1 :]:
            (self.folder / STAGE_FOLDERS[later] / store.META_FILE).unlink(missing_ok=True)
        started = folder / "started.json"
        unfinished = started.exists() and store.read_json(started).get("key") == self.key
        kept = verb == "reconstruct" or (verb == "simulate" and unfinished)
        if not kept and folder.exists():
            shutil.rmtree(folder)
        store.write_json(started, {"key": self.key})

    def _keep(self, folder: Path, value: Any) -> Any:
        store.save(folder / store.DATA_FILE, value)
        return value

    def _reconstruct(self, folder: Path, progress: Progress) -> Reconstruction:
        from corporeal.io.splat.splat_ply import write_splat_ply
        from corporeal.pipeline.stages.reconstruct import reconstruct
        from corporeal.vlm.photographed_objects import PhotoInterview

        source, asked = photographed_input(self.inputs), self.settings.describe
        assert source is not None, "models need no reconstruction"
        config, extents = self.settings.reconstruct, self.settings.assemble.extent
        if self.settings.assemble.objects != "auto":
            raise UserError("--objects is for models. Choose how objects are separated with --apart.")
        viewer = PhotoInterview(safe_name(scene_name(source)), asked.vlm, asked.record)
        result = reconstruct(source, config, extents, viewer, folder, progress)
        made, scene = result.found, result.scene
        if viewer.asked().transcript:
            store.write_json(folder / "transcript.json", viewer.asked().transcript)
        write_splat_ply(folder / GAUSSIANS_FILE, made.gaussians)
        write_glb(folder / f"{scene.name}.glb", scene)
        return self._keep(folder, made)

    def _assemble(self, folder: Path, progress: Progress) -> Scene:
        from corporeal.pipeline.stages.assemble import assemble, scene_title

        progress(0.0, "reading the scene")
        inputs, config = self.inputs, self.settings.assemble
        if self.made.reconstruct is not None:
            inputs = [_reconstructed_model(self.inputs[0], self.folder / STAGE_FOLDERS["reconstruct"])]
            config = replace(config, extent=())  # they determine the scale of the reconstruction
            scene = assemble(inputs, config)
            if is_scene_file(self.inputs[0]):
                scene = replace(scene, name=scene_title(self.inputs[0]))
            return self._keep(folder, scene)
        return self._keep(folder, assemble(inputs, config, chosen_up_axis(self.settings.reconstruct.up)))

    def _describe(self, folder: Path, progress: Progress) -> Inventory:
        from corporeal.pipeline.stages.describe import describe

        progress(0.0, "recognising")
        config, library = self.settings.describe, self.settings.ground.library
        found = self.made.reconstruct
        shown = range(0 if found is None else len(found.names))  # models beside them come after
        made = describe(self.made.scene, config, library, progress, shown)
        if made.transcript:
            store.write_json(folder / "transcript.json", made.transcript)
        return self._keep(folder, made)

    def _segment(self, folder: Path, progress: Progress) -> Parts:
        from corporeal.pipeline.stages.segment import segment

        progress(0.0, "finding parts")
        made, config = self.made, self.settings.segment
        semantic = self.settings.reconstruct.semantic
        parts = segment(made.scene, made.inventory, config, made.reconstruction, semantic)
        return self._keep(folder, parts)

    def _ground(self, folder: Path, progress: Progress) -> MaterialField:
        from corporeal.pipeline.mass_posterior import ground_with_mass_posterior

        progress(0.0, "choosing material values")
        made = self.made
        found = ground_with_mass_posterior(made.scene, made.parts, made.inventory, self.settings.ground)
        return self._keep(folder, found)

    def _fill(self, folder: Path, progress: Progress) -> Particles:
        from corporeal.pipeline.stages.fill import fill

        progress(0.0, "filling with particles")
        made = self.made
        return self._keep(folder, fill(made.scene, made.parts, made.field, self.settings.fill))

    def _simulate(self, folder: Path, progress: Progress) -> Trajectory:
        from corporeal.pipeline.stages.simulate import simulate

        made, config = self.made, self.settings.simulate
        return simulate(made.scene, made.particles, made.field, config, folder, progress)

    def _video(self, folder: Path, progress: Progress) -> Video:
        from corporeal.pipeline.stages.video import render_video

        return self._keep(folder, render_video(self.made.played, self.settings.video, folder, progress))

    def _report(self, folder: Path, progress: Progress) -> None:
        from corporeal.pipeline.run_files import RunCost, write_run_files
        from corporeal.simulation.audit_file import read_audit

        progress(0.0, "writing the report")
        audit = read_audit(self.folder / STAGE_FOLDERS["simulate"])
        divided = self.settings.assemble.objects != "auto"
        spent = RunCost(_settings_for_report(self.settings), self.seconds, divided)
        figures: dict[str, Path] = {}
        if self.made.reconstruct is not None:
            from corporeal.reconstruction.reconstruction_figures import figures_of_reconstruction

            figures = figures_of_reconstruction(self.folder / STAGE_FOLDERS["reconstruct"])
        write_run_files(self.folder, self.made, audit, spent, progress, figures)


def _reconstructed_model(asked: Path, folder: Path) -> Path:
    """Return the model that was reconstructed, with all that a scene file says beside it."""
    model = next(folder.glob("*.glb"))
    if not is_scene_file(asked):
        return model
    write_scene_file(folder / "scene.toml", replace(read_scene(asked), file=model))
    return folder / "scene.toml"


def _settings_for_report(settings: Settings) -> dict[str, str]:
    fill_, simulate_ = settings.fill, settings.simulate
    return {
        "detail": fill_.detail,
        "stiffness": fill_.stiffness,
        "contact": simulate_.contact,
        "engine": simulate_.engine,
    }
