"""Mean dilatation of nearly incompressible material (decision laws-mean-dilatation).

Taken from every particle's own J, pressure would lock: eight constraints in a cell that has three nodes' worth of
freedom make a block of ν = 0.49 up to a sixth too stiff.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.mpm.constants import TINY_DOUBLE
from corporeal.mpm.state import ParticleConstants, State


@dataclass(frozen=True)
class DilatationClusters:
    """Groups of nearly incompressible particles: those of one field in 2 x 2 x 2 cells."""

    chosen: Int[np.ndarray, " M"]
    """Which particles belong to any."""
    of: Int[np.ndarray, " M"]
    """Which group each of them belongs to."""
    volume: Float[np.ndarray, " M"]
    """Their rest volume V [m³]."""

    def mean(self, values: Float[np.ndarray, " P"]) -> Float[np.ndarray, " P"]:
        """Σ V a / Σ V over the particle's group; 0 for particles without one.

        This map A is a projection and V-symmetric, Σ V a (A b) = Σ V (A a) b: used on the rates of dilatation and on
        the pressures of one step, it makes forces that are the slope of the stored energy.
        """
        weight = np.bincount(self.of, self.volume)
        total = np.bincount(self.of, self.volume * values[self.chosen])
        out = np.zeros_like(values)
        out[self.chosen] = (total / np.maximum(weight, TINY_DOUBLE))[self.of]
        return out


def group_clusters(
    matter: ParticleConstants, state: State, field: Int[np.ndarray, " P"], cell: float
) -> DilatationClusters:
    """Group particles by the pair of cells, along each axis, that their splines are centred in."""
    chosen = np.flatnonzero(matter.uses_mean_dilatation)
    place = np.floor(state.position[chosen] / cell - 0.5).astype(np.int64) >> 1
    rows = np.column_stack([field[chosen], place])
    of = np.unique(rows, axis=0, return_inverse=True)[1] if len(rows) else np.zeros(0, np.int64)
    return DilatationClusters(chosen, of.reshape(-1), matter.volume[chosen])
