"""Gaussians from posed pictures.

Adam on the loss of ``loss``, one view a step, before random backgrounds: where there are masks,
nothing beside the things is drawn, and without, no place is left empty. The first steps look at
pictures of half the size. Everything left to chance comes from the seed and the number of the step,
so that a training that was cut off goes on as if it had not been.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32

from corporeal.splats import exposure, growth, limits, saved
from corporeal.splats.crew import Crew
from corporeal.splats.kernels_learn import adam
from corporeal.splats.lesson import DEFAULT, Lesson, Masks, TrainConfig
from corporeal.splats.limits import Limits
from corporeal.splats.loss import goal, loss
from corporeal.splats.parameters import (
    COLOUR,
    MEAN,
    OPACITY,
    ROTATION,
    SCALE,
    Parameters,
    gaussians_of,
    opacity,
)
from corporeal.splats.quality import Quality, quality
from corporeal.splats.start import Points, joined, on_hull, seeded
from corporeal.splats.sweep import swept
from corporeal.types import Gaussians, Vector, Views

Progress = Callable[[float, str], None]

RATES = {MEAN: 3e-4, ROTATION: 2e-3, SCALE: 8e-3, OPACITY: 0.05, COLOUR: 0.012, COLOUR + 3: 2e-3}
"""Adam's, from each column on; of means in radii of what the cameras look at."""
FALL = {MEAN: 0.02, SCALE: 0.15, COLOUR: 0.15}
"""What is left of them at the end."""
PULL = 0.01
"""On opacities and scales, so that what nobody needs fades (Kheradmand et al. 2024)."""
ROUND = 50
"""Steps between rounds of growth."""
SETTLED = (100, 0.8)
"""Growth begins after so many steps, and ends after this share of them."""
GONE = -7.0
"""Logit of the opacity that haze is left with: it is dead."""
STIR = 1e3
"""Reach of the random steps that faint ones take [standard deviations], per rate of the means."""
EVERY = 15.0
"""Seconds between checkpoints."""
WITHIN = 0.2
"""Share of the Gaussians that begin inside the visual hull, where some do."""
TRIAL = {"gaussians": 5000, "steps": 300, "longest": 128, "held_out": 4}
"""A small training that tells whether some should."""
GAIN = 0.5
"""Held-out views must agree better with it by so much on things [dB]."""
GREY: Vector = (0.5, 0.5, 0.5)
"""Behind things when pictures are compared."""


@dataclass(frozen=True)
class Trained:
    """What came of it."""

    gaussians: Gaussians
    quality: Quality | None
    """On held-out views."""
    seconds: float
    exposures: Float32[np.ndarray, "V 3"]
    """How much brighter than on average each photograph is, by channel; 1 where held out."""
    ahead: float = np.nan
    """How much better a small training was on things that began inside the visual hull, too [dB];
    nan: there was none."""


def train(
    views: Views,
    masks: Masks | None = None,
    points: Points | None = None,
    config: TrainConfig = DEFAULT,
    checkpoint: Path | None = None,
    progress: Progress = lambda fraction, words: None,
) -> Trained:
    """Learn Gaussians from posed pictures.

    masks: what belongs to the things; only that is learned then. points: where to start, too, or
    with masks instead of their visual hull; without masks a plane sweep finds where things are.
    checkpoint: a file that is written now and then; a training that was cut off goes on from it,
    and one that was finished is not done again.

    Where exposures differ, Gaussians have the mean one, and held-out views are compared after the
    gain that suits each.

    Raises:
        UserError: There are too few pictures, masks of another shape, a skewed camera, or cameras
            and pictures do not belong together.

    """
    begun = time.monotonic()
    lesson = Lesson(views, masks, points, config)
    with Crew(config.threads) as crew:
        pupil = _begun(lesson, checkpoint, crew, progress)
        spent = pupil.seconds
        for fraction, words in _learn(pupil, lesson, checkpoint, crew):
            pupil.seconds = spent + time.monotonic() - begun
            progress(fraction, words)
    if checkpoint is not None:
        saved.keep(checkpoint, lesson.name, vars(pupil))
    made = gaussians_of(pupil.theta[opacity(pupil.theta) > growth.DEAD])
    behind = None if masks is None else GREY
    apart = exposure.differ(pupil.gains)
    held = lesson.held_out
    out = quality(made, views, held, masks, behind, apart) if held else None
    exposures = np.ones((len(views.cameras), 3), np.float32)
    exposures[lesson.learned] = pupil.gains
    return Trained(made, out, spent + time.monotonic() - begun, exposures, pupil.ahead)


@dataclass
class Pupil:
    """What learning changes."""

    theta: Parameters
    first: Parameters
    second: Parameters
    """Adam's moments."""
    limits: Limits
    gains: exposure.Gains
    """Of the views that are learned from."""
    widest: float
    """Scale that no Gaussian may have more of [m]."""
    ahead: float
    """As in ``Trained``."""
    step: int = 0
    seconds: float = 0.0
    """Spent so far."""


def _begun(lesson: Lesson, checkpoint: Path | None, crew: Crew, progress: Progress) -> Pupil:
    """Return the state to go on from: a checkpoint's, or that of a beginner."""
    rng = np.random.default_rng([lesson.seed, 0])
    preset, points = lesson.preset, lesson.points
    views, masks = _of(lesson.views, lesson.masks, lesson.learned)
    if masks is None:
        found = swept(views, preset.gaussians, rng, crew)
        lesson.surfaces = found.surfaces
        points = found.points if points is None else joined(points, found.points)
    state = saved.kept(checkpoint, lesson.name) if checkpoint is not None else {}
    if state:
        learned = state["theta"], state["first"], state["second"]
        rest = state["limits"], state["gains"], float(state["widest"]), float(state["ahead"])
        return Pupil(*learned, *rest, int(state["step"]), float(state["seconds"]))
    widest, ahead, begin = limits.REACH * lesson.radius, np.nan, lesson.config.begin
    if points is None and masks is not None:
        ahead = _tried(lesson, views, masks, progress) if begin == "auto" else np.nan
        inside = begin == "inside" or ahead > GAIN
        if inside:
            # As far as so many are apart on a sphere. One that is wider shows all of a plain face
            # from below it, and costs less of PULL than those that lie on it.
            widest = lesson.radius * np.sqrt(4 * np.pi / preset.gaussians)
        points = on_hull(views, masks, preset.gaussians, rng, crew, WITHIN * inside)
    assert points is not None
    theta = seeded(points, preset.gaussians, preset.degree, rng)
    bounds, _ = _bounds(theta, widest, lesson, crew)
    gains = np.ones((len(lesson.learned), 3), np.float32)
    moments = np.zeros_like(theta), np.zeros_like(theta)
    return Pupil(theta, *moments, bounds, gains, float(widest), ahead)


def _tried(lesson: Lesson, views: Views, masks: Masks, progress: Progress) -> float:
    """Return how much better a small training is that begins inside the hull [dB]; nan: unknown."""
    if lesson.preset.steps <= TRIAL["steps"]:
        return np.nan  # it is no larger itself
    progress(0.0, "finding where to begin")
    small = replace(lesson.config, **TRIAL)
    tries = [replace(small, begin=begin) for begin in ("inside", "hull")]
    inside, hull_alone = (train(views, masks, config=c).quality for c in tries)
    if inside is None or hull_alone is None:
        return np.nan  # too few views to tell
    assert inside.psnr_things is not None and hull_alone.psnr_things is not None
    return inside.psnr_things - hull_alone.psnr_things


def _learn(pupil: Pupil, lesson: Lesson, checkpoint: Path | None, crew: Crew):
    """Take the steps that are left; yields fraction done and words."""
    steps = lesson.preset.steps
    start, begun = lesson.cost(pupil.step), time.monotonic()
    errors: list[float] = []
    written = begun
    while pupil.step < steps:
        errors.append(_step(pupil, lesson, crew))
        pupil.step += 1
        done, now = lesson.cost(pupil.step), time.monotonic()
        left = (now - begun) / (done - start) * (lesson.cost(steps) - done)
        recent = -10 * np.log10(max(np.mean(errors[-len(lesson.learned) :]), 1e-12))
        words = f"step {pupil.step} of {steps}, {recent:.1f} dB, {len(pupil.theta)} Gaussians"
        yield done / lesson.cost(steps), f"{words}, {left:.0f} s left"
        if checkpoint is not None and now - written > EVERY:
            written = now
            saved.keep(checkpoint, lesson.name, vars(pupil))


def _step(pupil: Pupil, lesson: Lesson, crew: Crew) -> float:
    """Learn from one view; returns the mean of Δ²."""
    rng = np.random.default_rng([lesson.seed, 1, pupil.step])
    size, k = lesson.size(pupil.step), _turn(lesson, pupil.step)
    place = lesson.learned.index(k)
    background = rng.random(3, np.float32)
    aim = goal(size.rgb[k], size.masks.get(k), background, pupil.gains[place])
    drawing = lesson.draw(pupil.theta, size.cameras[k], background, crew)
    off = loss(drawing, aim, crew)
    gradient = lesson.back(drawing, off.slope, crew)
    rates = _rates(lesson, pupil)
    count = len(pupil.theta)
    decay = np.float32(PULL / count), np.float32(PULL / 3 / count / lesson.radius)
    rest = gradient, pupil.first, pupil.second, rates, pupil.step + 1, decay
    bounds = pupil.limits, drawing.spans
    crew.each(adam, [(pupil.theta, *rest, *bounds, *span) for span in crew.spans(count)])
    if pupil.step >= len(lesson.learned):
        seen = exposure.gain(drawing, size.rgb[k], size.masks.get(k))
        pupil.gains = exposure.followed(pupil.gains, place, seen)
    _stir(pupil, lesson, float(rates[MEAN]), rng, crew)
    return off.error


def _stir(pupil: Pupil, lesson: Lesson, rate: float, rng: np.random.Generator, crew: Crew) -> None:
    """Move Gaussians that are dead to live ones now and then; let faint ones wander."""
    begin, end = SETTLED
    growing = begin < pupil.step < end * lesson.preset.steps
    if pupil.step % ROUND == 0 and growing:
        _, haze = _bounds(pupil.theta, pupil.widest, lesson, crew)
        pupil.theta[haze, OPACITY] = GONE
        moments = [pupil.first, pupil.second]
        most = lesson.preset.gaussians
        pupil.theta, moments = growth.moved(pupil.theta, moments, most, rng)
        pupil.first, pupil.second = moments
    if pupil.step % ROUND == 0:
        pupil.limits, _ = _bounds(pupil.theta, pupil.widest, lesson, crew)
    faint = np.flatnonzero(opacity(pupil.theta) < 0.1)
    reach = STIR * rate / lesson.radius
    pupil.theta[faint, MEAN:ROTATION] += growth.jitter(pupil.theta[faint], reach, rng)


def _bounds(
    theta: Parameters, widest: float, lesson: Lesson, crew: Crew
) -> tuple[Limits, Bool[np.ndarray, " N"]]:
    """Return what Gaussians may do, and which of them are haze; masks leave no room for any."""
    if lesson.surfaces is None:
        return limits.even(theta, widest), np.zeros(len(theta), np.bool_)
    return limits.strict(theta, lesson.radius, lesson.surfaces, crew)


def _rates(lesson: Lesson, pupil: Pupil) -> Float32[np.ndarray, " D"]:
    """Return Adam's rate for each column."""
    share = pupil.step / lesson.preset.steps
    rates = np.empty(pupil.theta.shape[1], np.float32)
    for column, rate in RATES.items():
        rates[column:] = rate * FALL.get(column, 1.0) ** share
    rates[MEAN:ROTATION] *= lesson.radius
    return rates


def _turn(lesson: Lesson, step: int) -> int:
    """Return whose turn it is: every view once, then again in another order."""
    lap, place = divmod(step, len(lesson.learned))
    return lesson.learned[
        np.random.default_rng([lesson.seed, 2, lap]).permutation(len(lesson.learned))[place]
    ]


def _of(views: Views, masks: Masks | None, which: list[int]) -> tuple[Views, Masks | None]:
    cameras = tuple(views.cameras[k] for k in which)
    return Views(views.rgb[which], cameras), None if masks is None else masks[which]
