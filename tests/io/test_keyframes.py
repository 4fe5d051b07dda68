"""Paths that people write: what they mean, and what is said of slips."""

import math

import numpy as np
import pytest

from corporeal.core.errors import BadFileError
from corporeal.core.types import Keyframes
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.io.scene_toml import read_scene_file, write_scene_file
from corporeal.scene.scene_building import box, build_scene

HEAD = '[[object]]\nfile = "a.glb"\n'


def read(tmp_path, text, csv=None):
    if csv is not None:
        (tmp_path / "hand.csv").write_text(csv)
    (tmp_path / "scene.toml").write_text(HEAD + text)
    return read_scene_file(tmp_path / "scene.toml").objects[0]


def test_a_path_begins_at_its_first_row_and_goes_on_from_there(tmp_path):
    thing = read(tmp_path, "path = [[0, 1, 2, 3], [0.5, 1, 2, 3.5]]")
    assert thing.position == (1.0, 2.0, 3.0)
    still = (0.0, 0.0, 0.0)
    assert thing.path == Keyframes((0.0, 0.5), (still, (0.0, 0.0, 0.5)), (still, still))


def test_a_rotation_vector_about_one_axis_counts_every_turn(tmp_path):
    thing = read(tmp_path, "path = [[0, 0, 0, 0, 0, 0, 90], [2, 0, 0, 0, 0, 0, 810]]")
    np.testing.assert_allclose(thing.path.turn, [[0, 0, 0], [0, 0, 4 * math.pi]])


def test_a_quaternion_turns_the_shorter_way(tmp_path):
    half = math.sqrt(0.5)
    rows = f"path = [[0, 0, 0, 0, 1, 0, 0, 0], [1, 0, 0, 0, {-half}, 0, {half}, 0]]"
    turn = read(tmp_path, rows).path.turn
    np.testing.assert_allclose(turn, [[0, 0, 0], [0, -math.pi / 2, 0]], atol=1e-12)


@pytest.mark.parametrize("head", ["", "t,x,y,z\n", "\ufefft, x, y, z\n"])
def test_a_csv_file_says_the_same_as_rows(tmp_path, head):
    csv = head + "0, 1, 2, 3\n\n0.5, 1, 2, 3.5\n"
    followed = read(tmp_path, 'follows = "hand.csv"', csv)
    told = read(tmp_path, "path = [[0, 1, 2, 3], [0.5, 1, 2, 3.5]]")
    assert (followed.path, followed.position) == (told.path, told.position)


@pytest.mark.parametrize(
    "rows",
    [
        "[[0, 1, 2, 3], [0.5, 1, 2, 3.5]]",
        "[[0, 0, 0, 1, 0, 0, 0], [2, 0, 0, 1, 0, 0, 720]]",
        "[[0, 0, 0, 1, 0, 0, 0], [1, 0, 0, 1, 0, 0, 90], [2, 0, 0, 1, 90, 0, 0]]",
    ],
)
def test_a_path_that_was_written_is_read_back(tmp_path, rows):
    read(tmp_path, f"path = {rows}")
    first = read_scene_file(tmp_path / "scene.toml")
    write_scene_file(tmp_path / "again.toml", first)
    again = read_scene_file(tmp_path / "again.toml").objects[0]
    assert again.position == first.objects[0].position
    np.testing.assert_allclose(again.path.turn, first.objects[0].path.turn, atol=1e-12)
    np.testing.assert_allclose(again.path.shift, first.objects[0].path.shift, atol=1e-12)


def test_a_path_survives_in_a_glb_of_ours(tmp_path):
    from dataclasses import replace

    path = Keyframes((0.0, 1.0), ((0.0,) * 3, (0.5, 0.0, 0.0)), ((0.0,) * 3, (0.0, 0.0, 1.0)))
    thing = replace(box("wood", size=(0.1, 0.1, 0.1), at=(0, 0, 0.05)), path=path)
    write_glb(tmp_path / "hand.glb", build_scene(thing))
    assert read_glb(tmp_path / "hand.glb").objects[0].path == path


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("path = 3", "object 1: 'path' is 3, not a list of rows."),
        ("path = []", "path: it has 0 rows"),
        ("path = [[0, 0, 0]]", "path: row 1 is [0, 0, 0]. Give rows of t, x, y, z"),
        ("path = [[0, 0, 0, nan]]", "path: row 1 is"),
        ("path = [[0, 0, 0, true]]", "path: row 1 is"),
        ("path = [[0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 9]]", "row 2 has 7 numbers, the first 4"),
        ("path = [[0, 0, 0, 0], [0, 0, 0, 1]]", "row 2 at 0 s comes after 0 s. Let times rise."),
        ("path = [[-1, 0, 0, 0], [0, 0, 0, 1]]", "its times run from -1 to 0 s"),
        ("path = [[0, 0, 0, 0], [1e-3, 5, 0, 0]]", "goes at 5e+03 m/s from row 1 to row 2"),
        ("path = [[0, 5000, 0, 0]]", "farther away than a kilometre"),
        ("path = [[0, 0, 0, 0, 2, 0, 0, 0]]", "the quaternion of row 1 has length 2"),
        ("path = [[0, 0, 0, 0]]\nposition = [0, 0, 1]", "follows a path and has a 'position'"),
        ("path = [[0, 0, 0, 0]]\nvelocity = [0, 0, 1]", "follows a path and has a 'velocity'"),
        ("path = [[0, 0, 0, 0]]\nwind = { velocity = [1, 0, 0] }", "and has a 'wind'"),
        ('path = [[0, 0, 0, 0]]\nfollows = "hand.csv"', "Say only one of them."),
        ('follows = "none.csv"', "there is no file"),
        ("follows = 3", "'follows' is 3, not a text"),
    ],
)
def test_a_slip_in_a_path_is_named(tmp_path, text, said):
    with pytest.raises(BadFileError) as error:
        read(tmp_path, text)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("csv", "said"),
    [
        ("", "it has 0 rows"),
        ("t,x,y,z\n0,0,0,a\n", "line 2 holds '0,0,0,a', not numbers."),
        ("0,0,0\n", "row 1 is [0.0, 0.0, 0.0]"),
        ("0,0,0,0\n1,0,0\n", "row 2 is [1.0, 0.0, 0.0]"),
        ("0,0,0,inf\n", "row 1 is"),
    ],
)
def test_a_slip_in_a_file_of_a_path_is_named(tmp_path, csv, said):
    with pytest.raises(BadFileError) as error:
        read(tmp_path, 'follows = "hand.csv"', csv)
    assert said in str(error.value)
    assert "hand.csv" in str(error.value)
