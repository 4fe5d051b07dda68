"""Settling of objects until one of the wanted interactions is possible."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from corporeal.core.errors import UserError
from corporeal.scene.arrange_bodies import BodyArrangement
from corporeal.scene.interactions import (
    ARRANGEMENTS_OF_KIND,
    MAX_WIND_SPEED_M_S,
    InteractionKind,
    SceneInteraction,
    begin_interaction,
)
from corporeal.scene.rest_certificate import RestCertificate
from corporeal.scene.settle_blender import BlenderError
from corporeal.scene.settle_bodies import SettleConfig, settle_bodies
from corporeal.scene.settling_body import BodyPose, SettlingBody

MAX_SETTLED_COMPOSITIONS = 6
"""Compositions that are settled until one leaves room for its interaction."""


@dataclass(frozen=True)
class SettledInteraction:
    """Objects at rest, and what happens then."""

    poses: list[BodyPose]
    arrangement: BodyArrangement
    action: SceneInteraction | None
    certificate: RestCertificate


def settle_for_interaction(
    bodies: Sequence[SettlingBody],
    arrangement: BodyArrangement | Literal["auto"],
    kinds: Sequence[InteractionKind],
    rng: np.random.Generator,
    deepest: float,
    config: SettleConfig,
) -> SettledInteraction:
    """Settle until objects rest and one of some interactions is possible.

    Without a given arrangement, another one is tried if no rest is found.

    Args:
        bodies: What there is.
        arrangement: How it begins to fall.
        kinds: What may happen, best first; none: nothing is to.
        rng: Source of random numbers.
        deepest: Penetration allowed [m].
        config: How hard to try.

    Raises:
        UserError: No rest is found, or nothing can happen.
    """
    ways = _possible_arrangements(arrangement, kinds, len(bodies), rng)
    reason = ""
    for k in range(MAX_SETTLED_COMPOSITIONS):
        way = ways[k % len(ways)]
        try:
            poses, certificate = settle_bodies(bodies, way, int(rng.integers(2**31)), deepest, config)
        except BlenderError:
            raise
        except UserError as refusal:
            reason = str(refusal)
            ways.remove(way)
            if not ways:
                break
            continue
        if not kinds:
            return SettledInteraction(poses, way, None, certificate)
        begun = (begin_interaction(bodies, poses, kind, rng) for kind in _fitting_kinds(kinds, way))
        action = next((a for a in begun if a), None)
        if action is not None:
            return SettledInteraction(poses, way, action, certificate)
    names = ", ".join(b.name for b in bodies)
    raise UserError(
        reason
        or f"{names}: {_why_impossible(kinds[0])} in {MAX_SETTLED_COMPOSITIONS} compositions. "
        "Try another --seed, another "
        "--interaction, or other objects."
    )


def _possible_arrangements(
    asked: BodyArrangement | Literal["auto"], kinds: Sequence[InteractionKind], count: int, rng: np.random.Generator
) -> list[BodyArrangement]:
    """Return the ways in which objects may stand, in an order of chance."""
    if asked != "auto":
        return [asked]
    if count == 1:
        return ["scatter"]
    ways: Sequence[BodyArrangement] = ARRANGEMENTS_OF_KIND[kinds[0]] if kinds else get_args(BodyArrangement)
    return [ways[k] for k in rng.permutation(len(ways))]


def _fitting_kinds(kinds: Sequence[InteractionKind], arrangement: BodyArrangement) -> list[InteractionKind]:
    """Keep what may happen to objects that stand so; the first may, however they stand."""
    return [kinds[0], *(k for k in kinds[1:] if arrangement in ARRANGEMENTS_OF_KIND[k])]


def _why_impossible(kind: InteractionKind) -> str:
    reasons = {
        "wind": f"no wind of up to {MAX_WIND_SPEED_M_S:g} m/s moves anything",
        "chain": "no impact reaches the last of the row",
    }
    return reasons.get(kind, f"no room for a {kind}")
