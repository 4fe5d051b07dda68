"""Masses of objects: those stated in files, and warnings of implausible ones."""

from collections.abc import Mapping, Sequence

from corporeal.core.errors import UserError
from corporeal.core.types import Material, MaterialField, Note, NoteKind, PartDescription, Scene, SceneObject
from corporeal.discretization.mesh_measures import MeasuredObject, oriented_box_size
from corporeal.discretization.part_model import THICKNESS_FROM_MESH, PartModel, scale_part_mass
from corporeal.materials.quantities import QUANTITIES
from corporeal.recognition.mass_from_name import mass_from_name_warning
from corporeal.recognition.typical_bulk_density import mass_warning

NOTABLE_MASS_DIFFERENCE_FRACTION = 0.01
"""Relative difference between a stated mass and the computed one that is reported."""
THICK_WALL_RATIO = 1.5
"""A wall that is drawn thicker than the thickest of its material, times this, is reported."""
SHEET_ONLY_MATERIALS = ("leather", "synthetic_leather", "aluminium_can_sheet")
"""Materials that come in sheets alone."""
MAX_PLAUSIBLE_SHEET_LAYERS = 8.0
"""So many of the thickest sheets on one another are reported."""
UNSEEN_MATERIAL_SOURCES = ("metadata", "unknown")
"""Who recognises a material without having looked at the object."""


def scale_to_stated_masses(
    scene: Scene, anatomies: Sequence[MeasuredObject], makes: Mapping[int, PartModel]
) -> tuple[dict[int, PartModel], tuple[str, ...]]:
    """Let objects weigh what their file states: all parts of one object by the same factor.

    Returns:
        How every part is made, and a sentence for each object that its materials and its shape would give another mass.

    Raises:
        UserError: No material is as dense as that.
    """
    made, warnings = dict(makes), []
    for obj, anatomy in zip(scene.objects, anatomies, strict=True):
        own = [m.part for m in anatomy.members]
        usual = sum(makes[k].mass for k in own)
        if obj.mass is None or usual <= 0:
            continue
        made |= {k: scale_part_mass(makes[k], obj.mass / usual) for k in own}
        possible = QUANTITIES["density"]
        for row in (made[k] for k in own):
            if not possible.low <= row.density <= possible.high:
                raise UserError(
                    f"{obj.name}: its file states {obj.mass:.3g} kg, so that its material would "
                    f"have {row.density:.3g} kg/m³; no material has less than {possible.low:g} or "
                    f"more than {possible.high:g}. Correct the file, or its unit of mass."
                )
        if abs(obj.mass / usual - 1) > NOTABLE_MASS_DIFFERENCE_FRACTION:
            warnings.append(
                f"{obj.name} weighs {obj.mass:.3g} kg, as its file states; its materials and "
                f"its shape would give {usual:.3g} kg."
            )
    return made, tuple(warnings)


def warn_of_implausible_masses(scene: Scene, anatomies: Sequence[MeasuredObject], masses: Sequence[float]) -> list[str]:
    """Return which objects are too heavy or too light for the room that they take.

    Args:
        scene: The objects, with what they are.
        anatomies: One per object.
        masses: Of every part, as large as it is in the scene [kg].
    """
    doubts = (
        mass_warning(
            obj.name,
            obj.class_name or obj.name,
            sum(masses[m.part] for m in anatomy.members) / obj.scale**3,
            _real_lengths(oriented_box_size(anatomy.vertices), obj.scale),
        )
        for obj, anatomy in zip(scene.objects, anatomies, strict=True)
    )
    return [sentence for sentence in doubts if sentence]


def warn_of_masses_not_as_named(
    scene: Scene, anatomies: Sequence[MeasuredObject], masses: Sequence[float]
) -> list[str]:
    """Return which objects do not weigh what their names say ("dumbbell_5kg").

    Args:
        scene: The objects, with what they are called.
        anatomies: One per object.
        masses: Of every part, as large as it is in the scene [kg].
    """
    doubts = (
        mass_from_name_warning(
            obj.name, sum(masses[m.part] for m in anatomy.members) / obj.scale**3, obj.name, obj.stem
        )
        for obj, anatomy in zip(scene.objects, anatomies, strict=True)
    )
    return [sentence for sentence in doubts if sentence]


def _real_lengths(sides: tuple[float, float, float], scale: float) -> tuple[float, float, float]:
    """Return lengths in the scene as they are in reality [m]."""
    a, b, c = sides
    return a / scale, b / scale, c / scale


def warn_of_thick_walls(
    scene: Scene, anatomies: Sequence[MeasuredObject], makes: Mapping[int, PartModel], field: MaterialField
) -> list[str]:
    """Return warnings of walls that weigh too much, since their thickness is the mesh's.

    Meshes often draw walls too thick: a bin of polypropylene had 9 mm. Sheet materials that fill a block are reported,
    too.

    Args:
        scene: The objects.
        anatomies: One per object.
        makes: How every part is made.
        field: What it is made of, with walls as thick as in the scene.
    """
    doubts = (
        _thick_wall_text(obj, makes[m.part], field.words[m.part], field.materials[m.part])
        for obj, anatomy in zip(scene.objects, anatomies, strict=True)
        for m in anatomy.members
    )
    return [sentence for sentence in doubts if sentence]


def _thick_wall_text(obj: SceneObject, made: PartModel, words: PartDescription, material: Material) -> str:
    """Describe an implausibly thick wall whose thickness is the mesh's; "": plausible."""
    ground = material.grounds.get("shell_thickness")
    if ground is None or words.answered_by not in UNSEEN_MATERIAL_SOURCES:
        return ""
    if material.name in SHEET_ONLY_MATERIALS and made.thickness == 0:
        return _thick_block_text(obj, made, words, ground.range.high)
    if made.whose != THICKNESS_FROM_MESH:
        return ""
    drawn, usual = made.thickness / obj.scale, ground.range
    if drawn <= usual.high * THICK_WALL_RATIO:
        return ""
    low, typical, high = (f"{1e3 * x:.2g}" for x in (usual.low, usual.typical, usual.high))
    return Note(
        f"{obj.name}: the mesh of {words.name} draws a wall {1e3 * drawn:.2g} mm thick, and such "
        f"walls of {material.name} have {low} to {high} mm, usually {typical}: it may be "
        f"{drawn / usual.typical:.2g} times too heavy. State its thickness with --annotations.",
        NoteKind.ASSUMED,
    )


def _thick_block_text(obj: SceneObject, made: PartModel, words: PartDescription, thickest: float) -> str:
    """State that what comes in sheets is a block; "": it may be some sheets on one another."""
    through = 2.0 * made.volume / made.area / obj.scale if made.area > 0 else 0.0
    if through <= MAX_PLAUSIBLE_SHEET_LAYERS * thickest:
        return ""
    return Note(
        f"{obj.name}: {words.name} is {words.material} all through, {100 * through:.2g} cm thick, "
        f"and that comes in sheets of up to {1e3 * thickest:.2g} mm: it may be many times too "
        "heavy. State what is behind the sheet with --annotations.",
        NoteKind.ASSUMED,
    )
