"""Bodies that come to a running problem, or break: an engine is followed by another one.

An engine says how it is built anew and what it takes over of the one before. What is the same in all of them is here:
the problem after it, who is whole, what stays held, what is booked.
"""

from abc import abstractmethod
from typing import Self

import numpy as np

from corporeal.mpm.add_bodies import AddedBodies, adopt_running_conditions
from corporeal.mpm.engine_interaction import EngineInteraction
from corporeal.mpm.problem import BodySplit, Problem
from corporeal.mpm.split_body import ParentMap, split_problem

BodyChange = AddedBodies | ParentMap
"""Which bodies are what they were, and what the others inherit of the books."""


class EngineBodyChanges(EngineInteraction):
    """More bodies, or pieces of one, over accessors that an engine gives."""

    def with_added_bodies(self, problem: Problem) -> Self:
        """Return an engine with more bodies: see ``problem.BodyAddingEngine``."""
        change = AddedBodies(len(self.problem.bodies), len(problem.bodies))
        after = self._followed_by(adopt_running_conditions(problem, self.problem), change)
        added = after.measure().potential[change.before :]
        after._enter(change.before, np.zeros(3), float(added.sum()))
        return after

    def with_split_body(self, split: BodySplit) -> Self:
        """Return an engine with a body in pieces: see ``problem.BodySplittingEngine``."""
        change = ParentMap.of(self.problem, split)
        return self._followed_by(split_problem(self.problem, split), change)

    def _followed_by(self, problem: Problem, change: BodyChange) -> Self:
        after, whole = self._successor(problem, change), change.whole
        after.grips = {b: grip for b, grip in self.grips.items() if b in whole}
        if after.grips:
            after._take_grips()
        return after

    @abstractmethod
    def _successor(self, problem: Problem, change: BodyChange) -> Self:
        """Build an engine of the same kind and options that goes on from here.

        Its time, steps, books and the bodies that are whole are as here. All other bodies are where the problem says,
        nothing is held, and contacts are looked for anew in the next step.
        """
