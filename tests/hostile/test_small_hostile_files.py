"""Hostile files made here, so that they are tested everywhere."""

import copy
import json
import os
import random
import struct
import time
import zlib

import DracoPy
import numpy as np
import pytest

from corporeal.core.errors import BadFileError
from corporeal.io.gltf.gltf_reader import read_glb
from glb_maker import CUBE, CUBE_TRIANGLES, Maker, cube, pack


def refused(path, said, seconds=10.0):
    start = time.process_time()
    with pytest.raises(BadFileError, match=said) as error:
        read_glb(path)
    assert time.process_time() - start < seconds
    assert path.name in str(error.value)


def change(made, place, value):
    """Set what a path such as "accessors/0/count" leads to."""
    *way, last = [int(k) if k.isdigit() else k for k in place.split("/")]
    item = made.json
    for key in way:
        item = item[key]
    item[last] = value
    return made


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("accessors/0/count", 2**31, "more than its 96 bytes"),
        ("accessors/0/count", 10**30, "not a whole number"),
        ("accessors/0/count", -1, "not a whole number"),
        ("accessors/0/count", True, "not a whole number"),
        ("accessors/0/count", "8", "not a whole number"),
        ("accessors/0/count", 9, "claims 9 values"),
        ("accessors/0/count", 4, "beyond the 4 vertices"),
        ("accessors/0/componentType", 5124, "componentType"),
        ("accessors/0/type", "VEC9", "'type'"),
        ("accessors/0/type", ["VEC3"], "'type'"),
        ("accessors/0/byteOffset", 2**40, "byteOffset"),
        ("accessors/0/bufferView", 7, "only 2"),
        ("accessors/0", None, "not a JSON object"),
        ("accessors", {}, "not a list"),
        ("accessors/1/componentType", 5126, "more than its|unsigned integers"),
        ("bufferViews/0/byteLength", 10**12, "not a whole number|there are only"),
        ("bufferViews/0/byteOffset", 150, "there are only"),
        ("bufferViews/0/byteStride", 4, "smaller than one row"),
        ("bufferViews/0/byteStride", 252, "claims 8 values"),
        ("bufferViews/0/buffer", 1, "only 1"),
        ("meshes/0/primitives/0/mode", 9, "unknown 'mode'"),
        ("meshes/0/primitives/0/attributes", [], "not a JSON object"),
        ("meshes/0/primitives/0/attributes", {}, "no triangles"),
        ("meshes/0/primitives/0/attributes/POSITION", 1, "numbers a row"),
        ("meshes/0/primitives", 3, "not a list"),
        ("nodes/0/mesh", 3, "only 1"),
        ("nodes/0/matrix", [0] * 15, "16 numbers"),
        ("nodes/0/matrix", [0] * 16, "affine"),
        ("nodes/0/scale", [0, 0, 0], "no triangles of any size"),
        ("nodes/0/scale", [1e300, 1, 1], "transform"),
        ("nodes/0/rotation", [0, 0, 0, 0], "quaternion"),
        ("nodes/0/translation", [None, 0, 0], "finite"),
        ("nodes/0/children", [0], "twice, or below itself"),
        ("nodes/0/children", ["0"], "does not exist"),
        ("scenes/0/nodes", [0, 0], "twice"),
        ("scenes/0/nodes", [5], "does not exist"),
        ("scenes/0/nodes", [], "no triangles"),
        ("scene", 4, "only 1"),
        ("asset/version", "1.0", "glTF 1.0"),
        ("asset/minVersion", "3.0", "glTF 3.0"),
        ("extensionsRequired", ["ACME_cubes"], "'ACME_cubes', which is not supported"),
    ],
)
def test_a_lie_in_the_structure_is_named(tmp_path, place, value, said):
    refused(change(cube(), place, value).save(tmp_path / "a.glb"), said)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("asset", {}),
        ("materials", 3),
        ("materials", [3]),
        ("materials", [{"pbrMetallicRoughness": {"baseColorFactor": "red"}}]),
        ("materials", [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 9}}}]),
        ("materials", [{"emissiveFactor": [None, 0, 0], "alphaMode": 7, "name": {}}]),
        ("nodes/0/name", 12),
        ("nodes/0/extras", "words"),
        ("nodes/0/extras", {"class": 3, "real_extent_m": "big"}),
        ("nodes/0/skin", 77),
        ("meshes/0/name", "x" * 10**6),
        ("cameras", [{}]),
        ("animations", [{"channels": 4}]),
    ],
)
def test_a_lie_about_the_look_or_the_names_costs_no_shape(tmp_path, place, value):
    made = change(cube(), place, value)
    made.primitive()["material"] = 0
    (surface,) = read_glb(made.save(tmp_path / "a.glb")).surfaces
    assert len(surface.triangles) == 12
    assert len(surface.name) <= 120


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 3e38])
def test_positions_that_are_nowhere_name_their_mesh(tmp_path, bad):
    vertices = CUBE.copy()
    vertices[3, 1] = bad
    made = Maker()
    made.node(mesh=made.mesh(vertices))
    made.json["meshes"][0]["name"] = "hull"
    refused(made.save(tmp_path / "a.glb"), "mesh 'hull' has 1 of 8 vertices at impossible places")


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity"])
def test_bare_nan_in_the_json_is_refused(tmp_path, word):
    text = json.dumps(cube().json).replace('"scene": 0', f'"scene": 0, "extras": [{word}]')
    (tmp_path / "a.gltf").write_text(text)
    refused(tmp_path / "a.gltf", f"bare {word}")


@pytest.mark.parametrize(
    "text",
    [b"", b"\0", b"glTF", b"{", b"[]", b"\xff\xfe{}", b"[" * 10**6, b"9" * 10**5, b'{"a":' * 10**5,
     b"PK\x03\x04", b"solid x", b"<html>404</html>"],
)  # fmt: skip
def test_bytes_that_are_no_gltf_are_refused(tmp_path, text):
    for name in ("a.glb", "a.gltf"):
        (tmp_path / name).write_bytes(text)
        refused(tmp_path / name, "a.gl")


def test_a_file_cut_off_anywhere_is_refused(tmp_path):
    whole = cube().save(tmp_path / "whole.glb").read_bytes()
    for length in range(0, len(whole), 13):
        (tmp_path / "cut.glb").write_bytes(whole[:length])
        refused(tmp_path / "cut.glb", "cut off|empty|header")


def test_objects_that_are_no_files_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.glb")
    (tmp_path / "folder.glb").mkdir()
    (tmp_path / "dangling.glb").symlink_to(tmp_path / "none")
    for name in ("pipe.glb", "folder.glb", "dangling.glb", "none.glb"):
        refused(tmp_path / name, "is not a file|no such file")


@pytest.mark.parametrize(
    "uri",
    ["../secret.bin", "%2e%2e/secret.bin", "a/../../secret.bin", "..\\secret.bin", "link.bin",
     "/etc/passwd", "file:///etc/passwd", "http://example.org/a.bin", "\\\\host\\a", "C:\\a.bin",
     "nul\0l.bin", "x" * 5000, "", ".", "data:", "data:;base64,AAA"],
)  # fmt: skip
def test_nothing_outside_the_folder_is_read(tmp_path, uri):
    made = cube()
    (tmp_path / "secret.bin").write_bytes(made.binary)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.bin").symlink_to(tmp_path / "secret.bin")
    made.json["buffers"] = [{"byteLength": len(made.binary), "uri": uri}]
    (tmp_path / "in" / "a.gltf").write_text(json.dumps(made.json))
    refused(tmp_path / "in" / "a.gltf", "folder|not there|base64|cannot|no content|only|null")


def test_an_accessor_without_bytes_may_not_be_endless(tmp_path):
    made = cube()
    made.json["accessors"][0] = {"componentType": 5126, "type": "VEC3", "count": 2**32}
    refused(made.save(tmp_path / "a.glb"), "holds none")


def test_a_mesh_shown_a_million_times_is_refused(tmp_path):
    made = Maker()
    strip = np.arange(60000, dtype=np.uint16)
    mesh = made.mesh(np.random.default_rng(0).random((60000, 3)), strip, mode=5)
    made.json["nodes"] = [{"mesh": mesh}] * 9_000
    made.json["scenes"][0]["nodes"] = list(range(9_000))
    refused(made.save(tmp_path / "a.glb"), "million vertices and indices")


def test_too_many_small_pieces_are_refused(tmp_path):
    made = cube()
    made.json["nodes"] = [{"mesh": 0}] * 12_000
    made.json["scenes"][0]["nodes"] = list(range(12_000))
    refused(made.save(tmp_path / "a.glb"), "more than 10000 pieces", seconds=20)


def test_a_very_deep_tree_is_read(tmp_path):
    made = Maker()
    made.mesh()
    depth = 2000
    made.json["nodes"] = [{"children": [k + 1]} for k in range(depth)] + [{"mesh": 0}]
    made.json["scenes"][0]["nodes"] = [0]
    for objects in ("auto", "nodes"):
        assert len(read_glb(made.save(tmp_path / "a.glb"), objects).objects) == 1


def test_transforms_that_multiply_beyond_all_bounds_are_refused(tmp_path):
    made = Maker()
    made.mesh()
    made.json["nodes"] = [{"children": [k + 1], "scale": [1e6] * 3} for k in range(100)]
    made.json["nodes"].append({"mesh": 0})
    made.json["scenes"][0]["nodes"] = [0]
    refused(made.save(tmp_path / "a.glb"), "transform")


def test_meshopt_says_how_to_unpack_it(tmp_path):
    made = cube()
    made.json["extensionsRequired"] = ["EXT_meshopt_compression"]
    for view in made.json["bufferViews"]:
        view["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    refused(made.save(tmp_path / "a.glb"), "EXT_meshopt_compression, which is not supported")


@pytest.mark.parametrize("data", [b"", b"DRACO", b"rubbish" * 9, "cut", "bomb"])
def test_broken_draco_is_refused(tmp_path, data):
    good = DracoPy.encode(CUBE, CUBE_TRIANGLES.astype(np.uint32))
    if data == "cut":
        data = good[: len(good) // 2]
    elif data == "bomb":
        data = good[:12] + b"\xff\xff\xff\xff\x07" * 2 + good[14:]
    made = cube()
    packed = {"bufferView": made.view(data), "attributes": {"POSITION": 0}}
    made.primitive()["extensions"] = {"KHR_draco_mesh_compression": packed}
    refused(made.save(tmp_path / "a.glb"), "Draco|million|more values")


def test_a_picture_that_unpacks_to_gigabytes_is_left_out(tmp_path):
    def chunk(kind, data):
        crc = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + crc

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 65000, 65000, 8, 2, 0, 0, 0))
    bomb = b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(10**6)))
    made = cube()
    made.primitive()["material"] = 0
    made.json |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": made.view(bomb)}],
    }
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert scene.finishes[0].texture is None
    assert "pixels" in scene.warnings[0]


def test_a_skinned_mesh_stands_as_its_skeleton_rests(tmp_path):
    made = Maker()
    weights = np.zeros((8, 4), np.float32)
    weights[:, 0] = 1
    bind = np.eye(4, dtype=np.float32)
    bind[3, 0] = -1  # column-major: moves by -1 in x
    mesh = made.mesh(
        attributes={"JOINTS_0": made.accessor(np.zeros((8, 4), np.uint8)), "WEIGHTS_0": made.accessor(weights)}
    )
    inverse = made.accessor(bind.reshape(1, 16)[:, :4], type="MAT4", bufferView=0)
    made.json["accessors"][inverse]["bufferView"] = made.view(bind.tobytes())
    joint = made.node(scale=[2, 2, 2])
    made.node(mesh=mesh, skin=0, translation=[100, 0, 0])
    made.json["skins"] = [{"joints": [joint], "inverseBindMatrices": inverse}]
    (s,) = read_glb(made.save(tmp_path / "a.glb")).surfaces
    assert np.allclose(s.vertices.min(0), [-2, -2, 0])
    assert np.allclose(s.vertices.max(0), [0, 0, 2])


WEIRD = [
    None, -1, 0, 1, 7, 1e308, -0.5, 2**63, 10**30, True, "", "x", [], {}, [1], [None], {"a": 1},
    [1e308] * 3, [0, 0, 0, 0], "../../etc/passwd", "data:,", 5121, 5126, "VEC3", "MAT4",
]  # fmt: skip


def test_no_random_change_to_a_file_breaks_the_reader(tmp_path):
    chance = random.Random(11)
    made = cube(name="crate", extras={"class": "box", "real_extent_m": 1})
    made.primitive()["material"] = 0
    made.primitive()["attributes"]["COLOR_0"] = made.accessor(np.ones((8, 4), np.float32))
    made.json["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}]
    made.json["buffers"] = [{"byteLength": len(made.binary)}]
    read = 0
    for _ in range(400):
        text = copy.deepcopy(made.json)
        for _ in range(chance.randint(1, 3)):
            item, key = chance.choice(list(places(text)))
            item[key] = copy.deepcopy(chance.choice(WEIRD))
        (tmp_path / "a.glb").write_bytes(pack(text, made.binary))
        try:
            read_glb(tmp_path / "a.glb", chance.choice(("auto", "one", "nodes")))
            read += 1
        except BadFileError as error:
            assert "a.glb" in str(error)
    assert 20 < read < 380


def places(item):
    """Every container and key within nested lists and objects."""
    pairs = item.items() if isinstance(item, dict) else enumerate(item)
    for key, value in pairs:
        yield item, key
        if isinstance(value, dict | list):
            yield from places(value)
