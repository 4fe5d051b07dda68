"""Simulated parameters of one part: rigid, deformable or shell, with reasons.

Plants: crowns of leaves, and parts that do not visibly bend.

With true wood a plant hardly flexes: what sways is its root ball in soft potting soil and its leaves on their stalks.
So where everything but the leaves stays rigid, the crown is a body of its own without stress, each of its particles on
a damped spring to the wood, and the give of the soil is in a sprung joint at the root. Where the wood does bend, none
of this applies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import Literal

from corporeal.core.types import Discretization
from corporeal.discretization.filled_shells import mean_density, part_as_contents
from corporeal.discretization.pair_damping import pair_loss_factor_of_parts, takes_part_in_impact
from corporeal.discretization.part_geometry import (
    MIN_TUBE_SLENDERNESS,
    ExpectedMotion,
    PartGeometry,
    RigidityVerdict,
    is_flat_wall,
    is_folding_wall,
    part_at_life_size,
    part_width,
    rod_thickening_ratio,
    tube_diameter,
    wall_factors,
    wall_thickening_ratio,
)
from corporeal.discretization.rigidity import judge_rigidity
from corporeal.discretization.step_budget import wave_speed
from corporeal.materials.restitution_speed import material_at_speed
from corporeal.mpm.constants import GRID_LOSS_FACTOR, MIN_CELLS_FOR_GRID_LOSS
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.liquid_stiffness import bulk_modulus, elastic_moduli, fall_speed
from corporeal.mpm.physics.maxwell_branches import stiffening
from corporeal.mpm.physics.time_step_limits import (
    bounded_poisson,
    closed_wall_factors,
    fold_stiffness_factor,
    limp_wall_factors,
    shell_wave_speeds,
    stable_step,
)

MIN_FOLIAGE_LEAVES = 20
"""A part of fewer separate leaves is no crown."""
POTTED_SOIL_REASON = "a rigid pot holds it, and its compliance is in the spring at the plant's root"
FOLIAGE_REASON = "A crown of leaves without stress of its own, each on a damped spring to the wood"


@dataclass(frozen=True)
class PartVerdicts:
    """Verdicts on all parts of a scene, and which of them are crowns of leaves."""

    verdicts: Sequence[RigidityVerdict]
    """One per part."""
    foliage_parts: frozenset[int] = frozenset()
    """Numbers of parts."""


def judge_plants(parts: Sequence[PartGeometry], verdicts: Sequence[RigidityVerdict]) -> PartVerdicts:
    """Make potted soil rigid, and find the crowns of leaves."""
    judged = list(verdicts)
    foliage_parts: set[int] = set()
    leafy = {k for k, p in enumerate(parts) if p.leaves >= MIN_FOLIAGE_LEAVES and not p.prescribed}
    for number in sorted({parts[k].object for k in leafy}):
        mine = [k for k, p in enumerate(parts) if p.object == number]
        rest = [k for k in mine if k not in leafy]
        soil = [k for k in rest if CONSTITUTIVE_LAWS[parts[k].material.law].granular]
        firm = [k for k in rest if k not in soil]
        if firm and all(judged[k].rigid for k in firm):
            for k in soil:
                judged[k] = replace(judged[k], rigid=True, reason=POTTED_SOIL_REASON)
            foliage_parts |= leafy & set(mine)
    return PartVerdicts(judged, frozenset(foliage_parts))


PartRole = Literal["soft", "rigid", "inclusion", "subgrid", "foliage"]
"""An inclusion is rigid and holds the softer parts of its object. A subgrid part is too small to
be one and goes with them. Foliage is leaves on springs."""


@dataclass(frozen=True)
class GridResolution:
    """How finely an object is resolved."""

    cell: float
    """Grid spacing dx [m]."""
    across: float
    """Cells across what deforms of it [-]."""


def remaining_loss_factor(part: PartGeometry, motion: ExpectedMotion, across: float) -> float:
    """Loss factor that is left to the material of what is struck, beside the grid's own share [-].

    Contact at nodes and transfers take a share of an impact themselves. It counts on what the material has to take, so
    that both together are what was measured. A solid loses for what is rigid and meets it, too; a wall is dented so
    much more easily that it does not matter.

    Args:
        part: What is struck, as its contents where those are simulated.
        motion: Of its object.
        across: Cells across it [-].
    """
    if CONSTITUTIVE_LAWS[part.material.law].loose:
        return 0.0
    if motion.impact_speed == 0.0:
        return part.material.loss
    struck = material_at_speed(part.material, motion.impact_speed)
    loss = pair_loss_factor_of_parts(struck, motion) if is_dented_as_hertz(part) else struck.loss
    return max(0.0, loss - GRID_LOSS_FACTOR / max(across, MIN_CELLS_FOR_GRID_LOSS) ** 2)


def is_dented_as_hertz(part: PartGeometry) -> bool:
    """Return whether an impact dents a part as Hertz has it: no wall but a flat one."""
    return part.structure.kind == "solid" or is_flat_wall(part)


def effective_parameters(
    part: PartGeometry, verdict: RigidityVerdict, motion: ExpectedMotion, resolved: GridResolution, role: PartRole
) -> Discretization:
    """Give a part its simulated numbers: true ones, but for a thin wall and a capped bulk."""
    cell = resolved.cell
    if role == "foliage":
        return foliage_parameters(part, verdict, motion)
    if part.thin_shell and role == "soft":
        return thin_shell_parameters(part, verdict, motion, resolved)
    soft = role in ("soft", "subgrid")
    part = part_as_contents(part, motion.impact_speed) if soft else part
    material, structure = part.material, part.structure
    thicker = choose_thickening(part, role, 2 * cell, motion.impact_speed)
    density = mean_density(part) * thicker.density
    # True elastic numbers; those of a liquid follow from its speed.
    simulated_young_pa, poisson = bounded_poisson(material.young_pa, material.poisson)
    strong, young_pa = material.yield_stress, material.young_pa
    if CONSTITUTIVE_LAWS[material.law].liquid:
        simulated_young_pa, poisson = liquid_stiffness_numbers(part, motion)
        young_pa, strong = simulated_young_pa, sqrt(3.0) * material.yield_shear
    # What the grid does not dissipate by itself, and the waves that limit the step.
    shell = structure.kind == "shell" and structure.thickness is not None
    loss = remaining_loss_factor(part, motion, resolved.across) if soft else 0.0
    simulated_young_pa *= thicker.young_factor
    wave = wave_speed(simulated_young_pa, poisson, density, loss) if soft else 0.0
    return Discretization(
        kind=("shell" if shell else "deformable") if soft else "rigid",
        young_pa=young_pa,
        simulated_young_pa=simulated_young_pa if soft else material.young_pa,
        poisson=poisson,
        density=density,
        yield_stress=strong * thicker.strength if soft and strong is not None else strong,
        thickness=max(structure.thickness or 0.0, 2 * cell) if shell else None,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        loss=loss,
        wave_speed=wave,
        step=stable_step(wave, motion.impact_speed, cell) if soft else inf,
        reason="".join(
            (
                treatment_reason(verdict, role),
                wall_reason(part, thicker.wall, motion.impact_speed) if soft else "",
                rod_reason(thicker.rod),
                bar_reason(part, 2 * cell if soft else 0.0),
                partner_reason(part, motion) if soft else "",
                scale_reason(part, motion),
            )
        ),
    )


def thin_shell_parameters(
    part: PartGeometry, verdict: RigidityVerdict, motion: ExpectedMotion, resolved: GridResolution
) -> Discretization:
    """Give a thin wall its measured numbers; the step budget may lower its stiffness in the plane afterwards."""
    material, thickness = part.material, part.structure.thickness or 0.0
    young, poisson = bounded_poisson(material.young_pa, material.poisson)
    density = mean_density(part)
    loss = remaining_loss_factor(part, motion, resolved.across)
    plane, bending = shell_wave_speeds(young, poisson, density, thickness / resolved.cell)
    wave = max(plane, bending) * sqrt(stiffening(loss, poisson))
    return Discretization(
        kind="shell",
        young_pa=material.young_pa,
        simulated_young_pa=young,
        poisson=poisson,
        density=density,
        yield_stress=material.yield_stress,
        thickness=thickness,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        loss=loss,
        wave_speed=wave,
        step=stable_step(wave, motion.impact_speed, resolved.cell),
        reason=f"{treatment_reason(verdict, 'soft')} It is a triangle shell, {1e3 * thickness:.3g} mm thick as in "
        f"reality.{partner_reason(part, motion)}{scale_reason(part, motion)}",
        bending_young_pa=young,
    )


@dataclass(frozen=True)
class ThickeningFactors:
    """How a wall or a rod that the grid cannot resolve is simulated thicker than it is."""

    wall: float
    """Thickness of its wall over the simulated one [-]; 1: as it is."""
    rod: float
    """Diameter of a rod over the simulated one [-]; 1: as it is."""
    young_factor: float
    """Factor on E [-]."""
    strength: float
    """Factor on the yield stress [-]."""
    density: float
    """Factor on the density [-]."""


def choose_thickening(part: PartGeometry, role: PartRole, thick: float, speed: float) -> ThickeningFactors:
    """Choose the factors that keep bending and mass where a part is simulated ``thick`` [m]."""
    wall = wall_thickening_ratio(part, thick)
    young_factor, strength, density = wall_factors(part, wall, speed)
    thickness = part.structure.thickness
    round_dent = part.closed and not is_folding_wall(part, speed)
    if CONSTITUTIVE_LAWS[part.material.law].ductile and thickness and wall < 1 and not round_dent:
        young_factor *= fold_stiffness_factor(thickness, thick, part.size[1] / 2)
    rod = rod_thickening_ratio(part, thick) if role == "soft" else 1.0
    if rod < 1:
        young_factor, strength, density = rod**4, rod**3, rod**2
    return ThickeningFactors(wall, rod, young_factor, strength, density)


def liquid_stiffness_numbers(part: PartGeometry, motion: ExpectedMotion) -> tuple[float, float]:
    """E [Pa] and ν [-] that a liquid's largest speed asks for: of its fall, and of its collapse."""
    collapse = fall_speed(motion.acceleration, part.size[2])
    speed = hypot(motion.impact_speed, collapse)
    return elastic_moduli(bulk_modulus(part.material.density, speed))


def foliage_parameters(part: PartGeometry, verdict: RigidityVerdict, motion: ExpectedMotion) -> Discretization:
    """Give foliage no stress of its own."""
    return Discretization(
        kind="foliage",
        young_pa=part.material.young_pa,
        simulated_young_pa=0.0,
        poisson=0.0,
        density=part.material.density,
        yield_stress=None,
        thickness=None,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        wave_speed=0.0,
        step=inf,
        reason=f"{FOLIAGE_REASON}, because {verdict.reason} and the wood stays rigid.",
    )


def treatment_reason(verdict: RigidityVerdict, role: PartRole) -> str:
    """Say in one sentence why a part is treated as it is."""
    return {
        "rigid": f"Rigid, because {verdict.reason}.",
        "inclusion": f"A rigid inclusion that holds the soft parts around it, because {verdict.reason}.",
        "subgrid": "Deformable with the rest of its object; by itself it would be rigid.",
        "soft": f"Deformable, because {verdict.reason}.",
    }[role]


def scale_reason(part: PartGeometry, motion: ExpectedMotion) -> str:
    """Return where the real object, struck as fast, would be judged otherwise; "" where it would not.

    Stiffness against stress waves does not depend on size; against its own weight it does.
    """
    if part.scale == 1:
        return ""
    here, life = judge_rigidity(part, motion), judge_rigidity(part_at_life_size(part), motion)
    if here.rigid == life.rigid:
        return ""
    return f" At its real size, {1 / part.scale:.3g} times this one, it would be judged otherwise: {life.reason}."


def rod_reason(ratio: float) -> str:
    """Describe what a thickened rod keeps."""
    if ratio >= 1:
        return ""
    return (
        f" It is simulated {1 / ratio:.3g} times as thick, with its bending stiffness (up to 10 % "
        "less where it runs askew to the grid), its strength in bending and its mass kept; "
        "stretched it is softer than in reality."
    )


def bar_reason(part: PartGeometry, simulated: float) -> str:
    """Describe what was assumed of a long thin part that is no known rod or tube; "" of all others.

    Args:
        part: Which.
        simulated: How thick a known rod would at least be simulated [m].
    """
    across = part_width(part)
    known = part.diameter > 0 or part.leaves > 0 or tube_diameter(part) > 0
    plate = part.size[1] > part.size[2] / 4 and across > 0.7 * part.size[0]
    if known or plate or not 0 < MIN_TUBE_SLENDERNESS * across < part.size[2]:
        return ""
    thin = part.structure.kind != "shell" and across < simulated
    grid = "; it is simulated as thin as it is, and its bending is a rough estimate" if thin else ""
    return (
        " It is long and thin, but not one round rod or tube: whether it flexes was judged as for "
        f"a solid bar {1e3 * across:.2g} mm across{grid}."
    )


def partner_reason(part: PartGeometry, motion: ExpectedMotion) -> str:
    """Describe what else a part loses for; "" where it is nothing."""
    names = sorted({p.material.name for p in motion.partners if takes_part_in_impact(part.material, p)})
    if not names or not is_dented_as_hertz(part) or CONSTITUTIVE_LAWS[part.material.law].loose:
        return ""
    return (
        f" What meets it is rigid here ({', '.join(names)}) but deforms in reality: the loss "
        "factor is that of both, weighted by compliance."
    )


def wall_reason(part: PartGeometry, ratio: float, speed: float) -> str:
    """Describe what a thickened wall keeps."""
    if ratio >= 1:
        return ""
    factors = wall_factors(part, ratio, speed)
    if factors == limp_wall_factors(ratio):
        kept, lost = "its stiffness in its plane", "limp as it is, it bends less easily"
    else:
        dents = factors == closed_wall_factors(ratio)
        kept = "the stiffness with which it dents" if dents else "its bending stiffness"
        lost = "in its plane it is softer"
    return (
        f" Its wall is simulated {1 / ratio:.3g} times as thick, with {kept} and its mass kept; {lost} than in reality."
    )
