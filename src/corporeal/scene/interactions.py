"""What happens in a settled scene: who falls, is thrown, is pushed along, or stands in the wind.

The settled poses are certified at rest; an interaction changes the start of as few objects as it
can. Heights and speeds are drawn within ranges that scale with the scene, so that a scene of twice
the size plays the same film more slowly (Froude scaling): a height is a share of an object's size,
a speed a share of √(g L). What depends on masses and friction is found from them: how fast the
first of a row must go for the blow to reach the last, and in which wind something moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal, get_args

import numpy as np

from corporeal.core.types import GRAVITY, Vector, Wind
from corporeal.geometry.placing import lifted
from corporeal.io.scene_file import ObjectEntry
from corporeal.scene.arrange import Arrangement
from corporeal.scene.body import Body, Pose
from corporeal.scene.breeze import headings, wind_that_moves
from corporeal.scene.chain import chain
from corporeal.scene.standing import Standing, meet, size

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
"""How several objects may stand before it begins."""

FALL = (0.5, 1.5)
"""Height of a fall, over the falling object's own size."""
SPEED = (0.5, 0.9)
"""Speed on impact over √(g L), L the largest object's size: 1.1 to 2.0 m/s at half a metre."""
LIGHTEST = 0.5
"""What is sent into another has at least this share of its mass, where anything has: then what is
struck goes on with a third of the speed or more."""
APART = 0.1
"""Least way to what is struck, over the largest object's size: what is soft spreads as it comes to
bear its own weight before time 0 (a quilt of half a metre by 46 mm), and nothing strikes what it
touches already."""
WIND = (1.15, 1.35)
"""Speed of the wind over the slowest one that moves anything."""
STORM = 32.0
"""No wind is stronger: a violent storm (Beaufort 11) [m/s]."""
GUST = 0.3
BLOWS = 0.6
"""How long the wind blows [s]: what is light should not leave the picture."""
AFTER = 0.8
"""How long to go on watching after the first impact [s]."""


@dataclass(frozen=True)
class Action:
    """How a scene begins: entries for its scene file, and how long to watch."""

    kind: Kind
    entries: tuple[ObjectEntry, ...]
    duration: float
    """[s]"""
    words: str
    """What happens, for people."""


def act(
    bodies: Sequence[Body], poses: Sequence[Pose], kind: Kind, rng: np.random.Generator
) -> Action | None:
    """Begin an interaction in a settled scene.

    Args:
        bodies: What is in it.
        poses: Where each came to rest.
        kind: What is to happen.
        rng: Draws who, how high and how fast.

    Returns:
        None: there are too few objects, something stands in every path, or nothing here can do
        it: no storm moves anything, no blow reaches the last of the row.

    """
    if len(bodies) < NEEDS[kind]:
        return None
    begin = {
        "fall": _fall,
        "fall-onto": _fall_onto,
        "collision": _collision,
        "chain": _chain,
        "wind": _wind,
    }[kind]
    return begin(Standing(bodies, poses), rng)


# ---------------------------------------------------------------- falls


def _fall(still: Standing, rng: np.random.Generator) -> Action:
    """Hang everything above where it rests, what lies on top higher still."""
    share = float(rng.uniform(*FALL))
    rises = lifted(still.boxes, share)
    entries = [
        _at(name, still.foot(k) + np.array([0, 0, rise]))
        for k, (name, rise) in enumerate(zip(still.names, rises, strict=True))
    ]
    highest = float((still.boxes[:, 0, 2] + rises).max())
    words = f"everything falls to the ground, from up to {highest:.2g} m"
    return Action("fall", tuple(entries), _watch(sqrt(2 * highest / GRAVITY)), words)


def _fall_onto(still: Standing, rng: np.random.Generator) -> Action | None:
    """Hang one object above another: something light enough to have nothing resting on it."""
    boxes, names = still.boxes, still.names
    for top, target in sorted(_pairs(still, rng), key=lambda p: _grows(still, p)):
        height = float(rng.uniform(*FALL)) * size(boxes[top])
        over = still.foot(target)
        over[2] = boxes[target][1, 2] + height
        there = boxes[top] - still.foot(top) + over
        column = np.array([[*there[0, :2], boxes[target][1, 2]], there[1]])
        others = [k for k in range(len(boxes)) if k not in (top, target)]
        if still.free(top) and not any(meet(column, boxes[k]) for k in others):
            words = f"{names[top]} falls {height:.2g} m onto {names[target]}"
            entries = (_at(names[top], over),)
            return Action("fall-onto", entries, _watch(sqrt(2 * height / GRAVITY)), words)
    return None


# ---------------------------------------------------------------- along the floor


def _collision(still: Standing, rng: np.random.Generator) -> Action | None:
    """Send one object along the floor into another: one that is heavy enough to be felt.

    Friction leaves it the speed drawn when it arrives, v₀² = v² + 2 μ g d over the gap d; what
    rolls arrives faster. Nothing is sent into what stands nearer than ``APART``.
    """
    least = APART * float(still.sizes.max())
    for mover, target in sorted(_pairs(still, rng), key=lambda p: _weak(still, p)):
        if not (still.free(mover) and still.open_way(mover, target)):
            continue
        gap, heading = still.gap(mover, target)
        if gap >= least:
            arrival = _arrival(still, rng)
            start = sqrt(arrival**2 + 2 * still.bodies[mover].friction * GRAVITY * gap)
            entry = _sent(still.names[mover], start * heading)
            words = f"{still.names[mover]} is sent into {still.names[target]} at {start:.2g} m/s"
            return Action("collision", (entry,), _watch(2 * gap / (start + arrival)), words)
    return None


def _chain(still: Standing, rng: np.random.Generator) -> Action | None:
    """Send the object at one end of a row into its neighbour, and that one into the next."""
    blow = chain(still, _arrival(still, rng), rng)
    if blow is None:
        return None
    speed = float(np.linalg.norm(blow.velocity))
    mover, target = still.names[blow.mover], still.names[blow.target]
    words = f"{mover} is sent into {target} at {speed:.2g} m/s, and on along the row"
    return Action("chain", (_sent(mover, blow.velocity),), _watch(blow.arrives), words)


def _arrival(still: Standing, rng: np.random.Generator) -> float:
    return float(rng.uniform(*SPEED)) * sqrt(GRAVITY * float(still.sizes.max()))


# ---------------------------------------------------------------- wind


def _wind(still: Standing, rng: np.random.Generator) -> Action | None:
    """Let air blow on everything from one side, somewhat faster than what moves the easiest object.

    Of the objects that carry others nothing is expected.
    """
    share, first = float(rng.uniform(*WIND)), float(rng.uniform(0, 2 * np.pi))
    loose = [k for k in range(len(still)) if still.free(k)]
    for heading in headings(first):
        moving = [wind_that_moves(still.bodies[k], still.poses[k], heading) for k in loose]
        speed = share * min(moving, default=np.inf)
        if speed <= STORM:
            wind = Wind(_vector(speed * heading), GUST, end=BLOWS)
            entries = tuple(ObjectEntry(name=n, wind=wind) for n in still.names)
            words = f"a wind of {speed:.2g} m/s, in gusts, for {BLOWS:g} s"
            return Action("wind", entries, 1.5, words)
    return None


# ---------------------------------------------------------------- who, and how it is written


def _pairs(still: Standing, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Every ordered pair, in an order of chance."""
    n = len(still)
    pairs = [(a, b) for a in range(n) for b in range(n) if a != b]
    return [pairs[k] for k in rng.permutation(len(pairs))]


def _grows(still: Standing, pair: tuple[int, int]) -> bool:
    """Tell whether the first is larger than the second."""
    return bool(still.sizes[pair[0]] > still.sizes[pair[1]])


def _weak(still: Standing, pair: tuple[int, int]) -> tuple[bool, bool]:
    """Tell whether the first is too light to move the second, and whether it is larger."""
    mover, target = (still.bodies[k].mass for k in pair)
    return mover < LIGHTEST * target, _grows(still, pair)


def _at(name: str, foot: np.ndarray) -> ObjectEntry:
    x, y, z = (round(float(c), 6) for c in foot)
    return ObjectEntry(name=name, position=(x, y, z))


def _sent(name: str, velocity: np.ndarray) -> ObjectEntry:
    return ObjectEntry(name=name, velocity=_vector(velocity))


def _vector(across: np.ndarray) -> Vector:
    return (round(float(across[0]), 6), round(float(across[1]), 6), 0.0)


def _watch(until: float) -> float:
    """Return how long to film [s] when the last impact that counts comes after ``until``."""
    return round(min(max(until + AFTER, 1.0), 3.0), 2)
