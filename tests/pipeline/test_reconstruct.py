"""From a splat, or photographs, to objects with closed surfaces, in metres and on the floor."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.geometry.gaussian_transforms import transform_gaussians
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.scene_transforms import move_scene
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.multiview.similarity_transform import apply_similarity_to_points
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.stages import reconstruct as stage
from corporeal.pipeline.stages.reconstruct import reconstruct
from corporeal.reconstruction.features import point_features
from corporeal.reconstruction.gaussians import radiance_field
from corporeal.reconstruction.reconstruct_config import ReconstructConfig, ReconstructionResolution
from corporeal.scene.repose_reconstruction import repose_reconstruction
from corporeal.vlm.photographed_objects import PhotoInterview, SeenObject
from gaussian_boxes import DOWN, box, together

RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.2, 0.8)
SIDES = ((0.4, 0.3, 0.2), (0.16, 0.16, 0.3))
MIDDLES = ((0.0, 0.0, 0.1), (0.45, 0.1, 0.15))
"""Of two boxes that stand on the floor."""


COARSE = ReconstructConfig(resolution=ReconstructionResolution(16, (160, 160), 100_000, 250_000))
"""Looks at splats in fewer and smaller pictures, and carves more coarsely, than for people."""


@pytest.fixture(scope="module")
def splat(tmp_path_factory):
    """Two boxes in a file whose -y is up and whose unit is half a metre."""
    path = tmp_path_factory.mktemp("splat") / "boxes.ply"
    scene = together(box(SIDES[0], MIDDLES[0], RED), box(SIDES[1], MIDDLES[1], BLUE))
    write_splat_ply(path, transform_gaussians(scene, DOWN, 2.0, (0.3, -0.2, 5.0)))
    return path


@pytest.fixture(scope="module")
def made(splat):
    config = replace(COARSE, object_names=("crate", "blue pillar"))
    return reconstruct(splat, config, ("crate=0.4",))


@pytest.mark.slow
def test_objects_come_out_in_metres_on_the_floor(made):
    found, scene = made.found, made.scene
    assert [(o.name, o.class_name) for o in scene.objects] == [("crate", "crate"), ("blue pillar", "blue pillar")]
    assert found.metres_per_unit == pytest.approx(0.5, rel=0.05)
    for surface, sides in zip(scene.surfaces, SIDES, strict=True):
        np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), sides, atol=0.02)
        volume = signed_volume(Mesh(surface.vertices, surface.triangles))
        assert volume == pytest.approx(np.prod(sides), rel=0.15)  # their edges are cut off
        assert surface.vertices[:, 2].min() == pytest.approx(0, abs=0.01)
    back = apply_similarity_to_points(found.boxes.mean(axis=1), np.linalg.inv(found.world_from_file))
    expected = 2 * np.array(MIDDLES) @ DOWN.T + (0.3, -0.2, 5.0)
    np.testing.assert_allclose(back, expected, atol=0.04)
    between = found.boxes.mean(axis=1)
    np.testing.assert_allclose(
        np.linalg.norm(between[1] - between[0]), np.linalg.norm(np.subtract(*MIDDLES)), atol=0.02
    )


def test_every_gaussian_knows_whose_it_is(made):
    found = made.found
    red = found.gaussians.sh[:, 0, 0] > 0
    assert np.mean(found.object_of_gaussian[red] == 0) > 0.99
    assert np.mean(found.object_of_gaussian[~red] == 1) > 0.99, "undersides, too"
    assert len(found.object_of_point) == found.cloud.count
    np.testing.assert_array_equal(found.object_of_point, found.object_of_gaussian[found.cloud.gaussian_of_point])


def test_surfaces_are_coloured_as_seen(made):
    scene = made.scene
    for surface, colour in zip(scene.surfaces, (RED, BLUE), strict=True):
        expected = np.where(np.array(colour) <= 0.04045, 0, ((np.array(colour) + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(np.median(surface.colours[:, :3], axis=0), expected, atol=0.03)


def test_the_scene_is_a_glb_like_any_other(made, tmp_path):
    scene = made.scene
    write_glb(tmp_path / "boxes.glb", scene)
    back = read_glb(tmp_path / "boxes.glb")
    assert [o.name for o in back.objects] == ["crate", "blue pillar"]


def test_gaussians_follow_their_objects(made):
    found, scene = made.found, made.scene
    there = repose_reconstruction(found, move_scene(scene, (0.0, 0.0, 1.0), 1))
    shift = there.gaussians.mean - found.gaussians.mean
    up = (found.object_of_gaussian == 1)[:, None] * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(shift, up, atol=1e-5)
    with pytest.raises(UserError, match="Reconstruct it again"):
        repose_reconstruction(found, replace(scene, objects=scene.objects[:1]))


def test_gaussians_follow_their_objects_beside_others(made):
    found, scene = made.found, made.scene
    ball = replace(scene.objects[0], name="ball")
    surfaces = [replace(s, object=s.object + 1) for s in scene.surfaces]
    more = replace(scene, objects=(ball, *scene.objects), surfaces=(scene.surfaces[0], *surfaces))
    there = repose_reconstruction(found, move_scene(more, (0.0, 0.0, 1.0), 2))
    np.testing.assert_array_equal(
        there.object_of_gaussian, np.where(found.object_of_gaussian < 0, -1, found.object_of_gaussian + 1)
    )
    np.testing.assert_array_equal(there.object_of_point, found.object_of_point + 1)
    shift = there.gaussians.mean - found.gaussians.mean
    np.testing.assert_allclose(shift[:, 2], found.object_of_gaussian == 1, atol=1e-5)
    results = StageResults(reconstruct=found, assemble=more)
    assert results.reconstruction is not None
    assert results.rendered_reconstruction is None, "the ball has no Gaussians"
    assert StageResults(reconstruct=found, assemble=scene).rendered_reconstruction is not None


def test_the_report_says_how_it_came_about(made):
    found = made.found
    told = " ".join(found.statements)
    assert "Gaussians were read from boxes.ply" in told
    assert "2 objects, segmented by" in told
    assert "the command line" in told


class Seer(PhotoInterview):
    """Somebody who sees two things, and which region is which."""

    def __init__(self):
        super().__init__("boxes", "metadata")

    def objects(self, pictures):
        assert all(p.dtype == np.uint8 and p.ndim == 3 for p in pictures)
        return [SeenObject("pillar", "blue", 0.3, "a model (x)"), SeenObject("crate", "red", 0.4, "a model (x)")]

    def regions(self, pictures, colours, things):
        painted = pictures[1].reshape(-1, 3).astype(int)
        assert (painted[:, 0] - painted[:, 2] > 60).any(), "the first region is red"
        assert colours == ["red", "blue"]
        return [1, 0]


@pytest.mark.slow
def test_a_model_that_sees_the_pictures_names_objects_and_their_sizes(splat):
    result = reconstruct(splat, COARSE, viewer=Seer())
    found, scene = result.found, result.scene
    assert [o.class_name for o in scene.objects] == ["crate", "pillar"]
    assert found.metres_per_unit == pytest.approx(0.5, rel=0.05)


class Colours:
    """An encoder: colours of patches of 8 pixels, about grey."""

    def map(self, picture):
        high, wide = (n // 8 for n in picture.shape[:2])
        patches = picture[: 8 * high, : 8 * wide].reshape(high, 8, wide, 8, 3).mean(axis=(1, 3))
        return (patches / 255 - 0.3).astype(np.float16)


class Enough(Exception):  # noqa: N818
    """All that a test wants to know."""


@pytest.mark.slow
@pytest.mark.parametrize("lifting", ["uplift", "back-projection", pytest.param("radiance", marks=pytest.mark.slow)])
def test_every_way_of_lifting_says_of_points_what_pictures_show(splat, lifting, monkeypatch):
    def stopped(cloud, *_):
        raise Enough(cloud)

    monkeypatch.setattr(stage, "assign_instances", stopped)
    monkeypatch.setattr(point_features, "connect_encoder", lambda spec, folder: Colours())
    small = radiance_field.FieldPreset(100, 160, 2048)
    monkeypatch.setitem(radiance_field.FIELD_PRESETS, "draft", small)
    config = replace(COARSE, object_names=("a", "b"), training="draft", lifting=lifting)
    with pytest.raises(Enough) as caught:
        reconstruct(splat, config)
    (cloud,) = caught.value.args
    assert cloud.count > 1000
    assert (cloud.gaussian_of_point is None) == (lifting == "radiance")
    red = cloud.colour[:, 0] > cloud.colour[:, 2]
    assert np.mean((cloud.semantic[:, 0] > cloud.semantic[:, 2]) == red) > 0.97
    assert 0.2 < red.mean() < 0.9
    np.testing.assert_allclose(np.linalg.norm(cloud.semantic.astype(float), axis=1), 1, atol=2e-3)
    assert np.mean(cloud.seen > 0) > 0.7
    sides = np.percentile(cloud.position[red], (99, 1), axis=0)[:, :2]
    np.testing.assert_allclose(sides[0] - sides[1], 2 * np.array(SIDES[0][:2]), atol=0.05)


@pytest.mark.parametrize(
    ("config", "extents", "told"),
    [
        ({"count": 0}, (), "--count is 0"),
        ({"semantic": "bert"}, (), "Unknown picture encoder 'bert'"),
        ({"count": 3, "object_names": ("crate",)}, (), "--count is 3, but --object-names names 1 objects"),
        ({"metres_per_unit": -1.0}, (), "--metres-per-unit is -1 m"),
        ({"floor_at": float("nan")}, (), "--floor-at is nan"),
        ({"training_seed": -1}, (), "--training-seed is -1"),
        ({"apart": "masks"}, (), "is a splat, which has no instance masks"),
        ({"object_names": ("crate", "pillar")}, ("box=1",), "no object 'box'. Choose one of: crate, pil"),
        ({}, ("box=1",), "no object 'box'. Name it with --object-names"),
        ({"known_distance": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)}, (), "distance of the two points is 0 units"),
    ],
)
def test_options_that_make_no_sense_are_refused_before_anything_is_done(splat, config, extents, told, monkeypatch):
    monkeypatch.setattr(stage, "turn_upright", None)
    with pytest.raises(UserError, match=told):
        reconstruct(splat, replace(COARSE, **config), extents)
