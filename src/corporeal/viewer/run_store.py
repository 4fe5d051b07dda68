"""Runs shown by the server, with cached results."""

from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from corporeal.core import store
from corporeal.core.audit_data import RunAudit
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import UserError
from corporeal.discretization.discretization_plan import DetailLevel
from corporeal.mpm.engines import DEFAULT_ENGINE
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import RUN_FILE, STAGE_FOLDERS, read_run, read_run_request
from corporeal.pipeline.stages.ground import DEFAULT_CONFIG, GroundConfig
from corporeal.pipeline.viewer_data import bind_scene, record_trajectory, viewer_recording
from corporeal.scene.initial_state import parse_lift
from corporeal.simulation.audit_file import AUDIT_FILE

INBOX_FOLDER = ".inbox"
"""Folder of uploads, among the runs."""
UPLOADED_NAME = "uploaded"
MAX_CACHED_RUNS = 4
"""Runs that are held in memory, the latest."""
REQUIRED_STAGE = "fill"
"""The stage without which there is nothing to look at."""
THUMBNAIL_FILE = "thumbnail.png"
MAX_RECORDING_FPS = 60.0
"""Most pictures a second of a recording from a server [1/s]."""


@dataclass(frozen=True)
class LoadedRun:
    """A run that has been read."""

    made: StageResults
    take: bytes
    """What the page plays: see ``render.take``."""


@dataclass(frozen=True)
class LiveInput:
    """What a live simulation begins with."""

    results: StageResults
    detail: DetailLevel
    """With which it was filled."""
    ground: GroundConfig = DEFAULT_CONFIG
    """From which its materials came."""
    engine: str = DEFAULT_ENGINE
    """Which simulates it."""


class RunStore:
    """Runs by name: those that were named, or all below a folder."""

    def __init__(self, runs: tuple[Path, ...], folder: Path | None = None) -> None:
        self.named, self.folder = {run.resolve().name: run for run in runs}, folder
        self.read: OrderedDict[tuple[str, float], LoadedRun] = OrderedDict()
        self.lock = Lock()

    def runs(self) -> dict[str, Path]:
        """Return all runs that there are now, the newest first."""
        if self.folder is None:
            return dict(self.named)
        found = [path.parent for path in self.folder.glob(f"*/{RUN_FILE}") if path.parent.is_dir()]
        found.sort(key=lambda run: -(run / RUN_FILE).stat().st_mtime)
        return {run.name: run for run in found}

    def path(self, name: str) -> Path:
        """Return a run's folder.

        Raises:
            UserError: There is no such run.
        """
        known = self.runs()
        if name not in known:
            raise UserError(f"There is no run {name!r} here.")
        return known[name]

    def listed(self) -> list[dict[str, Any]]:
        """Say of every run how far it is."""
        return [_row(name, run) for name, run in self.runs().items()]

    def open(self, name: str) -> LoadedRun:
        """Read a run, or return what was read of it since it last changed.

        Raises:
            UserError: There is no such run, it cannot be read, or it is not filled yet.
        """
        run = self.path(name)
        key = (name, _changed(run))
        with self.lock:
            if key not in self.read:
                self.read[key] = load_run(run)
                while len(self.read) > MAX_CACHED_RUNS:
                    self.read.popitem(last=False)
            self.read.move_to_end(key)
            return self.read[key]

    def made(self, name: str) -> LiveInput:
        """Return what a run's stages made, and with which detail it was filled.

        Raises:
            UserError: There is no such run, it cannot be read, or it is not filled yet.
        """
        settings = read_run_request(self.path(name)).settings
        made, engine = self.open(name).made, settings.simulate.engine
        return LiveInput(made, settings.fill.detail, settings.ground, engine)

    def asked(self, name: str) -> dict[str, Any]:
        """Return how a run was asked to begin: detail, drop; lift and velocity of every object."""
        settings = read_run_request(self.path(name)).settings
        lift = dict(map(parse_lift, settings.assemble.lift))
        objects = self.open(name).made.assembled.scene.objects
        return {
            "detail": settings.fill.detail,
            "drop": settings.assemble.drop,
            "lift": [lift.get(o.name, 0.0) for o in objects],
            "velocity": [list(o.velocity) for o in objects],
        }


def load_run(run: Path) -> LoadedRun:
    """Read a run and make it ready to be played.

    Raises:
        UserError: It cannot be read, or it is not filled yet.
    """
    made = read_run(run)
    if made.fill is None:
        raise UserError(f"{run} has no {REQUIRED_STAGE} yet: nothing of it can be shown in 3D.")
    cast = bind_scene(made.prepared)
    if made.simulate is None:
        return LoadedRun(made, viewer_recording(made.prepared, cast, found=made.rendered_reconstruction))
    audit = run / AUDIT_FILE
    whole = from_plain(RunAudit, store.read_json(audit)) if audit.exists() else None
    recording = record_trajectory(cast, made.trajectory, MAX_RECORDING_FPS)
    shown = viewer_recording(
        made.prepared, cast, made.played.outcome, recording, whole, found=made.rendered_reconstruction
    )
    return LoadedRun(made, shown)


def _row(name: str, run: Path) -> dict[str, Any]:
    try:
        asked, kept = read_run_request(run), store.read_json(run / RUN_FILE)
    except (UserError, OSError, ValueError, TypeError, KeyError) as error:
        return {"name": name, "state": "unreadable", "error": str(error)[:300], "shown": False}
    return {
        "name": name,
        "state": kept.get("state", ""),
        "error": kept.get("error", ""),
        "input": ", ".join(map(_input_name, asked.inputs)),
        "detail": asked.settings.fill.detail,
        "shown": (run / STAGE_FOLDERS[REQUIRED_STAGE] / store.META_FILE).exists(),
        "picture": (run / STAGE_FOLDERS["video"] / THUMBNAIL_FILE).exists(),
        "report": (run / "report.html").exists(),
    }


def _input_name(path: Path) -> str:
    """Return what to call an input; names of uploads are generated."""
    return UPLOADED_NAME if INBOX_FOLDER in path.parts else path.name


def _changed(run: Path) -> float:
    """When a stage of a run was last finished."""
    metas = [run / folder / store.META_FILE for folder in STAGE_FOLDERS.values()]
    return max((meta.stat().st_mtime for meta in metas if meta.exists()), default=0.0)
