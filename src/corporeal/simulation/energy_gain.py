"""Detection of unphysical energy gain, per object and frame."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.audit_data import EnergyGain
from corporeal.core.errors import SimulationError
from corporeal.core.types import Ledger
from corporeal.mpm.problem import Problem
from corporeal.simulation.ledger_row import object_of_body

MAX_FREE_FLIGHT_GROWTH = 0.01
"""Growth of an object's energy in flight, as a share of the most it had, that ends a run: explicit steps and transfers
between particles and grid only lose energy."""


class EnergyWatch:
    """Compares every frame of a run with those before it, object by object.

    Between two frames in which an object touched nothing and no push, wind or grip did work, its motion, strain and
    height together can only lose energy; what they gain comes from the method.
    """

    def __init__(self, names: Sequence[str], pull: float, cell: float) -> None:
        """Begin before the first frame.

        Args:
            names: Of the objects, in the ledger's order.
            pull: Strength of gravity [m/s²].
            cell: dx [m].
        """
        self.names, self.smallest = names, pull * cell
        self.time = np.inf
        self.work = 0.0
        self.least = np.zeros(len(names))
        self.most = np.zeros(len(names))

    @classmethod
    def of(cls, problem: Problem) -> "EnergyWatch | None":
        """Watch a problem's objects; None where all share one field, which books no contacts."""
        if problem.contact == "single":
            return None
        group = object_of_body(problem).tolist()
        names = [problem.bodies[group.index(k)].name for k in range(max(group) + 1)]
        return cls(names, float(np.linalg.norm(problem.gravity)), problem.cell)

    def see(self, row: Ledger) -> None:
        """Look at the next frame.

        Raises:
            SimulationError: An object gained energy without external work.
        """
        moving = row.kinetic + row.elastic
        energy = moving + row.potential
        alone = self._left_alone(row)
        self.least = np.where(alone, np.minimum(self.least, energy), energy)
        self.most = np.where(alone, self.most, np.maximum(self.most, moving))
        scale = np.maximum(self.most, row.mass * self.smallest)
        share = (energy - self.least) / np.maximum(scale, 1e-300)
        self.time, self.work = float(row.time), float(row.push_work)
        worst = int(np.argmax(share))
        if share[worst] > MAX_FREE_FLIGHT_GROWTH:
            raise SimulationError(
                f"At t = {self.time:.4g} s {self.names[worst]!r} had gained {share[worst]:.1%} of "
                "its energy although it touched nothing and nothing pushed it: its motion from "
                "there on is not physical. Earlier frames are kept. Use more detail, and report "
                "this."
            )

    def _left_alone(self, row: Ledger) -> Bool[np.ndarray, " B"]:
        """Which objects touched nothing since the last frame; none where outer forces worked."""
        last = np.nan_to_num(row.last_contact[: len(self.names)], nan=-np.inf).max(axis=1)
        # Contacts bear the time at which their step began.
        return (last < self.time) & np.isfinite(self.time) & (row.push_work == self.work)


def energy_gain(
    ledger: Ledger, names: Sequence[str], balance: Float[np.ndarray, " F"], allowed: float
) -> EnergyGain | None:
    """Say in which object energy from nowhere gathered, and when it passed what is allowed.

    Args:
        ledger: Of all frames.
        names: Of the objects.
        balance: Energy of all less what work accounts for [J].
        allowed: Growth of it that is no breach [J].

    Returns:
        None where it never grew so much.
    """
    grown = balance - balance[0]
    beyond = np.flatnonzero(~(grown <= allowed))
    if not len(beyond):
        return None
    held = ledger.kinetic + ledger.elastic + ledger.potential
    whose = int(np.argmax(np.nan_to_num(held - held[0], nan=np.inf)[int(np.nanargmax(grown))]))
    first = int(beyond[0])
    return EnergyGain(names[whose], first, float(ledger.time[first]))
