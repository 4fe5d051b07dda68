"""Points and normals of the surface of a rigid object that liquids touch."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from corporeal.discretization.cavity import is_vessel
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.part_model import PartModel
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.point_sampling import poisson_disk_subset, sample_surface

WETTED_SPACING_CELLS = 0.4
"""Distance of neighbours [cells]: a face that is nearly flat within a cell is known to a
hundredth of it."""
DARTS_PER_POINT = 8
"""Samples thrown for each point that is kept, about."""
MAX_SAMPLED_WETTED_POINTS = 60_000


def sample_wetted_points(
    anatomy: MeasuredObject, makes: Mapping[int, PartModel], cell: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Cover all faces of an object's material, the inside of a wall that is drawn by its outside too.

    Args:
        anatomy: The object.
        makes: How each part is made.
        cell: dx [m].
        rng: Source of the samples.

    Returns:
        Points [m] and unit normals out of the material.

    """
    faces = [f for m in anatomy.members for f in part_wetted_faces(m, makes[m.part])]
    area = sum(float(mesh.areas.sum()) for mesh, _, _ in faces)
    distance = max(
        WETTED_SPACING_CELLS * cell, float(np.sqrt(0.69 * area / MAX_SAMPLED_WETTED_POINTS))
    )
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for mesh, depth, side in faces:
        count = int(
            np.clip(
                DARTS_PER_POINT * mesh.areas.sum() / distance**2,
                50,
                DARTS_PER_POINT * MAX_SAMPLED_WETTED_POINTS,
            )
        )
        found, triangle = sample_surface(mesh, count, rng)
        normal = mesh.normals[triangle]
        order = rng.permutation(len(found))
        found, normal = found[order] - depth * normal[order], side * normal[order]
        kept = poisson_disk_subset(found, distance)
        points.append(found[kept])
        normals.append(normal[kept])
    return np.concatenate(points), np.concatenate(normals)


def part_wetted_faces(member: MeasuredPart, made: PartModel) -> list[tuple[Mesh, float, float]]:
    """Faces of a part: a mesh, how deep below it each lies [m], and 1 or -1: which way it looks."""
    found: list[tuple[Mesh, float, float]] = []
    if len(member.body.triangles):
        found.append((member.body, 0.0, 1.0))
        if made.thickness > 0 and not made.modelled and not is_vessel(member):
            found.append((member.body, made.thickness, -1.0))
    if len(member.sheet.triangles):
        half = 0.5 * made.sheet
        found += [(member.sheet, -half, 1.0), (member.sheet, half, -1.0)]
    return found
