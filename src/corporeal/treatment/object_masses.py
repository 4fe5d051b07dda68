"""Masses of whole objects: those that a file states, and those that are implausible."""

from collections.abc import Mapping, Sequence

from corporeal.errors import UserError
from corporeal.formats.typical_bulk import doubt_mass
from corporeal.geometry.extent import oriented_size
from corporeal.geometry.make import Make, heavier
from corporeal.geometry.survey import Anatomy
from corporeal.materials.quantities import QUANTITIES
from corporeal.types import Scene

NOTABLE = 0.01
"""Relative difference between a stated mass and the computed one that is reported."""


def as_heavy_as_stated(
    scene: Scene, anatomies: Sequence[Anatomy], makes: Mapping[int, Make]
) -> tuple[dict[int, Make], tuple[str, ...]]:
    """Let objects weigh what their file states: all parts of one object by the same factor.

    Args:
        scene: The objects, with the masses that their files state.
        anatomies: One per object.
        makes: How every part is made.

    Returns:
        How every part is made, and a sentence for each object that its materials and its shape
        would give another mass.

    Raises:
        UserError: No material is as dense as that.

    """
    made, warnings = dict(makes), []
    for obj, anatomy in zip(scene.objects, anatomies, strict=True):
        own = [m.part for m in anatomy.members]
        usual = sum(makes[k].mass for k in own)
        if obj.mass is None or usual <= 0:
            continue
        made |= {k: heavier(makes[k], obj.mass / usual) for k in own}
        possible = QUANTITIES["density"]
        for row in (made[k] for k in own):
            if not possible.low <= row.density <= possible.high:
                raise UserError(
                    f"{obj.name}: its file states {obj.mass:.3g} kg, so that its material would "
                    f"have {row.density:.3g} kg/m³; no material has less than {possible.low:g} or "
                    f"more than {possible.high:g}. Correct the file, or its unit of mass."
                )
        if abs(obj.mass / usual - 1) > NOTABLE:
            warnings.append(
                f"{obj.name} weighs {obj.mass:.3g} kg, as its file states; its materials and "
                f"its shape would give {usual:.3g} kg."
            )
    return made, tuple(warnings)


def implausible_masses(
    scene: Scene, anatomies: Sequence[Anatomy], masses: Sequence[float]
) -> list[str]:
    """Say which objects are too heavy or too light for the room that they take.

    Args:
        scene: The objects, with what they are.
        anatomies: One per object.
        masses: Of every part [kg].

    """
    doubts = (
        doubt_mass(
            obj.name,
            obj.class_name or obj.name,
            sum(masses[m.part] for m in anatomy.members),
            oriented_size(anatomy.vertices),
        )
        for obj, anatomy in zip(scene.objects, anatomies, strict=True)
    )
    return [sentence for sentence in doubts if sentence]
