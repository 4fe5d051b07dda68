"""Wall shear stress of a sticking liquid in a viscous layer.

A node sees the wall through its spline. The layer between the wall and what the node stands for is
``WALL_LAYER_DX`` cells thick, whatever the place of the wall between nodes; its stress follows the
liquid's own flow curve, τ = τ_y + K (u/d)ⁿ (Herschel and Bulkley), and acts on the area of the wall
that is the node's. So a wall takes as much momentum as the liquid's stress carries to it, and
nothing more where steps are short: nodes that are held would take what transfers bring to them
in every step (decision liquids-walls-and-vessels).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numba import njit

from corporeal.mpm import laws
from corporeal.mpm.constants import LIQUID_TOUCH_DX, LIQUID_WALL_REACH_DX, MIN_HALF_SPACE_WEIGHT, TINY, WALL_LAYER_DX
from corporeal.mpm.laws.fluid import SLIP_NEWTON_ITERATIONS
from corporeal.mpm.physics.contact import Scalars, Vectors, gap_to_plane, half_space_weight
from corporeal.mpm.problem import Body


class FlowCurve(NamedTuple):
    """How a liquid flows at a wall: τ(u) = τ_y + K/dⁿ uⁿ, with d the layer's thickness."""

    yield_shear: float
    """τ_y [Pa]"""
    drag: float
    """K/dⁿ [Pa (s/m)ⁿ]"""
    exponent: float
    """n [-]"""


def flow_curve(body: Body, cell: float) -> FlowCurve:
    """Return the flow curve of a body's liquid, of several the most viscous; zeros of what is none.

    Args:
        body: The liquid.
        cell: dx [m].
    """
    pours = np.flatnonzero(np.isin(body.law, laws.LIQUID_LAWS))
    if body.rigid or len(pours) == 0:
        return FlowCurve(0.0, 0.0, 1.0)
    consistency = np.zeros(len(body.law)) if body.consistency is None else body.consistency
    most = pours[np.argmax(consistency[pours])]
    index = 1.0 if body.flow_index is None else float(body.flow_index[most])
    drag = float(consistency[most]) / (WALL_LAYER_DX * cell) ** index
    return FlowCurve(float(body.yield_stress[most]) / np.sqrt(3.0), drag, index)


def drag_span(mass: Scalars, full: float, height: Scalars, cell: float, dt: float) -> Scalars:
    """Area of the wall that drags on each node, times the step [m² s].

    dx² dt N(h)/W(h) m/(ρ dx³): N, the spline's weight on the wall, adds up to 1 over the nodes of a column; m over the
    mass that the half space above the wall has at the node, ρ dx³ W, is how far the liquid covers the wall there.

    Args:
        mass: Of the nodes [kg].
        full: ρ dx³, mass of a full cell [kg].
        height: Of the nodes over the wall [m].
        cell: dx [m].
        dt: [s]
    """
    h = height / cell
    away = np.abs(h)
    on = np.where(away < 0.5, 0.75 - h**2, 0.5 * np.maximum(1.5 - away, 0.0) ** 2)
    share = on / np.maximum(half_space_weight(h), MIN_HALF_SPACE_WEIGHT)
    return mass / full * share * cell**2 * dt


def touches_wall(mean: Vectors, height: Scalars, normal: Vectors, cell: float) -> np.ndarray:
    """Whether a liquid touches a wall, as far as each node can tell by its mean place [m]."""
    near = gap_to_plane(mean, height, normal, cell) < LIQUID_TOUCH_DX * cell
    return near & (height <= LIQUID_WALL_REACH_DX * cell)


@njit(cache=True)
def wall_slip(free: float, softness: float, layer: Float[np.ndarray, " 4"]) -> float:
    """Slip u [m/s] that a wall leaves of one of ``free``: u + s (τ_y + K/dⁿ uⁿ) = free.

    Newton's steps from below, as in ``laws.fluid.slip_of``; any softness s, and so any viscosity and any step, leaves a
    slip between 0 and ``free``.

    Args:
        free: Without the wall's drag [m/s].
        softness: 1/m_eff [1/kg].
        layer: Span [m² s], then the flow curve.
    """
    s = softness * layer[0]
    excess, drag, index = free - s * layer[1], s * layer[2], layer[3]
    if excess <= 0.0:
        return 0.0
    if index == 1.0 or drag == 0.0:
        return excess / (1.0 + drag)
    u = max(min(0.5 * excess, (0.5 * excess / drag) ** (1.0 / index)), TINY)
    for _ in range(SLIP_NEWTON_ITERATIONS):
        power = drag * u**index
        u = max(u - (u + power - excess) / (1.0 + index * power / u), TINY)
    return u


@njit(cache=True)
def drag_impulse(
    stopping: Float[np.ndarray, " 3"], softness: float, layer: Float[np.ndarray, " 4"]
) -> Float[np.ndarray, " 3"]:
    """Tangential impulse of a wall [N s], from the one that would end the slip."""
    free = softness * np.sqrt(np.dot(stopping, stopping))
    return stopping * (1.0 - wall_slip(free, softness, layer) / free) if free > 0.0 else stopping
