import json

import pytest

from corporeal.core.errors import UserError
from corporeal.io.sources import called, kind_of, pictured, sources
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
    text = (
        '[[object]]\nfile = "cube.gltf"\n[[object]]\nfile = "ball.glb"\n[[object]]\nfile = "x.glb"'
    )
    (tmp_path / "scene.toml").write_text(text)
    names = {"scene.toml", "cube.gltf", "cube.bin", "skin.png", "ball.glb"}
    assert {p.name for p in sources([tmp_path / "scene.toml"])} == names
    assert {p.name for p in sources([tmp_path])} == names - {"scene.toml"}


def test_a_broken_file_still_counts_as_itself(tmp_path):
    for name in ("a.gltf", "a.toml"):
        (tmp_path / name).write_text("{ broken")
        assert sources([tmp_path / name]) == [tmp_path / name]
    for name in ("none.glb", "none.ply", "none.spz", "none.mp4", "none.json"):
        assert sources([tmp_path / name]) == []
        (tmp_path / "scene.toml").write_text(f'[[object]]\nfile = "{name}"')
        assert sources([tmp_path / "scene.toml"]) == [tmp_path / "scene.toml"], "it cannot be read"


def test_a_folder_is_called_by_its_whole_name(tmp_path):
    (tmp_path / "scan.2").mkdir()
    assert called(tmp_path / "scan.2") == "scan.2"
    assert called(tmp_path / "a.compressed.ply") == "a.compressed"


def test_names_tell_what_an_input_is(tmp_path):
    posed, splat, models = (tmp_path / name for name in ("posed", "sog", "models"))
    for folder in (posed, splat, models):
        folder.mkdir()
    for file in (posed / "transforms.json", splat / "meta.json", splat / "means_l.webp"):
        file.touch()
    (models / "a.glb").touch()
    assert kind_of([posed]) == kind_of([posed / "transforms.json"]) == "photographs"
    assert kind_of([splat]) == kind_of([tmp_path / "a.PLY"]) == "splat"
    assert kind_of([models]) == kind_of([models / "a.glb"]) == kind_of([tmp_path]) == "model"
    assert sources([posed / "transforms.json"]) == [posed] == sources([posed])
    (tmp_path / "fall.toml").write_text('file = "posed"')
    assert kind_of([tmp_path / "fall.toml"]) == "photographs"
    assert pictured([tmp_path / "fall.toml"]) == posed
    assert sources([tmp_path / "fall.toml"]) == [tmp_path / "fall.toml", posed]
    assert pictured([models / "a.glb"]) is None
    with pytest.raises(UserError, match=r"a\.ply is a whole scene \(splat\), which stands alone"):
        kind_of([models / "a.glb", tmp_path / "a.ply"])


@pytest.mark.parametrize("how", ["beside", "as an object"])
def test_photographs_among_models_are_told_how_they_come_together(tmp_path, how):
    """A scene file said of a folder of photographs: is no model, convert it to .glb."""
    (tmp_path / "bananas").mkdir()
    (tmp_path / "bananas" / "transforms.json").touch()
    said = r"bananas is a whole scene \(photographs\).*runs/bananas/0-reconstruct/bananas\.glb"
    with pytest.raises(UserError, match=said):
        if how == "beside":
            kind_of([tmp_path / "bananas", cube().save(tmp_path / "ball.glb")])
        else:
            (tmp_path / "scene.toml").write_text('[[object]]\nfile = "bananas"\n')
            assemble([tmp_path / "scene.toml"])
