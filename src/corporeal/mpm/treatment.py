"""How each part enters the simulation: rigid, deformable or shell, and with which numbers.

One policy for all scenes (no scene can tune it): a part that would neither yield nor visibly flex
is rigid; everything else keeps its true stiffness; thin walls are thickened with the stiffness
that counts and the areal mass kept; only a step budget may compress wave speeds, in their order.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Literal

from corporeal.mpm.stability import (
    COURANT,
    bounded_poisson,
    capped_young,
    closed_wall,
    compress_speed,
    fold_factor,
    p_wave_speed,
    stable_step,
    thin_wall,
    yield_speed,
)
from corporeal.types import Law, Material, Structure, Treatment

Detail = Literal["draft", "normal", "fine"]
Stiffness = Literal["true", "capped"]

INVISIBLE_STRAIN = 5e-3
"""Half a percent of strain is not seen."""

PARTICLES_PER_CELL = 8

TRINKET_CELLS, TRINKET_LENGTH = 8.0, 5.0
"""A part of fewer cells than the first, and nowhere longer than the second [cells], is a trinket:
its own stiffness cannot be seen."""


@dataclass(frozen=True)
class PartGeometry:
    """What the policy needs to know of one part."""

    object: int
    """Which object it belongs to."""
    material: Material
    structure: Structure
    size: tuple[float, float, float]
    """Extents of its bounding box, shortest first [m]."""
    volume: float
    """Enclosed volume [m³]."""
    area: float
    """Surface area, one side [m²]."""
    closed: bool = False
    """Whether its wall goes all around something, as a duck's does and a vase's does not."""


@dataclass(frozen=True)
class Motion:
    """What is about to happen to one object."""

    impact_speed: float
    """Estimated speed at impact: fall, own velocity, push, and others' speed [m/s]."""
    acceleration: float
    """Largest acceleration: gravity and push [m/s²]."""


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
        return min(self.steps_per_second, max(self.work / particles, 0.4 * self.steps_per_second))


QUALITIES: dict[str, Quality] = {
    "draft": Quality(8, 48, 40_000, 20e3, 3e8),
    "normal": Quality(12, 96, 200_000, 60e3, 5e9),
    "fine": Quality(20, 192, 1_000_000, 200e3, 1e11),
}


@dataclass(frozen=True)
class Verdict:
    """Whether one part, by itself, would be seen to change its shape."""

    strain: float
    """Largest strain expected [-]."""
    yield_speed: float
    """[m/s]"""
    rigid: bool
    reason: str


def plan(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    detail: Detail,
    stiffness: Stiffness = "true",
) -> Plan:
    """Choose the grid spacing and every part's treatment.

    Args:
        parts: All parts of the scene.
        motions: One per object.
        detail: The one knob of quality.
        stiffness: "capped" is the published rule, a control only.

    """
    quality = QUALITIES[detail]
    verdicts = [judge(part, motions[part.object]) for part in parts]
    soft = {p.object for p, v in zip(parts, verdicts, strict=True) if not v.rigid}
    if stiffness == "capped":
        soft = {p.object for p in parts}
    cell = choose_cell(parts, soft, quality)
    treatments = [
        treat(p, v, motions[p.object], cell, p.object in soft)
        for p, v in zip(parts, verdicts, strict=True)
    ]
    warnings = [*unresolved(parts, soft, cell)]
    if stiffness == "capped":
        treatments = [cap(p, t, cell) for p, t in zip(parts, treatments, strict=True)]
        warnings.append("Stiffness is capped by the published rule: a control, not a prediction.")
    else:
        treatments = calm_trinkets(parts, treatments, cell)
        steps = quality.steps(particles_needed(parts, cell))
        treatments, compressed = fit_budget(treatments, cell, steps)
        warnings.extend(compressed)
    return Plan(cell=cell, treatments=tuple(treatments), warnings=tuple(warnings))


# ------------------------------------------------------------------ rigid or not


def judge(part: PartGeometry, motion: Motion) -> Verdict:
    """Say whether a part would yield or visibly flex.

    ε = max(v/c, ρ a L/E, tip shift of a cantilever / L) and v_y = σ_y/(ρ c); rigid when ε is below
    half a percent and v below v_y. A thin wall is judged by its mapped values at a tenth of the
    part's width, which is the wall the finest detail would simulate: so the verdict depends neither
    on the detail nor on what else is in the scene.
    """
    material, speed = part.material, motion.impact_speed
    young, poisson = bounded_poisson(material.young, material.poisson)
    density = material.density
    stiffer, _, denser = wall_factors(part, wall_ratio(part, width(part) / 10))
    real = p_wave_speed(young, poisson, density)
    mapped = stiffer / denser
    strain = max(
        speed / (real * sqrt(mapped)),
        density * motion.acceleration * part.size[2] / (young * mapped),
        sag(part, motion.acceleration),
    )
    yields_at = yield_speed(resistance(material), real, density)
    rigid = strain < INVISIBLE_STRAIN and speed < yields_at
    return Verdict(strain, yields_at, rigid, explain(strain, speed, yields_at))


def explain(strain: float, speed: float, yields_at: float) -> str:
    """Give the verdict in words."""
    if strain >= INVISIBLE_STRAIN:
        return f"it would visibly flex: a strain of about {strain:.2g} is expected"
    if speed >= yields_at:
        return f"it would yield: {speed:.2g} m/s exceeds its yield speed of {yields_at:.2g} m/s"
    return f"it would neither yield nor visibly flex: a strain of about {strain:.1g} is expected"


def resistance(material: Material) -> float | None:
    """Stress [Pa] that the material bears before it flows; None: it does not flow."""
    if material.law is Law.DRUCKER_PRAGER:
        return material.cohesion or 0.0
    return material.yield_stress


def width(part: PartGeometry) -> float:
    """How wide the part is across [m]: its shortest side, or less where it is bent or branched.

    6 V/A is the side of the cube (the diameter of the sphere) with the part's volume per area; it
    says nothing when the mesh models the wall itself, inside and outside.
    """
    spread = 6 * part.volume / part.area if part.area > 0 else 0.0
    thickness = part.structure.thickness or 0.0
    wall_only = part.structure.kind == "shell" and spread < 4 * thickness
    return part.size[0] if wall_only or spread <= 0 else min(part.size[0], spread)


def wall_ratio(part: PartGeometry, simulated: float) -> float:
    """Give r = t / t_num of a wall that is simulated at least ``simulated`` thick [m]; else 1."""
    thickness = part.structure.thickness
    if part.structure.kind != "shell" or thickness is None:
        return 1.0
    return min(1.0, thickness / simulated)


def wall_factors(part: PartGeometry, ratio: float) -> tuple[float, float, float]:
    """Factors on (E, σ_y, ρ) of a part's wall, by how it gives way.

    A closed wall that does not flow answers by its indentation stiffness; an open one bends; and
    what flows (a can) folds along plastic hinges.
    """
    elastic = part.material.law not in (Law.VON_MISES, Law.DRUCKER_PRAGER)
    return closed_wall(ratio) if part.closed and elastic else thin_wall(ratio)


def sag(part: PartGeometry, acceleration: float) -> float:
    """Tip shift over length of the part as a cantilever in a uniform acceleration [-].

    δ/L = (3 ρ a L² / 2 E h) (L / h) for a solid bar of depth h (Euler–Bernoulli). A tube bends
    less, so the estimate is on the safe side for it.
    """
    length, depth = part.size[2], 2 / 3 * width(part)
    if depth <= 0 or length < 4 * depth:
        return 0.0
    density, young = part.material.density, part.material.young
    return 1.5 * density * acceleration * length**3 / (young * depth**2)


# ------------------------------------------------------------------ resolution


def object_size(parts: Sequence[PartGeometry], number: int) -> tuple[float, float]:
    """Shortest and longest side of an object [m]; its box is at least each part's, side by side."""
    sizes = [p.size for p in parts if p.object == number]
    return max(s[0] for s in sizes), max(s[2] for s in sizes)


def choose_cell(parts: Sequence[PartGeometry], soft: set[int], quality: Quality) -> float:
    """Grid spacing dx [m]: the smallest deformable object resolved, the largest affordable.

    Where nothing deforms, all objects count.
    """
    sizes = [object_size(parts, k) for k in sorted(soft or {p.object for p in parts})]
    cell = max(
        min(short for short, _ in sizes) / quality.cells_across,
        max(long for _, long in sizes) / quality.cells_along,
    )
    while particles_needed(parts, cell) > quality.particles:
        cell *= 1.01
    return cell


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


def unresolved(parts: Sequence[PartGeometry], soft: set[int], cell: float) -> list[str]:
    """Warn of deformable objects that are too thin for the grid."""
    thinnest = [(object_size(parts, k)[0] / cell, k) for k in sorted(soft)]
    return [
        f"Object {k + 1} of the scene is only {cells:.1f} cells across: its deformation is a rough "
        "estimate. A finer detail resolves it better."
        for cells, k in thinnest
        if cells < 4
    ]


# ------------------------------------------------------------------ numbers


def treat(
    part: PartGeometry, verdict: Verdict, motion: Motion, cell: float, soft: bool
) -> Treatment:
    """Give a part its simulated numbers: true ones, but for a thin wall and a capped bulk."""
    material, structure = part.material, part.structure
    ratio = wall_ratio(part, 2 * cell)
    stiffer, stronger, denser = wall_factors(part, ratio)
    if material.law is Law.VON_MISES and structure.thickness and ratio < 1:
        stiffer *= fold_factor(structure.thickness, 2 * cell, part.size[1] / 2)
    young, poisson = bounded_poisson(material.young, material.poisson)
    density = material.density * denser
    strong = material.yield_stress
    shell = structure.kind == "shell" and structure.thickness is not None
    wave = p_wave_speed(young * stiffer, poisson, density) if soft else 0.0
    return Treatment(
        kind=("shell" if shell else "deformable") if soft else "rigid",
        young_real=material.young,
        young=young * stiffer if soft else material.young,
        poisson=poisson,
        density=density,
        yield_stress=strong * stronger if soft and strong is not None else strong,
        thickness=max(structure.thickness or 0.0, 2 * cell) if shell else None,
        strain=verdict.strain,
        impact_speed=motion.impact_speed,
        wave_speed=wave,
        step=stable_step(wave, motion.impact_speed, cell) if soft else inf,
        why=reason(verdict, soft) + (wall_reason(part, ratio) if soft else ""),
    )


def reason(verdict: Verdict, soft: bool) -> str:
    """Say in one or two sentences why a part is treated as it is."""
    if not soft:
        return f"Rigid, because {verdict.reason}."
    if verdict.rigid:
        text = "Deformable with the rest of its object; by itself it would be rigid."
    else:
        text = f"Deformable, because {verdict.reason}."
    return text


def wall_reason(part: PartGeometry, ratio: float) -> str:
    """Say what a thickened wall keeps."""
    if ratio >= 1:
        return ""
    dents = wall_factors(part, ratio) == closed_wall(ratio)
    kept = "the stiffness with which it dents" if dents else "its bending stiffness"
    return (
        f" Its wall is simulated {1 / ratio:.3g} times as thick, with {kept} and its mass kept; "
        "in its plane it is softer than in life."
    )


def calm_trinkets(
    parts: Sequence[PartGeometry], treatments: Sequence[Treatment], cell: float
) -> list[Treatment]:
    """Give parts that the grid cannot show the stiffness of the fastest part that they sit on.

    A can's tab or a duck's eye would otherwise set the time step of the whole scene.
    """
    small = [
        p.volume < TRINKET_CELLS * cell**3 and p.size[2] < TRINKET_LENGTH * cell for p in parts
    ]
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
    """Compress wave speeds where the step budget would be exceeded; their order is kept.

    σ_y falls with √(E_sim/E), which keeps the impact speed at which a part yields.
    """
    fastest = max((t.wave_speed for t in treatments), default=0.0)
    motion = max((t.impact_speed for t in treatments), default=0.0)
    # A wave must outrun what moves by far, whatever the budget.
    limit = max(COURANT * cell * steps - motion, 10 * motion)
    if fastest <= limit:
        return list(treatments), []
    because = "The step budget slows its waves"
    fitted = [
        compress(t, compress_speed(t.wave_speed, fastest, limit), cell, because) for t in treatments
    ]
    changed = sum(a.young != b.young for a, b in zip(treatments, fitted, strict=True))
    return fitted, [
        f"{changed} of {len(fitted)} parts are simulated softer than they are, to stay within "
        f"{steps:,.0f} steps per second; the order of stiffness is kept. "
        "A finer detail has a larger budget."
    ]


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
