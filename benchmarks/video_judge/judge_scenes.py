"""All videos of several scenes: references, controls and methods, ready to be asked about."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core.audit_data import Audit
from corporeal.core.errors import UserError, check_range
from corporeal.core.progress import Progress, no_progress
from corporeal.lab.evaluation.dynamics.compared_methods import OURS_NAME
from corporeal.materials import find_material_or_default
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.audit_messages import ALLOWED_BREACHES, passage_message
from corporeal.simulation.simulation_result import SimulationResult
from corporeal.vlm import NO_MODEL
from video_judge.camera_staging import LOOK_TURNS_DEG, Staging, stage_scene
from video_judge.control_effect import (
    COMPARED_AFTER_CONTACT_S,
    NO_DIFFERENCE,
    MotionDifference,
    compare_motions,
)
from video_judge.edited_controls import EDITED_CONTROLS, edit_motion
from video_judge.prompt_context import scene_facts
from video_judge.simulated_controls import SIMULATED_CONTROLS, simulate_control
from video_judge.video_motion import VideoMotion, motion_of_run
from video_judge.video_question import VideoQuestion, video_question

REFERENCE_METHOD = OURS_NAME
CONTROL_NAMES = (*EDITED_CONTROLS, *SIMULATED_CONTROLS)
DEFAULT_CONTROL_SCENES = 12
"""Scenes whose controls are judged unless more are asked for."""


@dataclass(frozen=True)
class JudgeConfig:
    """Who judges, how often, and what it may cost."""

    judge: str = NO_MODEL
    """Model that judges the videos: as --vlm."""
    record: Path | None = None
    """Folder where its answers are recorded, for replay:FOLDER."""
    looks: int = 1
    """Times that each video is judged, each from another side and with questions in another order: 1 to 3.
    """
    control_scenes: int = DEFAULT_CONTROL_SCENES
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
class FailedVideo:
    """A video that could not be made, and why."""

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
    """How far a control is from its reference, and whether that is enough to be distinguished."""

    scene: str
    control: str
    difference: MotionDifference
    limit: MotionDifference
    effective: bool


@dataclass(frozen=True)
class JudgedVideos:
    """All that a judge is asked about, and what was left out."""

    asked: list[VideoQuestion]
    effects: list[ControlEffect]
    failed: list[FailedVideo]
    groups: dict[str, SceneGroups]
    """By scene."""
    methods: list[str]
    """The reference first."""


def check_judging(config: JudgeConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scenes."""
    check_range("--looks", config.looks, 1, len(LOOK_TURNS_DEG))
    check_range("--control-scenes", config.control_scenes, 0, 10_000)


# ---------------------------------------------------------------- videos


def gather_videos(
    scenes: Sequence[SceneRuns], out: Path, config: JudgeConfig, progress: Progress = no_progress
) -> JudgedVideos:
    """Make all videos: read runs back, simulate and edit controls.

    Args:
        scenes: With finished runs.
        out: Folder of the evaluation; runs of controls go to ``OUT/SCENE/control-NAME``.
        config: How many looks, and controls of how many scenes.
        progress: Called with the fraction done and a description.

    """
    videos = JudgedVideos([], [], [], {}, methods_of(scenes))
    for number, scene in enumerate(scenes):
        progress(number / len(scenes), scene.name)
        _gather_scene(scene, out / scene.name, number < config.control_scenes, config, videos)
    return videos


def methods_of(scenes: Sequence[SceneRuns]) -> list[str]:
    """Return all methods, the reference first."""
    others = {m for s in scenes for m in s.runs} - {REFERENCE_METHOD}
    return [REFERENCE_METHOD, *sorted(others)]


def _gather_scene(
    scene: SceneRuns, folder: Path, with_controls: bool, config: JudgeConfig, videos: JudgedVideos
) -> None:
    """Add the videos of one scene; a reference that is not clean leaves it out."""
    reference, why = _run(scene, REFERENCE_METHOD)
    if reference is None:
        videos.failed.append(FailedVideo(scene.name, REFERENCE_METHOD, why))
        return
    library = run_pipeline.read_run_request(scene.runs[REFERENCE_METHOD]).settings.ground.library
    videos.groups[scene.name] = scene_groups(reference, library)
    staging, facts = stage_scene(reference), scene_facts(reference.prepared)
    shown = {REFERENCE_METHOD: motion_of_run(reference), **_methods(scene, videos)}
    if with_controls:
        limit = _yardstick(scene, reference, staging).limit
        for control, video in _controls(scene, reference, folder, videos).items():
            far = compare_motions(shown[REFERENCE_METHOD], video, staging.times)
            effect = ControlEffect(scene.name, control, far, limit, far.exceeds(limit))
            videos.effects.append(effect)
            if effect.effective:
                same = video.prepared is reference.prepared
                bound = shown[REFERENCE_METHOD] if same else None
                shown[control_name(control)] = replace(video, bound_as=bound)
    videos.asked.extend(
        VideoQuestion(scene.name, condition, look, video_question(video, staging, facts, look))
        for condition, video in shown.items()
        for look in range(config.looks)
    )


def _methods(scene: SceneRuns, videos: JudgedVideos) -> dict[str, VideoMotion]:
    """Return the videos of all methods but the reference; what cannot be judged is a row."""
    shown = {m: _read(scene, m, videos) for m in scene.runs if m != REFERENCE_METHOD}
    return {m: video for m, video in shown.items() if video is not None}


def _read(scene: SceneRuns, method: str, videos: JudgedVideos) -> VideoMotion | None:
    played, why = _run(scene, method)
    if played is None:
        failed = FailedVideo(scene.name, method, why)
        videos.failed.extend([failed] if failed not in videos.failed else [])
        return None
    return motion_of_run(played)


def _controls(
    scene: SceneRuns, reference: SimulationResult, folder: Path, videos: JudgedVideos
) -> dict[str, VideoMotion]:
    """Return the videos of all controls that have a place in the scene."""
    found = {c: _control(c, scene, reference, folder, videos) for c in CONTROL_NAMES}
    return {c: video for c, video in found.items() if video is not None}


def control_name(control: str) -> str:
    """Name a control among the conditions: ``single`` is also a method."""
    return f"control:{control}"


def _run(scene: SceneRuns, method: str) -> tuple[SimulationResult | None, str]:
    """Read a run back, or say why it is not judged."""
    folder = scene.runs.get(method)
    if folder is None:
        return None, "was not run"
    try:
        played = run_pipeline.read_run(folder).played
        why = audit_breach(read_audit(folder / STAGE_FOLDERS["simulate"]))
    except (UserError, LookupError) as error:
        return None, str(error)
    return (None, why) if why else (played, "")


def audit_breach(audit: Audit) -> str:
    """Describe what keeps a run from being judged as physics; "": nothing."""
    if audit.nan_count or audit.particles_out_of_domain:
        return "the simulation lost particles"
    if audit.mechanical_growth > ALLOWED_BREACHES["mechanical_growth"]:
        return f"energy grew by {audit.mechanical_growth:.1%}"
    through = [passage_message(pair) for pair in audit.surfaces if pair.passed]
    return through[0] if through else ""


def _control(
    control: str, scene: SceneRuns, reference: SimulationResult, folder: Path, videos: JudgedVideos
) -> VideoMotion | None:
    if control in EDITED_CONTROLS:
        return edit_motion(control, reference)
    if control in scene.runs:  # also a method, so it was run
        return _read(scene, control, videos)
    try:
        played = simulate_control(control, scene.runs[REFERENCE_METHOD], folder / f"control-{control}")
    except UserError as error:
        videos.failed.append(FailedVideo(scene.name, control_name(control), str(error)))
        return None
    return None if played is None else motion_of_run(played)


def _yardstick(scene: SceneRuns, reference: SimulationResult, staging: Staging) -> MotionDifference:
    """Measure how far the reference is from a finer run of the same scene."""
    if scene.yardstick is None:
        return NO_DIFFERENCE
    finer = run_pipeline.read_run(scene.yardstick).played
    met = np.array(reference.trajectory.ledger.first_contact[-1], dtype=float)
    met = np.where(met > 0, met, np.inf)[: len(reference.prepared.scene.objects)]
    until = met.min(axis=1, initial=np.inf) + COMPARED_AFTER_CONTACT_S
    return compare_motions(motion_of_run(reference), motion_of_run(finer), staging.times, until)


def scene_groups(played: SimulationResult, library: str) -> SceneGroups:
    """Return which classes of materials and which constitutive laws occur in a scene.

    Args:
        played: The scene.
        library: Its library of materials.

    Raises:
        UserError: The library does not know a material any more.

    """
    made = played.prepared.field.materials
    kinds = sorted({find_material_or_default(m.name, library).group for m in made})
    return SceneGroups(tuple(kinds), tuple(sorted({m.law.name.lower() for m in made})))
