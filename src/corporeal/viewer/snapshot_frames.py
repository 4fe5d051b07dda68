"""Frames from an engine's snapshots."""

import numpy as np

from corporeal.core.types import Frame
from corporeal.discretization.build_model import ModelMapping
from corporeal.mpm.problem import Snapshot
from corporeal.simulation.equivalent_stress import VonMises


class SnapshotFrames:
    """Puts an engine's particles back into the order in which the scene was filled."""

    def __init__(self, posed: ModelMapping) -> None:
        """Remember the order."""
        self.stress = VonMises(posed.problem)
        self.place = np.empty_like(posed.order)
        self.place[posed.order] = np.arange(len(posed.order))
        counts = [len(body.position) for body in posed.problem.bodies]
        self.stiff = np.repeat(posed.rigid, counts)

    def frame(self, now: Snapshot) -> Frame:
        """Return an instant, with stresses; a rigid particle's deformation is its rotation."""
        motion = np.where(self.stiff[:, None, None], now.deformation, now.motion)[self.place]
        stress = self.stress.at(now)[self.place]
        return Frame(now.time, now.position[self.place], motion, stress)
