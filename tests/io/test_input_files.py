import json

import pytest

from corporeal.core.errors import UserError
from corporeal.io.input_files import input_kind, list_input_files, photographed_input, scene_name
from corporeal.pipeline.stages.assemble import assemble
from glb_maker import cube


def test_a_scene_is_made_of_every_file_that_it_names(tmp_path):
    made = cube()
    (tmp_path / "cube.bin").write_bytes(made.binary)
    (tmp_path / "skin.png").write_bytes(b"")
    made.json["buffers"] = [{"byteLength": len(made.binary), "uri": "cube.bin"}]
    made.json["images"] = [{"uri": "skin.png"}, {"uri": "data:,"}, {"uri": "../../etc/passwd"}]
    (tmp_path / "cube.gltf").write_text(json.dumps(made.json))
    cube().save(tmp_path / "ball.glb")
    text = '[[object]]\nfile = "cube.gltf"\n[[object]]\nfile = "ball.glb"\n[[object]]\nfile = "x.glb"'
    (tmp_path / "scene.toml").write_text(text)
    names = {"scene.toml", "cube.gltf", "cube.bin", "skin.png", "ball.glb"}
    assert {p.name for p in list_input_files([tmp_path / "scene.toml"])} == names
    assert {p.name for p in list_input_files([tmp_path])} == names - {"scene.toml"}


def test_a_broken_file_still_counts_as_itself(tmp_path):
    for name in ("a.gltf", "a.toml"):
        (tmp_path / name).write_text("{ broken")
        assert list_input_files([tmp_path / name]) == [tmp_path / name]
    for name in ("none.glb", "none.ply", "none.spz", "none.mp4", "none.json"):
        assert list_input_files([tmp_path / name]) == []
        (tmp_path / "scene.toml").write_text(f'[[object]]\nfile = "{name}"')
        assert list_input_files([tmp_path / "scene.toml"]) == [tmp_path / "scene.toml"], "it cannot be read"


def test_a_folder_is_called_by_its_whole_name(tmp_path):
    (tmp_path / "scan.2").mkdir()
    assert scene_name(tmp_path / "scan.2") == "scan.2"
    assert scene_name(tmp_path / "a.compressed.ply") == "a.compressed"


def test_names_tell_what_an_input_is(tmp_path):
    posed, splat, models = (tmp_path / name for name in ("posed", "sog", "models"))
    for folder in (posed, splat, models):
        folder.mkdir()
    for file in (posed / "transforms.json", splat / "meta.json", splat / "means_l.webp"):
        file.touch()
    (models / "a.glb").touch()
    assert input_kind([posed]) == input_kind([posed / "transforms.json"]) == "photographs"
    assert input_kind([splat]) == input_kind([tmp_path / "a.PLY"]) == "splat"
    assert input_kind([models]) == input_kind([models / "a.glb"]) == input_kind([tmp_path]) == "model"
    assert list_input_files([posed / "transforms.json"]) == [posed] == list_input_files([posed])
    (tmp_path / "fall.toml").write_text('file = "posed"')
    assert input_kind([tmp_path / "fall.toml"]) == "photographs"
    assert photographed_input([tmp_path / "fall.toml"]) == posed
    assert list_input_files([tmp_path / "fall.toml"]) == [tmp_path / "fall.toml", posed]
    assert photographed_input([models / "a.glb"]) is None
    with pytest.raises(UserError, match=r"a\.ply is a whole scene \(splat\), which stands alone"):
        input_kind([models / "a.glb", tmp_path / "a.ply"])


@pytest.mark.parametrize("how", ["beside", "as an object"])
def test_photographs_among_models_are_reported_with_how_to_combine_them(tmp_path, how):
    """A scene file said of a folder of photographs: is no model, convert it to .glb."""
    (tmp_path / "bananas").mkdir()
    (tmp_path / "bananas" / "transforms.json").touch()
    said = r"bananas is a whole scene \(photographs\).*runs/bananas/0-reconstruct/bananas\.glb"
    with pytest.raises(UserError, match=said):
        if how == "beside":
            input_kind([tmp_path / "bananas", cube().save(tmp_path / "ball.glb")])
        else:
            (tmp_path / "scene.toml").write_text('[[object]]\nfile = "bananas"\n')
            assemble([tmp_path / "scene.toml"])
