"""Space carving (Kutulakos and Seitz 2000) as a signed distance on a grid.

A place is free where views see past it. One view may err, and all do along outlines; so a cell's distance is not the
largest that any view allows, but the one that four in ten of those views exceed that see the cell at all. Both sides of
a thin wall are seen by about as many, and each side's views agree among themselves, so that the wall stays. A view says
nothing of what is well behind the surface that it sees, so that behind a surface of faint Gaussians the few rays that
leak through it are alone, and agree on a cavern: what is free must be looked into through free places. What no view
observes, inside objects and below them, is filled in smoothly between (∇²f = 0), which closes a seat from below with
about the least area.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.ndimage import binary_dilation

from corporeal.core.types import Vector
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.kernels_space_carving import carve_grid, mark_hidden_cells, relax_unknown_cells
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

MAX_TRUSTED_DISTANCE_CELLS = 3.0
"""Distances are taken at their word up to so many cells."""
EMPTIER_VIEWS_FRACTION = 0.4
"""Share of the views that see a cell which may take it for emptier than it is."""
MIN_WITNESS_VIEWS_FRACTION = 0.04
"""Share of all views that must see a cell, and at least one."""
MIN_PLATE_THICKNESS_CELLS = 1.5
"""How thick what lies flat on the floor is at least [cells]."""
SILHOUETTE_TOLERANCE_PX = 1.0
"""Rays through pixels next to those that show an object miss it by so little [px]."""
CRUST_CELLS = 1
"""A camera sees through so many cells of what is not free: a surface is as rough."""
FILL_RELAX_ITERATIONS = 100
"""Of filling in what no view observes."""


@dataclass(frozen=True)
class VoxelGrid:
    """Cubic cells; X, Y, Z of them."""

    low: Vector
    """Middle of the first cell [m]."""
    cell: float
    """[m]"""
    shape: tuple[int, int, int]

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Middles of the cells along x, y and z [m]."""
        x, y, z = (a + self.cell * np.arange(n) for a, n in zip(self.low, self.shape, strict=True))
        return x, y, z

    def points(self, chosen: Bool[np.ndarray, "X Y Z"]) -> Float[np.ndarray, "N 3"]:
        """Middles of the chosen cells [m]."""
        return np.array(self.low) + self.cell * np.argwhere(chosen)

    def at(self, places: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, "N 3"]:
        """Which cells places are in; beside the grid, the nearest ones."""
        found = np.round((places - np.array(self.low)) / self.cell).astype(int)
        return np.clip(found, 0, np.array(self.shape) - 1)


def grid_over_box(low: np.ndarray, high: np.ndarray, cells: int, floor: float, finest: float = 0.0) -> VoxelGrid:
    """Return a grid of about so many cells over a box, with the floor half-way between two layers.

    finest: no cell is smaller [m].
    """
    span = np.maximum(high - low, 1e-9)
    cell = max(float(np.cbrt(np.prod(np.maximum(span, span.max() / 50)) / cells)), finest)
    start = np.array(low, dtype=float)
    start[2] = floor + cell * (np.floor((low[2] - floor) / cell) + 0.5)
    x, y, z = (int(n) for n in np.ceil((high - start) / cell) + 1)
    return VoxelGrid((float(start[0]), float(start[1]), float(start[2])), cell, (x, y, z))


def carve_signed_distance(
    grid: VoxelGrid, rendering: DepthRendering, floor: float, pool: ThreadPool
) -> Float32[np.ndarray, "X Y Z"]:
    """Return the signed distance to what is seen, cut off at a few cells [m]; positive outside.

    Nothing is below the floor: what is seen there, or closely above it, is a plate that lies on it.
    """
    field = np.empty(grid.shape, np.float32)
    place = np.array([*grid.low, grid.cell])
    reach = MAX_TRUSTED_DISTANCE_CELLS * grid.cell
    rule = np.array([reach, EMPTIER_VIEWS_FRACTION, max(1, round(MIN_WITNESS_VIEWS_FRACTION * len(rendering.depth)))])
    rest = (
        place,
        rendering.rows,
        _lift_to_plate(rendering, floor + MIN_PLATE_THICKNESS_CELLS * grid.cell),
        rule,
        field,
    )
    pool.each(carve_grid, [(*span, *rest) for span in pool.spans(grid.shape[0])])
    # Where a surface lets some light through, only rays that leak through it see what is behind.
    blind = np.empty(grid.shape, np.bool_)
    rest = place, rendering.rows, field, CRUST_CELLS, int(rule[2]), blind
    pool.each(mark_hidden_cells, [(*span, *rest) for span in pool.spans(grid.shape[0])])
    field[blind] = np.nan
    above = grid.axes[2] > floor
    room = field[:, :, above]  # the floor is no witness: below it everything is unknown
    unseen = np.isnan(room)
    room[unseen] = -reach
    relax_unknown_cells(room, np.argwhere(unseen), FILL_RELAX_ITERATIONS)
    field[:, :, above] = room
    field[:, :, ~above] = -reach
    np.maximum(field, (floor - grid.axes[2]).astype(np.float32), out=field)
    return field


def _lift_to_plate(rendering: DepthRendering, top: float) -> Float32[np.ndarray, "V H W"]:
    """Return depths with what objects show lower than a plate's upper side lifted to it [m].

    Where nothing is seen: minus the distance to what is [px], as far as that is near.
    """
    lifted = rendering.depth.copy()
    height, width = lifted.shape[1:]
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    for depth, met, row in zip(lifted, rendering.met, rendering.rows, strict=True):
        turn, shift = row[:12].reshape(3, 4)[:, :3], row[:12].reshape(3, 4)[:, 3]
        fx, fy, cx, cy = row[12:16]
        up = turn[0, 2] * (u - cx) / fx + turn[1, 2] * (v - cy) / fy + turn[2, 2]
        eye = -float(turn[:, 2] @ shift)
        with np.errstate(invalid="ignore"):
            below = (met >= 0) & (up < 0) & (eye + depth * up < top)
        depth[below] = ((top - eye) / up[below]).astype(np.float32)
        nothing = np.isinf(depth)
        edge = nothing & binary_dilation(~nothing)
        depth[nothing], depth[edge] = -np.inf, -SILHOUETTE_TOLERANCE_PX
    return lifted
