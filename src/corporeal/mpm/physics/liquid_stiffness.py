"""Artificial bulk modulus of liquids, chosen by their speed.

A liquid's own sound (1480 m/s in water) would make steps a hundred times shorter than its motion needs. With K = ρ c₀²
and c₀ ten times its largest speed its density changes by one per cent (weak compressibility: Monaghan 1994, "Simulating
free surface flows with SPH"). The shear modulus is the spring that a Maxwell branch needs within a step; what is
transmitted slowly is the viscosity alone.
"""

from math import sqrt

from corporeal.mpm.constants import LIQUID_SHEAR_TO_BULK_RATIO, SOUND_TO_FLOW_SPEED_RATIO


def bulk_modulus(density: float, speed: float) -> float:
    """K = ρ (10 v)² [Pa].

    Args:
        density: ρ [kg/m³].
        speed: Largest speed that is expected [m/s].
    """
    return density * (SOUND_TO_FLOW_SPEED_RATIO * speed) ** 2


def fall_speed(gravity: float, height: float) -> float:
    """√(2 g H) [m/s]: of what falls from all the way up."""
    return sqrt(2.0 * gravity * height)


def elastic_moduli(bulk: float) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio [-] of a bulk modulus K [Pa] and G = K/8.

    E = 9 K G/(3 K + G),  ν = (3 K - 2 G)/2 (3 K + G)
    """
    shear = LIQUID_SHEAR_TO_BULK_RATIO * bulk
    young_pa = 9.0 * bulk * shear / (3.0 * bulk + shear)
    return young_pa, (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
