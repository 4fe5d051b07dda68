"""Mesh decimation that keeps shape and appearance.

Shape: quadric error metrics (Garland & Heckbert, SIGGRAPH 1997) on welded vertices, so that
texture seams do not tear open. Look: each new corner takes texture coordinates, normal and colour
from the nearest point of the old surface. Where that lies across a seam, on another piece of the
picture than the middle of its triangle, the corner takes what is a little nearer to the middle.
"""

from dataclasses import replace

import fast_simplification
import igl
import numpy as np
from jaxtyping import Float

from corporeal.core.types import Scene, Surface

WELD_GRID_STEPS = 2**21 - 1
"""Steps along an extent within which vertices are one: three numbers fit into 63 bits."""
MIN_DECIMATED_TRIANGLES = 4
"""A surface with fewer triangles than this is left as it is."""
COLLAPSE_AGGRESSIVENESS = (3.0, 5.0, 7.0)
"""How fast the threshold for a collapse grows: folds come with haste, so it grows only if needed.
"""
MAX_TEXTURE_STRETCH = 3.0
"""How many times more of a picture than usual a triangle may show before it crosses a seam."""
INWARD_LOOK_FRACTIONS = (0.125, 0.25, 0.5, 0.75)
"""How far a corner that lies across a seam looks towards its triangle's middle, step by step."""
MIN_CORNER_NORMAL_COS = 0.7
"""Cosine of the angle to its triangle beyond which a corner's normal is from round an edge."""
SAME_LOOK_STEPS_PER_UNIT = 1e5
"""Steps per unit within which two corners of one vertex look the same."""


def decimate_scene(scene: Scene, most: int) -> Scene:
    """Return the scene with about ``most`` triangles, shared out as they were before."""
    total = sum(len(s.triangles) for s in scene.surfaces)
    surfaces = (_decimate_surface(s, int(most * len(s.triangles) / total)) for s in scene.surfaces)
    return replace(scene, surfaces=tuple(s for s in surfaces if len(s.triangles)))


def _decimate_surface(surface: Surface, target: int) -> Surface:
    old = _SourceSurface(surface)
    if len(old.triangles) <= max(target, MIN_DECIMATED_TRIANGLES):
        return surface
    vertices, triangles = _collapse_edges(old.vertices, old.triangles, target)
    if not len(triangles):
        return replace(surface, triangles=surface.triangles[:0])
    return _transfer_attributes(surface, old, vertices, triangles)


def _collapse_edges(vertices: np.ndarray, triangles: np.ndarray, target: int) -> tuple[np.ndarray, np.ndarray]:
    """Collapse edges, the cheapest first, until there are no more than ``target`` triangles.

    The library's threshold is an absolute squared distance: hence the unit size.
    """
    low = vertices.min(axis=0)
    size = float(np.ptp(vertices, axis=0).max())
    x, t = (vertices - low) / size, triangles.astype(np.int32)
    for haste in COLLAPSE_AGGRESSIVENESS:
        if len(t) > target:
            x, t = fast_simplification.simplify(x, t, target_count=target, agg=haste)[:2]
            t = np.asarray(t, np.int32)
    return np.asarray(x, np.float64) * size + low, t.astype(np.int64)


class _SourceSurface:
    """The surface as found, welded by position, and the way back to what its corners wore."""

    def __init__(self, surface: Surface) -> None:
        x = np.asarray(surface.vertices, np.float64)
        low, size = x.min(axis=0), max(float(np.ptp(x, axis=0).max()), 1e-300)
        steps = np.round((x - low) / size * WELD_GRID_STEPS).astype(np.int64)
        key = (steps[:, 0] << 42) | (steps[:, 1] << 21) | steps[:, 2]
        _, first, joined = np.unique(key, return_index=True, return_inverse=True)
        welded = joined.reshape(-1)[surface.triangles]
        a, b, c = welded.T
        real = (a != b) & (b != c) & (c != a)
        self.vertices = np.ascontiguousarray(x[first])
        self.triangles = np.ascontiguousarray(welded[real])
        self.corners = surface.triangles[real]
        """For each triangle, its vertices in the surface's own numbers."""
        self.tree = igl.AABB()
        self.tree.init(self.vertices, self.triangles)

    def nearest(self, points: Float[np.ndarray, "N 3"]) -> tuple[np.ndarray, np.ndarray]:
        """For each point the nearest triangle, and the weights of its corners there."""
        _, face, foot = self.tree.squared_distance(self.vertices, self.triangles, points)
        face, foot = np.asarray(face), np.asarray(foot)
        a, b, c = np.swapaxes(self.vertices[self.triangles[face]], 0, 1)
        u, v, w = b - a, c - a, foot - a
        uu, uv, vv, wu, wv = (_row_dot(u, u), _row_dot(u, v), _row_dot(v, v), _row_dot(w, u), _row_dot(w, v))
        area = np.maximum(uu * vv - uv * uv, 1e-300)
        s = np.clip((vv * wu - uv * wv) / area, 0, 1)
        t = np.clip((uu * wv - uv * wu) / area, 0, 1 - s)
        return face, np.stack([1 - s - t, s, t], axis=1)

    def worn(self, values: np.ndarray, face: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Interpolate what the corners wear."""
        return np.einsum("nk,nkd->nd", weights, np.asarray(values, np.float64)[self.corners[face]])


def _transfer_attributes(surface: Surface, old: _SourceSurface, x: np.ndarray, triangles: np.ndarray) -> Surface:
    """Give each corner of the new triangles what the old surface wears there."""
    face, weights = old.nearest(x)
    columns = {}
    if surface.uv is not None:
        picture = _SourceTexture(old, np.asarray(surface.uv, np.float64))
        columns["uv"] = picture.on(x, triangles, face, weights)
    if surface.normals is not None:
        found = old.worn(surface.normals, face, weights)
        columns["normals"] = _transfer_normals(found, x, triangles)
    if surface.colours is not None:
        colours = np.clip(old.worn(surface.colours, face, weights), 0, 1)
        columns["colours"] = colours[triangles]
    return _join_equal_corners(surface, x, triangles, columns)


class _SourceTexture:
    """A picture as the old surface wore it."""

    def __init__(self, old: _SourceSurface, uv: np.ndarray) -> None:
        self.old, self.uv = old, uv
        self.density = np.sqrt(
            _triangle_areas(uv[old.corners]) / np.maximum(_triangle_areas(old.vertices[old.triangles]), 1e-300)
        )
        """Of each old triangle, length in the picture per length in space."""

    def on(
        self, x: np.ndarray, triangles: np.ndarray, face: np.ndarray, weights: np.ndarray
    ) -> Float[np.ndarray, "T 3 2"]:
        """Texture coordinates of new triangles, each on one piece of the picture.

        Args:
            x: Vertices (V, 3).
            triangles: New triangles on them.
            face: For each vertex, the nearest old triangle.
            weights: Where in it.
        """
        corners = x[triangles]
        middle = corners.mean(axis=1)
        at, inside = self.old.nearest(middle)
        centre = self.old.worn(self.uv, at, inside)
        density = np.median(self.density[np.column_stack([at, face[triangles]])], axis=1)
        reach = MAX_TEXTURE_STRETCH * density[:, None] * np.linalg.norm(corners - middle[:, None], axis=2)
        taken = self.old.worn(self.uv, face, weights)[triangles]
        across = np.linalg.norm(taken - centre[:, None], axis=2) > reach
        for step in INWARD_LOOK_FRACTIONS:
            t, k = np.nonzero(across)
            if not len(t):
                return taken
            points = corners[t, k] + step * (middle[t] - corners[t, k])
            found = self.old.worn(self.uv, *self.old.nearest(points))
            taken[t, k] = found
            across[t, k] = np.linalg.norm(found - centre[t], axis=1) > reach[t, k]
        return np.where(across[:, :, None], centre[:, None], taken)


def _triangle_areas(corners: np.ndarray) -> Float[np.ndarray, " T"]:
    """Areas of triangles (T, 3, 2 or 3)."""
    a, b, c = np.swapaxes(corners, 0, 1)
    u, v = b - a, c - a
    return 0.5 * np.sqrt(np.maximum(_row_dot(u, u) * _row_dot(v, v) - _row_dot(u, v) ** 2, 0))


def _transfer_normals(found: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (T, 3, 3); a triangle's own where the corner's is from round an edge."""
    a, b, c = np.swapaxes(x[triangles], 0, 1)
    flat = _unit_rows(np.cross(b - a, c - a))[:, None]
    smooth = _unit_rows(found)[triangles]
    return np.where((smooth * flat).sum(axis=2, keepdims=True) < MIN_CORNER_NORMAL_COS, flat, smooth)


def _join_equal_corners(
    surface: Surface, x: np.ndarray, triangles: np.ndarray, columns: dict[str, np.ndarray]
) -> Surface:
    """Make corners of one vertex that look the same into one."""
    flat = {name: v.reshape(-1, v.shape[2]) for name, v in columns.items()}
    rows = np.column_stack([triangles.reshape(-1), *(np.round(v * SAME_LOOK_STEPS_PER_UNIT) for v in flat.values())])
    _, first, joined = np.unique(rows.astype(np.int64), axis=0, return_index=True, return_inverse=True)
    return replace(
        surface,
        vertices=x[triangles.reshape(-1)[first]],
        triangles=joined.reshape(-1, 3),
        **{name: v[first] for name, v in flat.items()},
    )


def _row_dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("nk,nk->n", a, b)


def _unit_rows(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)
