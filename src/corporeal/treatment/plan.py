"""How each part enters the simulation: rigid, deformable or shell, and with which numbers.

One policy for all scenes (no scene can tune it): a part that would neither yield nor visibly flex
is rigid, by itself or as the frame of softer parts; everything else keeps its true stiffness; thin
walls are thickened with the stiffness that counts and the areal mass kept; only a step budget may
compress wave speeds, in their order. What would sag far more than in life, as soft as thick walls
and the step budget make it, is rigid after all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import Literal

from corporeal.mpm.constants import FEWEST_CELLS, GRID_LOSS
from corporeal.mpm.laws import MENU
from corporeal.mpm.physics.liquid_stiffness import bulk_modulus, elastic_numbers, fall_speed
from corporeal.mpm.physics.stability import (
    bounded_poisson,
    closed_wall,
    fold_factor,
    limp_wall,
    stable_step,
)
from corporeal.treatment.crown_of_leaves import SWAYS, Judgements, with_plants
from corporeal.treatment.filled import as_contents, mean_density
from corporeal.treatment.part import (
    TUBE,
    Motion,
    PartGeometry,
    Verdict,
    is_grain,
    life_sized,
    rod_ratio,
    tube,
    wall_factors,
    wall_ratio,
    width,
)
from corporeal.treatment.rigidity import judge
from corporeal.treatment.step_budget import (
    calm_trinkets,
    cap,
    fit_budget,
    nearer_rigid,
    torn_walls,
    wave_speed,
)
from corporeal.types import Material, Treatment

Detail = Literal["draft", "normal", "fine"]
Stiffness = Literal["true", "capped"]
Role = Literal["soft", "rigid", "frame", "trinket", "crown"]
"""A frame is a rigid inclusion: it holds the softer parts of its object. A trinket is too small to
be one and goes with them. A crown is leaves on springs."""

PARTICLES_PER_CELL = 8


@dataclass(frozen=True)
class Plan:
    """Resolution and treatments for a whole scene."""

    cell: float
    """Grid spacing dx [m]."""
    treatments: tuple[Treatment, ...]
    """One per part."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Quality:
    """What one word of detail buys."""

    cells_across: int
    """Cells across the shortest side of the smallest deformable object."""
    cells_along: int
    """At most so many cells along the largest deformable object."""
    particles: int
    """At most so many particles in the scene."""
    steps_per_second: float
    """At most so many steps per simulated second …"""
    work: float
    """… and so many particles times steps, but never below two fifths of those steps."""

    def steps(self, particles: float) -> float:
        """Say how many steps per simulated second a scene of so many particles may take."""
        return min(
            self.steps_per_second,
            max(self.work / particles, 0.4 * self.steps_per_second),
        )


QUALITIES: dict[str, Quality] = {
    "draft": Quality(8, 48, 40_000, 20e3, 3e8),
    "normal": Quality(12, 96, 200_000, 60e3, 5e9),
    "fine": Quality(20, 192, 1_000_000, 200e3, 1e11),
}


def plan(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    detail: Detail | Quality,
    stiffness: Stiffness = "true",
) -> Plan:
    """Choose the grid spacing and every part's treatment.

    Args:
        parts: All parts of the scene.
        motions: One per object.
        detail: The one knob of quality, or what it buys.
        stiffness: "capped" is the published rule, a control only.

    """
    verdicts = [judge(part, motions[part.object]) for part in parts]
    judged = Judgements(verdicts)
    if stiffness == "true":
        judged = with_plants(parts, verdicts)
    while True:
        draft = _plan(parts, motions, judged, detail, stiffness)
        treatments = draft.plan.treatments
        why = nearer_rigid(parts, motions, judged.verdicts, draft.unslowed, treatments)
        why |= torn_walls(parts, judged.verdicts, treatments)
        if stiffness == "capped" or not why:
            return draft.plan
        verdicts = [
            replace(v, rigid=True, reason=why[k]) if k in why else v
            for k, v in enumerate(judged.verdicts)
        ]
        judged = replace(judged, verdicts=verdicts)


@dataclass(frozen=True)
class _Draft:
    """A plan, and what it would be without a step budget."""

    plan: Plan
    unslowed: Sequence[Treatment]
    """Treatments before the step budget."""


def _plan(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    judged: Judgements,
    detail: Detail | Quality,
    stiffness: Stiffness,
) -> _Draft:
    """Choose for given verdicts and crowns."""
    quality = detail if isinstance(detail, Quality) else QUALITIES[detail]
    verdicts, crowns = judged.verdicts, judged.crowns
    # The grid resolves what deforms.
    capped = stiffness == "capped"
    yields = [
        not v.rigid or (capped and not p.prescribed) for v, p in zip(verdicts, parts, strict=True)
    ]
    soft = [p for p, deforms in zip(parts, yields, strict=True) if deforms]
    cell = choose_cell(parts, soft, quality)
    # What deforms decides whether what does not is a body of its own or a frame within one.
    leafy = {parts[k].object for k in crowns}
    mixed = {p.object for p in soft} - leafy
    roles: list[Role] = [
        "crown" if k in crowns else role(p, deforms, mixed, cell)
        for k, (p, deforms) in enumerate(zip(parts, yields, strict=True))
    ]
    across = {k: object_size(soft, k)[0] / cell for k in {p.object for p in soft}}
    treatments = unslowed = [
        treat(p, v, motions[p.object], Resolved(cell, across.get(p.object, 0.0)), r)
        for p, v, r in zip(parts, verdicts, roles, strict=True)
    ]
    # Waves are slowed to what the step budget allows.
    warnings = [*unresolved(soft, cell)]
    if stiffness == "capped":
        treatments = [cap(as_contents(p), t, cell) for p, t in zip(parts, treatments, strict=True)]
        warnings.append("Stiffness is capped by the published rule: a control, not a prediction.")
    else:
        unslowed = calm_trinkets(parts, treatments, cell)
        steps = quality.steps(particles_needed(parts, cell))
        fitted = fit_budget(unslowed, cell, steps)
        treatments = fitted.treatments
        warnings.extend(fitted.warnings)
    chosen = Plan(cell=cell, treatments=tuple(treatments), warnings=tuple(warnings))
    return _Draft(chosen, unslowed)


# ------------------------------------------------------------------ rigid or not


def role(part: PartGeometry, deforms: bool, mixed: set[int], cell: float) -> Role:
    """Say how a part takes part in its object.

    Args:
        part: Which.
        deforms: Whether it would, by itself.
        mixed: Objects some part of which does.
        cell: dx [m].

    """
    if deforms:
        return "soft"
    if part.object not in mixed:
        return "rigid"
    return "trinket" if is_grain(part, cell) else "frame"


# ------------------------------------------------------------------ resolution


def object_size(parts: Sequence[PartGeometry], number: int) -> tuple[float, float]:
    """Shortest and longest side of an object [m]; its box is at least each part's, side by side."""
    sizes = [p.size for p in parts if p.object == number]
    return max(s[0] for s in sizes), max(s[2] for s in sizes)


def choose_cell(
    parts: Sequence[PartGeometry], soft: Sequence[PartGeometry], quality: Quality
) -> float:
    """Grid spacing dx [m]: the smallest deformable object resolved, the largest affordable.

    Of an object with a rigid frame its soft parts count. Where nothing deforms, all objects do.
    What is rigid and may be touched is at least a cell wide, as far as that is affordable.
    """
    seen = soft or parts
    sizes = [object_size(seen, k) for k in sorted({p.object for p in seen})]
    cell = max(
        min(min(short for short, _ in sizes) / quality.cells_across, narrowest_rigid(parts, soft)),
        max(long for _, long in sizes) / quality.cells_along,
    )
    while particles_needed(parts, cell) > quality.particles:
        cell *= 1.01
    return cell


def narrowest_rigid(parts: Sequence[PartGeometry], soft: Sequence[PartGeometry]) -> float:
    """Width of the narrowest object that is rigid all through [m]: its middle side."""
    bends = {p.object for p in soft}
    stiff = sorted({p.object for p in parts} - bends)
    widths = [max(p.size[1] for p in parts if p.object == k) for k in stiff]
    return min((w for w in widths if w > 0), default=inf)


def particles_needed(parts: Sequence[PartGeometry], cell: float) -> float:
    """Particles that the scene takes at 8 per cell [-]; a wall is at least two cells thick."""
    volume = 0.0
    for part in parts:
        thickness = part.structure.thickness
        if part.structure.kind == "shell" and thickness is not None:
            volume += part.area * max(thickness, 2 * cell)
        else:
            volume += part.volume
    return PARTICLES_PER_CELL * volume / cell**3


def unresolved(soft: Sequence[PartGeometry], cell: float) -> list[str]:
    """Warn of deformable objects that are too thin for the grid."""
    thinnest = [(object_size(soft, k)[0] / cell, k) for k in sorted({p.object for p in soft})]
    return [
        f"Object {k + 1} of the scene is only {cells:.1f} cells across: its deformation is a rough "
        "estimate. A finer detail resolves it better."
        for cells, k in thinnest
        if cells < 4
    ]


# ------------------------------------------------------------------ numbers


@dataclass(frozen=True)
class Resolved:
    """How finely an object is resolved."""

    cell: float
    """Grid spacing dx [m]."""
    across: float
    """Cells across what deforms of it [-]."""


def left_of_loss(material: Material, motion: Motion, across: float) -> float:
    """Loss factor that is left to the matter of what is struck, beside the grid's own share [-].

    Contact at nodes and transfers take a share of a blow themselves. It counts on what the material
    has to take, so that both together are what was measured.

    Args:
        material: What is struck.
        motion: Of its object.
        across: Cells across it [-].

    """
    if MENU[material.law].loose:
        return 0.0
    if motion.impact_speed == 0.0:
        return material.loss
    return max(0.0, material.loss - GRID_LOSS / max(across, FEWEST_CELLS) ** 2)


def treat(
    part: PartGeometry, verdict: Verdict, motion: Motion, resolved: Resolved, role: Role
) -> Treatment:
    """Give a part its simulated numbers: true ones, but for a thin wall and a capped bulk."""
    cell = resolved.cell
    if role == "crown":
        return crown(part, verdict, motion)
    soft = role in ("soft", "trinket")
    part = as_contents(part) if soft else part
    material, structure = part.material, part.structure
    ratio = wall_ratio(part, 2 * cell)
    stiffer, stronger, denser = wall_factors(part, ratio)
    if MENU[material.law].ductile and structure.thickness and ratio < 1:
        stiffer *= fold_factor(structure.thickness, 2 * cell, part.size[1] / 2)
    thin = rod_ratio(part, 2 * cell) if role == "soft" else 1.0
    if thin < 1:
        stiffer, stronger, denser = thin**4, thin**3, thin**2
    density = mean_density(part) * denser
    young, poisson = bounded_poisson(material.young, material.poisson)
    strong, real = material.yield_stress, material.young
    if MENU[material.law].liquid:
        young, poisson = liquid_numbers(part, motion)
        real, strong = young, sqrt(3.0) * material.yield_shear
    shell = structure.kind == "shell" and structure.thickness is not None
    loss = left_of_loss(material, motion, resolved.across) if soft else 0.0
    wave = wave_speed(young * stiffer, poisson, density, loss) if soft else 0.0
    return Treatment(
        kind=("shell" if shell else "deformable") if soft else "rigid",
        young_real=real,
        young=young * stiffer if soft else material.young,
        poisson=poisson,
        density=density,
        yield_stress=strong * stronger if soft and strong is not None else strong,
        thickness=max(structure.thickness or 0.0, 2 * cell) if shell else None,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        loss=loss,
        wave_speed=wave,
        step=stable_step(wave, motion.impact_speed, cell) if soft else inf,
        why="".join(
            (
                reason(verdict, role),
                wall_reason(part, ratio) if soft else "",
                rod_reason(thin),
                bar_reason(part, 2 * cell if soft else 0.0),
                scale_reason(part, motion),
            )
        ),
    )


def liquid_numbers(part: PartGeometry, motion: Motion) -> tuple[float, float]:
    """E [Pa] and ν [-] that a liquid's largest speed asks for: of its fall, and of its collapse."""
    collapse = fall_speed(motion.acceleration, part.size[2])
    speed = hypot(motion.impact_speed, collapse)
    return elastic_numbers(bulk_modulus(part.material.density, speed))


def crown(part: PartGeometry, verdict: Verdict, motion: Motion) -> Treatment:
    """Give foliage no stress of its own."""
    return Treatment(
        kind="foliage",
        young_real=part.material.young,
        young=0.0,
        poisson=0.0,
        density=part.material.density,
        yield_stress=None,
        thickness=None,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        wave_speed=0.0,
        step=inf,
        why=f"{SWAYS}, because {verdict.reason} and the wood stays rigid.",
    )


def reason(verdict: Verdict, role: Role) -> str:
    """Say in one sentence why a part is treated as it is."""
    return {
        "rigid": f"Rigid, because {verdict.reason}.",
        "frame": f"A rigid frame that holds what is soft around it, because {verdict.reason}.",
        "trinket": "Deformable with the rest of its object; by itself it would be rigid.",
        "soft": f"Deformable, because {verdict.reason}.",
    }[role]


def scale_reason(part: PartGeometry, motion: Motion) -> str:
    """Say where the real object, struck as fast, would be judged otherwise; "" where it would not.

    Stiffness against stress waves does not depend on size; against its own weight it does.
    """
    if part.scale == 1:
        return ""
    here, life = judge(part, motion), judge(life_sized(part), motion)
    if here.rigid == life.rigid:
        return ""
    return (
        f" At its real size, {1 / part.scale:.3g} times this one, it would be judged otherwise: "
        f"{life.reason}."
    )


def rod_reason(ratio: float) -> str:
    """Say what a thickened rod keeps."""
    if ratio >= 1:
        return ""
    return (
        f" It is simulated {1 / ratio:.3g} times as thick, with its bending stiffness (up to 10 % "
        "less where it runs askew to the grid), its strength in bending and its mass kept; "
        "stretched it is softer than in life."
    )


def bar_reason(part: PartGeometry, simulated: float) -> str:
    """Say what was assumed of a long thin part that is no known rod or tube; "" of all others.

    Args:
        part: Which.
        simulated: How thick a known rod would at least be simulated [m].

    """
    across = width(part)
    known = part.diameter > 0 or part.leaves > 0 or tube(part) > 0
    plate = part.size[1] > part.size[2] / 4 and across > 0.7 * part.size[0]
    if known or plate or not 0 < TUBE * across < part.size[2]:
        return ""
    thin = part.structure.kind != "shell" and across < simulated
    grid = "; it is simulated as thin as it is, and its bending is a rough estimate" if thin else ""
    return (
        " It is long and thin, but not one round rod or tube: whether it flexes was judged as for "
        f"a solid bar {1e3 * across:.2g} mm across{grid}."
    )


def wall_reason(part: PartGeometry, ratio: float) -> str:
    """Say what a thickened wall keeps."""
    if ratio >= 1:
        return ""
    factors = wall_factors(part, ratio)
    if factors == limp_wall(ratio):
        kept, lost = "its stiffness in its plane", "limp as it is, it bends less easily"
    else:
        dents = factors == closed_wall(ratio)
        kept = "the stiffness with which it dents" if dents else "its bending stiffness"
        lost = "in its plane it is softer"
    return (
        f" Its wall is simulated {1 / ratio:.3g} times as thick, with {kept} and its mass kept; "
        f"{lost} than in life."
    )
