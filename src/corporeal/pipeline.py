"""The order of the verbs: the only file that knows it.

A run is a folder. Each verb leaves its result in a numbered folder inside, named by a key that
covers everything it depends on: what is fresh is read back, what is stale is done again, what was
interrupted goes on. ``run.json`` says how far the run came.
"""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from corporeal import store
from corporeal.errors import UserError
from corporeal.features import MENU as ENCODERS
from corporeal.formats.glb_writer import write_glb
from corporeal.formats.scene_file import read_scene_file, write_scene_file
from corporeal.formats.sources import called, kind_of, pictured, sources
from corporeal.formats.splat_ply import write_splat
from corporeal.formats.words import safe
from corporeal.geometry.followed import followed
from corporeal.mpm.frames import read_trajectory
from corporeal.results import FILES as RESULTS
from corporeal.results import write_results
from corporeal.showcase.scenes import build
from corporeal.stages.assemble import AssembleConfig, assemble
from corporeal.stages.describe import DescribeConfig, describe
from corporeal.stages.fill import FillConfig, fill
from corporeal.stages.film import FilmConfig, film
from corporeal.stages.ground import GroundConfig, ground
from corporeal.stages.reconstruct import ReconstructConfig, reconstruct
from corporeal.stages.segment import SegmentConfig, segment
from corporeal.stages.simulate import SimulateConfig, simulate
from corporeal.types import Film, MaterialField, Particles, Parts, Reconstruction, Scene, Trajectory
from corporeal.vlm.things import Viewer

Progress = Callable[[float, str], None]
"""Told the fraction done and what is being done."""
Tell = Callable[[str], Progress]
"""Given a verb, returns whom to tell about its progress."""

FOLDERS = {
    "reconstruct": "0-reconstruct",
    "assemble": "1-assemble",
    "describe": "4-describe",
    "segment": "5-segment",
    "ground": "6-ground",
    "fill": "7-fill",
    "simulate": "8-simulate",
    "film": "9-film",
    "report": "10-report",
}
VERBS = tuple(FOLDERS)
RUN = "run.json"
WRITTEN = ("record",)
"""Settings that name what is written, not what is read."""
BEFORE_PATHS = ("replay", *ENCODERS)
"""What stands before a colon and a path."""
GAUSSIANS = "gaussians.ply"


@dataclass(frozen=True)
class Settings:
    """One configuration per verb."""

    reconstruct: ReconstructConfig = field(default_factory=ReconstructConfig)
    assemble: AssembleConfig = field(default_factory=AssembleConfig)
    describe: DescribeConfig = field(default_factory=DescribeConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    fill: FillConfig = field(default_factory=FillConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    film: FilmConfig = field(default_factory=FilmConfig)


def run(
    inputs: list[Path],
    folder: Path,
    settings: Settings,
    tell: Tell,
    until: str = "report",
) -> Path:
    """Do every verb up to ``until``; return the run's folder.

    Args:
        inputs: What a person typed: scene files, a folder of photographs, or a splat.
        folder: The run's folder; made when absent.
        settings: Configuration of every verb.
        tell: Whom to tell about progress.
        until: The last verb to do.

    Raises:
        UserError: An input cannot be used, the disk is full, another process works in the folder,
            or the simulation cannot go on.

    """
    with opened(inputs, folder, settings, tell, until):
        return folder


@contextmanager
def opened(
    inputs: list[Path], folder: Path, settings: Settings, tell: Tell, until: str
) -> Iterator[tuple[dict[str, Any], str]]:
    """Do every verb up to ``until`` and keep the run's folder from others meanwhile.

    Yields:
        What each verb made, and the key of the last one's result.

    """
    with store.alone(folder), store.writing(folder):
        work = _Run(inputs, folder, settings, tell)
        work.through(until)
        yield work.made, work.key


def reopen(folder: Path) -> tuple[list[Path], Settings]:
    """Read back what a run was asked to do.

    Raises:
        UserError: The folder is not a run.

    """
    if not (folder / RUN).exists():
        raise UserError(f"{folder} is not a run: it has no {RUN}. Start one with: corporeal run.")
    said = store.read_json(folder / RUN)
    configs = {f.name: f.default_factory for f in fields(Settings)}  # type: ignore[misc]
    known = {
        name: _config(make(), said["settings"].get(name, {}))  # type: ignore[operator]
        for name, make in configs.items()
    }
    return [Path(p) for p in said["inputs"]], Settings(**known)


def _config(default: Any, said: dict) -> Any:
    given = {}
    for known in fields(default):
        value = said.get(known.name, getattr(default, known.name))
        if isinstance(value, list):
            value = tuple(value)
        if isinstance(value, str) and "Path" in str(known.type):
            value = Path(value)
        given[known.name] = value
    return replace(default, **given)


def files_read(config: Any) -> list[str]:
    """Name the content of every file that a configuration points to."""
    named = [f.name for f in fields(config) if f.name not in WRITTEN] if config else []
    values = [str(getattr(config, name)) for name in named]
    paths = [_named(value) for value in values if value]
    return [store.digest(path) for path in paths if path.exists()]


def _named(value: str) -> Path:
    kind, colon, rest = value.partition(":")
    return Path(rest if colon and kind in BEFORE_PATHS else value).expanduser()


def status(folder: Path) -> list[tuple[str, str, float | None]]:
    """For each verb: its name, "finished", "unfinished" or "not yet", and its seconds."""
    inputs, _ = reopen(folder)
    rows = []
    for verb in verbs(inputs):
        name = FOLDERS[verb]
        meta = folder / name / store.META
        if meta.exists():
            rows.append((verb, "finished", store.read_json(meta)["seconds"]))
        else:
            rows.append((verb, "unfinished" if (folder / name).exists() else "not yet", None))
    return rows


def verbs(inputs: list[Path]) -> tuple[str, ...]:
    """Return what is to be done with an input: models need no reconstruction.

    Raises:
        UserError: The inputs don't go together.

    """
    return VERBS[1:] if kind_of(inputs) == "model" else VERBS


def outdate(folder: Path, verb: str) -> None:
    """Declare one verb's result stale, so that it is done again even with the same settings."""
    with store.alone(folder):
        (folder / FOLDERS[verb] / store.META).unlink(missing_ok=True)


def forget_simulation(folder: Path) -> None:
    """Drop a simulation, finished or not, so that the next run starts it again."""
    with store.alone(folder):
        shutil.rmtree(folder / FOLDERS["simulate"], ignore_errors=True)


def write_showcase(name: str, folder: Path) -> Path:
    """Write one of our own scenes as a GLB; return its path.

    Raises:
        UnknownChoiceError: There is no such scene.

    """
    path = folder / f"{name}.glb"
    with store.writing(path):
        folder.mkdir(parents=True, exist_ok=True)
        write_glb(path, build(name))
    return path


class _Run:
    """One pass over the verbs; holds what earlier verbs made for later ones."""

    def __init__(self, inputs: list[Path], folder: Path, settings: Settings, tell: Tell) -> None:
        self.inputs, self.folder, self.settings, self.tell = inputs, folder, settings, tell
        self.key = ""
        self.seconds: dict[str, float] = {}
        self.made: dict[str, Any] = {}

    def through(self, until: str) -> None:
        """Do all verbs up to ``until`` and say in ``run.json`` how it went."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._declare("running")
        try:
            todo = verbs(self.inputs)
            if until not in todo:
                raise UserError("A model needs no reconstruction: run the other verbs.")
            for verb in todo[: todo.index(until) + 1]:
                self._do(verb)
        except KeyboardInterrupt:
            self._declare("interrupted")
            raise
        except Exception as error:
            self._declare("failed", str(error))
            raise
        last = self.folder / FOLDERS["report"] / store.META
        self._declare("finished" if last.exists() else f"done up to {until}")

    def _declare(self, state: str, error: str = "") -> None:
        settings = {f.name: asdict(getattr(self.settings, f.name)) for f in fields(Settings)}
        said = {
            "state": state,
            "inputs": [str(path.resolve()) for path in self.inputs],
            "settings": settings,
            "error": error,
        }
        store.write_json(self.folder / RUN, said)

    def _do(self, verb: str) -> None:
        config = getattr(self.settings, verb, None)
        before = [self.key] if self.key else [store.digest(p) for p in self._files()]
        self.key = store.key(verb, config, before + files_read(config) + self._borrowed(verb))
        folder = self.folder / FOLDERS[verb]
        step = getattr(self, f"_{verb}")
        if store.fresh(folder, self.key):
            self.made[verb] = self._read(verb, folder)
            self.seconds[verb] = store.read_json(folder / store.META)["seconds"]
            return
        self._clear(verb, folder)
        store.begin(folder)
        start = time.perf_counter()
        self.made[verb] = step(folder, self.tell(verb))
        self.seconds[verb] = time.perf_counter() - start
        store.finish(folder, self.key, config, self.seconds[verb])

    def _borrowed(self, verb: str) -> list[str]:
        """Name what a verb takes from another verb's settings."""
        if verb == "reconstruct":
            asked = [] if self.settings.reconstruct.things else [self.settings.describe.vlm]
            return [*self.settings.assemble.extent, *asked]
        if verb != "describe":
            return []
        library = self.settings.ground.library
        return [library, *(store.digest(p) for p in [Path(library)] if p.exists())]

    def _files(self) -> list[Path]:
        missing = [str(p) for p in self.inputs if not p.exists()]
        if missing:
            raise UserError(f"No such file: {', '.join(missing)}. Check the path.")
        return sources(self.inputs)

    def _clear(self, verb: str, folder: Path) -> None:
        """Remove results that no longer follow from the settings.

        An unfinished simulation is kept, and what a reconstruction learned: both go on from there,
        a training only if it is of the same pictures.
        """
        for name in RESULTS:
            (self.folder / name).unlink(missing_ok=True)
        for later in VERBS[VERBS.index(verb) + 1 :]:
            (self.folder / FOLDERS[later] / store.META).unlink(missing_ok=True)
        started = folder / "started.json"
        unfinished = started.exists() and store.read_json(started).get("key") == self.key
        kept = verb == "reconstruct" or (verb == "simulate" and unfinished)
        if not kept and folder.exists():
            shutil.rmtree(folder)
        store.write_json(started, {"key": self.key})

    def _read(self, verb: str, folder: Path) -> Any:
        if verb == "simulate":
            return read_trajectory(folder)
        return None if verb == "report" else store.load(folder / store.DATA)

    def _keep(self, folder: Path, value: Any) -> Any:
        store.save(folder / store.DATA, value)
        return value

    # ------------------------------------------------------------ the verbs

    def _reconstruct(self, folder: Path, progress: Progress) -> Reconstruction:
        source, asked = pictured(self.inputs), self.settings.describe
        assert source is not None, "models need no reconstruction"
        config, extents = self.settings.reconstruct, self.settings.assemble.extent
        if self.settings.assemble.objects != "auto":
            raise UserError("--objects is for models. Say what tells things apart with --apart.")
        viewer = Viewer(safe(called(source)), asked.vlm, asked.record)
        made, scene = reconstruct(source, config, extents, viewer, folder, progress)
        if viewer.asked().transcript:
            store.write_json(folder / "transcript.json", viewer.asked().transcript)
        write_splat(folder / GAUSSIANS, made.gaussians)
        write_glb(folder / f"{scene.name}.glb", scene)
        return self._keep(folder, made)

    def _assemble(self, folder: Path, progress: Progress) -> Scene:
        progress(0.0, "reading the scene")
        inputs, config = self.inputs, self.settings.assemble
        if "reconstruct" in self.made:
            inputs = [_modelled(self.inputs[0], self.folder / FOLDERS["reconstruct"])]
            config = replace(config, extent=())  # the reconstruction has its size from them
        return self._keep(folder, assemble(inputs, config))

    def _found(self) -> Reconstruction | None:
        """Return what was reconstructed, where the scene's objects stand now."""
        made = self.made.get("reconstruct")
        return None if made is None else followed(made, self.made["assemble"])

    def _describe(self, folder: Path, progress: Progress) -> Any:
        progress(0.0, "recognising")
        scene, library = self.made["assemble"], self.settings.ground.library
        pictures = "reconstruct" in self.made
        made = describe(scene, self.settings.describe, library, progress, pictures)
        if made.transcript:
            store.write_json(folder / "transcript.json", made.transcript)
        return self._keep(folder, made)

    def _segment(self, folder: Path, progress: Progress) -> Parts:
        progress(0.0, "finding parts")
        scene, inventory = self.made["assemble"], self.made["describe"]
        config, semantic = self.settings.segment, self.settings.reconstruct.semantic
        return self._keep(folder, segment(scene, inventory, config, self._found(), semantic))

    def _ground(self, folder: Path, progress: Progress) -> MaterialField:
        progress(0.0, "looking numbers up")
        scene, inventory, parts = (self.made[v] for v in ("assemble", "describe", "segment"))
        made = ground(scene, parts, inventory, self.settings.ground)
        return self._keep(folder, made)

    def _fill(self, folder: Path, progress: Progress) -> Particles:
        progress(0.0, "filling with particles")
        scene, parts, made = (self.made[v] for v in ("assemble", "segment", "ground"))
        return self._keep(folder, fill(scene, parts, made, self.settings.fill))

    def _simulate(self, folder: Path, progress: Progress) -> Trajectory:
        scene, particles, made = (self.made[v] for v in ("assemble", "fill", "ground"))
        return simulate(scene, particles, made, self.settings.simulate, folder, progress)

    def _film(self, folder: Path, progress: Progress) -> Film:
        names = ("assemble", "segment", "fill", "ground", "simulate")
        scene, parts, particles, made, trajectory = (self.made[v] for v in names)
        config, found = self.settings.film, self._found()
        splat, owner = (found.gaussians, found.object_of_gaussian) if found else (None, None)
        taken = scene, parts, particles, made, trajectory, config, folder, progress
        return self._keep(folder, film(*taken, splat, owner))

    def _report(self, folder: Path, progress: Progress) -> None:
        progress(0.0, "writing the report")
        audit = store.read_json(self.folder / FOLDERS["simulate"] / "audit.json")
        settings = _spoken(self.settings)
        write_results(self.folder, self.made, audit, settings, self.seconds, progress)


def _modelled(asked: Path, folder: Path) -> Path:
    """Return the model that was reconstructed, with all that a scene file says beside it."""
    model = next(folder.glob("*.glb"))
    if asked.suffix.lower() != ".toml":
        return model
    write_scene_file(folder / "scene.toml", replace(read_scene_file(asked), file=model))
    return folder / "scene.toml"


def _spoken(settings: Settings) -> dict[str, str]:
    fill_, simulate_ = settings.fill, settings.simulate
    return {
        "detail": fill_.detail,
        "stiffness": fill_.stiffness,
        "contact": simulate_.contact,
        "engine": simulate_.engine,
    }
