"""Space carved by what cameras see: what lies flat on the floor."""

import numpy as np
import pytest

from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.space_carving import carve_signed_distance, grid_over_box
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

SIZE, ABOVE = 32, 2.0
"""Of a picture [px]; height of a camera that looks straight down [m]."""


@pytest.mark.parametrize("height", [-0.01, 0.001, 0.01])
def test_what_lies_flat_on_the_floor_is_a_plate(height):
    """Depths that are off by less than a cell left holes in it."""
    down = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, ABOVE]])
    rows = np.array([[*down.ravel(), SIZE, SIZE, SIZE / 2, SIZE / 2, SIZE, SIZE]])
    depth = np.full((1, SIZE, SIZE), ABOVE - height, np.float32)
    met, rgb = np.zeros(depth.shape, np.int32), np.zeros((*depth.shape, 3), np.float32)
    grid = grid_over_box(np.array([-0.5, -0.5, -0.1]), np.array([0.5, 0.5, 0.4]), 20_000, 0.0)
    assert grid.cell > 0.02
    with ThreadPool(1) as pool:
        field = carve_signed_distance(grid, DepthRendering(rgb, depth, depth, met, rows), 0.0, pool)
    first = int(np.argmax(grid.axes[2] > 0))
    assert (field[..., first] < 0).all()
    assert (field[..., first + 2 :] > 0).all()
