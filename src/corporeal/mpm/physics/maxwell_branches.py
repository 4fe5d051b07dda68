"""Viscoelasticity: two Maxwell branches in parallel with the elastic law.

A branch is a spring that forgets. Its strain is a conformation tensor less the identity,
E = b - 1 (an Oldroyd-B branch: Ram et al. 2015, "A material point method for viscoelastic fluids,
foams and sponges"), carried along by the flow and forgotten at the rate 1/T. Two branches a decade
apart give a loss factor that hardly depends on the frequency, as of most soft solids. What the
material resists slowly is the elastic law alone: loss over a band of frequencies stiffens
(causality), and an impact finds more than that.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from corporeal.mpm.constants import (
    BRANCHES,
    LOCAL_BULK_RATIO,
    LOSS_BAND_HIGH_RATIO,
    LOSS_BAND_LOW_RATIO,
    MIN_LOSS_FACTOR,
)


@dataclass(frozen=True)
class MaxwellBranches:
    """Two branches of M materials; where a material has none, strengths are 0 and times 1."""

    shear: Float[np.ndarray, "M 2"]
    """G [Pa]"""
    bulk: Float[np.ndarray, "M 2"]
    """K [Pa]"""
    time: Float[np.ndarray, "M 2"]
    """T [s]"""


@dataclass(frozen=True)
class BranchMemory:
    """What the branches of P particles remember."""

    strain: Float[np.ndarray, "P 2 3 3"]
    """E = b - 1, symmetric [-]."""
    volume: Float[np.ndarray, "P 2"]
    """θ, the logarithm of the branch's own J [-]."""


@dataclass(frozen=True)
class BranchFit:
    """Strengths and times of the two branches for one loss factor."""

    strength: tuple[float, float]
    """Over the relaxed modulus [-]."""
    time: tuple[float, float]
    """T ω₀ [-], with ω₀ of the slowest vibration at the modulus in the middle of the band."""
    stiffening: float
    """Modulus in the middle of the band over the relaxed one [-]."""


@lru_cache(maxsize=256)
def fit_branches(loss: float) -> BranchFit:
    """Fit two branches to a loss factor that is the same all over the band.

    Least squares on loss(ω)/loss - 1 at sixty frequencies, evenly spaced in their logarithm; within 3 % of it.

    Args:
        loss: tan δ [-], from 0.02 to 2.
    """
    low, high = LOSS_BAND_LOW_RATIO, LOSS_BAND_HIGH_RATIO
    frequency = np.geomspace(low, high, 60)
    reach = (high / low) ** (1.0 / BRANCHES)
    times = np.log(1.0 / (low * reach ** (np.arange(BRANCHES) + 0.5)))

    def miss(x: np.ndarray) -> np.ndarray:
        modulus = complex_modulus(np.exp(x[BRANCHES:]), np.exp(x[:BRANCHES]), frequency)
        return np.imag(modulus) / np.real(modulus) / loss - 1.0

    start = np.concatenate([times, np.full(BRANCHES, np.log(2.0 * loss))])
    found = least_squares(miss, start, max_nfev=400).x
    slow, fast = sorted(zip(np.exp(found[:BRANCHES]), np.exp(found[BRANCHES:]), strict=True))[::-1]
    strength, time = (slow[1], fast[1]), (slow[0], fast[0])
    middle = np.array([np.sqrt(low * high)])
    stiffening = np.real(complex_modulus(np.array(strength), np.array(time), middle)[0])
    return BranchFit(strength, time, float(stiffening))


def relaxing_bulk(mu: Float[np.ndarray, " *N"], lam: Float[np.ndarray, " *N"]) -> Float[np.ndarray, " *N"]:
    """Bulk modulus [Pa] of which the branches have their share.

    All of it up to ν = 0.4. What λ exceeds 4 μ by hardly strains, and stores and loses nothing.

    Args:
        mu: μ [Pa].
        lam: λ [Pa].
    """
    return np.minimum(lam, LOCAL_BULK_RATIO * mu) + 2 / 3 * mu


def stiffening(loss: float, poisson: float) -> float:
    """P-wave modulus of what is resisted at once over that of what is resisted slowly [-].

    1 + (g₁ + g₂) (K_r + 4/3 μ)/(λ + 2 μ), with the ``relaxing_bulk`` K_r; its root is the ratio of wave speeds, and so
    of steps.

    Args:
        loss: tan δ [-].
        poisson: ν [-], below 1/2.
    """
    if loss < MIN_LOSS_FACTOR:
        return 1.0
    lam = 2.0 * poisson / (1.0 - 2.0 * poisson)
    relaxing = float(relaxing_bulk(np.array(1.0), np.array(lam))) + 4 / 3
    return 1.0 + sum(fit_branches(loss).strength) * relaxing / (lam + 2.0)


def complex_modulus(
    strength: Float[np.ndarray, " K"], time: Float[np.ndarray, " K"], frequency: Float[np.ndarray, " N"]
) -> np.ndarray:
    """G*(ω)/G(0) = 1 + Σ g iωT/(1 + iωT).

    Args:
        strength: g, over the relaxed modulus [-].
        time: T [s].
        frequency: ω [rad/s].
    """
    x = 1j * frequency[:, None] * time
    return 1.0 + (x / (1.0 + x)) @ strength


def branch_decay(dt: float, time: Float[np.ndarray, " *N"]) -> tuple[np.ndarray, np.ndarray]:
    """Return what is left of old strain, and of strain made evenly during the step [-].

    Exact for a constant rate of strain. With T far below dt the second is T/dt: the branch is then a viscosity G T,
    without the time step that an explicit viscosity asks for.
    """
    old = np.exp(-dt / time)
    return old, -np.expm1(-dt / time) * time / dt


def advance_branches(
    memory: BranchMemory, increment: Float[np.ndarray, "P 3 3"], time: Float[np.ndarray, "P 2"], dt: float
) -> BranchMemory:
    """Carry the branches' strain along for one step, and forget.

    E ← q (E + A E + E Aᵀ + A E Aᵀ) + r (A + Aᵀ + A Aᵀ) with A = dt ∇v less a third of its trace;
    θ ← q θ + r dt tr ∇v. Never 1 + A: small strains keep their digits in float32.

    Args:
        memory: Before.
        increment: dt ∇v [-].
        time: T [s].
        dt: The step [s].
    """
    trace = np.trace(increment, axis1=1, axis2=2)
    A = (increment - trace[:, None, None] / 3.0 * np.eye(3))[:, None]
    At, E = A.swapaxes(2, 3), memory.strain
    old, new = branch_decay(dt, time)
    carried = E + A @ E + E @ At + A @ E @ At
    strain = old[..., None, None] * carried + new[..., None, None] * (A + At + A @ At)
    return BranchMemory(strain, old * memory.volume + new * trace[:, None])


def maxwell_stress(branches: MaxwellBranches, memory: BranchMemory) -> Float[np.ndarray, "P 3 3"]:
    """Kirchhoff stress Σ G dev E + K θ 1 [Pa] of particles, their materials row by row."""
    E = memory.strain
    deviator = E - np.trace(E, axis1=2, axis2=3)[..., None, None] / 3.0 * np.eye(3)
    pressure = np.sum(branches.bulk * memory.volume, axis=1)
    shear = np.sum(branches.shear[..., None, None] * deviator, axis=1)
    return shear + pressure[:, None, None] * np.eye(3)


def branch_free_energy(branches: MaxwellBranches, memory: BranchMemory) -> Float[np.ndarray, " P"]:
    """Energy that the branches hold per rest volume [J/m³]: G/2 (tr E - ln det(1 + E)) + K/2 θ²."""
    E = memory.strain
    invariants = np.stack(
        [
            np.trace(E, axis1=2, axis2=3),
            0.5 * (np.trace(E, axis1=2, axis2=3) ** 2 - np.sum(E * E.swapaxes(2, 3), axis=(2, 3))),
            np.linalg.det(E),
        ]
    )
    shear = 0.5 * branches.shear * (invariants[0] - np.log1p(invariants.sum(axis=0)))
    return np.sum(shear + 0.5 * branches.bulk * memory.volume**2, axis=1)
