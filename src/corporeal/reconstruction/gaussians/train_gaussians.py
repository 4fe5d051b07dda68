"""Training of Gaussians on posed pictures.

Adam on the loss of ``image_loss``, one view a step, before random backgrounds: where there are masks, nothing beside
the objects is drawn, and without, no place is left empty. The first steps look at pictures of half the size. Everything
left to chance comes from the seed and the number of the step, so that a training that was cut off goes on as if it had
not been.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32

from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Gaussians, Vector, Views
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.reconstruction.gaussians import densification, exposure_gains, training_checkpoint
from corporeal.reconstruction.gaussians.carved_volume import carve_volume
from corporeal.reconstruction.gaussians.densification import ScaleLimits
from corporeal.reconstruction.gaussians.gaussian_initialisation import (
    StartPoints,
    initial_gaussians,
    join_points,
    points_on_hull,
)
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
    ParameterMatrix,
    gaussians_of_parameters,
    opacities,
)
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality, heldout_quality
from corporeal.reconstruction.gaussians.image_loss import image_loss, target_image
from corporeal.reconstruction.gaussians.kernels_training import adam_rows
from corporeal.reconstruction.gaussians.plane_sweep import sweep_planes
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.training_schedule import DEFAULT_TRAINING, Masks, TrainConfig, TrainingSchedule

LEARNING_RATES = {
    PARAM_MEAN: 3e-4,
    PARAM_ROTATION: 2e-3,
    PARAM_SCALE: 8e-3,
    PARAM_OPACITY: 0.05,
    PARAM_COLOUR: 0.012,
    PARAM_COLOUR + 3: 2e-3,
}
"""Adam's, from each column on; of means in radii of what the cameras look at."""
FINAL_RATE_FRACTIONS = {PARAM_MEAN: 0.02, PARAM_SCALE: 0.15, PARAM_COLOUR: 0.15}
"""What is left of them at the end."""
OPACITY_SCALE_PENALTY = 0.01
"""On opacities and scales, so that unneeded ones fade (Kheradmand et al. 2024)."""
DEAD_OPACITY_LOGIT = -7.0
"""Logit of the opacity that haze is left with: it is dead."""
STIR_SIGMAS_PER_RATE = 1e3
"""Reach of the random steps that faint ones take [standard deviations], per rate of the means."""
INSIDE_HULL_FRACTION = 0.2
"""Share of the Gaussians that begin inside the visual hull, where some do."""
TRIAL_TRAINING = {"gaussians": 5000, "steps": 300, "longest": 128, "held_out": 4}
"""A small training that tells whether some should."""
MIN_TRIAL_GAIN_DB = 0.5
"""Held-out views must agree better with it by so much on objects [dB]."""
GREY_BACKGROUND: Vector = (0.5, 0.5, 0.5)
"""Behind objects when pictures are compared."""


@dataclass(frozen=True)
class TrainedGaussians:
    """What came of it."""

    gaussians: Gaussians
    quality: HeldOutQuality | None
    """On held-out views."""
    seconds: float
    exposures: Float32[np.ndarray, "V 3"]
    """How much brighter than on average each photograph is, by channel; 1 where held out."""
    ahead: float = np.nan
    """How much better a small training was on objects that began inside the visual hull, too [dB];
    nan: there was none."""


def train_gaussians(
    views: Views,
    masks: Masks | None = None,
    points: StartPoints | LinesOfSight | None = None,
    config: TrainConfig = DEFAULT_TRAINING,
    checkpoint: Path | None = None,
    progress: Progress = no_progress,
) -> TrainedGaussians:
    """Learn Gaussians from posed pictures.

    masks: what belongs to the objects; only that is learned then. points: where to start, too, or with masks instead of
    their visual hull; without masks a plane sweep finds where objects are. Lines of sight in their place empty the
    visual hull where they pass.
    checkpoint: a file that is written now and then; a training that was cut off goes on from it, and one that was
    finished is not done again.

    Where exposures differ, Gaussians have the mean one, and held-out views are compared after the gain that suits each.

    Raises:
        UserError: There are too few pictures, masks of another shape, a skewed camera, or cameras and pictures do not
            belong together.
    """
    begun = time.monotonic()
    schedule = TrainingSchedule(views, masks, points, config)
    with ThreadPool(config.threads) as pool:
        training = _begin_or_resume(schedule, checkpoint, pool, progress)
        spent = training.seconds
        for fraction, words in _learn(training, schedule, checkpoint, pool):
            training.seconds = spent + time.monotonic() - begun
            progress(fraction, words)
    if checkpoint is not None:
        training_checkpoint.save_checkpoint(checkpoint, schedule.name, vars(training))
    left = (opacities(training.theta) > densification.DEAD_OPACITY) & ~_in_empty_space(training.theta, schedule)
    made = gaussians_of_parameters(training.theta[left])
    behind = None if masks is None else GREY_BACKGROUND
    apart = exposure_gains.exposures_differ(training.gains)
    held = schedule.held_out
    out = heldout_quality(made, views, held, masks, behind, apart) if held else None
    exposures = np.ones((len(views.cameras), 3), np.float32)
    exposures[schedule.learned] = training.gains
    return TrainedGaussians(made, out, spent + time.monotonic() - begun, exposures, training.ahead)


@dataclass
class TrainingState:
    """What a training changes."""

    theta: ParameterMatrix
    first: ParameterMatrix
    second: ParameterMatrix
    """Adam's moments."""
    limits: ScaleLimits
    gains: exposure_gains.ExposureGains
    """Of the views that are learned from."""
    widest: float
    """Scale that no Gaussian may have more of [m]."""
    ahead: float
    """As in ``TrainedGaussians``."""
    step: int = 0
    seconds: float = 0.0
    """Spent so far."""


def _begin_or_resume(
    schedule: TrainingSchedule, checkpoint: Path | None, pool: ThreadPool, progress: Progress
) -> TrainingState:
    """Return the state to go on from: a checkpoint's, or that of a fresh start."""
    rng = np.random.default_rng([schedule.seed, 0])
    preset, points = schedule.preset, schedule.points
    lines = points if isinstance(points, LinesOfSight) else None
    points = points if isinstance(points, StartPoints) else None
    views, masks = _subset_of_views(schedule.views, schedule.masks, schedule.learned)
    if masks is None:
        found = sweep_planes(views, preset.gaussians, rng, pool, schedule.config.sweep)
        schedule.surfaces = found.surfaces
        points = found.points if points is None else join_points(points, found.points)
    if points is None and masks is not None:
        own = None if lines is None else lines.only(schedule.learned)
        schedule.outlines = carve_volume(views, masks, own, pool, schedule.config.hull)
    state = training_checkpoint.load_checkpoint(checkpoint, schedule.name) if checkpoint is not None else {}
    if state:
        learned = state["theta"], state["first"], state["second"]
        rest = state["limits"], state["gains"], float(state["widest"]), float(state["ahead"])
        return TrainingState(*learned, *rest, int(state["step"]), float(state["seconds"]))
    widest, ahead, begin = (densification.MAX_SCALE_RADII * schedule.radius, np.nan, schedule.config.begin)
    if schedule.outlines is not None:
        ahead = _trial_gain(schedule, progress) if begin == "auto" else np.nan
        inside = begin == "inside" or ahead > MIN_TRIAL_GAIN_DB
        if inside:
            # As far as so many are apart on a sphere. One that is wider shows all of a plain face from below it, and
            # costs less of PULL than those that lie on it.
            widest = schedule.radius * np.sqrt(4 * np.pi / preset.gaussians)
        points = points_on_hull(schedule.outlines, preset.gaussians, rng, pool, INSIDE_HULL_FRACTION * inside)
    assert points is not None
    theta = initial_gaussians(points, preset.gaussians, preset.degree, rng)
    bounds, _ = _limits_and_haze(theta, widest, schedule, pool)
    gains = np.ones((len(schedule.learned), 3), np.float32)
    moments = np.zeros_like(theta), np.zeros_like(theta)
    return TrainingState(theta, *moments, bounds, gains, float(widest), ahead)


def _trial_gain(schedule: TrainingSchedule, progress: Progress) -> float:
    """Return how much better a small training is that begins inside the hull [dB]; nan: unknown."""
    if schedule.preset.steps <= TRIAL_TRAINING["steps"]:
        return np.nan  # it is no larger itself
    progress(0.0, "finding where to begin")
    small = replace(schedule.config, **TRIAL_TRAINING)
    tries = [replace(small, begin=begin) for begin in ("inside", "hull")]
    views, masks = _subset_of_views(schedule.views, schedule.masks, schedule.learned)
    lines = schedule.points
    lines = lines.only(schedule.learned) if isinstance(lines, LinesOfSight) else None
    inside, hull_alone = (train_gaussians(views, masks, lines, c).quality for c in tries)
    if inside is None or hull_alone is None:
        return np.nan  # too few views to tell
    assert inside.psnr_on_objects is not None and hull_alone.psnr_on_objects is not None
    return inside.psnr_on_objects - hull_alone.psnr_on_objects


def _learn(training: TrainingState, schedule: TrainingSchedule, checkpoint: Path | None, pool: ThreadPool):
    """Take the steps that are left; yields fraction done and words."""
    steps = schedule.preset.steps
    start, begun = schedule.cost(training.step), time.monotonic()
    errors: list[float] = []
    written = begun
    while training.step < steps:
        errors.append(_step(training, schedule, pool))
        training.step += 1
        done, now = schedule.cost(training.step), time.monotonic()
        left = (now - begun) / (done - start) * (schedule.cost(steps) - done)
        recent = -10 * np.log10(max(np.mean(errors[-len(schedule.learned) :]), 1e-12))
        words = f"step {training.step} of {steps}, {recent:.1f} dB, {len(training.theta)} Gaussians"
        yield done / schedule.cost(steps), f"{words}, {left:.0f} s left"
        if checkpoint is not None and now - written > schedule.config.checkpoint_interval_s:
            written = now
            training_checkpoint.save_checkpoint(checkpoint, schedule.name, vars(training))


def _step(training: TrainingState, schedule: TrainingSchedule, pool: ThreadPool) -> float:
    """Learn from one view; returns the mean of Δ²."""
    # One view a step, before a random background, so that nothing is learned beside objects.
    rng = np.random.default_rng([schedule.seed, 1, training.step])
    size, k = schedule.size(training.step), _view_of_step(schedule, training.step)
    place = schedule.learned.index(k)
    background = rng.random(3, np.float32)
    aim = target_image(size.rgb[k], size.masks.get(k), background, training.gains[place])
    # Draw, compare, and carry the loss back to every number of every Gaussian.
    drawing = schedule.draw(training.theta, size.cameras[k], background, pool)
    off = image_loss(drawing, aim, pool)
    gradient = schedule.back(drawing, off.slope, pool)
    # Adam, with a decay that lets what no picture needs fade.
    rates = _column_rates(schedule, training)
    count = len(training.theta)
    decay = (np.float32(OPACITY_SCALE_PENALTY / count), np.float32(OPACITY_SCALE_PENALTY / 3 / count / schedule.radius))
    rest = gradient, training.first, training.second, rates, training.step + 1, decay
    bounds = training.limits, drawing.spans
    pool.each(adam_rows, [(training.theta, *rest, *bounds, *span) for span in pool.spans(count)])
    # Exposures follow once every view had its turn.
    if training.step >= len(schedule.learned):
        seen = exposure_gains.exposure_gain(drawing, size.rgb[k], size.masks.get(k))
        training.gains = exposure_gains.update_gain(training.gains, place, seen)
    _densify_and_wander(training, schedule, float(rates[PARAM_MEAN]), rng, pool)
    return off.error


def _densify_and_wander(
    training: TrainingState, schedule: TrainingSchedule, rate: float, rng: np.random.Generator, pool: ThreadPool
) -> None:
    """Move Gaussians that are dead to live ones now and then; let faint ones wander."""
    when = schedule.config.densification
    due = training.step % when.interval_steps == 0
    end = when.end_fraction * schedule.preset.steps
    if due and when.begin_step < training.step < end:
        _, haze = _limits_and_haze(training.theta, training.widest, schedule, pool)
        haze |= _in_empty_space(training.theta, schedule)
        training.theta[haze, PARAM_OPACITY] = DEAD_OPACITY_LOGIT
        moments = [training.first, training.second]
        most = schedule.preset.gaussians
        training.theta, moments = densification.densify(training.theta, moments, most, rng)
        training.first, training.second = moments
    if due:
        training.limits, _ = _limits_and_haze(training.theta, training.widest, schedule, pool)
    faint = np.flatnonzero(opacities(training.theta) < 0.1)
    reach = STIR_SIGMAS_PER_RATE * rate / schedule.radius
    training.theta[faint, PARAM_MEAN:PARAM_ROTATION] += densification.random_steps(training.theta[faint], reach, rng)


def _limits_and_haze(
    theta: ParameterMatrix, widest: float, schedule: TrainingSchedule, pool: ThreadPool
) -> tuple[ScaleLimits, Bool[np.ndarray, " N"]]:
    """Return what Gaussians may do, and which of them are haze; masks leave no room for any."""
    if schedule.surfaces is None:
        return densification.equal_scale_limits(theta, widest), np.zeros(len(theta), np.bool_)
    return densification.scale_limits_from_views(theta, schedule.radius, schedule.surfaces, pool)


def _in_empty_space(theta: ParameterMatrix, schedule: TrainingSchedule) -> Bool[np.ndarray, " N"]:
    """Return which Gaussians are where lines of sight pass."""
    if schedule.outlines is None:
        return np.zeros(len(theta), np.bool_)
    return schedule.outlines.emptied(theta[:, PARAM_MEAN:PARAM_ROTATION])


def _column_rates(schedule: TrainingSchedule, training: TrainingState) -> Float32[np.ndarray, " D"]:
    """Return Adam's rate for each column."""
    share = training.step / schedule.preset.steps
    rates = np.empty(training.theta.shape[1], np.float32)
    for column, rate in LEARNING_RATES.items():
        rates[column:] = rate * FINAL_RATE_FRACTIONS.get(column, 1.0) ** share
    rates[PARAM_MEAN:PARAM_ROTATION] *= schedule.radius
    return rates


def _view_of_step(schedule: TrainingSchedule, step: int) -> int:
    """Return whose turn it is: every view once, then again in another order."""
    lap, place = divmod(step, len(schedule.learned))
    return schedule.learned[np.random.default_rng([schedule.seed, 2, lap]).permutation(len(schedule.learned))[place]]


def _subset_of_views(views: Views, masks: Masks | None, which: list[int]) -> tuple[Views, Masks | None]:
    cameras = tuple(views.cameras[k] for k in which)
    return Views(views.rgb[which], cameras), None if masks is None else masks[which]
