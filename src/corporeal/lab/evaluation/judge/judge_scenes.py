"""All films of several scenes: references, controls and methods, ready to be asked about."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError, check_range
from corporeal.core.findings import Audit
from corporeal.lab.evaluation.dynamics.places import OURS
from corporeal.lab.evaluation.judge.control_effect import (
    AFTER_CONTACT,
    UNMEASURED,
    Difference,
    difference,
)
from corporeal.lab.evaluation.judge.controls import EDITED, edited
from corporeal.lab.evaluation.judge.film_question import FilmAsked, question
from corporeal.lab.evaluation.judge.filmed_motion import FilmedMotion, simulated
from corporeal.lab.evaluation.judge.simulated_controls import SIMULATED, simulate_control
from corporeal.lab.evaluation.judge.staging import TURNS, Staging, stage_scene
from corporeal.lab.evaluation.judge.told_facts import facts
from corporeal.materials import named
from corporeal.pipeline import runner
from corporeal.pipeline.runner import FOLDERS
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.audit_words import ALLOWED, passage
from corporeal.simulation.played import Played
from corporeal.vlm import NOBODY

Progress = Callable[[float, str], None]
REFERENCE = OURS
CONTROLS = (*EDITED, *SIMULATED)
WITH_CONTROLS = 12
"""Scenes whose controls are judged unless more are asked for."""


@dataclass(frozen=True)
class JudgeConfig:
    """Who judges, how often, and what it may cost."""

    judge: str = NOBODY
    """Model that judges the films: as --vlm."""
    record: Path | None = None
    """Folder where its answers are recorded, for replay:FOLDER."""
    looks: int = 1
    """Times that each film is judged, each from another side and with questions in another order:
    1 to 3."""
    control_scenes: int = WITH_CONTROLS
    """Scenes of which controls are judged."""
    yes: bool = False
    """Ask a judge that costs more than 5 US$, or whose price is not known."""


@dataclass(frozen=True)
class SceneRuns:
    """Finished runs of one scene by method; the reference is ``ours``."""

    name: str
    runs: Mapping[str, Path]
    """Method → folder of the run."""
    yardstick: Path | None = None
    """Run at a finer detail; None: there is none."""


@dataclass(frozen=True)
class Failed:
    """A film that nobody judges, and why."""

    scene: str
    condition: str
    reason: str


@dataclass(frozen=True)
class SceneGroups:
    """What occurs in a scene."""

    classes: tuple[str, ...]
    """Of materials."""
    laws: tuple[str, ...]
    """Constitutive laws."""


@dataclass(frozen=True)
class ControlEffect:
    """How far a control is from its reference, and whether that is enough to be told."""

    scene: str
    control: str
    difference: Difference
    limit: Difference
    effective: bool


@dataclass(frozen=True)
class Films:
    """All that a judge is asked about, and what was left out."""

    asked: list[FilmAsked]
    effects: list[ControlEffect]
    failed: list[Failed]
    groups: dict[str, SceneGroups]
    """By scene."""
    methods: list[str]
    """The reference first."""


def check_judging(config: JudgeConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scenes."""
    check_range("--looks", config.looks, 1, len(TURNS))
    check_range("--control-scenes", config.control_scenes, 0, 10_000)


# ---------------------------------------------------------------- films


def gather_films(
    scenes: Sequence[SceneRuns],
    out: Path,
    config: JudgeConfig,
    progress: Progress = lambda fraction, words: None,
) -> Films:
    """Make all films: read runs back, simulate and edit controls.

    Args:
        scenes: With finished runs.
        out: Folder of the evaluation; runs of controls go to ``OUT/SCENE/control-NAME``.
        config: How many looks, and controls of how many scenes.
        progress: Told the fraction done and what is being done.

    """
    films = Films([], [], [], {}, methods_of(scenes))
    for number, scene in enumerate(scenes):
        progress(number / len(scenes), scene.name)
        _gather_scene(scene, out / scene.name, number < config.control_scenes, config, films)
    return films


def methods_of(scenes: Sequence[SceneRuns]) -> list[str]:
    """Return all methods, the reference first."""
    others = {m for s in scenes for m in s.runs} - {REFERENCE}
    return [REFERENCE, *sorted(others)]


def _gather_scene(
    scene: SceneRuns, folder: Path, with_controls: bool, config: JudgeConfig, films: Films
) -> None:
    """Add the films of one scene; a reference that is not clean leaves it out."""
    reference, why = _run(scene, REFERENCE)
    if reference is None:
        films.failed.append(Failed(scene.name, REFERENCE, why))
        return
    library = runner.reopen(scene.runs[REFERENCE]).settings.ground.library
    films.groups[scene.name] = groups_of(reference, library)
    staging, told = stage_scene(reference), facts(reference.prepared)
    shown = {REFERENCE: simulated(reference), **_methods(scene, films)}
    if with_controls:
        limit = _yardstick(scene, reference, staging).limit
        for control, film in _controls(scene, reference, folder, films).items():
            far = difference(shown[REFERENCE], film, staging.times)
            effect = ControlEffect(scene.name, control, far, limit, far.exceeds(limit))
            films.effects.append(effect)
            if effect.effective:
                same = film.prepared is reference.prepared
                bound = shown[REFERENCE] if same else None
                shown[control_name(control)] = replace(film, bound_as=bound)
    films.asked.extend(
        FilmAsked(scene.name, condition, look, question(film, staging, told, look))
        for condition, film in shown.items()
        for look in range(config.looks)
    )


def _methods(scene: SceneRuns, films: Films) -> dict[str, FilmedMotion]:
    """Return the films of all methods but the reference; what cannot be judged is a row."""
    shown = {m: _read(scene, m, films) for m in scene.runs if m != REFERENCE}
    return {m: film for m, film in shown.items() if film is not None}


def _read(scene: SceneRuns, method: str, films: Films) -> FilmedMotion | None:
    played, why = _run(scene, method)
    if played is None:
        failed = Failed(scene.name, method, why)
        films.failed.extend([failed] if failed not in films.failed else [])
        return None
    return simulated(played)


def _controls(
    scene: SceneRuns, reference: Played, folder: Path, films: Films
) -> dict[str, FilmedMotion]:
    """Return the films of all controls that have a place in the scene."""
    found = {c: _control(c, scene, reference, folder, films) for c in CONTROLS}
    return {c: film for c, film in found.items() if film is not None}


def control_name(control: str) -> str:
    """Name a control among the conditions: ``single`` is also a method."""
    return f"control:{control}"


def _run(scene: SceneRuns, method: str) -> tuple[Played | None, str]:
    """Read a run back, or say why it is not judged."""
    folder = scene.runs.get(method)
    if folder is None:
        return None, "was not run"
    try:
        played = runner.read_back(folder).played
        why = breach(read_audit(folder / FOLDERS["simulate"]))
    except (UserError, LookupError) as error:
        return None, str(error)
    return (None, why) if why else (played, "")


def breach(audit: Audit) -> str:
    """Say what keeps a run from being judged as physics; "": nothing."""
    if audit.nan_count or audit.particles_out_of_domain:
        return "the simulation lost particles"
    if audit.mechanical_growth > ALLOWED["mechanical_growth"]:
        return f"energy grew by {audit.mechanical_growth:.1%}"
    through = [passage(pair) for pair in audit.surfaces if pair.passed]
    return through[0] if through else ""


def _control(
    control: str, scene: SceneRuns, reference: Played, folder: Path, films: Films
) -> FilmedMotion | None:
    if control in EDITED:
        return edited(control, reference)
    if control in scene.runs:  # also a method, so it was run
        return _read(scene, control, films)
    try:
        played = simulate_control(control, scene.runs[REFERENCE], folder / f"control-{control}")
    except UserError as error:
        films.failed.append(Failed(scene.name, control_name(control), str(error)))
        return None
    return None if played is None else simulated(played)


def _yardstick(scene: SceneRuns, reference: Played, staging: Staging) -> Difference:
    """Measure how far the reference is from a finer run of the same scene."""
    if scene.yardstick is None:
        return UNMEASURED
    finer = runner.read_back(scene.yardstick).played
    met = np.array(reference.trajectory.ledger.first_contact[-1], dtype=float)
    met = np.where(met > 0, met, np.inf)[: len(reference.prepared.scene.objects)]
    until = met.min(axis=1, initial=np.inf) + AFTER_CONTACT
    return difference(simulated(reference), simulated(finer), staging.times, until)


def groups_of(played: Played, library: str) -> SceneGroups:
    """Return which classes of materials and which constitutive laws occur in a scene.

    Args:
        played: The scene.
        library: Its library of materials.

    Raises:
        UserError: The library does not know a material any more.

    """
    made = played.prepared.field.materials
    kinds = sorted({named(m.name, library).group for m in made})
    return SceneGroups(tuple(kinds), tuple(sorted({m.law.name.lower() for m in made})))
