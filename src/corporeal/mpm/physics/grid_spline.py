"""Quadratic B-splines between particles and the nodes of a sparse grid of fields.

Node i is at i·dx. A *slot* is one field's value at one node; only slots that a particle
reaches exist, sorted by field, then by node.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array

OFFSETS = np.array(list(np.ndindex(3, 3, 3)))


@dataclass(frozen=True)
class Stencil:
    """Each particle's 27 nodes; P particles, A slots."""

    cell: float
    """dx [m]."""
    slot: Int[np.ndarray, "P 27"]
    """Where the particle's nodes stand in the list of slots."""
    arm: Float[np.ndarray, "P 27 3"]
    """x_i - x_p [m]."""
    spline: Float[np.ndarray, "P 3 3"]
    """N of each of three nodes along each axis; the last index is the axis."""
    slope: Float[np.ndarray, "P 3 3"]
    """dN/dx likewise [1/m]."""
    field: Int[np.ndarray, " A"]
    """Which field each slot belongs to."""
    index: Int[np.ndarray, "A 3"]
    """Node of each slot."""
    key: Int[np.ndarray, " A"]
    """The node as one number."""

    @property
    def count(self) -> int:
        """Number of slots A."""
        return len(self.field)

    @cached_property
    def weight(self) -> Float[np.ndarray, "P 27"]:
        """N_i(x_p)."""
        i, j, k = OFFSETS.T
        return self.spline[:, i, 0] * self.spline[:, j, 1] * self.spline[:, k, 2]

    def gradient(self, particle: Int[np.ndarray, " M"], near: Int[np.ndarray, " M"]) -> Float[np.ndarray, "M 3"]:
        """∇N of some particles' nodes [1/m]."""
        out = np.ones((len(particle), 3))
        for axis, offset in enumerate(OFFSETS[near].T):
            for column in range(3):
                table = self.slope if column == axis else self.spline
                out[:, column] *= table[particle, offset, axis]
        return out

    @cached_property
    def _sum(self) -> csr_array:
        """S: what a particle gets of every slot."""
        return self._matrix(self.weight)

    @cached_property
    def _moments(self) -> tuple[csr_array, ...]:
        """S times each component of x_i - x_p."""
        return tuple(self._matrix(self.weight * self.arm[:, :, d]) for d in range(3))

    def _matrix(self, values: np.ndarray) -> csr_array:
        rows = 27 * np.arange(len(self.slot) + 1)
        shape = (len(self.slot), self.count)
        return csr_array((values.ravel(), self.slot.ravel(), rows), shape=shape)

    def scatter(self, values: np.ndarray) -> np.ndarray:
        """Sum particle values, (P,) or (P, k), into slots: Σ_p N_i a_p."""
        return self._sum.T @ values

    def scatter_moment(self, values: np.ndarray) -> np.ndarray:
        """Sum (P, k, 3) into (A, k): Σ_p N_i B_p (x_i - x_p)."""
        parts = [m.T @ values[:, :, d] for d, m in enumerate(self._moments)]
        return parts[0] + parts[1] + parts[2]

    def gather(self, values: np.ndarray) -> np.ndarray:
        """Interpolate (A, k) at the particles: S v = Σ_i N_i v_i."""
        return self._sum @ values

    def gather_gradient(self, values: np.ndarray) -> np.ndarray:
        """APIC's velocity gradient, 4/dx² Σ_i N_i v_i (x_i - x_p)ᵀ [1/s]."""
        return 4.0 / self.cell**2 * np.stack([m @ values for m in self._moments], axis=2)


def stencil(position: Float[np.ndarray, "P 3"], field: Int[np.ndarray, " P"], cell: float) -> Stencil:
    """Find every particle's nodes and spline values."""
    scaled = position / cell
    base = np.floor(scaled - 0.5).astype(np.int64)
    f = (scaled - base)[:, None, :] - np.arange(3)[None, :, None]
    spline = [0.5 * (1.5 - f[:, 0]) ** 2, 0.75 - f[:, 1] ** 2, 0.5 * (1.5 + f[:, 2]) ** 2]
    slope = [(f[:, 0] - 1.5) / cell, -2.0 * f[:, 1] / cell, (f[:, 2] + 1.5) / cell]
    arm = (base - scaled)[:, None, :] * cell + OFFSETS * cell
    slots, slot = _slots(base, field)
    return Stencil(cell, slot, arm, np.stack(spline, axis=1), np.stack(slope, axis=1), *slots)


def _slots(
    base: Int[np.ndarray, "P 3"], field: Int[np.ndarray, " P"]
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Return the nodes that are reached, field by field, and each particle's 27 among them."""
    low = base.min(axis=0)
    size = base.max(axis=0) - low + 3
    stride = np.array([size[1] * size[2], size[2], 1])
    nodes = int(size.prod())
    corner = field * nodes + (base - low) @ stride
    cells, cell_of_particle = np.unique(corner, return_inverse=True)
    keys, slot_of_cell = np.unique(cells[:, None] + OFFSETS @ stride, return_inverse=True)
    slot = slot_of_cell.reshape(-1, 27)[cell_of_particle]
    node = keys % nodes
    index = np.stack(np.unravel_index(node, tuple(size)), axis=1) + low
    return (keys // nodes, index, node), slot
