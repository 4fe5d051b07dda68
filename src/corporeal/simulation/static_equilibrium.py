"""Static equilibrium under gravity before time 0, by dynamic relaxation.

Poses at rest come from rigid bodies. Here soft objects sink until they carry their weight and what lies on them. Motion
is taken out by kinetic damping (Cundall 1976; Barnes 1999, "Form finding and analysis of tension structures by dynamic
relaxation"): whenever the kinetic energy of an object passes a maximum it lies near its balance, and is stopped there.
There is no coefficient to choose, and what falls over falls as fast as in reality. In the end nothing is damped for a
while; only what stays by itself has found its balance.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Keyframes, Push
from corporeal.mpm.problem import Engine, Problem, Snapshot
from corporeal.simulation.ledger_row import object_of_body

ENERGY_CHECK_INTERVAL_RATIO = 0.1
"""Interval of energy checks, over √(dx/g): a free fall of 1/200 of a cell."""
CALM_WINDOW_S, CALM_DRIFT_DX = 0.05, 0.02
"""Less than so many cells within so many seconds [s, dx]: rest is tested."""
WATCH_WINDOW_S, STILL_DRIFT_DX = 0.25, 0.1
"""It stays when, left alone so long, nothing drifts by so much [s, dx]: a fifth of what counts as motion
(docs/reference/static-equilibrium-benchmark.md)."""
MAX_RELAXATION_S = 4.0
"""Maximum relaxation time [s]."""
CHECKS_BETWEEN_SAVE_POINTS = 10
"""Checks between two stopping tests."""
MAXWELL_RELAXATION_SPEEDUP = 1e6
"""How much faster Maxwell branches forget here [-]: what lies has had all the time it takes."""

RESTING_PATH = Keyframes((0.0,), ((0.0, 0.0, 0.0),), ((0.0, 0.0, 0.0),))
"""Objects with a prescribed path are held at its start."""

SaveCallback = Callable[[float], None]


@dataclass(frozen=True)
class StaticEquilibrium:
    """Result of the relaxation; B objects."""

    seconds: float
    """Duration [s]."""
    found: bool
    """Whether they came to rest."""
    moved: Float[np.ndarray, "B 3"]
    """Displacement of their centres of mass [m]."""
    farthest: Float[np.ndarray, " B"]
    """Largest displacement of a particle [m]."""
    state: dict[str, np.ndarray]
    """State of the engine at rest."""


def settling_problem(problem: Problem, hung: set[int]) -> Problem:
    """Return the problem without motion, wind, forces and loss.

    Branches that forget at once neither bear nor lose anything: what remains is the slow modulus, which alone carries
    what has lain for long.

    Args:
        problem: Of the video.
        hung: Unsupported bodies: gravity does not pull them.
    """
    x, y, z = problem.gravity
    bodies = [
        replace(
            body,
            velocity=np.zeros_like(body.velocity),
            vibration=MAXWELL_RELAXATION_SPEEDUP * body.vibration,
            push=Push((-x, -y, -z)) if k in hung else None,
            wind=None,
            path=None if body.path is None else RESTING_PATH,
        )
        for k, body in enumerate(problem.bodies)
    ]
    return replace(problem, bodies=tuple(bodies), gravity_ramp=0.0)


class DynamicRelaxation:
    """One dynamic relaxation, resumable."""

    def __init__(self, engine: Engine, problem: Problem, hung: set[int]) -> None:
        """Look at the start.

        Args:
            engine: Fresh, of the problem.
            problem: What ``settling_problem`` returned.
            hung: Bodies that are held where they are.
        """
        self.engine, self.cell, self.hung = engine, problem.cell, hung
        group = object_of_body(problem)
        self.members = [np.flatnonzero(group == k).tolist() for k in range(group.max() + 1)]
        self.bodies = range(len(group))
        self.owner = np.repeat(group, [len(b.position) for b in problem.bodies])
        self.sample = ENERGY_CHECK_INTERVAL_RATIO * float(np.sqrt(self.cell / np.linalg.norm(problem.gravity)))
        self.first: Snapshot = engine.snapshot()
        self.start, self.energy = self._look()
        self.energy[:] = 0.0
        self.anchor, self.since, self.count, self.watching = self.start.copy(), 0.0, 0, False

    def run(self, pause: SaveCallback, max_seconds: float = MAX_RELAXATION_S) -> StaticEquilibrium:
        """Run until equilibrium, or time is up.

        Args:
            pause: Called with the time [s] whenever the state can be saved.
            max_seconds: Gives up after so long [s].
        """
        found = False
        while not found and self.engine.time < max_seconds:
            if self.count % CHECKS_BETWEEN_SAVE_POINTS == 0:
                pause(self.engine.time)
            self.count += 1
            self.engine.advance(self.count * self.sample)
            found = self._judge()
        self.engine.stop(self.bodies)
        return self._balance(found)

    def _judge(self) -> bool:
        """Apply kinetic damping; return whether everything is at rest."""
        centre, energy = self._look()
        self.engine.stop(self.hung)
        drift = float(np.linalg.norm(centre - self.anchor, axis=1).max()) / self.cell
        waited = self.engine.time - self.since
        if self.watching:
            if drift < STILL_DRIFT_DX:
                return waited >= WATCH_WINDOW_S
            self._note(centre, watching=False)
            return False
        falling = energy < self.energy
        self.energy = np.where(falling, 0.0, energy)
        self.engine.stop([b for k in np.flatnonzero(falling) for b in self.members[k]])
        if waited >= CALM_WINDOW_S:
            self._note(centre, watching=drift < CALM_DRIFT_DX)
        return False

    def _note(self, centre: np.ndarray, watching: bool) -> None:
        """Measure drift from now on; what is watched starts at rest."""
        self.anchor, self.since, self.watching = centre, self.engine.time, watching
        if watching:
            self.engine.stop(self.bodies)
            self.energy = np.zeros_like(self.energy)

    def _look(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass [m] and kinetic energy [J] of every object."""
        now = self.engine.measure()
        shares = [now.mass[m] / now.mass[m].sum() for m in self.members]
        centre = [s @ now.centre[m] for s, m in zip(shares, self.members, strict=True)]
        return np.stack(centre), np.array([now.kinetic[m].sum() for m in self.members])

    def _balance(self, found: bool) -> StaticEquilibrium:
        far = np.linalg.norm(self.engine.snapshot().position - self.first.position, axis=1)
        return StaticEquilibrium(
            seconds=self.engine.time,
            found=found,
            moved=self._look()[0] - self.start,
            farthest=np.array([far[self.owner == k].max() for k in range(len(self.members))]),
            state=self.engine.save(),
        )

    def saved(self) -> dict[str, np.ndarray]:
        """State to resume bit for bit."""
        own = {"settling.anchor": self.anchor, "settling.energy": self.energy}
        own["settling.clock"] = np.array([self.since, self.count, self.watching], float)
        return self.engine.save() | own

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Restore the state returned by ``saved``."""
        self.engine.restore(saved)
        self.anchor, self.energy = saved["settling.anchor"], saved["settling.energy"]
        since, count, watching = saved["settling.clock"].tolist()
        self.since, self.count, self.watching = since, int(count), bool(watching)
