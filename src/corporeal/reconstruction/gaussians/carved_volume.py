"""Volume of objects carved by masks, lines of sight and stereo."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from corporeal.core.types import Views
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.hull_stereo import hull_cells_seen_past
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import CarvedVolume, carve_tight_hull


def carve_volume(
    views: Views,
    masks: Bool[np.ndarray, "V H W"],
    lines: LinesOfSight | None,
    pool: ThreadPool,
    config: HullConfig = DEFAULT_HULL,
) -> CarvedVolume:
    """Carve the visual hull, and empty it where stereo sees past it and points were seen through.

    Points are where they are to a part of a pixel, so that nothing is ever learned on the way to them. What stereo sees
    past is only where nothing begins: thin walls come back.

    lines: from the views' cameras; None: nothing is known to be seen through it.
    config: how the hull is carved.

    Raises:
        UserError: Nothing is inside all masks.
    """
    hull = carve_tight_hull(views, masks, pool, config)
    past = hull_cells_seen_past(views, masks, hull, pool)
    if not (hull.inside & ~past).any():
        past[:] = False
    hull = replace(hull, inside=hull.inside & ~past)
    empty, low = np.zeros(hull.inside.shape, np.bool_), hull.cells[0, 0, 0]
    if lines is not None:
        empty = lines.emptied(views.cameras, low, hull.side, empty.shape)
    left = hull.inside & ~empty
    if not left.any():  # lines of poses that masks contradict
        return CarvedVolume(views, masks, hull, np.zeros_like(empty))
    return CarvedVolume(views, masks, replace(hull, inside=left), empty)
