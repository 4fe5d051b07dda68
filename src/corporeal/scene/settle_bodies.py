"""Arranging, settling and certifying of bodies, with retries."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.registry import load_backend
from corporeal.scene.arrange_bodies import BodyArrangement, arrange_bodies
from corporeal.scene.rest_certificate import RestCertificate, RestEvidence, measure_rest
from corporeal.scene.settle_blender import BlenderConfig
from corporeal.scene.settle_mujoco import DropConfig, DroppedBodies
from corporeal.scene.settling_body import BodyPose, SettlingBody, scene_unit_of

SettlingEngine = Literal["mujoco", "blenderproc"]
SETTLING_ENGINES = {
    "mujoco": "corporeal.scene.settle_mujoco:drop_in_mujoco",
    "blenderproc": "corporeal.scene.settle_blender:drop_in_blender",
}

MAX_STRAY_UNITS = 0.75
"""How far along the floor a body may end from where it started, of the scene's unit."""
PILED_ARRANGEMENTS: tuple[BodyArrangement, ...] = ("stack", "onto")
"""Arrangements in which something is meant to lie on something else."""
MAX_PILING_ATTEMPTS = 3
"""Attempts at that; then a pile that fell apart and came to rest is taken."""


@dataclass(frozen=True)
class SettleConfig:
    """How hard to try."""

    attempts: int = 8
    engine: SettlingEngine = "mujoco"
    """What lets objects fall; the certificate is the same for both."""
    drop: DropConfig = field(default_factory=DropConfig)
    """In MuJoCo."""
    blender: BlenderConfig = field(default_factory=BlenderConfig)
    """In Blender, through BlenderProc."""


DEFAULT_SETTLE_CONFIG = SettleConfig()


def settle_bodies(
    bodies: Sequence[SettlingBody],
    arrangement: BodyArrangement,
    seed: int,
    deepest: float,
    config: SettleConfig = DEFAULT_SETTLE_CONFIG,
) -> tuple[list[BodyPose], RestCertificate]:
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
    first: tuple[list[BodyPose], RestCertificate] | None = None
    wants_pile = arrangement in PILED_ARRANGEMENTS and len(bodies) > 1
    for attempt in range(config.attempts):
        rng = np.random.default_rng([seed, attempt])
        start = arrange_bodies(bodies, arrangement, rng)
        dropped = _drop_bodies(bodies, start, config)
        evidence = None
        reason = _why_lost(bodies, start, dropped)
        poses = _centre_at_origin(bodies, dropped.poses)
        if not reason:
            evidence = measure_rest(bodies, poses, deepest)
            reason = " and ".join(evidence.objections)
        if reason or evidence is None:
            reasons.append(reason)
        else:
            seconds = time.perf_counter() - begun
            found = poses, _rest_certificate(evidence, seed, attempt + 1, seconds)
            if not wants_pile or evidence.lifted:
                return found
            first = first or found
        if first and attempt + 1 >= MAX_PILING_ATTEMPTS:
            return first[0], replace(first[1], attempts=attempt + 1)
    names = ", ".join(b.name for b in bodies)
    raise UserError(
        f"{names}: no rest found as a {arrangement} in {config.attempts} attempts; in the last one "
        f"{reasons[-1]}. Try another seed, another arrangement or fewer objects."
    )


def _drop_bodies(bodies: Sequence[SettlingBody], start: Sequence[BodyPose], config: SettleConfig) -> DroppedBodies:
    drop = load_backend("settling engine", config.engine, SETTLING_ENGINES)
    return drop(bodies, start, config.blender if config.engine == "blenderproc" else config.drop)


def _why_lost(bodies: Sequence[SettlingBody], start: Sequence[BodyPose], dropped: DroppedBodies) -> str:
    """Return why bodies are not worth examining; "": they are."""
    if not dropped.quiet:
        return f"something still moved after {dropped.seconds:.0f} s"
    far = MAX_STRAY_UNITS * scene_unit_of(bodies)
    for body, before, after in zip(bodies, start, dropped.poses, strict=True):
        way = after.world(body.centre[None]) - before.world(body.centre[None])
        if np.linalg.norm(way[0, :2]) > far:
            return f"{body.name} rolled away"
    return ""


def _rest_certificate(evidence: RestEvidence, seed: int, attempts: int, seconds: float) -> RestCertificate:
    return RestCertificate(
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


def _centre_at_origin(bodies: Sequence[SettlingBody], poses: Sequence[BodyPose]) -> list[BodyPose]:
    all_points = [p.world(b.hull.vertices) for b, p in zip(bodies, poses, strict=True)]
    points = np.concatenate(all_points)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return [p.moved((-middle[0], -middle[1], 0.0)) for p in poses]
