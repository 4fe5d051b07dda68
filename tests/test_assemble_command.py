"""`corporeal assemble`: from a folder of models to a scene that can be run."""

import json

import numpy as np
import pytest
import trimesh

from glb_maker import Maker
from test_cli import refused

VIEWS = ("--views", "2", "--size", "32", "32")


@pytest.fixture
def typed(monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    for name, sides in {"box": (1, 1, 1), "plank": (4, 0.5, 1)}.items():
        fine = trimesh.creation.box(sides).subdivide().subdivide()
        maker = Maker()
        maker.node(mesh=maker.mesh(fine.vertices, fine.faces.astype(np.uint16)))
        (tmp_path / "models" / name).mkdir(parents=True)
        maker.save(tmp_path / "models" / name / f"{name}.glb")
    return command


@pytest.mark.slow
def test_a_folder_of_models_becomes_a_certified_scene_with_views(typed, tmp_path):
    code, text = typed("assemble", "--from", "models", "--classes", "box", "plank", *VIEWS)
    assert code == 0, text.err
    folder = tmp_path / "scenes" / "box-plank-0"
    assert {p.name for p in folder.iterdir()} >= {
        *("scene.glb", "scene.toml", "certificate.json", "composition.json", "views")
    }
    proof = json.loads((folder / "certificate.json").read_text())
    assert {"drift_m", "penetration_m", "extent_m", "seed", "attempts", "seconds", "objects"} <= set(proof)
    assert len(json.loads((folder / "views" / "transforms.json").read_text())["frames"]) == 2
    assert "corporeal run scenes/box-plank-0/scene.toml" in text.out


@pytest.mark.slow
def test_the_pool_that_was_made_serves_again_and_another_seed_is_another_scene(typed, tmp_path):
    assert typed("assemble", "--from", "models", "--count", "1", "--views", "0")[0] == 0
    said = ("assemble", "--from", "scenes/pool", "--count", "1", "--seed", "4", "--views", "0")
    code, text = typed(*said)
    assert code == 0, text.err
    assert not (tmp_path / "scenes" / "scene-4" / "views").exists()


def test_what_cannot_be_assembled_is_reported_in_one_line(typed, tmp_path):
    refused(typed("assemble", "--from", "nowhere"), "nowhere")
    refused(typed("assemble", "--from", "models", "--classes", "duck"), "box, plank")
    assert not list((tmp_path / "scenes").glob("scene-*"))
