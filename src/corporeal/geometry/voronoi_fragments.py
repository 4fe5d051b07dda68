"""Voronoi fragments of a closed surface, smaller near an impact."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.core.types import Surface

MAX_FRAGMENTS = 14
"""Pieces that an object breaks into at most."""
MIN_PARTICLES_PER_FRAGMENT = 3
"""Particles of a piece at least: fewer have no extent."""
NEAR_IMPACT_DISTANCE_FRACTION = 0.1
"""Pieces are smallest within this share of the object's longest side from the impact [-]."""
FRAGMENT_CREASE_ANGLE_DEG = 30.0
"""Edges sharper than this [degrees] are seen as edges."""

FragmentPoints = Float[np.ndarray, "N 3"]


def fragment_seeds(points: FragmentPoints, struck: Float[np.ndarray, "3"], rng: np.random.Generator) -> FragmentPoints:
    """Choose points of an object whose cells are its pieces, densely near the impact.

    The chance of a point falls with its squared distance from the impact. Cells of fewer than
    ``MIN_PARTICLES_PER_FRAGMENT`` points are given to their neighbours.

    Args:
        points: Of all of the object [m].
        struck: Where it is struck [m].
        rng: Makes the choice.
    """
    away = np.linalg.norm(points - struck, axis=1)
    chance = 1.0 / (away**2 + (NEAR_IMPACT_DISTANCE_FRACTION * np.ptp(points, axis=0).max()) ** 2)
    count = min(MAX_FRAGMENTS, len(points) // MIN_PARTICLES_PER_FRAGMENT)
    chosen = points[rng.choice(len(points), max(count, 1), False, chance / chance.sum())]
    while len(chosen) > 1:
        sizes = np.bincount(fragment_cells(points, chosen), minlength=len(chosen))
        if sizes.min() >= MIN_PARTICLES_PER_FRAGMENT:
            break
        chosen = np.delete(chosen, sizes.argmin(), axis=0)
    return chosen


def fragment_cells(points: FragmentPoints, seed: Float[np.ndarray, "S 3"]) -> Int[np.ndarray, " N"]:
    """Which seed each point is nearest to."""
    return np.asarray(KDTree(seed).query(points)[1], dtype=np.int64)


def cut_fragments(surface: Surface, wall: float, seed: Float[np.ndarray, "S 3"]) -> tuple[Surface, ...] | None:
    """Cut what a surface encloses into the cells of some points; None: it encloses nothing.

    Texture and colours go with the outside, and are drawn out over what is new.

    Args:
        surface: Closed.
        wall: Thickness of a hollow object whose outside alone is modelled [m]; 0: it is solid.
        seed: One per piece [m].
    """
    body = _fragment_solid(surface, wall)
    if body is None:
        return None
    pieces = []
    for k, own in enumerate(seed):
        piece = body
        for other in np.delete(seed, k, axis=0):
            normal = (own - other) / np.linalg.norm(own - other)
            piece = piece.trim_by_plane(normal, float(normal @ (own + other) / 2.0))
        pieces.append(_fragment_surface(piece, surface))
    return tuple(pieces)


def _fragment_solid(surface: Surface, wall: float) -> m3.Manifold | None:
    # Three columns are left for normals.
    columns = [surface.vertices, np.zeros_like(surface.vertices)]
    columns += [c for c in (surface.uv, surface.colours) if c is not None]
    rows = np.concatenate([np.asarray(c, dtype=np.float64) for c in columns], axis=1)
    outside = _fragment_manifold(rows, surface.triangles)
    if outside is None or wall == 0.0:
        return outside
    inner = rows.copy()
    inner[:, :3] -= wall * _outward_normals(surface)
    hollow = _fragment_manifold(inner, surface.triangles)
    return None if hollow is None else outside - hollow


def _fragment_manifold(rows: np.ndarray, triangles: np.ndarray) -> m3.Manifold | None:
    mesh = m3.Mesh(rows.astype(np.float32), triangles.astype(np.uint32))
    mesh.merge()
    body = m3.Manifold(mesh)
    return body if body.status() == m3.Error.NoError and body.volume() > 0.0 else None


def _outward_normals(surface: Surface) -> FragmentPoints:
    """Return unit normals at vertices; those on a seam share one."""
    place, own = np.unique(surface.vertices, axis=0, return_inverse=True)
    corner = own.reshape(-1)[surface.triangles]
    a, b, c = (place[corner[:, k]] for k in range(3))
    total, area = np.zeros_like(place), np.cross(b - a, c - a)
    for k in range(3):
        np.add.at(total, corner[:, k], area)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    return (total / np.maximum(size, np.finfo(float).tiny))[own.reshape(-1)]


def _fragment_surface(piece: m3.Manifold, whole: Surface) -> Surface:
    """Read a piece back, with the finish of the whole."""
    made = piece.calculate_normals(0, FRAGMENT_CREASE_ANGLE_DEG).to_mesh()
    rows = np.asarray(made.vert_properties, dtype=np.float64)
    first = 6 if whole.uv is None else 8
    width = 0 if whole.colours is None else whole.colours.shape[1]
    return replace(
        whole,
        vertices=rows[:, :3],
        triangles=np.asarray(made.tri_verts, dtype=np.int64),
        normals=rows[:, 3:6],
        uv=None if whole.uv is None else rows[:, 6:8],
        colours=rows[:, first : first + width] if width else None,
    )
