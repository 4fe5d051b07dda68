"""Surfaces fitted to the outlines that objects have in pictures.

What carves space are depths, which are off by a pixel or two where an object is plain or shiny, and
mostly all to the same side. Outlines are known to a tenth of a pixel. Wherever the surface's own
outline differs from the object's, the surface there is moved along its normal by as much, and what
lies between goes along (compare Kolev and Cremers 2008, who add outlines to stereo as constraints).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from corporeal.geometry.mesh import Mesh
from corporeal.splats.depth_rendering import DepthRendering
from corporeal.splats.fairing import ON, means, smoothed
from corporeal.splats.kernels_outline import outline, stray
from corporeal.splats.thread_pool import ThreadPool

REACH = 4
"""Outlines may be so many pixels apart."""
STEEP = 0.35
"""Cosine between normal and view up to which a vertex may be on an outline: 20°."""
EDGE = 0.6
"""How near to its own outline what is on it lies [px]."""
BEHIND = 3.0
"""What is seen outside must be so many cells farther away to be behind."""
ROUNDS = 5
"""How often the surface is moved."""
SPREAD = 6
"""How often a move is shared with neighbours."""
PRIOR = 0.05
"""Outlines that the median of all counts for, where the surface is seen."""


@dataclass(frozen=True)
class Outlines:
    """Where an object ends in pictures."""

    distance: Float32[np.ndarray, "V H W"]
    """To the outline [px], negative inside; nan: not near, or something hides it there."""
    cameras: Float[np.ndarray, "V 18"]
    """As ``DepthRendering.rows``."""


def outlined(
    mine: Bool[np.ndarray, "V H W"], rendering: DepthRendering, cell: float, pool: ThreadPool
) -> Outlines:
    """Find an object's outlines.

    Args:
        mine: Pixels that show the object.
        rendering: What the cameras see.
        cell: Of the grid that the object was carved from [m].
        pool: Threads.

    """
    out = np.empty(mine.shape, np.float32)
    rest = mine, rendering.depth, BEHIND * cell, REACH, out
    pool.each(outline, [(*span, *rest) for span in pool.spans(len(mine))])
    return Outlines(out, rendering.rows)


def fitted(
    mesh: Mesh,
    outlines: Outlines,
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
    mean, out = means(mesh), np.empty((views, len(mesh.vertices)), np.float32)
    rule = np.array([STEEP, REACH, EDGE])
    lies = mesh.vertices[:, 2] < floor + ON
    for _ in range(ROUNDS):
        normals = mesh.vertex_normals
        rest = mesh.vertices, mesh.triangles, normals, outlines.cameras, outlines.distance
        pool.each(stray, [(*span, *rest, rule, out) for span in pool.spans(views)])
        known = np.isfinite(out)
        total, count = np.where(known, out, 0).sum(axis=0), known.sum(axis=0).astype(float)
        if not count.any():
            break
        median = float(np.median(total[count > 0] / count[count > 0]))
        for _ in range(SPREAD):
            total, count = mean @ total, mean @ count
        prior = PRIOR * seen
        move = (total + prior * median) / (count + PRIOR)
        vertices = mesh.vertices + np.where(still, 0, move)[:, None] * normals
        vertices[lies, 2] = floor
        mesh = smoothed(Mesh(vertices, mesh.triangles), floor, 2, mean)
    return mesh
