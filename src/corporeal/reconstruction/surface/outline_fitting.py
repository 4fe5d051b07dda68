"""Surfaces fitted to the outlines that objects have in pictures.

What carves space are depths, which are off by a pixel or two where an object is plain or shiny, and
mostly all to the same side. Outlines are known to a tenth of a pixel. Wherever the surface's own
outline differs from the object's, the surface there is moved along its normal by as much, and what
lies between goes along (compare Kolev and Cremers 2008, who add outlines to stereo as constraints).
Where no outline is near, a surface goes inwards as most outlines do, since what is met first is too
near; that outlines want more elsewhere, as at the rim of a pan, says nothing of its bottom.
No side of a wall, and none of a gap, is moved as far as its middle: else thin objects would be
turned inside out, and from then on every round would make them larger.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Float32

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import pixel_width
from corporeal.reconstruction.surface.fairing import FLOOR_TOLERANCE_M, neighbour_mean_matrix, smooth_taubin
from corporeal.reconstruction.surface.kernels_outline import outline_distance, outline_error

MAX_OUTLINE_MOVE_PX = 4
"""Outlines may be so many pixels apart, and nothing is moved farther."""
MAX_OUTLINE_COSINE = 0.35
"""Cosine between normal and view up to which a vertex may be on an outline: 20°."""
OWN_OUTLINE_PX = 0.6
"""How near to its own outline what is on it lies [px]."""
BEHIND_CELLS = 3.0
"""What is seen outside must be so many cells farther away to be behind."""
OUTLINE_ITERATIONS = 5
"""How often the surface is moved."""
OUTLINE_SMOOTHING_ITERATIONS = 6
"""How often a move is shared with neighbours."""
MEDIAN_OUTLINE_WEIGHT = 0.05
"""Outlines that the median of all counts for, where the surface is seen and that is inwards."""
MAX_MOVE_FRACTION = 0.4
"""Share of a wall's thickness, and of a gap's width, that either side of it may be moved by."""
MAX_MOVE_SLOPE, MOVE_SLOPE_RINGS = 0.5, 12
"""How much farther a vertex may be moved than one beside it, in the length between, and up to how many vertices away
that is looked at."""
RAY_OFFSET_FRACTION = 1e-6
"""Rays begin so far off the surface, in its longest sides, so as not to meet where they begin."""


@dataclass(frozen=True)
class ObjectOutlines:
    """Where an object ends in pictures."""

    distance: Float32[np.ndarray, "V H W"]
    """To the outline [px], negative inside; nan: not near, or something hides it there."""
    cameras: Float[np.ndarray, "V 18"]
    """As ``DepthRendering.rows``."""
    rounds: int = OUTLINE_ITERATIONS
    """How often a surface is moved to them."""


def find_object_outlines(
    mine: Bool[np.ndarray, "V H W"], rendering: DepthRendering, cell: float, pool: ThreadPool
) -> ObjectOutlines:
    """Find an object's outlines.

    Args:
        mine: Pixels that show the object.
        rendering: What the cameras see.
        cell: Of the grid that the object was carved from [m].
        pool: Threads.
    """
    out = np.empty(mine.shape, np.float32)
    rest = mine, rendering.depth, BEHIND_CELLS * cell, MAX_OUTLINE_MOVE_PX, out
    pool.each(outline_distance, [(*span, *rest) for span in pool.spans(len(mine))])
    return ObjectOutlines(out, rendering.rows)


def fit_to_outlines(
    mesh: Mesh,
    outlines: ObjectOutlines,
    seen: Bool[np.ndarray, " N"],
    still: Bool[np.ndarray, " N"],
    floor: float,
    pool: ThreadPool,
) -> Mesh:
    """Return a surface whose outlines are those of the object.

    Args:
        mesh: Closed.
        outlines: Of the object.
        seen: Whether any view sees a vertex.
        still: Vertices that stay where they are.
        floor: Nothing is moved below it, nor off it [m].
        pool: Threads.
    """
    views = len(outlines.cameras)
    mean, out = neighbour_mean_matrix(mesh), np.empty((views, len(mesh.vertices)), np.float32)
    rule = np.array([MAX_OUTLINE_COSINE, MAX_OUTLINE_MOVE_PX, OWN_OUTLINE_PX])
    lies = mesh.vertices[:, 2] < floor + FLOOR_TOLERANCE_M
    pixel = pixel_width(outlines.cameras, mesh.vertices.mean(axis=0))
    begun, leeway = mesh, np.minimum(_move_limits(mesh), MAX_OUTLINE_MOVE_PX * pixel)
    for _ in range(outlines.rounds):
        normals = mesh.vertex_normals
        rest = mesh.vertices, mesh.triangles, normals, outlines.cameras, outlines.distance
        pool.each(outline_error, [(*span, *rest, rule, out) for span in pool.spans(views)])
        known = np.isfinite(out)
        total, count = np.where(known, out, 0).sum(axis=0), known.sum(axis=0).astype(float)
        if not count.any():
            break
        median = min(0.0, float(np.median(total[count > 0] / count[count > 0])))
        for _ in range(OUTLINE_SMOOTHING_ITERATIONS):
            total, count = mean @ total, mean @ count
        move = (total + MEDIAN_OUTLINE_WEIGHT * seen * median) / (count + MEDIAN_OUTLINE_WEIGHT)
        vertices = mesh.vertices + np.where(still, 0, move)[:, None] * begun.vertex_normals
        vertices[lies, 2] = floor
        mesh = smooth_taubin(Mesh(vertices, mesh.triangles), floor, 2, mean)
        mesh = _clamp_moves(mesh, begun, leeway)
    return mesh


def _move_limits(mesh: Mesh) -> Float[np.ndarray, "2 N"]:
    """Return how far vertices may be moved inwards, and outwards [m]; inf: nothing is in the way.

    So that both sides of a wall, or of a gap, may be moved at once.
    """
    rays = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False).ray
    off = RAY_OFFSET_FRACTION * float(np.ptp(mesh.vertices, axis=0).max())
    middles, normals = mesh.corners.mean(axis=1), mesh.area_vectors
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    out = np.full((2, len(mesh.vertices)), np.inf)
    for room, way in zip(out, (-normals, normals), strict=True):
        begin, far = middles + off * way, np.full(len(middles), np.inf)
        met, ray, _ = rays.intersects_location(begin, way, multiple_hits=False)
        far[ray] = MAX_MOVE_FRACTION * np.linalg.norm(met - begin[ray], axis=1)
        np.minimum.at(room, mesh.triangles.ravel(), np.repeat(far, 3))
    _limit_slope_of_moves(out[0], mesh)
    return out


def _limit_slope_of_moves(room: Float[np.ndarray, " N"], mesh: Mesh) -> None:
    """Let no vertex move much farther than its neighbours may, so that no rim is folded over.

    That is asked of moves inwards: outwards rough surfaces have gaps everywhere, and would stay.
    """
    f = mesh.triangles
    a, b = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]).T
    wider = MAX_MOVE_SLOPE * np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1)
    for _ in range(MOVE_SLOPE_RINGS):
        np.minimum.at(room, a, room[b] + wider)
        np.minimum.at(room, b, room[a] + wider)


def _clamp_moves(mesh: Mesh, begun: Mesh, leeway: Float[np.ndarray, "2 N"]) -> Mesh:
    """Return a mesh no vertex of which is farther from where it began than it may be."""
    moved = mesh.vertices - begun.vertices
    inwards = (moved * begun.vertex_normals).sum(axis=1) < 0
    room = np.where(inwards, *leeway)
    far = np.linalg.norm(moved, axis=1)
    share = np.minimum(1, room / np.maximum(far, np.finfo(float).tiny))
    return Mesh(begun.vertices + share[:, None] * moved, mesh.triangles)
