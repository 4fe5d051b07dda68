"""Where the steps that a scene may take do not suffice: waves are slowed, in their order.

First the bulk of what is nearly incompressible gives way, which hardly shows; then Young's modulus.
What would then be dented or squashed much more than in life is rigid instead.

Also the published rule, a cap that does not keep the order: a control only.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

from scipy.optimize import brentq

from corporeal.core.types import Treatment
from corporeal.discretization.bending import INVISIBLE_STRAIN
from corporeal.discretization.dents import dent_of_blow, dent_of_wall, mark_of_blow
from corporeal.discretization.part import (
    COMPACT,
    Motion,
    PartGeometry,
    Verdict,
    is_flat_wall,
    is_trinket,
)
from corporeal.mpm.constants import COURANT, POISSON_FLOOR
from corporeal.mpm.laws import MENU
from corporeal.mpm.physics.branches import stiffening
from corporeal.mpm.physics.stability import (
    capped_young,
    compress_young,
    compression,
    p_wave_speed,
    stable_step,
)


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


@dataclass(frozen=True)
class Fitted:
    """Treatments that keep within a step budget."""

    treatments: list[Treatment]
    warnings: tuple[str, ...] = ()


STIFFENED = 1.6
"""How many times more steps than without loss lossy matter may take [-], before stiffness pays."""


OUTRUN = 10.0
"""How many times faster than anything moves a wave is, whatever the budget [-]."""


def counted(treatment: Treatment) -> float:
    """Wave speed that the step budget counts [m/s].

    Loss stiffens: up to a loss factor of 0.3 the steps that it takes are given, beyond that waves
    are slowed for it.
    """
    free = sqrt(stiffening(treatment.loss, treatment.poisson))
    return treatment.wave_speed / min(STIFFENED, free)


def fit_budget(
    treatments: Sequence[Treatment], cell: float, steps: float, outrun: float = OUTRUN
) -> Fitted:
    """Compress stiffness where the step budget would be exceeded; its order is kept.

    σ_y falls with √(E_sim/E), which keeps the impact speed at which a part yields.
    """
    motion = max((t.impact_speed for t in treatments), default=0.0)
    limit = max(COURANT * cell * steps - motion, outrun * motion)
    treatments = [soften_bulk(t, limit, cell) for t in treatments]
    fastest = max(map(counted, treatments), default=0.0)
    # A part whose bulk gave way runs at the limit, but for rounding.
    if fastest <= limit * (1 + 1e-9):
        return Fitted(treatments)
    because = "The step budget slows its waves"
    bends = [(t.young, counted(t)) for t in treatments if t.wave_speed > 0]
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
    softer = (
        "is simulated softer than it is" if changed == 1 else "are simulated softer than they are"
    )
    warning = (
        f"{changed} of {len(fitted)} parts {softer}, to stay within {steps:,.0f} steps per second; "
        "what is stiffer stays stiffer. A finer --detail has a larger budget."
    )
    return Fitted(fitted, (warning,))


def soften_bulk(treatment: Treatment, limit: float, cell: float) -> Treatment:
    """Lower Poisson's ratio of what is nearly incompressible until its waves keep to a limit.

    E stays, and with it the order of stiffness: from ν = 0.49 to 0.41 Hertz's force falls by 9 %,
    the wave speed to 0.37. Nothing of it shows but a volume that strains by less than the shape.

    Args:
        treatment: Of any part.
        limit: Largest wave speed that the budget counts [m/s].
        cell: dx [m].

    """
    if counted(treatment) <= limit or treatment.poisson <= POISSON_FLOOR:
        return treatment

    def at(poisson: float) -> Treatment:
        wave = wave_speed(treatment.young, poisson, treatment.density, treatment.loss)
        step = stable_step(wave, treatment.impact_speed, cell)
        return replace(treatment, poisson=poisson, wave_speed=wave, step=step)

    def excess(poisson: float) -> float:
        return counted(at(poisson)) - limit

    enough = excess(POISSON_FLOOR) < 0
    lower = POISSON_FLOOR
    if enough:
        lower = float(brentq(excess, POISSON_FLOOR, treatment.poisson))  # pyright: ignore[reportArgumentType]
    return replace(
        at(lower),
        why=f"{treatment.why} The step budget lowers its Poisson's ratio from "
        f"{treatment.poisson:.3g} to {lower:.3g}.",
    )


def wave_speed(young: float, poisson: float, density: float, loss: float) -> float:
    """Speed of the fastest wave [m/s]: c_p of the modulus that is resisted at once.

    Args:
        young: E, resisted slowly [Pa].
        poisson: ν [-].
        density: ρ [kg/m³].
        loss: tan δ as simulated [-]: loss stiffens (``mpm.physics.branches``).

    """
    return p_wave_speed(young, poisson, density) * sqrt(stiffening(loss, poisson))


# ------------------------------------------------------------------ better rigid


def nearer_rigid(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    verdicts: Sequence[Verdict],
    unslowed: Sequence[Treatment],
    slowed: Sequence[Treatment],
) -> dict[int, str]:
    """Say which parts would be simulated so much too soft that rigid is nearer to the truth.

    Rigid is nearer where the strain is off by more than all that there is of it in life. No strain
    counts as more than 1, at which all shape is lost. Of a solid that yields the lasting dent
    counts. What flows has to do so at any stiffness; sheets, rods and hollow things keep bending
    when struck.

    Returns:
        Number of the part → why, in a clause.

    """
    found = {}
    for k, (true, soft) in enumerate(zip(unslowed, slowed, strict=True)):
        part, verdict = parts[k], verdicts[k]
        flows = MENU[part.material.law].loose
        if verdict.rigid or flows or true.wave_speed == 0:
            continue
        why = _too_soft(part, motions[part.object], verdict, true, soft)
        if why:
            found[k] = why
    return found


def _too_soft(
    part: PartGeometry, motion: Motion, verdict: Verdict, true: Treatment, soft: Treatment
) -> str:
    """Say why rigid is nearer to the truth than as soft as a part would be simulated; "": no."""
    if true.impact_speed >= verdict.yield_speed:
        dents = _marks(part, true, soft)
    elif verdict.impact < INVISIBLE_STRAIN:
        sags = _sags_too_far(part, motion, verdict, true, soft)
        return (
            f"it is expected to strain by about {verdict.strain:.2g}, and as soft as the grid and "
            "the step budget would make it, it would sag by more than that"
            if sags
            else ""
        )
    else:
        dents = _dents(part, true, soft) if is_compact(part) else None
    if dents is None or dents.simulated <= 2.0 * dents.life:
        return ""
    return _dented(true.impact_speed, dents)


def _dented(speed: float, dents: "_Dents") -> str:
    """Say why a part that would be dented too deeply is rigid."""
    return (
        f"a blow at {speed:.2g} m/s would dent it by {dents.life:.2g} of its radius, and as soft "
        f"as the grid and the step budget would make it, by {dents.simulated:.2g}; it rebounds "
        "by its coefficient of restitution"
    )


@dataclass(frozen=True)
class _Dents:
    """Greatest dents of a ball in a blow, over its radius [-]."""

    life: float
    simulated: float


def _dents(part: PartGeometry, true: Treatment, soft: Treatment) -> _Dents | None:
    """Give how deep a blow dents a solid or a sealed wall; None: it bends in another way.

    Other walls are open, or their restitution is that of solids: they stay soft.
    """
    if soft.kind == "deformable":
        return _Dents(
            *(
                dent_of_blow(young, true.poisson, true.density, true.impact_speed)
                for young in (true.young, soft.young)
            )
        )
    if soft.kind != "shell" or not part.structure.sealed or not soft.thickness:
        return None
    speed, radius, made = true.impact_speed, 0.5 * part.size[0], part.material
    real = (made.young, made.poisson, made.density, part.structure.thickness or soft.thickness)
    slow = (soft.young, soft.poisson, soft.density, soft.thickness)
    return _Dents(*(dent_of_wall(*wall, radius, speed) for wall in (real, slow)))


def _marks(part: PartGeometry, true: Treatment, soft: Treatment) -> _Dents | None:
    """Give how deep a blow marks a compact solid that yields; None: it bends in another way."""
    solid = soft.kind == "deformable" and part.structure.kind == "solid"
    if not (solid and is_compact(part) and true.yield_stress and soft.yield_stress):
        return None
    strengths = (true.yield_stress, soft.yield_stress)
    return _Dents(*(mark_of_blow(s, true.density, true.impact_speed) for s in strengths))


def _sags_too_far(
    part: PartGeometry, motion: Motion, verdict: Verdict, true: Treatment, soft: Treatment
) -> bool:
    """Tell whether a part sags by more than twice as much as in life.

    In life it strains by ε_w for good under its own weight; softened f times by the step budget,
    by ε_w f; and thickened, which keeps its bending stiffness only, by ρ a L/E of the simulated
    numbers.
    """
    pull = motion.driven if part.burden else motion.acceleration
    squashed = soft.density * pull * part.size[2] / soft.young
    sags = min(1.0, max(squashed, verdict.weight * true.young / soft.young))
    return sags - min(1.0, verdict.weight) > max(verdict.weight, INVISIBLE_STRAIN)


def is_compact(part: PartGeometry) -> bool:
    """Tell whether a blow dents a part rather than bends it: no rod, no sheet, no plant."""
    lumpy = part.size[0] >= COMPACT * part.size[2]
    return lumpy and part.leaves == 0 and part.diameter == 0


LEAST_HOLD = 0.25
"""A flat wall that holds less than this share of what it holds in life when stretched is nearer to
life as a rigid one: its dent, as √(1/hold), would be more than twice as deep as in life."""


def torn_walls(
    parts: Sequence[PartGeometry], verdicts: Sequence[Verdict], treatments: Sequence[Treatment]
) -> dict[int, str]:
    """Say which flat ductile walls would tear as they are simulated, and why they are rigid.

    A plate that is struck stops what strikes it by being stretched: the energy of a dent of depth w
    is π σ_y t w² (a membrane in the shape of a cone). A thickened wall keeps its bending strength,
    and so holds only σ_sim t_sim / (σ_y t), which the step budget lowers further.
    """
    found = {}
    for k, (part, verdict, treatment) in enumerate(zip(parts, verdicts, treatments, strict=True)):
        thickness, strong = part.structure.thickness or 0.0, part.material.yield_stress
        flat = treatment.kind == "shell" and is_flat_wall(part)
        if verdict.rigid or not flat or not strong or not treatment.thickness:
            continue
        hold = (treatment.yield_stress or 0.0) * treatment.thickness / (strong * thickness)
        if treatment.impact_speed >= verdict.yield_speed and hold < LEAST_HOLD:
            found[k] = (
                f"it would yield when struck at {treatment.impact_speed:.2g} m/s, but on this grid "
                f"it would resist being stretched with only {hold:.1%} of its strength, and tear"
            )
    return found


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
