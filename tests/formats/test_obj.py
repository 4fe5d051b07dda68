"""Wavefront OBJ with its materials."""

import numpy as np
import pytest
from PIL import Image

from corporeal.errors import BadFileError
from corporeal.formats.obj import companions, read_obj

CORNERS = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\n"
FACES = "f 1 2 3 4\nf 1/1 2/2 5/3\n"


@pytest.fixture
def chair(tmp_path):
    """A red quad and a triangle with a picture whose left half is blue."""
    (tmp_path / "look.mtl").write_text(
        "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 0\nmap_Kd pics/half blue.png\n"
    )
    (tmp_path / "pics").mkdir()
    picture = np.zeros((4, 4, 3), np.uint8)
    picture[:, :2, 2] = 255
    Image.fromarray(picture).save(tmp_path / "pics" / "half blue.png")
    path = tmp_path / "Old_Chair.obj"
    path.write_text(
        f"mtllib look.mtl\n{CORNERS}vt 0 0\nvt 0.25 0\nvt 0 1\n"
        "usemtl red\nf 1 2 3 4\nusemtl blue\nf 1/1 2/2 5/3\n"
    )
    return path


def test_shape_and_look_are_read_with_z_up(chair):
    scene = read_obj(chair)
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
    scene = read_obj(chair)
    (blue,) = (s for s in scene.surfaces if scene.finishes[s.finish].name == "blue")
    high = blue.vertices[:, 1].argmin()  # 3 up OBJ's z is 3 along our -y
    np.testing.assert_allclose(blue.uv[high], (0, 0))
    np.testing.assert_allclose(sorted(map(tuple, blue.uv)), [(0, 0), (0, 1), (0.25, 1)])


def test_companions_are_named_and_come_from_the_same_folder_only(chair, tmp_path):
    assert [p.name for p in companions(chair)] == ["look.mtl", "half blue.png"]
    (tmp_path / "below").mkdir()
    inner = tmp_path / "below" / "x.obj"
    inner.write_text(f"mtllib ../look.mtl\n{CORNERS}usemtl red\n{FACES}")
    assert companions(inner) == []
    assert read_obj(inner).finishes[0].colour != (1, 0, 0, 1)


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
        read_obj(path)
    assert "bad.obj" in str(error.value)


def test_a_missing_or_broken_picture_leaves_a_plain_colour(chair, tmp_path):
    (tmp_path / "pics" / "half blue.png").write_bytes(b"no picture")
    finishes = {f.name: f for f in read_obj(chair).finishes}
    assert finishes["blue"].texture is None
