"""The ten scenes: real things, apart at the start, of substances that the library knows."""

import tomllib
from functools import partial
from importlib import resources

import numpy as np
import prop_soundness
import pytest
import trimesh

from corporeal.core.errors import UnknownChoiceError
from corporeal.showcase import showcase_scenes
from corporeal.showcase.prop_models import PROP_BUILDERS

NAMES = list(showcase_scenes.SHOWCASE_SCENE_BUILDERS)


@pytest.fixture(autouse=True)
def props_made_once(models, monkeypatch):
    monkeypatch.setattr(showcase_scenes, "PROP_BUILDERS", {name: partial(models.get, name) for name in models})


@pytest.fixture
def scene(name):
    return showcase_scenes.build_showcase_scene(name)


@pytest.fixture(scope="module")
def library():
    text = resources.files("corporeal.materials").joinpath("library.toml").read_text("utf-8")
    return set(tomllib.loads(text))


def test_there_are_ten_scenes_and_the_duck_on_mud_comes_first():
    assert len(NAMES) == 10
    assert NAMES[:3] == ["duck-on-mud", "duck-on-can", "vase-ball-armchair"]


def test_an_unknown_scene_is_refused_with_the_menu():
    with pytest.raises(UnknownChoiceError, match="duck-on-can"):
        showcase_scenes.build_showcase_scene("duck-on-custard")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_nothing_overlaps_at_the_start(name):
    composition = showcase_scenes.SHOWCASE_SCENE_BUILDERS[name]()
    models = showcase_scenes.place_models(composition)
    assert prop_soundness.overlap_fraction([p for m in models for p in m.parts]) < 1e-5 + max(
        prop_soundness.overlap_fraction(m.parts) for m in models
    )


@pytest.mark.parametrize("name", NAMES)
def test_nothing_starts_below_the_floor(scene, name):
    lowest = min(s.vertices[:, 2].min() for s in scene.surfaces)
    assert lowest == pytest.approx(0, abs=1.5e-4) or lowest > 0


@pytest.mark.parametrize("name", NAMES)
def test_every_substance_is_in_the_library(scene, library, name):
    for surface in scene.surfaces:
        assert surface.extras["substance"] in library
        assert surface.extras.get("shell_thickness_m", 0.0) >= 0


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_is_whole_and_short(scene, name):
    assert scene.name == name
    assert 60 <= scene.duration * scene.fps <= 120
    assert {s.object for s in scene.surfaces} == set(range(len(scene.objects)))
    assert {s.finish for s in scene.surfaces} == set(range(len(scene.finishes)))
    assert len({o.name for o in scene.objects}) == len(scene.objects)
    assert np.linalg.norm(showcase_scenes.view_direction(name)) > 0


def test_the_same_code_builds_the_same_scene(monkeypatch):
    first = showcase_scenes.build_showcase_scene("duck-on-mud")
    monkeypatch.setattr(showcase_scenes, "PROP_BUILDERS", PROP_BUILDERS)
    for a, b in zip(first.surfaces, showcase_scenes.build_showcase_scene("duck-on-mud").surfaces, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.triangles, b.triangles)


def test_the_duck_starts_above_the_mud_at_the_speed_of_its_fall():
    scene = showcase_scenes.build_showcase_scene("duck-on-mud")
    mud = next(s for s in scene.surfaces if s.name == "mud").vertices
    duck = next(s for s in scene.surfaces if s.name == "body").vertices
    near = np.hypot(*(mud[:, :2] - duck[:, :2].mean(0)).T) < 0.06
    gap = duck[:, 2].min() - mud[near, 2].max()
    speed = -scene.objects[1].velocity[2]
    assert gap + speed**2 / (2 * 9.81) == pytest.approx(1.2, abs=0.02)


def test_vase_ball_and_armchair_stand_in_a_row_with_gaps():
    scene = showcase_scenes.build_showcase_scene("vase-ball-armchair")
    parts = [[s for s in scene.surfaces if s.object == k] for k in range(3)]
    vase, ball, chair = (np.concatenate([s.vertices for s in p]) for p in parts)
    front = trimesh.Trimesh(parts[2][0].vertices, parts[2][0].triangles, process=False)
    places, *_ = front.ray.intersects_location(
        [[-1.5, y, 0.11] for y in (-0.1, 0.0, 0.1)], [[1.0, 0, 0]] * 3, multiple_hits=False
    )
    assert vase[:, 0].max() + 0.05 < ball[:, 0].min()
    assert len(places) == 3, "the stretcher stands in the ball's way"
    assert ball[:, 0].max() + 0.1 < places[:, 0].min()
    assert all(points[:, 2].min() == pytest.approx(0, abs=1e-4) for points in (vase, ball, chair))
