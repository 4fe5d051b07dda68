"""Cube lattices in a random frame, and columns made ambiguous by holes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from corporeal.geometry.mesh_queries import QueryMesh, random_rotation

MAX_SLAB_CUBES = 4_000_000
"""Cubes that are looked at together."""
MAX_UNCLEAR_COLUMNS_FRACTION = 0.1
"""Share of the columns up to which those near a hole are asked point by point: all take 0.3 µs a
point, and blocks ask about a tenth of them."""


@dataclass(frozen=True)
class CubeLattice:
    """Cubes in a turned frame."""

    frame: np.ndarray
    """Its axes, as columns."""
    centre: np.ndarray
    """World position of its origin [m]."""
    low: np.ndarray
    """Corner of the first cube, in the frame [m]."""
    counts: np.ndarray
    spacing: float

    def world(self, inner: np.ndarray) -> np.ndarray:
        """World position of points that are given in cubes from the first corner."""
        # A product of so narrow matrices takes BLAS ten times as long.
        turned = np.einsum("...i,ji->...j", self.low + inner * self.spacing, self.frame)
        return turned + self.centre

    def inner(self, points: np.ndarray) -> np.ndarray:
        """Take points of the world [m] into cubes from the first corner."""
        return ((points - self.centre) @ self.frame - self.low) / self.spacing

    def slabs(self) -> "Iterator[CubeLattice]":
        """Cut it along its first axis into lattices of at most SLAB cubes or of four layers."""
        thick = max(4, MAX_SLAB_CUBES // int(self.counts[1] * self.counts[2]) // 4 * 4)
        for first in range(0, self.counts[0], thick):
            low = self.low + np.array([first * self.spacing, 0, 0])
            counts = np.array([min(thick, self.counts[0] - first), *self.counts[1:]])
            yield replace(self, low=low, counts=counts)


@dataclass(frozen=True)
class HoleShadow:
    """Where columns may pass so near open edges that crossings do not settle what is inside.

    A box across the columns, in the lattice's frame; empty where no edge is open.
    """

    low: Float[np.ndarray, " 2"]
    """[m]"""
    high: Float[np.ndarray, " 2"]
    """[m]"""

    def over(
        self, columns: Float[np.ndarray, "C 2"], lattice: CubeLattice
    ) -> Bool[np.ndarray, " C"]:
        """Whether each column, in cubes, stands in the shadow."""
        place = lattice.low[:2] + columns * lattice.spacing
        return np.logical_and.reduce((place > self.low) & (place < self.high), axis=1)


NO_HOLE_SHADOW = HoleShadow(np.full(2, np.inf), np.full(2, -np.inf))
"""Of a mesh without open edges."""


def hole_shadow_of(shape: QueryMesh, lattice: CubeLattice) -> HoleShadow | None:
    """Find where columns must be asked point by point; None: in too many places.

    A cap from the middle of all open edges to each closes the mesh. Wherever a column crosses mesh
    and cap as often one way as the other, the winding number differs from the count of crossings
    below by the solid angle of the cap over 4π. That is below a half, so changes nothing, farther
    from the cap than the root of its area over 2π.
    """
    rim, excess = shape.open_edges
    if shape.closed or not len(rim):
        return NO_HOLE_SHADOW
    ends = shape.mesh.vertices[rim]
    a, b = np.swapaxes(ends - ends.reshape(-1, 3).mean(axis=0), 0, 1)
    area = 0.5 * float(np.abs(excess) @ np.linalg.norm(np.cross(a, b), axis=1))
    flat = ((ends - lattice.centre) @ lattice.frame)[..., :2].reshape(-1, 2)
    reach = np.sqrt(area / (2 * np.pi)) + lattice.spacing
    hole = HoleShadow(flat.min(axis=0) - reach, flat.max(axis=0) + reach)
    shadow = np.prod(hole.high - hole.low)
    whole = np.prod(lattice.counts[:2]) * lattice.spacing**2
    return hole if shadow <= MAX_UNCLEAR_COLUMNS_FRACTION * whole else None


def cube_lattice_of(shape: QueryMesh, spacing: float, rng: np.random.Generator) -> CubeLattice:
    """Lay cubes of ``spacing`` [m] in a random frame around a shape."""
    used = shape.mesh.vertices[np.unique(shape.mesh.triangles)]
    frame, centre = random_rotation(rng), used.mean(axis=0)
    turned = (used - centre) @ frame
    # A random shift, so that a thin plate is not hit or missed as a whole.
    low = turned.min(axis=0) - rng.uniform(0, 1, 3) * spacing
    counts = np.ceil((turned.max(axis=0) - low) / spacing).astype(int) + 1
    return CubeLattice(frame, centre, low, counts, spacing)
