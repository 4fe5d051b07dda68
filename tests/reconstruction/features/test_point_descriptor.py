from dataclasses import replace

import numpy as np
import pytest
from box_scenes import TWO, around, cast, on_faces

from corporeal.multiview.point_cloud_geometry import nearest_neighbours, point_normals
from corporeal.reconstruction.features.feature_lifting import back_projection, visible_points
from corporeal.reconstruction.features.point_descriptor import (
    DEFAULT_DESCRIPTOR,
    DESCRIPTOR_CHANNELS,
    GAMUT_RADIUS_LAB100,
    MAX_COLOUR_SPREAD_LAB100,
    mean_view_directions,
    point_descriptor,
)

RADIUS = np.sqrt(GAMUT_RADIUS_LAB100**2 + MAX_COLOUR_SPREAD_LAB100**2 + 0.1**2 + 0.5 * 0.5**2 + (0.3 * 0.5) ** 2)


@pytest.fixture(scope="module")
def boxes():
    return on_faces(TWO, 1000, np.random.default_rng(0))


def distance(a, b):
    return np.linalg.norm(a.astype(float) - b.astype(float), axis=-1)


def test_descriptors_are_unit_whatever_the_colour(boxes):
    position, normal, _ = boxes
    rng = np.random.default_rng(1)
    colour = np.round(rng.random(position.shape))
    made = point_descriptor(position, colour, normal, rng.random((len(position), 2)))
    assert made.shape == (2000, DESCRIPTOR_CHANNELS) and made.dtype == np.float16
    np.testing.assert_allclose(np.linalg.norm(made.astype(float), axis=1), 1, atol=2e-3)


def test_black_and_white_are_as_far_apart_as_their_weight_says(boxes):
    position, normal, _ = boxes
    black = point_descriptor(position, np.zeros_like(position), normal)
    white = point_descriptor(position, np.ones_like(position), normal)
    np.testing.assert_allclose(distance(black, white), 1 / RADIUS, rtol=5e-3)


def test_colours_that_look_alike_are_close_and_others_are_not(boxes):
    position, normal, _ = boxes
    sides = (
        point_descriptor(position, np.tile(colour, (2000, 1)), normal)
        for colour in ([0.8, 0.1, 0.1], [0.75, 0.12, 0.1], [0.1, 0.3, 0.8])
    )
    red, like, blue = sides
    assert (distance(red, like) < 0.2 * distance(red, blue)).all()


def test_texture_is_distinguished_from_a_plain_surface_of_the_same_mean():
    rng = np.random.default_rng(2)
    position = np.column_stack([rng.uniform(0, 1, (4000, 2)), np.zeros(4000)])
    up = np.tile([0, 0, 1.0], (4000, 1))
    plain = np.full((4000, 3), 0.5)
    mottled = np.clip(plain + rng.choice([-0.2, 0.2], (4000, 1)), 0, 1)
    a, b = point_descriptor(position, plain, up), point_descriptor(position, mottled, up)
    assert a[:, 3].max() == 0
    spread = b[:, 3].astype(float) * RADIUS
    np.testing.assert_allclose(np.median(spread), 0.2, atol=0.02)


def test_finish_counts_where_it_is_known(boxes):
    position, normal, _ = boxes
    colour = np.full_like(position, 0.5)
    unknown = point_descriptor(position, colour, normal)
    middling = point_descriptor(position, colour, normal, np.full((2000, 2), 0.5))
    np.testing.assert_array_equal(unknown, middling)
    chalk = point_descriptor(position, colour, normal, np.tile([1.0, 0.0], (2000, 1)))
    metal = point_descriptor(position, colour, normal, np.tile([0.0, 1.0], (2000, 1)))
    np.testing.assert_allclose(distance(chalk, metal), 0.5 * np.sqrt(2) / RADIUS, rtol=5e-3)


def test_where_the_scene_stands_and_in_which_unit_does_not_matter(boxes):
    position, normal, owner = boxes
    colour = np.where(owner[:, None] == 0, [0.8, 0.2, 0.1], [0.2, 0.2, 0.9])
    here = point_descriptor(position, colour, normal)
    there = point_descriptor(1000 * position + [3, 4, 5], colour, normal)
    assert (distance(here, there) < 2e-3).mean() > 0.999


def test_a_look_without_weight_does_not_count(boxes):
    position, normal, _ = boxes
    rng = np.random.default_rng(3)
    config = replace(DEFAULT_DESCRIPTOR, colour=0.0, spread=0.0)
    a, b = (point_descriptor(position, rng.random((2000, 3)), normal, None, config) for _ in range(2))
    np.testing.assert_array_equal(a, b)


def test_boxes_of_two_colours_are_distinguished_from_their_pictures():
    """From views alone: colours and outsides are lifted, the descriptor's two clusters are them."""
    cameras = around(12)
    paint = np.array([[1.0, 1.0, 1.0], [0.8, 0.2, 0.1], [0.15, 0.3, 0.8]])
    views = [cast(TWO, camera) for camera in cameras]
    depth = np.stack([d for d, _ in views])
    position, normal, owner = on_faces(TWO, 3000, np.random.default_rng(4))
    lifted = back_projection(position, cameras, depth, [paint[w + 1] for _, w in views])
    shown = [visible_points(position, c, d) for c, d in zip(cameras, depth, strict=True)]
    towards = mean_view_directions(position, cameras, shown)
    found = point_normals(position, nearest_neighbours(position, 16), towards)
    flat = np.abs(np.sum(found * normal, 1)) > 0.95
    often = lifted.seen > 2
    assert (np.sum(found * normal, 1)[flat & often] > 0).mean() > 0.98
    under = (normal[:, 2] == -1) & (lifted.seen == 0) & flat
    assert (found[under, 2] < 0).mean() > 0.99
    made = point_descriptor(position, lifted.mean.astype(float), towards)[often].astype(float)
    red, blue = (np.median(made[owner[often] == k], axis=0) for k in (0, 1))
    told = (distance(made, blue) < distance(made, red)).astype(int)
    assert (told == owner[often]).mean() > 0.97
