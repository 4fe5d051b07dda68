import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from corporeal.core.errors import BadFileError
from corporeal.core.types import Push, Wall, Wind
from corporeal.io.scene_toml import ObjectEntry, SceneFile, read_scene_file, write_scene_file

WHOLE = """
duration = 2
fps = 30
gravity = [0, 0, -1.62]
[[object]]
name = "duck_0"
file = "duck.glb"
class = "rubber duck"
extent = 0.1
position = [0, 0, 0.4]
velocity = [0, 0, -2]
push = { acceleration = [3, 0, 0], from = 0.1, to = 0.5 }
[[object]]
file = "can.glb"
push = { acceleration = [1, 0, 0] }
wind = { velocity = [8, 0, 0], gust = 0.3, from = 0.5, to = 1.5 }
"""


WALL = 'file = "a.glb"\n[[wall]]\n'
WIND = '[[object]]\nfile = "a.glb"\nwind = '


def read(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return read_scene_file(path)


def test_a_scene_file_says_what_is_where_and_how_it_starts(tmp_path):
    scene = read(tmp_path, WHOLE)
    duck, can = scene.objects
    assert (scene.duration, scene.fps, scene.gravity) == (2.0, 30, (0.0, 0.0, -1.62))
    assert duck.file == tmp_path / "duck.glb"
    assert (duck.name, duck.class_name, duck.extent) == ("duck_0", "rubber duck", 0.1)
    assert (duck.position, duck.velocity) == ((0, 0, 0.4), (0, 0, -2))
    assert duck.push == Push((3.0, 0.0, 0.0), 0.1, 0.5)
    assert can.push == Push((1.0, 0.0, 0.0), 0.0, math.inf)
    assert can.wind == Wind((8.0, 0.0, 0.0), 0.3, 0.5, 1.5)
    assert duck.wind is None
    assert can.position is can.velocity is can.name is None


@pytest.mark.parametrize(("said", "meant"), [("true", True), ("false", False)])
def test_a_scene_file_says_that_objects_had_come_to_rest(tmp_path, said, meant):
    scene = read(tmp_path, f'file = "a.glb"\nsettled = {said}\n')
    assert scene.settled is meant
    write_scene_file(tmp_path / "again.toml", scene)
    assert f"settled = {said}" in (tmp_path / "again.toml").read_text()
    assert read_scene_file(tmp_path / "again.toml").settled is meant
    assert read(tmp_path, 'file = "a.glb"').settled is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('file = "a.glb"\nsettled = 1', "'settled' is 1. Write true or false."),
        ('file = "a.glb"\ndt = 1e-4', "unknown key 'dt'. Allowed here: file, duration"),
        ('[[object]]\nfile = "a.glb"\nyoung = 1e6', "object 1: unknown key 'young'"),
        ('[[object]]\nfile = "a.glb"\ndamping = 0.1', "unknown key 'damping'"),
        ('file = "a.glb"\nwind = { velocity = [1, 0, 0] }', "unknown key 'wind'"),
        (WIND + '"strong"', "'wind' is not a table. Allowed in it: velocity, gust, from, to"),
        (WIND + "{ gust = 0.3 }", "wind: 'velocity' is missing"),
        (WIND + "{ velocity = [8, 0] }", "three numbers"),
        (WIND + "{ velocity = [8, 0, 0], gust = -0.1 }", "from 0 to 1"),
        (WIND + "{ velocity = [8, 0, 0], gust = 1.1 }", "from 0 to 1"),
        (WIND + "{ velocity = [8, 0, 0], gust = nan }", "from 0 to 1"),
        (WIND + "{ velocity = [8, 0, 0], from = 2, to = 1 }", "before it begins"),
        (WIND + "{ velocity = [8, 0, 0], from = -1 }", "from 0 to 60"),
        (WIND + "{ velocity = [340, 0, 0] }", "at up to 340 m/s. Give at most 100 m/s"),
        (WIND + "{ velocity = [60, 0, 60], gust = 0.5 }", "at up to 127.3 m/s"),
        (WIND + "{ velocity = [8, 0, 0], drag = 1.2 }", "unknown key 'drag'"),
        ('[[object]]\nfile = "a.glb"\nposition = [0, 0]', "three numbers"),
        ('[[object]]\nfile = "a.glb"\nposition = [0, 0, nan]', "three numbers"),
        ('[[object]]\nfile = "a.glb"\nvelocity = [0, 0, 1e9]', "at most 1000"),
        ('[[object]]\nfile = "a.glb"\nvelocity = "fast"', "three numbers"),
        ('[[object]]\nfile = "a.glb"\npush = [1, 0, 0]', "not a table"),
        ('[[object]]\nfile = "a.glb"\npush = { to = 1 }', "'acceleration' is missing"),
        ('[[object]]\nfile = "a.glb"\npush = { acceleration = [1, 0, 0], from = 1, to = 0.5 }', "before it begins"),
        ("[[object]]\nfile = 3", "not a text"),
        ('[[object]]\nfile = "a.glb"\nextent = -1', "from 0.0001 to 1000"),
        ('[[object]]\nname = "a"', "names no model"),
        ('[object]\nfile = "a.glb"', "Write [[object]] before each"),
        ('file = "a.glb"\n[[object]]\nposition = [0, 0, 0]', "object 1 names no file"),
        ('file = "a.glb"\nduration = 0', "from 0.01 to 60"),
        ('file = "a.glb"\nduration = true', "from 0.01 to 60"),
        ('file = "a.glb"\nfps = 29.97', "whole number"),
        (WALL + "point = [1, 0, 0]", "wall 1: it needs a point and a normal"),
        (WALL + "point = [1, 0, 0]\nnormal = [0, 0, 0]", "wall 1: 'normal' is zero"),
        (WALL + "point = [1, 0, 0]\nnormal = [1, 0, inf]", "three numbers"),
        (WALL + "friction = 2", "wall 1: unknown key 'friction'"),
        ("file = ", "not valid TOML"),
        ("[[object]\n", "An object begins with [[object]]"),
        ("", "names no model"),
    ],
)
def test_a_slip_in_a_scene_file_is_named(tmp_path, text, said):
    with pytest.raises(BadFileError) as error:
        read(tmp_path, text)
    assert said in str(error.value)
    assert "scene.toml" in str(error.value)


def test_a_scene_file_may_have_walls(tmp_path):
    scene = read(tmp_path, 'file = "a.glb"\n[[wall]]\npoint = [1, 0, 0]\nnormal = [-3, 0, 4]\n')
    assert scene.walls == (Wall((-0.6, 0.0, 0.8), (1.0, 0.0, 0.0)),)


def test_a_missing_scene_file_is_named(tmp_path):
    with pytest.raises(BadFileError, match="no such file"):
        read_scene_file(tmp_path / "none.toml")


# ---------------------------------------------------------------- writing


def vectors(most=1000.0):
    return st.tuples(*[st.floats(-most, most, allow_subnormal=False)] * 3)


@st.composite
def windows(draw):
    start = draw(st.floats(0.0, 59.0))
    return start, draw(st.just(math.inf) | st.floats(start, 60.0, exclude_min=True))


words = st.text(st.characters(codec="utf-8"), min_size=1).filter(str.strip)
files = st.sampled_from(["duck.glb", "models/a b.glb", "ünï\x7fcode.glb", 'quo"te.glb'])
# Plain values: whoever checks types while values are drawn would roll dice of its own.
entries = st.fixed_dictionaries(
    {
        "name": words,
        "file": st.none() | files,
        "class_name": st.none() | words,
        "extent": st.none() | st.floats(1e-4, 1000.0),
        "position": st.none() | vectors(),
        "velocity": st.none() | vectors(),
        "push": st.none() | st.tuples(vectors(), windows()),
        "wind": st.none() | st.tuples(vectors(28.0), st.floats(0.0, 1.0), windows()),
    }
)
scene_files = st.fixed_dictionaries(
    {
        "duration": st.none() | st.floats(0.01, 60.0),
        "fps": st.none() | st.integers(1, 1000),
        "gravity": st.none() | vectors(),
        "objects": st.lists(entries, max_size=3),
        "walls": st.lists(st.tuples(st.sampled_from([(0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)]), vectors()), max_size=2),
    }
)


def entry(folder, drawn):
    file, push, wind = (drawn[key] for key in ("file", "push", "wind"))
    made = {
        "file": file and folder / file,
        "push": push and Push(push[0], *push[1]),
        "wind": wind and Wind(wind[0], wind[1], *wind[2]),
    }
    return ObjectEntry(**(drawn | made))


@pytest.mark.slow
@given(drawn=scene_files)
@settings(max_examples=30, deadline=None)
def test_what_is_written_is_read_back(drawn):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = {
            "path": folder / "scene.toml",
            "file": folder / "scene.glb",
            "objects": tuple(entry(folder, o) for o in drawn["objects"]),
            "walls": tuple(Wall(*wall) for wall in drawn["walls"]),
        }
        scene = SceneFile(**(drawn | made))
        write_scene_file(scene.path, scene)
        assert read_scene_file(scene.path) == scene


def test_a_scene_of_files_names_none_of_its_own(tmp_path):
    path = tmp_path / "scene.toml"
    scene = SceneFile(path, objects=(ObjectEntry(file=tmp_path / "duck.glb"),))
    write_scene_file(path, scene)
    assert read_scene_file(path) == scene


def test_files_elsewhere_are_still_found(tmp_path):
    duck = tmp_path / "models" / "duck.glb"
    path = tmp_path / "scenes" / "scene.toml"
    write_scene_file(path, SceneFile(path, file=duck))
    found = read_scene_file(path).file
    assert found is not None and found.resolve() == duck


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (SceneFile(Path("x")), "names no model"),
        (SceneFile(Path("x"), Path("a.glb"), duration=math.nan), "'duration' is nan"),
        (SceneFile(Path("x"), Path("a.glb"), gravity=(0.0, 0.0, -math.inf)), "'gravity' is"),
        (SceneFile(Path("x"), Path("a.glb"), fps=0), "'fps' is 0"),
        (SceneFile(Path("x"), Path("a.glb"), objects=(ObjectEntry(),)), "object 1 names no file"),
        (SceneFile(Path("x"), objects=(ObjectEntry(name="\ud800", file=Path("a.glb")),)), "is not valid TOML"),
        (
            SceneFile(Path("x"), objects=(ObjectEntry(file=Path("a.glb"), wind=Wind((99.0, 0.0, 0.0), gust=1.0)),)),
            "it blows at up to 198 m/s",
        ),
    ],
)
def test_what_reading_refuses_is_not_written(tmp_path, scene, said):
    path = tmp_path / "scene.toml"
    with pytest.raises(BadFileError, match=said):
        write_scene_file(path, scene)
    assert not path.exists()
