"""Runs of all assembled scenes of a corpus, each in its own process.

``<corpus>/scenes/<scene>/scene.toml`` becomes ``<corpus>/runs/<scene>/``, a run like any other. A scene that is
interrupted goes on from its checkpoint.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.jobs.executor import Executor, execute_jobs
from corporeal.jobs.job import Job, ManifestRow
from corporeal.lab.corpus.corpus_plan import CorpusPlan, PlannedScene, read_plan
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.showcase.showcase_scenes import view_direction

SCENES_FOLDER, RUNS_FOLDER = "scenes", "runs"
SCENE_TOML_FILE, VIEWS_FOLDER = "scene.toml", "views"
ORPHAN_WORKER_TIMEOUT_S = 60.0
"""Longest wait for a worker of a killed corpus run to be gone [s]."""
TIME_SHARE_OF_VERB: Mapping[str, tuple[float, float]] = {
    "assemble": (0.0, 0.01),
    "describe": (0.01, 0.03),
    "segment": (0.03, 0.05),
    "ground": (0.05, 0.06),
    "fill": (0.06, 0.15),
    "simulate": (0.15, 0.4),
    "video": (0.4, 0.92),
    "report": (0.92, 1.0),
}
"""Where each stage begins and ends in the time of a run at draft detail, roughly."""


@dataclass(frozen=True)
class RunConfig:
    """Which scenes are run."""

    first: int | None = None
    """Only so many, from the start of the plan."""
    resume: bool = True
    """Keep what is finished and go on with what was interrupted; else begin all scenes anew."""


def run_corpus(folder: Path, config: RunConfig, settings: Settings, hands: Executor) -> dict[str, ManifestRow]:
    """Run the scenes of a corpus; return what became of each.

    Raises:
        UserError: The folder is no corpus, no scene of it is assembled, or another process works
            in it.
    """
    plan = read_plan(folder)
    if config.first is not None and config.first < 1:
        raise UserError(f"--first is {config.first}. Give a number from 1.")
    planned = plan.scenes[: config.first]
    there = [s for s in planned if (folder / SCENES_FOLDER / s.name / store.META_FILE).exists()]
    if not there:
        raise UserError(f"No scene of {folder} is assembled. Next: corporeal corpus assemble {folder}.")
    if len(there) < len(planned):
        hands.say(f"{len(planned) - len(there)} of {len(planned)} scenes are not assembled: left out.")
    with store.lock_folder(folder):
        configs = [getattr(settings, f.name) for f in fields(Settings)]
        read = [name for config in configs for name in run_pipeline.digests_of_named_files(config)]
        jobs = [_job(folder, scene, _with_showcase_view(plan, scene, settings), read) for scene in there]
        if not config.resume:
            forget_runs(jobs)
        return execute_jobs(folder, "run", jobs, hands)


def _with_showcase_view(plan: CorpusPlan, scene: PlannedScene, settings: Settings) -> Settings:
    """Let a scene of the showcase be seen from where it shows best."""
    if plan.config.preset != "seven" or settings.video.view is not None:
        return settings
    return replace(settings, video=replace(settings.video, view=view_direction(scene.name)))


def _job(folder: Path, scene: PlannedScene, settings: Settings, read: Sequence[str]) -> Job:
    """Describe what is to be done for one scene; ``read`` names the files that settings point to."""
    path = folder / SCENES_FOLDER / scene.name
    made = store.read_meta(path).key
    asked = replace(settings, describe=replace(settings.describe, record=None))
    return Job(
        name=scene.name,
        function=run_scene,
        folder=folder / RUNS_FOLDER / scene.name,
        key=store.result_key("corpus run", asked, [made, *read]),
        arguments={"scene": (path / SCENE_TOML_FILE).resolve(), "settings": settings},
        resumable=True,
    )


def run_scene(folder: Path, progress: Progress, scene: Path, settings: Settings) -> None:
    """Take one scene through the pipeline, in the process of a worker."""
    with store.lock_folder(folder, ORPHAN_WORKER_TIMEOUT_S):
        pass
    run_pipeline.run([scene], folder, settings, _overall_progress(progress))


def _overall_progress(progress: Progress) -> run_pipeline.ProgressOfStage:
    """Spread the stages over one bar."""

    def tell(verb: str) -> Progress:
        low, high = TIME_SHARE_OF_VERB[verb]
        return lambda done, words: progress(low + (high - low) * done, f"{verb} {words}")

    return tell


def forget_runs(jobs: Sequence[Job]) -> None:
    """Have every stage of these runs done again."""
    for job in jobs:
        if job.folder.exists():
            run_pipeline.delete_simulation(job.folder)
            for name in run_pipeline.STAGE_FOLDERS.values():
                (job.folder / name / store.META_FILE).unlink(missing_ok=True)
            (job.folder / store.META_FILE).unlink(missing_ok=True)
