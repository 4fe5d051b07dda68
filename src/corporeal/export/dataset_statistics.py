"""Statistics of data sets over all runs, accumulated run by run."""

from typing import Any

import numpy as np
from jaxtyping import Float

from corporeal.export.particle_arrays import ParticleTable

CONNECTIVITY_RADIUS_DX = 1.5
"""Default radius of connectivity [cells]: holds the 26 neighbours of two points a cell."""


class DatasetStatistics:
    """What both loaders ask of a data set: bounds, steps, and how positions change; run by run."""

    def __init__(self) -> None:
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.changes = {"vel": _DifferenceStatistics(1), "acc": _DifferenceStatistics(2)}
        self.cells: list[float] = []
        self.steps: list[float] = []
        self.lengths: list[int] = []
        self.particles: list[int] = []

    def add(self, table: ParticleTable) -> None:
        """Take one more run into account."""
        self.low = np.minimum(self.low, table.position.min(axis=(0, 1)))
        self.high = np.maximum(self.high, table.position.max(axis=(0, 1)))
        for change in self.changes.values():
            change.add(table.position)
        self.cells.append(table.cell)
        self.steps.append(table.step)
        self.lengths.append(len(table.position))
        self.particles.append(table.position.shape[1])

    def metadata(self) -> dict[str, Any]:
        """Return the contents of ``metadata.json``."""
        cell = float(np.median(self.cells))
        rows = {
            "dim": 3,
            "dt": float(np.median(self.steps)),
            "write_every": 1,
            "sequence_length": min(self.lengths),
            "num_particles_max": max(self.particles),
            "dx": cell,
            "default_connectivity_radius": CONNECTIVITY_RADIUS_DX * cell,
            "bounds": np.stack([self.low, self.high], axis=1),
            "periodic_boundary_conditions": [False] * 3,
        }
        for name, change in self.changes.items():
            rows |= {f"{name}_mean": change.mean, f"{name}_std": change.spread}
        return rows


class _DifferenceStatistics:
    """Mean and standard deviation of differences from frame to frame [m per frame^order]."""

    def __init__(self, order: int) -> None:
        self.order, self.count = order, 0
        self.total, self.square = np.zeros(3), np.zeros(3)

    def add(self, position: Float[np.ndarray, "F P 3"]) -> None:
        for k in range(len(position) - self.order):
            step = np.diff(position[k : k + self.order + 1].astype(float), self.order, axis=0)[0]
            self.count += len(step)
            self.total += step.sum(axis=0)
            self.square += (step**2).sum(axis=0)

    @property
    def mean(self) -> np.ndarray:
        return self.total / max(self.count, 1)

    @property
    def spread(self) -> np.ndarray:
        return np.sqrt(np.maximum(self.square / max(self.count, 1) - self.mean**2, 0.0))
