"""A crown as pictures show it, one surface of thickened leaves: what it weighs, how it swings."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes
from test_fill import LEAVES, SOLID, WOOD, a_potted_plant, inputs, put, thing

from corporeal.core.types import Structure
from corporeal.discretization.foliage import find_rooted_wood, leaf_frequencies, root_joint, weigh_bulk_foliage
from corporeal.discretization.mesh_measures import measure_objects
from corporeal.discretization.part_model import infer_part_model
from corporeal.geometry.mesh import Mesh
from corporeal.materials import find_material
from corporeal.pipeline.stages.fill import fill

CELL, LEAF, COUNT = 0.0125, 0.08, 40
ONE_FACE = COUNT * LEAF**2
"""Area of all leaves, which are squares [m²]."""
TISSUE = find_material("leaf_tissue").pick(find_material("leaf_tissue").typical())


@cache
def carved():
    """Leaves in a ball of 0.12 m, as pictures show them: a cell thick and grown together."""
    rng = np.random.default_rng(3)
    empty = np.ones((48, 48, 48), dtype=bool)
    grid = np.linspace(-0.5, 0.5, 12) * LEAF
    for middle in rng.normal(size=(COUNT, 3)):
        middle *= 0.12 * rng.uniform() ** (1 / 3) / np.linalg.norm(middle)
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        points = middle + (grid[:, None, None] * frame[0] + grid[None, :, None] * frame[1])
        empty[tuple(np.rint(points.reshape(-1, 3) / CELL).astype(int).T + 24)] = False
    away = distance_transform_edt(empty)
    vertices, faces, _, _ = marching_cubes(away, 0.7, spacing=(CELL,) * 3)
    return put(trimesh.Trimesh(vertices, faces), 0.3)


def a_sapling(built=SOLID):
    stem = put(trimesh.creation.cylinder(0.012, 0.5, sections=12), 0.0)
    return inputs(thing((stem, WOOD), (carved(), LEAVES, built)))


@cache
def anatomy():
    scene, parts, _ = a_sapling()
    return measure_objects(scene, parts, 0)[0]


def crown(whole, field, scale=1.0):
    leaves = whole.members[-1]
    made = infer_part_model(whole, leaves, field, np.random.default_rng(0))
    return weigh_bulk_foliage(made, whole, leaves, field, TISSUE, scale)


def test_a_crown_weighs_what_its_leaves_weigh_and_each_swings_as_a_usual_one_does():
    particles = fill(*a_sapling())
    thick, density = 0.25e-3, 800.0  # as leaves usually are
    assert particles.mass_real[1] == pytest.approx(0.75 * carved().area * thick * density, rel=1e-3)
    assert 0.5 < particles.mass_real[1] / (ONE_FACE * thick * density) < 2
    assert particles.mass_real[1] < 0.2 * 150 * carved().volume
    leafy = particles.part == 1
    assert particles.treatments[1].kind == "foliage"
    assert particles.mass[leafy].sum() == pytest.approx(particles.mass_real[1])
    rate = np.sqrt(2e8 * thick**2 / (0.6 * density)) / 0.08**2
    np.testing.assert_allclose(particles.rate[leafy], rate, rtol=0.01)
    shown = f"about {0.75 * carved().area:.2g} m² of leaves 0.25 mm thick"
    assert shown in particles.fills[1]


def test_leaves_as_thick_as_stated_have_the_density_of_their_material():
    made = crown(anatomy(), a_sapling(Structure("shell", 1e-3))[2])
    assert made.mass == pytest.approx(0.75 * carved().area * 1e-3 * 150, rel=1e-3)
    assert made.density == pytest.approx(made.mass / anatomy().members[-1].volume)


def test_leaves_of_a_small_copy_are_as_much_thinner():
    made = crown(anatomy(), a_sapling()[2], scale=0.5)
    assert made.mass == pytest.approx(0.75 * carved().area * 0.125e-3 * 800, rel=1e-3)


def test_what_nothing_bears_is_no_crown():
    made = crown(anatomy().only([1]), a_sapling()[2])
    assert made.leaves == 0
    assert made.mass == pytest.approx(150 * carved().volume, rel=0.05)


def test_a_scrap_of_leaf_swings_no_faster_than_can_be_seen():
    scrap = trimesh.Trimesh([[0, 0, 0], [4e-3, 0, 0], [0, 3e-3, 0]], [[0, 1, 2]], process=False)
    stem = put(trimesh.creation.cylinder(0.012, 0.5, sections=12), 0.0)
    scene, parts, _ = inputs(thing((stem, WOOD), (scrap, LEAVES)))
    member = measure_objects(scene, parts, 0)[0].members[1]
    np.testing.assert_allclose(leaf_frequencies(member, np.zeros((1, 3)), TISSUE, 1.0), 300.0)


def above(stem, height):
    """What shows of a stem."""
    shown = np.maximum(stem.body.vertices, [-np.inf, -np.inf, height])
    return replace(stem, body=Mesh(shown, stem.body.triangles), closed=False)


def test_a_potted_stem_whose_foot_is_unseen_reaches_halfway_down():
    scene, parts, field = a_potted_plant()
    whole = measure_objects(scene, parts, 0)[0]
    pot, soil, stem, leaves = whole.members
    seen = find_rooted_wood(whole, field.materials)
    assert (seen.wood, seen.soil) == (2, 1)
    assert (seen.foot, seen.top) == pytest.approx((0.11, 0.19))
    top = replace(soil, body=soil.body.only(soil.body.normals[:, 2] > 0.9), closed=False)
    pictured = replace(whole, members=(pot, top, above(stem, 0.19), leaves))
    found = find_rooted_wood(pictured, field.materials)
    assert (found.wood, found.soil) == (2, 1)
    assert (found.foot, found.top) == pytest.approx((0.095, 0.19))
    assert seen.seen and not found.seen and "0.095 m, halfway down" in found.doubt
    root = root_joint(found, pictured, 0, field.materials, lambda wood, point: 1.0)
    assert root.stiffness == pytest.approx(0.34 * 3e5 * 0.095**3)
    assert root.point[2] == pytest.approx(0.095 + 0.4 * 0.095)
    hung = replace(whole, members=(pot, top, above(stem, 0.4), leaves))
    assert find_rooted_wood(hung, field.materials) is None
