"""A plant that seems to end where sand begins has a foot in it."""

import numpy as np
import pytest
import trimesh
from test_fill import CLAY, LEAVES, SOIL, WOOD, inputs, leaf_blades, put, thing

from corporeal.core.types import Law, Material
from corporeal.discretization.plant_roots import extend_plants_into_ground
from corporeal.pipeline.stages.fill import fill

SAND = Material("sand", Law.DRUCKER_PRAGER, 2e7, 0.3, 1550.0, friction_angle=0.58, cohesion=0.0)
TOP, HEIGHT = 0.15, 0.5


def planted(bottom=TOP, wood=WOOD, *more):
    heap = put(trimesh.creation.cylinder(0.1, TOP, sections=24), 0.0)
    stem = put(trimesh.creation.cylinder(0.012, HEIGHT, sections=12), bottom)
    stem = stem.subdivide().subdivide().subdivide()
    leaves = leaf_blades(40, bottom + 0.15)
    return inputs(thing((heap, SAND)), thing((stem, wood), (leaves, LEAVES), *more))


def lowest(scene):
    return [min(s.vertices[:, 2].min() for s in scene.surfaces if s.object == k) for k in (0, 1)]


def test_a_stem_that_ends_on_sand_is_drawn_out_into_it():
    scene, parts, field = planted()
    drawn, said = extend_plants_into_ground(scene, parts, field)
    assert lowest(drawn) == pytest.approx([0.0, TOP - 0.2 * HEIGHT])
    assert "thing_1 grows from what it stands on" in said[0] and "0.1 m below the visible end" in said[0]
    before, after = (np.concatenate([v.vertices for v in s.surfaces]) for s in (scene, drawn))
    moved = before[:, 2] != after[:, 2]
    assert before[moved, 2].max() < TOP + 0.05 * HEIGHT
    np.testing.assert_array_equal(before[:, :2], after[:, :2])
    assert scene.surfaces[0] is drawn.surfaces[0]


def test_a_stump_that_was_taken_for_sand_is_ground_as_well():
    scene, parts, field = planted(bottom=TOP + 0.05)
    assert extend_plants_into_ground(scene, parts, field) == (scene, ())
    stump = put(trimesh.creation.cylinder(0.012, 0.05, sections=24), TOP)
    heap = trimesh.util.concatenate([put(trimesh.creation.cylinder(0.1, TOP), 0.0), stump])
    stem = put(trimesh.creation.cylinder(0.012, HEIGHT, sections=12), TOP + 0.05)
    stem = stem.subdivide().subdivide().subdivide()
    things = thing((heap, SAND)), thing((stem, WOOD), (leaf_blades(40, TOP + 0.2), LEAVES))
    drawn, said = extend_plants_into_ground(*inputs(*things))
    assert lowest(drawn)[1] == pytest.approx(TOP + 0.05 - 0.2 * HEIGHT) and len(said) == 1


def test_no_foot_goes_through_the_bottom_of_its_ground():
    scene, parts, field = planted()
    thin = scene.surfaces[0].vertices
    thin[:, 2] = np.maximum(thin[:, 2], TOP - 0.05)
    drawn, _ = extend_plants_into_ground(scene, parts, field)
    assert lowest(drawn)[1] == pytest.approx(TOP - 0.9 * 0.05)


@pytest.mark.parametrize(
    "made",
    [
        lambda: planted(bottom=0.05),  # its foot is there
        lambda: planted(bottom=0.25),  # it hangs in the air
        lambda: planted(wood=CLAY),  # what ends on the sand is no wood
        lambda: planted(TOP, WOOD, (put(trimesh.creation.box((0.1,) * 3), TOP), SOIL)),
    ],
)
def test_what_grows_elsewhere_stays_as_it_is(made):
    scene, parts, field = made()
    drawn, said = extend_plants_into_ground(scene, parts, field)
    assert drawn is scene and not said


def test_fill_fills_the_foot_and_says_so():
    particles = fill(*planted())
    wood = particles.part == 1
    assert particles.position[wood, 2].min() == pytest.approx(TOP - 0.2 * HEIGHT, abs=0.02)
    assert any("0.1 m below the visible end" in w for w in particles.warnings)
