"""Volumetric energies λ/2 e(J)², whose pressure may be evaluated at a mean J."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from corporeal.mpm.laws.kinematics import Scalars


@dataclass(frozen=True)
class VolumetricEnergy:
    """One energy of volume, as functions of J alone, over λ."""

    psi: Callable[[Scalars], Scalars]
    """e²/2 [-]."""
    pressure: Callable[[Scalars], Scalars]
    """Its slope in ln J: the Kirchhoff pressure [-]."""
    modulus: Callable[[Scalars], Scalars]
    """Bound on the slope of that in ln J, for J and all smaller volumes [-]."""


def _log(J: Scalars) -> Scalars:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(J)


def _stretched(J: Scalars) -> Scalars:
    most = np.maximum(J, 1.0)
    return most * (2.0 * most - 1.0)


QUADRATIC_VOLUMETRIC = VolumetricEnergy(
    psi=lambda J: 0.5 * (J - 1.0) ** 2,
    pressure=lambda J: J * (J - 1.0),
    modulus=_stretched,
)
"""e = J - 1."""
LOGARITHMIC_VOLUMETRIC = VolumetricEnergy(
    psi=lambda J: 0.5 * _log(J) ** 2, pressure=_log, modulus=np.ones_like
)
"""e = ln J."""
