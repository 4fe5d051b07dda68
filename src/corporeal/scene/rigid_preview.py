"""Rigid-body preview of an interaction, to find contacts and their times.

The engine's contacts are soft and take the bounce out of impacts, so that less momentum is passed
on than in reality: so it is a lower bound.
"""

# The engine's names come from compiled modules without stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TypeVar

import numpy as np
from jaxtyping import Float

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


def impact_hops(
    met: Sequence[Sequence[ObjectKey]], sent: Sequence[ObjectKey]
) -> dict[ObjectKey, int]:
    """Count how far an impact was passed on: 1 for what was struck, 2 for what that struck.

    Args:
        met: Pairs in the order in which they met.
        sent: What was moving at the start.

    """
    reached = dict.fromkeys(sent, 0)
    for a, b in met:
        for one, other in ((a, b), (b, a)):
            if one in reached and other not in reached:
                reached[other] = reached[one] + 1
                break
    return reached
