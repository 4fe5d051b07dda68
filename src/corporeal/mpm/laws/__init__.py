"""Constitutive laws, one per file, and their dispatch.

A law is defined in the file that has its name in ``types.Law``, in lower case, under the name ``LAW``. The functions
below answer for particles of different laws at once.
"""

from importlib import import_module

import numpy as np
from jaxtyping import Bool, Int

from corporeal.core.types import Law
from corporeal.mpm.constants import BULK_ROUNDING_FRACTION, LOCAL_BULK_RATIO
from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw, ReturnMapResult, YieldParameters
from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors, stretches


def _load_law(law: Law) -> ConstitutiveLaw:
    name = law.name.lower()
    try:
        return import_module(f"{__name__}.{name}").LAW
    except ModuleNotFoundError as error:
        raise ImportError(
            f"types.Law has {law.name}, but there is no mpm/laws/{name}.py. Write the law there: "
            "docs/how-to/add-a-law-material-provider-or-format.md says how."
        ) from error


CONSTITUTIVE_LAWS: dict[Law, ConstitutiveLaw] = {law: _load_law(law) for law in Law}
PLASTIC_LAWS = tuple(law.value for law in Law if CONSTITUTIVE_LAWS[law].flows)
"""Numbers of laws with a return map: shape is then not only elastic deformation."""
GRANULAR_LAWS = tuple(law.value for law in Law if CONSTITUTIVE_LAWS[law].granular)
"""Numbers of laws of grains."""
LIQUID_LAWS = tuple(law.value for law in Law if CONSTITUTIVE_LAWS[law].liquid)
"""Numbers of laws of what takes any shape."""
_VOLUMETRIC_LAWS = tuple(law.value for law in Law if CONSTITUTIVE_LAWS[law].volumetric)

LawNumbers = Int[np.ndarray, " P"]
"""``types.Law`` values."""


def psi(law: LawNumbers, F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Return the stored energy per rest volume Ψ [J/m³] of particles with different laws."""
    out = np.empty(len(F))
    for rule, k in _by_law(law):
        out[k] = rule.psi(F[k], mu[k], lam[k])
    return out


def tau(law: LawNumbers, F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """Return the Kirchhoff stress τ [Pa] of particles with different laws."""
    out = np.empty_like(F)
    for rule, k in _by_law(law):
        out[k] = rule.tau(F[k], mu[k], lam[k])
    return out


def principal_tau(law: LawNumbers, F: Matrices, mu: Scalars, lam: Scalars) -> Vectors:
    """Return the principal Kirchhoff stresses of ``tau`` [Pa], in no order, far faster."""
    out = np.empty(F.shape[:2])
    for rule, k in _by_law(law):
        if rule.principal_tau is None:
            out[k] = np.linalg.eigvalsh(rule.tau(F[k], mu[k], lam[k]))
        else:
            out[k] = rule.principal_tau(stretches(F[k]), mu[k], lam[k])
    return out


def wave_modulus(law: LawNumbers, F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Bound ρ₀ c² [Pa] of the waves in particles with different laws."""
    out = np.empty(len(F))
    for rule, k in _by_law(law):
        out[k] = rule.wave_modulus(F[k], mu[k], lam[k])
    return out


def flow(law: LawNumbers, F: Matrices, numbers: YieldParameters, plastic: Scalars, volume: Scalars) -> ReturnMapResult:
    """Bring granular and plastic material back to what it can bear.

    Args:
        law: ``types.Law`` values.
        F: Trial elastic deformation gradients.
        numbers: Of the materials.
        plastic: Equivalent plastic strain so far.
        volume: Volume correction so far.
    """
    out = ReturnMapResult(F.copy(), np.zeros(len(F)), volume.copy(), np.zeros(len(F)))
    for rule, k in _by_law(law):
        if rule.flow is not None:
            here = rule.flow(F[k], numbers.of(k), plastic[k], volume[k])
            for whole, part in zip(out, here, strict=True):
                whole[k] = part
    return out


def is_stiff_in_bulk(law: LawNumbers, mu: Scalars, lam: Scalars) -> Bool[np.ndarray, " P"]:
    """Whether material is elastic and its ν above 0.4: splines lock unless pressure is a mean.

    Where ν is 0.4 to within rounding it is not above.
    """
    return np.isin(law, _VOLUMETRIC_LAWS) & (lam > LOCAL_BULK_RATIO * (1.0 + BULK_ROUNDING_FRACTION) * mu)


def mean_pressure(law: LawNumbers, J: Scalars, bulk: Scalars) -> Scalars:
    """Kirchhoff pressure [Pa] of a mean volume J̄; bulk: the part of λ that acts on it [Pa]."""
    return bulk * _volumetric_by_law("pressure", law, J)


def psi_mean(law: LawNumbers, J: Scalars, bulk: Scalars) -> Scalars:
    """Return the stored energy [J/m³] of a mean volume J̄: ``mean_pressure`` is its slope."""
    return bulk * _volumetric_by_law("psi", law, J)


def mean_modulus(law: LawNumbers, J: Scalars, bulk: Scalars) -> Scalars:
    """Return what a mean volume J̄ adds to the bound on ρ₀ c² [Pa]."""
    return bulk * _volumetric_by_law("modulus", law, J)


def _volumetric_by_law(measure: str, law: LawNumbers, J: Scalars) -> Scalars:
    out = np.zeros(len(J))
    for rule, k in _by_law(law):
        if rule.volumetric is not None:
            out[k] = getattr(rule.volumetric, measure)(J[k])
    return out


def _by_law(law: LawNumbers) -> list[tuple[ConstitutiveLaw, np.ndarray]]:
    """List the laws that occur, each with the particles that follow it."""
    return [(CONSTITUTIVE_LAWS[Law(value)], np.flatnonzero(law == value)) for value in np.unique(law).tolist()]
