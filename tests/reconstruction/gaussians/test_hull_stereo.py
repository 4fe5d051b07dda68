"""What pictures agree on inside the visual hull empties the way to it, and nothing else."""

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Camera, Views
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.hull_config import HullConfig
from corporeal.reconstruction.gaussians.hull_stereo import hull_cells_seen_past
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import carve_tight_hull
from corporeal.reconstruction.surface.refine_depth import fill_plain_depth, refine_depth

HALF, WALL, HEIGHT, SIZE = 1.0, 0.25, 1.2, 96
"""A box without a lid: half its width, its walls and bottom, its height [m]; pictures [px]."""
COARSE = HullConfig(grid_cells=60_000)
INNER, WAVES = HALF - WALL, 6
"""Of the grain, in each colour."""


def block(low, high):
    return trimesh.creation.box(bounds=[low, high])


def without_lid():
    sides = [
        block([-HALF, -HALF, 0], [-INNER, HALF, HEIGHT]),
        block([INNER, -HALF, 0], [HALF, HALF, HEIGHT]),
        block([-INNER, -HALF, 0], [INNER, -INNER, HEIGHT]),
        block([-INNER, INNER, 0], [INNER, HALF, HEIGHT]),
    ]
    return trimesh.util.concatenate([*sides, block([-INNER, -INNER, 0], [INNER, INNER, WALL])])


def cameras():
    """From all around, and from above: the roof over the mouth is no silhouette's."""
    found = []
    for turn in np.linspace(0, 2 * np.pi, 16, endpoint=False):
        eye = np.array([3 * np.cos(turn), 3 * np.sin(turn), 4.0])
        ahead = np.array([0, 0, HEIGHT / 2]) - eye
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1]) / np.linalg.norm(np.cross(ahead, [0, 0, 1]))
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(ahead, right), ahead, eye], axis=1)
        K = np.array([[SIZE, 0, SIZE / 2], [0, SIZE, SIZE / 2], [0, 0, 1.0]])
        found.append(Camera(K, pose, SIZE, SIZE))
    return tuple(found)


def photographed(solid, contrast):
    """Return pictures of a solid whose grain goes all through it, each otherwise exposed."""
    rng, eyes = np.random.default_rng(0), cameras()
    waves, phases = 8 * rng.normal(size=(3 * WAVES, 3)), 6 * rng.random(3 * WAVES)
    rgb = np.full((len(eyes), SIZE, SIZE, 3), 40, np.uint8)
    masks = np.zeros(rgb.shape[:3], bool)
    v, u = (i.ravel() + 0.5 for i in np.indices((SIZE, SIZE)))
    local = np.stack([u - SIZE / 2, v - SIZE / 2, np.full(u.shape, SIZE)], axis=1)
    for k, eye in enumerate(eyes):
        rays = local @ eye.world_from_camera[:3, :3].T
        origins = np.broadcast_to(eye.world_from_camera[:3, 3], rays.shape)
        places, ray, _ = solid.ray.intersects_location(origins, rays, multiple_hits=False)
        grain = np.sin(places @ waves.T + phases).reshape(-1, WAVES, 3).mean(axis=1)
        shade = (0.4 + contrast * grain) * rng.uniform(0.7, 1.3)
        rgb[k].reshape(-1, 3)[ray] = np.clip(255 * shade, 0, 255)
        masks[k].ravel()[ray] = True
    return Views(rgb, eyes), masks


def emptied(solid, contrast):
    views, masks = photographed(solid, contrast)
    with ThreadPool(1) as pool:
        found = carve_tight_hull(views, masks, pool, COARSE)
        return found, hull_cells_seen_past(views, masks, found, pool)


@pytest.mark.slow
def test_stereo_opens_a_box_that_all_look_into_and_leaves_its_walls():
    found, empty = emptied(without_lid(), 0.25)
    x, y, z = np.moveaxis(found.cells, -1, 0)
    wide, cell = np.maximum(abs(x), abs(y)), found.side
    roof = found.inside & (z > HEIGHT + 2 * cell)
    assert roof.sum() > 0.05 * (found.inside & (z > 0)).sum(), "nothing but masks leaves a roof"
    assert empty[roof].mean() > 0.9
    hollow = (wide < INNER - 3 * cell) & (z > WALL + 4 * cell) & (z < HEIGHT)
    assert empty[hollow].mean() > 0.8
    walls = found.inside & (wide > INNER + cell) & (wide < HALF - cell) & (z < HEIGHT - 2 * cell)
    assert empty[walls].mean() < 0.02
    assert not empty[~found.inside].any()


@pytest.mark.slow
def test_what_is_full_stays_full():
    full = block([-HALF, -HALF, 0], [HALF, HALF, HEIGHT])
    found, empty = emptied(full, 0.25)
    x, y, z = np.moveaxis(found.cells, -1, 0)
    inside = (np.maximum(abs(x), abs(y)) < HALF) & (z < HEIGHT - found.side) & found.inside
    assert inside.sum() > 5000
    assert empty[inside].mean() < 0.01


def test_plain_pictures_empty_nothing():
    _, empty = emptied(without_lid(), 0.0)
    assert not empty.any()


def test_the_number_of_threads_changes_nothing():
    config = HullConfig(grid_cells=20_000)
    views, masks = photographed(without_lid(), 0.25)
    views, masks = Views(views.rgb[::4], views.cameras[::4]), masks[::4]
    results = []
    for count in (1, 3):
        with ThreadPool(count) as pool:
            hull = carve_tight_hull(views, masks, pool, config)
            results.append(hull_cells_seen_past(views, masks, hull, pool))
    np.testing.assert_array_equal(*results)


def depths(solid):
    """Along z, of every pixel of all cameras; inf: beside the solid."""
    found = np.full((len(cameras()), SIZE, SIZE), np.inf, np.float32)
    v, u = (i.ravel() + 0.5 for i in np.indices((SIZE, SIZE)))
    local = np.stack([u / SIZE - 0.5, v / SIZE - 0.5, np.ones(u.shape)], axis=1)
    for k, eye in enumerate(cameras()):
        rays, origin = local @ eye.world_from_camera[:3, :3].T, eye.world_from_camera[:3, 3]
        origins = np.broadcast_to(origin, rays.shape)
        places, ray, _ = solid.ray.intersects_location(origins, rays, multiple_hits=False)
        found[k].ravel()[ray] = (places - origin) @ eye.world_from_camera[:3, 2]
    return found


@pytest.fixture
def lidless():
    """A box without a lid, of which Gaussians show one: its photographs, masks and both depths."""
    shown, true = depths(block([-HALF, -HALF, 0], [HALF, HALF, HEIGHT])), depths(without_lid())
    return *photographed(without_lid(), 0.25), shown, true


def deeper(views, masks, shown, far):
    met, rows = np.zeros(shown.shape, np.int32), np.zeros((len(shown), 18))
    with ThreadPool(1) as pool:
        rendering = DepthRendering(views.rgb, shown, far, met, rows)
        return refine_depth(rendering, views, masks, pool, COARSE).depth


@pytest.mark.slow
def test_photographs_see_below_a_thin_lid_of_gaussians(lidless):
    """Through a lid that hides less than half they know better, and leave its sides."""
    views, masks, shown, true = lidless
    found, on = deeper(views, masks, shown, np.full_like(true, np.inf)), np.isfinite(true)
    lid, sides = on & (true > shown + 0.3), on & (true < shown + 0.01)
    assert lid.mean() > 0.05
    assert np.median(true[lid] - shown[lid]) > 1
    assert (np.abs(found[lid] - true[lid]) < 0.25).mean() > 0.7
    assert (found[sides] < true[sides] + 0.05).mean() > 0.98
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(shown))


@pytest.mark.slow
def test_what_hides_most_light_is_no_lid(lidless):
    """As in a mirror: photographs agree on what lies behind its face, and Gaussians hide it."""
    views, masks, shown, _ = lidless
    found = deeper(views, masks, shown, shown + 0.1)
    assert (found > shown).any()
    assert (found <= shown + np.float32(0.1001)).all()


def test_a_plain_face_goes_on_between_known_depths():
    """A slanted plane: what is plain lies on it, what is not stays unknown."""
    rows, columns = np.mgrid[:24, :30]
    true = 1 / (0.2 + 0.004 * rows + 0.003 * columns)
    known = (rows < 4) | (rows > 19) | (columns < 4) | (columns > 25)
    plain = columns < 20
    found = fill_plain_depth(np.where(known, true, np.inf), np.ones(true.shape, bool), plain)
    there = known | plain
    np.testing.assert_allclose(found[there], true[there], rtol=1e-3)
    assert np.isinf(found[~there]).all()
    nothing = np.full(true.shape, np.inf)
    assert np.isinf(fill_plain_depth(nothing, np.ones(true.shape, bool), plain)).all()
