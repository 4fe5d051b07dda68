"""Meshes of all kinds beside glTF: one shape in each, and files that mean no good."""

import io
import os
import struct
import zipfile

import numpy as np
import pytest
import trimesh
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.io import registry
from corporeal.io.gltf.gltf_materials import DEFAULT_FINISH
from corporeal.io.input_files import list_companions
from corporeal.io.mesh.mesh_loader import load_mesh
from corporeal.io.mesh.raw_mesh import MAX_PIECES
from corporeal.io.ply_container import kind_of_ply

CORNERS = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\n"
FACES = "f 1 2 3 4\nf 1/1 2/2 5/3\n"
MM = 1e-3
SIZE = np.array([10.0, 20.0, 45.0])
"""Of the block in every file: x, y, and z which is up [mm]."""

pytestmark = pytest.mark.usefixtures("mesh_reader_in_process")


@pytest.fixture
def chair(tmp_path):
    """A red quad and a triangle with a picture whose left half is blue."""
    (tmp_path / "look.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 0\nmap_Kd pics/half blue.png\n")
    (tmp_path / "pics").mkdir()
    picture = np.zeros((4, 4, 3), np.uint8)
    picture[:, :2, 2] = 255
    Image.fromarray(picture).save(tmp_path / "pics" / "half blue.png")
    path = tmp_path / "Old_Chair.obj"
    path.write_text(
        f"mtllib look.mtl\n{CORNERS}vt 0 0\nvt 0.25 0\nvt 0 1\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1/1 2/2 5/3\n"
    )
    return path


# ---------------------------------------------------------------- one block as every kind


def block(axes=(0, 1, 2), unit=1.0):
    """A box whose lower corner is the origin; ``axes``: which world axis each file axis is."""
    made = trimesh.creation.box(SIZE / unit)
    made.apply_translation(SIZE / unit / 2)
    turned = made.vertices[:, axes]
    if axes == (0, 2, 1):  # +y up: (x, y, z) of the world are (x, -z, y) of the file
        turned = turned * (1, 1, -1)
    return trimesh.Trimesh(turned, made.faces, process=False)


def write_dae(path, mesh, unit, axis):
    places = " ".join(f"{x:.9g}" for x in mesh.vertices.ravel())
    corners = " ".join(map(str, mesh.faces.ravel()))
    path.write_text(f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter="{unit}"/><up_axis>{axis}</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse>
<color>0.2 0.4 0.6 1</color></diffuse></lambert></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="block"><mesh>
<source id="p"><float_array id="pa" count="{mesh.vertices.size}">{places}</float_array>
<technique_common><accessor source="#pa" count="{len(mesh.vertices)}" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(mesh.faces)}" material="s"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{corners}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="n"><instance_geometry url="#block">
<bind_material><technique_common><instance_material symbol="s" target="#m"/></technique_common>
</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>""")


def usd_text(mesh, unit, axis, look=""):
    places = ", ".join(f"({x:.9g}, {y:.9g}, {z:.9g})" for x, y, z in mesh.vertices)
    corners = ", ".join(map(str, mesh.faces.ravel()))
    counts = ", ".join(["3"] * len(mesh.faces))
    return f"""#usda 1.0
(metersPerUnit = {unit}
upAxis = "{axis}")
def Xform "world" {{
def Mesh "block" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
point3f[] points = [{places}]
int[] faceVertexCounts = [{counts}]
int[] faceVertexIndices = [{corners}]
rel material:binding = </world/look>
}}
def Material "look" {{
token outputs:surface.connect = </world/look/s.outputs:surface>
def Shader "s" {{
uniform token info:id = "UsdPreviewSurface"
color3f inputs:diffuseColor = (0.2, 0.4, 0.6)
{look}
token outputs:surface
}}
}}
}}
"""


def written(kind, folder):
    """Write the block as one kind of file; return its path."""
    path = folder / f"block{kind}"
    if kind == ".dae":
        pytest.importorskip("collada")
        write_dae(path, block(unit=10.0), 0.01, "Z_UP")
    elif kind in (".usd", ".usda"):
        path.write_text(usd_text(block((0, 2, 1), 10.0), 0.01, "Y"))
    elif kind in (".usdc", ".usdz"):
        usd = pytest.importorskip("pxr.Usd")
        utils = pytest.importorskip("pxr.UsdUtils")
        text = folder / "whole.usda"
        text.write_text(usd_text(block((0, 2, 1), 10.0), 0.01, "Y"))
        if kind == ".usdz":
            assert utils.CreateNewUsdzPackage(str(text), str(path))
        else:
            usd.Stage.Open(str(text)).Export(str(path))
    else:
        if kind == ".3mf":
            pytest.importorskip("lxml")
        data = block((0, 2, 1) if kind == ".obj" else (0, 1, 2)).export(file_type=kind[1:])
        path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


@pytest.mark.parametrize("kind", registry.suffixes_of("mesh"))
def test_one_block_has_the_same_extents_as_every_kind_of_file(kind, tmp_path):
    if kind.startswith(".usd"):
        pytest.importorskip("pxr")
    read = load_mesh(written(kind, tmp_path))
    assert read.metric == (kind in (".3mf", ".dae", ".usd", ".usda", ".usdc", ".usdz"))
    unit = 1.0 if read.metric else MM
    places = unit * np.concatenate([s.vertices for s in read.scene.surfaces])
    np.testing.assert_allclose(places.min(axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(places.max(axis=0), SIZE * MM, rtol=1e-4)
    solid = trimesh.util.concatenate([trimesh.Trimesh(s.vertices, s.triangles) for s in read.scene.surfaces])
    assert solid.is_watertight
    # Inside out it would be negative.
    np.testing.assert_allclose(unit**3 * solid.volume, np.prod(SIZE * MM), rtol=1e-4)
    (thing,) = read.scene.objects
    assert thing.class_name == "block"
    np.testing.assert_allclose(unit * thing.real_extent, 0.045, rtol=1e-4)


@pytest.mark.parametrize("geometry", ['id="ID2"', 'id="geom-Box001" name="Box001"'])
def test_nodes_and_materials_of_a_collada_keep_their_names(tmp_path, geometry):
    path = tmp_path / "yard.dae"
    write_dae(path, block(), 1, "Z_UP")
    own = geometry.split('"')[1]
    text = path.read_text().replace('id="block"', geometry).replace("#block", f"#{own}")
    text = text.replace('<material id="m">', '<material id="m" name="Oak">')
    start, end = text.index('<node id="n">'), text.index("</visual_scene>")
    node = text[start:end].replace('id="n"', 'id="{0}" name="{0}"')
    nodes = "".join(node.format(name) for name in ("Table", "Bench"))
    path.write_text(f'{text[:start]}<node id="all" name="All">{nodes}</node>{text[end:]}')
    scene = load_mesh(path, "nodes").scene
    assert [o.class_name for o in scene.objects] == ["table", "bench"]
    assert [s.name for s in scene.surfaces] == ["Table", "Bench"]
    assert {scene.finishes[s.finish].name for s in scene.surfaces} == {"Oak"}


def test_components_of_a_collada_give_their_names_to_nodes_that_are_but_counted(tmp_path):
    """As SketchUp writes two chairs, of which somebody named the second."""
    path = tmp_path / "yard.dae"
    write_dae(path, block(), 1, "Z_UP")
    text = path.read_text()
    start, end = text.index('<node id="n">'), text.index("</visual_scene>")
    component = text[start:end].replace('id="n"', 'id="c" name="Chair"')
    places = "".join(
        f'<node id="{name}" name="{name}"><translate>{x} 0 0</translate><instance_node url="#c"/></node>'
        for x, name in ((0, "instance_0"), (9, "instance_1"), (18, "Garden_Chair"))
    )
    text = f'{text[:start]}<node id="all" name="SketchUp">{places}</node>{text[end:]}'
    library = f"<library_nodes>{component}</library_nodes><library_visual_scenes>"
    path.write_text(text.replace("<library_visual_scenes>", library))
    scene = load_mesh(path, "nodes").scene
    assert [o.class_name for o in scene.objects] == ["chair", "chair", "garden chair"]


def test_materials_tell_pieces_of_one_node_of_a_collada_apart(tmp_path):
    path = tmp_path / "chair.dae"
    write_dae(path, block(), 1, "Z_UP")
    text = path.read_text().replace('<node id="n">', '<node id="n" name="Chair">')
    start, end = text.index("<triangles"), text.index("</mesh>")
    text = text[:end] + text[start:end].replace('"s"', '"t"') + text[end:]
    for other, name in (("m", "Oak"), ("m2", "Leather")):
        made = f'<material id="{other}" name="{name}"><instance_effect url="#e"/></material>'
        text = text.replace("</library_materials>", f"{made}</library_materials>")
    text = text.replace('<material id="m"><instance_effect url="#e"/></material>', "")
    bound = '<instance_material symbol="t" target="#m2"/>'
    path.write_text(text.replace('target="#m"/>', f'target="#m"/>{bound}'))
    scene = load_mesh(path).scene
    assert [o.class_name for o in scene.objects] == ["chair"]
    assert [s.name for s in scene.surfaces] == ["Oak", "Leather"]
    assert [scene.finishes[s.finish].name for s in scene.surfaces] == ["Oak", "Leather"]


@pytest.mark.parametrize("kind", [".dae", ".usda"])
def test_plain_colours_come_along(kind, tmp_path):
    pytest.importorskip("pxr" if kind == ".usda" else "collada")
    (finish,) = load_mesh(written(kind, tmp_path)).scene.finishes
    np.testing.assert_allclose(finish.colour, (0.2, 0.4, 0.6, 1), atol=2 / 255)


def test_axes_can_be_overridden(tmp_path):
    path = written(".stl", tmp_path)
    corners = np.concatenate([s.vertices for s in load_mesh(path, up="-y").scene.surfaces])
    # The file's -y points up: its z becomes y, and its y points down.
    np.testing.assert_allclose(corners.min(axis=0), (0, 0, -20), atol=1e-9)
    np.testing.assert_allclose(corners.max(axis=0), (10, 45, 0), atol=1e-9)


def test_colours_of_vertices_are_kept_as_linear_light(tmp_path):
    mesh = block()
    mesh.visual.vertex_colors = np.tile(np.array([255, 128, 0, 255], np.uint8), (8, 1))
    (tmp_path / "a.ply").write_bytes(mesh.export(file_type="ply"))
    (surface,) = load_mesh(tmp_path / "a.ply").scene.surfaces
    wanted = [*srgb_to_linear(np.array([1, 128 / 255, 0])), 1]
    np.testing.assert_allclose(surface.colours, np.tile(wanted, (24, 1)), atol=1e-6)


def test_named_objects_are_objects_where_asked(tmp_path):
    text = f"o chair_1\n{CORNERS}f 1 2 3 4\no cup\nf 1 2 5\n"
    (tmp_path / "room.obj").write_text(text)
    assert len(load_mesh(tmp_path / "room.obj").scene.objects) == 1
    scene = load_mesh(tmp_path / "room.obj", "nodes").scene
    assert {o.class_name for o in scene.objects} == {"chair", "cup"}
    assert sorted(len(s.triangles) for s in scene.surfaces) == [1, 2]
    assert {s.object for s in scene.surfaces} == {0, 1}


@pytest.mark.parametrize("order", ["usemtl wax\ng {}", "g {}\nusemtl wax"])
def test_groups_are_objects_where_an_obj_has_no_objects(tmp_path, order):
    faces = zip(("chair_1", "cup"), ("f 1 2 3 4", "f 1 2 5"), strict=True)
    text = CORNERS + "".join(f"{order.format(name)}\n{face}\n" for name, face in faces)
    (tmp_path / "room.obj").write_text(text)
    scene = load_mesh(tmp_path / "room.obj", "nodes").scene
    assert {o.class_name for o in scene.objects} == {"chair", "cup"}
    (tmp_path / "one.obj").write_text(f"o room\n{text}")
    assert len(load_mesh(tmp_path / "one.obj", "nodes").scene.objects) == 1


def test_patches_of_a_surface_are_no_objects(tmp_path):
    groups = "".join(f"g patch{k}\nf 1 2 3\n" for k in range(MAX_PIECES + 1))
    (tmp_path / "scan.obj").write_text(CORNERS + groups)
    assert len(load_mesh(tmp_path / "scan.obj").scene.surfaces) == 1


def test_a_splat_a_mesh_and_points_are_recognised_by_the_header(tmp_path):
    def kind(text):
        return kind_of_ply(f"ply\nformat ascii 1.0\n{text}end_header\n".encode())

    place = "".join(f"property float {axis}\n" for axis in "xyz")
    mesh = "element face 1\nproperty list uchar int vertex_indices\n"
    splat = "".join(f"property float {p}\n" for p in ("f_dc_0", "opacity", "scale_0", "rot_0"))
    assert kind(f"element vertex 3\n{place}") == "points"
    assert kind(f"element vertex 3\n{place}{mesh}") == "mesh"
    assert kind(f"element vertex 3\n{place}{mesh.replace('face 1', 'face 0')}") == "points"
    assert kind(f"element vertex 3\n{place}{splat}") == "splat"
    assert kind(f"element chunk 1\n{place}element vertex 3\n{place}") == "splat"


# ---------------------------------------------------------------- OBJ and its companions


def test_shape_and_look_are_read_with_z_up(chair):
    scene = load_mesh(chair).scene
    assert scene.objects[0].class_name == "old chair"
    assert scene.objects[0].real_extent == 3
    finishes = {f.name: f for f in scene.finishes}
    assert finishes["red"].colour == (1, 0, 0, 1) and finishes["red"].texture is None
    assert finishes["blue"].colour == (1, 1, 1, 1), "a picture is not multiplied with black"
    assert finishes["blue"].texture.shape == (4, 4, 3)
    corners = np.concatenate([s.vertices for s in scene.surfaces])
    np.testing.assert_array_equal(corners.min(axis=0), (0, -3, 0))
    np.testing.assert_array_equal(corners.max(axis=0), (1, 0, 2))
    assert sum(len(s.triangles) for s in scene.surfaces) == 3


def test_texture_coordinates_run_down_as_in_gltf(chair):
    scene = load_mesh(chair).scene
    (blue,) = (s for s in scene.surfaces if scene.finishes[s.finish].name == "blue")
    high = blue.vertices[:, 1].argmin()  # 3 up OBJ's z is 3 along our -y
    np.testing.assert_allclose(blue.uv[high], (0, 0))
    np.testing.assert_allclose(sorted(map(tuple, blue.uv)), [(0, 0), (0, 1), (0.25, 1)])


def test_companions_are_named_and_come_from_the_same_folder_only(chair, tmp_path, mesh_reader_child):
    assert [p.name for p in list_companions(chair)] == ["look.mtl", "half blue.png"]
    (tmp_path / "below").mkdir()
    inner = tmp_path / "below" / "x.obj"
    inner.write_text(f"mtllib ../look.mtl\n{CORNERS}usemtl red\n{FACES}")
    assert list_companions(inner) == []
    assert load_mesh(inner).scene.finishes[0].colour != (1, 0, 0, 1)


def test_materials_keep_their_names_without_their_library(chair):
    (chair.parent / "look.mtl").unlink()
    scene = load_mesh(chair).scene
    assert {f.name for f in scene.finishes} == {"red", "blue"}
    assert {f.colour for f in scene.finishes} == {DEFAULT_FINISH.colour}
    assert "colours and pictures ('look.mtl' is not there" in scene.warnings[0]


def test_a_material_that_its_library_has_not_keeps_its_name(chair):
    (chair.parent / "look.mtl").write_text("newmtl red\nKd 1 0 0\n")
    scene = load_mesh(chair).scene
    assert {f.name: f.colour for f in scene.finishes} == {"red": (1, 0, 0, 1), "blue": DEFAULT_FINISH.colour}
    assert not scene.warnings


def test_a_missing_or_broken_picture_leaves_a_plain_colour(chair, tmp_path):
    (tmp_path / "pics" / "half blue.png").write_bytes(b"no picture")
    finishes = {f.name: f for f in load_mesh(chair).scene.finishes}
    assert finishes["blue"].texture is None


# ---------------------------------------------------------------- USD and what it may name

PICTURED = """color3f inputs:diffuseColor.connect = </world/look/t.outputs:rgb>
}
def Shader "t" {
uniform token info:id = "UsdUVTexture"
asset inputs:file = @FILE@
color3f outputs:rgb"""


@pytest.mark.slow
def test_a_picture_comes_from_the_files_own_folder_only(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "own").mkdir()
    for place in (tmp_path / "outside.png", tmp_path / "own" / "inside.png"):
        Image.fromarray(np.full((4, 4, 3), 90, np.uint8)).save(place)

    def look(file):
        text = PICTURED.replace("FILE", file).replace("}\ndef Shader", "token outputs:surface\n}\ndef Shader")
        (tmp_path / "own" / "a.usda").write_text(
            usd_text(block(), 1.0, "Z", text).replace("(0.2, 0.4, 0.6)", "(1, 1, 1)")
        )
        read = load_mesh(tmp_path / "own" / "a.usda")
        return read.scene.finishes[0].texture, read.scene.warnings

    assert look("./inside.png")[0].shape == (4, 4, 3)
    assert [p.name for p in list_companions(tmp_path / "own" / "a.usda")] == ["inside.png"]
    for elsewhere in ("../outside.png", str(tmp_path / "outside.png")):
        texture, told = look(elsewhere)
        assert texture is None and "pictures that are not there" in told[0]
        assert list_companions(tmp_path / "own" / "a.usda") == []


def test_a_layer_from_elsewhere_is_refused_before_it_is_opened(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "own").mkdir()
    (tmp_path / "secret.usda").write_text(usd_text(block(), 1.0, "Z"))
    for reference in ("subLayers = [@../secret.usda@]", 'defaultPrim = "a"'):
        inner = "" if "sub" in reference else 'def "a" (references = @../secret.usda@</world>) {}'
        (tmp_path / "own" / "a.usda").write_text(f"#usda 1.0\n({reference})\n{inner}\n")
        with pytest.raises(BadFileError, match=r"'../secret.usda', which lies outside its folder"):
            load_mesh(tmp_path / "own" / "a.usda")


def processor_seconds():
    """Of this process and of its children that have ended: a busy machine counts for nothing."""
    return sum(os.times()[:4])


@pytest.mark.slow
def test_instances_of_instances_end_at_the_deadline(tmp_path, mesh_reader_child):
    pytest.importorskip("pxr")
    lines = ['#usda 1.0\nclass "c0" {\ndef Mesh "m" {\npoint3f[] points = [(0, 0, 0)]\n}\n}\n']
    for level in range(1, 9):
        inner = "\n".join(f'def "x{k}" (instanceable = true\nreferences = </c{level - 1}>) {{}}' for k in range(10))
        lines.append(f'class "c{level}" {{\n{inner}\n}}\n')
    (tmp_path / "a.usda").write_text("".join(lines) + 'def "a" (references = </c8>) {}\n')
    start = processor_seconds()
    with pytest.raises(BadFileError, match="is not read within 12 s"):
        load_mesh(tmp_path / "a.usda", max_seconds=12)
    assert processor_seconds() - start < 20


# ---------------------------------------------------------------- what is broken


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty"),
        ("# nothing\n", "OBJ|no triangles"),
        ("v 0 0 0\nv 1 0 0\n", "OBJ|no triangles"),
        (f"{CORNERS}f 1 2 99\n", "OBJ"),
        (f"{CORNERS}f a b c\n", "OBJ"),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
        ("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "no size"),
        ("v 0 0\nv 1 0\nf 1 2 2\n", "OBJ|no triangles"),
        ("\0\1\2\xff" * 100, "OBJ|no triangles"),
    ],
)
def test_what_is_broken_is_refused_by_name(tmp_path, text, said):
    path = tmp_path / "bad.obj"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(BadFileError, match=said) as error:
        load_mesh(path)
    assert "bad.obj" in str(error.value) and "\n" not in str(error.value)


def ply(vertices, faces, body=b"", kind="binary_little_endian"):
    head = f"ply\nformat {kind} 1.0\nelement vertex {vertices}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + body


def zip_of(size):
    """A 3MF whose model unpacks to so many blanks."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("3D/3dmodel.model", "w") as model:
            for _ in range(size >> 20):
                model.write(b" " * 2**20)
    return made.getvalue()


TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
HOSTILE = {
    "names points that are not there.ply": (
        lambda: ply(3, 1, TRIANGLE + struct.pack("<B3i", 3, 0, 1, 7)),
        "a face without corners|cannot be read as PLY",
    ),
    "names points below zero.ply": (
        lambda: ply(3, 1, TRIANGLE + struct.pack("<B3i", 3, 0, 1, -2)),
        "a face without corners|cannot be read as PLY",
    ),
    "nan.ply": (lambda: ply(3, 1, struct.pack("<9fB3i", *[np.nan] * 9, 3, 0, 1, 2)), "finite|cannot be read"),
    "claims a trillion points.ply": (lambda: ply(10**12, 1, TRIANGLE), "PLY|does not fit"),
    "claims a billion faces.ply": (lambda: ply(3, 10**9, TRIANGLE), "no triangles|does not fit"),
    "cut off.ply": (lambda: ply(3, 1, TRIANGLE[:20]), "PLY|no triangles"),
    "claims four billion triangles.stl": (
        lambda: bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50),
        "STL|no triangles",
    ),
    "is a picture.stl": (lambda: b"\x89PNG\r\n\x1a\n" + bytes(500), "STL|no triangles|no size"),
    "all at one place.stl": (lambda: bytes(80) + struct.pack("<I", 2) + bytes(100), "no size"),
    "far away.off": (lambda: b"OFF\n3 1 0\n0 0 0\n1e300 0 0\n0 1 0\n3 0 1 2\n", "impossible"),
    "claims a billion points.off": (lambda: b"OFF\n1000000000 1 0\n0 0 0\n", "OFF|does not fit"),
    "is no zip.3mf": (lambda: b"PK\x03\x04" + bytes(100), "3MF"),
    "bomb.3mf": (lambda: zip_of(2**29 + 2**20), "unpacks to 0.5 GiB"),
    "is no model.3mf": (lambda: zip_of(2**20), "3MF"),
    "laughs.dae": (
        lambda: (
            b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY l0 "ha">'
            + b"".join(b'<!ENTITY l%d "%s">' % (k, b"&l%d;" % (k - 1) * 10) for k in range(1, 12))
            + b"]><COLLADA>&l11;</COLLADA>"
        ),
        "DAE",
    ),
    "reads a secret.dae": (
        lambda: (
            b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>'
            b"<COLLADA><asset>&x;</asset></COLLADA>"
        ),
        "DAE",
    ),
    "text.usd": (lambda: b"hello", "cannot be read as USD"),
    "cut off.usdc": (lambda: b"PXR-USDC" + bytes(40), "cannot be read as USD"),
    "is no zip.usdz": (lambda: b"PK\x03\x04" + bytes(100), "cannot be read as USD"),
    "no faces.usda": (lambda: b'#usda 1.0\ndef Mesh "m" {\n}\n', "no triangles"),
    "bad corners.usda": (
        lambda: usd_text(block(), 1.0, "Z").replace("[3, 3", "[9, 3").encode(),
        "faces without corners",
    ),
    "no unit at all.usda": (lambda: usd_text(block(), 0, "Z").encode(), "a unit is 0 m"),
}
NEEDS = {".3mf": "lxml", ".dae": "collada", ".usd": "pxr"}
LIMITED = [name for name in HOSTILE if name.startswith(("claims", "bomb", "laughs", "cut off", "text", "is no zip"))]
"""May take memory or time without end, or end the process."""


@pytest.mark.slow
@pytest.mark.parametrize("name", LIMITED)
def test_a_hostile_file_ends_in_one_sentence(tmp_path, mesh_reader_child, name):
    refused(tmp_path, name)


@pytest.mark.parametrize("name", sorted(HOSTILE.keys() - LIMITED))
def test_a_broken_file_ends_in_one_sentence(tmp_path, name):
    refused(tmp_path, name)


def refused(tmp_path, name):
    path = tmp_path / name
    if package := NEEDS.get(path.suffix[:4]):
        pytest.importorskip(package)
    make, said = HOSTILE[name]
    path.write_bytes(make())
    start = processor_seconds()
    with pytest.raises(BadFileError, match=said) as error:
        load_mesh(path)
    assert processor_seconds() - start < 30
    assert name in str(error.value) and "\n" not in str(error.value)
    assert len(str(error.value)) < len(str(path)) + 250


def test_the_readers_of_meshes_may_be_absent(tmp_path, monkeypatch):
    (tmp_path / "a.3mf").write_bytes(b"PK")
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    with pytest.raises(BadFileError, match=r"needs lxml and networkx.*'corporeal\[meshes\]'"):
        load_mesh(tmp_path / "a.3mf")


# ---------------------------------------------------------------- as other programs write them


def test_an_obj_may_count_corners_back_from_where_they_stand(tmp_path):
    """Each triangle after its own vertices, as some programs write all of them."""
    box, path = block(), tmp_path / "crate.obj"
    lines = ["o crate", "vt 0 0"]
    for triangle in box.triangles:
        lines += [f"v {x} {y} {z}" for x, y, z in triangle]
        lines += ["f -3/-1 -2/-1 \\", " -1/-1"]
    path.write_text("\r\n".join(lines))
    surface = load_mesh(path, up="+z").scene.surfaces[0]
    made = trimesh.Trimesh(surface.vertices, surface.triangles)
    assert np.allclose(np.ptp(surface.vertices, axis=0), SIZE)
    assert made.volume == pytest.approx(SIZE.prod())


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("mixed", [True, False])
@pytest.mark.parametrize("flagged", [False, True])
def test_a_ply_in_bytes_may_mix_triangles_and_quads(tmp_path, order, mixed, flagged):
    box, path = trimesh.creation.box((2, 3, 4)), tmp_path / "crate.ply"
    written = [face.tolist() for face in box.faces]
    if mixed:  # the first and the third are one side
        written = [[0, 1, 3, 2], written[1], *written[3:]]
    kind = {"<": "little", ">": "big"}[order]
    head = [f"ply\nformat binary_{kind}_endian 1.0\nelement vertex 8"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {len(written)}\nproperty list uchar uint vertex_indices"]
    head += ["property uchar flags"] * flagged
    body = b"".join(struct.pack(f"{order}3d", *place) for place in box.vertices)
    for face in written:
        body += struct.pack(f"{order}B{len(face)}I", len(face), *face) + b"\7" * flagged
    path.write_bytes(("\n".join(head) + "\nend_header\n").encode() + body)
    made = load_mesh(path)
    surface = made.scene.surfaces[0]
    shape = trimesh.Trimesh(surface.vertices, surface.triangles)
    assert np.allclose(np.ptp(surface.vertices, axis=0), (2, 3, 4))
    assert shape.area == pytest.approx(52)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(BadFileError, match=r"PLY|faces"):
        load_mesh(path)
