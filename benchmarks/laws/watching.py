"""Step an engine and remember what it measured on the way."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from corporeal.mpm.problem import Diagnostics, Engine, Problem
from laws.asked import production


@dataclass(frozen=True)
class History:
    """Measures at increasing times; T times, B bodies."""

    run: Engine
    measures: list[Diagnostics]

    def all(self, name: str) -> np.ndarray:
        """One field of every measure, stacked."""
        return np.array([getattr(m, name) for m in self.measures])

    @property
    def time(self) -> Float[np.ndarray, " T"]:
        """When [s]."""
        return self.all("time")

    @property
    def velocity(self) -> Float[np.ndarray, "T B 3"]:
        """Of the centres of mass [m/s]."""
        return self.all("momentum") / self.all("mass")[..., None]

    @property
    def moved(self) -> Float[np.ndarray, "T B 3"]:
        """Of the centres of mass, since the start [m]."""
        centre = self.all("centre")
        return centre - centre[0]

    @property
    def energy(self) -> Float[np.ndarray, " T"]:
        """Kinetic, elastic and potential, of all bodies [J]."""
        parts = (self.all(name).sum(axis=1) for name in ("kinetic", "elastic", "potential"))
        return sum(parts, np.zeros(len(self.measures)))


def started(given: Problem) -> Any:
    """Build the engine that is asked, on one thread: cases run side by side."""
    return production(given)


def watch(run: Engine, until: float, looks: int) -> History:
    """Advance in equal parts and measure after each."""
    measures = [run.measure()]
    for time in np.linspace(0.0, until, looks + 1)[1:]:
        run.advance(float(time))
        measures.append(run.measure())
    return History(run, measures)


@dataclass(frozen=True)
class Path:
    """Where groups of particles were on average, and how fast; T times, G groups."""

    time: Float[np.ndarray, " T"]
    """[s]"""
    place: Float[np.ndarray, "T G 3"]
    """[m]"""
    velocity: Float[np.ndarray, "T G 3"]
    """[m/s]"""

    @property
    def moved(self) -> Float[np.ndarray, "T G 3"]:
        """Since the start [m]."""
        return self.place - self.place[0]


def follow(run: Engine, until: float, looks: int, groups: list[np.ndarray] | None = None) -> Path:
    """Advance in equal parts and look where groups of particles are: cheaper than to measure.

    Args:
        run: The engine; its time may be past 0.
        until: The last look [s].
        looks: How many after the first, which is now.
        groups: Which particles, bodies in the problem's order; None: one group per body.

    """
    groups = bodies_of(run.problem) if groups is None else groups
    times = np.linspace(run.time, until, looks + 1)
    rows = []
    for time in times:
        run.advance(float(time))
        now = run.snapshot()
        rows.append([(now.position[g].mean(axis=0), now.velocity[g].mean(axis=0)) for g in groups])
    place, velocity = np.moveaxis(np.array(rows), 2, 0)
    return Path(times, place, velocity)


def bodies_of(given: Problem) -> list[np.ndarray]:
    """Return the particles of each body."""
    ends = np.cumsum([len(b.position) for b in given.bodies])
    return np.split(np.arange(ends[-1]), ends[:-1])


def crossing(time: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return the times at which a value falls through zero, interpolated."""
    k = np.flatnonzero((value[:-1] > 0) & (value[1:] <= 0))
    return time[k] + (time[k + 1] - time[k]) * value[k] / (value[k] - value[k + 1])


def half_width(time: np.ndarray, impulse: np.ndarray) -> float:
    """Width of a force at half its peak [s], from what it accumulates to; nan: no force."""
    force = np.diff(impulse) / np.diff(time)
    if force.max() <= 0:
        return float("nan")
    return float(np.sum(np.diff(time)[force > 0.5 * force.max()]))


def rise(time: np.ndarray, value: np.ndarray, low: float, high: float) -> float:
    """Return how long a value takes to climb from ``low`` to ``high`` for the first time [s]."""
    return first_above(time, value, high) - first_above(time, value, low)


def first_above(time: np.ndarray, value: np.ndarray, level: float) -> float:
    """Time at which a value first exceeds a level, interpolated [s]; nan: never."""
    over = np.flatnonzero(value > level)
    if not len(over) or over[0] == 0:
        return float("nan")
    k = over[0]
    share = (level - value[k - 1]) / (value[k] - value[k - 1])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))
