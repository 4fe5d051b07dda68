"""A corpus that was run, for other tools: one data set to learn from, all else scene by scene."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.export.motion import motion_of_run
from corporeal.export.particle_table import save_h5, save_npz
from corporeal.export.physical_scene import physical_scene
from corporeal.export.record import ExportRecord, TargetRecord, write_record
from corporeal.export.target import Asked, ExportConfig, Target, Written
from corporeal.lab.corpus.plan import PLAN
from corporeal.lab.corpus.run import RUNS
from corporeal.pipeline.runner import FOLDERS, RUN, read_back

TOGETHER: dict[Target, Callable[[Path, Iterator[Asked]], Written]] = {
    "h5": save_h5,
    "npz": save_npz,
}
"""Targets that hold many runs in one file."""


def is_corpus(folder: Path) -> bool:
    """Whether a folder is a corpus."""
    return (folder / PLAN).exists()


def finished_runs(corpus: Path) -> list[Path]:
    """Return the folders of all scenes that were simulated, by name.

    Raises:
        UserError: There are none.

    """
    folders = sorted(p.parent for p in (corpus / RUNS).glob(f"*/{RUN}"))
    found = [f for f in folders if (f / FOLDERS["simulate"] / store.META).exists()]
    if not found:
        raise UserError(f"{corpus} has no finished run. Go on with: corporeal corpus run {corpus}")
    return found


def export_together(
    corpus: Path, targets: Sequence[Target], out: Path, config: ExportConfig
) -> ExportRecord:
    """Write one data set of all finished runs of a corpus for each of ``TOGETHER``.

    Args:
        corpus: Its folder.
        targets: Names from ``TOGETHER``.
        out: Where the targets' folders and ``export.json`` go.
        config: The instant and what can deform.

    Raises:
        UserError: Nothing is finished, a library is missing, or the disk refuses.

    """
    runs, rows = finished_runs(corpus), {}
    with store.alone(out), store.writing(out):
        for target in targets:
            with store.whole_folder(out / target) as folder:
                written = TOGETHER[target](folder, _asked(runs, config))
            files = sorted(str(p.relative_to(out)) for p in (out / target).iterdir())
            names = f"Runs in this order: {', '.join(r.name for r in runs)}."
            rows[target] = TargetRecord(
                0.0, tuple(files), (*written.unsaid, names), written.measured
            )
        record = ExportRecord(str(corpus), (), rows)
        write_record(out, record)
    return record


def _asked(runs: list[Path], config: ExportConfig) -> Iterator[Asked]:
    """Read one run after the other, and forget it."""
    for folder in runs:
        played = read_back(folder).played
        motion = motion_of_run(played, config.at)
        yield Asked(physical_scene(played.prepared, motion), motion, config, played)
