"""Interactions of a settled scene: drop, throw, slide, wind.

The settled poses are certified at rest; an interaction changes the start of as few objects as it can. Heights and
speeds are drawn within ranges that scale with the scene, so that a scene of twice the size plays the same video more
slowly (Froude scaling): a height is a share of an object's size, a speed a share of √(g L). What depends on masses and
friction is found from them: how fast the first of a row must go for the impact to reach the last, and in which wind
something moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal, get_args

import numpy as np

from corporeal.core.types import GRAVITY_M_S2, Vector, Wind
from corporeal.geometry.box_placement import lift_heights
from corporeal.io.scene_toml import ObjectEntry
from corporeal.scene.arrange_bodies import BodyArrangement
from corporeal.scene.collision_chain import find_collision_chain
from corporeal.scene.settled_bodies import SettledBodies, boxes_meet, largest_box_side
from corporeal.scene.settling_body import BodyPose, SettlingBody
from corporeal.scene.wind_threshold import wind_headings, wind_threshold

InteractionKind = Literal["fall", "fall-onto", "collision", "chain", "wind"]
INTERACTION_KINDS: tuple[InteractionKind, ...] = get_args(InteractionKind)
MIN_OBJECTS_OF_KIND: dict[InteractionKind, int] = {"fall": 1, "wind": 1, "fall-onto": 2, "collision": 2, "chain": 3}
"""Fewest objects that an interaction takes."""
ARRANGEMENTS_OF_KIND: dict[InteractionKind, tuple[BodyArrangement, ...]] = {
    "fall": ("scatter", "stack", "onto"),
    "fall-onto": ("scatter", "row"),
    "collision": ("scatter", "row"),
    "chain": ("row",),
    "wind": ("scatter", "stack", "onto"),
}
"""How several objects may stand before it begins."""

FALL_HEIGHT_SIZES_RANGE = (0.5, 1.5)
"""Height of a fall, over the falling object's own size."""
IMPACT_SPEED_RATIO_RANGE = (0.5, 0.9)
"""Speed on impact over √(g L), L the largest object's size: 1.1 to 2.0 m/s at half a metre."""
MIN_MOVER_MASS_RATIO = 0.5
"""What is sent into another has at least this share of its mass, where anything has: then what is struck goes on with a
third of the speed or more."""
MIN_APPROACH_SIZE_FRACTION = 0.1
"""Least way to what is struck, over the largest object's size: what is soft spreads as it comes to bear its own weight
before time 0 (a quilt of half a metre by 46 mm), and nothing strikes what it touches already."""
WIND_SPEED_RATIO_RANGE = (1.15, 1.35)
"""Speed of the wind over the slowest one that moves anything."""
MAX_WIND_SPEED_M_S = 32.0
"""No wind is stronger: a violent storm (Beaufort 11) [m/s]."""
WIND_GUST_FRACTION = 0.3
WIND_DURATION_S = 0.6
"""Duration of the wind [s]: what is light should not leave the picture."""
WATCH_AFTER_IMPACT_S = 0.8
"""How long to go on watching after the first impact [s]."""


@dataclass(frozen=True)
class SceneInteraction:
    """How a scene begins: entries for its scene file, and how long to watch."""

    kind: InteractionKind
    entries: tuple[ObjectEntry, ...]
    duration: float
    """[s]"""
    words: str
    """What happens, for people."""


def begin_interaction(
    bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], kind: InteractionKind, rng: np.random.Generator
) -> SceneInteraction | None:
    """Begin an interaction in a settled scene.

    Returns:
        None: there are too few objects, something stands in every path, or nothing here can do
        it: no storm moves anything, no impact reaches the last of the row.
    """
    if len(bodies) < MIN_OBJECTS_OF_KIND[kind]:
        return None
    begin = {
        "fall": _begin_fall,
        "fall-onto": _begin_fall_onto,
        "collision": _begin_collision,
        "chain": _begin_chain,
        "wind": _begin_wind,
    }[kind]
    return begin(SettledBodies(bodies, poses), rng)


def _begin_fall(still: SettledBodies, rng: np.random.Generator) -> SceneInteraction:
    """Hang everything above where it rests, what lies on top higher still."""
    share = float(rng.uniform(*FALL_HEIGHT_SIZES_RANGE))
    rises = lift_heights(still.boxes, share)
    entries = [
        _entry_at(name, still.foot(k) + np.array([0, 0, rise]))
        for k, (name, rise) in enumerate(zip(still.names, rises, strict=True))
    ]
    highest = float((still.boxes[:, 0, 2] + rises).max())
    words = f"everything falls to the ground, from up to {highest:.2g} m"
    return SceneInteraction("fall", tuple(entries), _watch_duration(sqrt(2 * highest / GRAVITY_M_S2)), words)


def _begin_fall_onto(still: SettledBodies, rng: np.random.Generator) -> SceneInteraction | None:
    """Hang one object above another: something light enough to have nothing resting on it."""
    boxes, names = still.boxes, still.names
    for top, target in sorted(_ordered_pairs(still, rng), key=lambda p: _is_mover_larger(still, p)):
        height = float(rng.uniform(*FALL_HEIGHT_SIZES_RANGE)) * largest_box_side(boxes[top])
        over = still.foot(target)
        over[2] = boxes[target][1, 2] + height
        there = boxes[top] - still.foot(top) + over
        column = np.array([[*there[0, :2], boxes[target][1, 2]], there[1]])
        others = [k for k in range(len(boxes)) if k not in (top, target)]
        if still.free(top) and not any(boxes_meet(column, boxes[k]) for k in others):
            words = f"{names[top]} falls {height:.2g} m onto {names[target]}"
            entries = (_entry_at(names[top], over),)
            return SceneInteraction("fall-onto", entries, _watch_duration(sqrt(2 * height / GRAVITY_M_S2)), words)
    return None


def _begin_collision(still: SettledBodies, rng: np.random.Generator) -> SceneInteraction | None:
    """Send one object along the floor into another: one that is heavy enough to be felt.

    Friction leaves it the speed drawn when it arrives, v₀² = v² + 2 μ g d over the gap d; what rolls arrives faster.
    Nothing is sent into what stands nearer than ``MIN_APPROACH_SIZE_FRACTION``.
    """
    least = MIN_APPROACH_SIZE_FRACTION * float(still.sizes.max())
    for mover, target in sorted(_ordered_pairs(still, rng), key=lambda p: _is_mover_too_light(still, p)):
        if not (still.free(mover) and still.open_way(mover, target)):
            continue
        gap, heading = still.gap(mover, target)
        if gap >= least:
            arrival = _arrival_speed(still, rng)
            start = sqrt(arrival**2 + 2 * still.bodies[mover].friction * GRAVITY_M_S2 * gap)
            entry = _entry_with_velocity(still.names[mover], start * heading)
            words = f"{still.names[mover]} is sent into {still.names[target]} at {start:.2g} m/s"
            return SceneInteraction("collision", (entry,), _watch_duration(2 * gap / (start + arrival)), words)
    return None


def _begin_chain(still: SettledBodies, rng: np.random.Generator) -> SceneInteraction | None:
    """Send the object at one end of a row into its neighbour, and that one into the next."""
    chain = find_collision_chain(still, _arrival_speed(still, rng), rng)
    if chain is None:
        return None
    speed = float(np.linalg.norm(chain.velocity))
    mover, target = still.names[chain.mover], still.names[chain.target]
    words = f"{mover} is sent into {target} at {speed:.2g} m/s, and on along the row"
    return SceneInteraction(
        "chain", (_entry_with_velocity(mover, chain.velocity),), _watch_duration(chain.arrives), words
    )


def _arrival_speed(still: SettledBodies, rng: np.random.Generator) -> float:
    return float(rng.uniform(*IMPACT_SPEED_RATIO_RANGE)) * sqrt(GRAVITY_M_S2 * float(still.sizes.max()))


def _begin_wind(still: SettledBodies, rng: np.random.Generator) -> SceneInteraction | None:
    """Apply wind to everything from one side, somewhat faster than what moves the easiest object.

    Of the objects that carry others nothing is expected.
    """
    share, first = float(rng.uniform(*WIND_SPEED_RATIO_RANGE)), float(rng.uniform(0, 2 * np.pi))
    loose = [k for k in range(len(still)) if still.free(k)]
    for heading in wind_headings(first):
        moving = [wind_threshold(still.bodies[k], still.poses[k], heading) for k in loose]
        speed = share * min(moving, default=np.inf)
        if speed <= MAX_WIND_SPEED_M_S:
            wind = Wind(_horizontal_vector(speed * heading), WIND_GUST_FRACTION, end=WIND_DURATION_S)
            entries = tuple(ObjectEntry(name=n, wind=wind) for n in still.names)
            words = f"a wind of {speed:.2g} m/s, in gusts, for {WIND_DURATION_S:g} s"
            return SceneInteraction("wind", entries, 1.5, words)
    return None


def _ordered_pairs(still: SettledBodies, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Every ordered pair, in an order of chance."""
    n = len(still)
    pairs = [(a, b) for a in range(n) for b in range(n) if a != b]
    return [pairs[k] for k in rng.permutation(len(pairs))]


def _is_mover_larger(still: SettledBodies, pair: tuple[int, int]) -> bool:
    """Return whether the first is larger than the second."""
    return bool(still.sizes[pair[0]] > still.sizes[pair[1]])


def _is_mover_too_light(still: SettledBodies, pair: tuple[int, int]) -> tuple[bool, bool]:
    """Return whether the first is too light to move the second, and whether it is larger."""
    mover, target = (still.bodies[k].mass for k in pair)
    return mover < MIN_MOVER_MASS_RATIO * target, _is_mover_larger(still, pair)


def _entry_at(name: str, foot: np.ndarray) -> ObjectEntry:
    x, y, z = (round(float(c), 6) for c in foot)
    return ObjectEntry(name=name, position=(x, y, z))


def _entry_with_velocity(name: str, velocity: np.ndarray) -> ObjectEntry:
    return ObjectEntry(name=name, velocity=_horizontal_vector(velocity))


def _horizontal_vector(across: np.ndarray) -> Vector:
    return (round(float(across[0]), 6), round(float(across[1]), 6), 0.0)


def _watch_duration(until: float) -> float:
    """Return the duration of the scene [s] when the last impact that counts comes after ``until``."""
    return round(min(max(until + WATCH_AFTER_IMPACT_S, 1.0), 3.0), 2)
