"""What cameras see through is empty; what they see is not."""

import numpy as np
import pytest

from corporeal.core.types import Camera, Views
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.reconstruction.gaussians import carved_volume
from corporeal.reconstruction.gaussians.hull_config import HullConfig
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

HALF, WALL, HEIGHT = 1.0, 0.25, 1.2
"""A box without a lid: half its width, its walls and bottom, its height [m]."""
SIDE = 0.05


def camera_at(eye, target=(0.0, 0.0, 0.6)):
    ahead = (np.array(target) - eye) / np.linalg.norm(np.array(target) - eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(ahead, right), ahead, eye], axis=1)
    return Camera(np.array([[90.0, 0, 48], [0, 90, 48], [0, 0, 1]]), pose, 96, 96)


@pytest.fixture(scope="module")
def cameras():
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    eyes = [np.array([3 * np.cos(t), 3 * np.sin(t), 4.0]) for t in turns]
    return tuple(camera_at(eye) for eye in eyes)


@pytest.fixture(scope="module")
def lines(cameras):
    """Points on the inner faces, and which camera sees which through the mouth."""
    rng, inner = np.random.default_rng(0), HALF - WALL
    floor = np.column_stack([rng.uniform(-inner, inner, (1500, 2)), np.full(1500, WALL)])
    along, high = rng.uniform(-inner, inner, 1500), rng.uniform(WALL, HEIGHT, 1500)
    sides = np.column_stack([np.full(1500, inner), along, high])
    for k in range(4):
        c, s = np.cos(k * np.pi / 2), np.sin(k * np.pi / 2)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        floor = np.concatenate([floor, sides[k::4] @ turn.T])
    pairs = []
    for k, camera in enumerate(cameras):
        eye = camera.world_from_camera[:3, 3]
        share = (HEIGHT - floor[:, 2]) / (eye[2] - floor[:, 2])
        at_mouth = floor + share[:, None] * (eye - floor)
        seen = np.flatnonzero((np.abs(at_mouth[:, :2]) < inner).all(axis=1))
        pairs.append(np.column_stack([np.full(len(seen), k), seen]))
    view, point = np.concatenate(pairs).T
    return LinesOfSight(floor, view, point)


def grid():
    line = np.arange(-1.5, 1.5, SIDE) + SIDE / 2
    up = np.arange(0.0, 2.2, SIDE) + SIDE / 2
    return np.stack(np.meshgrid(line, line, up, indexing="ij"), axis=-1)


def test_the_hollow_of_an_open_box_is_empty_and_its_walls_are_not(lines, cameras):
    cells = grid()
    empty = lines.emptied(cameras, cells[0, 0, 0], SIDE, cells.shape[:3])
    x, y, z = np.abs(cells[..., 0]), np.abs(cells[..., 1]), cells[..., 2]
    wide, inner = np.maximum(x, y), HALF - WALL
    mouth = (wide < 0.5) & (z > HEIGHT) & (z < HEIGHT + 0.3)
    hollow = (wide < inner - 5 * SIDE) & (z > WALL + 6 * SIDE) & (z < HEIGHT)
    rim = HEIGHT - 2 * SIDE  # lines graze faces within a cell or two
    solid = (wide < HALF) & (z < rim) & ((wide > inner + 2 * SIDE) | (z < WALL - 2 * SIDE))
    assert empty[mouth].mean() > 0.98
    assert empty[hollow].mean() > 0.95
    assert not empty[solid].any()


def test_one_view_alone_empties_nothing(lines, cameras):
    cells = grid()
    alone = lines.only([3])
    assert len(alone.view) > 100
    assert not alone.emptied(cameras[3:4], cells[0, 0, 0], SIDE, cells.shape[:3]).any()


def test_a_point_behind_a_wall_that_two_views_mistake_costs_a_line_not_the_wall(cameras):
    wrong = LinesOfSight(np.array([[0.0, 0.0, 0.1]]), np.array([0, 4]), np.array([0, 0]))
    cells = grid()
    assert wrong.emptied(cameras, cells[0, 0, 0], SIDE, cells.shape[:3]).sum() < 300


def test_views_that_are_left_out_take_their_lines_along(lines):
    some = lines.only([5, 2])
    np.testing.assert_array_equal(some.seen_by(0), lines.seen_by(5))
    np.testing.assert_array_equal(some.seen_by(1), lines.seen_by(2))
    assert set(some.view) == {0, 1}


def test_the_hull_of_an_open_box_seen_from_above_has_no_lid(lines, cameras):
    coarse = HullConfig(grid_cells=100_000)
    cells = grid()
    places = cells[(np.abs(cells[..., :2]).max(axis=-1) < HALF) & (cells[..., 2] < HEIGHT)]
    masks = np.zeros((len(cameras), 96, 96), bool)
    for mask, camera in zip(masks, cameras, strict=True):
        local = (places - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
        u, v = (local[:, :2] / local[:, 2:] * 90 + 48).astype(int).T
        mask[v, u] = True
    views = Views(np.zeros((*masks.shape, 3), np.uint8), cameras)
    with ThreadPool(1) as pool:
        with_lines = carved_volume.carve_volume(views, masks, lines, pool, coarse)
        without = carved_volume.carve_volume(views, masks, None, pool, coarse)
    tops = [o.hull.cells[o.hull.inside][:, 2].max() for o in (without, with_lines)]
    assert tops[0] > HEIGHT + 0.3, "nothing but masks leaves a roof over the mouth"
    assert tops[1] < HEIGHT + 0.15
    middle = np.array([[0.0, 0.0, 1.0], [HALF - WALL / 2, 0.0, 0.6], [50.0, 0.0, 0.0]])
    np.testing.assert_array_equal(with_lines.emptied(middle), [True, False, False])
    assert not without.emptied(middle).any()
