import numpy as np
import pytest

from corporeal.errors import UserError
from corporeal.stages.describe import describe
from corporeal.stages.segment import segment
from handmade import plain, scene

CHAIR = (
    "chair_0",
    [("seat", plain("Oak"), {}), ("cushion", plain("Fabric"), {}), ("leg", plain("Oak"), {})],
)
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
