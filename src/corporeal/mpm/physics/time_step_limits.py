"""Wave speeds, stable time steps, and the step budget."""

from collections.abc import Sequence
from math import inf, log, pi, sqrt

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.constants import (
    BASELINE_COURANT,
    BASELINE_STEP_S,
    COURANT,
    FLIP_DAMPING_FRACTION,
    GRANULAR_DAMPING_FRACTION,
    MAX_POISSON_RATIO,
)


def p_wave_speed(young_pa: float, poisson: float, density: float) -> float:
    """Longitudinal wave speed c_p [m/s] of an isotropic solid.

    c_p = sqrt( E (1 - ν) / (ρ (1 + ν) (1 - 2ν)) )

    It grows without bound as ν → 1/2. Source: Landau & Lifshitz, Theory of Elasticity, §22.

    Args:
        young_pa: Young's modulus E [Pa].
        poisson: Poisson's ratio ν [-], below 1/2.
        density: Mass density ρ [kg/m³].
    """
    return sqrt(young_pa * (1 - poisson) / (density * (1 + poisson) * (1 - 2 * poisson)))


def shell_wave_speeds(young_pa: float, poisson: float, density: float, cells: float) -> tuple[float, float]:
    """Speeds that limit the step of a shell [m/s]: of waves in its plane, and of bending on the grid.

    c = √(E/(ρ (1 - ν²))); bending with the wave number π/dx, ω = (π/dx)² √(D/(ρ t)), limits a step as waves of
    ω dx/2 = π² t c/(4 √3 dx) do.

    Args:
        young_pa: E [Pa].
        poisson: ν [-].
        density: ρ [kg/m³].
        cells: Thickness over the grid spacing, t/dx [-].
    """
    plane = sqrt(young_pa / (density * (1 - poisson**2)))
    return plane, pi**2 * cells / (4 * sqrt(3)) * plane


def young_from_speed(speed: float, poisson: float, density: float) -> float:
    """Young's modulus [Pa] of the solid whose c_p is ``speed`` [m/s]: ``p_wave_speed`` inverted."""
    return density * speed**2 * (1 + poisson) * (1 - 2 * poisson) / (1 - poisson)


def bounded_poisson(young_pa: float, poisson: float) -> tuple[float, float]:
    """Cap the bulk modulus and keep the shear modulus: (E, ν) with ν ≤ 0.49 and the same μ.

    μ = E / 2(1 + ν). Above ν = 0.49 steps shrink and quadratic splines lock, while μ, which
    carries the shape, no longer changes.
    """
    bounded = min(poisson, MAX_POISSON_RATIO)
    return young_pa * (1 + bounded) / (1 + poisson), bounded


def stable_step(wave: float, motion: float, cell: float, courant: float = COURANT) -> float:
    """Largest stable time step [s]: dt = s dx / (c_p + |v|) (Courant, Friedrichs, Lewy).

    Args:
        wave: Wave speed c_p [m/s].
        motion: Largest particle speed |v| [m/s].
        cell: Grid spacing dx [m].
        courant: s [-].
    """
    speed = wave + motion
    return courant * cell / speed if speed > 0 else inf


def flip_damping_rate(
    wave: Float[np.ndarray, " P"], granular: Bool[np.ndarray, " P"], pull: float, cell: float
) -> Float[np.ndarray, " P"]:
    """Rate at which material forgets the velocities that its grid cannot see [1/s].

    κ c/dx: what rings, rings away within some passages of its waves. What flows like sand does not ring, and the
    stiffness of a grain must not tell how far a heap runs out: ½ √(g/dx) for it (decision laws-sand).

    Args:
        wave: Wave speed c [m/s].
        granular: Which of it is granular.
        pull: Strength g of gravity [m/s²]; without any, all forget alike.
        cell: dx [m].
    """
    rings = FLIP_DAMPING_FRACTION * wave / cell
    settles = GRANULAR_DAMPING_FRACTION * sqrt(pull / cell) if pull > 0 else inf
    return np.where(granular, np.minimum(rings, settles), rings)


def yield_speed(yield_stress: float | None, wave: float, density: float) -> float:
    """Impact speed v_y = σ_y / (ρ c_p) [m/s] at which a plane impact on a rigid wall yields.

    From σ = ρ c v behind an elastic front (Kolsky, Stress Waves in Solids, ch. 2).
    """
    return inf if yield_stress is None else yield_stress / (density * wave)


def thin_wall_factors(ratio: float) -> tuple[float, float, float]:
    """Factors on (E, σ_y, ρ) for a wall simulated thicker than it is.

    With r = t / t_num: E r³ keeps the bending stiffness E t³/12(1 - ν²), σ_y r² the moment of the plastic hinge σ_y
    t²/4, ρ r the areal mass ρ t.
    """
    return ratio**3, ratio**2, ratio


def limp_wall_factors(ratio: float) -> tuple[float, float, float]:
    """Factors on (E, σ_y, ρ) for a thickened wall that hangs down as cloth does.

    How it bends is not seen, but it must not be pulled to pieces: E r and σ_y r keep what it resists in its plane, per
    width.
    """
    return ratio, ratio, ratio


def closed_wall_factors(ratio: float) -> tuple[float, float, float]:
    """Factors on (E, σ_y, ρ) for a thickened wall that goes all around and does not flow.

    A closed convex surface cannot bend without stretching (Cohn-Vossen's theorem), so what an impact feels is the
    indentation stiffness k = 4 E t² / (R √(3(1 - ν²))) of a spherical shell (Reissner 1946): E r² keeps it. E r³ would
    make a rubber duck t_num/t times too soft.
    """
    return ratio**2, ratio**2, ratio


def fold_stiffness_factor(thickness: float, simulated: float, radius: float) -> float:
    """Factor on E r³ that lets a fold in a thickened wall yield at the same angle as in reality.

    A wall of thickness t and radius of curvature R folds over √(R t) (the boundary layer of thin
    shells: Pogorelov, Bendings of Surfaces and Stability of Shells, 1988), on the grid over t_num. A fold's moment per
    angle E t³/12 over its width is kept by E r³ t_num/√(R t). Without it a coarse can would have to fold by a right
    angle before it yields, and would spring back.
    """
    if simulated <= thickness:
        return 1.0
    # No fold is tighter than the wall is thick.
    return max(1.0, simulated / sqrt(max(radius, thickness) * thickness))


def fit_young_compression(parts: Sequence[tuple[float, float]], limit: float) -> tuple[float, float]:
    """Knee K [Pa] and power q of the compression that keeps every wave below ``limit`` [m/s].

    E ↦ K (E/K)^q above K, E below. The knee lies at half the limit's wave speed in the part that exceeds it most for
    its stiffness, and q is the largest that slows all enough; 0 < q < 1.

    Args:
        parts: Young's modulus [Pa] and wave speed [m/s] of each.
        limit: Largest wave speed.
    """
    fast = [(young_pa, speed / limit) for young_pa, speed in parts if speed > limit]
    knee = min(young_pa / over**2 for young_pa, over in fast) / 4
    return knee, 1 - max(2 * log(over) / log(young_pa / knee) for young_pa, over in fast)


def compress_young(young_pa: float, knee: float, power: float) -> float:
    """Compress Young's modulus [Pa]: K (E/K)^q above the knee.

    Monotone in E, so the order of stiffness is kept, whatever the densities; a compression of wave speeds would make
    heavy soft material stiffer than light stiff material. Never above E.
    """
    return young_pa if young_pa <= knee else knee * (young_pa / knee) ** power


def capped_young(young_pa: float, poisson: float, density: float, cell: float) -> float:
    """Apply the published cap on Young's modulus [Pa], kept as a baseline and control only.

    E_sim = min(E, ρ (s dx/dt₀)² (1+ν)(1-2ν)/(1-ν)) with dt₀ = 1e-4 s and s = 0.5. The capped
    value depends on ρ and ν alone, so the order of stiffness is lost.
    """
    return min(young_pa, young_from_speed(BASELINE_COURANT * cell / BASELINE_STEP_S, poisson, density))
