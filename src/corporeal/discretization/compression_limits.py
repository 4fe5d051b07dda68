"""Limits on the stiffness of parts that prescribed motion compresses, with warnings.

What a displacement is forced on has its shape at any stiffness, and only the force is as wrong as
its stiffness. So a part that the step budget softens stays deformable, and the factor is said. What
would be softened out of all proportion is hard: in reality it would stop, or break, what presses
it, which prescribed motion cannot do. It is rigid, at the cost of a rigid one, and that is said.
"""

from collections.abc import Sequence

from corporeal.core.types import Discretization
from corporeal.discretization.part_geometry import PartGeometry, RigidityVerdict
from corporeal.discretization.rigidity import MAX_INVISIBLE_STRAIN

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
        for k, (part, verdict, true, made) in enumerate(
            zip(parts, verdicts, unslowed, slowed, strict=True)
        )
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
    return not verdict.rigid and verdict.pressed >= MAX_INVISIBLE_STRAIN > max(
        verdict.weight, verdict.impact
    )


def warn_of_wrong_compression(
    parts: Sequence[PartGeometry],
    unslowed: Sequence[Discretization],
    made: Sequence[Discretization],
) -> list[str]:
    """Warn where the force on what presses a part cannot be right, and say by how much.

    Args:
        parts: All of the scene's.
        unslowed: Treatments before the step budget.
        made: As they are simulated.

    """
    told = []
    for part, true, treatment in zip(parts, unslowed, made, strict=True):
        if part.pressed < MAX_INVISIBLE_STRAIN:
            continue
        name = f"Object {part.object + 1} of the scene"
        share = (
            treatment.simulated_young_pa / true.simulated_young_pa
            if true.simulated_young_pa > 0.0
            else 1.0
        )
        if treatment.kind == "rigid":
            told.append(
                f"{name} is pressed by about {part.pressed:.2g} of its thickness by prescribed "
                "motion, and is rigid, so the contact force cannot be right. End the path at the "
                "contact, or choose a softer material."
            )
        elif share < MIN_RIGHT_FORCE_STIFFNESS_RATIO:
            told.append(
                f"{name} is compressed by prescribed motion and simulated {1 / share:.2g} times "
                "softer than it is: its reaction force is too small by about that factor. A finer "
                "detail has a larger step budget."
            )
    return list(dict.fromkeys(told))
