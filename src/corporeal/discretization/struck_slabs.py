"""Slabs and sheets on the floor that would be dented much too deeply.

A ball that is dented more than twice as deep as in life is rigid instead (``step_budget``). So is a
slab that lies on the floor and is softened by the step budget, and a flat sheet that the grid makes
thicker, where what falls on it is rigid: what it loses then depends on the grid, and rounds of
impacts know that the floor holds it, so that both rebound by their coefficient of restitution. A
sheet thinner than half a cell, as of paper, is so whatever falls on it: it would be a mattress of
two cells between a ball and the floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from corporeal.core.types import Treatment
from corporeal.discretization.blow_frequency import compliance
from corporeal.discretization.dents import dent_of_layer
from corporeal.discretization.falls import FLOOR
from corporeal.discretization.lossy_partners import largest_of
from corporeal.discretization.part import COMPACT, Landing, Motion, PartGeometry, is_flat_wall
from corporeal.materials.blow import compliance_of
from corporeal.mpm.laws import MENU

TOO_DEEP = 2.0
"""Dent as simulated over that of life, from which rigid is nearer to the truth [-]."""
THICKEST = 4.0
"""Thickness of a sheet as simulated, two cells at least, over that of life, up to which it is a mat
to what is soft and falls on it [-]; one that is thinner than half a cell is nothing of its own."""


def pressed_slabs(
    parts: Sequence[PartGeometry], motions: Sequence[Motion], treatments: Sequence[Treatment]
) -> dict[int, str]:
    """Say which slabs and sheets on the floor are nearer to life as rigid ones.

    Args:
        parts: All of the scene's.
        motions: One per object.
        treatments: As they are simulated.

    Returns:
        Number of the part → why, in a clause.

    """
    found = {}
    for k, (part, treatment) in enumerate(zip(parts, treatments, strict=True)):
        alone = sum(p.object == part.object for p in parts) == 1
        if not (alone and _lies_flat(part, motions[part.object], treatment)):
            continue
        for number, motion in enumerate(motions):
            lands = motion.landing
            if lands is None or lands.onto != part.object or lands.energy <= 0.0:
                continue
            ball = largest_of(parts, number)
            beside = treatments[parts.index(ball)]
            if beside.kind != "rigid" and _is_mat(part, treatment):
                continue
            dents = _Dents(
                _dent(
                    ball,
                    lands,
                    compliance_of(part.material) + compliance_of(ball.material),
                    _thickness(part),
                ),
                _dent(
                    ball,
                    lands,
                    compliance(treatment) + compliance(beside),
                    treatment.thickness or part.size[0],
                ),
            )
            if dents.simulated > TOO_DEEP * dents.life:
                found[k] = _why(lands.speed, dents)
    return found


def laid_sheets(
    parts: Sequence[PartGeometry], motions: Sequence[Motion], treatments: Sequence[Treatment]
) -> tuple[Treatment, ...]:
    """Mark rigid flat sheets on the floor that are thinner than half a cell.

    A tenth of a millimetre of paper stores nothing of a blow, and the next step may lead through it
    to the floor: what it is made of says nothing of the rebound.

    Args:
        parts: All of the scene's.
        motions: One per object.
        treatments: As they are simulated.

    """
    return tuple(
        replace(treatment, laid=True)
        if treatment.kind == "rigid"
        and is_flat_wall(part)
        and _rests(motions[part.object])
        and not _is_mat(part, treatment)
        else treatment
        for part, treatment in zip(parts, treatments, strict=True)
    )


def _thickness(part: PartGeometry) -> float:
    """Thickness in life [m]."""
    wall = part.structure.thickness if is_flat_wall(part) else None
    return wall or part.size[0]


@dataclass(frozen=True)
class _Dents:
    """How much nearer a ball and a slab draw [m]."""

    life: float
    simulated: float


def _lies_flat(part: PartGeometry, motion: Motion, treatment: Treatment) -> bool:
    slab = treatment.kind == "deformable" and part.size[0] < COMPACT * part.size[1]
    sheet = treatment.kind == "shell" and is_flat_wall(part)
    flows = MENU[part.material.law].loose
    return _rests(motion) and (slab or sheet) and part.leaves == 0 and not flows


def _rests(motion: Motion) -> bool:
    """Tell whether an object lies on the floor, and nothing but gravity acts on it."""
    lands = motion.landing
    lies = lands is not None and lands.onto == FLOOR and lands.speed == 0.0
    return lies and motion.driven == 0.0


def _is_mat(part: PartGeometry, treatment: Treatment) -> bool:
    """Tell whether a part is a sheet that is at least half a cell thick."""
    resolved = (treatment.thickness or 0.0) <= THICKEST * _thickness(part)
    return is_flat_wall(part) and resolved


def _dent(ball: PartGeometry, lands: Landing, plane: float, thick: float) -> float:
    return dent_of_layer(lands.mass, 0.5 * ball.size[1], lands.speed, 1.0 / plane, thick)


def _why(speed: float, dents: _Dents) -> str:
    return (
        f"a blow at {speed:.2g} m/s would press it in by {1e3 * dents.life:.2g} mm, and as soft as "
        f"the grid and the step budget would make it, by {1e3 * dents.simulated:.2g}; the floor "
        "holds it, and what strikes it rebounds by the coefficient of restitution of both"
    )
