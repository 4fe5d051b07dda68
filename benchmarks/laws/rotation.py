"""Turning costs nothing: case 17."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from corporeal.core.types import Law
from corporeal.mpm.laws import CONSTITUTIVE_LAWS, flow, tau
from corporeal.mpm.laws.constitutive_law import YieldParameters, lame_parameters
from corporeal.mpm.laws.drucker_prager import cone_slope
from corporeal.mpm.reference.engine import ReferenceEngine
from laws.bodies import Stuff, box, problem
from laws.outcome import Check, Outcome, absolute
from laws.watching import started

CELL = 0.02
SPIN = np.array([0.02, -0.01, 0.03])
"""[rad/s]; slow, as a real body in rotation is stretched by ρ ω² R² / E."""


@dataclass(frozen=True)
class Turned:
    """What a rotation left behind."""

    stress: float
    """Largest |τ| / E [-]."""
    strain: float
    """Largest |Σ - 1| [-]."""


def turned_at_once(law: Law, count: int = 1000) -> Turned:
    """Turn undeformed matter by random rotations and let it flow, in double precision."""
    F = Rotation.random(count, random_state=0).as_matrix()
    one, none, numbers = np.ones(count), np.zeros(count), np.full(count, law.value)
    mu, lam = (np.asarray(value) for value in lame_parameters(one, 0.3 * one))
    weak = YieldParameters(
        mu=mu,
        lam=lam,
        yield_stress=1e-9 * one,
        hardening=none,
        cone=cone_slope(0.5) * one,
        apex=none,
        drag=none,
        flow_index=one,
    )
    F = flow(numbers, F, weak, none, none).F
    stress = tau(numbers, F, mu, lam)
    stretch = np.linalg.svd(F, compute_uv=False)
    return Turned(float(np.abs(stress).max()), float(np.abs(stretch - 1).max()))


def turning_body(law: Law, build, time: float) -> Turned:
    """Let a small block spin freely; ρ ω² R² / E is 2e-8."""
    stuff = Stuff(law=law, young_pa=1e5, poisson=0.3, density=1000.0, yield_stress=1e4)
    block = box((0.003, 0.007, 0.005), (0.06, 0.04, 0.04), CELL / 2, stuff=stuff, spin=tuple(SPIN))
    run = build(problem(block, cell=CELL))
    run.advance(time)
    F = run.snapshot().deformation
    count = np.ones(len(F))
    mu, lam = (np.asarray(value) for value in lame_parameters(1e5 * count, 0.3 * count))
    stress = tau(np.full(len(F), law.value), F, mu, lam)
    stretch = np.linalg.svd(F, compute_uv=False)
    return Turned(float(np.abs(stress).max() / 1e5), float(np.abs(stretch - 1).max()))


def rotating_body(quick: bool = False) -> Outcome:
    """Case 17: a rotation causes no stress, whatever the law."""
    checks: list[Check] = []
    time = 0.12 if quick else 0.3
    for law in CONSTITUTIVE_LAWS:
        name = law.name.lower().replace("_", "-")
        checks.append(absolute(f"τ/E after any rotation, {name}", turned_at_once(law).stress, 0.0, 1e-6))
    for law in tuple(CONSTITUTIVE_LAWS)[1:2] if quick else CONSTITUTIVE_LAWS:
        name = law.name.lower().replace("_", "-")
        found = turning_body(law, ReferenceEngine, time)
        checks.append(absolute(f"τ/E of a spinning block, {name}", found.stress, 0.0, 1e-6))
    fast = turning_body(Law.NEO_HOOKEAN, started, time)
    checks.append(absolute("τ/E of a spinning block, production engine", fast.stress, 0.0, 1e-5))
    return Outcome("17", "Rotating a body costs no stress", "f64 twin; all laws, return maps included", tuple(checks))
