"""Places that hardly a camera can look into are not free, whatever leaks through a surface."""

import itertools

import numpy as np

from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.space_carving import carve_signed_distance, grid_over_box
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

SIZE, AWAY, RADIUS, HEIGHT = 96, 3.0, 0.5, 0.6
"""Of a picture [px]; distance of the cameras, radius and height of the ball they look at [m]."""
VIEWS, LEAKING = 48, 7
"""One view of so many sees through the ball's front."""
MIDDLE = np.array([0, 0, HEIGHT])


def looking(depth_of):
    """What cameras on a spiral over the ball's upper half see: depths of rays (H, W, 3)."""
    v, u = np.indices((SIZE, SIZE)) + 0.5
    local = np.stack([u / SIZE - 0.5, v / SIZE - 0.5, np.ones_like(u)], axis=-1)
    rows, depths = [], []
    for k, z in enumerate(np.linspace(0.1, 0.95, VIEWS)):
        around = np.pi * (1 + 5**0.5) * k
        way = np.array([*np.sqrt(1 - z * z) * np.array([np.cos(around), np.sin(around)]), z])
        right = np.cross(-way, [0, 0, 1.0]) / np.sqrt(1 - z * z)
        turn, eye = np.stack([right, np.cross(-way, right), -way]), AWAY * way + MIDDLE
        pose = np.concatenate([turn, -(turn @ eye)[:, None]], axis=1)
        rows.append([*pose.ravel(), SIZE, SIZE, SIZE / 2, SIZE / 2, SIZE, SIZE])
        depths.append(depth_of(eye, local @ turn))
    depth = np.stack(depths).astype(np.float32)
    met = np.where(np.isfinite(depth), 0, -1).astype(np.int32)
    rgb = np.zeros((*depth.shape, 3), np.float32)
    return DepthRendering(rgb, depth, depth, met, np.array(rows))


def met(eye, rays, radius, side):
    """Depth at which rays enter (side -1) or leave (1) a ball; inf: they pass it by."""
    off = eye - MIDDLE
    a, b, c = (rays**2).sum(axis=-1), rays @ off, off @ off - radius**2
    root = b * b - a * c
    return np.where(root > 0, (-b + side * np.sqrt(np.maximum(root, 0))) / a, np.inf)


def space(seen):
    """Return the carved distance, how far from the ball's middle cells are, and the grid."""
    grid = grid_over_box(np.array([-0.6, -0.6, 0.0]), np.array([0.6, 0.6, 1.2]), 120_000, 0.0)
    with ThreadPool(1) as pool:
        field = carve_signed_distance(grid, seen, 0.0, pool)
    far = np.linalg.norm(grid.points(np.ones(grid.shape, bool)) - MIDDLE, axis=1)
    return field, far.reshape(grid.shape), grid


def test_rays_that_leak_through_a_front_leave_no_cavern_behind_it():
    """Views from which it is whole say nothing of what is behind: all that speak call it free."""
    through = itertools.cycle([0.2 * RADIUS] + (LEAKING - 1) * [0.0])
    field, far, grid = space(looking(lambda e, r: met(e, r, RADIUS, -1) + next(through)))
    seen = grid.axes[2] > HEIGHT - 0.6 * RADIUS
    deep = (far < RADIUS - 2 * grid.cell) & seen
    assert np.mean(field[deep] > 0) < 1e-3
    assert (field[(far > RADIUS + 2 * grid.cell)] > 0).all()


def test_a_hollow_that_cameras_look_into_stays_free():
    """The upper half of the ball is gone, and a hollow of .8 of its radius is in the rest."""

    def bowl(eye, rays):
        flat = (HEIGHT - eye[2]) / rays[..., 2]
        off = np.linalg.norm(eye + flat[..., None] * rays - MIDDLE, axis=-1)
        within = np.where(off < 0.8 * RADIUS, met(eye, rays, 0.8 * RADIUS, 1), flat)
        below = met(eye, rays, RADIUS, -1)
        with np.errstate(invalid="ignore"):
            below[(eye + below[..., None] * rays)[..., 2] > HEIGHT] = np.inf
        return np.where((off < RADIUS) & (flat > 0), within, below)

    field, far, grid = space(looking(bowl))
    z = np.broadcast_to(grid.axes[2], field.shape)
    assert (field[(far < 0.8 * RADIUS - 2 * grid.cell) & (z > HEIGHT - 0.6 * RADIUS)] > 0).all()
    wall = (far > 0.85 * RADIUS) & (far < 0.95 * RADIUS) & (z < HEIGHT - 2 * grid.cell)
    assert (field[wall] < 0).all()
