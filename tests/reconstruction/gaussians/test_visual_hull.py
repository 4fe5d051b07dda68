"""What all masks allow; pieces of it where there is nothing."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import label
from splat_scenes import around

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians import visual_hull
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

CAMERAS = around(5, (64, 64), focal=80.0)


def balls(seed):
    """Four balls at random: centres and radii."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.8, 0.8, (4, 3)), rng.uniform(0.1, 0.25, 4)


def masks_of(centres, radii, cameras):
    made = []
    for camera in cameras:
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        local = np.linalg.solve(camera.K, np.stack([u.ravel(), v.ravel(), np.ones(u.size)]))
        rays = local.T @ camera.world_from_camera[:3, :3].T
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        away = np.cross(rays[:, None], centres - camera.world_from_camera[:3, 3])
        made.append((np.linalg.norm(away, axis=-1) < radii).any(axis=1).reshape(v.shape))
    return np.stack(made)


def pieces(seed, config):
    """Return which ball the middle of each piece of the hull is in; -1: none, a phantom."""
    centres, radii = balls(seed)
    masks = masks_of(centres, radii, CAMERAS)
    views = Views(np.zeros((*masks.shape, 3), np.uint8), CAMERAS)
    with ThreadPool(1) as pool:
        found = visual_hull.carve_tight_hull(views, masks, pool, config)
    piece, count = label(found.inside, np.ones((3, 3, 3)))
    middles = np.stack([found.cells[piece == k + 1].mean(axis=0) for k in range(count)])
    inside = np.linalg.norm(middles[:, None] - centres, axis=-1) < radii
    return sorted(np.where(inside.any(axis=1), inside.argmax(axis=1), -1).tolist())


def test_of_five_views_objects_are_left_and_hardly_a_phantom():
    seeds = range(8)
    coarse = HullConfig(grid_cells=100_000)
    found = [pieces(seed, coarse) for seed in seeds]
    all_pieces = [pieces(seed, replace(coarse, phantom_max_views=0)) for seed in seeds]
    things = [[k for k in one if k >= 0] for one in all_pieces]
    assert [[k for k in one if k >= 0] for one in found] == things
    phantoms, control = (sum(one.count(-1) for one in many) for many in (found, all_pieces))
    assert phantoms < 0.2 * control


def test_what_many_views_see_is_left_though_others_would_fill_its_masks():
    most = DEFAULT_HULL.phantom_max_views
    masks = np.ones((most + 1, 64, 64), bool)
    cameras = around(len(masks), (64, 64), focal=80.0)
    cells = np.stack(np.meshgrid(*3 * [np.linspace(-0.2, 0.2, 9)], indexing="ij"), axis=-1)
    inside = np.zeros(cells.shape[:3], bool)
    inside[:7], inside[8, 4, 4] = True, True
    carved = visual_hull.VisualHull(cells, 0.05, inside)
    views = Views(np.zeros((*masks.shape, 3), np.uint8), cameras)
    for seen, left in ((most + 1, 2), (most, 1)):
        by = np.full(inside.shape, float(seen))
        found = visual_hull._without_phantoms(carved, by, views, masks)
        assert label(found.inside)[1] == left
