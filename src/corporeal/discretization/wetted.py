"""Points and normals of the surface of a rigid object that liquids touch."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from corporeal.discretization.make import Make
from corporeal.discretization.room import is_vessel
from corporeal.discretization.survey import Anatomy, Member
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.spread import sample_surface, thin_out

APART = 0.4
"""Distance of neighbours [cells]: a face that is nearly flat within a cell is known to a
hundredth of it."""
DARTS = 8
"""Samples thrown for each point that is kept, about."""
MOST = 60_000


def wetted_points(
    anatomy: Anatomy, makes: Mapping[int, Make], cell: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Cover all faces of an object's matter, the inside of a wall that is drawn by its outside too.

    Args:
        anatomy: The object.
        makes: How each part is made.
        cell: dx [m].
        rng: Source of the samples.

    Returns:
        Points [m] and unit normals out of the matter.

    """
    faces = [f for m in anatomy.members for f in faces_of(m, makes[m.part])]
    area = sum(float(mesh.areas.sum()) for mesh, _, _ in faces)
    distance = max(APART * cell, float(np.sqrt(0.69 * area / MOST)))
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for mesh, depth, side in faces:
        count = int(np.clip(DARTS * mesh.areas.sum() / distance**2, 50, DARTS * MOST))
        found, triangle = sample_surface(mesh, count, rng)
        normal = mesh.normals[triangle]
        order = rng.permutation(len(found))
        found, normal = found[order] - depth * normal[order], side * normal[order]
        kept = thin_out(found, distance)
        points.append(found[kept])
        normals.append(normal[kept])
    return np.concatenate(points), np.concatenate(normals)


def faces_of(member: Member, made: Make) -> list[tuple[Mesh, float, float]]:
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
