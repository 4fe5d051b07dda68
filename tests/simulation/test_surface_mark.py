"""A mark in sand is what its surface shows, wherever single grains went."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import Law, Material
from corporeal.simulation.residual_shape import residual_dent
from corporeal.simulation.surface_mark import COLUMN_WIDTH_DX, keeps_surface_mark, surface_mark

CELL = 0.01
DEPTH, RADIUS = 0.03, 0.07
"""Of a bowl, and of the circle where it meets the surface [m]."""
BALL = (RADIUS**2 + DEPTH**2) / (2 * DEPTH)
"""Radius of the sphere that stamps it [m]."""
THICK = 0.1
SAND = Material("sand", Law.DRUCKER_PRAGER, 4e7, 0.3, 1600.0, friction_angle=0.6)


def bed(width, thick=THICK):
    """Fill a bed with grains half a cell apart, four by four by two of them in a cell's square."""
    axis, up = np.arange(CELL / 4, width, CELL / 2), np.arange(CELL / 4, thick, CELL / 2)
    grid = np.stack(np.meshgrid(axis - width / 2, axis - width / 2, up, indexing="ij"), -1)
    return grid.reshape(-1, 3) + np.random.default_rng(5).uniform(-1e-3, 1e-3, (grid.size // 3, 3))


BED = bed(width=0.3)


def bowl(distance):
    """Depth of a spherical bowl at a distance from its middle [m]."""
    inside = np.sqrt(np.maximum(BALL**2 - distance**2, 0.0)) - (BALL - DEPTH)
    return np.maximum(inside, 0.0)


def stamped(points):
    """Press the bowl into a bed: each grain goes down by its share of the height."""
    fall = bowl(np.hypot(points[:, 0] - 0.02, points[:, 1]))
    return points - np.outer(fall, [0, 0, 1]) * (points[:, 2:] / THICK)


def splashed(points, share):
    """Throw a share of the grains of the bowl's upper layers, neighbours together, onto the bed."""
    dice = np.random.default_rng(7)
    near = np.hypot(BED[:, 0] - 0.02, BED[:, 1]) < RADIUS
    top = np.flatnonzero(near & (BED[:, 2] > THICK - CELL))
    thrown = top[np.argsort(BED[top] @ [1.0, 0.3, 0.0])][-round(share * len(BED)) :]
    points = points.copy()
    points[thrown, 0] = -0.11 + dice.uniform(-0.03, 0.03, len(thrown))
    points[thrown, 1] = dice.uniform(-0.14, 0.14, len(thrown))
    points[thrown, 2] = THICK + CELL / 4
    return points


def mark_of(points, **changes):
    return surface_mark(**{"start": BED, "now": [points], "cell": CELL, "threshold": CELL} | changes)


def test_a_bowl_is_as_deep_and_as_wide_as_it_was_stamped():
    mark = mark_of(stamped(BED))
    assert mark.depth == pytest.approx(DEPTH, abs=0.15 * CELL)
    np.testing.assert_allclose(mark.place[:2], [0.02, 0.0], atol=0.2 * CELL)
    assert mark.place[2] == pytest.approx(THICK, abs=0.6 * CELL), "on the surface as it was"
    deep = np.pi * (BALL**2 - (BALL - DEPTH + CELL) ** 2) / 0.3**2
    assert mark.share == pytest.approx(deep, rel=0.1)
    assert mark.rim == pytest.approx(0.0, abs=0.05 * CELL)


def test_grains_that_splashed_far_make_no_deeper_mark_as_they_make_a_deeper_dent():
    """A quarter of a percent of the grains end .1 to .2 m away, as in the showcase's heap."""
    points = splashed(stamped(BED), 0.0025)
    assert mark_of(points).depth == pytest.approx(DEPTH, abs=0.3 * CELL)
    assert residual_dent(BED, [points], CELL).depth > 4 * DEPTH, "the control: it follows the grains"


def test_grains_in_the_air_above_a_bowl_neither_fill_it_nor_are_a_rim():
    dice, frames = np.random.default_rng(11), []
    for _ in range(3):
        points = stamped(BED)
        flying = dice.choice(len(points), len(points) // 500, replace=False)
        points[flying] += [0.0, 0.0, 0.3]
        frames.append(points)
    mark = mark_of(BED, now=frames)
    assert mark.depth == pytest.approx(DEPTH, abs=0.2 * CELL)
    assert mark.rim < 0.2 * CELL


def test_a_rim_is_as_high_as_it_was_raised():
    distance = np.hypot(BED[:, 0] - 0.02, BED[:, 1])
    ring = 0.012 * np.exp(-(((distance - RADIUS - 0.02) / 0.02) ** 2))
    points = stamped(BED) + np.outer(ring, [0, 0, 1]) * (BED[:, 2:] / THICK)
    mark = mark_of(points)
    assert mark.rim == pytest.approx(0.012, abs=0.1 * CELL)
    assert mark.depth == pytest.approx(DEPTH, abs=0.15 * CELL)


def test_a_hole_through_a_bed_is_as_deep_as_the_bed():
    points = BED.copy()
    points[np.hypot(BED[:, 0], BED[:, 1]) < 2 * CELL, 0] += 3.0
    assert mark_of(points).depth == pytest.approx(THICK, abs=COLUMN_WIDTH_DX * CELL)


def test_what_slides_as_a_whole_is_not_marked():
    moved = mark_of(BED + np.array([0.3, -0.1, 0.2]))
    assert moved.depth < 1e-6 and moved.share == 0.0 and np.isnan(moved.place).all()


def test_grains_in_rows_are_on_no_edge_of_a_column():
    """A lattice that rounding moved by a hair is where it was."""
    axis = np.arange(CELL / 4, 0.1, CELL / 2)
    rows = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    moved = rows - np.outer(rows[:, 0] > 0.05, [1e-9, 0.0, 0.0])
    assert surface_mark(rows, [moved], CELL, CELL).depth < 1e-6


def test_half_the_bed_in_half_the_cells_has_half_the_mark():
    fine = 0.5 * BED
    half = fine.copy()
    half[:, 2] -= 0.5 * (BED - stamped(BED))[:, 2]
    mark = surface_mark(fine, [half], CELL / 2, CELL / 2)
    assert mark.depth == pytest.approx(DEPTH / 2, abs=0.08 * CELL)


def test_a_pinch_of_grains_has_no_surface():
    few = BED[:2]
    mark = surface_mark(few, [few - [0, 0, 1]], CELL, CELL)
    assert (mark.depth, mark.rim, mark.share) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "marked"),
    [
        ({}, True),
        ({"law": Law.FLUID, "yield_shear": 25.0, "consistency": 10.0}, True),
        ({"law": Law.FLUID, "viscosity": 1e-3}, False),
        ({"law": Law.VON_MISES, "yield_stress": 1e5}, False),
    ],
)
def test_grains_and_pastes_are_measured_at_their_surface_and_plasticine_by_its_matter(changes, marked):
    assert keeps_surface_mark(replace(SAND, **changes)) is marked
