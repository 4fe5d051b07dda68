"""Wind pressure on the surface of a body.

Air presses on the faces turned towards it, along their normals. With u the velocity of the
air seen from the face and θ the angle between u and the face's inward normal,

    p = ½ ρ_air C |u|² cos³θ   where cos θ > 0, nothing in the lee.

C = 1.17 is a square plate or disc facing the wind, and the third power is the one with which the pressure on a sphere's
front adds up to its drag: C_d = 2 C/5 = .468 (Hoerner 1965, Fluid-Dynamic Drag, ch. 3: plate 1.17, sphere .47 below the
drag crisis). The same rule gives a cylinder across the wind 3π C/16 = .69 (short ones .63–.74 there), a cube face on
1.17 (1.05 there) and leaves in all directions C/5 = .23 per area of one side (canopy models take .2: Katul et al. 2004,
Boundary-Layer Meteorology 113). Skin friction, lift of wings and the shelter that one part of an object gives another
are left out.
"""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Wind
from corporeal.mpm.constants import AIR_DENSITY, GUST_SINES, MIN_GUST_FREQUENCY_HZ, PLATE_DRAG_COEFFICIENT, TINY

HALF_RHO_C = 0.5 * AIR_DENSITY * PLATE_DRAG_COEFFICIENT
"""½ ρ C: what the square of a wind's speed presses with on a plate that faces it [kg/m³]."""

_OCTAVES = np.arange(GUST_SINES)
GUST_FREQUENCY = MIN_GUST_FREQUENCY_HZ * 2.0 ** (_OCTAVES / 2.0)
"""From a quarter of a hertz to 2.8 Hz [Hz]."""
_SHARE = GUST_FREQUENCY ** (-1.0 / 3.0)
GUST_SHARE = _SHARE / _SHARE.sum()
"""Amplitudes of Kolmogorov's spectrum S ~ f^(-5/3) on frequencies half an octave apart."""
GUST_PHASE = 2.0 * np.pi * np.modf(_OCTAVES * (np.sqrt(5.0) - 1.0) / 2.0)[0]
"""Fixed, so that every run has the same gusts [rad]."""


def gust_signal(time: float) -> float:
    """Smooth signal between -1 and 1: Σ a_k sin(2π f_k t + φ_k)."""
    return float(GUST_SHARE @ np.sin(2.0 * np.pi * GUST_FREQUENCY * time + GUST_PHASE))


def air_velocity(wind: Wind, time: float) -> Float[np.ndarray, "3"] | None:
    """Velocity of the air [m/s]; None: outside the time window no air is there."""
    if not wind.start <= time < wind.end:
        return None
    return np.array(wind.velocity, np.float64) * (1.0 + wind.gust * gust_signal(time))


def wind_impulses(
    area: Float[np.ndarray, "A 3"], seen: Float[np.ndarray, "A 3"], mass: Float[np.ndarray, " A"], dt: float
) -> Float[np.ndarray, "A 3"]:
    """Impulses of the air on faces in one step [N s].

    Args:
        area: Outward area vectors now [m²].
        seen: Velocity of the air relative to each face [m/s].
        mass: What each face moves [kg]: a face never becomes faster than the air.
        dt: [s]
    """
    size = np.maximum(np.linalg.norm(area, axis=1), TINY)
    normal = area / size[:, None]
    against = np.maximum(-np.sum(seen * normal, axis=1), 0.0)
    speed = np.maximum(np.linalg.norm(seen, axis=1), TINY)
    force = HALF_RHO_C * size * against**3 / speed
    rate = force / (mass * np.maximum(against, TINY))
    return -normal * (force * dt / (1.0 + rate * dt))[:, None]


def largest_wind_acceleration(wind: Wind, area: float, mass: float) -> float:
    """Largest acceleration of a body at rest whose largest cross-section is ``area`` [m/s²]."""
    speed = float(np.linalg.norm(wind.velocity)) * (1.0 + wind.gust)
    return HALF_RHO_C * area * speed**2 / mass
