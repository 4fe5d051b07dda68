"""Step budget: reduction of wave speeds if the allowed number of time steps does not suffice.

First the bulk modulus of nearly incompressible materials is reduced, which is hardly visible; then Young's modulus.
Parts that would then be deformed much more than in reality become rigid.

Also the published rule, a cap that does not keep the order: a control only.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

from scipy.optimize import brentq

from corporeal.core.types import Discretization
from corporeal.discretization.hertz_indentation import dent_of_hollow_ball, hertz_dent_of_ball, yield_mark_of_ball
from corporeal.discretization.part_geometry import (
    MIN_COMPACT_SIDE_RATIO,
    ExpectedMotion,
    PartGeometry,
    RigidityVerdict,
    is_flat_wall,
    is_subgrid_part,
)
from corporeal.discretization.rigidity import MAX_INVISIBLE_STRAIN
from corporeal.mpm.constants import COURANT, MIN_REDUCED_POISSON_RATIO
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.maxwell_branches import stiffening
from corporeal.mpm.physics.time_step_limits import (
    capped_young,
    compress_young,
    fit_young_compression,
    p_wave_speed,
    shell_wave_speeds,
    stable_step,
)


def slow_subgrid_parts(
    parts: Sequence[PartGeometry], treatments: Sequence[Discretization], cell: float
) -> list[Discretization]:
    """Give parts that the grid cannot show the stiffness of the fastest part that they sit on.

    A can's tab or a duck's eye would otherwise set the time step of the whole scene.
    """
    small = [is_subgrid_part(p, cell) for p in parts]
    fastest = dict.fromkeys((p.object for p in parts), 0.0)
    for part, treatment, subgrid in zip(parts, treatments, small, strict=True):
        if not subgrid:
            fastest[part.object] = max(fastest[part.object], treatment.wave_speed)
    because = "Too small for the grid to resolve its stiffness, it is softened to its surroundings"
    return [
        slow_waves(t, fastest[p.object], cell, because) if subgrid and fastest[p.object] > 0 else t
        for p, t, subgrid in zip(parts, treatments, small, strict=True)
    ]


@dataclass(frozen=True)
class BudgetedTreatments:
    """Treatments that keep within a step budget."""

    treatments: list[Discretization]
    warnings: tuple[str, ...] = ()


MAX_LOSS_STEP_FACTOR = 1.6
"""How many times more steps than without loss lossy material may take [-], before stiffness
pays.
"""


MIN_WAVE_SPEED_RATIO = 10.0
"""How many times faster than anything moves a wave is, whatever the budget [-]."""


def counted_wave_speed(treatment: Discretization) -> float:
    """Wave speed that the step budget counts [m/s].

    Loss stiffens: up to a loss factor of 0.3 the steps that it takes are given, beyond that waves are slowed for it.
    """
    free = sqrt(stiffening(treatment.loss, treatment.poisson))
    return treatment.wave_speed / min(MAX_LOSS_STEP_FACTOR, free)


def fit_step_budget(
    treatments: Sequence[Discretization], cell: float, steps: float, outrun: float = MIN_WAVE_SPEED_RATIO
) -> BudgetedTreatments:
    """Compress stiffness where the step budget would be exceeded; its order is kept.

    σ_y falls with √(E_sim/E), which keeps the impact speed at which a part yields.
    """
    motion = max((t.impact_speed for t in treatments), default=0.0)
    limit = max(COURANT * cell * steps - motion, outrun * motion)
    treatments = [lower_poisson_ratio(t, limit, cell) for t in treatments]
    fastest = max(map(counted_wave_speed, treatments), default=0.0)
    # A part whose bulk gave way runs at the limit, but for rounding.
    if fastest <= limit * (1 + 1e-9):
        return BudgetedTreatments(treatments)
    because = "The step budget reduces its wave speed"
    bends = [(t.simulated_young_pa, counted_wave_speed(t)) for t in treatments if t.wave_speed > 0]
    knee, power = fit_young_compression(bends, limit)
    fitted = [
        slow_waves(
            t,
            t.wave_speed * sqrt(compress_young(t.simulated_young_pa, knee, power) / t.simulated_young_pa),
            cell,
            because,
        )
        if t.wave_speed > 0
        else t
        for t in treatments
    ]
    changed = sum(a.simulated_young_pa != b.simulated_young_pa for a, b in zip(treatments, fitted, strict=True))
    softer = "is simulated softer than it is" if changed == 1 else "are simulated softer than they are"
    warning = (
        f"{changed} of {len(fitted)} parts {softer}, to stay within {steps:,.0f} steps per second; "
        "the order of stiffness is kept. A finer --detail has a larger budget."
    )
    return BudgetedTreatments(fitted, (warning,))


def lower_poisson_ratio(treatment: Discretization, limit: float, cell: float) -> Discretization:
    """Lower Poisson's ratio of what is nearly incompressible until its waves keep to a limit.

    E stays, and with it the order of stiffness: from ν = 0.49 to 0.41 Hertz's force falls by 9 %, the wave speed to
    0.37. Nothing of it shows but a volume that strains by less than the shape.

    Args:
        treatment: Of any part.
        limit: Largest wave speed that the budget counts [m/s].
        cell: dx [m].
    """
    in_plane = treatment.bending_young_pa > 0.0  # no bulk is squeezed in plane stress
    if in_plane or counted_wave_speed(treatment) <= limit or treatment.poisson <= MIN_REDUCED_POISSON_RATIO:
        return treatment

    def at(poisson: float) -> Discretization:
        wave = wave_speed(treatment.simulated_young_pa, poisson, treatment.density, treatment.loss)
        step = stable_step(wave, treatment.impact_speed, cell)
        return replace(treatment, poisson=poisson, wave_speed=wave, step=step)

    def excess(poisson: float) -> float:
        return counted_wave_speed(at(poisson)) - limit

    enough = excess(MIN_REDUCED_POISSON_RATIO) < 0
    lower = MIN_REDUCED_POISSON_RATIO
    if enough:
        lower = float(brentq(excess, MIN_REDUCED_POISSON_RATIO, treatment.poisson))  # pyright: ignore[reportArgumentType]
    return replace(
        at(lower),
        reason=f"{treatment.reason} The step budget lowers its Poisson's ratio from "
        f"{treatment.poisson:.3g} to {lower:.3g}.",
    )


def wave_speed(young_pa: float, poisson: float, density: float, loss: float) -> float:
    """Speed of the fastest wave [m/s]: c_p of the modulus that is resisted at once.

    Args:
        young_pa: E, resisted slowly [Pa].
        poisson: ν [-].
        density: ρ [kg/m³].
        loss: tan δ as simulated [-]: loss stiffens (``mpm.physics.branches``).
    """
    return p_wave_speed(young_pa, poisson, density) * sqrt(stiffening(loss, poisson))


def parts_nearer_to_rigid(
    parts: Sequence[PartGeometry],
    motions: Sequence[ExpectedMotion],
    verdicts: Sequence[RigidityVerdict],
    unslowed: Sequence[Discretization],
    slowed: Sequence[Discretization],
) -> dict[int, str]:
    """Return which parts would be simulated so much too soft that rigid is nearer to the truth.

    Rigid is nearer where the strain is off by more than all that there is of it in reality. No strain counts as more
    than 1, at which all shape is lost. Of a solid that yields the lasting dent counts. What flows has to do so at any
    stiffness; sheets, rods and hollow objects keep bending when struck.

    Returns:
        Number of the part → why, in a clause.
    """
    found = {}
    for k, (true, soft) in enumerate(zip(unslowed, slowed, strict=True)):
        part, verdict = parts[k], verdicts[k]
        flows = CONSTITUTIVE_LAWS[part.material.law].loose
        if verdict.rigid or flows or true.wave_speed == 0:
            continue
        why = _too_soft_reason(part, motions[part.object], verdict, true, soft)
        if why:
            found[k] = why
    return found


def _too_soft_reason(
    part: PartGeometry, motion: ExpectedMotion, verdict: RigidityVerdict, true: Discretization, soft: Discretization
) -> str:
    """Return why rigid is nearer to the truth than as soft as a part would be simulated; "": no."""
    if true.impact_speed >= verdict.yield_speed:
        dents = _yield_marks(part, true, soft)
    elif verdict.impact < MAX_INVISIBLE_STRAIN:
        sags = _sags_too_far(part, motion, verdict, true, soft)
        return (
            f"it is expected to strain by about {verdict.strain:.2g}, and as soft as the grid and "
            "the step budget would make it, it would sag by more than that"
            if sags
            else ""
        )
    else:
        dents = _ball_dents(part, true, soft) if is_dented_by_impact(part) else None
    if dents is None or dents.simulated <= 2.0 * dents.life:
        return ""
    return _dented_reason(true.impact_speed, dents)


def _dented_reason(speed: float, dents: "_BallDents") -> str:
    """Return why a part that would be dented too deeply is rigid."""
    return (
        f"an impact at {speed:.2g} m/s would dent it by {dents.life:.2g} of its radius, and as "
        "soft "
        f"as the grid and the step budget would make it, by {dents.simulated:.2g}; it rebounds "
        "by its coefficient of restitution"
    )


@dataclass(frozen=True)
class _BallDents:
    """Greatest dents of a ball in an impact, over its radius [-]."""

    life: float
    simulated: float


def _ball_dents(part: PartGeometry, true: Discretization, soft: Discretization) -> _BallDents | None:
    """Return how deep an impact dents a solid or a sealed wall; None: it bends in another way.

    Other walls are open, or their restitution is that of solids: they stay soft.
    """
    if soft.kind == "deformable":
        return _BallDents(
            *(
                hertz_dent_of_ball(modulus_pa, true.poisson, true.density, true.impact_speed)
                for modulus_pa in (true.simulated_young_pa, soft.simulated_young_pa)
            )
        )
    if soft.kind != "shell" or not part.structure.sealed or not soft.thickness:
        return None
    speed, radius, made = true.impact_speed, 0.5 * part.size[0], part.material
    real = (made.young_pa, made.poisson, made.density, part.structure.thickness or soft.thickness)
    slow = (soft.simulated_young_pa, soft.poisson, soft.density, soft.thickness)
    return _BallDents(*(dent_of_hollow_ball(*wall, radius, speed) for wall in (real, slow)))


def _yield_marks(part: PartGeometry, true: Discretization, soft: Discretization) -> _BallDents | None:
    """Return how deep an impact marks a compact solid that yields; None: it bends in another way."""
    solid = soft.kind == "deformable" and part.structure.kind == "solid"
    if not (solid and is_dented_by_impact(part) and true.yield_stress and soft.yield_stress):
        return None
    strengths = (true.yield_stress, soft.yield_stress)
    return _BallDents(*(yield_mark_of_ball(s, true.density, true.impact_speed) for s in strengths))


def _sags_too_far(
    part: PartGeometry, motion: ExpectedMotion, verdict: RigidityVerdict, true: Discretization, soft: Discretization
) -> bool:
    """Return whether a part sags by more than twice as much as in reality.

    In life it strains by ε_w for good under its own weight; softened f times by the step budget,
    by ε_w f; and thickened, which keeps its bending stiffness only, by ρ a L/E of the simulated
    numbers.
    """
    pull = motion.driven if part.burden else motion.acceleration
    squashed = soft.density * pull * part.size[2] / soft.simulated_young_pa
    sags = min(1.0, max(squashed, verdict.weight * true.simulated_young_pa / soft.simulated_young_pa))
    return sags - min(1.0, verdict.weight) > max(verdict.weight, MAX_INVISIBLE_STRAIN)


def is_dented_by_impact(part: PartGeometry) -> bool:
    """Return whether an impact dents a part rather than bends it: no rod, no sheet, no plant."""
    lumpy = part.size[0] >= MIN_COMPACT_SIDE_RATIO * part.size[2]
    return lumpy and part.leaves == 0 and part.diameter == 0


MIN_WALL_HOLD_FRACTION = 0.25
"""A flat wall that holds less than this share of what it holds in reality when stretched is nearer to life as a rigid
one: its dent, as √(1/hold), would be more than twice as deep as in reality.
"""


def walls_that_tear(
    parts: Sequence[PartGeometry], verdicts: Sequence[RigidityVerdict], treatments: Sequence[Discretization]
) -> dict[int, str]:
    """Return which flat ductile walls would tear as they are simulated, and why they are rigid.

    A plate that is struck stops what strikes it by being stretched: the energy of a dent of depth w is π σ_y t w² (a
    membrane in the shape of a cone). A thickened wall keeps its bending strength, and so holds only σ_sim t_sim / (σ_y
    t), which the step budget lowers further.
    """
    found = {}
    for k, (part, verdict, treatment) in enumerate(zip(parts, verdicts, treatments, strict=True)):
        thickness, strong = part.structure.thickness or 0.0, part.material.yield_stress
        flat = treatment.kind == "shell" and is_flat_wall(part)
        if verdict.rigid or not flat or not strong or not treatment.thickness:
            continue
        hold = (treatment.yield_stress or 0.0) * treatment.thickness / (strong * thickness)
        if treatment.impact_speed >= verdict.yield_speed and hold < MIN_WALL_HOLD_FRACTION:
            found[k] = (
                f"it would yield when struck at {treatment.impact_speed:.2g} m/s, but on this grid "
                f"it would resist being stretched with only {hold:.1%} of its strength, and tear"
            )
    return found


def slow_waves(treatment: Discretization, speed: float, cell: float, because: str) -> Discretization:
    """Slow a deformable part's waves down to ``speed`` [m/s], and say why."""
    if treatment.kind == "rigid" or speed >= treatment.wave_speed:
        return treatment
    if treatment.bending_young_pa > 0.0:
        return slow_shell_waves(treatment, speed, cell, because)
    factor = speed / treatment.wave_speed
    strong = treatment.yield_stress
    return replace(
        treatment,
        simulated_young_pa=treatment.simulated_young_pa * factor**2,
        yield_stress=None if strong is None else strong * factor,
        wave_speed=speed,
        step=stable_step(speed, treatment.impact_speed, cell),
        reason=f"{treatment.reason} {because}: {1 / factor:.3g} times.",
    )


def slow_shell_waves(treatment: Discretization, speed: float, cell: float, because: str) -> Discretization:
    """Slow a thin shell's waves down to ``speed`` [m/s]: those in its plane and those of bending, each as far as asked.

    It yields at its measured stress.
    """
    stiffer = sqrt(stiffening(treatment.loss, treatment.poisson))
    numbers = treatment.bending_young_pa, treatment.poisson, treatment.density, (treatment.thickness or 0.0) / cell
    bending_speed = stiffer * shell_wave_speeds(*numbers)[1]
    plane_speed = stiffer * shell_wave_speeds(treatment.simulated_young_pa, *numbers[1:])[0]
    plane, bending = (min(1.0, (speed / wave) ** 2) for wave in (plane_speed, bending_speed))
    words = (f"in its plane {1 / plane:.3g} times", f"in bending {1 / bending:.3g} times")
    softer = " and ".join(w for w, factor in zip(words, (plane, bending), strict=True) if factor < 1.0)
    return replace(
        treatment,
        simulated_young_pa=treatment.simulated_young_pa * plane,
        bending_young_pa=treatment.bending_young_pa * bending,
        wave_speed=speed,
        step=stable_step(speed, treatment.impact_speed, cell),
        reason=f"{treatment.reason} {because}: it is softer {softer}.",
    )


def cap_stiffness(part: PartGeometry, treatment: Discretization, cell: float) -> Discretization:
    """Apply the published cap instead: σ_y falls with E, which keeps the yield strain."""
    material, density = part.material, treatment.density
    poisson = min(material.poisson, 0.4999)
    simulated_young_pa = capped_young(material.young_pa, poisson, density, cell)
    wave = p_wave_speed(simulated_young_pa, poisson, density)
    strong = material.yield_stress
    return replace(
        treatment,
        simulated_young_pa=simulated_young_pa,
        poisson=poisson,
        yield_stress=None if strong is None else strong * simulated_young_pa / material.young_pa,
        wave_speed=wave,
        step=stable_step(wave, treatment.impact_speed, cell),
        reason="Deformable with the published cap on Young's modulus.",
    )
