import base64
import csv
import io
import json
import struct
from dataclasses import replace

import DracoPy
import numpy as np
import pytest
import trimesh
from PIL import Image

from corporeal.core.types import Finish, Push, Scene, SceneObject, Surface, Wind
from corporeal.geometry.crease_normals import add_crease_normals
from corporeal.geometry.scene_transforms import object_boxes
from corporeal.io.gltf.glb_writer import encode_glb, write_glb
from corporeal.io.gltf.gltf_reader import read_glb
from glb_maker import CUBE, CUBE_TRIANGLES, Maker, cube


def volume(scene):
    """Signed volume: positive where the outside is out."""
    return sum(
        np.einsum("td,td->", a, np.cross(b, c)) / 6 for s in scene.surfaces for a, b, c in [s.vertices[s.triangles.T]]
    )


def corners(scene):
    v = np.concatenate([s.vertices for s in scene.surfaces])
    return np.stack([v.min(0), v.max(0)])


def png(array):
    data = io.BytesIO()
    Image.fromarray(np.asarray(array, np.uint8)).save(data, "PNG")
    return data.getvalue()


@pytest.fixture
def scene():
    rng = np.random.default_rng(7)
    vertices = CUBE.astype(float) - [0.5, 0.5, 0]
    triangles = CUBE_TRIANGLES.astype(np.int64)
    normals = vertices - [0, 0, 0.5]
    skin = Surface(
        "body", 0, 0, vertices, triangles,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        uv=rng.random((8, 2)),
        colours=rng.random((8, 4)),
        extras={"substance": "rubber", "shell_thickness_m": 0.002},
    )  # fmt: skip
    lid = add_crease_normals(Surface("lid", 0, 1, vertices + np.array([0, 0, 1]), triangles))
    stone = add_crease_normals(Surface("stone", 1, 2, vertices * 0.25 + [2, 0, 0], triangles))
    return Scene(
        name="two_things",
        source="made",
        objects=(
            SceneObject("rubber_duck_0", "rubber duck", 0.1, 20.0, velocity=(0.0, 0.0, -2.0)),
            SceneObject(
                "stone_0", "stone", 0.25,
                push=Push((3.0, 0.0, 0.0), 0.25), wind=Wind((0.0, 8.0, 0.0), 0.3, 0.5, 1.5),
                source="stone.blend", credit="CC0, somebody",
            ),
        ),
        surfaces=(skin, lid, stone),
        finishes=(
            Finish("paint", (0.5, 0.25, 1.0, 1.0), rng.integers(0, 255, (4, 6, 3), np.uint8), 0.5),
            Finish("glass", (1.0, 1.0, 1.0, 0.5), None, 0.0, 0.25, 0.75, alpha_mode="BLEND"),
            Finish("ember", (0.5, 0.5, 0.5, 1.0), emission=4.0, alpha_mode="MASK", alpha_cutoff=0.25),
        ),
        gravity=(0.0, 0.0, -1.5),
        duration=1.5,
        fps=50,
    )  # fmt: skip


def test_what_was_written_is_read_back(scene, tmp_path):
    write_glb(tmp_path / "two_things.glb", scene)
    back = read_glb(tmp_path / "two_things.glb")
    assert (back.name, back.gravity, back.duration, back.fps) == (
        scene.name, scene.gravity, scene.duration, scene.fps,
    )  # fmt: skip
    duck, stone = back.objects
    assert (duck.name, duck.class_name, duck.real_extent, duck.velocity) == (
        "rubber_duck_0", "rubber duck", 0.1, (0.0, 0.0, -2.0),
    )  # fmt: skip
    assert duck.scale == 20.0
    assert stone == scene.objects[1]
    for was, now in zip(scene.finishes, back.finishes, strict=True):
        if was.texture is not None:
            assert np.array_equal(was.texture, now.texture)
        assert repr(was).split("texture")[0] == repr(now).split("texture")[0]
        assert (was.metallic, was.roughness, was.transmission, was.emission, was.alpha_mode) == (
            now.metallic, now.roughness, now.transmission, now.emission, now.alpha_mode,
        )  # fmt: skip
    for was, now in zip(scene.surfaces, back.surfaces, strict=True):
        assert (was.name, was.object, was.finish, was.extras) == (
            now.name, now.object, now.finish, now.extras,
        )  # fmt: skip
        assert np.array_equal(was.triangles, now.triangles)
        for part in ("vertices", "normals", "uv", "colours"):
            a, b = getattr(was, part), getattr(now, part)
            assert (a is None) == (b is None)
            assert a is None or np.allclose(a, b, atol=1e-6)
    assert back.warnings == ()


def test_the_same_scene_gives_the_same_bytes(scene):
    assert encode_glb(scene) == encode_glb(scene)


def test_reading_what_we_wrote_and_writing_it_again_changes_nothing(scene, tmp_path):
    write_glb(tmp_path / "two_things.glb", scene)
    once = encode_glb(read_glb(tmp_path / "two_things.glb"))
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "two_things.glb").write_bytes(once)
    twice = read_glb(tmp_path / "again" / "two_things.glb")
    sources = [o.source for o in read_glb(tmp_path / "two_things.glb").objects]
    assert [o.source for o in twice.objects] == sources
    assert encode_glb(twice) == once


def test_another_program_sees_the_written_scene_with_y_up(scene, tmp_path):
    write_glb(tmp_path / "a.glb", scene)
    low, high = trimesh.load(tmp_path / "a.glb").bounds
    ours = corners(scene)
    assert np.allclose([low[0], low[1], -high[2]], [ours[0, 0], ours[0, 2], ours[0, 1]])
    assert np.allclose([high[0], high[1], -low[2]], [ours[1, 0], ours[1, 2], ours[1, 1]])


def test_nan_cannot_be_written(scene, tmp_path):
    bad = scene.surfaces[0].vertices.copy()
    bad[0, 0] = np.nan
    surface = Surface("bad", 0, 0, bad, scene.surfaces[0].triangles)
    with pytest.raises(ValueError, match="NaN"):
        write_glb(tmp_path / "a.glb", Scene("s", "", scene.objects, (surface,), scene.finishes))
    assert not (tmp_path / "a.glb").exists()


def test_up_in_the_file_is_up_in_the_world(tmp_path):
    scene = read_glb(cube(translation=[0, 5, 0]).save(tmp_path / "a.glb"))
    assert np.allclose(corners(scene), [[0, -1, 5], [1, 0, 6]])
    assert volume(scene) == pytest.approx(1)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [-2, -1, -1], [1, 2, 3]])
def test_a_mirrored_node_keeps_its_outside_out(tmp_path, scale):
    scene = read_glb(cube(scale=scale).save(tmp_path / "a.glb"))
    assert volume(scene) == pytest.approx(abs(np.prod(scale)))


def test_a_matrix_says_the_same_as_its_translation_rotation_and_scale(tmp_path):
    half = np.sqrt(0.5)
    parts = {"translation": [1, 2, 3], "rotation": [0, half, 0, half], "scale": [1, 2, 3]}
    # A quarter turn about y takes x to -z and z to x; columns, as glTF stores it.
    matrix = [0, 0, -1, 0, 0, 2, 0, 0, 3, 0, 0, 0, 1, 2, 3, 1]
    a = read_glb(cube(**parts).save(tmp_path / "a.glb"))
    b = read_glb(cube(matrix=matrix).save(tmp_path / "b.glb"))
    assert np.allclose(a.surfaces[0].vertices, b.surfaces[0].vertices)


def test_a_child_moves_with_its_parent(tmp_path):
    made = Maker()
    child = made.node(root=False, mesh=made.mesh(), translation=[1, 0, 0])
    made.node(children=[child], scale=[2, 2, 2])
    assert np.allclose(corners(read_glb(made.save(tmp_path / "a.glb")))[0], [2, -2, 0])


def test_strips_fans_and_bare_lists_say_the_same_as_triangles(tmp_path):
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    ways = {
        "list": (square, np.array([0, 1, 2, 2, 1, 3], np.uint8), 4),
        "strip": (square, np.array([0, 1, 2, 3], np.uint32), 5),
        "fan": (square, np.array([0, 1, 3, 2], np.uint16), 6),
        "bare": (square[[0, 1, 2, 2, 1, 3]], None, 4),
    }
    for name, (vertices, indices, mode) in ways.items():
        made = Maker()
        made.node(mesh=made.mesh(vertices, indices, mode=mode))
        (s,) = read_glb(made.save(tmp_path / f"{name}.glb")).surfaces
        a, b, c = (s.vertices[s.triangles[:, k]] for k in range(3))
        area = np.cross(b - a, c - a) / 2
        assert np.allclose(area.sum(0), [0, -1, 0]), name  # the file's +z faces us from -y
        assert len(area) == 2


def test_points_and_lines_are_left_out_and_reported(tmp_path):
    made = cube()
    made.node(mesh=made.mesh(indices=np.arange(8, dtype=np.uint16), mode=0))
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert len(scene.surfaces) == 1
    assert any("points" in w for w in scene.warnings)


def test_a_mesh_that_the_scene_does_not_place_is_left_out_and_reported(tmp_path):
    made = cube()
    made.node(root=False, mesh=0, name="plank")
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert len(scene.surfaces) == 1
    assert scene.warnings == ("a.glb: 1 node with a mesh is not in its scene and left out: plank.",)
    assert read_glb(cube().save(tmp_path / "b.glb")).warnings == ()


def test_quantised_positions_are_the_same_shape(tmp_path):
    made = Maker()
    stored = (CUBE * 65535).astype(np.uint16)
    padded = np.zeros((8, 4), np.uint16)
    padded[:, :3] = stored
    mesh = made.mesh()
    made.primitive()["attributes"]["POSITION"] = made.accessor(padded, type="VEC3", normalized=True)
    made.json["bufferViews"][-1]["byteStride"] = 8
    made.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    made.node(mesh=mesh, scale=[2, 2, 2])
    assert volume(read_glb(made.save(tmp_path / "a.glb"))) == pytest.approx(8, rel=1e-4)


def test_a_sparse_accessor_replaces_single_vertices(tmp_path):
    made = cube()
    which = made.view(np.array([7], np.uint8).tobytes())
    made.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": which, "componentType": 5121},
        "values": {"bufferView": made.view(np.array([[3, 1, 1]], np.float32).tobytes())},
    }  # fmt: skip
    assert corners(read_glb(made.save(tmp_path / "a.glb")))[1, 0] == 3


def test_draco_gives_the_same_shape(tmp_path):
    made = cube()
    data = DracoPy.encode(CUBE, CUBE_TRIANGLES.astype(np.uint32), quantization_bits=14)
    made.primitive()["extensions"] = {
        "KHR_draco_mesh_compression": {
            "bufferView": made.view(data), "attributes": {"POSITION": 0},
        }
    }  # fmt: skip
    made.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    for accessor in made.json["accessors"]:
        del accessor["bufferView"]
    assert volume(read_glb(made.save(tmp_path / "a.glb"))) == pytest.approx(1, rel=1e-3)


def textured(material, image, name="skin.png"):
    made = cube()
    uv = np.linspace(0, 1, 16, dtype=np.float32).reshape(8, 2)
    made.primitive()["attributes"]["TEXCOORD_0"] = made.accessor(uv)
    made.primitive()["material"] = 0
    made.json |= {
        "materials": [material],
        "textures": [{"source": 0}],
        "images": [{"bufferView": made.view(image), "name": name}],
    }
    return made, uv


def test_a_texture_and_its_transform_are_kept(tmp_path):
    picture = np.arange(24).reshape(2, 4, 3)
    turn = {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 1]}
    info = {"index": 0, "extensions": {"KHR_texture_transform": turn}}
    made, uv = textured({"pbrMetallicRoughness": {"baseColorTexture": info}}, png(picture))
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert np.array_equal(scene.finishes[0].texture, picture)
    # Anticlockwise to the eye, with v down: a quarter turn takes (u, v) to (v, -u).
    turned = np.stack([0.5 + uv[:, 1], 0.25 - 2 * uv[:, 0]], 1)
    (seen,) = scene.surfaces
    assert seen.uv is not None
    assert np.allclose(seen.uv[seen.triangles], turned[CUBE_TRIANGLES])


def test_a_file_without_normals_gets_some_with_sharp_edges(tmp_path):
    (seen,) = read_glb(cube().save(tmp_path / "a.glb")).surfaces
    assert seen.normals is not None
    assert len(np.unique(np.round(seen.normals, 6), axis=0)) == 6


@pytest.mark.parametrize("image", [b"", b"\x89PNG\r\n\x1a\nrubbish", b"hello"])
def test_a_broken_texture_is_left_out_and_reported(tmp_path, image):
    made, _ = textured({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, image)
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert scene.finishes[0].texture is None
    assert any("skin.png" in w for w in scene.warnings)
    assert volume(scene) == pytest.approx(1)


def test_a_metal_texture_counts_by_its_mean(tmp_path):
    picture = np.zeros((4, 4, 3))
    picture[:2, :, 2] = 255
    picture[..., 1] = 51
    pbr = {"metallicRoughnessTexture": {"index": 0}}
    scene = read_glb(textured({"pbrMetallicRoughness": pbr}, png(picture))[0].save(tmp_path / "a.glb"))
    assert scene.finishes[0].metallic == pytest.approx(0.5)
    assert scene.finishes[0].roughness == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("material", "metallic", "roughness"),
    [
        ({}, 0.0, 1.0),
        ({"pbrMetallicRoughness": {"roughnessFactor": 0.5}}, 1.0, 0.5),
        ({"extensions": {"KHR_materials_unlit": {}}}, 0.0, 1.0),
        (
            {"extensions": {"KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [0, 0, 0, 1], "glossinessFactor": 0.75}}},
            1.0, 0.25,
        ),
        (
            {"extensions": {"KHR_materials_pbrSpecularGlossiness": {
                "specularFactor": [0.04, 0.04, 0.04], "glossinessFactor": 0.25}}},
            0.0, 0.75,
        ),
    ],
)  # fmt: skip
def test_every_way_to_state_a_look_ends_as_one_finish(tmp_path, material, metallic, roughness):
    made = cube()
    made.json["materials"] = [material]
    made.primitive()["material"] = 0
    (finish,) = read_glb(made.save(tmp_path / "a.glb")).finishes
    assert (finish.metallic, finish.roughness) == (metallic, roughness)


def test_vertex_colours_of_bytes_become_fractions(tmp_path):
    made = cube()
    colours = np.full((8, 4), 51, np.uint8)
    made.primitive()["attributes"]["COLOR_0"] = made.accessor(colours, normalized=True)
    assert np.allclose(read_glb(made.save(tmp_path / "a.glb")).surfaces[0].colours, 0.2)


def test_a_gltf_finds_its_companions_beside_it(tmp_path):
    made = cube()
    inline = base64.b64encode(made.binary).decode()
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "cube one.bin").write_bytes(made.binary)
    for uri in ("parts/cube%20one.bin", f"data:application/octet-stream;base64,{inline}"):
        made.json["buffers"] = [{"byteLength": len(made.binary), "uri": uri}]
        (tmp_path / "a.gltf").write_text(json.dumps(made.json))
        assert volume(read_glb(tmp_path / "a.gltf")) == pytest.approx(1)


def three_things():
    made = Maker()
    names = ("Chair_01", "table", "Lamp.002")
    mesh = made.mesh()
    children = [made.node(root=False, name=n, mesh=mesh, translation=[3 * k, 0, 0]) for k, n in enumerate(names)]
    made.node(name="Sketchfab_model", children=children)
    return made


def test_a_file_is_one_object_unless_asked_otherwise(tmp_path):
    path = three_things().save(tmp_path / "my_room_v2.glb")
    (whole,) = read_glb(path).objects
    assert (whole.name, whole.class_name) == ("my_room_0", "my room")
    assert [o.name for o in read_glb(path, "nodes").objects] == ["chair_0", "table_0", "lamp_0"]


def test_nodes_that_state_their_class_are_objects(tmp_path):
    made = three_things()
    made.json["nodes"][0]["extras"] = {"class": "armchair", "real_extent_m": [0.9, 0.5, 0.8]}
    scene = read_glb(made.save(tmp_path / "a.glb"))
    assert [o.class_name for o in scene.objects] == ["armchair", "table", "lamp"]
    assert scene.objects[0].real_extent == 0.9
    assert scene.objects[0].scale == pytest.approx(1 / 0.9)
    assert len(read_glb(tmp_path / "a.glb", "one").objects) == 1


@pytest.mark.parametrize("nonsense", [0.0, -2.0, 1e9])
def test_a_scale_that_makes_no_sense_is_measured_instead(scene, tmp_path, nonsense):
    things = [replace(o, scale=nonsense) for o in scene.objects]
    write_glb(tmp_path / "a.glb", replace(scene, objects=tuple(things)))
    back = read_glb(tmp_path / "a.glb")
    for k, thing in enumerate(back.objects):
        extent = np.diff(object_boxes(back)[k], axis=0).max()
        assert thing.scale == pytest.approx(extent / thing.real_extent)


def test_the_copyright_follows_the_object(tmp_path):
    made = cube()
    made.json["asset"]["copyright"] = "(c) somebody, CC BY 4.0"
    assert read_glb(made.save(tmp_path / "a.glb")).objects[0].credit == "(c) somebody, CC BY 4.0"


def test_a_strangers_extras_set_no_motion(tmp_path):
    made = cube(extras={"class": "ball", "velocity_m_s": [0, 0, 99]})
    assert read_glb(made.save(tmp_path / "a.glb")).objects[0].velocity == (0, 0, 0)


def test_all_real_objects_have_the_sizes_and_triangles_of_the_manifest(shared_assets):
    with open(shared_assets / "manifest.csv", newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["file"].endswith(".glb")]
    assert len(rows) == 55
    for row in rows:
        scene = read_glb(shared_assets / row["file"])
        x, y, z = (float(v) for v in row["extents_m"].split("x"))
        assert np.allclose(np.diff(corners(scene), axis=0), [x, z, y], rtol=1e-3), row["file"]
        triangles = sum(len(s.triangles) for s in scene.surfaces)
        assert triangles == int(row["triangles"]), row["file"]
        textured = any(f.texture is not None for f in scene.finishes)
        assert textured == (row["textured"] == "yes"), row["file"]
        assert scene.warnings == (), row["file"]


def test_the_header_says_the_length(scene):
    data = encode_glb(scene)
    assert struct.unpack("<4sII", data[:12]) == (b"glTF", 2, len(data))
    assert len(data) % 4 == 0
