"""Surfaces go where photographs agree that they are, and nowhere else."""

import numpy as np
import pytest
import trimesh
from scipy.ndimage import gaussian_filter, map_coordinates
from splat_scenes import around

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import camera_rows
from corporeal.reconstruction.surface.photo_consistency import move_to_agreement, object_photographs
from corporeal.reconstruction.surface.remove_flakes import remove_flakes

SIZE, FOCAL, AWAY = 96, 150.0, 3.0
PIXEL = AWAY / FOCAL
HALF = 0.6
"""Half the side of a plate at z = 0 [m]."""
BUMP = 1.5
"""Height of bumps of the surface that is begun with [px]."""
FLOOR = -10.0


def eyes():
    every = around(32, (SIZE, SIZE), AWAY, FOCAL, np.zeros(3))
    return tuple(c for c in every if c.world_from_camera[2, 3] > 0.45 * AWAY)


def bumpy():
    """A surface with bumps where a plate is; its vertices are a pixel apart."""
    line = np.arange(-HALF, HALF, PIXEL)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    z = BUMP * PIXEL * np.sin(2 * np.pi * x / (10 * PIXEL)) * np.cos(2 * np.pi * y / (12 * PIXEL))
    n = len(line)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + 1], 1), np.stack([a + 1, a + n, a + n + 1], 1)])
    return Mesh(np.stack([x, y, z], axis=1), faces)


def pattern(seed=0, smooth=1.5):
    blots = gaussian_filter(np.random.default_rng(seed).normal(size=(256, 256, 3)), (smooth, smooth, 0))
    return 0.5 + 0.15 * blots / blots.std()


def photographs(colour):
    """What cameras see of a plate at z = 0; colour: of places and ways of rays (N, 3), (N, 3)."""
    out, rng = [], np.random.default_rng(1)
    v, u = (np.indices((SIZE, SIZE)).reshape(2, -1)) + 0.5
    for c in eyes():
        ray = np.stack([u, v, np.ones_like(u)], axis=1) @ np.linalg.inv(c.K).T
        ray = ray @ c.world_from_camera[:3, :3].T
        eye = c.world_from_camera[:3, 3]
        place = eye - ray * (eye[2] / ray[:, 2])[:, None]
        rgb = colour(place, ray) * np.exp(0.1 * rng.normal()) + 0.005 * rng.normal(size=(len(u), 3))
        out.append(np.clip(np.round(255 * rgb), 0, 255).astype(np.uint8).reshape(SIZE, SIZE, 3))
    return np.stack(out)


def shown(picture, places):
    """The pattern's colours at places x, y; it repeats, and one of its cells is a pixel."""
    at = (places[:, :2] / PIXEL).T % 256
    return np.stack([map_coordinates(p, at, order=1, mode="grid-wrap") for p in picture.T], axis=1)


def heights(colour, movable=True):
    """Heights over the plate before and after [px], away from its rim."""
    begun, rows = bumpy(), camera_rows(eyes())
    rows = np.concatenate([rows, np.full((len(rows), 2), SIZE)], axis=1)
    rgb = photographs(colour)
    pictures = object_photographs(rgb, np.ones(rgb.shape[:3], bool), rows, PIXEL)
    with ThreadPool(1) as pool:
        may = np.full(len(begun.vertices), movable)
        made = move_to_agreement(begun, pictures, may, PIXEL, FLOOR, pool)
    inner = np.abs(begun.vertices[:, :2]).max(axis=1) < HALF - 6 * PIXEL
    return begun.vertices[inner, 2] / PIXEL, made.mesh.vertices[inner, 2] / PIXEL


def test_bumps_of_a_patterned_face_go_though_exposures_differ():
    picture = pattern()
    before, after = heights(lambda place, ray: shown(picture, place))
    assert np.percentile(np.abs(before), 95) > 1.1
    assert np.percentile(np.abs(after), 95) < 0.3
    assert abs(np.median(after)) < 0.1


def test_a_plain_face_stays_where_it_is():
    before, after = heights(lambda place, ray: np.full((len(place), 3), 0.5))
    assert np.abs(after - before).max() < 0.5


@pytest.mark.filterwarnings("error")
def test_what_no_photograph_may_move_stays_and_nothing_is_divided_by_nothing():
    before, after = heights(lambda place, ray: np.full((len(place), 3), 0.5), movable=False)
    assert np.abs(after - before).max() < 0.1


def test_a_mirror_stays_where_it_is():
    """What it shows lies as far behind it as a patterned ceiling is above it."""
    picture = pattern()

    def ceiling(place, ray):
        away = 1.0 / np.abs(ray[:, 2])
        return shown(picture, place + away[:, None] * ray * [1, 1, 0])

    before, after = heights(ceiling)
    assert np.abs(after - before).max() < 0.5


def fine(sides, middle):
    """A box in triangles of about a pixel."""
    box = trimesh.creation.box(sides).subdivide_to_size(1.5 * PIXEL)
    return box.apply_translation(middle)


def test_a_sheet_before_a_face_is_laid_on_it():
    body = fine([0.5, 0.5, 0.5], [0, 0, 0])
    sheet = fine([0.5 * PIXEL, 0.2, 0.2], [0.25 + 1.75 * PIXEL, 0, 0])
    both = trimesh.util.concatenate([body, sheet])
    begun = Mesh(np.asarray(both.vertices), np.asarray(both.faces))
    made = remove_flakes(begun, PIXEL, FLOOR)
    assert np.ptp(begun.vertices[:, 0]) == pytest.approx(0.5 + 2 * PIXEL)
    assert np.ptp(made.vertices[:, 0]) < 0.5 + 0.5 * PIXEL


def test_a_thin_plate_is_no_sheet():
    plate = fine([0.5 * PIXEL, 0.5, 0.5], [0, 0, 0])
    begun = Mesh(np.asarray(plate.vertices), np.asarray(plate.faces))
    assert remove_flakes(begun, PIXEL, FLOOR) is begun
