"""Guard that keeps silhouettes filled during carving.

A mirror image lies behind its face, and photographs agree on where: carved as deep, a ball of steel has a dent as wide
as what it mirrors. But through every pixel of a mask something is met, and rays near an outline pass an object's face
only (Kolev and Cremers 2008 ask the same of stereo). So what depths of photographs take away stays taken only where the
masks remain full: cells are given back in whose pixel some view's ray meets nothing any more. A hollow that photographs
truly look into has a wall or a bottom behind it, and loses nothing by this.
"""

import numpy as np
from jaxtyping import Bool, Float

from corporeal.multiview.silhouette_coherence import is_outside_silhouettes
from corporeal.reconstruction.gaussians.space_carving import VoxelGrid
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.kernels_outline import count_lacking_views, mark_unmet_pixels


def restore_silhouettes(
    before: Float[np.ndarray, "X Y Z"],
    after: Float[np.ndarray, "X Y Z"],
    grid: VoxelGrid,
    mine: Bool[np.ndarray, "V H W"],
    cameras: Float[np.ndarray, "V 18"],
    pool: ThreadPool,
) -> Float[np.ndarray, "X Y Z"]:
    """Return ``after`` but where masks need what it takes away, which is as ``before``.

    Args:
        before: Distance to a surface, negative inside [m].
        after: The same of one that lies deeper.
        grid: Where these are.
        mine: Pixels that show the object.
        cameras: As ``DepthRendering.rows``.
        pool: Threads.
    """
    taken = (before < 0) & (after >= 0)
    if not taken.any():
        return after
    place, lacks = np.array([*grid.low, grid.cell]), np.empty(mine.shape, np.bool_)
    rest = place, cameras, mine, after, lacks
    pool.each(mark_unmet_pixels, [(*span, *rest) for span in pool.spans(len(mine))])
    places = grid.points(taken)
    votes = np.empty((len(places), 2), np.int64)
    rest = places, cameras, lacks, votes
    pool.each(count_lacking_views, [(*span, *rest) for span in pool.spans(len(places))])
    given = np.zeros(taken.shape, np.bool_)
    given[taken] = is_outside_silhouettes(*votes.T)  # masks may err here as where they say that nothing is
    return np.where(given, before, after)
