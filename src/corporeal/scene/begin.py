"""Settle objects until they rest so that what is to happen can happen."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from corporeal.core.errors import UserError
from corporeal.scene.arrange import Arrangement
from corporeal.scene.blender import BlenderError
from corporeal.scene.body import Body, Pose
from corporeal.scene.certificate import Certificate
from corporeal.scene.interactions import STANDING, STORM, Action, Kind, act
from corporeal.scene.rest import RestConfig, at_rest

TRIES = 6
"""Compositions that are settled until one leaves room for its interaction."""


@dataclass(frozen=True)
class Begun:
    """Objects at rest, and what happens then."""

    poses: list[Pose]
    arrangement: Arrangement
    action: Action | None
    certificate: Certificate


def drop_and_begin(
    bodies: Sequence[Body],
    arrangement: Arrangement | Literal["auto"],
    kinds: Sequence[Kind],
    rng: np.random.Generator,
    deepest: float,
    config: RestConfig,
) -> Begun:
    """Settle until objects rest and one of some interactions is possible.

    Where nobody asked for an arrangement, another one is tried when one finds no rest.

    Args:
        bodies: What there is.
        arrangement: How it begins to fall.
        kinds: What may happen, best first; none: nothing is to.
        rng: Of everything that is left to chance.
        deepest: Penetration allowed [m].
        config: How hard to try.

    Raises:
        UserError: No rest is found, or nothing can happen.

    """
    ways = _arrangements(arrangement, kinds, len(bodies), rng)
    reason = ""
    for k in range(TRIES):
        way = ways[k % len(ways)]
        try:
            poses, certificate = at_rest(bodies, way, int(rng.integers(2**31)), deepest, config)
        except BlenderError:
            raise
        except UserError as refusal:
            reason = str(refusal)
            ways.remove(way)
            if not ways:
                break
            continue
        if not kinds:
            return Begun(poses, way, None, certificate)
        begun = (act(bodies, poses, kind, rng) for kind in _fitting(kinds, way))
        action = next((a for a in begun if a), None)
        if action is not None:
            return Begun(poses, way, action, certificate)
    names = ", ".join(b.name for b in bodies)
    raise UserError(
        reason
        or f"{names}: {_why_not(kinds[0])} in {TRIES} compositions. Try another --seed, another "
        "--interaction, or other objects."
    )


def _arrangements(
    asked: Arrangement | Literal["auto"],
    kinds: Sequence[Kind],
    count: int,
    rng: np.random.Generator,
) -> list[Arrangement]:
    """Return the ways in which objects may stand, in an order of chance."""
    if asked != "auto":
        return [asked]
    if count == 1:
        return ["scatter"]
    ways: Sequence[Arrangement] = STANDING[kinds[0]] if kinds else get_args(Arrangement)
    return [ways[k] for k in rng.permutation(len(ways))]


def _fitting(kinds: Sequence[Kind], arrangement: Arrangement) -> list[Kind]:
    """Keep what may happen to objects that stand so; the first may, however they stand."""
    return [kinds[0], *(k for k in kinds[1:] if arrangement in STANDING[k])]


def _why_not(kind: Kind) -> str:
    reasons = {
        "wind": f"no wind of up to {STORM:g} m/s moves anything",
        "chain": "no blow reaches the last of the row",
    }
    return reasons.get(kind, f"no room for a {kind}")
