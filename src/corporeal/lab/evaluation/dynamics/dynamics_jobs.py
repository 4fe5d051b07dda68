"""Jobs of an evaluation of dynamics, resumable."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.core.progress import Progress
from corporeal.jobs.job import Job
from corporeal.lab.evaluation.dynamics.compared_methods import (
    OUR_METHOD,
    Method,
    ReferenceDetail,
    method_settings,
    reference_folder,
    run_folder,
)
from corporeal.lab.evaluation.dynamics.run_measures import measure_run, write_run_measures
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings

ORPHAN_WAIT_S = 60.0
"""Longest wait for the process of an earlier call that was killed to be gone [s]."""


@dataclass(frozen=True)
class EvaluatedScene:
    """A scene that is evaluated."""

    name: str
    path: Path
    """Of its file."""


@dataclass(frozen=True)
class MethodComparison:
    """Who is compared with what."""

    out: Path
    """Folder of the evaluation."""
    methods: tuple[Method, ...]
    """Ours first."""
    reference: ReferenceDetail
    settings: Settings
    """Ours."""


def dynamics_jobs(scenes: Sequence[EvaluatedScene], comparison: MethodComparison) -> list[Job]:
    """Return all runs, those of one scene together: every method, then the reference."""
    found = []
    for scene in scenes:
        for method in comparison.methods:
            folder = run_folder(comparison.out, scene.name, method.name)
            how = method_settings(method, comparison.settings, scene.name)
            found.append(_job(scene, folder, how))
        finer = replace(comparison.settings, fill=replace(comparison.settings.fill, detail=comparison.reference))
        folder = reference_folder(comparison.out, scene.name, comparison.reference)
        found.append(_job(scene, folder, method_settings(OUR_METHOD, finer, scene.name)))
    return found


def _job(scene: EvaluatedScene, folder: Path, settings: Settings) -> Job:
    configs = [getattr(settings, f.name) for f in fields(Settings)]
    read = [name for config in configs for name in run_pipeline.digests_of_named_files(config)]
    asked = replace(settings, describe=replace(settings.describe, record=None))
    return Job(
        name=f"{scene.name}.{folder.name}",
        function=run_and_measure,
        folder=folder,
        key=store.result_key("dynamics", asked, [store.path_digest(scene.path), *read]),
        arguments={"scene": scene.path.resolve(), "settings": settings},
        resumable=True,
    )


def run_and_measure(folder: Path, progress: Progress, scene: Path, settings: Settings) -> None:
    """Run a scene up to simulate and keep what is compared, in the process of a worker."""
    with store.lock_folder(folder, ORPHAN_WAIT_S):
        pass
    run_pipeline.run([scene], folder, settings, _only_simulation(progress), "simulate")
    progress(0.99, "measuring")
    write_run_measures(folder, measure_run(folder))


def _only_simulation(progress: Progress) -> run_pipeline.ProgressOfStage:
    """Show the progress of the simulation; what comes before takes little."""

    def tell(verb: str) -> Progress:
        share = 0.95 if verb == "simulate" else 0.0
        return lambda done, words: progress(share * done, f"{verb} {words}")

    return tell
