"""Where the steps that a scene may take do not suffice: waves are slowed, in their order.

Also the published rule, a cap that does not keep the order: a control only.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

from corporeal.mpm.judging import INVISIBLE_STRAIN
from corporeal.mpm.part import Motion, PartGeometry, Verdict, is_trinket
from corporeal.mpm.stability import (
    COURANT,
    capped_young,
    compress_young,
    compression,
    p_wave_speed,
    stable_step,
)
from corporeal.types import Law, Treatment


def calm_trinkets(
    parts: Sequence[PartGeometry], treatments: Sequence[Treatment], cell: float
) -> list[Treatment]:
    """Give parts that the grid cannot show the stiffness of the fastest part that they sit on.

    A can's tab or a duck's eye would otherwise set the time step of the whole scene.
    """
    small = [is_trinket(p, cell) for p in parts]
    fastest = dict.fromkeys((p.object for p in parts), 0.0)
    for part, treatment, trinket in zip(parts, treatments, small, strict=True):
        if not trinket:
            fastest[part.object] = max(fastest[part.object], treatment.wave_speed)
    because = "Too small for the grid to show its own stiffness, it is slowed to what it sits on"
    return [
        compress(t, fastest[p.object], cell, because) if trinket and fastest[p.object] > 0 else t
        for p, t, trinket in zip(parts, treatments, small, strict=True)
    ]


def fit_budget(
    treatments: Sequence[Treatment], cell: float, steps: float
) -> tuple[list[Treatment], list[str]]:
    """Compress stiffness where the step budget would be exceeded; its order is kept.

    σ_y falls with √(E_sim/E), which keeps the impact speed at which a part yields.
    """
    fastest = max((t.wave_speed for t in treatments), default=0.0)
    motion = max((t.impact_speed for t in treatments), default=0.0)
    # A wave must outrun what moves by far, whatever the budget.
    limit = max(COURANT * cell * steps - motion, 10 * motion)
    if fastest <= limit:
        return list(treatments), []
    because = "The step budget slows its waves"
    bends = [(t.young, t.wave_speed) for t in treatments if t.wave_speed > 0]
    knee, power = compression(bends, limit)
    fitted = [
        compress(
            t, t.wave_speed * sqrt(compress_young(t.young, knee, power) / t.young), cell, because
        )
        if t.wave_speed > 0
        else t
        for t in treatments
    ]
    changed = sum(a.young != b.young for a, b in zip(treatments, fitted, strict=True))
    return fitted, [
        f"{changed} of {len(fitted)} parts are simulated softer than they are, to stay within "
        f"{steps:,.0f} steps per second; the order of stiffness is kept. "
        "A finer detail has a larger budget."
    ]


def nearer_rigid(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    verdicts: Sequence[Verdict],
    unslowed: Sequence[Treatment],
    slowed: Sequence[Treatment],
) -> set[int]:
    """Say which parts would be simulated so much too soft that rigid is nearer to the truth.

    In life a part strains by ε_w for good under its own weight; softened f times by the step
    budget, by ε_w f; and thickened, which keeps its bending stiffness only, by ρ a L/E of the
    simulated numbers. It is better rigid where that is off by more than ε_w; no strain counts as
    more than 1, at which all shape is lost. What would visibly flex when struck stays soft, and
    what yields or flows has to do so at any stiffness.
    """
    found = set()
    for k, (true, soft) in enumerate(zip(unslowed, slowed, strict=True)):
        part, verdict = parts[k], verdicts[k]
        flows = part.material.law is Law.DRUCKER_PRAGER
        yields = flows or true.impact_speed >= verdict.yield_speed
        flexes = verdict.impact >= INVISIBLE_STRAIN
        if verdict.rigid or yields or flexes or true.wave_speed == 0:
            continue
        motion = motions[part.object]
        pull = motion.driven if part.burden else motion.acceleration
        squashed = soft.density * pull * part.size[2] / soft.young
        sags = min(1.0, max(squashed, verdict.weight * true.young / soft.young))
        if sags - min(1.0, verdict.weight) > max(verdict.weight, INVISIBLE_STRAIN):
            found.add(k)
    return found


def softened(verdict: Verdict) -> str:
    """Say why such a part is rigid."""
    return (
        f"it is expected to strain by about {verdict.strain:.2g}, and as soft as the grid and the "
        "step budget would make it, it would sag by more than that"
    )


def compress(treatment: Treatment, speed: float, cell: float, because: str) -> Treatment:
    """Slow a deformable part's waves down to ``speed`` [m/s], and say why."""
    if treatment.kind == "rigid" or speed >= treatment.wave_speed:
        return treatment
    factor = speed / treatment.wave_speed
    strong = treatment.yield_stress
    return replace(
        treatment,
        young=treatment.young * factor**2,
        yield_stress=None if strong is None else strong * factor,
        wave_speed=speed,
        step=stable_step(speed, treatment.impact_speed, cell),
        why=f"{treatment.why} {because}: {1 / factor:.3g} times.",
    )


def cap(part: PartGeometry, treatment: Treatment, cell: float) -> Treatment:
    """Apply the published cap instead: σ_y falls with E, which keeps the yield strain."""
    material, density = part.material, treatment.density
    poisson = min(material.poisson, 0.4999)
    young = capped_young(material.young, poisson, density, cell)
    wave = p_wave_speed(young, poisson, density)
    strong = material.yield_stress
    return replace(
        treatment,
        young=young,
        poisson=poisson,
        yield_stress=None if strong is None else strong * young / material.young,
        wave_speed=wave,
        step=stable_step(wave, treatment.impact_speed, cell),
        why="Deformable with the published cap on Young's modulus.",
    )
