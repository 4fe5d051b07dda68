"""How each part enters the simulation: rigid, deformable or shell, and with which numbers.

One policy for all scenes (no scene can tune it): a part that would neither yield nor visibly flex
is rigid, by itself or as the frame of softer parts; everything else keeps its true stiffness; thin
walls are thickened with the stiffness that counts and the areal mass kept; only a step budget may
compress wave speeds, in their order. What would sag far more than in life, as soft as thick walls
and the step budget make it, is rigid after all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

from corporeal.core.types import Material, Treatment
from corporeal.discretization.blow_frequency import tuned_to_blows
from corporeal.discretization.crown_of_leaves import Judgements, with_plants
from corporeal.discretization.filled import as_contents
from corporeal.discretization.hard_blows import calmed
from corporeal.discretization.lossy_partners import with_partners
from corporeal.discretization.part import (
    Motion,
    PartGeometry,
    is_grain,
)
from corporeal.discretization.pressed_parts import pressed_wrongly, unyielding
from corporeal.discretization.rigidity import judge
from corporeal.discretization.step_budget import (
    OUTRUN,
    calm_trinkets,
    cap,
    fit_budget,
    nearer_rigid,
    torn_walls,
)
from corporeal.discretization.struck_slabs import laid_sheets, pressed_slabs
from corporeal.discretization.treat import Resolved, Role, treat

Detail = Literal["draft", "normal", "fine"]
Stiffness = Literal["true", "capped"]
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
    outrun: float = OUTRUN
    """Waves run at least so many times faster than anything moves [-]."""
    cell: float | None = None
    """Grid spacing of a scene that runs, for what joins it [m]; None: it is chosen."""

    def steps(self, particles: float, pressed: bool = False) -> float:
        """Say how many steps per simulated second a scene of so many particles may take.

        Where prescribed motion presses something soft, its stiffness is the force that is asked
        for: then only the work counts, where it is counted.
        """
        affordable = max(self.work / particles, 0.4 * self.steps_per_second)
        whole = pressed and affordable < inf
        return affordable if whole else min(self.steps_per_second, affordable)


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
    floor: Material | None = None,
) -> Plan:
    """Choose the grid spacing and every part's treatment.

    Args:
        parts: All parts of the scene.
        motions: One per object.
        detail: The one knob of quality, or what it buys.
        stiffness: "capped" is the published rule, a control only.
        floor: What the floor is made of; None: it is not known.

    """
    verdicts = [judge(part, motions[part.object]) for part in parts]
    judged = Judgements(verdicts)
    if stiffness == "true":
        judged = with_plants(parts, verdicts)
    while True:
        met = with_partners(parts, motions, [v.rigid for v in judged.verdicts], floor)
        draft = _plan(parts, met, judged, detail, stiffness)
        treatments = draft.plan.treatments
        why = nearer_rigid(parts, met, judged.verdicts, draft.unslowed, treatments)
        why |= torn_walls(parts, judged.verdicts, treatments)
        if not why:
            why = unyielding(parts, judged.verdicts, draft.unslowed, treatments)
        if not why:  # first what strikes, then what is struck
            why = pressed_slabs(parts, motions, treatments)
        if stiffness == "capped" or not why:
            laid = laid_sheets(parts, motions, treatments)
            told = (*draft.plan.warnings, *pressed_wrongly(parts, draft.unslowed, laid))
            tuned = tuned_to_blows(parts, motions, laid)
            return replace(draft.plan, treatments=tuned, warnings=told)
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
    cell = quality.cell or choose_cell(parts, soft, quality)
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
        steps = quality.steps(particles_needed(parts, cell), any(p.pressed for p in soft))
        fitted = fit_budget(unslowed, cell, steps, quality.outrun)
        treatments = calmed(parts, motions, unslowed, fitted.treatments, cell)
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
