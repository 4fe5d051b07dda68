"""Splitting of a rigid body; mass, momentum and ledgers are conserved."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.mpm.problem import Body, BodySplit, Problem


@dataclass(frozen=True)
class ParentMap:
    """Who comes of whom in a problem with a split body; B bodies now."""

    parent: Int[np.ndarray, " B"]
    """Number of each body's parent before; its own where it is whole."""
    share: Float[np.ndarray, " B"]
    """Of the parent's mass [-]."""

    @classmethod
    def of(cls, problem: Problem, split: BodySplit) -> "ParentMap":
        """Return who comes of whom."""
        body, more = problem.bodies[split.body], split.count - 1
        mass = np.bincount(split.piece, body.volume * body.density, split.count)
        share = np.ones(len(problem.bodies) + more)
        share[split.body], share[len(problem.bodies) :] = mass[0], mass[1:]
        share[[split.body, *range(len(problem.bodies), len(share))]] /= mass.sum()
        parent = np.append(np.arange(len(problem.bodies)), np.full(more, split.body))
        return cls(parent, share)

    @property
    def whole(self) -> set[int]:
        """Bodies that are what they were."""
        pieces = np.bincount(self.parent)
        return {b for b, parent in enumerate(self.parent) if b == parent and pieces[b] == 1}

    def inherited(self, book: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Share out what was booked of bodies and pairs, by the names of ``Ledger``.

        Sums go by mass; of contacts every piece inherits the times and places of the whole.
        """
        bodies = int(self.parent.max()) + 1
        planes = len(book["first_contact"]) - bodies
        rows = np.append(self.parent, bodies + np.arange(planes))
        square, by = np.ix_(self.parent, self.parent), self.share
        found = dict(book)
        found["external_impulse"] = book["external_impulse"][self.parent] * by[:, None]
        found["plane_impulse"] = book["plane_impulse"][:, self.parent] * by[:, None]
        found["pair_impulse"] = book["pair_impulse"][square] * by[:, None] * by
        all_by = np.append(by, np.ones(planes))
        found["impact_of_pair"] = book["impact_of_pair"][np.ix_(rows, rows)]
        found["impact_of_pair"] = found["impact_of_pair"] * all_by[:, None] * all_by
        for name in ("first_contact", "last_contact", "contact_point"):
            found[name] = book[name][np.ix_(rows, rows)]
        return found


def split_problem(problem: Problem, split: BodySplit) -> Problem:
    """Return the problem in which a rigid body is several, where they are and as they move now."""
    body, bodies = problem.bodies[split.body], list(problem.bodies)
    pieces = [_piece_body(body, split, k) for k in range(split.count)]
    bodies[split.body] = pieces[0]
    rows = np.append(
        np.append(np.arange(len(bodies)), np.full(split.count - 1, split.body)),
        len(bodies) + np.arange(len(problem.planes)),
    )
    return replace(
        problem,
        bodies=(*bodies, *pieces[1:]),
        friction=problem.friction[np.ix_(rows, rows)],
        restitution=problem.restitution[np.ix_(rows, rows)],
        restitution_law=None if problem.restitution_law is None else problem.restitution_law[np.ix_(rows, rows)],
        rolling_resistance=None
        if problem.rolling_resistance is None
        else problem.rolling_resistance[np.ix_(rows, rows)],
    )


def _piece_body(body: Body, split: BodySplit, k: int) -> Body:
    mine = split.piece == k
    columns = "volume density law young_pa poisson yield_stress hardening friction_angle cohesion"
    columns += " loss vibration consistency flow_index"
    held = {name: getattr(body, name) for name in columns.split()}
    return replace(
        body,
        position=split.position[mine],
        velocity=split.velocity[mine],
        surface=split.surfaces[k],
        curvature=np.zeros((0, CURVATURE_COLUMNS)),
        wetted_surface=None,
        **{name: None if value is None else value[mine] for name, value in held.items()},
    )


def can_split(problem: Problem, body: int) -> bool:
    """Whether a body is rigid and by itself: no tether, joint or wind acts on it."""
    one = problem.bodies[body]
    tied = {b for pair in (*problem.bonds, *problem.excluded_pairs) for b in pair}
    tied |= {b for joint in problem.joints for b in (joint.first, joint.second)}
    alone = one.wind is None and one.path is None and one.tether is None
    return one.rigid and alone and body not in tied and problem.contact == "multi"
