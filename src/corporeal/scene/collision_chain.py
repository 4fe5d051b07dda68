"""Initial speed of a chain of collisions, so that the impact reaches the last object.

Backwards along the row: what slides a way d arrives with v² = v₀² - 2 μ g d, and goes on together with what it strikes,
M v/(M + m): impacts without a bounce. Where heavy objects come first that takes the least speed; from the light end it
may take too much. Then the row is played with rigid bodies, for hits beside the middle, and for objects that turn,
topple or roll.

Rigid-body preview of an interaction, to find contacts and their times.

The engine's contacts are soft and take the bounce out of impacts, so that less momentum is passed on than in reality:
so it is a lower bound.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from corporeal.core.types import GRAVITY_M_S2
from corporeal.scene.settle_mujoco import MujocoScene
from corporeal.scene.settled_bodies import SettledBodies

PREVIEW_STEP_S = 1e-3
"""In a scene of unit size [s]."""
TOUCHING_DISTANCE_UNITS = 1e-3
"""What is no farther apart at the start touches [unit]."""
PREVIEW_REST_SPEED_M_S = 0.02
"""What goes no faster in a scene of unit size has come to rest [m/s]."""

ObjectKey = TypeVar("ObjectKey", bound=Hashable)


@dataclass(frozen=True)
class PreviewContact:
    """Two objects that were apart touch for the first time."""

    a: int
    b: int
    instant: float
    """[s]"""


def preview_contacts(
    still: SettledBodies, velocity: Mapping[int, Float[np.ndarray, "2"]], longest: float
) -> list[PreviewContact]:
    """Send objects off along the floor and see who meets whom.

    Args:
        still: Where all stand.
        velocity: Of those that are sent [m/s].
        longest: How long to watch [s].

    Returns:
        In the order in which they met; what touches at the start is left out.
    """
    engine = MujocoScene(still.bodies, still.poses, PREVIEW_STEP_S)
    engine.roughen([b.friction for b in still.bodies])
    touching = engine.near(TOUCHING_DISTANCE_UNITS)
    for k, v in velocity.items():
        engine.send(k, v)
    met: dict[tuple[int, int], float] = {}
    for number in range(1, round(longest / sqrt(engine.unit) / PREVIEW_STEP_S) + 1):
        engine.step()
        for pair in engine.touching() - touching:
            met.setdefault(pair, number * PREVIEW_STEP_S * sqrt(engine.unit))
        if engine.speed() < PREVIEW_REST_SPEED_M_S:
            break
    return [PreviewContact(*pair, met[pair]) for pair in sorted(met, key=lambda p: (met[p], p))]


def impact_hops(met: Sequence[Sequence[ObjectKey]], sent: Sequence[ObjectKey]) -> dict[ObjectKey, int]:
    """Count how far an impact was passed on: 1 for what was struck, 2 for what that struck."""
    reached = dict.fromkeys(sent, 0)
    for a, b in met:
        for one, other in ((a, b), (b, a)):
            if one in reached and other not in reached:
                reached[other] = reached[one] + 1
                break
    return reached


LAST_IMPACT_SPEED_RATIO_RANGE = (0.15, 0.3)
"""Speed with which the last of the row is struck, over √(g L)."""
MAX_START_SPEED_RATIO = 3.0
"""Nothing is sent off faster, over √(g L): 6.6 m/s where the largest object is half a metre."""
SLOW_SPEED_FRACTION = 0.8
"""The row must pass the impact on even from this share of the speed."""
SPEED_RAISE_FACTOR = 1.25
"""By how much a speed that did not do is raised."""
MAX_CHAIN_S = 2.0
"""How long a row is played [s]."""


@dataclass(frozen=True)
class ChainStart:
    """What sets off a chain."""

    mover: int
    target: int
    velocity: Float[np.ndarray, "2"]
    """Along the floor [m/s]."""
    arrives: float
    """When it reaches the last [s]."""


def find_collision_chain(still: SettledBodies, arrival: float, rng: np.random.Generator) -> ChainStart | None:
    """Find the end and the speed from which an impact reaches the last of a row.

    Args:
        still: Three objects or more, in a row.
        arrival: Speed with which the second is struck at least [m/s].
        rng: Draws how fast the last is struck.

    Returns:
        None: from neither end.
    """
    scale = sqrt(GRAVITY_M_S2 * float(still.sizes.max()))
    last = float(rng.uniform(*LAST_IMPACT_SPEED_RATIO_RANGE)) * scale
    starts = [(chain_start_speed(still, row, arrival, last), row) for row in _possible_rows(still)]
    for speed, row in sorted(starts):
        while speed <= MAX_START_SPEED_RATIO * scale:
            chain = _preview_chain(still, row, speed)
            if chain:
                return chain
            speed *= SPEED_RAISE_FACTOR
    return None


def chain_start_speed(still: SettledBodies, row: Sequence[int], arrival: float, last: float) -> float:
    """Return the speed of the first that strikes the second and the last fast enough [m/s].

    Args:
        still: Where all stand.
        row: Numbers of the objects, the mover first.
        arrival: Least speed at the second [m/s].
        last: Least speed at the last [m/s].
    """
    bodies = [still.bodies[k] for k in row]
    mass = np.cumsum([b.mass for b in bodies])
    rough = np.cumsum([b.mass * b.friction for b in bodies]) / mass
    speed = last
    for k in reversed(range(len(row) - 1)):
        arriving = max(speed, arrival) if k == 0 else speed
        gap, _ = still.gap(row[k], row[k + 1])
        speed = sqrt(arriving**2 + 2 * float(rough[k]) * GRAVITY_M_S2 * gap)
        speed *= float(mass[k] / mass[k - 1]) if k > 0 else 1.0
    return speed


def _possible_rows(still: SettledBodies) -> list[list[int]]:
    """Return the row from either end, where the first can be sent into the second."""
    across = still.centres[:, :2] - still.centres[:, :2].mean(axis=0)
    along = np.linalg.svd(across)[2][0]
    order = [int(k) for k in np.argsort(across @ along)]
    both = (order, order[::-1])
    return [r for r in both if still.free(r[0]) and still.open_way(r[0], r[1])]


def _preview_chain(still: SettledBodies, row: Sequence[int], speed: float) -> ChainStart | None:
    """Play a chain, and play it slower; None: it broke off."""
    _, heading = still.gap(row[0], row[1])
    arrives = 0.0
    for share in (SLOW_SPEED_FRACTION, 1.0):
        met = preview_contacts(still, {row[0]: share * speed * heading}, MAX_CHAIN_S)
        reached = impact_hops([(m.a, m.b) for m in met], row[:1])
        if reached.get(row[-1], 0) < 2 or len(reached) < len(row):
            return None
        arrives = max(m.instant for m in met if row[-1] in (m.a, m.b))
    return ChainStart(row[0], row[1], speed * heading, arrives)
