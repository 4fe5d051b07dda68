"""Slabs and sheets on the floor that would be indented much too deeply.

A ball that is dented more than twice as deep as in reality is rigid instead (``step_budget``). So is a slab that lies
on the floor and is softened by the step budget, and a flat sheet that the grid makes thicker, where what falls on it is
rigid: what it loses then depends on the grid, and rounds of impacts know that the floor holds it, so that both rebound
by their coefficient of restitution. A sheet thinner than half a cell, as of paper, is so whatever falls on it: it would
be a mattress of two cells between a ball and the floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from corporeal.core.types import Discretization
from corporeal.discretization.hertz_indentation import hertz_dent_of_layer
from corporeal.discretization.impact_frequency import impact_compliance
from corporeal.discretization.impact_speeds import FLOOR_NUMBER
from corporeal.discretization.pair_damping import largest_part_of
from corporeal.discretization.part_geometry import (
    MIN_COMPACT_SIDE_RATIO,
    ExpectedMotion,
    ObjectLanding,
    PartGeometry,
    is_flat_wall,
)
from corporeal.materials.restitution_speed import plane_strain_compliance
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

MAX_DENT_RATIO = 2.0
"""Dent as simulated over that of life, from which rigid is nearer to the truth [-]."""
MAX_MAT_THICKNESS_RATIO = 4.0
"""Thickness of a sheet as simulated, two cells at least, over that of life, up to which it is a mat to what is soft and
falls on it [-]; one that is thinner than half a cell is nothing of its own."""


def slabs_nearer_to_rigid(
    parts: Sequence[PartGeometry], motions: Sequence[ExpectedMotion], treatments: Sequence[Discretization]
) -> dict[int, str]:
    """Return which slabs and sheets on the floor are nearer to life as rigid ones.

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
            ball = largest_part_of(parts, number)
            beside = treatments[parts.index(ball)]
            if beside.kind != "rigid" and _is_simulated_mat(part, treatment):
                continue
            dents = _SlabDents(
                _slab_dent(
                    ball,
                    lands,
                    plane_strain_compliance(part.material) + plane_strain_compliance(ball.material),
                    _real_thickness(part),
                ),
                _slab_dent(
                    ball,
                    lands,
                    impact_compliance(treatment) + impact_compliance(beside),
                    treatment.thickness or part.size[0],
                ),
            )
            if dents.simulated > MAX_DENT_RATIO * dents.life:
                found[k] = _dent_reason(lands.speed, dents)
    return found


def mark_thin_floor_sheets(
    parts: Sequence[PartGeometry], motions: Sequence[ExpectedMotion], treatments: Sequence[Discretization]
) -> tuple[Discretization, ...]:
    """Mark rigid flat sheets on the floor that are thinner than half a cell.

    A tenth of a millimetre of paper stores nothing of an impact, and the next step may lead through it to the floor:
    what it is made of says nothing of the rebound.
    """
    return tuple(
        replace(treatment, is_floor_covering=True)
        if treatment.kind == "rigid"
        and is_flat_wall(part)
        and _rests_on_floor(motions[part.object])
        and not _is_simulated_mat(part, treatment)
        else treatment
        for part, treatment in zip(parts, treatments, strict=True)
    )


def _real_thickness(part: PartGeometry) -> float:
    """Thickness in reality [m]."""
    wall = part.structure.thickness if is_flat_wall(part) else None
    return wall or part.size[0]


@dataclass(frozen=True)
class _SlabDents:
    """How much nearer a ball and a slab draw [m]."""

    life: float
    simulated: float


def _lies_flat(part: PartGeometry, motion: ExpectedMotion, treatment: Discretization) -> bool:
    slab = treatment.kind == "deformable" and part.size[0] < MIN_COMPACT_SIDE_RATIO * part.size[1]
    sheet = treatment.kind == "shell" and is_flat_wall(part)
    flows = CONSTITUTIVE_LAWS[part.material.law].loose
    return _rests_on_floor(motion) and (slab or sheet) and part.leaves == 0 and not flows


def _rests_on_floor(motion: ExpectedMotion) -> bool:
    """Return whether an object lies on the floor, and nothing but gravity acts on it."""
    lands = motion.landing
    lies = lands is not None and lands.onto == FLOOR_NUMBER and lands.speed == 0.0
    return lies and motion.driven == 0.0


def _is_simulated_mat(part: PartGeometry, treatment: Discretization) -> bool:
    """Return whether a part is a sheet that is at least half a cell thick."""
    resolved = (treatment.thickness or 0.0) <= MAX_MAT_THICKNESS_RATIO * _real_thickness(part)
    return is_flat_wall(part) and resolved


def _slab_dent(ball: PartGeometry, lands: ObjectLanding, plane: float, thick: float) -> float:
    return hertz_dent_of_layer(lands.mass, 0.5 * ball.size[1], lands.speed, 1.0 / plane, thick)


def _dent_reason(speed: float, dents: _SlabDents) -> str:
    return (
        f"an impact at {speed:.2g} m/s would press it in by {1e3 * dents.life:.2g} mm, and as soft "
        "as "
        f"the grid and the step budget would make it, by {1e3 * dents.simulated:.2g}; the floor "
        "holds it, and what strikes it rebounds by the coefficient of restitution of both"
    )
