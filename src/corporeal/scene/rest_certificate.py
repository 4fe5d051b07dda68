"""Certificates of rest, measured on the original meshes independent of the engine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.point_sampling import sample_surface
from corporeal.scene.settle_mujoco import DEFAULT_DROP_CONFIG, HARD_CONTACT_STEP_S, MujocoScene
from corporeal.scene.settling_body import BodyPose, SettlingBody, scene_unit_of

MAX_DRIFT_FRACTION = 1e-3
"""Of what rests within a second, at most, per metre of scene."""
KICK_SPIN_RAD_S = 0.01
"""Spin given to every body to topple what is merely balanced [rad/s]."""
MAX_HOVER_UNITS = 0.008
"""Gap below a body that still counts as touching, of the scene's unit."""
SURFACE_SAMPLES_PER_BODY = 4000
"""Points of a surface beside its vertices that are looked up in other bodies."""


@dataclass(frozen=True)
class RestCertificate:
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
    """Widest gap below any body: to the floor or to the nearest other mesh [m]."""
    lifted: int = 0
    """Bodies that do not touch the floor: they lie on others."""


@dataclass(frozen=True)
class RestEvidence:
    """What was measured."""

    drift: float
    """[m]; not measured, and not a number, where the rest speaks against it already."""
    penetration: float
    """[m]"""
    hover: float
    """[m]"""
    extent: float
    """[m]"""
    lifted: int
    objects: int
    objections: tuple[str, ...]
    """What speaks against rest, in words."""


def measure_rest(bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], deepest: float) -> RestEvidence:
    """Measure drift, penetration, hovering and extent of bodies that claim to be at rest.

    Args:
        bodies: What claims it.
        poses: Where.
        deepest: Penetration allowed [m].
    """
    clouds = [p.world(_surface_points(b)) for b, p in zip(bodies, poses, strict=True)]
    everything = np.concatenate(clouds)
    extent = float(np.ptp(everything, axis=0).max())
    depth = max(0.0, -float(everything[:, 2].min()), _deepest_penetration(bodies, poses, clouds))
    near = MAX_HOVER_UNITS * scene_unit_of(bodies)
    floating = [k for k, cloud in enumerate(clouds) if cloud[:, 2].min() > near]
    gaps = [float(c[:, 2].min()) for k, c in enumerate(clouds) if k not in floating]
    gaps += [_nearest_distance(k, bodies, poses, clouds, near) for k in floating]
    hover = max(0.0, *gaps)
    found = []
    if depth > deepest:
        found.append(f"meshes overlap by {1e3 * depth:.2g} mm")
    if hover > near:
        found.append("something hovers")
    moved = np.nan
    if not found:
        moved = measure_drift(bodies, poses)
        if moved >= MAX_DRIFT_FRACTION * extent:
            found.append(f"something moves by {1e3 * moved:.2g} mm in a second")
    return RestEvidence(moved, depth, hover, extent, len(floating), len(bodies), tuple(found))


def measure_drift(bodies: Sequence[SettlingBody], poses: Sequence[BodyPose]) -> float:
    """How far hulls move in a second on hard ground that lets them roll, after small kicks [m]."""
    engine = MujocoScene(bodies, poses, DEFAULT_DROP_CONFIG.step)
    engine.let_roll()
    engine.harden()
    spin = engine.data.qvel.reshape(len(bodies), 6)[:, 3:]
    seconds = max(1.0, scene_unit_of(bodies) ** -0.5)
    for number in range(round(seconds / HARD_CONTACT_STEP_S)):
        if number in (0, 25):
            spin[:, number // 25] += KICK_SPIN_RAD_S
        engine.step()
    moved = 0.0
    for body, before, after in zip(bodies, poses, engine.poses(), strict=True):
        way = after.world(body.hull.vertices) - before.world(body.hull.vertices)
        moved = max(moved, float(np.linalg.norm(way, axis=1).max()))
    return moved


def _surface_points(body: SettlingBody) -> np.ndarray:
    mesh = Mesh(body.vertices, body.triangles)
    more, _ = sample_surface(mesh, SURFACE_SAMPLES_PER_BODY, np.random.default_rng(0))
    return np.concatenate([mesh.vertices[np.unique(mesh.triangles)], more])


def _deepest_penetration(
    bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], clouds: Sequence[np.ndarray]
) -> float:
    """How deep points of one body are in another [m]."""
    depth = 0.0
    for i, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        for j, cloud in enumerate(clouds):
            points = _near_body_points(body, pose.body(cloud), 0.0) if i != j else cloud[:0]
            if len(points):
                points = points[body.shape.inside(points)]
            if len(points):
                depth = max(depth, float(body.shape.closest(points)[0].max()))
    return depth


def _nearest_distance(
    k: int, bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], clouds: Sequence[np.ndarray], near: float
) -> float:
    """Distance from one body to the nearest other [m]; inf: more than ``near``."""
    least = np.inf
    for j, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        if j != k:
            for surface, points in ((body, pose.body(clouds[k])), (bodies[k], poses[k].body(clouds[j]))):
                points = _near_body_points(surface, points, near)
                points = points[surface.shape.may_be_within(near, points)]
                if len(points):
                    least = min(least, float(surface.shape.closest(points)[0].min()))
    return least if least <= near else np.inf


def _near_body_points(body: SettlingBody, points: np.ndarray, near: float) -> np.ndarray:
    """Keep points of the body's frame that its box could hold."""
    low, high = body.hull.vertices.min(axis=0) - near, body.hull.vertices.max(axis=0) + near
    return points[((points > low) & (points < high)).all(axis=1)]
