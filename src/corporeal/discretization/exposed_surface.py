"""Surface of an object exposed to air: its outer skin, and both sides of open sheets.

Only surfaces inside other parts are left out; there is no sheltering.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.discretization.mesh_measures import MeasuredObject
from corporeal.geometry.mesh import Mesh

MAX_EDGE_HALVINGS = 40
"""Halvings of a triangle's edges, at most."""


def exposed_faces(
    anatomy: MeasuredObject, points: Float[np.ndarray, "P 3"], spacing: float
) -> tuple[Float[np.ndarray, "A 3"], Int[np.ndarray, " A"]]:
    """Share the exposed surface among the points inside.

    Every small piece of the mesh goes to the nearest point; pieces of one point that look the same way are one face, so
    that an edge keeps the faces on both of its sides.

    Args:
        anatomy: The object.
        points: Its particles [m].
        spacing: Between them [m].

    Returns:
        Outward area vectors [m²], and the point that bears each.
    """
    shown = [m.sheet for m in anatomy.members if len(m.sheet.triangles)]
    sheets = [cut_mesh_to_size(m, spacing) for m in shown]
    bodies = []
    if anatomy.skin is not None and len(anatomy.skin.numbers):
        bodies.append(cut_mesh_to_size(anatomy.skin.shape.mesh, spacing))
    both = [(centre, side * area) for centre, area in sheets for side in (1.0, -1.0)]
    found = bodies + both
    if not found:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    centre = np.concatenate([c for c, _ in found])
    area = np.concatenate([a for _, a in found])
    bearer = np.asarray(KDTree(points).query(centre)[1], dtype=np.int64)
    return _merge_by_direction(area, bearer)


def _merge_by_direction(area: np.ndarray, bearer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add up pieces of one point whose normals are closest to the same of 26 directions."""
    way = np.array([w for w in np.ndindex(3, 3, 3) if w != (1, 1, 1)]) - 1.0
    way /= np.linalg.norm(way, axis=1)[:, None]
    label = bearer * len(way) + np.argmax(area @ way.T, axis=1)
    kinds, face = np.unique(label, return_inverse=True)
    total = np.zeros((len(kinds), 3))
    np.add.at(total, face.reshape(-1), area)
    return total, kinds // len(way)


def cut_mesh_to_size(mesh: Mesh, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres [m] and area vectors [m²] of a mesh cut into pieces no longer than ``size`` [m]."""
    done, corners = [], mesh.corners
    for _ in range(MAX_EDGE_HALVINGS):
        edges = np.roll(corners, -1, axis=1) - corners
        length = np.linalg.norm(edges, axis=2)
        large = length.max(axis=1) > size
        done.append(corners[~large])
        corners, longest = corners[large], np.argmax(length[large], axis=1)
        if not len(corners):
            break
        corners = halve_triangles(corners, longest)
    done.append(corners)
    small = np.concatenate(done)
    area = 0.5 * np.cross(small[:, 1] - small[:, 0], small[:, 2] - small[:, 0])
    return small.mean(axis=1), area


def halve_triangles(corners: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """Cut every triangle in two across its given edge."""
    row = np.arange(len(corners))
    a, b = corners[row, edge], corners[row, (edge + 1) % 3]
    c, middle = corners[row, (edge + 2) % 3], 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])


def cross_section_area(anatomy: MeasuredObject, direction: tuple[float, float, float]) -> float:
    """Area that an object shows in a direction [m²]; its mean over all where there is none.

    ∫ |n · d| dA, by half for what encloses something; parts behind one another count twice.
    """
    size = float(np.linalg.norm(direction))
    shown = 0.0
    for member in anatomy.members:
        for mesh, share in ((member.body, 0.5), (member.sheet, 1.0)):
            along = np.abs(mesh.normals @ np.array(direction)) / size if size > 0 else 0.5
            shown += share * float(np.sum(along * mesh.areas))
    return shown
