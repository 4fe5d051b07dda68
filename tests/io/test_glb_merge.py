"""Files joined byte for byte."""

import hashlib
import io
import json
import math
from base64 import b64encode

import DracoPy
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.spatial.transform import Rotation

from corporeal.core.errors import BadFileError, UserError
from corporeal.io.gltf import gltf_copy
from corporeal.io.gltf.glb_merge import MergeMember, merge_glb_files
from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.io.gltf.gltf_reader import read_glb, read_gltf_model
from glb_maker import CUBE, CUBE_TRIANGLES, Maker, cube, pack

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
HERE = (0.0, 0.0, 0.0)
GRAVITY = {"gravity_m_s2": [0.0, 0.0, -9.81], "duration_s": 1.5, "fps": 25}


def member(file, name="box_0", position=HERE, quaternion=UPRIGHT, scale=1.0, **extras):
    return MergeMember(file, name, position, quaternion, scale, {"class": "box"} | extras)


def merged(tmp_path, *members, **extras):
    path = tmp_path / "scene.glb"
    merge_glb_files(path, members, "scene", GRAVITY | extras)
    return path


def json_of(path):
    return GltfDocument(path).root.value


def placed(vertices, m):
    w, x, y, z = m.quaternion
    turn = Rotation.from_quat([x, y, z, w]).as_matrix()
    return (m.scale * np.asarray(vertices, float)) @ turn.T + m.position


def pictures(path):
    """SHA-256 of every picture's bytes, in the file's order."""
    document = GltfDocument(path)
    found = []
    for image in document.entries("images"):
        view = image.refer("bufferView", "bufferViews")
        data = document.view(view) if view else document.resource(image)
        found.append(hashlib.sha256(data).hexdigest())
    return found


def png(colour=(200, 30, 40)):
    out = io.BytesIO()
    Image.new("RGB", (4, 4), colour).save(out, "PNG")
    return out.getvalue()


def dressed(**texture):
    """A cube with a picture, a sampler, and extensions that our own types know nothing of."""
    made = Maker()
    uv = made.accessor(np.zeros((8, 2), np.float32))
    made.node(mesh=made.mesh(attributes={"TEXCOORD_0": uv}, material=0), name="shell")
    info = {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
    made.json |= {
        "images": [{"bufferView": made.view(png()), "mimeType": "image/png", "name": "red"}],
        "samplers": [{"wrapS": 33071, "magFilter": 9728, "name": "clamped"}],
        "textures": [{"source": 0, "sampler": 0, "name": "paint"} | texture],
        "materials": [
            {
                "name": "lacquer",
                "pbrMetallicRoughness": {"baseColorTexture": info, "roughnessFactor": 0.25},
                "extensions": {
                    "KHR_materials_clearcoat": {"clearcoatTexture": {"index": 0}},
                    "KHR_materials_ior": {"ior": 1.4},
                },
                "extras": {"baseTexture": {"index": 99}},
            }
        ],
        "extensionsUsed": [
            "KHR_texture_transform",
            "KHR_materials_clearcoat",
            "KHR_materials_ior",
            "KHR_lights_punctual",
        ],
        "extensionsRequired": ["KHR_texture_transform"],
    }
    return made


# ---------------------------------------------------------------- where things stand


finite = st.floats(-50, 50, allow_subnormal=False)
turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)


@given(st.tuples(finite, finite, finite), turns, st.floats(1e-3, 1e3))
@settings(max_examples=12, deadline=None)
def test_an_object_stands_where_its_member_says(tmp_path_factory, position, quaternion, scale):
    folder = tmp_path_factory.mktemp("merge")
    m = member(cube(name="box").save(folder / "box.glb"), "box_0", position, quaternion, scale)
    before = read_glb(m.file).surfaces[0].vertices
    after = read_glb(merged(folder, m)).surfaces[0].vertices
    assert np.abs(after - placed(before, m)).max() <= 1e-12 * (scale + 50)


def test_another_reader_sees_the_same_objects_at_the_same_places(tmp_path):
    """Trimesh reads the file as it is, Y up."""
    file = cube(name="box").save(tmp_path / "box.glb")
    turn = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # a quarter about the vertical
    members = [member(file, "box_0", (1.0, 2.0, 3.0), turn, 2.0), member(file, "box_1", (-4.0, 0.0, 0.5))]
    seen = trimesh.load_scene(merged(tmp_path, *members))
    assert {"scene", "box_0", "box_1"} <= set(seen.graph.nodes)
    # The file's cube is x, y, z in [0, 1], and so x, -z, y of ours.
    ours = placed([[0, -1, 0], [1, 0, 1]], members[0])
    ours = np.concatenate([ours, placed([[0, -1, 0], [1, 0, 1]], members[1])])
    low, high = ours.min(axis=0), ours.max(axis=0)
    wanted = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]
    np.testing.assert_allclose(seen.bounds, wanted, atol=1e-6)


def test_a_file_reads_back_as_one_of_ours(tmp_path):
    file = cube(name="box").save(tmp_path / "box.glb")
    said = {
        "object_id": "o1",
        "class": "cardboard box",
        "real_extent_m": 0.4,
        "scale": 2.5,
        "source": "somewhere",
        "licence": "CC-BY-4.0",
        "attribution": "A. Person",
    }
    first = MergeMember(file, "cardboard_box_0", HERE, UPRIGHT, 1.0, said)
    path = merged(tmp_path, first, member(file, "box_1"))
    model = read_gltf_model(path)
    first, second = model.scene.objects
    assert model.ours
    assert (first.name, second.name) == ("cardboard_box_0", "box_1")
    assert (first.class_name, first.real_extent, first.scale) == ("cardboard box", 0.4, 2.5)
    assert (first.source, first.credit) == ("somewhere", "CC-BY-4.0; A. Person")
    assert second.credit == ""
    assert (model.scene.gravity, model.scene.duration, model.scene.fps) == ((0, 0, -9.81), 1.5, 25)
    written = json_of(path)
    assert written["asset"]["copyright"] == "CC-BY-4.0; A. Person"
    node = next(n for n in written["nodes"] if n["name"] == "cardboard_box_0")
    assert node["extras"] == said


def test_the_copyright_of_a_file_goes_with_its_object(tmp_path):
    made = cube()
    made.json["asset"]["copyright"] = "© A. Person"
    path = merged(tmp_path, member(made.save(tmp_path / "box.glb")))
    assert read_glb(path).objects[0].credit == "© A. Person"
    assert json_of(path)["asset"]["copyright"] == "© A. Person"


def test_a_whole_scene_of_ours_can_become_one_object(tmp_path):
    """Classes and motion within a member's own tree mean nothing in the merged file."""
    made = cube(name="duck_0", extras={"class": "duck", "velocity_m_s": [0, 0, -2]})
    made.json["nodes"][0]["children"] = [made.node(root=False, mesh=0, extras={"substance": "oak"})]
    made.json["asset"]["generator"] = "corporeal"
    path = merged(tmp_path, member(made.save(tmp_path / "inner.glb"), "toy_0", **{"class": "toy"}))
    after = read_glb(path)
    assert [(o.name, o.class_name) for o in after.objects] == [("toy_0", "toy")]
    assert after.objects[0].velocity == (0, 0, 0)
    assert [s.object for s in after.surfaces] == [0, 0]
    assert after.surfaces[1].extras == {"substance": "oak"}


# ---------------------------------------------------------------- what survives


def test_names_samplers_textures_extensions_and_extras_survive(tmp_path):
    first = cube(name="plain").save(tmp_path / "a.glb")
    made = dressed()
    made.json["nodes"][0]["extras"] = {"substance": "oak"}
    second = made.save(tmp_path / "b.glb")
    path = merged(tmp_path, member(first, "a_0"), member(second, "b_0"))
    after = json_of(path)
    assert pictures(path) == pictures(second)
    assert after["images"][0]["name"] == "red"
    assert after["samplers"] == made.json["samplers"]
    assert after["textures"] == [{"source": 0, "sampler": 0, "name": "paint"}]
    assert after["materials"] == made.json["materials"]
    # Lights are not copied, so that the extension is no longer used.
    used = ["KHR_materials_clearcoat", "KHR_materials_ior", "KHR_texture_transform"]
    assert after["extensionsUsed"] == used
    assert after["extensionsRequired"] == ["KHR_texture_transform"]
    assert next(n for n in after["nodes"] if n["name"] == "shell")["extras"]["substance"] == "oak"


def test_a_webp_picture_survives_with_its_extension(tmp_path):
    made = dressed(extensions={"EXT_texture_webp": {"source": 1}})
    image = Image.new("RGB", (4, 4), (1, 200, 3))
    image.save(tmp_path / "green.webp", lossless=True)
    data = (tmp_path / "green.webp").read_bytes()
    made.json["images"].append({"bufferView": made.view(data), "mimeType": "image/webp"})
    path = merged(tmp_path, member(made.save(tmp_path / "b.glb")))
    assert "EXT_texture_webp" in json_of(path)["extensionsUsed"]
    assert hashlib.sha256(data).hexdigest() in pictures(path)
    texture = read_glb(path).finishes[0].texture
    assert texture is not None
    assert (texture == (1, 200, 3)).all()


def packed():
    made = cube()
    data = DracoPy.encode(CUBE, CUBE_TRIANGLES.astype(np.uint32), quantization_bits=14)
    draco = {"bufferView": made.view(data), "attributes": {"POSITION": 0}}
    made.primitive()["extensions"] = {"KHR_draco_mesh_compression": draco}
    made.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    for accessor in made.json["accessors"]:
        del accessor["bufferView"]
    return made


def sparse():
    made = cube()
    which = made.view(np.array([7], np.uint8).tobytes())
    made.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": which, "componentType": 5121},
        "values": {"bufferView": made.view(np.array([[3, 1, 1]], np.float32).tobytes())},
    }
    return made


def quantised():
    made = cube(scale=[0.1, 0.1, 0.1])
    position = made.accessor((CUBE * 10).astype(np.uint16))
    made.primitive()["attributes"]["POSITION"] = position
    made.json["extensionsUsed"] = made.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    return made


@pytest.mark.parametrize("make", [packed, sparse, quantised])
def test_meshes_in_any_packing_keep_their_shapes(tmp_path, make):
    made = make()
    target = made.accessor(np.ones((8, 3), np.float32))
    if make is not packed:
        made.primitive()["targets"] = [{"POSITION": target}]
    file = made.save(tmp_path / "a.glb")
    path = merged(tmp_path, member(cube().save(tmp_path / "b.glb"), "b_0"), member(file, "a_0"))
    before, after = read_glb(file).surfaces[0], read_glb(path).surfaces[1]
    np.testing.assert_array_equal(after.vertices, before.vertices)
    np.testing.assert_array_equal(after.triangles, before.triangles)
    written = json_of(path)
    assert written.get("extensionsRequired", []) == made.json.get("extensionsRequired", [])
    assert set(written.get("extensionsRequired", [])) <= set(written.get("extensionsUsed", []))
    moved = [p["targets"][0]["POSITION"] for p in written["meshes"][1]["primitives"] if p.get("targets")]
    for accessor in moved:
        view = written["bufferViews"][written["accessors"][accessor]["bufferView"]]
        chunk = GltfDocument(path).chunk[view["byteOffset"] :][: view["byteLength"]]
        assert bytes(chunk) == np.ones((8, 3), np.float32).tobytes()
    assert len(moved) == (make is not packed)


def test_companions_and_data_uris_move_into_the_file(tmp_path):
    made = dressed()
    made.json["images"] = [{"uri": "red.png"}]
    (tmp_path / "red.png").write_bytes(png())
    (tmp_path / "red.bin").write_bytes(made.binary)
    made.json["buffers"] = [{"uri": "red.bin", "byteLength": len(made.binary)}]
    beside = tmp_path / "beside.gltf"
    beside.write_text(json.dumps(made.json))
    within = tmp_path / "within.gltf"
    made.json["images"] = [{"uri": "data:;base64," + b64encode(png()).decode()}]
    made.json["buffers"][0]["uri"] = "data:;base64," + b64encode(made.binary).decode()
    within.write_text(json.dumps(made.json))
    path = merged(tmp_path, member(beside, "a_0"), member(within, "b_0"))
    after = json_of(path)
    assert [i["mimeType"] for i in after["images"]] == ["image/png"] * 2
    assert all("uri" not in x for x in after["images"] + after["buffers"])
    assert pictures(path) == [hashlib.sha256(png()).hexdigest()] * 2
    for s in read_glb(path).surfaces:
        assert len(s.triangles) == 12


def test_a_model_that_occurs_twice_is_stored_once(tmp_path):
    file = dressed().save(tmp_path / "a.glb")
    one = merged(tmp_path, member(file, "a_0")).stat().st_size
    path = merged(tmp_path, member(file, "a_0"), member(file, "a_1", (2.0, 0.0, 0.0)))
    assert path.stat().st_size - one < 600
    assert len(json_of(path)["meshes"]) == 1
    a, b = read_glb(path).surfaces
    np.testing.assert_allclose(b.vertices - a.vertices, [[2, 0, 0]] * 24, atol=1e-12)


def test_unused_nodes_are_left_out(tmp_path):
    made = cube()
    made.view(b"\7" * 5000)
    made.mesh(CUBE * 2)
    path = merged(tmp_path, member(made.save(tmp_path / "a.glb")))
    assert b"\7" * 100 not in path.read_bytes()
    assert len(json_of(path)["meshes"]) == 1


def test_animations_and_cameras_go_with_all_that_points_to_them(tmp_path):
    made = cube(name="box", camera=0)
    made.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
    times = made.accessor(np.zeros(2, np.float32))
    made.json["animations"] = [{"channels": [], "samplers": [{"input": times, "output": times}]}]
    file = made.save(tmp_path / "a.glb")
    path = tmp_path / "scene.glb"
    told = merge_glb_files(path, [member(file)], "scene", {})
    assert told == ("a.glb: its animations are left out.", "a.glb: its cameras are left out.")
    after = json_of(path)
    assert not {"cameras", "animations"} & after.keys()
    assert all("camera" not in n for n in after["nodes"])
    assert len(after["accessors"]) == 2


def skinned():
    """A cube on a bone that stands 3 above where it was bound."""
    made = Maker()
    joints = made.accessor(np.zeros((8, 4), np.uint8))
    weights = made.accessor(np.tile(np.float32([1, 0, 0, 0]), (8, 1)))
    mesh = made.mesh(attributes={"JOINTS_0": joints, "WEIGHTS_0": weights})
    inverse = made.accessor(np.eye(4, dtype=np.float32))
    made.json["accessors"][inverse] |= {"type": "MAT4", "count": 1}
    bone = made.node(name="bone", translation=[0, 3, 0])
    made.node(mesh=mesh, skin=0, translation=[50, 0, 0])
    made.json["skins"] = [{"joints": [bone], "skeleton": bone, "inverseBindMatrices": inverse}]
    return made


def test_a_skeleton_goes_with_each_of_its_copies(tmp_path):
    file = skinned().save(tmp_path / "a.glb")
    members = [member(file, "a_0", scale=2.0), member(file, "a_1", (0.0, 5.0, 0.0))]
    path = merged(tmp_path, *members)
    assert [s["joints"] for s in json_of(path)["skins"]] == [[0], [3]]
    before = read_glb(file).surfaces[0].vertices
    for surface, m in zip(read_glb(path).surfaces, members, strict=True):
        np.testing.assert_allclose(surface.vertices, placed(before, m), atol=1e-6)


# ---------------------------------------------------------------- what is refused


def test_the_same_members_give_the_same_bytes(tmp_path):
    file = dressed().save(tmp_path / "a.glb")
    members = [member(file, "a_0"), member(cube().save(tmp_path / "b.glb"), "b_0")]
    first = merged(tmp_path, *members).read_bytes()
    assert merged(tmp_path, *members).read_bytes() == first


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position": (0.0, math.nan, 0.0)}, "stands at"),
        ({"quaternion": (0.0, 0.0, 0.0, 0.0)}, "a rotation"),
        ({"scale": 0.0}, "a scale above 0"),
        ({"scale": math.inf}, "a scale above 0"),
        ({"real_extent_m": math.nan}, "NaN or infinite, which JSON cannot say"),
    ],
)
def test_no_number_that_json_cannot_say_is_written(tmp_path, change, said):
    file = cube().save(tmp_path / "a.glb")
    with pytest.raises(UserError, match=said):
        merged(tmp_path, member(file, **change))
    assert not (tmp_path / "scene.glb").exists()


def test_a_bare_nan_in_a_file_is_refused(tmp_path):
    made = cube()
    text = json.dumps(made.json | {"extras": {"x": math.nan}})
    (tmp_path / "a.glb").write_bytes(pack(text, made.binary))
    with pytest.raises(BadFileError, match="bare NaN"):
        merged(tmp_path, member(tmp_path / "a.glb"))


def test_a_number_too_large_for_json_is_not_passed_on(tmp_path):
    made = cube()
    made.json["buffers"] = [{"byteLength": len(made.binary)}]
    made.json["meshes"][0]["extras"] = {"x": 12345}
    text = json.dumps(made.json).replace("12345", "1e999")
    (tmp_path / "a.glb").write_bytes(pack(text, made.binary))
    with pytest.raises(UserError, match="JSON cannot say"):
        merged(tmp_path, member(tmp_path / "a.glb"))


def nested(depth):
    return json.loads('{"x":' * depth + "1" + "}" * depth)


def test_what_is_nested_too_deeply_is_left_out_or_refused(tmp_path):
    made = dressed()
    made.json["materials"][0]["extensions"]["ACME_maze"] = nested(600)
    path = tmp_path / "scene.glb"
    (told,) = merge_glb_files(path, [member(made.save(tmp_path / "a.glb"))], "scene", {})
    assert "nested too deeply" in told
    assert len(read_glb(path).surfaces[0].triangles) == 12
    with pytest.raises(UserError, match="nested too deeply"):
        merged(tmp_path, member(cube().save(tmp_path / "b.glb"), maze=deep()))


def deep():
    x: dict = {}
    for _ in range(100_000):
        x = {"x": x}
    return x


def test_a_file_that_shows_nothing_is_refused(tmp_path):
    made = cube()
    made.json["scenes"][0]["nodes"] = []
    with pytest.raises(BadFileError, match="shows no mesh"):
        merged(tmp_path, member(made.save(tmp_path / "a.glb")))


def test_nothing_two_of_one_name_and_too_much_are_refused(tmp_path):
    file = cube().save(tmp_path / "a.glb")
    with pytest.raises(UserError, match="nothing to merge"):
        merged(tmp_path)
    with pytest.raises(UserError, match="Two objects are named 'box_0'"):
        merged(tmp_path, member(file), member(file))
    with pytest.raises(UserError, match="The merged file would be larger"):
        gltf_copy.MergedDocument(max_bytes=100).view(memoryview(bytes(101)), {})


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda j: j["meshes"][0]["primitives"][0].update(indices=77), "'indices' points to"),
        (lambda j: j["accessors"][0].update(bufferView=77), "'bufferView' points to"),
        (lambda j: j["nodes"][0].update(mesh="box"), "'mesh' is 'box'"),
        (lambda j: j["nodes"][0].update(children=[0]), "hangs in the tree twice"),
        (lambda j: j.update(extensionsRequired=["ACME_magic"]), "ACME_magic"),
        (lambda j: j["bufferViews"][0].update(extensions={"EXT_meshopt_compression": {}}), "EXT_meshopt_compression"),
    ],
)
def test_a_broken_member_is_named(tmp_path, spoil, said):
    made = cube()
    spoil(made.json)
    with pytest.raises(BadFileError, match=said) as problem:
        merged(tmp_path, member(made.save(tmp_path / "a.glb")))
    assert "a.glb" in str(problem.value)


def test_a_missing_picture_is_reported_and_left_out(tmp_path):
    made = dressed()
    made.json["images"] = [{"uri": "gone.png"}]
    path = tmp_path / "scene.glb"
    (told,) = merge_glb_files(path, [member(made.save(tmp_path / "a.glb"))], "scene", {})
    assert "gone.png" in told
    assert read_glb(path).finishes[0].texture is None


def test_whatever_can_be_read_can_be_merged(shared_assets, tmp_path):
    """Test files of other projects, most of them broken on purpose."""
    count = 0
    for file in sorted((shared_assets / "hostile").rglob("*.gl*")):
        try:
            before = read_glb(file, "one")
        except BadFileError:
            continue
        after = read_glb(merged(tmp_path, member(file)), "one")
        for a, b in zip(after.surfaces, before.surfaces, strict=True):
            np.testing.assert_array_equal(a.vertices, b.vertices)
            np.testing.assert_array_equal(a.triangles, b.triangles)
        count += 1
    assert count >= 25
