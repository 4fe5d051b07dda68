"""Arrange, settle, certify; again from another seed where it failed."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from corporeal.errors import UserError
from corporeal.settle.arrange import Arrangement, arrange
from corporeal.settle.body import Body, Pose
from corporeal.settle.certificate import Certificate, examine
from corporeal.settle.mujoco import SettleConfig, settle


@dataclass(frozen=True)
class RestConfig:
    """How hard to try."""

    attempts: int = 8
    settle: SettleConfig = field(default_factory=SettleConfig)


DEFAULT = RestConfig()


def at_rest(
    bodies: Sequence[Body],
    arrangement: Arrangement,
    seed: int,
    deepest: float,
    config: RestConfig = DEFAULT,
) -> tuple[list[Pose], Certificate]:
    """Bring bodies to rest on the floor z = 0 and on each other, around the origin.

    Args:
        bodies: At least one.
        arrangement: How they begin.
        seed: The same seed gives the same poses, bit by bit.
        deepest: Penetration allowed between the meshes [m].
        config: How hard to try.

    Raises:
        UserError: No attempt came to rest; it says why.

    """
    if not bodies:
        raise UserError("There is nothing to settle. Give at least one body.")
    begun = time.perf_counter()
    reason = ""
    for attempt in range(config.attempts):
        rng = np.random.default_rng([seed, attempt])
        settled = settle(bodies, arrange(bodies, arrangement, rng), config.settle)
        if not settled.quiet:
            reason = f"it still moved after {settled.seconds:.0f} s"
            continue
        poses = _around_origin(bodies, settled.poses)
        evidence = examine(bodies, poses)
        objections = evidence.objections(deepest)
        if not objections:
            certificate = Certificate(
                drift_m=evidence.drift,
                penetration_m=evidence.penetration,
                extent_m=evidence.extent,
                seed=seed,
                attempts=attempt + 1,
                seconds=time.perf_counter() - begun,
                objects=len(bodies),
                hover_m=evidence.hover,
            )
            return poses, certificate
        reason = " and ".join(objections)
    names = ", ".join(b.name for b in bodies)
    raise UserError(
        f"{names}: no rest found as a {arrangement} in {config.attempts} attempts; in the last one "
        f"{reason}. Try another seed, another arrangement or fewer objects."
    )


def _around_origin(bodies: Sequence[Body], poses: Sequence[Pose]) -> list[Pose]:
    all_points = [p.world(b.hull.vertices) for b, p in zip(bodies, poses, strict=True)]
    points = np.concatenate(all_points)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return [p.moved((-middle[0], -middle[1], 0.0)) for p in poses]
