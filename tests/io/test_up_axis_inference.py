"""What is said of a mesh that lies on its side, since its file does not state what is up."""

import numpy as np
import pytest
import trimesh

from corporeal.io.mesh.mesh_loader import load_mesh
from corporeal.io.mesh.mesh_trimesh import read_dae_names

QUARTER = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
"""Turns what has +y up to have +z up."""

pytestmark = pytest.mark.usefixtures("mesh_reader_in_process")


def chair():
    """Return a chair with +z up: it also stands on its back."""
    legs = [box((x, y, 0), (x + 0.04, y + 0.04, 0.45)) for x in (-0.2, 0.16) for y in (-0.2, 0.16)]
    seat, back = box((-0.2, -0.2, 0.45), (0.2, 0.2, 0.5)), box((-0.2, 0.16, 0.5), (0.2, 0.2, 0.9))
    return trimesh.util.concatenate([*legs, seat, back])


def box(low, high):
    return trimesh.creation.box(bounds=[low, high])


def mushroom():
    """Return what stands on its stem with +z up, and tips over on the edge of its cap."""
    stem = box((-0.1, -0.1, 0), (0.1, 0.1, 0.4))
    cap = trimesh.creation.cone(0.3, 0.3, sections=31).apply_translation((0, 0, 0.4))
    return trimesh.util.concatenate([stem, cap])


def said(mesh, path, head=""):
    text = mesh.export(file_type=path.suffix[1:])
    path.write_bytes(head.encode() + (text.encode() if isinstance(text, str) else text))
    return load_mesh(path).scene


@pytest.mark.parametrize(("made", "why"), [(chair, "plane z = 0"), (mushroom, "tip over")])
def test_an_obj_that_lies_on_its_side_is_reported_to_and_an_upright_one_is_not(tmp_path, made, why):
    (lying,) = said(made(), tmp_path / "thing.obj").warnings
    assert why in lying and "use --up z" in lying
    upright = made().apply_transform(np.linalg.inv(QUARTER))
    assert said(upright, tmp_path / "thing.obj").warnings == ()
    assert load_mesh(tmp_path / "thing.obj", up="+z").scene.warnings == (), "somebody says it"


def test_a_ply_that_was_made_with_y_up_is_reported_to_lie(tmp_path):
    lying = chair().apply_transform(np.linalg.inv(QUARTER))
    (why,) = said(lying, tmp_path / "chair.ply").warnings
    assert "plane y = 0" in why and "use --up y" in why
    assert said(chair(), tmp_path / "chair.ply").warnings == ()


@pytest.mark.parametrize("comment", ["# Z-up, metres", "# up axis: z", "# up_axis = +Z"])
def test_a_comment_that_says_z_up_is_believed_and_reported(tmp_path, comment):
    scene = said(chair(), tmp_path / "chair.obj", f"{comment}\n")
    (why,) = scene.warnings
    assert "as its comment states" in why
    height = np.ptp(np.concatenate([s.vertices for s in scene.surfaces]), axis=0)[2]
    assert height == pytest.approx(0.9)


def test_what_stands_either_way_is_not_doubted(tmp_path):
    cube = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    assert said(cube, tmp_path / "cube.obj", "# a set up, z\n# zup.com\n").warnings == ()


def test_places_of_a_geometry_that_no_node_names_are_objects_apart():
    pytest.importorskip("collada")
    assert [own for own, _ in read_dae_names(THREE.encode()).values()] == [
        ("brick",), ("brick_1",), ("brick_2",),
    ]  # fmt: skip


PLACES = "".join(f"<node><translate>{x} 0 0</translate><instance_geometry url='#g'/></node>" for x in range(3))
THREE = f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset/><library_geometries><geometry id="g" name="brick"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
<technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">{PLACES}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
