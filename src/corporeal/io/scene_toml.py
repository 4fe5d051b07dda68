"""Reading and writing of ``scene.toml``: objects, initial states, forces [m, s].

It has no numerical parameters: quality is set by ``--detail``.

::

    file = "scene.glb"            # or one [[object]] per file
    duration = 2.0
    fps = 60
    gravity = [0, 0, -9.81]
    settled = true                # what lies or stands had come to rest before all this begins
    [[object]]
    name = "duck_0"               # of an object in ``file``, or a name to give
    file = "duck.glb"
    position = [0, 0, 0.4]        # the middle of the underside of its bounding box
    velocity = [0, 0, -2]
    extent = 0.1                  # its largest extent
    class = "rubber duck"
    push = { acceleration = [3, 0, 0], from = 0.0, to = 0.5 }
    wind = { velocity = [8, 0, 0], gust = 0.3, from = 0.0, to = 1.5 }
    [[object]]
    file = "hand.glb"             # prescribed motion, as one rigid body, whatever it meets
    path = [[0, 0, 0, 0.2], [0.5, 0, 0, 0.1]]    # rows of t, x, y, z: see ``keyframes``
    # or follows = "hand.csv", a file of such rows
    [[wall]]
    point = [1, 0, 0]             # any point of it
    normal = [-1, 0, 0]           # out of the wall into the room
"""

import json
import math
import os
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.types import Keyframes, Push, Vector, Wall, Wind
from corporeal.io import keyframes

SCENE_KEYS = ("file", "duration", "fps", "gravity", "settled", "object", "wall")
WALL_KEYS = ("point", "normal")
OBJECT_KEYS = (*("name", "file", "class", "extent", "position", "velocity", "push", "wind"), *("path", "follows"))
KEYS_STATED_BY_PATH = ("position", "velocity", "push", "wind")
"""Fields that an object with a path must not have."""
PUSH_KEYS = ("acceleration", "from", "to")
WIND_KEYS = ("velocity", "gust", "from", "to")
MAX_SCENE_DURATION_S = 60.0
"""[s]"""
MAX_SCENE_SPEED_M_S = 1000.0
"""Speed [m/s] and acceleration [m/s²] beyond which an entry is taken for a slip."""
MAX_STATED_WIND_SPEED_M_S = 100.0
"""Fastest wind [m/s]: air resists otherwise from a third of the speed of sound."""
MAX_SCENE_DISTANCE_M = 1000.0
"""[m]"""


@dataclass(frozen=True)
class ObjectEntry:
    """What one [[object]] says; None: nothing."""

    name: str | None = None
    file: Path | None = None
    class_name: str | None = None
    extent: float | None = None
    """[m]"""
    position: Vector | None = None
    """Middle of the underside of the bounding box [m]."""
    velocity: Vector | None = None
    """[m/s]"""
    push: Push | None = None
    wind: Wind | None = None
    path: Keyframes | None = None
    """From ``position``, which the file says as the path's first row."""


@dataclass(frozen=True)
class SceneFile:
    """What a scene file says; None: nothing."""

    path: Path
    file: Path | None = None
    duration: float | None = None
    """[s]"""
    fps: int | None = None
    gravity: Vector | None = None
    """[m/s²]"""
    settled: bool | None = None
    """Whether what lies or stands had come to rest before it begins."""
    objects: tuple[ObjectEntry, ...] = ()
    walls: tuple[Wall, ...] = ()


def read_scene_file(path: Path) -> SceneFile:
    """Read and check a scene file.

    Raises:
        BadFileError: It is no TOML, has an unknown key, or a value of the wrong kind or size.
    """
    return _checked_scene(path, _parsed(path, _load(path)))


def write_scene_file(path: Path, scene: SceneFile) -> None:
    """Write what ``read_scene_file`` reads back, files relative to the scene file's folder.

    Raises:
        BadFileError: Reading would refuse it; nothing is written.
        UserError: The disk refuses it.
    """
    data = "\n".join(_lines(replace(scene, path=path))).encode(errors="surrogatepass")
    _checked_scene(path, _parsed(path, data))
    store.write_bytes(path, data)


def _lines(scene: SceneFile) -> Iterator[str]:
    folder = scene.path.parent
    head = {name: getattr(scene, name) for name in ("file", "duration", "fps", "gravity", "settled")}
    yield from _pairs(head, folder)
    for entry in scene.objects:
        yield from ("", "[[object]]")
        yield from _pairs(_rows_of(entry), folder)
    for wall in scene.walls:
        yield from ("", "[[wall]]")
        yield from _pairs({"point": wall.point, "normal": wall.normal}, folder)
    yield ""


def _rows_of(entry: ObjectEntry) -> dict[str, Any]:
    rows = {
        "name": entry.name,
        "file": entry.file,
        "class": entry.class_name,
        "extent": entry.extent,
        "position": entry.position,
        "velocity": entry.velocity,
    }
    if entry.path is not None:
        rows["path"] = keyframes.rows_from_keyframes(rows.pop("position") or (0.0, 0.0, 0.0), entry.path)
    if entry.push is not None:
        rows["push"] = {"acceleration": entry.push.acceleration} | _format_window(entry.push)
    if entry.wind is not None:
        blown = {"velocity": entry.wind.velocity, "gust": entry.wind.gust}
        rows["wind"] = blown | _format_window(entry.wind)
    return rows


def _format_window(force: Push | Wind) -> dict[str, float]:
    return {"from": force.start} | ({"to": force.end} if force.end < math.inf else {})


def _pairs(rows: dict[str, Any], folder: Path) -> Iterator[str]:
    return (f"{key} = {_format_toml_value(x, folder)}" for key, x in rows.items() if x is not None)


def _format_toml_value(x: Any, folder: Path) -> str:
    """Return a value as TOML writes it."""
    if isinstance(x, dict):
        return f"{{ {', '.join(_pairs(x, folder))} }}"
    if isinstance(x, tuple):
        return f"[{', '.join(_format_toml_value(c, folder) for c in x)}]"
    if isinstance(x, int):
        return str(x).lower()
    if isinstance(x, float):
        return repr(float(x))
    text = _relative(x, folder) if isinstance(x, Path) else x
    # JSON's texts are TOML's too, but for one character.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _relative(file: Path, folder: Path) -> str:
    if file.is_relative_to(folder):
        return file.relative_to(folder).as_posix()
    return str(file) if file.is_absolute() else os.path.relpath(file, folder)


def _checked_scene(path: Path, parsed: dict[str, Any]) -> SceneFile:
    table = _TomlTable(path, "", parsed)
    table.only(SCENE_KEYS)
    objects = tuple(_object(t) for t in table.tables("object"))
    file = table.file("file")
    if file is None and not any(o.file for o in objects):
        table.fail("names no model.", 'Give file = "scene.glb", or a file in each [[object]].')
    for k, entry in enumerate(objects):
        if entry.file is None and (file is None or entry.name is None):
            table.fail(f"object {k + 1} names no file.", "Give it a file, or a name within file.")
    return SceneFile(
        path=path,
        file=file,
        duration=table.number("duration", 0.01, MAX_SCENE_DURATION_S),
        fps=table.whole("fps", 1, 1000),
        gravity=table.vector("gravity", MAX_SCENE_SPEED_M_S),
        settled=table.flag("settled"),
        objects=objects,
        walls=tuple(_wall(t) for t in table.tables("wall")),
    )


def _object(table: "_TomlTable") -> ObjectEntry:
    table.only(OBJECT_KEYS)
    start, path = _path(table)
    return ObjectEntry(
        name=table.text("name"),
        file=table.file("file"),
        class_name=table.text("class"),
        extent=table.number("extent", 1e-4, MAX_SCENE_DISTANCE_M),
        position=start or table.vector("position", MAX_SCENE_DISTANCE_M),
        velocity=table.vector("velocity", MAX_SCENE_SPEED_M_S),
        push=_push(table),
        wind=_wind(table),
        path=path,
    )


def _path(table: "_TomlTable") -> tuple[Vector | None, Keyframes | None]:
    """Return where an object's path begins [m], and the path; None where it has none."""
    rows, follows = table.value.get("path"), table.file("follows")
    if rows is None and follows is None:
        return None, None
    if rows is not None and follows is not None:
        table.fail("it has a path and follows a file.", "Say only one of them.")
    for key in KEYS_STATED_BY_PATH:
        if key in table.value:
            table.fail(f"it follows a path and has a {key!r}.", "Leave one of them out.")
    if follows is not None:
        return keyframes.read_keyframe_file(follows, table.fail)
    if not isinstance(rows, list):
        table.fail(f"'path' is {_shown(rows)}, not a list of rows.", keyframes.KEYFRAME_ROWS_ADVICE)

    def fail(what: str, step: str) -> NoReturn:
        table.fail(f"path: {what}", step)

    return keyframes.keyframes_from_rows(rows, fail)


def _wall(table: "_TomlTable") -> Wall:
    table.only(WALL_KEYS)
    point, normal = (table.vector("point", MAX_SCENE_DISTANCE_M), table.vector("normal", MAX_SCENE_DISTANCE_M))
    if point is None or normal is None:
        table.fail("it needs a point and a normal.", "Give both as [x, y, z].")
    size = math.hypot(*normal)
    if size < 1e-6:
        table.fail("'normal' is zero.", "Give the direction out of the wall.")
    return Wall((normal[0] / size, normal[1] / size, normal[2] / size), point)


def _push(table: "_TomlTable") -> Push | None:
    push = table.table("push", PUSH_KEYS)
    if push is None:
        return None
    acceleration = push.vector("acceleration", MAX_SCENE_SPEED_M_S)
    if acceleration is None:
        push.fail("'acceleration' is missing.", "Give it as [x, y, z] in m/s².")
    return Push(acceleration, *push.window())


def _wind(table: "_TomlTable") -> Wind | None:
    wind = table.table("wind", WIND_KEYS)
    if wind is None:
        return None
    velocity = wind.vector("velocity", MAX_SCENE_SPEED_M_S)
    if velocity is None:
        wind.fail("'velocity' is missing.", "Give it as [x, y, z] in m/s.")
    gust = wind.number("gust", 0.0, 1.0) or 0.0
    if math.hypot(*velocity) * (1.0 + gust) > MAX_STATED_WIND_SPEED_M_S:
        what = f"it blows at up to {math.hypot(*velocity) * (1.0 + gust):.4g} m/s."
        wind.fail(what, f"Give at most {MAX_STATED_WIND_SPEED_M_S:g} m/s, gusts included.")
    return Wind(velocity, gust, *wind.window())


def _load(path: Path) -> bytes:
    if not path.is_file():
        raise BadFileError(path, "there is no such file.", "Check the path.")
    try:
        return path.read_bytes()
    except OSError as problem:
        raise BadFileError(path, f"cannot be read ({problem.strerror}).") from None


def _parsed(path: Path, data: bytes) -> dict[str, Any]:
    try:
        return tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as problem:
        step = "An object begins with [[object]], and then for example: file = 'duck.glb'."
        raise BadFileError(path, f"is not valid TOML ({str(problem)[:100]}).", step) from None


@dataclass(frozen=True)
class _TomlTable:
    """One table of the file and its place."""

    path: Path
    where: str
    value: dict[str, Any]

    def fail(self, what: str, next_step: str) -> NoReturn:
        raise BadFileError(self.path, f"{self.where}{what}", next_step)

    def only(self, allowed: tuple[str, ...]) -> None:
        for key in self.value:
            if key not in allowed:
                self.fail(f"unknown key {key[:40]!r}.", f"Allowed here: {', '.join(allowed)}.")

    def tables(self, key: str) -> "list[_TomlTable]":
        items = self.value.get(key, [])
        if not isinstance(items, list) or not all(isinstance(x, dict) for x in items):
            self.fail(f"{key!r} is not a list of tables.", f"Write [[{key}]] before each.")
        return [_TomlTable(self.path, f"{key} {k + 1}: ", x) for k, x in enumerate(items)]

    def table(self, key: str, allowed: tuple[str, ...]) -> "_TomlTable | None":
        item = self.value.get(key)
        if item is None:
            return None
        if not isinstance(item, dict):
            self.fail(f"{key!r} is not a table.", f"Allowed in it: {', '.join(allowed)}.")
        inner = _TomlTable(self.path, f"{self.where}{key}: ", item)
        inner.only(allowed)
        return inner

    def window(self) -> tuple[float, float]:
        start = self.number("from", 0.0, MAX_SCENE_DURATION_S) or 0.0
        end = self.number("to", 0.0, MAX_SCENE_DURATION_S)
        end = math.inf if end is None else end
        if end <= start:
            self.fail(f"it ends at {end} s, before it begins at {start} s.", "Swap from and to.")
        return start, end

    def text(self, key: str) -> str | None:
        x = self.value.get(key)
        if x is not None and (not isinstance(x, str) or not x.strip()):
            self.fail(f"{key!r} is {_shown(x)}, not a text.", "Put it in quotes.")
        return x

    def file(self, key: str) -> Path | None:
        name = self.text(key)
        return None if name is None else self.path.parent / name

    def number(self, key: str, low: float, high: float) -> float | None:
        x = self.value.get(key)
        if x is None:
            return None
        if not isinstance(x, int | float) or isinstance(x, bool) or not low <= x <= high:
            self.fail(f"{key!r} is {_shown(x)}.", f"Give a number from {low:g} to {high:g}.")
        return float(x)

    def whole(self, key: str, low: int, high: int) -> int | None:
        x = self.number(key, float(low), float(high))
        if x is None:
            return None
        if not x.is_integer():
            self.fail(f"{key!r} is {x}.", "Give a whole number.")
        return int(x)

    def flag(self, key: str) -> bool | None:
        x = self.value.get(key)
        if x is not None and not isinstance(x, bool):
            self.fail(f"{key!r} is {_shown(x)}.", "Write true or false.")
        return x

    def vector(self, key: str, most: float) -> Vector | None:
        x = self.value.get(key)
        if x is None:
            return None
        numbers = isinstance(x, list) and len(x) == 3
        if not numbers or not all(isinstance(c, int | float) and abs(c) <= most for c in x):
            step = f"Give three numbers, [x, y, z], each at most {most:g} in size."
            self.fail(f"{key!r} is {_shown(x)}.", step)
        return (float(x[0]), float(x[1]), float(x[2]))


def _shown(x: Any) -> str:
    text = repr(x)
    return text if len(text) <= 40 else text[:37] + "…"
