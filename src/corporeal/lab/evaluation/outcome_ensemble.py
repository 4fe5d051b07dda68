"""Uncertainty of the outcome by an ensemble of sampled material values.

Every member is drawn as a whole (materials/value_sampling.py), filled anew and simulated; its frames are dropped once
its outcome is known. A member that is done is not done again, and one that was cut off goes on, as a run does.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import SimulationError, UserError
from corporeal.lab.evaluation.figure_files import save_figure
from corporeal.materials.value_sampling import sample_material_field
from corporeal.pipeline.mass_posterior import sample_hypotheses
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import (
    Progress,
    ProgressOfStage,
    Settings,
    no_progress_of_stage,
    open_run,
    read_run_request,
)
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
from corporeal.render.figure_legends import drawable_name
from corporeal.simulation.outcome import measure_outcome
from corporeal.simulation.trajectory_files import FRAMES_FOLDER

MEMBERS_FOLDER, MEMBER_FILE, SPREAD_FILE = "ensemble", "outcome.json", "ensemble.json"
SPREAD_QUANTITIES = {
    "mass_kg": "mass [kg]",
    "rebound_m": "rebound [m]",
    "rebound_ratio": "rebound over fall",
    "dent_depth_m": "dent [m]",
    "deepest_squeeze_m": "deepest squeeze [m]",
    "moved_level_m": "moved across [m]",
    "turned_deg": "turned [°]",
}
"""Outcome numbers whose spread is reported."""
INTERVAL_LOW_QUANTILE, INTERVAL_HIGH_QUANTILE = 0.05, 0.95
MAX_MEMBERS = 1000
"""Members of one ensemble."""


ObjectQuantities = Mapping[str, Mapping[str, float | None]]
"""Object → quantity → what it was."""


@dataclass(frozen=True)
class QuantitySpread:
    """How far one quantity of one object is known."""

    chosen: float | None
    """In the run's own simulation."""
    count: int
    """Members in which there was such a number."""
    low: float | None = None
    """5 % of these are below."""
    median: float | None = None
    high: float | None = None
    """5 % are above."""
    smallest: float | None = None
    largest: float | None = None


@dataclass(frozen=True)
class MemberOutcome:
    """What was drawn for one member, and what came of it."""

    number: int
    drawn: tuple[Mapping[str, str | float], ...]
    """Per part: ``part``, ``material``, and field of ``Material`` → value [SI]."""
    objects: ObjectQuantities
    """Empty where it could not be simulated to the end."""
    error: str = ""
    """Why not."""


@dataclass(frozen=True)
class Ensemble:
    """A run simulated again with other values from the ranges."""

    samples: int
    seed: int
    interval: tuple[float, float]
    """Shares of the members below ``Spread.low`` and ``Spread.high``."""
    chosen: ObjectQuantities
    """Of the run itself."""
    members: tuple[MemberOutcome, ...]
    spread: Mapping[str, Mapping[str, QuantitySpread]]
    """Object → quantity → how far it is known."""

    def of(self, obj: str, quantity: str) -> QuantitySpread:
        """Return how far one of ``SPREAD_QUANTITIES`` of an object is known."""
        return self.spread[obj][quantity]


@dataclass(frozen=True)
class EnsembleMember:
    """One drawn set of values, and where its result goes."""

    number: int
    seed: int
    folder: Path
    key: str

    @property
    def random(self) -> np.random.Generator:
        """Source of all that is drawn for it."""
        return np.random.default_rng([self.seed, self.number])


def simulate_ensemble(
    folder: Path,
    samples: int,
    seed: int = 0,
    config: SimulateConfig | None = None,
    tell: ProgressOfStage = no_progress_of_stage,
) -> Ensemble:
    """Simulate a run again ``samples`` times over the ranges, and keep the spread in its folder.

    Args:
        folder: The run's; its own simulation is done first, where it is not done yet.
        samples: How many sets of values are drawn.
        seed: Of the draws.
        config: How to simulate; None: as the run was.
        tell: Progress callback of each stage.

    Raises:
        UserError: The folder is no run, or the number of samples makes no sense.
    """
    if not 1 <= samples <= MAX_MEMBERS:
        raise UserError(f"--samples is {samples}. Give a number from 1 to {MAX_MEMBERS}.")
    asked = read_run_request(folder)
    settings = asked.settings
    if config is not None:
        settings = replace(settings, simulate=config)
    with open_run(asked.inputs, folder, settings, tell, "simulate") as work:
        made = work.made
        progress = tell("ensemble")
        chosen = outcome_row(made)
        rows = []
        for number in range(samples):
            name = store.result_key("member", {"seed": seed, "number": number}, [work.key])
            member = EnsembleMember(number, seed, folder / MEMBERS_FOLDER / f"{number:03d}", name)
            rows.append(_member(member, made, settings, _share(progress, number, samples)))
        known = outcome_spread(chosen, rows)
        result = Ensemble(samples, seed, (INTERVAL_LOW_QUANTILE, INTERVAL_HIGH_QUANTILE), chosen, tuple(rows), known)
        store.write_json(folder / SPREAD_FILE, result)
    return result


def _share(progress: Progress, number: int, samples: int) -> Progress:
    def tell(fraction: float, words: str) -> None:
        progress((number + fraction) / samples, f"{number + 1} of {samples}: {words}")

    return tell


def _member(member: EnsembleMember, made: StageResults, settings: Settings, progress: Progress) -> MemberOutcome:
    """Return a member's outcome, from disk where it is done."""
    place = member.folder
    if store.is_fresh(place, member.key):
        progress(1.0, "done before")
        return from_plain(MemberOutcome, store.read_json(place / MEMBER_FILE))
    started = place / "started.json"
    if place.exists() and not (started.exists() and store.read_json(started) == member.key):
        shutil.rmtree(place)
    store.begin_result(place)
    store.write_json(started, member.key)
    row = _simulated(member, made, settings, progress)
    store.write_json(place / MEMBER_FILE, row)
    shutil.rmtree(place / FRAMES_FOLDER, ignore_errors=True)
    store.finish_result(place, member.key, {"number": member.number, "seed": member.seed}, 0.0)
    return row


def _simulated(member: EnsembleMember, made: StageResults, settings: Settings, progress: Progress) -> MemberOutcome:
    random = member.random
    scene, parts, _ = made.assembled.all
    library, floor = settings.ground.library, settings.ground.floor
    words = sample_hypotheses(made.inventory, made.field.mixtures, random, library)
    field = ground(scene, parts, words, settings.ground)
    field = sample_material_field(field, [p.object for p in parts.catalogue], random, library, floor)
    progress(0.0, "filling")
    particles = fill(scene, parts, field, settings.fill)
    drawn = tuple(
        {"part": w.name, "material": m.name} | {f: g.value for f, g in m.grounds.items()}
        for w, m in zip(field.words, field.materials, strict=True)
    )
    try:
        trajectory = simulate(scene, particles, field, settings.simulate, member.folder, progress)
    except SimulationError as error:
        return MemberOutcome(member.number, drawn, {}, str(error))
    again = made.having("ground", field).having("fill", particles).having("simulate", trajectory)
    return MemberOutcome(member.number, drawn, outcome_row(again))


def outcome_row(made: StageResults) -> ObjectQuantities:
    """Return what happened to every object, what moved in vessels and broke off included."""
    scene, particles = made.scene, made.particles
    happened = measure_outcome(scene, particles, made.field, made.trajectory).objects
    mass = np.bincount(particles.object, particles.mass, len(scene.objects))
    return {
        obj.name: {q: float(mass[k]) if q == "mass_kg" else getattr(happened[obj.name], q) for q in SPREAD_QUANTITIES}
        for k, obj in enumerate(scene.objects)
    }


def outcome_spread(
    chosen: ObjectQuantities, rows: Sequence[MemberOutcome]
) -> Mapping[str, Mapping[str, QuantitySpread]]:
    """Return how far each outcome number is spread over the members that came through."""
    return {
        name: {q: _spread(own[q], [r.objects[name][q] for r in rows if name in r.objects]) for q in own}
        for name, own in chosen.items()
    }


def _spread(chosen: float | None, values: Sequence[float | None]) -> QuantitySpread:
    known = np.array([v for v in values if v is not None])
    if not len(known):
        return QuantitySpread(chosen, 0)
    low, median, high = np.quantile(known, [INTERVAL_LOW_QUANTILE, 0.5, INTERVAL_HIGH_QUANTILE])
    return QuantitySpread(
        chosen=chosen,
        count=len(known),
        low=float(low),
        median=float(median),
        high=float(high),
        smallest=float(known.min()),
        largest=float(known.max()),
    )


SPREAD_HEADS = ("object", "quantity", "as chosen", "5 %", "median", "95 %", "members")
NEGLIGIBLE_SPREAD = 1e-9
"""A spread below this is none."""
FIGURE_COLUMNS = 4
INK_COLOUR, MEMBER_COLOUR, CHOSEN_COLOUR = "#222222", "#9fb8c4", "#c8553d"


def spread_rows(result: Ensemble) -> list[tuple[str, ...]]:
    """Return one row per object and quantity that has a value."""
    return [
        (name, SPREAD_QUANTITIES[quantity], *map(_number, (s.chosen, s.low, s.median, s.high)), str(s.count))
        for name, own in result.spread.items()
        for quantity, s in own.items()
        if s.count
    ]


def failed_members(result: Ensemble) -> list[str]:
    """Return which members could not be simulated to the end."""
    return [f"Member {member.number} stopped: {member.error}" for member in result.members if member.error]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def spread_figure(result: Ensemble, path: Path) -> None:
    """Draw a panel per quantity: every member, the interval, and what was chosen."""
    shown = [q for q in SPREAD_QUANTITIES if _varies(result, q)]
    names = list(result.spread)
    lines = -(-max(len(shown), 1) // FIGURE_COLUMNS)
    size = (2.6 * FIGURE_COLUMNS, lines * (0.3 * len(names) + 0.9))
    figure = Figure(figsize=size, dpi=150, layout="constrained")
    panels = figure.subplots(lines, FIGURE_COLUMNS, sharey=True, squeeze=False).ravel()
    for axes, quantity in zip(panels, shown, strict=False):
        for k, name in enumerate(names):
            _draw(axes, result, name, quantity, k)
        axes.set_xlabel(SPREAD_QUANTITIES[quantity], fontsize=8)
        axes.tick_params(labelsize=7)
        axes.margins(x=0.12)
    for axes in panels[len(shown) :]:
        axes.axis("off")
    called = [drawable_name(n.replace("_", " "), f"object {k + 1}") for k, n in enumerate(names)]
    panels[0].set_yticks(range(len(names)), called, fontsize=7)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    save_figure(figure, path)


def _varies(result: Ensemble, quantity: str) -> bool:
    found = [result.of(name, quantity) for name in result.spread]
    return any((s.largest or 0.0) - (s.smallest or 0.0) > NEGLIGIBLE_SPREAD for s in found)


def _draw(axes: Any, result: Ensemble, name: str, quantity: str, k: int) -> None:
    own = result.of(name, quantity)
    if not own.count:
        return
    values = [member.objects[name][quantity] for member in result.members if member.objects]
    values = [v for v in values if v is not None]
    axes.plot([own.low, own.high], [k, k], color=MEMBER_COLOUR, lw=7, solid_capstyle="butt")
    axes.plot(values, [k] * len(values), "o", color=INK_COLOUR, ms=2.5, alpha=0.6, mew=0)
    if own.chosen is not None:
        axes.plot([own.chosen], [k], "D", color=CHOSEN_COLOUR, ms=5, mew=0)
