"""How far the outcome is known: one run simulated again with other values from the ranges.

Every member is drawn as a whole (materials/ensemble.py), filled anew and simulated; its frames are
dropped once its outcome is known. A member that is done is not done again, and one that was cut off
goes on, as a run does.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from corporeal import store
from corporeal.errors import SimulationError, UserError
from corporeal.materials.ensemble import otherwise, sample
from corporeal.mpm.frames import FOLDER
from corporeal.mpm.outcome import outcome
from corporeal.pipeline import Progress, Settings, Tell, opened, reopen
from corporeal.stages.fill import fill
from corporeal.stages.ground import ground
from corporeal.stages.simulate import SimulateConfig, simulate
from corporeal.types import Particles, Scene, Trajectory

MEMBERS, DATA, SPREAD = "ensemble", "outcome.json", "ensemble.json"
QUANTITIES = {
    "mass_kg": "mass [kg]",
    "rebound_m": "rebound [m]",
    "rebound_ratio": "rebound over fall",
    "dent_depth_m": "dent [m]",
    "deepest_squeeze_m": "deepest squeeze [m]",
    "moved_level_m": "moved across [m]",
    "turned_deg": "turned [°]",
}
"""Outcome numbers whose spread is reported."""
LOW, HIGH = 0.05, 0.95
MOST = 1000
"""Members of one ensemble."""


@dataclass(frozen=True)
class Member:
    """One drawn set of values, and where its result goes."""

    number: int
    seed: int
    folder: Path
    key: str

    @property
    def random(self) -> np.random.Generator:
        """Source of all that is drawn for it."""
        return np.random.default_rng([self.seed, self.number])


def ensemble(
    folder: Path, samples: int, seed: int, config: SimulateConfig | None, tell: Tell
) -> dict[str, Any]:
    """Simulate a run again ``samples`` times over the ranges, and keep the spread in its folder.

    Args:
        folder: The run's; its own simulation is done first, where it is not done yet.
        samples: How many sets of values are drawn.
        seed: Of the draws.
        config: How to simulate; None: as the run was.
        tell: Whom to tell about progress.

    Returns:
        ``members``: one row each; ``spread[object][quantity]``: ``chosen`` (the run's own), ``low``
        (5 % of the members are below), ``median``, ``high``, ``smallest``, ``largest``, ``count``.

    Raises:
        UserError: The folder is no run, or the number of samples makes no sense.

    """
    if not 1 <= samples <= MOST:
        raise UserError(f"--samples is {samples}. Give a number from 1 to {MOST}.")
    inputs, settings = reopen(folder)
    if config is not None:
        settings = replace(settings, simulate=config)
    with opened(inputs, folder, settings, tell, "simulate") as (made, key):
        scene = made["assemble"]
        progress = tell("ensemble")
        chosen = outcome_row(scene, made["fill"], made["simulate"])
        rows = []
        for number in range(samples):
            name = store.key("member", {"seed": seed, "number": number}, [key])
            member = Member(number, seed, folder / MEMBERS / f"{number:03d}", name)
            rows.append(_member(member, made, settings, _share(progress, number, samples)))
        result = {
            "samples": samples,
            "seed": seed,
            "interval": [LOW, HIGH],
            "chosen": chosen,
            "members": rows,
            "spread": spread(chosen, rows),
        }
        store.write_json(folder / SPREAD, result)
    return result


def _share(progress: Progress, number: int, samples: int) -> Progress:
    def tell(fraction: float, words: str) -> None:
        progress((number + fraction) / samples, f"{number + 1} of {samples}: {words}")

    return tell


def _member(
    member: Member, made: Mapping[str, Any], settings: Settings, progress: Progress
) -> dict[str, Any]:
    """Return a member's outcome, from disk where it is done."""
    place = member.folder
    if store.fresh(place, member.key):
        progress(1.0, "done before")
        return store.read_json(place / DATA)
    started = place / "started.json"
    if place.exists() and not (started.exists() and store.read_json(started) == member.key):
        shutil.rmtree(place)
    store.begin(place)
    store.write_json(started, member.key)
    row = {"number": member.number} | _simulated(member, made, settings, progress)
    store.write_json(place / DATA, row)
    shutil.rmtree(place / FOLDER, ignore_errors=True)
    store.finish(place, member.key, {"number": member.number, "seed": member.seed}, 0.0)
    return row


def _simulated(
    member: Member, made: Mapping[str, Any], settings: Settings, progress: Progress
) -> dict[str, Any]:
    scene, parts, random = made["assemble"], made["segment"], member.random
    library, floor = settings.ground.library, settings.ground.floor
    words = otherwise(made["describe"], random, library)
    field = ground(scene, parts, words, settings.ground)
    field = sample(field, [p.object for p in parts.catalogue], random, library, floor)
    progress(0.0, "filling")
    particles = fill(scene, parts, field, settings.fill)
    drawn = [
        {"part": w.name, "material": m.name} | {f: g.value for f, g in m.grounds.items()}
        for w, m in zip(field.words, field.materials, strict=True)
    ]
    try:
        trajectory = simulate(scene, particles, field, settings.simulate, member.folder, progress)
    except SimulationError as error:
        return {"error": str(error), "drawn": drawn, "objects": {}}
    return {"drawn": drawn, "objects": outcome_row(scene, particles, trajectory)}


def outcome_row(
    scene: Scene, particles: Particles, trajectory: Trajectory
) -> dict[str, dict[str, float | None]]:
    """Return what happened to every object: name → quantity → number."""
    happened = outcome(scene, particles, trajectory)["objects"]
    mass = np.bincount(particles.object, particles.mass, len(scene.objects))
    return {
        thing.name: {
            q: float(mass[k]) if q == "mass_kg" else happened[thing.name][q] for q in QUANTITIES
        }
        for k, thing in enumerate(scene.objects)
    }


def spread(
    chosen: Mapping[str, Mapping[str, float | None]], rows: Sequence[Mapping[str, Any]]
) -> dict[str, dict[str, dict[str, float | int | None]]]:
    """Say how far each outcome number is spread over the members that came through."""
    return {
        name: {
            q: _spread(own[q], [r["objects"][name][q] for r in rows if r["objects"]]) for q in own
        }
        for name, own in chosen.items()
    }


def _spread(chosen: float | None, values: Sequence[float | None]) -> dict[str, float | int | None]:
    known = np.array([v for v in values if v is not None])
    if not len(known):
        return {"chosen": chosen, "count": 0}
    low, median, high = np.quantile(known, [LOW, 0.5, HIGH])
    return {
        "chosen": chosen,
        "low": float(low),
        "median": float(median),
        "high": float(high),
        "smallest": float(known.min()),
        "largest": float(known.max()),
        "count": len(known),
    }
