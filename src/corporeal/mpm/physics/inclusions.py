"""Rigid inclusions: stiff parts that move with the soft material around them.

The frame keeps its six degrees of freedom and scatters mass only. Nodes of the soft field inside it
are its own: before contact, frame and lumped nodes become one rigid body with their momentum and
angular momentum; contact acts on that; afterwards the nodes get the velocity of its motion.
Sharing momentum through mass alone would let the bond creep.
"""

import numpy as np
from jaxtyping import Int
from scipy.spatial import KDTree

from corporeal.mpm.constants import FRAME_LAYER_DX, FRAME_REACH_DX, PARTICLES_PER_CELL
from corporeal.mpm.problem import Body


def inclusion_and_soft_density(frame: Body, soft: Body, cell: float) -> tuple[float, float]:
    """Mean densities [kg/m³] of a frame and of the soft material around it; masses give volumes.

    On the grid a frame's wall is no thinner than the layer of particles that it is made of: as thin as in reality it
    would hold nothing.
    """
    far = KDTree(frame.position).query(soft.position, distance_upper_bound=FRAME_LAYER_DX * cell)[0]
    near = np.isfinite(far)
    near = near if near.any() else np.ones(len(near), bool)
    held = float(soft.volume[near] @ soft.density[near] / soft.volume[near].sum())
    layer = len(frame.volume) * cell**3 / PARTICLES_PER_CELL
    return float(frame.volume @ frame.density) / max(float(frame.volume.sum()), layer), held


def inclusion_particles_near(frame: Body, soft: Body, cell: float) -> Int[np.ndarray, " K"]:
    """Particles of a frame that what it holds could ever meet; those far inside don't matter."""
    far = KDTree(soft.position).query(frame.position, distance_upper_bound=FRAME_REACH_DX * cell)[0]
    return np.flatnonzero(np.isfinite(far))
