"""Evaluation of dynamics: every scene by every method and the reference, and measured rebounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.jobs.executor import Executor, execute_jobs
from corporeal.jobs.job import read_manifest_rows
from corporeal.lab.corpus.corpus_plan import read_plan
from corporeal.lab.corpus.run_corpus import SCENE_TOML_FILE, SCENES_FOLDER
from corporeal.lab.evaluation.dynamics.compared_methods import INPUT_FOLDER, OUR_METHOD, ReferenceDetail, parse_method
from corporeal.lab.evaluation.dynamics.dynamics_jobs import EvaluatedScene, MethodComparison, dynamics_jobs
from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary, summarise_dynamics
from corporeal.lab.evaluation.dynamics.rebound_drops import drop_jobs
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS as SHOWCASE_SCENES

SHOWCASE_TARGET = "showcase"


@dataclass(frozen=True)
class DynamicsConfig:
    """What is evaluated, against whom."""

    against: tuple[str, ...] = ("single", "capped", "one")
    """Baselines: single, capped, one[:E=2e6,nu=.4,rho=200], omniphysgs, vomp:PATH, pixie:PATH, table:PATH."""
    reference: ReferenceDetail = "normal"
    """Detail of the run of ours that paths and contacts are compared with."""
    only: tuple[str, ...] = ()
    """Names of scenes; all where none is named."""
    life: bool = True
    """Also drop real balls whose rebound was published, by every method that needs no files."""
    run: bool = True
    """Run what has not been run; with --no-run what is there is summed up."""


def evaluate_dynamics(
    target: str, out: Path, config: DynamicsConfig, settings: Settings, hands: Executor
) -> DynamicsSummary:
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
    methods = tuple(parse_method(spec) for spec in config.against)
    names = [m.name for m in methods]
    if len(set(names)) < len(names):
        raise UserError("--against takes one baseline of a kind: give each its own --out.")
    comparison = MethodComparison(out, (OUR_METHOD, *methods), config.reference, settings)
    scenes = select_scenes(scenes_of(target, out), config.only)
    with store.lock_folder(out):
        todo = dynamics_jobs(scenes, comparison)
        if config.life:
            todo += drop_jobs(out, comparison.methods, settings)
        if config.run:
            execute_jobs(out, "evaluate", todo, hands)
        rows = read_manifest_rows(out, "evaluate")
        errors = {n: f"failed: {row.error}" for n, row in rows.items() if row.status == "failed"}
        return summarise_dynamics(scenes, comparison, errors)


def scenes_of(target: str, out: Path) -> list[EvaluatedScene]:
    """Return the scenes of the showcase, which are written down first, or of a corpus.

    Raises:
        UserError: The folder is no corpus, or no scene of it is assembled.
    """
    if target == SHOWCASE_TARGET:
        return [_showcase(name, out / name / INPUT_FOLDER) for name in SHOWCASE_SCENES]
    folder = Path(target)
    planned = read_plan(folder).scenes
    there = [EvaluatedScene(s.name, folder / SCENES_FOLDER / s.name / SCENE_TOML_FILE) for s in planned]
    there = [s for s in there if s.path.exists()]
    if not there:
        raise UserError(f"No scene of {folder} is assembled. Next: corporeal corpus assemble {folder}.")
    return there


def _showcase(name: str, folder: Path) -> EvaluatedScene:
    path = folder / f"{name}.glb"
    return EvaluatedScene(name, path if path.exists() else run_pipeline.write_showcase(name, folder))


def select_scenes(scenes: Sequence[EvaluatedScene], only: Sequence[str]) -> list[EvaluatedScene]:
    """Return the scenes of some names, all where none is named.

    Raises:
        UnknownChoiceError: There is no such scene.
    """
    names = [s.name for s in scenes]
    for name in only:
        if name not in names:
            raise UnknownChoiceError("scene", name, names)
    return [s for s in scenes if not only or s.name in only]
