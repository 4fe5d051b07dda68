"""The benchmark of rest: what stands is at rest, what hangs in the air is not."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.gltf.glb_writer import write_glb

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"


@pytest.fixture(scope="module")
def rest():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import rest

        yield rest
    finally:
        sys.path.remove(str(BENCHMARKS))


def write(folder, heights):
    """Steel cubes of 20 cm, so high above the floor [m]."""
    cube = trimesh.creation.box((0.2, 0.2, 0.2))
    surfaces, things = [], []
    for k, height in enumerate(heights):
        place = np.array([0.5 * k, 0.0, 0.1 + height])
        surfaces.append(Surface("steel", k, 0, cube.vertices + place, np.asarray(cube.faces)))
        things.append(SceneObject(name=f"cube_{k}", class_name="steel cube", real_extent=0.2))
    folder.mkdir(parents=True)
    path = folder / "scene.glb"
    finishes = (Finish("steel"),)
    write_glb(path, Scene("cubes", "", tuple(things), tuple(surfaces), finishes, duration=5.0))
    return path


def test_what_stands_is_at_rest_and_what_hangs_is_named(rest, tmp_path):
    path = write(tmp_path / "one-hangs", (0.0, 0.05))
    row = json.loads(json.dumps(rest.measure(path, tmp_path / "runs", "draft", 0.1)))
    stands, falls = row["objects"]
    assert stands["materials"] == ["steel"]
    assert stands["treatments"] == ["rigid"]
    assert stands["drift_dx"] < 0.01
    assert falls["moved_dx"][2] * row["cell_m"] == pytest.approx(-9.81 / 2 * 0.1**2, rel=0.03)
    assert falls["drift_dx"] == row["drift_dx"] >= rest.STILL
    assert not rest.at_rest(row)
    said = rest.summary([row])
    assert said.startswith("0 of 1 scenes at rest")
    assert "one-hangs: cube_1" in said
    assert "cube_0" not in said


def test_a_scene_that_cannot_be_simulated_is_named_with_its_reason(rest, tmp_path):
    path = tmp_path / "broken" / "scene.glb"
    path.parent.mkdir()
    path.write_bytes(b"no model")
    row = rest.measure(path, tmp_path / "runs", "draft", 0.1)
    assert "broken" in rest.summary([row])
    assert row["error"] in rest.summary([row])
    assert row["error"] in rest.lines(row)[0]


def post_on_toy(folder):
    """A post of wood on a stuffed toy of 20 cm, in a file that says they had settled."""
    boxes = (((0.2, 0.2, 0.2), 0.1, "plush toy"), ((0.1, 0.1, 0.25), 0.3255, "wood"))
    surfaces, things = [], []
    for k, (size, height, name) in enumerate(boxes):
        cube = trimesh.creation.box(size)
        place = np.array([0.0, 0.0, height])
        surfaces.append(Surface(name, k, k, cube.vertices + place, np.asarray(cube.faces)))
        things.append(SceneObject(name=f"cube_{k}", class_name=f"{name} cube", real_extent=max(size)))
    folder.mkdir(parents=True)
    path = folder / "scene.glb"
    finishes = tuple(Finish(name) for _, _, name in boxes)
    write_glb(path, Scene("soft", "", tuple(things), tuple(surfaces), finishes, settled=True))
    return path


@pytest.mark.slow
def test_a_settled_scene_with_something_soft_is_at_rest_and_without_settling_it_is_not(rest, tmp_path):
    path = post_on_toy(tmp_path / "soft")
    row, control = (rest.measure(path, tmp_path / said, "draft", 0.15, said) for said in ("said", "no"))
    assert row["objects"][0]["treatments"] == ["deformable"]
    assert row["settled"] is True
    assert row["objects"][1]["sank_dx"] > rest.STILL
    assert row["drift_dx"] < 0.1
    assert rest.at_rest(row)
    assert control["settled"] is None
    assert control["objects"][1]["sank_dx"] == 0.0
    assert control["drift_dx"] > rest.STILL
    assert not rest.at_rest(control)
    assert "| 0.00 |" in rest.lines(control)[1]
