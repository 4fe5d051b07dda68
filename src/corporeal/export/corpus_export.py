"""Export of a corpus: one data set for learning, other targets scene by scene."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.registry import load_function
from corporeal.export.export_record import ExportRecord, TargetRecord, write_record
from corporeal.export.export_target import (
    EXPORT_WRITERS,
    ExportConfig,
    ExportRequest,
    ExportTarget,
    WrittenTarget,
)
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_run
from corporeal.lab.corpus.corpus_plan import PLAN_FILE
from corporeal.lab.corpus.run_corpus import RUNS_FOLDER
from corporeal.pipeline.run_pipeline import RUN_FILE, STAGE_FOLDERS, read_run


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


def export_dataset(
    corpus: Path, targets: Sequence[ExportTarget], out: Path, config: ExportConfig
) -> ExportRecord:
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
            rows[target] = TargetRecord(
                0.0, tuple(files), (*written.unsaid, names), written.measured
            )
        record = ExportRecord(str(corpus), (), rows)
        write_record(out, record)
    return record


def _export_requests(runs: list[Path], config: ExportConfig) -> Iterator[ExportRequest]:
    """Read one run after the other, and forget it."""
    for folder in runs:
        played = read_run(folder).played
        motion = motion_of_run(played, config.at)
        yield ExportRequest(physical_scene(played.prepared, motion), motion, config, played)
