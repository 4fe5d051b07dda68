"""Every run of an evaluation as a job in a process of its own, resumed where it was stopped."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.jobs.jobs import Job, Progress
from corporeal.lab.evaluation.dynamics.methods import Method, ours, settings_of
from corporeal.lab.evaluation.dynamics.places import Finer, reference_folder, run_folder
from corporeal.lab.evaluation.dynamics.run_numbers import measure, write_numbers
from corporeal.pipeline import runner
from corporeal.pipeline.runner import Settings
from corporeal.pipeline.settings.simulate_config import as_kept

ORPHAN = 60.0
"""Longest wait for the process of an earlier call that was killed to be gone [s]."""


@dataclass(frozen=True)
class SceneInput:
    """A scene that is evaluated."""

    name: str
    path: Path
    """Of its file."""


@dataclass(frozen=True)
class Comparison:
    """Who is compared with what."""

    out: Path
    """Folder of the evaluation."""
    methods: tuple[Method, ...]
    """Ours first."""
    reference: Finer
    settings: Settings
    """Ours."""


def jobs(scenes: Sequence[SceneInput], comparison: Comparison) -> list[Job]:
    """Return all runs, those of one scene together: every method, then the reference."""
    found = []
    for scene in scenes:
        for method in comparison.methods:
            folder = run_folder(comparison.out, scene.name, method.name)
            how = settings_of(method, comparison.settings, scene.name)
            found.append(_job(scene, folder, how))
        finer = replace(
            comparison.settings, fill=replace(comparison.settings.fill, detail=comparison.reference)
        )
        folder = reference_folder(comparison.out, scene.name, comparison.reference)
        found.append(_job(scene, folder, settings_of(ours, finer, scene.name)))
    return found


def _job(scene: SceneInput, folder: Path, settings: Settings) -> Job:
    configs = [getattr(settings, f.name) for f in fields(Settings)]
    read = [name for config in configs for name in runner.files_read(config)]
    asked = replace(settings, describe=replace(settings.describe, record=None))
    named = {**store.kept(asked), "simulate": as_kept(settings.simulate)}
    return Job(
        name=f"{scene.name}.{folder.name}",
        function=run_and_measure,
        folder=folder,
        key=store.key("dynamics", named, [store.digest(scene.path), *read]),
        arguments={"scene": scene.path.resolve(), "settings": settings},
        resumable=True,
    )


def run_and_measure(folder: Path, progress: Progress, scene: Path, settings: Settings) -> None:
    """Run a scene up to simulate and keep what is compared, in the process of a worker."""
    with store.alone(folder, ORPHAN):
        pass
    runner.run([scene], folder, settings, _only_simulation(progress), "simulate")
    progress(0.99, "measuring")
    write_numbers(folder, measure(folder))


def _only_simulation(progress: Progress) -> runner.Tell:
    """Show the progress of the simulation; what comes before takes little."""

    def tell(verb: str) -> Progress:
        share = 0.95 if verb == "simulate" else 0.0
        return lambda done, words: progress(share * done, f"{verb} {words}")

    return tell
