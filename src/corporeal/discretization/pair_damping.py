"""Damping of contact pairs: the deformable side takes the loss of the rigid side, too.

One force presses both sides of a contact and their dents add up, so that each stores energy in proportion to its
compliance (1 - ν²)/E, and loses of that what its own loss factor says. A rigid body and a plane store none here. Their
part of the loss, by the real moduli of both, is given to the material that does deform: the loss factor of two in
series is the mean of theirs, weighted by their compliance.

A part has one loss factor for all that it meets. That of its first impacts is taken, straight down, by their energies;
what strikes it otherwise finds the same.
"""

from collections.abc import Sequence
from dataclasses import replace

from corporeal.core.types import Material
from corporeal.discretization.filled_shells import bulk_mass
from corporeal.discretization.impact_speeds import FLOOR_NUMBER
from corporeal.discretization.layered_sheets import layered_loss_factor
from corporeal.discretization.part_geometry import ExpectedMotion, ImpactPartner, PartGeometry
from corporeal.materials.contact_pairs import compliance_share, contact_loss_factor
from corporeal.materials.restitution_speed import material_at_speed

MIN_COMPLIANCE_FRACTION = 0.01
"""Of the compliance of a contact: what has less changes no rebound that can be measured [-]."""


def find_impact_partners(
    parts: Sequence[PartGeometry], motions: Sequence[ExpectedMotion], rigid: Sequence[bool], floor: Material | None
) -> list[ExpectedMotion]:
    """Tell every object what meets it in the first impacts and is rigid all through.

    Args:
        parts: All of the scene's.
        motions: One per object.
        rigid: Which parts are.
        floor: What the floor is made of; None: it is not known.
    """
    soft = {p.object for p, stiff in zip(parts, rigid, strict=True) if not stiff}
    made = {k: largest_part_of(parts, k) for k in {p.object for p in parts} - soft}
    found: dict[int, list[ImpactPartner]] = {k: [] for k in range(len(motions))}
    for k, motion in enumerate(motions):
        lands = motion.landing
        if lands is None or lands.energy <= 0.0:
            continue
        for one, other in ((k, lands.onto), (lands.onto, k)):
            if other == FLOOR_NUMBER and floor is not None:
                found[one].append(ImpactPartner(floor, lands.energy))
            elif one != FLOOR_NUMBER and other in made:
                ball = largest_part_of(parts, one)
                loss = layered_loss_factor(ball, lands, made[other]) if one == k else None
                found[one].append(ImpactPartner(made[other].material, lands.energy, loss))
    return [replace(m, partners=tuple(found[k])) for k, m in enumerate(motions)]


def largest_part_of(parts: Sequence[PartGeometry], number: int) -> PartGeometry:
    """Return the largest part of an object, by its mass."""
    return max((p for p in parts if p.object == number), key=bulk_mass)


def takes_part_in_impact(material: Material, partner: ImpactPartner) -> bool:
    """Return whether a partner would, in reality, take more than a negligible share of an impact."""
    return partner.loss is not None or compliance_share(partner.material, material) >= MIN_COMPLIANCE_FRACTION


def pair_loss_factor_of_parts(struck: Material, motion: ExpectedMotion) -> float:
    """Loss factor [-] of a solid and of what meets it, of each at the speed of the impact.

    Args:
        struck: What deforms, as it is at that speed.
        motion: Of its object, with what meets it.
    """
    energy = sum(p.energy for p in motion.partners)
    losses = struck.loss * energy
    for partner in (p for p in motion.partners if takes_part_in_impact(struck, p)):
        other = material_at_speed(partner.material, motion.impact_speed)
        both = contact_loss_factor(struck, other) if partner.loss is None else partner.loss
        losses += partner.energy * (both - struck.loss)
    return losses / energy if energy > 0.0 else struck.loss
