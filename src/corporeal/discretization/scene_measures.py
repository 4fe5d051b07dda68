"""Measures of all objects of a scene, with errors for scenes that cannot be filled."""

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Parts, Scene
from corporeal.discretization.mesh_measures import MeasuredObject, measure_object
from corporeal.geometry.mesh import join_meshes


def measure_objects(scene: Scene, parts: Parts, seed: int) -> list[MeasuredObject]:
    """Measure every object.

    Raises:
        UserError: A part has no surface.

    """
    whole = join_meshes(scene.surfaces)
    anatomies = []
    for number in range(len(scene.objects)):
        own = np.flatnonzero(parts.object_of_point == number)
        label = _without_unlabelled(parts.part_of_point[own])
        rng = np.random.default_rng([seed, number, 0])
        used, triangles = np.unique(whole.triangles[own], return_inverse=True)
        anatomies.append(measure_object(whole.vertices[used], triangles.reshape(-1, 3), label, rng))
    found = {m.part for a in anatomies for m in a.members}
    for k, part in enumerate(parts.catalogue):
        if k not in found:
            name = scene.objects[part.object].name
            raise UserError(
                f"Part {part.name!r} of object {name!r} has no surface: all of its triangles have "
                "no area. Remove it from the file, or give it another part's name."
            )
    return anatomies


def _without_unlabelled(label: np.ndarray) -> np.ndarray:
    """Give triangles that belong to no part to the object's most common part."""
    named = label[label >= 0]
    if len(named) == len(label) or not len(named):
        return label
    return np.where(label >= 0, label, np.bincount(named).argmax())


def refuse_flat_scene(scene: Scene, anatomies: list[MeasuredObject]) -> None:
    """Stop when nothing in the scene has a body.

    Raises:
        UserError: Every part is flat.

    """
    members = [m for a in anatomies for m in a.members]
    if all(m.volume == 0 and m.size[0] < 1e-6 * m.size[2] for m in members):
        raise UserError(
            f"{scene.source}: no object encloses a volume; every part is flat, so there is "
            "nothing to fill. Use a model of a solid object."
        )


def refuse_buried_objects(scene: Scene, anatomies: list[MeasuredObject], cell: float) -> None:
    """Stop when an object reaches more than one cell into the floor or a wall.

    Args:
        scene: The objects and the walls.
        anatomies: One per object.
        cell: Grid spacing [m].

    Raises:
        UserError: It names the object.

    """
    for obj, anatomy in zip(scene.objects, anatomies, strict=True):
        lowest = float(anatomy.vertices[:, 2].min())
        if lowest < -cell:
            raise UserError(
                f"Object {obj.name!r} reaches {-lowest:.3g} m below the floor. "
                "Raise its position by as much."
            )
        for k, wall in enumerate(scene.walls):
            depth = float(((np.array(wall.point) - anatomy.vertices) @ np.array(wall.normal)).max())
            if depth > cell:
                raise UserError(
                    f"Object {obj.name!r} reaches {depth:.3g} m into wall {k + 1}. "
                    "Move one of them, or flip the wall's normal."
                )
