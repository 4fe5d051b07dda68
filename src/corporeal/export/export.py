"""Export: a run, or a scene before any simulation, into the formats of other tools.

Every target has a folder of its own that appears whole or not at all; the run is only read.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote

from corporeal.core import registry, store
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.export.corpus_data import TOGETHER, export_together, finished_runs, is_corpus
from corporeal.export.motion import motion_of_run, motion_of_scene
from corporeal.export.physical_scene import physical_scene
from corporeal.export.readers import check
from corporeal.export.record import ExportRecord, TargetRecord, write_record
from corporeal.export.target import (
    DEFAULT,
    MENU,
    Asked,
    ExportConfig,
    NothingToWriteError,
    Target,
    Writer,
    Written,
)
from corporeal.io.sources import called
from corporeal.pipeline.in_memory import load_scene, prepare
from corporeal.pipeline.runner import RUN, read_back
from corporeal.simulation.played import Played, Prepared

FOLDER = "export"
USUAL: tuple[Target, ...] = ("usd", "mjcf", "urdf", "glb")
"""Targets that need no library beside corporeal's own."""
Progress = Callable[[float, str], None]


def silent(fraction: float, words: str) -> None:
    """Tell nobody about progress."""


def export(
    source: str | Path | Played | Prepared,
    targets: Sequence[Target] = USUAL,
    out: str | Path | None = None,
    config: ExportConfig = DEFAULT,
    progress: Progress = silent,
) -> ExportRecord:
    """Write a scene for other tools.

    Args:
        source: The folder of a run; a scene's file, of which only one instant is known; the same in
            memory; or a corpus that was run, whose runs make one data set (h5, npz) and have all
            other targets each in a folder of its name.
        targets: Names from ``MENU``.
        out: Where the targets' folders and ``export.json`` go; None: SOURCE/export of a run or a
            corpus, NAME-export of a scene called NAME.
        config: The instant, what can deform, tolerances.
        progress: Told the fraction done and what is being done.

    Returns:
        What was written, also kept in ``export.json``; of a corpus, of its data set.

    Raises:
        UserError: There is no such run or target, nothing could be written, a library is missing,
            or the disk refuses.

    """
    for target in targets:
        if target not in MENU:
            raise UnknownChoiceError("target", target, list(MENU))
    if isinstance(source, str | Path) and is_corpus(Path(source)):
        folder = Path(source) / FOLDER if out is None else Path(out)
        return _export_corpus(Path(source), targets, folder, config, progress)
    progress(0.0, "reading")
    asked, name = _asked(source, config)
    folder = Path(out) if out is not None else _usual_folder(source, name)
    return _export(asked, name, targets, folder, progress)


def _export(
    asked: Asked, name: str, targets: Sequence[Target], folder: Path, progress: Progress
) -> ExportRecord:
    with store.alone(folder), store.writing(folder):
        rows = {}
        for k, target in enumerate(targets):
            progress((k + 0.5) / (len(targets) + 0.5), target)
            rows[target] = _write(asked, target, folder)
        record = ExportRecord(name, asked.scene.unsaid, rows)
        write_record(folder, record)
    if rows and all(row.skipped for row in rows.values()):
        raise UserError(" ".join(row.skipped for row in rows.values()))
    return record


def _export_corpus(
    corpus: Path, targets: Sequence[Target], out: Path, config: ExportConfig, progress: Progress
) -> ExportRecord:
    each: list[Target] = [t for t in targets if t not in TOGETHER]
    runs = finished_runs(corpus)
    for k, run in enumerate(runs if each else ()):
        progress(k / (len(runs) + 1), run.name)
        asked, name = _asked(run, config)
        _export(asked, name, each, out / run.name, silent)
    progress(len(runs) / (len(runs) + 1), "data set")
    return export_together(corpus, [t for t in targets if t in TOGETHER], out, config)


def _asked(source: str | Path | Played | Prepared, config: ExportConfig) -> tuple[Asked, str]:
    if isinstance(source, Played):
        return _of_run(source, config), source.prepared.scene.name
    if isinstance(source, Prepared):
        return _of_scene(source, config), source.scene.name
    path = Path(source)
    if not (path / RUN).exists():
        return _of_scene(prepare(load_scene(path)), config), str(path)
    made = read_back(path)
    if made.fill is None:
        raise UserError(f"{path} has no matter yet. Go on with: corporeal fill {quote(str(path))}")
    if made.simulate is None:
        return _of_scene(made.prepared, config), str(path)
    return _of_run(made.played, config), str(path)


def _of_run(played: Played, config: ExportConfig) -> Asked:
    motion = motion_of_run(played, config.at)
    return Asked(physical_scene(played.prepared, motion), motion, config, played)


def _of_scene(prepared: Prepared, config: ExportConfig) -> Asked:
    if config.at not in ("start", "0"):
        raise UserError(f"--at is {config.at}, but nothing was simulated: only start is known.")
    motion = motion_of_scene(prepared)
    return Asked(physical_scene(prepared, motion), motion, config)


def _usual_folder(source: str | Path | Played | Prepared, name: str) -> Path:
    if isinstance(source, str | Path):
        path = Path(source)
        return path / FOLDER if (path / RUN).exists() else Path(f"{called(path)}-{FOLDER}")
    return Path(f"{name}-{FOLDER}")


def _write(asked: Asked, target: Target, out: Path) -> TargetRecord:
    writer: Writer = registry.load("target", target, MENU)
    try:
        with store.whole_folder(out / target) as folder:
            written = writer(asked, folder)
    except NothingToWriteError as error:
        return TargetRecord(asked.scene.time, skipped=str(error))
    row = _row(asked, written, out, target)
    if not asked.config.check:
        return row
    found = check(target, out / target, asked)
    return replace(row, checked=found.measured, doubts=found.doubts)


def _row(asked: Asked, written: Written, out: Path, target: str) -> TargetRecord:
    files = sorted(str(p.relative_to(out)) for p in (out / target).rglob("*") if p.is_file())
    return TargetRecord(asked.scene.time, tuple(files), written.unsaid, written.measured)
