"""Surfels below a closed surface that back transparent Gaussians.

Gaussians are learned to look right from where photographs were taken. From the side of a video they are thin where only
those behind them, or those below the floor, which are taken away, made them full: a foot is ragged, and an underside
that no photograph shows is a hole into a hollow shell. The closed surface is whole, with the colours that photographs
show. A layer of opaque discs along it, below what was learned, leaves full pixels as they are.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import Gaussians
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.space_carving import EMPTIER_VIEWS_FRACTION, MAX_TRUSTED_DISTANCE_CELLS
from corporeal.reconstruction.surface.closed_surface import ClosedSurface

SURFEL_SPACING_CELLS = 1.5
"""From disc to disc [cells of the solid's grid]."""
SURFEL_WIDTH_RATIO, SURFEL_THICKNESS_RATIO = 0.6, 0.1
"""Standard deviations of a disc along and across the surface, in that distance."""
SURFEL_DEPTH_RATIOS = (0.25, 0.5, 1.0, 2.0)
"""How far below the surface discs lie, in that distance: where a wall is thin, the less."""
EMPTY_VIEWS_FRACTION = 0.1
"""Share of the views that see a place which may see nothing there."""
SURFEL_OPACITY = 0.95
"""Of a disc, at its middle."""


def add_backing_surfels(
    gaussians: Gaussians, owner: Int[np.ndarray, " N"], solids: Sequence[ClosedSurface], rendering: DepthRendering
) -> tuple[Gaussians, Int[np.ndarray, " M"]]:
    """Add discs along closed surfaces, but where photographs look past these.

    Args:
        gaussians: What was learned.
        owner: Whose each is; -1: no object's.
        solids: The objects' surfaces, in the same frame and unit.
        rendering: What cameras of photographs see.

    Returns:
        All of them, those that were there first, and whose each is.
    """
    made, of = [gaussians], [owner]
    for k, solid in enumerate(solids):
        discs = _surfels(solid, rendering, gaussians)
        made.append(discs)
        of.append(np.full(discs.count, k, owner.dtype))
    fields = ("mean", "rotation", "scale", "opacity", "sh")
    joined = {name: np.concatenate([getattr(g, name) for g in made]) for name in fields}
    return replace(gaussians, **joined), np.concatenate(of)


def places_seen_past(
    places: Float[np.ndarray, "N 3"], rendering: DepthRendering, reach: float
) -> Bool[np.ndarray, " N"]:
    """Return which places photographs see to be empty.

    A view sees a place unless something is farther before it than reach [m], and sees it empty if the first surface is
    farther behind it than that. Two in five such views tell, as when space is carved; or one in ten, and two at least,
    which see nothing there at all, as when outlines carve.
    """
    seen, past, beside = (np.zeros(len(places), int) for _ in range(3))
    for depth, row in zip(rendering.depth, rendering.rows, strict=True):
        pose, (fx, fy, cx, cy, width, height) = row[:12].reshape(3, 4), row[12:]
        x, y, z = pose[:, :3] @ places.T + pose[:, 3:]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = fx * x / z + cx, fy * y / z + cy
        here = (z > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height)
        behind = depth[v[here].astype(int), u[here].astype(int)] - z[here]
        seen[here] += behind > -reach
        past[here] += behind > reach
        beside[here] += np.isinf(behind)
    return (past > EMPTIER_VIEWS_FRACTION * seen) | (beside > np.maximum(EMPTY_VIEWS_FRACTION * seen, 1))


def _surfels(solid: ClosedSurface, rendering: DepthRendering, like: Gaussians) -> Gaussians:
    mesh, apart = Mesh(solid.vertices, solid.triangles), SURFEL_SPACING_CELLS * solid.cell
    # One vertex of each cube.
    cubes = np.floor(solid.vertices / apart).astype(np.int64)
    some = np.unique(cubes, axis=0, return_index=True)[1]
    place, normal = solid.vertices[some], mesh.vertex_normals[some]
    # Below the surface, and at most half-way to the other side.
    shape, deep, inside = (QueryMesh(mesh), np.full(len(some), SURFEL_DEPTH_RATIOS[0]), np.ones(len(some), bool))
    for depth in SURFEL_DEPTH_RATIOS[1:]:
        inside &= shape.winding(place - 2 * depth * apart * normal) > 0.5
        deep[inside] = depth
    place = place - apart * deep[:, None] * normal
    kept = ~places_seen_past(place, rendering, MAX_TRUSTED_DISTANCE_CELLS * solid.cell)
    some, place, normal = some[kept], place[kept], normal[kept]
    sh = np.zeros((len(some), *like.sh.shape[1:]))
    sh[:, 0] = (solid.colours[some] - 0.5) / SH_DC_COEFFICIENT
    kind = like.mean.dtype
    return Gaussians(
        mean=place.astype(kind),
        rotation=_quaternions_from_z(normal).astype(like.rotation.dtype),
        scale=np.tile(
            apart * np.array([SURFEL_WIDTH_RATIO, SURFEL_WIDTH_RATIO, SURFEL_THICKNESS_RATIO]), (len(some), 1)
        ).astype(like.scale.dtype),
        opacity=np.full(len(some), SURFEL_OPACITY, like.opacity.dtype),
        sh=sh.astype(like.sh.dtype),
    )


def _quaternions_from_z(normal: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 4"]:
    """Return the quaternions that turn +z to some unit vectors by the shortest way."""
    x, y, z = normal.T
    made = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=1)
    made[z < -1 + 1e-9] = 0.0, 1.0, 0.0, 0.0
    return made / np.linalg.norm(made, axis=1, keepdims=True)
