"""Convex pieces of any mesh: what a rigid-body engine collides with."""

import hashlib
from pathlib import Path

import numpy as np
import vhacdx
from jaxtyping import Float, Int

from corporeal.errors import UserError
from corporeal.settle.hull import Piece, hull_of
from corporeal.store import load, save


def decompose(
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    cache: Path | None = None,
) -> tuple[Piece, ...]:
    """Cut a mesh into convex pieces.

    Args:
        vertices: [m]
        triangles: Vertex numbers; holes, flips and many shells are welcome.
        cache: Folder to keep pieces in, by the mesh's hash at unit size; None: keep nothing.

    Raises:
        UserError: The mesh has no surface, or numbers that are none.

    """
    used, number = np.unique(triangles, return_inverse=True)
    points = np.asarray(vertices, dtype=np.float64)[used]
    if not np.isfinite(points).all():
        raise UserError("it has vertices that are not finite")
    if not len(points):
        raise UserError("it has no triangles")
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    extent = float(np.ptp(points, axis=0).max())
    if extent <= 0:
        raise UserError("it has no size: all its vertices are one point")
    unit = np.round((points - middle) / extent, 6)
    arrays = _kept(unit, number.reshape(-1, 3).astype(np.uint32), cache)
    return tuple(Piece(v * extent + middle, t) for v, t in arrays)


def _kept(unit: np.ndarray, triangles: np.ndarray, cache: Path | None) -> tuple:
    if cache is None:
        return _cut(unit, triangles)
    name = hashlib.sha256(unit.tobytes() + triangles.tobytes()).hexdigest()[:24]
    path = cache / f"{name}.npz"
    if path.exists():
        return load(path)
    found = _cut(unit, triangles)
    save(path, found)
    return found


def _cut(unit: np.ndarray, triangles: np.ndarray) -> tuple:
    parts = vhacdx.compute_vhacd(
        unit, triangles, maxConvexHulls=16, resolution=100_000, maxNumVerticesPerCH=48
    )
    pieces = [hull_of(np.asarray(v)) for v, _ in parts] or [hull_of(unit)]
    return tuple((p.vertices, p.triangles) for p in pieces)
