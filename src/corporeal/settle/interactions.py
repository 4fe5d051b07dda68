"""What happens in a settled scene: who falls, is thrown, is pushed along, or stands in the wind.

The settled poses are certified at rest; an interaction changes the start of as few objects as it
can. Heights and speeds are drawn within ranges that scale with the scene, so that a scene of twice
the size plays the same film more slowly (Froude scaling): a height is a share of an object's size,
a speed a share of √(g L).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from corporeal.formats.scene_file import ObjectEntry
from corporeal.geometry.placing import lifted
from corporeal.settle.arrange import Arrangement
from corporeal.types import Vector, Wind

Kind = Literal["fall", "fall-onto", "collision", "chain", "wind"]
KINDS: tuple[Kind, ...] = get_args(Kind)
NEEDS: dict[Kind, int] = {"fall": 1, "wind": 1, "fall-onto": 2, "collision": 2, "chain": 3}
"""Fewest objects that an interaction takes."""
STANDING: dict[Kind, tuple[Arrangement, ...]] = {
    "fall": ("scatter", "stack", "onto"),
    "fall-onto": ("scatter", "row"),
    "collision": ("scatter", "row"),
    "chain": ("row",),
    "wind": ("scatter", "stack", "onto"),
}
"""How several things may stand before it begins."""

GRAVITY = 9.81
FALL = (0.5, 1.5)
"""Height of a fall, over the falling thing's own size."""
SPEED = (0.5, 0.9)
"""Speed on impact over √(g L), L the largest object's size: 1.1 to 2.0 m/s at half a metre."""
FRICTION = 0.6
"""Of the floor, as scenes are settled with: what slides arrives slower than it starts."""
WIND = (6.0, 12.0)
"""A fresh to a strong breeze (Beaufort 4 to 6) [m/s]."""
GUST = 0.3
CLEAR = 0.02
"""Free space kept beside what falls, over the larger thing's size."""
AFTER = 0.8
"""How long to go on watching after the first impact [s]."""

Boxes = Float[np.ndarray, "N 2 3"]


@dataclass(frozen=True)
class Action:
    """How a scene begins: entries for its scene file, and how long to watch."""

    kind: Kind
    entries: tuple[ObjectEntry, ...]
    duration: float
    """[s]"""
    words: str
    """What happens, for people."""


def act(boxes: Boxes, names: Sequence[str], kind: Kind, rng: np.random.Generator) -> Action | None:
    """Begin an interaction in a settled scene.

    Args:
        boxes: Lower and upper corner of every object at rest [m].
        names: Of the objects.
        kind: What is to happen.
        rng: Draws who, how high and how fast.

    Returns:
        None: there are too few objects, or something stands in every path.

    """
    if len(boxes) < NEEDS[kind]:
        return None
    begin = {
        "fall": _fall,
        "fall-onto": _fall_onto,
        "collision": _collision,
        "chain": _chain,
        "wind": _wind,
    }[kind]
    return begin(np.asarray(boxes, dtype=float), list(names), rng)


# ---------------------------------------------------------------- falls


def _fall(boxes: Boxes, names: list[str], rng: np.random.Generator) -> Action:
    """Hang everything above where it rests, what lies on top higher still."""
    share = float(rng.uniform(*FALL))
    rises = lifted(boxes, share)
    entries = [
        _at(n, _foot(b) + np.array([0, 0, r])) for n, b, r in zip(names, boxes, rises, strict=True)
    ]
    highest = float((boxes[:, 0, 2] + rises).max())
    words = f"everything falls to the ground, from up to {highest:.2g} m"
    return Action("fall", tuple(entries), _watch(sqrt(2 * highest / GRAVITY)), words)


def _fall_onto(boxes: Boxes, names: list[str], rng: np.random.Generator) -> Action | None:
    """Hang one thing above another: something light enough to have nothing resting on it."""
    for top, target in _pairs(boxes, rng):
        height = float(rng.uniform(*FALL)) * _size(boxes[top])
        over = _foot(boxes[target])
        over[2] = boxes[target][1, 2] + height
        there = boxes[top] - _foot(boxes[top]) + over
        column = np.array([[*there[0, :2], boxes[target][1, 2]], there[1]])
        others = [k for k in range(len(boxes)) if k not in (top, target)]
        if _free(boxes[top], boxes, top) and not any(_meet(column, boxes[k]) for k in others):
            words = f"{names[top]} falls {height:.2g} m onto {names[target]}"
            entries = (_at(names[top], over),)
            return Action("fall-onto", entries, _watch(sqrt(2 * height / GRAVITY)), words)
    return None


# ---------------------------------------------------------------- along the floor


def _collision(boxes: Boxes, names: list[str], rng: np.random.Generator) -> Action | None:
    """Send one thing along the floor into another."""
    for mover, target in _pairs(boxes, rng):
        way = _way(boxes, mover, target)
        if way is not None and _free(boxes[mover], boxes, mover):
            return _sent(boxes, names, (mover, target), rng, "collision")
    return None


def _chain(boxes: Boxes, names: list[str], rng: np.random.Generator) -> Action | None:
    """Send the thing at one end of a row into its neighbour, and that one into the next."""
    centres = boxes.mean(axis=1)[:, :2]
    along = np.linalg.svd(centres - centres.mean(axis=0))[2][0]
    order = [int(k) for k in np.argsort(centres @ along)]
    for row in (order, order[::-1]):
        if _way(boxes, row[0], row[1]) is not None and _free(boxes[row[0]], boxes, row[0]):
            return _sent(boxes, names, (row[0], row[1]), rng, "chain")
    return None


def _sent(
    boxes: Boxes, names: list[str], pair: tuple[int, int], rng: np.random.Generator, kind: Kind
) -> Action:
    """Start a thing so fast that friction leaves it the speed drawn when it arrives.

    v₀² = v² + 2 μ g d over the gap d; what rolls arrives faster.
    """
    mover, target = pair
    gap, heading = _gap(boxes, mover, target)
    arrival = float(rng.uniform(*SPEED)) * sqrt(GRAVITY * max(map(_size, boxes)))
    start = sqrt(arrival**2 + 2 * FRICTION * GRAVITY * gap)
    velocity = _vector(start * heading)
    entry = ObjectEntry(name=names[mover], velocity=velocity)
    words = f"{names[mover]} is sent into {names[target]} at {start:.2g} m/s"
    if kind == "chain":
        words += ", and on along the row"
    return Action(kind, (entry,), _watch(2 * gap / (start + arrival), long=kind == "chain"), words)


def _way(boxes: Boxes, mover: int, target: int) -> Float[np.ndarray, "2"] | None:
    """Return the direction along the floor in which the way to the target is free."""
    if not _level(boxes[mover], boxes[target]):
        return None
    gap, heading = _gap(boxes, mover, target)
    others = [k for k in range(len(boxes)) if k not in (mover, target)]
    for way in np.linspace(0.0, gap, 33):
        swept = boxes[mover] + np.array([*(way * heading), 0.0])
        if any(_meet(swept, boxes[k], margin=0.0) for k in others):
            return None
    return heading


def _gap(boxes: Boxes, mover: int, target: int) -> tuple[float, np.ndarray]:
    """Return how far the mover slides before it touches [m], and where to; boxes stand for both."""
    here, there = (boxes[k].mean(axis=0)[:2] for k in (mover, target))
    reach = np.linalg.norm(there - here)
    heading = (there - here) / max(float(reach), 1e-9)
    apart = np.maximum(boxes[target][0] - boxes[mover][1], boxes[mover][0] - boxes[target][1])[:2]
    shares = [a / abs(h) for a, h in zip(apart, heading, strict=True) if abs(h) > 1e-9]
    return max(0.0, *shares), heading


# ---------------------------------------------------------------- wind


def _wind(boxes: Boxes, names: list[str], rng: np.random.Generator) -> Action:
    """Let a breeze blow on everything from one side."""
    speed, angle = float(rng.uniform(*WIND)), float(rng.uniform(0, 2 * np.pi))
    air = _vector(speed * np.array([np.cos(angle), np.sin(angle)]))
    entries = tuple(ObjectEntry(name=n, wind=Wind(air, GUST)) for n in names)
    return Action("wind", entries, 1.5, f"a wind of {speed:.2g} m/s, in gusts")


# ---------------------------------------------------------------- boxes


def _pairs(boxes: Boxes, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Every ordered pair, in an order of chance, the smaller thing acting first of all."""
    n = len(boxes)
    pairs = [(a, b) for a in range(n) for b in range(n) if a != b]
    pairs = [pairs[k] for k in rng.permutation(len(pairs))]
    return sorted(pairs, key=lambda p: _size(boxes[p[0]]) > _size(boxes[p[1]]))


def _size(box: np.ndarray) -> float:
    return float((box[1] - box[0]).max())


def _foot(box: np.ndarray) -> np.ndarray:
    """Return the middle of a box's underside."""
    return np.array([*box.mean(axis=0)[:2], box[0, 2]])


def _at(name: str, foot: np.ndarray) -> ObjectEntry:
    x, y, z = (round(float(c), 6) for c in foot)
    return ObjectEntry(name=name, position=(x, y, z))


def _vector(across: np.ndarray) -> Vector:
    return (round(float(across[0]), 6), round(float(across[1]), 6), 0.0)


def _meet(a: np.ndarray, b: np.ndarray, margin: float = CLEAR) -> bool:
    space = margin * max(_size(a), _size(b))
    return bool(((a[0] - space < b[1]) & (b[0] - space < a[1])).all())


def _level(a: np.ndarray, b: np.ndarray) -> bool:
    """Tell whether two things stand on one support and one could run into the other."""
    shared = min(a[1, 2], b[1, 2]) - max(a[0, 2], b[0, 2])
    return bool(shared > 0.3 * min(a[1, 2] - a[0, 2], b[1, 2] - b[0, 2]))


def _free(box: np.ndarray, boxes: Boxes, own: int) -> bool:
    """Tell whether nothing lies on a thing, so that it may leave its place."""
    above = np.array([[*box[0, :2], box[1, 2]], [*box[1, :2], np.inf]])
    touching = [
        bool(((above[0] - 1e-3 < b[1]) & (b[0] < above[1])).all() and b[0, 2] > box.mean(0)[2])
        for k, b in enumerate(boxes)
        if k != own
    ]
    return not any(touching)


def _watch(until: float, long: bool = False) -> float:
    """Return how long to film [s] when the first impact comes after ``until``."""
    return round(min(max(until + AFTER * (1.5 if long else 1.0), 1.0), 3.0), 2)
