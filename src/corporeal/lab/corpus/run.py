"""Run every assembled scene of a corpus through the pipeline, each in a process of its own.

``<corpus>/scenes/<scene>/scene.toml`` becomes ``<corpus>/runs/<scene>/``, a run like any other. A
scene that is interrupted goes on from its checkpoint.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.jobs.carry_out import Hands, carry_out
from corporeal.jobs.jobs import Job, Progress
from corporeal.jobs.manifest import Row
from corporeal.lab.corpus.plan import Plan, PlannedScene, read_plan
from corporeal.pipeline import runner
from corporeal.pipeline.runner import Settings
from corporeal.pipeline.settings.simulate_config import as_kept
from corporeal.showcase.scenes import view

SCENES, RUNS = "scenes", "runs"
SCENE, VIEWS = "scene.toml", "views"
ORPHAN = 60.0
"""Longest wait for a worker of a killed corpus run to be gone [s]."""
SHARES: Mapping[str, tuple[float, float]] = {
    "assemble": (0.0, 0.01),
    "describe": (0.01, 0.03),
    "segment": (0.03, 0.05),
    "ground": (0.05, 0.06),
    "fill": (0.06, 0.15),
    "simulate": (0.15, 0.4),
    "film": (0.4, 0.92),
    "report": (0.92, 1.0),
}
"""Where each verb begins and ends in the time of a run at draft detail, roughly."""


@dataclass(frozen=True)
class RunConfig:
    """Which scenes are run."""

    first: int | None = None
    """Only so many, from the start of the plan."""
    resume: bool = True
    """Keep what is finished and go on with what was interrupted; else begin all scenes anew."""


def run_corpus(folder: Path, config: RunConfig, settings: Settings, hands: Hands) -> dict[str, Row]:
    """Run the scenes of a corpus; return what became of each.

    Raises:
        UserError: The folder is no corpus, no scene of it is assembled, or another process works
            in it.

    """
    plan = read_plan(folder)
    if config.first is not None and config.first < 1:
        raise UserError(f"--first is {config.first}. Give a number from 1.")
    planned = plan.scenes[: config.first]
    there = [s for s in planned if (folder / SCENES / s.name / store.META).exists()]
    if not there:
        raise UserError(
            f"No scene of {folder} is assembled. Do it with: corporeal corpus assemble {folder}."
        )
    if len(there) < len(planned):
        hands.say(
            f"{len(planned) - len(there)} of {len(planned)} scenes are not assembled: left out."
        )
    with store.alone(folder):
        configs = [getattr(settings, f.name) for f in fields(Settings)]
        read = [name for config in configs for name in runner.files_read(config)]
        jobs = [_job(folder, scene, _looking(plan, scene, settings), read) for scene in there]
        if not config.resume:
            forget(jobs)
        return carry_out(folder, "run", jobs, hands)


def _looking(plan: Plan, scene: PlannedScene, settings: Settings) -> Settings:
    """Let a scene of the showcase be seen from where it shows best."""
    if plan.config.preset != "seven" or settings.film.view is not None:
        return settings
    return replace(settings, film=replace(settings.film, view=view(scene.name)))


def _job(folder: Path, scene: PlannedScene, settings: Settings, read: Sequence[str]) -> Job:
    """Say what is to be done for one scene; ``read`` names the files that settings point to."""
    path = folder / SCENES / scene.name
    made = store.read_meta(path).key
    asked = replace(settings, describe=replace(settings.describe, record=None))
    named = {**store.kept(asked), "simulate": as_kept(settings.simulate)}
    return Job(
        name=scene.name,
        function=run_scene,
        folder=folder / RUNS / scene.name,
        key=store.key("corpus run", named, [made, *read]),
        arguments={"scene": (path / SCENE).resolve(), "settings": settings},
        resumable=True,
    )


def run_scene(folder: Path, progress: Progress, scene: Path, settings: Settings) -> None:
    """Take one scene through the pipeline, in the process of a worker."""
    with store.alone(folder, ORPHAN):
        pass
    runner.run([scene], folder, settings, _tell(progress))


def _tell(progress: Progress) -> runner.Tell:
    """Spread the verbs over one bar."""

    def tell(verb: str) -> Progress:
        low, high = SHARES[verb]
        return lambda done, words: progress(low + (high - low) * done, f"{verb} {words}")

    return tell


def forget(jobs: Sequence[Job]) -> None:
    """Have every verb of these runs done again."""
    for job in jobs:
        if job.folder.exists():
            runner.forget_simulation(job.folder)
            for name in runner.FOLDERS.values():
                (job.folder / name / store.META).unlink(missing_ok=True)
            (job.folder / store.META).unlink(missing_ok=True)
