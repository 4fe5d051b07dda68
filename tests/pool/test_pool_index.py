"""A folder of models becomes a pool; every file gets in or has a reason."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.pool import gate_verdicts
from corporeal.pool.pool_index import IndexConfig, OriginConfig, index_pool, read_pool
from corporeal.pool.quality_gate import GateConfig
from pool_models import ball, checks, glb, plain_ball, scene


def save(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def with_table(path):
    return IndexConfig(OriginConfig(csv=path))


@pytest.mark.slow
def test_every_real_object_is_let_in_but_those_that_are_several(shared_assets, tmp_path):
    folders = [shared_assets / "objects", shared_assets / "ycb"]
    pool = index_pool(folders, tmp_path / "pool")
    reasons = {Path(r.source).stem: r.reason for r in pool.rejections}
    assert set(reasons) == {"tea_set_polyhaven", "pillow_smallhouse"}
    assert "8 objects" in reasons["tea_set_polyhaven"]
    assert "2 objects" in reasons["pillow_smallhouse"]
    assert len(pool.assets) == 53
    assert len(pool.classes) == 40
    duck = pool.asset("duck_khronos")
    assert duck.class_name == "duck" and not duck.metric
    assert duck.licence == "SCEA-Shared-Source-1.0" and "Sony" in duck.attribution
    assert duck.file == (shared_assets / "objects" / "duck_khronos.glb").resolve()
    changed = [a.name for a in pool.assets if a.file.is_relative_to(tmp_path)]
    assert changed == ["guitar_market"], "a fifth of its triangles are degenerate"
    assert read_pool(tmp_path / "pool") == pool


def test_what_a_file_says_of_itself_is_measured_and_kept(tmp_path):
    data = plain_ball(0.035, copyright="CC BY 4.0, (c) 2021 Ada")
    path = save(tmp_path / "in" / "Orange_LP.glb", data)
    (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
    assert (asset.name, asset.class_name) == ("Orange_LP", "orange")
    assert (asset.file, asset.source) == (path.resolve(), str(path))
    assert asset.sha256 == hashlib.sha256(data).hexdigest()
    assert asset.extent == pytest.approx(0.07, rel=1e-6) and asset.metric
    assert (asset.triangles, asset.open_edges, asset.texture) == (4 * 24 * 23, 0.0, 0)
    assert asset.licence == "CC BY 4.0"
    assert asset.credit == "CC BY 4.0, (c) 2021 Ada"


def test_the_class_is_the_tables_then_the_folders_then_the_files(tmp_path):
    save(tmp_path / "in" / "mug" / "x1.glb", plain_ball(0.05))
    save(tmp_path / "in" / "mug" / "x2.glb", plain_ball(0.051))
    save(tmp_path / "in" / "tea_pot.glb", plain_ball(0.1))
    table = tmp_path / "said.csv"
    table.write_text("file, class, licence, attribution, metric\nin/mug/x2.glb, Soda_Can, MIT, Bo, no\n")
    pool = index_pool([tmp_path / "in"], tmp_path / "pool", with_table(table))
    classes = {a.name: a.class_name for a in pool.assets}
    assert classes == {"mug_x1": "mug", "mug_x2": "soda can", "tea_pot": "tea pot"}
    assert pool.asset("mug_x2").licence == "MIT" and pool.asset("mug_x2").attribution == "Bo"
    assert not pool.asset("mug_x2").metric
    assert pool.asset("mug_x1").licence == "unknown" and pool.asset("mug_x1").credit == ""


def test_folders_that_say_nothing_are_passed_over_and_models_called_model_take_their_name(tmp_path):
    save(tmp_path / "in" / "objects" / "Garden Chair" / "model.glb", plain_ball(0.5))
    save(tmp_path / "in" / "Duck" / "glTF-Binary" / "Duck.glb", plain_ball(0.05))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    classes = {a.name: a.class_name for a in pool.assets}
    assert classes == {"Garden_Chair_model": "garden chair", "Duck": "duck"}


def test_what_a_table_names_and_is_not_there_is_reported(tmp_path):
    save(tmp_path / "in" / "x.glb", plain_ball())
    table = tmp_path / "said.csv"
    table.write_text("file,class\nin/x.glb,ball\nin/y.glb,mug\n")
    pool = index_pool([tmp_path / "in"], tmp_path / "pool", with_table(table))
    assert len(pool.assets) == 1
    (told,) = pool.rejections
    assert (told.source, told.class_name) == (str(tmp_path / "in" / "y.glb"), "mug")
    assert told.reason == "there is no such file, though a table names it"


def test_a_manifest_in_the_folder_or_above_it_is_picked_up(tmp_path):
    save(tmp_path / "all" / "objects" / "x.glb", plain_ball(0.05))
    columns = "file,category,licence,attribution,max_extent_m,metric_scale"
    row = 'objects/x.glb,rubber ball,CC0-1.0,"Kay, Bo",0.1,no (artist units)'
    (tmp_path / "all" / "manifest.csv").write_text(f"{columns}\n{row}\n")
    (asset,) = index_pool([tmp_path / "all" / "objects"], tmp_path / "pool").assets
    assert (asset.class_name, asset.licence) == ("rubber ball", "CC0-1.0")
    assert asset.attribution == "Kay, Bo" and not asset.metric
    assert index_pool([tmp_path / "all"], tmp_path / "other").assets[0].class_name == "rubber ball"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name,class\nx,y\n", "no column 'file'"),
        ("", "no column 'file'"),
        ("file,class,metric\nx.glb,ball,perhaps\n", "line 2: 'perhaps' is neither yes nor no"),
        ("file,class,extent_m\nx.glb,ball,-3\n", "line 2: '-3' is no length"),
        ("file,class,extent_m\nx.glb,ball,nan\n", "line 2: 'nan' is no length"),
        (b"file,class\nx.glb,\xff\xfe\n", "cannot be read as a table"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_in_one_line(tmp_path, text, said):
    save(tmp_path / "in" / "x.glb", plain_ball())
    table = tmp_path / "said.csv"
    table.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UserError, match=said):
        index_pool([tmp_path / "in"], tmp_path / "pool", with_table(table))


def test_folders_without_models_are_refused(tmp_path):
    with pytest.raises(UserError, match="no such folder"):
        index_pool([tmp_path / "absent"], tmp_path / "pool")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="no model"):
        index_pool([tmp_path / "empty"], tmp_path / "pool")
    with pytest.raises(UserError, match="no asset pool"):
        read_pool(tmp_path / "nowhere")


def test_metres_are_believed_where_the_size_is_usual(tmp_path):
    save(tmp_path / "in" / "mug.glb", plain_ball(0.05))
    save(tmp_path / "in" / "cup.glb", plain_ball(50.0))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert pool.asset("mug").metric and not pool.asset("cup").metric


def test_a_stated_extent_that_the_mesh_has_not_puts_its_units_in_doubt(tmp_path):
    save(tmp_path / "in" / "mug.glb", plain_ball(0.05))
    table = tmp_path / "said.csv"
    for extent, metric in (("0.1", True), ("0.15", False)):
        table.write_text(f"file,class,metric,extent_m\nin/mug.glb,mug,yes,{extent}\n")
        (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool", with_table(table)).assets
        assert asset.metric is metric


def test_names_are_made_unique(tmp_path):
    for k in range(3):
        save(tmp_path / "in" / f"set{k}" / "ball.glb", plain_ball(0.1 + 0.01 * k))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert sorted(a.name for a in pool.assets) == ["ball", "ball_1", "ball_2"]


def test_nothing_is_judged_twice_and_what_changed_is_judged_again(tmp_path, monkeypatch):
    judged = []
    real = gate_verdicts.judge_file
    monkeypatch.setattr(gate_verdicts, "judge_file", lambda f, *a: judged.append(f.name) or real(f, *a))
    for k in range(3):
        save(tmp_path / "in" / f"ball{k}.glb", plain_ball(0.1 + 0.01 * k))
    save(tmp_path / "in" / "bad.glb", b"glTF")
    first = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert len(judged) == 4
    assert index_pool([tmp_path / "in"], tmp_path / "pool") == first
    assert len(judged) == 4
    save(tmp_path / "in" / "ball1.glb", plain_ball(0.2))
    index_pool([tmp_path / "in"], tmp_path / "pool")
    assert judged[4:] == ["ball1.glb"]
    strict = IndexConfig(gate=GateConfig(least_plain=10_000))
    assert not index_pool([tmp_path / "in"], tmp_path / "pool", strict).assets
    assert len(judged) == 9, "another gate judges anew"


def test_an_interrupted_run_goes_on_where_it_was(tmp_path, monkeypatch):
    judged = []
    real = gate_verdicts.judge_file

    def judge(file, *more):
        if len(judged) == 2:
            raise KeyboardInterrupt
        judged.append(file.name)
        return real(file, *more)

    for k in range(4):
        save(tmp_path / "in" / f"ball{k}.glb", plain_ball(0.1 + 0.01 * k))
    monkeypatch.setattr(gate_verdicts, "judge_file", judge)
    with pytest.raises(KeyboardInterrupt):
        index_pool([tmp_path / "in"], tmp_path / "pool")
    log = tmp_path / "pool" / gate_verdicts.VERDICTS_FILE
    log.write_bytes(log.read_bytes()[:-10])  # killed while it wrote
    monkeypatch.setattr(gate_verdicts, "judge_file", lambda f, *a: judged.append(f.name) or real(f, *a))
    pool = index_pool([tmp_path / "in"], tmp_path / "pool")
    assert judged == [f"ball{k}.glb" for k in (0, 1, 1, 2, 3)]
    assert len(pool.assets) == 4
    assert index_pool([tmp_path / "in"], tmp_path / "pool") == pool
    assert len(judged) == 5, "the torn line did not swallow the verdict written after it"


def test_another_folder_adds_to_the_pool_and_what_is_gone_leaves_it(tmp_path):
    first = save(tmp_path / "a" / "ball.glb", plain_ball(0.1))
    save(tmp_path / "b" / "ball.glb", plain_ball(0.11))
    save(tmp_path / "b" / "bad.glb", b"nothing")
    index_pool([tmp_path / "a"], tmp_path / "pool")
    pool = index_pool([tmp_path / "b"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["ball", "ball_1"]
    first.unlink()
    pool = index_pool([tmp_path / "b"], tmp_path / "pool")
    assert [a.name for a in pool.assets] == ["ball"]
    assert len(pool.rejections) == 1


def test_a_copy_that_was_deleted_is_made_again(tmp_path):
    vertices, triangles, uv = ball(40)
    write_glb(tmp_path / "ball.glb", scene(vertices, triangles, uv, checks(512, 512)))
    config = IndexConfig(gate=GateConfig(most_triangles=1000))
    pool = index_pool([tmp_path], tmp_path / "pool", config)
    (asset,) = pool.assets
    assert asset.file.parent == tmp_path / "pool" / "models"
    data = asset.file.read_bytes()
    assert hashlib.sha256(data).hexdigest() == asset.sha256
    asset.file.unlink()
    assert index_pool([tmp_path], tmp_path / "pool", config) == pool
    assert asset.file.read_bytes() == data


def test_a_pool_can_be_moved_with_its_copies(tmp_path):
    vertices, triangles, _ = ball(40)
    save(tmp_path / "in" / "ball.glb", glb(vertices, triangles))
    config = IndexConfig(gate=GateConfig(most_triangles=1000))
    index_pool([tmp_path / "in"], tmp_path / "pool", config)
    (tmp_path / "pool").rename(tmp_path / "moved")
    (asset,) = read_pool(tmp_path / "moved").assets
    read = read_glb(asset.file)
    assert sum(len(s.triangles) for s in read.surfaces) == asset.triangles <= 1000


def test_companions_count_as_content_and_a_gltf_becomes_a_glb(tmp_path):
    vertices, triangles, _ = ball()
    folder = tmp_path / "in"
    save(folder / "ball.bin", vertices.astype("<f4").tobytes() + triangles.astype("<u4").tobytes())
    views = [vertices.size * 4, triangles.size * 4]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "ball.bin", "byteLength": sum(views)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": views[0]},
            {"buffer": 0, "byteOffset": views[0], "byteLength": views[1]},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    save(folder / "ball.gltf", json.dumps(document).encode())
    (asset,) = index_pool([folder], tmp_path / "pool").assets
    assert asset.file.suffix == ".glb" and asset.class_name == "ball"
    (read,) = read_glb(asset.file).surfaces
    np.testing.assert_allclose(np.ptp(read.vertices, axis=0).max(), 0.2, rtol=1e-6)
    save(folder / "ball.bin", (2 * vertices).astype("<f4").tobytes() + triangles.astype("<u4").tobytes())
    assert index_pool([folder], tmp_path / "pool").assets[0].extent == pytest.approx(0.4)


@pytest.mark.slow
def test_an_obj_becomes_a_glb_and_its_picture_counts_as_content(tmp_path):
    vertices, triangles, uv = ball()
    lines = ["mtllib ball.mtl", "usemtl look"]
    lines += [f"v {x} {y} {z}" for x, y, z in vertices] + [f"vt {u} {v}" for u, v in uv]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in triangles + 1]
    save(tmp_path / "in" / "toy" / "ball.obj", "\n".join(lines).encode())
    save(tmp_path / "in" / "toy" / "ball.mtl", b"newmtl look\nmap_Kd ball.png\n")
    picture = tmp_path / "in" / "toy" / "ball.png"
    for k in (512, 1024):
        Image.fromarray(checks(k, k)).save(picture)
        (asset,) = index_pool([tmp_path / "in"], tmp_path / "pool").assets
        assert (asset.class_name, asset.texture, asset.triangles) == ("toy", k, len(triangles))
    scene = read_glb(asset.file)
    assert np.array_equal(scene.finishes[0].texture, checks(k, k))
    used = uv[np.unique(triangles)] * (1, -1) + (0, 1)
    found, wanted = (np.unique(np.round(x, 4), axis=0) for x in (scene.surfaces[0].uv, used))
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_the_progress_names_every_file(tmp_path):
    for k in range(4):
        save(tmp_path / "in" / f"ball{k}.glb", plain_ball(0.1 + 0.01 * k))
    told = []
    index_pool([tmp_path / "in"], tmp_path / "pool", progress=lambda f, words: told.append((f, words)))
    assert told == [(k / 4, f"ball{k}.glb") for k in range(4)] + [(1.0, "")]


def test_a_damaged_index_is_reported_in_one_line(tmp_path):
    save(tmp_path / "in" / "ball.glb", plain_ball())
    index_pool([tmp_path / "in"], tmp_path / "pool")
    path = tmp_path / "pool" / "pool.json"
    for text in ("{", "[]", '{"assets": [{}], "rejections": []}'):
        path.write_text(text)
        with pytest.raises(UserError, match=r"pool\.json.*Delete it"):
            read_pool(tmp_path / "pool")


def test_two_processes_do_not_write_one_pool(tmp_path):
    save(tmp_path / "in" / "ball.glb", plain_ball())
    with store.lock_folder(tmp_path / "pool"), pytest.raises(UserError, match="works in"):
        index_pool([tmp_path / "in"], tmp_path / "pool")
