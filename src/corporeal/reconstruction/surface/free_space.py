"""Separation of pieces by observed free space.

Means of Gaussians are poor witnesses of gaps: a plain face or neck has few, far apart. Cameras see that it is there,
and see through between objects that are apart. So space is carved by what they see, as for closed surfaces, and what
lies about the same connected piece of the rest goes together.

A piece is taken as wide as the grid can lose a line, so that thin legs and necks, of which carving leaves crumbs, break
nothing; gaps that are narrower than that are none.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree
from skimage import measure

from corporeal.core.types import Camera, Gaussians
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering, render_depth, restrict_depth_to_objects
from corporeal.reconstruction.gaussians.space_carving import VoxelGrid, carve_signed_distance, grid_over_box
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.surface_config import DEFAULT_FREE_SPACE, FreeSpaceConfig

GRID_PADDING_FRACTION = 0.1
"""About points, on each side, as a share of their extent."""
STRAY_POINTS_PERCENT = 0.1
"""Percentage of the points, at either end of each axis, that the grid need not hold."""
HALF_DIAGONAL_CELLS = np.sqrt(3) / 2
"""Half of a cell's diagonal [cells]: a line is nowhere farther from the middle of a cell that it passes through."""
HALF_GAP_PX = 0.5
"""Half as wide a gap lets a ray pass between the pixels of what is on its sides [px]."""
MIN_PIECE_FRACTION = 0.01
"""Share of the points that make a piece."""
FLOOR_HEIGHT_M = 0.0
"""Height that nothing is below [m]."""


def pieces_by_free_space(
    position: Float[np.ndarray, "N 3"],
    gaussians: Gaussians,
    of_object: Bool[np.ndarray, " G"],
    cameras: tuple[Camera, ...],
    masks: Bool[np.ndarray, "V H W"] | None = None,
    config: FreeSpaceConfig = DEFAULT_FREE_SPACE,
) -> Int[np.ndarray, " N"]:
    """Return which connected piece each point is of, the one with most points first.

    Args:
        position: Points on objects: +z up, the floor at z = 0 [m].
        gaussians: Of objects and, where there is one, of floor and background; in that frame.
        of_object: Which of them are objects'.
        cameras: From where they were learned, or are looked at.
        masks: Pixels that show objects, where given.
        config: How finely.
    """
    low, high = np.percentile(position, (STRAY_POINTS_PERCENT, 100 - STRAY_POINTS_PERCENT), axis=0)
    room = GRID_PADDING_FRACTION * (high - low)
    grid = grid_over_box(low - room, high + room, config.grid_cells, FLOOR_HEIGHT_M)
    with ThreadPool(config.threads) as pool:
        rendering = render_depth(gaussians, cameras, pool)
        rendering = restrict_depth_to_objects(rendering, of_object, masks)
        distance = carve_signed_distance(grid, rendering, FLOOR_HEIGHT_M, pool)
    held = distance < max(HALF_DIAGONAL_CELLS * grid.cell, HALF_GAP_PX * _mean_pixel_width(rendering))
    held[:, :, grid.axes[2] < FLOOR_HEIGHT_M] = False
    if not of_object.all():  # the floor would join all that stands on it
        nearest = KDTree(gaussians.mean).query(grid.points(held))[1]
        held[held] = of_object[nearest]
    return _piece_at_points(held, grid, position)


def _mean_pixel_width(rendering: DepthRendering) -> float:
    """Return how wide a pixel is at objects, in the mean [m]."""
    wide = (rendering.depth / rendering.rows[:, 12, None, None])[rendering.met >= 0]
    return float(wide.mean()) if len(wide) else 0.0


def _piece_at_points(
    held: Bool[np.ndarray, "X Y Z"], grid: VoxelGrid, position: Float[np.ndarray, "N 3"]
) -> Int[np.ndarray, " N"]:
    """Return the piece that each point is at: of those at which there are points enough."""
    piece = np.asarray(measure.label(held, connectivity=1))
    count, cell = int(piece.max()), tuple(grid.at(position).T)
    sizes = np.bincount(_nearest_piece(piece)[cell], minlength=count + 1)
    kept = np.flatnonzero(sizes >= max(MIN_PIECE_FRACTION * len(position), 1))
    kept = kept[kept > 0]
    if len(kept) < 2:
        return np.zeros(len(position), np.int64)
    own = _nearest_piece(np.where(np.isin(piece, kept), piece, 0))[cell]
    order = np.argsort(-np.bincount(own, minlength=count + 1), kind="stable")
    rank = np.empty(count + 1, np.int64)
    rank[order] = np.arange(count + 1)
    return rank[own]


def _nearest_piece(piece: Int[np.ndarray, "X Y Z"]) -> Int[np.ndarray, "X Y Z"]:
    """Return the nearest piece of every cell; 0: there is none."""
    if not piece.any():
        return piece
    at = distance_transform_edt(piece == 0, return_distances=False, return_indices=True)
    return piece[tuple(np.asarray(at))]
