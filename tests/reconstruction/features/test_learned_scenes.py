"""A splat seen by CLIP and DINOv2 of random weights, as far as the names of parts."""

import numpy as np
import pytest
from box_scenes import on_faces
from tiny_models import needs_models, save_clip, save_dinov2

from corporeal.core.types import Gaussians, Inventory, ObjectDescription, PartDescription
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.pipeline.stages import reconstruct as stage
from corporeal.pipeline.stages.reconstruct import reconstruct
from corporeal.pipeline.stages.segment import segment
from corporeal.reconstruction.gaussians import radiance_field
from corporeal.reconstruction.reconstruct_config import ReconstructConfig, ReconstructionResolution
from corporeal.vlm.photographed_objects import PhotoInterview, SeenObject

pytestmark = [needs_models(), pytest.mark.slow]
BOXES = (((-0.5, -0.25, 0.0), (-0.1, 0.25, 0.5)), ((0.2, -0.2, 0.0), (0.5, 0.2, 0.3)))
"""Lowest and highest corner of each [m]."""


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    save_clip(folder / "clip"), save_dinov2(folder / "dinov2")
    return {"semantic": f"clip:{folder / 'clip'}", "structural": f"dinov2:{folder / 'dinov2'}"}


@pytest.fixture
def splat(tmp_path, monkeypatch):
    """Two boxes of flat Gaussians, z up; looked at coarsely."""
    small = radiance_field.FieldPreset(60, 96, 2048)
    monkeypatch.setitem(radiance_field.FIELD_PRESETS, "draft", small)
    position, normal, owner = on_faces(BOXES, 2500, np.random.default_rng(0))
    turn = np.column_stack([1 + normal[:, 2], -normal[:, 1], normal[:, 0], 0 * owner])
    turn[normal[:, 2] == -1] = [0, 1, 0, 0]
    made = Gaussians(
        mean=position.astype(np.float32),
        rotation=(turn / np.linalg.norm(turn, axis=1, keepdims=True)).astype(np.float32),
        scale=np.tile(np.float32([0.018, 0.018, 0.002]), (len(owner), 1)),
        opacity=np.full(len(owner), 0.97, np.float32),
        sh=np.float32([[[1.0, -1.0, -1.0]], [[-1.0, -1.0, 1.0]]])[owner],
    )
    write_splat_ply(tmp_path / "boxes.ply", made)
    return tmp_path / "boxes.ply"


class Seer(PhotoInterview):
    """Somebody who sees two things; which is which CLIP tells."""

    def __init__(self):
        super().__init__("boxes", "metadata")

    def objects(self, pictures):
        return [SeenObject("brick", "red", 0.5, "a model (x)"), SeenObject("crate", "blue", 0.4)]

    def regions(self, *_):
        pytest.fail("CLIP tells which is which")


def test_models_that_were_saved_here_see_objects_and_name_parts(models, splat, tmp_path, monkeypatch):
    coarse = ReconstructionResolution(12, (96, 96), 60_000, 60_000)
    config = ReconstructConfig(up="z", training="draft", lifting="radiance", resolution=coarse, **models)
    result = reconstruct(splat, config, viewer=Seer(), folder=tmp_path / "kept")
    found, scene = result.found, result.scene
    assert {o.class_name for o in scene.objects} == {"brick", "crate"}
    assert found.cloud.semantic.shape == (found.cloud.count, 24)
    assert found.cloud.structural.shape == (found.cloud.count, 48)
    pieces = (PartDescription("lid", "wood"), PartDescription("body", "steel"))
    things = [ObjectDescription(o.name, o.class_name, (PartDescription(o.name, None),)) for o in scene.objects]
    pieced = PartDescription(scene.objects[0].name, "wood", pieces=pieces)
    things[0] = ObjectDescription(scene.objects[0].name, scene.objects[0].class_name, (pieced,))
    inventory = Inventory(tuple(things))
    parts = segment(scene, inventory, found=found, semantic=config.semantic)
    assert [(p.name, p.found_by) for p in parts.catalogue[:2]] == [("lid", "words"), ("body", "words")]

    def looked(*_):
        pytest.fail("a map that is kept was made again")

    def enough(cloud, *_):
        np.testing.assert_array_equal(cloud.semantic, found.cloud.semantic)
        raise StopIteration

    monkeypatch.setattr("corporeal.reconstruction.features.clip.dense_features", looked)
    monkeypatch.setattr(stage, "assign_instances", enough)
    with pytest.raises(StopIteration):
        reconstruct(splat, config, viewer=Seer(), folder=tmp_path / "kept")
