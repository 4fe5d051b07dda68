"""A ball that is struck hard vibrates: what that takes of a blow, its matter has not to lose.

Loss factors and rebounds are one thing by hereditary Hertz contact (``materials.rebound``), which
holds where a blow is slow against the waves in the ball. A blow of ρ v²/E = 0.1 dents it by two
thirds of its radius and leaves it vibrating, and it comes back as if its loss factor were larger by
0.09. A solid ball does that in life, too, and there is nothing to mend where it is as stiff here.
It is too much

- where the step budget has softened it: what it loses here beyond what it does in life is taken off
  its loss factor;
- where it stands for a wall with air behind it, whose loss factor was made from its rebound, or is
  that of the wall: the solid rings instead of them.
"""

from collections.abc import Sequence
from dataclasses import replace

from corporeal.core.types import Treatment
from corporeal.discretization.filled import as_contents
from corporeal.discretization.part import Motion, PartGeometry
from corporeal.discretization.step_budget import is_compact, wave_speed
from corporeal.mpm.laws import MENU
from corporeal.mpm.physics.stability import stable_step

RINGING = 0.87
"""Loss factor that vibrations take of a blow, over ρ v²/E [-]: measured on balls of 8 to 20 cells,
ρ v²/E of 0.001 to 0.1, ν of 0.2 and 0.41, loss factors from 0.05 to 0.4 (decision 103)."""
HARDEST = 0.1
"""ρ v²/E up to which it was measured [-]; what is struck harder counts as struck so."""
LEAST = 0.005
"""A smaller loss factor changes no rebound that can be measured [-]."""


def ringing(density: float, speed: float, young: float) -> float:
    """Loss factor [-] that a ball's vibrations take of a blow on a rigid plane.

    Args:
        density: [kg/m³]
        speed: [m/s]
        young: E, resisted slowly [Pa].

    """
    return RINGING * min(density * speed**2 / young, HARDEST)


def calmed(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    unslowed: Sequence[Treatment],
    slowed: Sequence[Treatment],
    cell: float,
) -> list[Treatment]:
    """Take off the loss factors of balls what they lose here, and not in life, by vibrating.

    Those are compact, elastic and fall on the floor or on something rigid; with what is soft
    itself a blow is slower, and what yields does not vibrate. No loss factor is below 0.

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
            if _bounces(part, made):
                made = _less_lossy(made, _excess(part, true, made, lands.speed), cell)
        found.append(made)
    return found


def _bounces(part: PartGeometry, made: Treatment) -> bool:
    """Tell whether a part is a soft compact solid, or is simulated as one, and is elastic."""
    law = MENU[as_contents(part).material.law]
    elastic = not law.loose and not made.yield_stress
    return made.kind == "deformable" and elastic and is_compact(part) and made.loss > 0.0


def _excess(part: PartGeometry, true: Treatment, made: Treatment, speed: float) -> float:
    """Loss factor [-] that vibrations take beyond those of life."""
    here = ringing(made.density, speed, made.young)
    if part.structure.inflated:
        return here
    return here - ringing(true.density, speed, true.young)


def _less_lossy(made: Treatment, excess: float, cell: float) -> Treatment:
    """Lower a loss factor, and the speed of waves with it, and say so."""
    taken = min(excess, made.loss)
    if taken < LEAST:
        return made
    loss = made.loss - taken
    wave = wave_speed(made.young, made.poisson, made.density, loss)
    return replace(
        made,
        loss=loss,
        wave_speed=wave,
        step=stable_step(wave, made.impact_speed, cell),
        why=f"{made.why} It is struck so hard that vibrations of its own take what a loss factor "
        f"of {taken:.2g} would, beyond those of the real thing: its matter loses so much less.",
    )
