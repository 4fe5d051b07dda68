"""Energy lost to vibration in hard impacts of balls, subtracted from the material's loss.

Loss factor and restitution are equivalent in hereditary Hertz contact (``materials.rebound``), which holds where an
impact is slow against the waves in the ball. An impact of ρ v²/E = 0.1 dents it by two thirds of its radius and leaves
it vibrating, and it comes back as if its loss factor were larger by 0.09. A solid ball does that in reality, too, and
there is nothing to mend where it is as stiff here. It is too much

- where the step budget has softened it: what it loses here beyond what it does in reality is taken off
  its loss factor;
- where it stands for a wall with air behind it, whose loss factor was made from its rebound, or is that of the wall:
  the solid rings instead of them.
"""

from collections.abc import Sequence
from dataclasses import replace

from corporeal.core.types import Discretization
from corporeal.discretization.filled_shells import part_as_contents
from corporeal.discretization.part_geometry import ExpectedMotion, PartGeometry
from corporeal.discretization.step_budget import is_dented_by_impact, wave_speed
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.time_step_limits import stable_step

VIBRATION_LOSS_COEFFICIENT = 0.87
"""Loss factor that vibrations take of an impact, over ρ v²/E [-]: measured on balls of 8 to 20 cells, ρ v²/E of 0.001
to 0.1, ν of 0.2 and 0.41, loss factors from 0.05 to 0.4 (decision discretize-rigid-parts).
"""
MAX_IMPACT_NUMBER = 0.1
"""ρ v²/E up to which it was measured [-]; what is struck harder counts as struck so."""
MIN_NOTABLE_LOSS_FACTOR = 0.005
"""A smaller loss factor changes no rebound that can be measured [-]."""


def vibration_loss(density: float, speed: float, young_pa: float) -> float:
    """Loss factor [-] that a ball's vibrations take of an impact on a rigid plane.

    Args:
        density: [kg/m³]
        speed: [m/s]
        young_pa: E, resisted slowly [Pa].
    """
    return VIBRATION_LOSS_COEFFICIENT * min(density * speed**2 / young_pa, MAX_IMPACT_NUMBER)


def compensate_vibration_loss(
    parts: Sequence[PartGeometry],
    motions: Sequence[ExpectedMotion],
    unslowed: Sequence[Discretization],
    slowed: Sequence[Discretization],
    cell: float,
) -> list[Discretization]:
    """Take off the loss factors of balls what they lose here, and not in reality, by vibrating.

    Those are compact, elastic and fall on the floor or on something rigid; with what is soft
    itself an impact is slower, and what yields does not vibrate. No loss factor is below 0.

    Args:
        parts: All of the scene's.
        motions: One per object.
        unslowed: Treatments before the step budget …
        slowed: … and after it.
        cell: dx [m].
    """
    soft = {p.object for p, t in zip(parts, slowed, strict=True) if t.wave_speed > 0.0}
    found = []
    for part, true, made in zip(parts, unslowed, slowed, strict=True):
        lands = motions[part.object].landing
        if lands is not None and lands.speed > 0.0 and lands.onto not in soft:
            if _is_elastic_ball(part, made):
                made = _lower_loss_factor(made, _excess_vibration_loss(part, true, made, lands.speed), cell)
        found.append(made)
    return found


def _is_elastic_ball(part: PartGeometry, made: Discretization) -> bool:
    """Return whether a part is a soft compact solid, or is simulated as one, and is elastic."""
    law = CONSTITUTIVE_LAWS[part_as_contents(part).material.law]
    elastic = not law.loose and not made.yield_stress
    return made.kind == "deformable" and elastic and is_dented_by_impact(part) and made.loss > 0.0


def _excess_vibration_loss(part: PartGeometry, true: Discretization, made: Discretization, speed: float) -> float:
    """Loss factor [-] that vibrations take beyond those of life."""
    here = vibration_loss(made.density, speed, made.simulated_young_pa)
    if part.structure.inflated:
        return here
    return here - vibration_loss(true.density, speed, true.simulated_young_pa)


def _lower_loss_factor(made: Discretization, excess: float, cell: float) -> Discretization:
    """Lower a loss factor, and the speed of waves with it, and say so."""
    taken = min(excess, made.loss)
    if taken < MIN_NOTABLE_LOSS_FACTOR:
        return made
    loss = made.loss - taken
    wave = wave_speed(made.simulated_young_pa, made.poisson, made.density, loss)
    return replace(
        made,
        loss=loss,
        wave_speed=wave,
        step=stable_step(wave, made.impact_speed, cell),
        reason=f"{made.reason} Its simulated vibrations in a hard impact dissipate as much as a loss "
        f"factor of {taken:.2g}, beyond those of the real object: its loss factor is reduced by "
        "that.",
    )
