"""What is rigid loses nothing on what is soft, so that what is soft loses for both.

One force presses both sides of a contact and their dents add up, so that each stores energy in
proportion to its compliance (1 - ν²)/E, and loses of that what its own loss factor says. A rigid
body and a plane store none here. Their part of the loss, by the real moduli of both, is given to
the matter that does deform: the loss factor of two in series is the mean of theirs, weighted by
their compliance.

A part has one loss factor for all that it meets. That of its first blows is taken, straight down,
by their energies; what strikes it otherwise finds the same.
"""

from collections.abc import Sequence
from dataclasses import replace

from corporeal.core.types import Material
from corporeal.discretization.crushed_layers import loss_on_layers
from corporeal.discretization.falls import FLOOR
from corporeal.discretization.filled import bulk
from corporeal.discretization.part import Motion, PartGeometry, Partner
from corporeal.materials.blow import at_speed
from corporeal.materials.contact import loss_of_pair, share

LEAST_SHARE = 0.01
"""Of the compliance of a contact: what has less changes no rebound that can be measured [-]."""


def with_partners(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    rigid: Sequence[bool],
    floor: Material | None,
) -> list[Motion]:
    """Tell every object what meets it in the first blows and is rigid all through.

    Args:
        parts: All of the scene's.
        motions: One per object.
        rigid: Which parts are.
        floor: What the floor is made of; None: it is not known.

    """
    soft = {p.object for p, stiff in zip(parts, rigid, strict=True) if not stiff}
    made = {k: largest_of(parts, k) for k in {p.object for p in parts} - soft}
    found: dict[int, list[Partner]] = {k: [] for k in range(len(motions))}
    for k, motion in enumerate(motions):
        lands = motion.landing
        if lands is None or lands.energy <= 0.0:
            continue
        for one, other in ((k, lands.onto), (lands.onto, k)):
            if other == FLOOR and floor is not None:
                found[one].append(Partner(floor, lands.energy))
            elif one != FLOOR and other in made:
                ball = largest_of(parts, one)
                loss = loss_on_layers(ball, lands, made[other]) if one == k else None
                found[one].append(Partner(made[other].material, lands.energy, loss))
    return [replace(m, partners=tuple(found[k])) for k, m in enumerate(motions)]


def largest_of(parts: Sequence[PartGeometry], number: int) -> PartGeometry:
    """Return the largest part of an object, by its mass."""
    return max((p for p in parts if p.object == number), key=bulk)


def takes_part(material: Material, partner: Partner) -> bool:
    """Tell whether a partner would, in life, take more than a negligible share of a blow."""
    return partner.loss is not None or share(partner.material, material) >= LEAST_SHARE


def loss_for_both(struck: Material, motion: Motion) -> float:
    """Loss factor [-] of a solid and of what meets it, of each at the speed of the blow.

    Args:
        struck: What deforms, as it is at that speed.
        motion: Of its object, with what meets it.

    """
    energy = sum(p.energy for p in motion.partners)
    losses = struck.loss * energy
    for partner in (p for p in motion.partners if takes_part(struck, p)):
        other = at_speed(partner.material, motion.impact_speed)
        both = loss_of_pair(struck, other) if partner.loss is None else partner.loss
        losses += partner.energy * (both - struck.loss)
    return losses / energy if energy > 0.0 else struck.loss
