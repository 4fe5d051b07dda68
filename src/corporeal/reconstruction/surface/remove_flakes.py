"""Removal of thin sheets before faces.

Where views disagree by a hair, carving leaves sheets thinner than a pixel a pixel or two before a plain face. Fitting
to outlines cannot take them away, since it moves no side of a wall as far as its middle. Nothing that is truly there is
so thin, so near a thick body, and seen at that size.
"""

import numpy as np
from jaxtyping import Bool, Float

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import RayCaster
from corporeal.reconstruction.surface.fairing import FLOOR_TOLERANCE_M, neighbour_mean_matrix, smooth_taubin

MAX_FLAKE_THICKNESS_PX, MAX_FLAKE_GAP_PX, MIN_BODY_THICKNESS_PX = 1.2, 3.0, 3.0
"""A sheet is thinner, nearer to the body, and the body thicker than so many pixels."""
FLAKE_PASSES = 2
"""How often sheets are looked for."""
FLAKE_RIM_VERTICES, FLAKE_RIM_ITERATIONS = 3, 20
"""Vertices beside a sheet that are laid between it and the body, in so many rounds."""
RAY_OFFSET_PX = 1e-3
"""Rays begin so many pixels off the surface."""


def remove_flakes(mesh: Mesh, pixel: float, floor: float) -> Mesh:
    """Return a surface with both sides of each sheet laid on the face behind it.

    Args:
        mesh: Closed.
        pixel: How wide one is at the surface [m].
        floor: Nothing is below it, and what lies on it stays [m].
    """
    mean = neighbour_mean_matrix(mesh)
    for _ in range(FLAKE_PASSES):
        way = _body_distance(mesh, pixel)
        lies = mesh.vertices[:, 2] < floor + FLOOR_TOLERANCE_M
        sheet = (way != 0) & ~lies
        if not sheet.any():
            return mesh
        vertices = mesh.vertices + np.where(sheet, way, 0)[:, None] * mesh.vertex_normals
        rim = sheet
        for _ in range(FLAKE_RIM_VERTICES):
            rim = rim | (mean @ rim > 0)
        loose = np.flatnonzero(rim & ~sheet & ~lies)
        near = mean[loose]
        for _ in range(FLAKE_RIM_ITERATIONS):
            vertices[loose] = near @ vertices
        mesh = smooth_taubin(Mesh(vertices, mesh.triangles), floor, 2, mean)
    return mesh


def _body_distance(mesh: Mesh, pixel: float) -> Float[np.ndarray, " N"]:
    """Return how far along its normal the body behind is from a vertex of a sheet [m]; 0: of none.

    On a sheet's outer side the way leads through it and the gap, on its inner side through the gap.
    """
    caster, normals = RayCaster(mesh), mesh.vertex_normals
    out = np.zeros(len(mesh.vertices))
    through = _ray_crossings(caster, mesh.vertices, -normals, 1, pixel)[:, 0]
    thin = np.flatnonzero(through < MAX_FLAKE_THICKNESS_PX * pixel)
    inwards = _ray_crossings(caster, mesh.vertices[thin], -normals[thin], 3, pixel)
    outer = _is_body(inwards[:, 1] - inwards[:, 0], inwards[:, 2] - inwards[:, 1], pixel)
    out[thin[outer]] = -inwards[outer, 1]
    rest = thin[~outer]
    outwards = _ray_crossings(caster, mesh.vertices[rest], normals[rest], 2, pixel)
    inner = _is_body(outwards[:, 0], outwards[:, 1] - outwards[:, 0], pixel)
    out[rest[inner]] = outwards[inner, 0]
    return out


def _is_body(gap: Float[np.ndarray, " N"], thick: Float[np.ndarray, " N"], pixel: float) -> Bool[np.ndarray, " N"]:
    return (gap < MAX_FLAKE_GAP_PX * pixel) & (thick > MIN_BODY_THICKNESS_PX * pixel)


def _ray_crossings(
    caster: RayCaster, begin: Float[np.ndarray, "N 3"], way: Float[np.ndarray, "N 3"], times: int, pixel: float
) -> Float[np.ndarray, "N {times}"]:
    """Return how far along rays they cross a surface the first times [m]; nan: not."""
    off, out = RAY_OFFSET_PX * pixel, np.full((len(begin), times), np.nan)
    far, going = np.full(len(begin), off), np.arange(len(begin))
    for k in range(times):
        found = caster.hits(begin[going] + far[going, None] * way[going], way[going])
        going = going[found.ray]
        out[going, k] = ((found.place - begin[going]) * way[going]).sum(axis=1)
        far[going] = out[going, k] + off
    return out
