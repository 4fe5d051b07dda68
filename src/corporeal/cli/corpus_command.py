"""`corporeal corpus assemble | run | report`: many scenes at once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import Annotated, Any, Literal

import tyro

from corporeal.cli.parse import parse, run_subcommand
from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.core.terminal import console, progress_bars, show_table

Corpus = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="CORPUS")]


@dataclass(frozen=True)
class WorkerOptions:
    """Worker processes."""

    workers: int = 0
    """Number of parallel scenes, each in its own process; 0: cores divided by --threads."""
    threads: int = 1
    """Threads per scene."""
    on: Literal["local", "ray"] = "local"
    """Execution backend: processes of this machine, or a Ray cluster (extra [cluster])."""
    address: str = ""
    """Address of a Ray cluster, "auto" for the one of this machine; by default a local one is started. The corpus must
    be on a file system shared by all machines.
    """
    gpus: float = 0.0
    """Share of a GPU per scene on Ray."""


def command_corpus() -> None:
    """Assemble, run and report many scenes: `corpus assemble`, `corpus run`, `corpus report`."""
    run_subcommand("corpus", {"assemble": _assemble, "run": _run, "report": _report})


def _assemble() -> None:
    """Plan a balanced corpus and assemble its scenes.

        corporeal corpus assemble corpus/ --pool pool/
        corporeal corpus assemble showcase/ --preset seven

    Classes, models, numbers of objects and interactions are balanced. Each scene is made in its own process and written
    to CORPUS/scenes atomically. Repeat the command to resume an interrupted corpus and to retry failed scenes.
    CORPUS/manifest.json holds the state of each scene.
    """
    from corporeal.discretization.object_scaling import SceneSizing
    from corporeal.lab.corpus.assemble_corpus import Sources, assemble_corpus
    from corporeal.lab.corpus.corpus_plan import CorpusConfig
    from corporeal.pipeline.stages.capture import CaptureConfig
    from corporeal.pipeline.stages.compose import ComposeConfig
    from corporeal.pool.pool_index import read_pool

    @dataclass(frozen=True)
    class Assemble:
        corpus: Corpus
        pool: Path = Path("pool")
        """Pool from `corporeal assets index`."""
        plan: CorpusConfig = field(default_factory=CorpusConfig)
        sizing: SceneSizing = field(default_factory=SceneSizing)
        vlm: str = ComposeConfig.vlm
        """Source of the sizes of classes; by default a table."""
        record: Path | None = None
        """Record a model's answers in this folder, for --vlm replay:FOLDER."""
        views: int = CaptureConfig.views
        """Number of posed views per scene."""
        size: tuple[int, int] = CaptureConfig.size
        """Width and height of the views [px]."""
        crew: WorkerOptions = WorkerOptions()

    first = ("pool", "preset", "scenes", "seed", "views", "workers")
    asked = parse(Assemble, "corpus assemble", _assemble.__doc__, words=2, first=first)
    pool = read_pool(asked.pool) if asked.plan.preset == "fortytwo" else None
    composing = ComposeConfig(sizing=asked.sizing, vlm=asked.vlm, record=asked.record)
    capturing = CaptureConfig(views=asked.views, size=asked.size, threads=asked.crew.threads)
    sources = Sources(pool, composing, capturing)
    _execute(
        asked,
        "assemble",
        lambda hands: assemble_corpus(asked.corpus, asked.plan, sources, hands),
        f"Next: corporeal corpus run {quote(str(asked.corpus))}",
    )


def _run() -> None:
    """Run every scene of a corpus, several at a time.

        corporeal corpus run corpus/ --detail draft --workers 4

    CORPUS/runs/<scene> is a run like any other. A failing scene doesn't stop the others. Repeat the command to resume:
    finished scenes are skipped, and an interrupted simulation continues from its checkpoint.
    """
    from corporeal.lab.corpus.run_corpus import RunConfig, run_corpus
    from corporeal.pipeline.settings import Settings

    @dataclass(frozen=True)
    class Run:
        corpus: Corpus
        scenes: RunConfig = field(default_factory=RunConfig)
        crew: WorkerOptions = WorkerOptions()
        settings: Annotated[Settings, tyro.conf.arg(name="")] = field(default_factory=Settings)

    first = ("detail", "vlm", "first", "workers", "threads", "on")
    asked = parse(Run, "corpus run", _run.__doc__, words=2, first=first)
    _execute(
        asked,
        "run",
        lambda hands: run_corpus(asked.corpus, asked.scenes, asked.settings, hands),
        f"Next: corporeal corpus report {quote(str(asked.corpus))}",
    )


def _report() -> None:
    """Write CORPUS/report.html, report.csv and report.json for all scenes run so far."""
    from corporeal.lab.corpus.corpus_report import report_corpus

    @dataclass(frozen=True)
    class Report:
        corpus: Corpus

    asked = parse(Report, "corpus report", _report.__doc__, words=2)
    with progress_bars() as tell:
        written = report_corpus(asked.corpus, tell("report"))
    print(*written, sep="\n")


def _execute(asked: Any, verb: str, do: Callable[..., dict[str, Any]], then: str) -> None:
    """Run the jobs with a progress bar or log lines, and print a summary."""
    from corporeal.jobs.executor import Executor
    from corporeal.jobs.local_workers import LOG_FOLDER

    with progress_bars() as tell:
        rows = do(Executor(worker_factory(asked.crew, asked.corpus), tell(verb), log_event))
    failed = {name: row for name, row in rows.items() if row.status == "failed"}
    print(f"{len(rows) - len(failed)} of {len(rows)} scenes finished: {asked.corpus}")
    if failed:
        show_table(("scene", "why it failed"), [(n, r.error) for n, r in failed.items()])
    if len(failed) == len(rows):
        raise UserError(f"No scene finished. Their logs are in {asked.corpus / LOG_FOLDER}.")
    print(then)


def log_event(words: str) -> None:
    """Log an event as a line; in a terminal only failures are printed beside the bar."""
    if not console.is_terminal or "failed" in words or "again" in words:
        console.print(words, markup=False, highlight=False, soft_wrap=True)


def worker_factory(crew: WorkerOptions, folder: Path) -> Callable[[], Any]:
    """Return a factory of workers that log to a folder in ``folder``.

    Raises:
        UserError: A number of workers, threads or GPUs is invalid.
    """
    if crew.workers < 0 or crew.threads < 1 or crew.gpus < 0:
        raise UserError("--workers, --threads and --gpus cannot be negative, --threads not 0.")
    slots = crew.workers or max(1, usable_cores() // crew.threads)
    if crew.on == "ray":
        from corporeal.jobs.ray_workers import ray_worker_pool

        return lambda: ray_worker_pool(slots, crew.threads, crew.gpus, crew.address)
    from corporeal.jobs.local_workers import LOG_FOLDER, local_worker_pool

    return lambda: local_worker_pool(slots, crew.threads, folder / LOG_FOLDER)
