import numpy as np
import pytest
import trimesh

from corporeal.core.errors import UserError
from corporeal.core.types import (
    FeatureCloud,
    Gaussians,
    Inventory,
    ObjectDescription,
    PartDescription,
    Reconstruction,
    Scene,
    SceneObject,
    Surface,
)
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.segment import segment
from corporeal.reconstruction.features.point_descriptor import point_descriptor
from corporeal.reconstruction.segment.part_naming import NamedParts
from sample_scenes import plain, scene

CHAIR = ("chair_0", [("seat", plain("Oak"), {}), ("cushion", plain("Fabric"), {}), ("leg", plain("Oak"), {})])
VASE = ("vase_0", [("mesh", plain(), {})])


def test_every_triangle_belongs_to_its_objects_part():
    made = scene(CHAIR, VASE)
    parts = segment(made, describe(made))
    assert np.array_equal(parts.object_of_point, made.object_of_triangle)
    owner = np.array([p.object for p in parts.catalogue])
    assert np.array_equal(owner[parts.part_of_point], parts.object_of_point)
    assert np.all(parts.confidence == 1)
    seat, cushion, leg, vase = (parts.part_of_point[4 * k] for k in range(4))
    assert seat == leg
    assert len({seat, cushion, vase}) == 3


def test_a_description_of_another_scene_is_refused():
    with pytest.raises(UserError, match="Describe the scene again"):
        segment(scene(CHAIR), describe(scene(VASE)))


# ---------------------------------------------------------------- objects from pictures


def potted():
    """A red pot, and what grows in it in green, as one surface; and a vase beside it."""
    pot = trimesh.creation.cylinder(0.1, 0.16, sections=48).subdivide().subdivide()
    leaves = trimesh.creation.icosphere(4, 0.12)
    leaves.apply_translation((0, 0, 0.24))
    vase = trimesh.creation.icosphere(3, 0.1)
    vase.apply_translation((0.5, 0, 0))
    plant = trimesh.util.concatenate([pot, leaves])
    surfaces = tuple(
        Surface(name, k, 0, np.array(m.vertices), np.array(m.faces))
        for k, (name, m) in enumerate((("plant", plant), ("vase", vase)))
    )
    things = tuple(SceneObject(s.name, s.name, 0.4) for s in surfaces)
    made = Scene("shelf", "by hand", things, surfaces, (plain("as seen"),))
    return made, made.surfaces[0].vertices[made.surfaces[0].triangles].mean(axis=1)[:, 2] > 0.11


def seen(made, green):
    """What pictures of it tell, as a reconstruction."""
    position = np.concatenate([s.vertices[s.triangles].mean(axis=1) for s in made.surfaces])
    owner = made.object_of_triangle
    colour = np.tile([0.7, 0.2, 0.15], (len(position), 1))
    colour[: len(green)][green] = (0.2, 0.5, 0.15)
    middle = np.array([[0, 0, 0.1], [0.5, 0, 0]])[owner]
    look = point_descriptor(position, colour, position - middle)
    cloud = FeatureCloud(position, colour, look, look, np.ones(len(position), int))
    empty = np.zeros((0, 3), np.float32)
    splat = Gaussians(empty, np.zeros((0, 4)), empty, np.zeros(0), np.zeros((0, 1, 3)))
    boxes = np.zeros((2, 2, 3))
    names, whole = ("plant", "vase"), np.zeros(0, int)
    return Reconstruction(splat, whole, cloud, owner, names, boxes, 1.0, np.eye(4))


def told(*pieces, vase_by="annotation"):
    words = PartDescription("plant", "ceramic", pieces=tuple(PartDescription(n, m) for n, m in pieces))
    vase = ObjectDescription("vase", "vase", (PartDescription("vase", "ceramic", answered_by=vase_by),))
    return Inventory((ObjectDescription("plant", "plant", (words,)), vase))


def test_pieces_of_an_object_from_pictures_are_found_on_it():
    made, green = potted()
    words = told(("red pot", "ceramic"), ("green leaves", "leaves-flowers"))
    parts = segment(made, words, found=seen(made, green))
    assert [(p.name, p.object) for p in parts.catalogue] == [("red pot", 0), ("green leaves", 0), ("vase", 1)]
    mine = parts.part_of_point[: len(green)]
    assert np.mean((mine == 1) == green) > 0.97
    assert np.all(parts.part_of_point[len(green) :] == 2)
    assert np.all((parts.confidence > 0) & (parts.confidence <= 1))
    made_of = ground(made, parts, words)
    assert [m.name for m in made_of.materials] == ["ceramic", "leaves-flowers", "ceramic"]


def test_without_a_reconstruction_pieces_share_a_surface():
    made, _ = potted()
    words = told(("red pot", "ceramic"), ("green leaves", "leaves-flowers"))
    assert [p.name for p in segment(made, words).catalogue] == ["plant", "vase"]


def test_a_piece_that_shows_nowhere_is_left_out_and_reported():
    made, green = potted()
    named = NamedParts(np.zeros(len(green), int), np.ones(len(green)), "attributes", ("None.",))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("corporeal.pipeline.stages.segment.name_parts", lambda *_: named)
        words = told(("red pot", "ceramic"), ("root", "wood"))
        parts = segment(made, words, found=seen(made, green))
    assert [p.name for p in parts.catalogue] == ["red pot", "vase"]
    assert parts.warnings == ("plant: None.",)


def test_what_was_not_looked_at_is_reported_to_be_one_material():
    made, green = potted()
    words = told(("red pot", "ceramic"), ("green leaves", "leaves-flowers"), vase_by="metadata")
    (warning,) = segment(made, words, found=seen(made, green)).warnings
    assert warning.startswith("vase: the pieces of this object are unknown.")
    assert segment(made, words).warnings == (), "a model's own nodes are its parts"
    unknown = told(("red pot", "ceramic"), ("green leaves", "leaves-flowers"), vase_by="unknown")
    assert segment(made, unknown, found=seen(made, green)).warnings == (), "ground says more"
