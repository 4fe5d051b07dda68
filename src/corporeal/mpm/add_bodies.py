"""Adding bodies to a running problem; state and ledgers of the others are unchanged."""

from dataclasses import dataclass, replace

import numpy as np

from corporeal.mpm.problem import Problem


@dataclass(frozen=True)
class AddedBodies:
    """A problem with more bodies than before; they come after those that were there."""

    before: int
    """Bodies that were there."""
    now: int

    @property
    def whole(self) -> set[int]:
        """Bodies that are what they were."""
        return set(range(self.before))

    def inherited(self, book: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Open an empty page for who joins, by the names of ``Ledger``."""
        at = np.full(self.now - self.before, self.before)
        found = dict(book)
        found["external_impulse"] = np.insert(book["external_impulse"], at, 0.0, axis=0)
        found["plane_impulse"] = np.insert(book["plane_impulse"], at, 0.0, axis=1)
        for name in ("pair_impulse", "impact_of_pair"):
            found[name] = _table_with_new_rows(book[name], at, 0.0)
        for name in ("first_contact", "last_contact", "contact_point"):
            found[name] = _table_with_new_rows(book[name], at, np.nan)
        return found


def _table_with_new_rows(table: np.ndarray, at: np.ndarray, value: float) -> np.ndarray:
    return np.insert(np.insert(table, at, value, axis=0), at, value, axis=1)


def adopt_running_conditions(problem: Problem, running: Problem) -> Problem:
    """Return a problem with more bodies, under the gravity, winds and contact of one that runs.

    Args:
        problem: With those that join after all others.
        running: What was simulated until now.
    """
    blown = [replace(body, wind=old.wind) for body, old in zip(problem.bodies, running.bodies, strict=False)]
    return replace(
        problem,
        bodies=(*blown, *problem.bodies[len(blown) :]),
        gravity=running.gravity,
        gravity_ramp=running.gravity_ramp,
        contact=running.contact,
    )
