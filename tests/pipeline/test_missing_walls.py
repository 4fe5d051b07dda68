"""What is soft bridges no hollow: the wall below it is there, although nothing shows it."""

import numpy as np
import pytest
import trimesh
from test_fill import SOLID, inputs, thing  # type: ignore[import-not-found]

from corporeal.core.types import Structure
from corporeal.discretization.mesh_measures import measure_objects
from corporeal.discretization.missing_walls import close_all_missing_walls
from corporeal.discretization.object_filling import FillRecipe, fill_object
from corporeal.materials import find_material
from corporeal.pipeline.mass_posterior import MassSampler
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import GroundConfig

T = 0.012
"""Of the boards [m]."""
WALL = Structure("shell", T)
LONG, WIDE, HIGH = 0.8, 0.4, 0.3
"""Of the box [m]."""


def matter(name):
    known = find_material(name)
    return known.pick(known.typical())


PLYWOOD, FOAM, GRANITE = matter("plywood"), matter("seat_foam"), matter("granite")


def block(depth, bottom, without=0):
    """A block as wide as the box; without: its face up (1) or down (-1), or none of them (0)."""
    mesh = trimesh.creation.box((LONG, WIDE, depth)).subdivide().subdivide()
    mesh.apply_translation((0, 0, bottom + depth / 2))
    return mesh.submesh([mesh.face_normals[:, 2] * without < 0.5], append=True, repair=False)


def box_under(soft, open_=True):
    """A box of boards under something, drawn as one surface, or as two closed ones."""
    box = block(HIGH, 0.0, without=1 if open_ else 0)
    return (box, PLYWOOD, WALL), (block(0.1, HIGH, without=-1 if open_ else 0), soft, SOLID)


@pytest.fixture(scope="module")
def drawn():
    return filled(*box_under(FOAM, open_=False))


@pytest.fixture(scope="module")
def hidden():
    return filled(*box_under(FOAM))


def filled(*parts):
    return fill(*inputs(thing(*parts)))


@pytest.mark.slow
def test_a_box_weighs_the_same_whether_its_top_is_drawn_or_hidden_below_foam(drawn, hidden):
    assert hidden.mass_real[0] == pytest.approx(drawn.mass_real[0], rel=0.03)
    assert "closed below the soft part on it, though not drawn" in hidden.fills[0]
    assert "not drawn" not in drawn.fills[0]


def test_its_top_weighs_where_it_is(drawn, hidden):
    assert middle(hidden) == pytest.approx(middle(drawn), abs=0.02 * HIGH)


def middle(particles):
    own = particles.part == 0
    return np.average(particles.position[own, 2], weights=particles.mass[own])


def test_points_lie_in_a_top_that_is_far_from_every_face():
    scene, parts, field = inputs(thing(*box_under(FOAM)))
    (anatomy,) = close_all_missing_walls(measure_objects(scene, parts, 0), field)
    recipes = {0: FillRecipe(0.02, 0.02, 0.0), 1: FillRecipe(np.inf, 0.0, 0.0)}
    points = fill_object(anatomy, recipes, 0.02, np.random.default_rng(0))
    inner = (points.part == 0) & (np.abs(points.points[:, :2]) < (0.3, 0.1)).all(axis=1)
    height = points.points[inner, 2]
    assert (height < 0.03).any() and (np.abs(height - HIGH) < 0.03).any()
    bare = fill_object(measure_objects(scene, parts, 0)[0], recipes, 0.02, np.random.default_rng(0))
    added = points.points[len(bare.points) :]
    assert np.abs(added[:, 2] - HIGH).max() < 0.02


def test_a_slab_bridges_a_hollow():
    particles = filled(*box_under(GRANITE))
    walls = 2 * HIGH * (LONG + WIDE) + LONG * WIDE
    assert particles.mass_real[0] == pytest.approx(PLYWOOD.density * T * walls, rel=0.05)
    assert "not drawn" not in particles.fills[0]


def test_nothing_is_closed_above_foam():
    upper, lower = (block(HIGH, 0.1, without=-1), PLYWOOD, WALL), block(0.1, 0.0, without=1)
    assert "not drawn" not in filled(upper, (lower, FOAM, SOLID)).fills[0]


def test_a_scene_is_weighed_with_its_hidden_tops(hidden):
    scene, parts, field = inputs(thing(*box_under(FOAM)))
    heavy = MassSampler(scene, parts, GroundConfig(), 0).of(field)
    assert heavy[0] == pytest.approx(sum(hidden.mass_real), rel=1e-6)
