"""Pressure of nearly incompressible matter from the mean swelling around each particle.

Taken from every particle's own J it would lock: eight constraints in a cell that has three nodes'
worth of freedom make a block of ν = 0.49 up to a sixth too stiff (decision 7).
"""

import numpy as np
from jaxtyping import Float

from corporeal.mpm.elasticity import Matrices, determinant
from corporeal.mpm.matter import Matter
from corporeal.mpm.stencil import Stencil


def relief(matter: Matter, F: Matrices, grid: Stencil) -> Float[np.ndarray, " P"]:
    """Mean swelling J around each particle, less its own; 0 where matter may be squeezed.

    J̄ = S (Sᵀ m J / Sᵀ m): F-bar (de Souza Neto et al. 1996) over the nodes' splines instead of an
    element. It acts a step later, which damps what the grid cannot see.
    """
    swells = matter.swells
    if not swells.any():
        return np.zeros(len(F))
    swelling = determinant(F) - 1.0
    mass = np.where(swells, matter.mass, 0.0)
    mean = grid.scatter(mass * swelling) / np.maximum(grid.scatter(mass), 1e-300)
    return np.where(swells, grid.gather(mean[:, None])[:, 0] - swelling, 0.0)
