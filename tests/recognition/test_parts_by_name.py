import numpy as np
import pytest

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.recognition.parts_by_name import identify_parts, name_words

POINTS, FACES = np.eye(3), np.array([[0, 1, 2]])


def scene(finishes, surfaces, objects=("thing_0",)):
    return Scene(
        "s",
        "by hand",
        tuple(SceneObject(n, n.split("_")[0], 1.0) for n in objects),
        tuple(Surface(n, o, f, POINTS, FACES, extras=e) for n, o, f, e in surfaces),
        tuple(finishes),
    )


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("M_LeatherParts.001", ["leather", "parts"]),
        ("aws_Vase_01_visual-lib", ["vase"]),
        ("Tree_winding_01_Material_0", ["tree", "winding"]),
        ("Scene_-_Root", []),
        ("lambert1", []),
        ("defaultMaterial", []),
        ("material_0", []),
    ],
)
def test_what_every_exporter_writes_says_nothing(name, told):
    assert name_words(name) == told


def test_surfaces_of_one_finish_are_one_part():
    found = identify_parts(scene([Finish("Oak")], [("drawer", 0, 0, {}), ("door", 0, 0, {})]))
    assert [p.name for p in found.catalogue] == ["thing"]
    assert found.part_of_surface.tolist() == [0, 0]


def test_finishes_that_differ_in_a_number_only_are_one():
    green = (0.0, 1.0, 0.0, 1.0)
    finishes = [Finish("Leaf.001", green), Finish("Leaf.002", green), Finish("Pot")]
    found = identify_parts(scene(finishes, [("a", 0, 0, {}), ("b", 0, 1, {}), ("c", 0, 2, {})]))
    assert found.part_of_surface.tolist() == [0, 0, 1]


def test_a_node_that_states_its_substance_is_a_part():
    said = {"substance": "soft_PVC"}
    found = identify_parts(scene([Finish("x")], [("body", 0, 0, said), ("beak", 0, 0, said)]))
    assert [(p.name, p.found_by) for p in found.catalogue] == [("body", "node"), ("beak", "node")]


def test_parts_never_cross_objects_and_names_in_one_object_differ():
    finishes = [Finish("", (1.0, 0.0, 0.0, 1.0)), Finish("", (0.0, 0.0, 1.0, 1.0))]
    surfaces = [("node1", 0, 0, {}), ("node2", 0, 1, {}), ("node1", 1, 0, {})]
    found = identify_parts(scene(finishes, surfaces, ("hammer_0", "hammer_1")))
    assert [(p.name, p.object) for p in found.catalogue] == [("hammer part 1", 0), ("hammer part 2", 0), ("hammer", 1)]


def test_names_that_speak_of_different_matter_part_what_shares_a_finish():
    surfaces = [("legs", 0, 0, {}), ("cushion", 0, 0, {})]
    found = identify_parts(scene([Finish("Atlas")], surfaces), lambda s, f: s.name)
    assert [p.name for p in found.catalogue] == ["legs", "cushion"]
