"""Refinement of depths by stereo behind floating Gaussians.

Gaussians are learned as balls some pixels wide, and of what is plain, such as the black inside of a pan, no picture
says where they are: their depth is that of a hump. Neighbouring photographs say how deep they see (``hull_stereo.py``),
and between such depths a plain face has none of the edges that a step would have: there it is taken to go on as flat as
it can.

In a mirror photographs see far behind its face, and agree on where: a highlight on a ball lies half its radius deep.
Gaussians stay on the face, since their colours change with the view. So nothing is taken to lie deeper than the far
side of the Gaussian at which half of the light is lost.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.hull_stereo import DEPTH_ERROR_CELLS, MIN_CONFIRMING_VIEWS, HullStereoImages
from corporeal.reconstruction.gaussians.kernels_space_carving import relax_unknown_cells
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import carve_tight_hull

DEPTH_FILL_ITERATIONS = 200
"""Of laying a face between known depths."""


def refine_depth(
    rendering: DepthRendering,
    views: Views,
    masks: Bool[np.ndarray, "V H W"],
    pool: ThreadPool,
    config: HullConfig = DEFAULT_HULL,
) -> DepthRendering:
    """Return the same, as deep as photographs see and Gaussians let most light through.

    Args:
        rendering: Of Gaussians.
        views: Photographs of what is rendered, by the same cameras in any frame of the same unit.
        masks: Their pixels on objects.
        pool: Threads.
        config: How the visual hull is carved.
    """
    try:
        hull = carve_tight_hull(views, masks, pool, config)
    except UserError:  # masks agree nowhere: Gaussians are all there is
        return rendering
    looks = HullStereoImages(views, masks)
    depths = looks.depths(hull, MIN_CONFIRMING_VIEWS, pool)
    for k, depth in enumerate(depths):
        depth[:] = fill_plain_depth(depth, looks.on[k], looks.plain(k))
    sizes = zip(rendering.depth.shape[1:], looks.grid, strict=True)
    rows, columns = (np.minimum(np.arange(n) // looks.every, most - 1) for n, most in sizes)
    seen = depths[:, rows[:, None], columns] - DEPTH_ERROR_CELLS * hull.side
    known = np.isfinite(seen) & np.isfinite(rendering.depth)
    seen = np.minimum(seen, rendering.far)
    deeper = np.where(known, np.maximum(rendering.depth, seen), rendering.depth)
    return replace(rendering, depth=deeper.astype(np.float32))


def fill_plain_depth(
    depth: Float[np.ndarray, "h w"], on: Bool[np.ndarray, "h w"], plain: Bool[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Lay a face between known depths of one view where it is plain.

    The inverse depth of a plane is linear in pixels, so that ∇²(1/z) = 0 goes on with planes.

    Args:
        depth: [m]; inf: unknown.
        on: Pixels on objects, beside which nothing goes on.
        plain: Pixels whose surroundings have one colour.
    """
    known = np.isfinite(depth) & on
    if not known.any():
        return depth
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    row, column = np.asarray(nearest)
    inverse = np.where(on, 1 / depth[row, column], np.nan).astype(np.float32)[None]
    relax_unknown_cells(inverse, np.argwhere((on & ~known)[None]), DEPTH_FILL_ITERATIONS)
    return np.where(on & plain & ~known, 1 / inverse[0].astype(np.float64), depth)
