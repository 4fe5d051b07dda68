"""Arrange, settle, certify; again from another seed where it failed."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.registry import load
from corporeal.scene.arrange import Arrangement, arrange
from corporeal.scene.blender import BlenderConfig
from corporeal.scene.body import Body, Pose, unit_of
from corporeal.scene.certificate import Certificate, Evidence, examine
from corporeal.scene.mujoco import DropConfig, Dropped

SettlingEngine = Literal["mujoco", "blenderproc"]
ENGINES = {
    "mujoco": "corporeal.scene.mujoco:drop",
    "blenderproc": "corporeal.scene.blender:drop_in_blender",
}

STRAY = 0.75
"""How far along the floor a body may end from where it started, of the scene's unit."""
PILES: tuple[Arrangement, ...] = ("stack", "onto")
"""Arrangements in which something is meant to lie on something else."""
PILINGS = 3
"""Attempts at that; then a pile that fell apart and came to rest is taken."""


@dataclass(frozen=True)
class RestConfig:
    """How hard to try."""

    attempts: int = 8
    engine: SettlingEngine = "mujoco"
    """What lets objects fall; the certificate is the same for both."""
    drop: DropConfig = field(default_factory=DropConfig)
    """In MuJoCo."""
    blender: BlenderConfig = field(default_factory=BlenderConfig)
    """In Blender, through BlenderProc."""


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
        seed: The same seed gives the same poses, with MuJoCo bit by bit.
        deepest: Penetration allowed between the meshes [m].
        config: How hard to try.

    Raises:
        UserError: No attempt came to rest, or BlenderProc does not work; it says why.

    """
    if not bodies:
        raise UserError("There is nothing to settle. Give at least one body.")
    begun = time.perf_counter()
    reasons: list[str] = []
    first: tuple[list[Pose], Certificate] | None = None
    wants_pile = arrangement in PILES and len(bodies) > 1
    for attempt in range(config.attempts):
        rng = np.random.default_rng([seed, attempt])
        start = arrange(bodies, arrangement, rng)
        dropped = _dropped(bodies, start, config)
        evidence = None
        reason = _lost(bodies, start, dropped)
        poses = _around_origin(bodies, dropped.poses)
        if not reason:
            evidence = examine(bodies, poses, deepest)
            reason = " and ".join(evidence.objections)
        if reason or evidence is None:
            reasons.append(reason)
        else:
            seconds = time.perf_counter() - begun
            found = poses, _certificate(evidence, seed, attempt + 1, seconds)
            if not wants_pile or evidence.lifted:
                return found
            first = first or found
        if first and attempt + 1 >= PILINGS:
            return first[0], replace(first[1], attempts=attempt + 1)
    names = ", ".join(b.name for b in bodies)
    raise UserError(
        f"{names}: no rest found as a {arrangement} in {config.attempts} attempts; in the last one "
        f"{reasons[-1]}. Try another seed, another arrangement or fewer objects."
    )


def _dropped(bodies: Sequence[Body], start: Sequence[Pose], config: RestConfig) -> Dropped:
    drop = load("settling engine", config.engine, ENGINES)
    return drop(bodies, start, config.blender if config.engine == "blenderproc" else config.drop)


def _lost(bodies: Sequence[Body], start: Sequence[Pose], dropped: Dropped) -> str:
    """Say why bodies are not worth examining; "": they are."""
    if not dropped.quiet:
        return f"something still moved after {dropped.seconds:.0f} s"
    far = STRAY * unit_of(bodies)
    for body, before, after in zip(bodies, start, dropped.poses, strict=True):
        way = after.world(body.centre[None]) - before.world(body.centre[None])
        if np.linalg.norm(way[0, :2]) > far:
            return f"{body.name} rolled away"
    return ""


def _certificate(evidence: Evidence, seed: int, attempts: int, seconds: float) -> Certificate:
    return Certificate(
        drift_m=evidence.drift,
        penetration_m=evidence.penetration,
        extent_m=evidence.extent,
        seed=seed,
        attempts=attempts,
        seconds=seconds,
        objects=evidence.objects,
        hover_m=evidence.hover,
        lifted=evidence.lifted,
    )


def _around_origin(bodies: Sequence[Body], poses: Sequence[Pose]) -> list[Pose]:
    all_points = [p.world(b.hull.vertices) for b, p in zip(bodies, poses, strict=True)]
    points = np.concatenate(all_points)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return [p.moved((-middle[0], -middle[1], 0.0)) for p in poses]
