"""Things that are not life-size: lengths that were said are real ones, and scale with the rest."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh

from corporeal.core.types import (
    Finish,
    Law,
    Material,
    MaterialField,
    PartComponent,
    PartDescription,
    RangePlacement,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Wall,
)
from corporeal.discretization.foliage import leaf_frequencies
from corporeal.discretization.mesh_measures import measure_object
from corporeal.discretization.object_scaling import field_in_scene_scale, is_not_life_size
from corporeal.discretization.part_model import infer_part_model, part_mass
from corporeal.geometry.scene_transforms import object_boxes, scale_scene, scale_to_life_size
from corporeal.materials import find_material

STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, shell_thickness=8e-4)
SOUP = Material("soup", Law.NEO_HOOKEAN, 300.0, 0.49, 1050.0)
SAID = PartDescription("a", "steel")
PUT = replace(SAID, placements={"shell_thickness": RangePlacement(0.5, "model", "It looks so.")})
CAN = trimesh.creation.cylinder(0.03, 0.1)
CUP = trimesh.creation.annulus(0.028, 0.03, 0.1)
FLAG = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0.1, 0.06, 0], [0, 0.06, 0.0]], [[0, 1, 2], [0, 2, 3]])

BUILDS = {
    "solid": (CAN, Structure("solid"), SAID),
    "shell as usual": (CAN, Structure("shell", 8e-4), SAID),
    "shell as stated": (CAN, Structure("shell", 3e-4), replace(SAID, thickness=3e-4)),
    "full of soup": (CAN, Structure("filled", 2e-4, contents=SOUP, fill=0.9), SAID),
    "wall as drawn": (CUP, Structure("shell", 8e-4), SAID),
    "wall as judged": (CUP, Structure("shell", 8e-4), PUT),
    "sheet as stated": (FLAG, Structure("shell", 1e-3), replace(SAID, thickness=1e-3)),
    "sheet as usual": (FLAG, Structure("solid"), SAID),
}


def field_of(structure, words, pieces=()):
    one = np.full((2, 2), 0.5)
    return MaterialField((STEEL,), (structure,), (words,), one, one, pieces)


@cache
def surveyed(mesh, scale):
    triangles = np.asarray(mesh.faces, dtype=np.int64)
    label, rng = np.zeros(len(triangles), dtype=np.int64), np.random.default_rng(0)
    return measure_object(np.asarray(mesh.vertices) * scale, triangles, label, rng)


def made(mesh, field, scale):
    """Make a thing of a mesh that is drawn at a scale: how it is built, and its mass [kg]."""
    anatomy = surveyed(mesh, scale)
    (member,) = anatomy.members
    scene = field_in_scene_scale(field, (scale,))
    return infer_part_model(anatomy, member, scene, np.random.default_rng(1)), part_mass(member, scene, 0.0)


@pytest.mark.parametrize("build", BUILDS)
def test_an_object_of_the_same_make_weighs_with_the_cube_of_its_scale(build):
    scale = 0.37
    mesh, structure, words = BUILDS[build]
    life, _ = made(mesh, field_of(structure, words), 1.0)
    here, weighed = made(mesh, field_of(structure, words), scale)
    assert here.mass == pytest.approx(life.mass * scale**3, rel=1e-9)
    assert weighed == pytest.approx(here.mass, rel=1e-9)
    assert here.thickness == pytest.approx(life.thickness * scale, rel=1e-9)
    assert here.sheet == pytest.approx(life.sheet * scale, rel=1e-9)
    assert (here.structure.kind, here.modelled, here.whose, here.density) == (
        (life.structure.kind, life.modelled, life.whose, pytest.approx(life.density))
    )


def test_pieces_that_share_a_mesh_are_scaled_too():
    halves = [
        replace(SAID, name=n, thickness=t, volume_share=0.5, surface_share=0.5)
        for n, t in (("lid", 2e-4), ("body", 9e-4))
    ]
    pieces = tuple(PartComponent(w, STEEL, Structure("shell", w.thickness)) for w in halves)
    field = field_of(Structure("shell", 9e-4), SAID, (pieces,))
    life, here = (made(CAN, field, scale)[0] for scale in (1.0, 0.37))
    inside = [CAN.volume * (1 - t / 0.03) ** 2 * (1 - t / 0.05) for t in (2e-4, 9e-4)]
    assert life.mass == pytest.approx(7850 * (CAN.volume - np.mean(inside)), rel=5e-3)
    assert here.mass == pytest.approx(0.37**3 * life.mass, rel=1e-9)


def test_at_life_size_nothing_is_touched():
    field = field_of(Structure("shell", 8e-4), SAID)
    assert field_in_scene_scale(field, (1.0,)) is field
    assert not is_not_life_size(1.004)
    assert is_not_life_size(0.99)


def test_a_leaf_of_twice_the_size_swings_half_as_fast():
    """ω ~ t/L² of a cantilever whose thickness is scaled with it; long leaves are cut likewise."""
    leaf = find_material("leaf_tissue")
    tissue = leaf.pick(leaf.typical())
    for length in (0.05, 0.4):
        rates = []
        for scale in (1.0, 2.0):
            size = 10 * length * scale
            (member,) = surveyed(FLAG, size).members
            rates.append(leaf_frequencies(member, FLAG.vertices * size, tissue, scale))
        np.testing.assert_allclose(rates[1], rates[0] / 2, rtol=1e-12)


# ---------------------------------------------------------------- whole scenes


def a_scene():
    box = trimesh.creation.box((0.2, 0.1, 0.1)).apply_translation((1.0, 2.0, 0.05))
    surfaces = [
        Surface("box", k, 0, np.asarray(box.vertices) + shift, np.asarray(box.faces, np.int64))
        for k, shift in enumerate(np.array([[0.0, 0, 0], [1.0, 0, 0]]))
    ]
    things = (SceneObject("a", "box", 0.2), SceneObject("b", "box", 0.05, scale=4.0))
    wall = (Wall((-1.0, 0.0, 0.0), (3.0, 0.5, 0.0)),)
    return Scene("s", "s.glb", things, tuple(surfaces), (Finish("plain"),), walls=wall)


def test_a_scaled_scene_has_its_walls_where_its_objects_are():
    scene = scale_scene(a_scene(), 2.0)
    assert scene.walls == (Wall((-1.0, 0.0, 0.0), (6.0, 1.0, 0.0)),)
    assert [o.scale for o in scene.objects] == [2.0, 8.0]
    assert [o.real_extent for o in scene.objects] == [0.2, 0.05]


def test_each_object_is_brought_back_to_its_real_size_where_it_stands():
    scene = scale_to_life_size(scale_scene(a_scene(), 2.0))
    boxes = object_boxes(scene)
    np.testing.assert_allclose(np.ptp(boxes, axis=1).max(axis=1), [0.2, 0.05], rtol=1e-12)
    np.testing.assert_allclose(boxes[:, 0, 2], 0.0, atol=1e-15)
    np.testing.assert_allclose(boxes.mean(axis=1)[:, :2], [[2.0, 4.0], [4.0, 4.0]], rtol=1e-12)
    assert [o.scale for o in scene.objects] == [1.0, 1.0]
