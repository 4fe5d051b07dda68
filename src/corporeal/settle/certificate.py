"""Proof that bodies are at rest: measured on the original meshes, not taken from the engine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corporeal.geometry.spread import sample_surface
from corporeal.settle.body import Body, Pose, unit_of
from corporeal.settle.mujoco import DEFAULT, FIRM_STEP, Engine

DRIFT = 1e-3
"""Of what rests within a second, at most, per metre of scene."""
KICK = 0.01
"""Spin given to every body to topple what is merely balanced [rad/s]."""
SAMPLES = 4000
"""Points of a surface beside its vertices that are looked up in other bodies."""


@dataclass(frozen=True)
class Certificate:
    """That a scene is at rest, how well, and what it took."""

    drift_m: float
    """How far any body moved in one second without damping, after a small kick [m]."""
    penetration_m: float
    """How deep any mesh is in another or in the floor [m]."""
    extent_m: float
    """Largest side of the box around all [m]."""
    seed: int
    """Of the attempt that came to rest."""
    attempts: int
    seconds: float
    """Of work."""
    objects: int
    hover_m: float = 0.0
    """Widest gap between any body and what carries it [m]."""


@dataclass(frozen=True)
class Evidence:
    """What was measured."""

    drift: float
    """[m]"""
    penetration: float
    """[m]"""
    hover: float
    """[m]"""
    extent: float
    """[m]"""

    def objections(self, deepest: float) -> list[str]:
        """Say in words what speaks against rest."""
        found = []
        if self.drift >= DRIFT * self.extent:
            found.append(f"it moves {1e3 * self.drift:.2g} mm in a second")
        if self.penetration > deepest:
            found.append(f"meshes overlap by {1e3 * self.penetration:.2g} mm")
        return found


def examine(bodies: Sequence[Body], poses: Sequence[Pose]) -> Evidence:
    """Measure drift, penetration, hovering and extent of bodies that claim to be at rest."""
    clouds = [p.world(_points(b)) for b, p in zip(bodies, poses, strict=True)]
    everything = np.concatenate(clouds)
    return Evidence(
        drift=drift(bodies, poses),
        penetration=max(0.0, -float(everything[:, 2].min()), _deepest(bodies, poses, clouds)),
        hover=0.0,
        extent=float(np.ptp(everything, axis=0).max()),
    )


def drift(bodies: Sequence[Body], poses: Sequence[Pose]) -> float:
    """How far hulls move in a second on hard ground that lets them roll, after small kicks [m]."""
    engine = Engine(bodies, poses, DEFAULT.step)
    engine.let_roll()
    engine.harden()
    spin = engine.data.qvel.reshape(len(bodies), 6)[:, 3:]
    seconds = max(1.0, unit_of(bodies) ** -0.5)
    for number in range(round(seconds / FIRM_STEP)):
        if number in (0, 25):
            spin[:, number // 25] += KICK
        engine.step()
    moved = 0.0
    for body, before, after in zip(bodies, poses, engine.poses(), strict=True):
        way = after.world(body.hull.vertices) - before.world(body.hull.vertices)
        moved = max(moved, float(np.linalg.norm(way, axis=1).max()))
    return moved


def _points(body: Body) -> np.ndarray:
    mesh = body.shape.mesh
    more, _ = sample_surface(mesh, SAMPLES, np.random.default_rng(0))
    return np.concatenate([mesh.vertices[np.unique(mesh.triangles)], more])


def _deepest(bodies: Sequence[Body], poses: Sequence[Pose], clouds: Sequence[np.ndarray]) -> float:
    depth = 0.0
    for i, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        low, high = body.hull.vertices.min(axis=0), body.hull.vertices.max(axis=0)
        for j, cloud in enumerate(clouds):
            if i == j:
                continue
            points = pose.body(cloud)
            points = points[((points > low) & (points < high)).all(axis=1)]
            points = points[body.shape.inside(points)]
            if len(points):
                depth = max(depth, float(body.shape.closest(points)[0].max()))
    return depth
