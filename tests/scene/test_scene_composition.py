"""What a composed scene consists of is kept, and scenes of older versions open."""

import json

import pytest

from corporeal.core.errors import BadFileError
from corporeal.discretization.object_scaling import SceneSizing
from corporeal.scene.rest_certificate import RestCertificate
from corporeal.scene.scene_composition import (
    ComposedObject,
    SceneComposition,
    read_certificate,
    read_composition,
    write_certificate,
    write_composition,
)

DUCK = ComposedObject("duck_0", "duck", "rubber_duck", "showcase", "00ff", "CC0", "", 0.08, "table", "usual", 0.5)
MADE = SceneComposition(
    7, "onto", "blender", "fall", "the duck falls", (DUCK,), SceneSizing(gamma=0.5), ("It is small.",)
)


def test_what_is_written_is_read_back_under_the_keys_that_the_disk_has(tmp_path):
    write_composition(tmp_path, MADE)
    assert read_composition(tmp_path) == MADE
    kept = json.loads((tmp_path / "composition.json").read_text())
    assert kept["objects"][0]["class"] == "duck" and "class_name" not in kept["objects"][0]
    assert kept["sizing"]["gamma"] == 0.5


def test_a_scene_that_was_settled_before_there_was_a_choice_of_engines_opens(tmp_path):
    write_composition(tmp_path, MADE)
    path = tmp_path / "composition.json"
    kept = json.loads(path.read_text())
    del kept["settled_with"]
    path.write_text(json.dumps(kept))
    assert read_composition(tmp_path).settled_with == "mujoco"


@pytest.mark.parametrize("text", ["{}", "[]", '{"objects": [{}]}', '{"objects": 3}', "null"])
def test_another_file_is_refused_in_one_sentence(tmp_path, text):
    (tmp_path / "composition.json").write_text(text)
    (tmp_path / "certificate.json").write_text(text)
    with pytest.raises(BadFileError, match=r"not a composition .* Assemble the scene again"):
        read_composition(tmp_path)
    with pytest.raises(BadFileError, match=r"not a certificate .* Assemble the scene again"):
        read_certificate(tmp_path)


def test_a_certificate_is_read_back(tmp_path):
    proof = RestCertificate(1e-5, 1e-4, 0.5, 3, 2, 1.5, 4, 1e-3, 1)
    write_certificate(tmp_path, proof)
    assert read_certificate(tmp_path) == proof
