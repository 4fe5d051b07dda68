"""Discretization of each part: rigid, deformable or shell, with its parameters.

One policy for all scenes (no scene can tune it): a part that would neither yield nor visibly flex is rigid, by itself
or as the inclusion of softer parts; everything else keeps its true stiffness; thin walls are thickened with the
stiffness that counts and the areal mass kept; only a step budget may compress wave speeds, in their order. What would
sag far more than in reality, as soft as thick walls and the step budget make it, is rigid after all.

Limits on the stiffness of parts that prescribed motion compresses, with warnings.

What a displacement is forced on has its shape at any stiffness, and only the force is as wrong as its stiffness. So a
part that the step budget softens stays deformable, and a warning states the factor. What would be softened out of all
proportion is hard: in reality it would stop, or break, what presses it, which prescribed motion cannot do. It is rigid,
at the cost of a rigid one, with a warning.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

from corporeal.core.types import Discretization, Material
from corporeal.discretization.effective_parameters import (
    GridResolution,
    PartRole,
    PartVerdicts,
    effective_parameters,
    judge_plants,
)
from corporeal.discretization.filled_shells import part_as_contents
from corporeal.discretization.impact_frequency import tune_loss_to_impacts
from corporeal.discretization.impact_slabs import mark_thin_floor_sheets, slabs_nearer_to_rigid
from corporeal.discretization.impact_vibration import compensate_vibration_loss
from corporeal.discretization.pair_damping import find_impact_partners
from corporeal.discretization.part_geometry import ExpectedMotion, PartGeometry, RigidityVerdict, is_grain_on_grid
from corporeal.discretization.rigidity import MAX_INVISIBLE_STRAIN, judge_rigidity
from corporeal.discretization.step_budget import (
    MIN_WAVE_SPEED_RATIO,
    cap_stiffness,
    fit_step_budget,
    parts_nearer_to_rigid,
    slow_subgrid_parts,
    walls_that_tear,
)

MIN_STIFFNESS_RATIO = 0.01
"""Least simulated over true E of what is pressed [-]: between rubber and plastics at draft."""
MIN_RIGHT_FORCE_STIFFNESS_RATIO = 0.87
"""Simulated over true E from which the force is right enough [-]: as ±15 % of a life's number."""


def too_stiff_to_compress(
    parts: Sequence[PartGeometry],
    verdicts: Sequence[RigidityVerdict],
    unslowed: Sequence[Discretization],
    slowed: Sequence[Discretization],
) -> dict[int, str]:
    """Return which part that is deformable only since it is pressed is too stiff for that, and why.

    Only the stiffest: without it, the step budget may leave the others as they are.

    Args:
        parts: All of the scene's.
        verdicts: On each.
        unslowed: Treatments before the step budget …
        slowed: … and after it.
    """
    hard = {
        k: true.wave_speed
        for k, (part, verdict, true, made) in enumerate(zip(parts, verdicts, unslowed, slowed, strict=True))
        if _only_soft_by_compression(verdict)
        and part.pressed
        and made.simulated_young_pa < MIN_STIFFNESS_RATIO * true.simulated_young_pa
    }
    if not hard:
        return {}
    k = max(hard, key=lambda number: hard[number])
    return {
        k: f"prescribed motion presses it by about {parts[k].pressed:.2g} of its thickness, "
        "and it is too stiff for that"
    }


def _only_soft_by_compression(verdict: RigidityVerdict) -> bool:
    """Return whether a part would be rigid if nothing pressed it."""
    return not verdict.rigid and verdict.pressed >= MAX_INVISIBLE_STRAIN > max(verdict.weight, verdict.impact)


def warn_of_wrong_compression(
    parts: Sequence[PartGeometry], unslowed: Sequence[Discretization], made: Sequence[Discretization]
) -> list[str]:
    """Warn where the force on what presses a part cannot be right, and say by how much."""
    messages = []
    for part, true, treatment in zip(parts, unslowed, made, strict=True):
        if part.pressed < MAX_INVISIBLE_STRAIN:
            continue
        name = f"Object {part.object + 1} of the scene"
        share = treatment.simulated_young_pa / true.simulated_young_pa if true.simulated_young_pa > 0.0 else 1.0
        if treatment.kind == "rigid":
            messages.append(
                f"{name} is pressed by about {part.pressed:.2g} of its thickness by prescribed "
                "motion, and is rigid, so the contact force cannot be right. End the path at the "
                "contact, or choose a softer material."
            )
        elif share < MIN_RIGHT_FORCE_STIFFNESS_RATIO:
            messages.append(
                f"{name} is compressed by prescribed motion and simulated {1 / share:.2g} times "
                "softer than it is: its reaction force is too small by about that factor. A finer "
                "detail has a larger step budget."
            )
    return list(dict.fromkeys(messages))


DetailLevel = Literal["draft", "normal", "fine"]
StiffnessMode = Literal["true", "capped"]
FILLED_PARTICLES_PER_CELL = 8
SHELL_VERTICES_PER_CELL_AREA = 4.6
"""Vertices of equilateral triangles with edges of half a cell, per area of a cell's face [-]."""


@dataclass(frozen=True)
class DiscretizationPlan:
    """Resolution and treatments for a whole scene."""

    cell: float
    """Grid spacing dx [m]."""
    treatments: tuple[Discretization, ...]
    """One per part."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class QualityPreset:
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
    outrun: float = MIN_WAVE_SPEED_RATIO
    """Waves run at least so many times faster than anything moves [-]."""
    cell: float | None = None
    """Grid spacing of a scene that runs, for what joins it [m]; None: it is chosen."""

    def steps(self, particles: float, pressed: bool = False) -> float:
        """Return how many steps per simulated second a scene of so many particles may take.

        Where prescribed motion presses something soft, its stiffness is the force that is asked
        for: then only the work counts, where it is counted.
        """
        affordable = max(self.work / particles, 0.4 * self.steps_per_second)
        whole = pressed and affordable < inf
        return affordable if whole else min(self.steps_per_second, affordable)


QUALITY_PRESETS: dict[str, QualityPreset] = {
    "draft": QualityPreset(8, 48, 40_000, 20e3, 3e8),
    "normal": QualityPreset(12, 96, 200_000, 60e3, 5e9),
    "fine": QualityPreset(20, 192, 1_000_000, 200e3, 1e11),
}


def plan_discretization(
    parts: Sequence[PartGeometry],
    motions: Sequence[ExpectedMotion],
    detail: DetailLevel | QualityPreset,
    stiffness: StiffnessMode = "true",
    floor: Material | None = None,
) -> DiscretizationPlan:
    """Choose the grid spacing and every part's treatment.

    Args:
        parts: All parts of the scene.
        motions: One per object.
        detail: The one knob of quality, or what it buys.
        stiffness: "capped" is the published rule, a control only.
        floor: What the floor is made of; None: it is not known.
    """
    verdicts = [judge_rigidity(part, motions[part.object]) for part in parts]
    judged = PartVerdicts(verdicts)
    if stiffness == "true":
        judged = judge_plants(parts, verdicts)
    while True:
        met = find_impact_partners(parts, motions, [v.rigid for v in judged.verdicts], floor)
        draft = _plan_with_verdicts(parts, met, judged, detail, stiffness)
        treatments = draft.plan.treatments
        why = parts_nearer_to_rigid(parts, met, judged.verdicts, draft.unslowed, treatments)
        why |= walls_that_tear(parts, judged.verdicts, treatments)
        if not why:
            why = too_stiff_to_compress(parts, judged.verdicts, draft.unslowed, treatments)
        if not why:  # first what strikes, then what is struck
            why = slabs_nearer_to_rigid(parts, motions, treatments)
        if stiffness == "capped" or not why:
            laid = mark_thin_floor_sheets(parts, motions, treatments)
            messages = (*draft.plan.warnings, *warn_of_wrong_compression(parts, draft.unslowed, laid))
            tuned = tune_loss_to_impacts(parts, motions, laid)
            return replace(draft.plan, treatments=tuned, warnings=messages)
        verdicts = [replace(v, rigid=True, reason=why[k]) if k in why else v for k, v in enumerate(judged.verdicts)]
        judged = replace(judged, verdicts=verdicts)


@dataclass(frozen=True)
class _PlanDraft:
    """A plan, and what it would be without a step budget."""

    plan: DiscretizationPlan
    unslowed: Sequence[Discretization]
    """Treatments before the step budget."""


def _plan_with_verdicts(
    parts: Sequence[PartGeometry],
    motions: Sequence[ExpectedMotion],
    judged: PartVerdicts,
    detail: DetailLevel | QualityPreset,
    stiffness: StiffnessMode,
) -> _PlanDraft:
    """Choose for given verdicts and foliage."""
    quality = detail if isinstance(detail, QualityPreset) else QUALITY_PRESETS[detail]
    verdicts, foliage_parts = judged.verdicts, judged.foliage_parts
    # The grid resolves what deforms.
    capped = stiffness == "capped"
    yields = [not v.rigid or (capped and not p.prescribed) for v, p in zip(verdicts, parts, strict=True)]
    soft = [p for p, deforms in zip(parts, yields, strict=True) if deforms]
    cell = quality.cell or choose_cell(parts, soft, quality)
    # What deforms decides whether what does not is a body of its own or an inclusion in one.
    leafy = {parts[k].object for k in foliage_parts}
    mixed = {p.object for p in soft} - leafy
    roles: list[PartRole] = [
        "foliage" if k in foliage_parts else choose_role(p, deforms, mixed, cell)
        for k, (p, deforms) in enumerate(zip(parts, yields, strict=True))
    ]
    across = {k: object_side_range(soft, k)[0] / cell for k in {p.object for p in soft}}
    treatments = unslowed = [
        effective_parameters(p, v, motions[p.object], GridResolution(cell, across.get(p.object, 0.0)), r)
        for p, v, r in zip(parts, verdicts, roles, strict=True)
    ]
    # Waves are slowed to what the step budget allows.
    warnings = [*warn_of_unresolved(soft, cell)]
    if stiffness == "capped":
        treatments = [cap_stiffness(part_as_contents(p), t, cell) for p, t in zip(parts, treatments, strict=True)]
        warnings.append("Stiffness is capped by the published rule: a control, not a prediction.")
    else:
        unslowed = slow_subgrid_parts(parts, treatments, cell)
        steps = quality.steps(particles_needed_count(parts, cell), any(p.pressed for p in soft))
        fitted = fit_step_budget(unslowed, cell, steps, quality.outrun)
        treatments = compensate_vibration_loss(parts, motions, unslowed, fitted.treatments, cell)
        warnings.extend(fitted.warnings)
    chosen = DiscretizationPlan(cell=cell, treatments=tuple(treatments), warnings=tuple(warnings))
    return _PlanDraft(chosen, unslowed)


def choose_role(part: PartGeometry, deforms: bool, mixed: set[int], cell: float) -> PartRole:
    """Return how a part takes part in its object.

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
    return "subgrid" if is_grain_on_grid(part, cell) else "inclusion"


def object_side_range(parts: Sequence[PartGeometry], number: int) -> tuple[float, float]:
    """Shortest and longest side of an object [m]; its box is at least each part's, side by side."""
    sizes = [p.size for p in parts if p.object == number]
    return max(s[0] for s in sizes), max(s[2] for s in sizes)


def choose_cell(parts: Sequence[PartGeometry], soft: Sequence[PartGeometry], quality: QualityPreset) -> float:
    """Grid spacing dx [m]: the smallest deformable object resolved, the largest affordable.

    Of an object with a rigid inclusion its soft parts count. Where nothing deforms, all objects do. What is rigid and
    may be touched is at least a cell wide, as far as that is affordable.
    """
    seen = soft or parts
    sizes = [object_side_range(seen, k) for k in sorted({p.object for p in seen})]
    cell = max(
        min(min(short for short, _ in sizes) / quality.cells_across, narrowest_rigid_width(parts, soft)),
        max(long for _, long in sizes) / quality.cells_along,
    )
    while particles_needed_count(parts, cell) > quality.particles:
        cell *= 1.01
    return cell


def narrowest_rigid_width(parts: Sequence[PartGeometry], soft: Sequence[PartGeometry]) -> float:
    """Width of the narrowest object that is rigid all through [m]: its middle side."""
    bends = {p.object for p in soft}
    stiff = sorted({p.object for p in parts} - bends)
    widths = [max(p.size[1] for p in parts if p.object == k) for k in stiff]
    return min((w for w in widths if w > 0), default=inf)


def particles_needed_count(parts: Sequence[PartGeometry], cell: float) -> float:
    """Particles that the scene takes at 8 per cell [-]; a wall is at least two cells thick."""
    volume = 0.0
    for part in parts:
        thickness = part.structure.thickness
        if part.thin_shell:
            volume += SHELL_VERTICES_PER_CELL_AREA / FILLED_PARTICLES_PER_CELL * part.area * cell
        elif part.structure.kind == "shell" and thickness is not None:
            volume += part.area * max(thickness, 2 * cell)
        else:
            volume += part.volume
    return FILLED_PARTICLES_PER_CELL * volume / cell**3


def warn_of_unresolved(soft: Sequence[PartGeometry], cell: float) -> list[str]:
    """Warn of deformable objects that are too thin for the grid."""
    thinnest = [(object_side_range(soft, k)[0] / cell, k) for k in sorted({p.object for p in soft})]
    return [
        f"Object {k + 1} of the scene is only {cells:.1f} cells across: its deformation is a rough "
        "estimate. A finer detail resolves it better."
        for cells, k in thinnest
        if cells < 4
    ]
