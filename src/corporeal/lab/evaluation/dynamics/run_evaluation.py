"""Run an evaluation of dynamics: every scene by every method, the reference, and life."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.jobs.carry_out import Hands, carry_out
from corporeal.jobs.manifest import read_rows
from corporeal.lab.corpus.plan import read_plan
from corporeal.lab.corpus.run import SCENE, SCENES
from corporeal.lab.evaluation.dynamics.jobs_of_runs import Comparison, SceneInput, jobs
from corporeal.lab.evaluation.dynamics.life_drops import drop_jobs
from corporeal.lab.evaluation.dynamics.methods import method_of, ours
from corporeal.lab.evaluation.dynamics.places import INPUT, Finer
from corporeal.lab.evaluation.dynamics.summary import Summary, summary
from corporeal.pipeline import runner
from corporeal.pipeline.runner import Settings
from corporeal.showcase.scenes import SCENES as SHOWCASE_SCENES

SHOWCASE = "showcase"


@dataclass(frozen=True)
class DynamicsConfig:
    """What is evaluated, against whom."""

    against: tuple[str, ...] = ("single", "capped", "one")
    """Baselines: single, capped, one[:E=2e6,nu=.4,rho=200], omniphysgs, vomp:PATH, pixie:PATH,
    table:PATH."""
    reference: Finer = "normal"
    """Detail of the run of ours that paths and contacts are compared with."""
    only: tuple[str, ...] = ()
    """Names of scenes; all where none is named."""
    life: bool = True
    """Also drop real balls whose rebound was published, by every method that needs no files."""
    run: bool = True
    """Run what has not been run; with --no-run what is there is summed up."""


def evaluate_dynamics(
    target: str, out: Path, config: DynamicsConfig, settings: Settings, hands: Hands
) -> Summary:
    """Run what is not done yet, and sum all up. A run that fails is a row, and stops no other.

    Args:
        target: "showcase", or the folder of a corpus whose scenes are assembled.
        out: Folder of the evaluation.
        config: What is asked for.
        settings: Ours.
        hands: Who does the runs.

    Raises:
        UserError: A name is unknown, nothing is there to evaluate, or another process works here.

    """
    if repeated := [s for s in config.against if config.against.count(s) > 1]:
        raise UserError(f"--against names {repeated[0]} twice.")
    methods = tuple(method_of(spec) for spec in config.against)
    names = [m.name for m in methods]
    if len(set(names)) < len(names):
        raise UserError("--against takes one baseline of a kind: give each its own --out.")
    comparison = Comparison(out, (ours, *methods), config.reference, settings)
    scenes = chosen(scenes_of(target, out), config.only)
    with store.alone(out):
        todo = jobs(scenes, comparison)
        if config.life:
            todo += drop_jobs(out, comparison.methods, settings)
        if config.run:
            carry_out(out, "evaluate", todo, hands)
        rows = read_rows(out, "evaluate")
        errors = {n: f"failed: {row.error}" for n, row in rows.items() if row.status == "failed"}
        return summary(scenes, comparison, errors)


def scenes_of(target: str, out: Path) -> list[SceneInput]:
    """Return the scenes of the showcase, which are written down first, or of a corpus.

    Raises:
        UserError: The folder is no corpus, or no scene of it is assembled.

    """
    if target == SHOWCASE:
        return [_showcase(name, out / name / INPUT) for name in SHOWCASE_SCENES]
    folder = Path(target)
    planned = read_plan(folder).scenes
    there = [SceneInput(s.name, folder / SCENES / s.name / SCENE) for s in planned]
    there = [s for s in there if s.path.exists()]
    if not there:
        raise UserError(
            f"No scene of {folder} is assembled. Do it with: corporeal corpus assemble {folder}."
        )
    return there


def _showcase(name: str, folder: Path) -> SceneInput:
    path = folder / f"{name}.glb"
    return SceneInput(name, path if path.exists() else runner.write_showcase(name, folder))


def chosen(scenes: Sequence[SceneInput], only: Sequence[str]) -> list[SceneInput]:
    """Return the scenes of some names, all where none is named.

    Raises:
        UnknownChoiceError: There is no such scene.

    """
    names = [s.name for s in scenes]
    for name in only:
        if name not in names:
            raise UnknownChoiceError("scene", name, names)
    return [s for s in scenes if not only or s.name in only]
