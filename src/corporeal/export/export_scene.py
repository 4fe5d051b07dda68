"""Export of a run, or of a scene before simulation, to other formats.

Every target has a folder of its own that appears whole or not at all; the run is only read.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote

from corporeal.core import store
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.registry import load_function
from corporeal.export.check_exports import check_target
from corporeal.export.export_target import (
    DEFAULT_EXPORT,
    EXPORT_WRITERS,
    ExportConfig,
    ExportRecord,
    ExportRequest,
    ExportTarget,
    NothingToWriteError,
    TargetRecord,
    TargetWriter,
    WrittenTarget,
    write_record,
)
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_run, motion_of_scene
from corporeal.io.input_files import scene_name
from corporeal.lab.corpus.corpus_plan import PLAN_FILE
from corporeal.lab.corpus.run_corpus import RUNS_FOLDER
from corporeal.pipeline.in_memory import load_scene, prepare_scene
from corporeal.pipeline.run_pipeline import RUN_FILE, STAGE_FOLDERS, read_run
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult


def is_corpus(folder: Path) -> bool:
    """Whether a folder is a corpus."""
    return (folder / PLAN_FILE).exists()


def finished_runs(corpus: Path) -> list[Path]:
    """Return the folders of all scenes that were simulated, by name.

    Raises:
        UserError: There are none.
    """
    folders = sorted(p.parent for p in (corpus / RUNS_FOLDER).glob(f"*/{RUN_FILE}"))
    found = [f for f in folders if (f / STAGE_FOLDERS["simulate"] / store.META_FILE).exists()]
    if not found:
        raise UserError(f"{corpus} has no finished run. Next: corporeal corpus run {corpus}")
    return found


def export_dataset(corpus: Path, targets: Sequence[ExportTarget], out: Path, config: ExportConfig) -> ExportRecord:
    """Write one data set of all finished runs of a corpus for each target.

    Args:
        corpus: Its folder.
        targets: Those of ``EXPORT_WRITERS`` that have ``write_dataset``.
        out: Where the targets' folders and ``export.json`` go.
        config: The instant and what can deform.

    Raises:
        UserError: Nothing is finished, a library is missing, or the disk refuses.
    """
    runs, rows = finished_runs(corpus), {}
    with store.lock_folder(out), store.disk_errors(out):
        for target in targets:
            with store.whole_folder(out / target) as folder:
                write = load_function(EXPORT_WRITERS[target].write_dataset)
                written: WrittenTarget = write(folder, _export_requests(runs, config))
            files = sorted(str(p.relative_to(out)) for p in (out / target).iterdir())
            names = f"Runs in this order: {', '.join(r.name for r in runs)}."
            rows[target] = TargetRecord(0.0, tuple(files), (*written.unsaid, names), written.measured)
        record = ExportRecord(str(corpus), (), rows)
        write_record(out, record)
    return record


def _export_requests(runs: list[Path], config: ExportConfig) -> Iterator[ExportRequest]:
    """Read one run after the other, and forget it."""
    for folder in runs:
        played = read_run(folder).played
        motion = motion_of_run(played, config.at)
        yield ExportRequest(physical_scene(played.prepared, motion), motion, config, played)


EXPORT_FOLDER = "export"
DEFAULT_TARGETS: tuple[ExportTarget, ...] = ("usd", "mjcf", "urdf", "glb")
"""Targets that need no library beside corporeal's own."""
ExportProgress = Callable[[float, str], None]


def ignore_progress(fraction: float, words: str) -> None:
    """Ignore progress."""


def export_scene(
    source: str | Path | SimulationResult | PreparedScene,
    targets: Sequence[ExportTarget] = DEFAULT_TARGETS,
    out: str | Path | None = None,
    config: ExportConfig = DEFAULT_EXPORT,
    progress: ExportProgress = ignore_progress,
) -> ExportRecord:
    """Write a scene for other tools.

    Args:
        source: The folder of a run; a scene's file, of which only one instant is known; the same in memory; or a corpus
            that was run, whose runs make one data set (h5, npz) and have all other targets each in a folder of its
            name.
        targets: Names from ``EXPORT_WRITERS``.
        out: Where the targets' folders and ``export.json`` go; None: SOURCE/export of a run or a corpus, NAME-export of
            a scene called NAME.
        config: The instant, what can deform, tolerances.
        progress: Called with the fraction done and a description.

    Returns:
        What was written, also kept in ``export.json``; of a corpus, of its data set.

    Raises:
        UserError: There is no such run or target, nothing could be written, a library is missing, or the disk refuses.
    """
    for target in targets:
        if target not in EXPORT_WRITERS:
            raise UnknownChoiceError("target", target, list(EXPORT_WRITERS))
    if isinstance(source, str | Path) and is_corpus(Path(source)):
        folder = Path(source) / EXPORT_FOLDER if out is None else Path(out)
        return _export_corpus(Path(source), targets, folder, config, progress)
    progress(0.0, "reading")
    asked, name = _export_request(source, config)
    folder = Path(out) if out is not None else _default_folder(source, name)
    return _export_targets(asked, name, targets, folder, progress)


def _export_targets(
    asked: ExportRequest, name: str, targets: Sequence[ExportTarget], folder: Path, progress: ExportProgress
) -> ExportRecord:
    with store.lock_folder(folder), store.disk_errors(folder):
        rows = {}
        for k, target in enumerate(targets):
            progress((k + 0.5) / (len(targets) + 0.5), target)
            rows[target] = _write_target(asked, target, folder)
        record = ExportRecord(name, asked.scene.unsaid, rows)
        write_record(folder, record)
    if rows and all(row.skipped for row in rows.values()):
        raise UserError(" ".join(row.skipped for row in rows.values()))
    return record


def _export_corpus(
    corpus: Path, targets: Sequence[ExportTarget], out: Path, config: ExportConfig, progress: ExportProgress
) -> ExportRecord:
    each: list[ExportTarget] = [t for t in targets if not EXPORT_WRITERS[t].write_dataset]
    runs = finished_runs(corpus)
    for k, run in enumerate(runs if each else ()):
        progress(k / (len(runs) + 1), run.name)
        asked, name = _export_request(run, config)
        _export_targets(asked, name, each, out / run.name, ignore_progress)
    progress(len(runs) / (len(runs) + 1), "data set")
    return export_dataset(corpus, [t for t in targets if t not in each], out, config)


def _export_request(
    source: str | Path | SimulationResult | PreparedScene, config: ExportConfig
) -> tuple[ExportRequest, str]:
    if isinstance(source, SimulationResult):
        return _request_of_run(source, config), source.prepared.scene.name
    if isinstance(source, PreparedScene):
        return _request_of_scene(source, config), source.scene.name
    path = Path(source)
    if not (path / RUN_FILE).exists():
        return _request_of_scene(prepare_scene(load_scene(path)), config), str(path)
    made = read_run(path)
    if made.fill is None:
        raise UserError(f"{path} has no particles yet. Next: corporeal fill {quote(str(path))}")
    if made.simulate is None:
        return _request_of_scene(made.prepared, config), str(path)
    return _request_of_run(made.played, config), str(path)


def _request_of_run(played: SimulationResult, config: ExportConfig) -> ExportRequest:
    motion = motion_of_run(played, config.at)
    return ExportRequest(physical_scene(played.prepared, motion), motion, config, played)


def _request_of_scene(prepared: PreparedScene, config: ExportConfig) -> ExportRequest:
    if config.at not in ("start", "0"):
        raise UserError(f"--at is {config.at}, but nothing was simulated: only start is known.")
    motion = motion_of_scene(prepared)
    return ExportRequest(physical_scene(prepared, motion), motion, config)


def _default_folder(source: str | Path | SimulationResult | PreparedScene, name: str) -> Path:
    if isinstance(source, str | Path):
        path = Path(source)
        return path / EXPORT_FOLDER if (path / RUN_FILE).exists() else Path(f"{scene_name(path)}-{EXPORT_FOLDER}")
    return Path(f"{name}-{EXPORT_FOLDER}")


def _write_target(asked: ExportRequest, target: ExportTarget, out: Path) -> TargetRecord:
    writer: TargetWriter = load_function(EXPORT_WRITERS[target].write, f"The target {target!r}")
    try:
        with store.whole_folder(out / target) as folder:
            written = writer(asked, folder)
    except NothingToWriteError as error:
        return TargetRecord(asked.scene.time, skipped=str(error))
    row = _target_record(asked, written, out, target)
    if not asked.config.check:
        return row
    found = check_target(target, out / target, asked)
    return replace(row, checked=found.measured, doubts=found.doubts)


def _target_record(asked: ExportRequest, written: WrittenTarget, out: Path, target: str) -> TargetRecord:
    files = sorted(str(p.relative_to(out)) for p in (out / target).rglob("*") if p.is_file())
    return TargetRecord(asked.scene.time, tuple(files), written.unsaid, written.measured)
