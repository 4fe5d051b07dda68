"""The runs that a server shows, and what of them has been read."""

from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.findings import RunAudit
from corporeal.core.typed import typed
from corporeal.discretization.plan import Detail
from corporeal.pipeline.playback import cast_of, playback, recorded
from corporeal.pipeline.results import Results
from corporeal.pipeline.runner import FOLDERS, RUN, read_back, reopen
from corporeal.pipeline.stages.ground import DEFAULT, GroundConfig
from corporeal.scene.beginnings import said_lift
from corporeal.simulation.audit_file import AUDIT

INBOX = ".inbox"
"""Folder of uploads, among the runs."""
UPLOADED = "uploaded"
KEPT = 4
"""Runs that are held in memory, the latest."""
NEEDED = "fill"
"""The verb without which there is nothing to look at."""
THUMBNAIL = "thumbnail.png"
SMOOTH = 60.0
"""Most pictures a second of a recording from a server [1/s]."""


@dataclass(frozen=True)
class Read:
    """A run that has been read."""

    made: Results
    take: bytes
    """What the page plays: see ``render.take``."""


@dataclass(frozen=True)
class Made:
    """What a live simulation begins with."""

    results: Results
    detail: Detail
    """With which it was filled."""
    ground: GroundConfig = DEFAULT
    """From which its materials came."""


class Shelf:
    """Runs by name: those that were named, or all below a folder."""

    def __init__(self, runs: tuple[Path, ...], folder: Path | None = None) -> None:
        self.named, self.folder = {run.resolve().name: run for run in runs}, folder
        self.read: OrderedDict[tuple[str, float], Read] = OrderedDict()
        self.lock = Lock()

    def runs(self) -> dict[str, Path]:
        """Return all runs that there are now, the newest first."""
        if self.folder is None:
            return dict(self.named)
        found = [path.parent for path in self.folder.glob(f"*/{RUN}") if path.parent.is_dir()]
        found.sort(key=lambda run: -(run / RUN).stat().st_mtime)
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

    def open(self, name: str) -> Read:
        """Read a run, or return what was read of it since it last changed.

        Raises:
            UserError: There is no such run, it cannot be read, or it is not filled yet.

        """
        run = self.path(name)
        key = (name, _changed(run))
        with self.lock:
            if key not in self.read:
                self.read[key] = read(run)
                while len(self.read) > KEPT:
                    self.read.popitem(last=False)
            self.read.move_to_end(key)
            return self.read[key]

    def made(self, name: str) -> Made:
        """Return what a run's verbs made, and with which detail it was filled.

        Raises:
            UserError: There is no such run, it cannot be read, or it is not filled yet.

        """
        settings = reopen(self.path(name)).settings
        return Made(self.open(name).made, settings.fill.detail, settings.ground)

    def asked(self, name: str) -> dict[str, Any]:
        """Say how a run was asked to begin: detail, drop; lift and velocity of every object."""
        settings = reopen(self.path(name)).settings
        lift = dict(map(said_lift, settings.assemble.lift))
        objects = self.open(name).made.assembled.scene.objects
        return {
            "detail": settings.fill.detail,
            "drop": settings.assemble.drop,
            "lift": [lift.get(o.name, 0.0) for o in objects],
            "velocity": [list(o.velocity) for o in objects],
        }


def read(run: Path) -> Read:
    """Read a run and make it ready to be played.

    Raises:
        UserError: It cannot be read, or it is not filled yet.

    """
    made = read_back(run)
    if made.fill is None:
        raise UserError(f"{run} has no {NEEDED} yet: nothing of it can be shown in 3D.")
    cast = cast_of(made.prepared)
    if made.simulate is None:
        return Read(made, playback(made.prepared, cast, found=made.filmed))
    audit = run / AUDIT
    whole = typed(RunAudit, store.read_json(audit)) if audit.exists() else None
    recording = recorded(cast, made.trajectory, SMOOTH)
    shown = playback(made.prepared, cast, made.played.outcome, recording, whole, found=made.filmed)
    return Read(made, shown)


def _row(name: str, run: Path) -> dict[str, Any]:
    try:
        asked, kept = reopen(run), store.read_json(run / RUN)
    except (UserError, OSError, ValueError, TypeError, KeyError) as error:
        return {"name": name, "state": "unreadable", "error": str(error)[:300], "shown": False}
    return {
        "name": name,
        "state": kept.get("state", ""),
        "error": kept.get("error", ""),
        "input": ", ".join(map(_called, asked.inputs)),
        "detail": asked.settings.fill.detail,
        "shown": (run / FOLDERS[NEEDED] / store.META).exists(),
        "picture": (run / FOLDERS["film"] / THUMBNAIL).exists(),
        "report": (run / "report.html").exists(),
    }


def _called(path: Path) -> str:
    """Return what to call an input; names of uploads are ours and tell nobody anything."""
    return UPLOADED if INBOX in path.parts else path.name


def _changed(run: Path) -> float:
    """When a verb of a run was last finished."""
    metas = [run / folder / store.META for folder in FOLDERS.values()]
    return max((meta.stat().st_mtime for meta in metas if meta.exists()), default=0.0)
