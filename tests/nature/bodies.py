"""Balls, boxes and cylinders of matter for experiments; lengths in metres."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from corporeal.mpm.problem import Body, Plane, Problem
from corporeal.types import Law, Push


@dataclass(frozen=True)
class Stuff:
    """A material, SI; soft rubber unless said otherwise."""

    law: Law = Law.NEO_HOOKEAN
    young: float = 1e5
    poisson: float = 0.3
    density: float = 1000.0
    yield_stress: float = 1e3
    hardening: float = 0.0
    friction_angle: float = 0.5
    cohesion: float = 0.0
    viscosity: float = 0.0


RUBBER = Stuff()


def body(
    points,
    volume,
    stuff=RUBBER,
    velocity=(0.0, 0.0, 0.0),
    spin=(0.0, 0.0, 0.0),
    rigid=False,
    surface=None,
    push: Push | None = None,
    name="body",
):
    """Give points of equal volume the same material and a rigid motion."""
    n = len(points)
    full = lambda value: np.full(n, float(value))  # noqa: E731
    arm = points - points.mean(axis=0)
    return Body(
        name=name,
        position=np.asarray(points, np.float64),
        velocity=np.array(velocity) + np.cross(np.array(spin), arm),
        volume=full(volume / n),
        density=full(stuff.density),
        law=np.full(n, stuff.law.value),
        young=full(stuff.young),
        poisson=full(stuff.poisson),
        yield_stress=full(stuff.yield_stress),
        hardening=full(stuff.hardening),
        friction_angle=full(stuff.friction_angle),
        cohesion=full(stuff.cohesion),
        viscosity=full(stuff.viscosity),
        rigid=rigid,
        surface=np.zeros((0, 3)) if surface is None else surface,
        push=push,
    )


def problem(*bodies, cell, friction=0.0, restitution=0.0, planes=(), **more):
    """Put bodies together with one coefficient for all pairs."""
    n = len(bodies) + len(planes)
    table = lambda value: np.full((n, n), float(value))  # noqa: E731
    more.setdefault("gravity", (0.0, 0.0, 0.0))
    return Problem(
        bodies=tuple(bodies),
        cell=cell,
        friction=friction if isinstance(friction, np.ndarray) else table(friction),
        restitution=table(restitution),
        planes=tuple(planes),
        **more,
    )


# ---------------------------------------------------------------- shapes and fills


def box_sdf(centre, size, turn=None):
    turn, half = np.eye(3) if turn is None else turn, np.array(size) / 2

    def distance(p):
        q = np.abs((p - np.array(centre)) @ turn) - half
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)

    return distance


def ball_sdf(centre, radius):
    return lambda p: np.linalg.norm(p - np.array(centre), axis=1) - radius


def cylinder_sdf(centre, radius, height):
    """An upright cylinder."""

    def distance(p):
        q = p - np.array(centre)
        a, b = np.hypot(q[:, 0], q[:, 1]) - radius, np.abs(q[:, 2]) - height / 2
        return np.minimum(np.maximum(a, b), 0) + np.hypot(np.maximum(a, 0), np.maximum(b, 0))

    return distance


def lattice(sdf, centre, reach, spacing):
    """Points of a lattice centred on a body, inside its surface."""
    half = int(np.ceil(reach / spacing)) + 1
    axis = (np.arange(-half, half) + 0.5) * spacing
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.array(centre) + grid
    return points[sdf(points) < -1e-9]


def blue_noise(sdf, centre, reach, spacing, seed=1, rounds=40):
    """Evenly random points, each at least half a spacing below the surface."""
    rng = np.random.default_rng(seed)
    points = lattice(sdf, centre, reach, spacing)
    points = points + rng.uniform(-0.3, 0.3, points.shape) * spacing
    for _ in range(rounds):
        points = _below_surface(points, sdf, spacing)
        ij = cKDTree(points).query_pairs(1.2 * spacing, output_type="ndarray")
        apart = points[ij[:, 0]] - points[ij[:, 1]]
        distance = np.linalg.norm(apart, axis=1) + 1e-12
        move = apart * (0.2 * (1.2 * spacing - distance) / distance)[:, None]
        np.add.at(points, ij[:, 0], move)
        np.add.at(points, ij[:, 1], -move)
    return _below_surface(_below_surface(points, sdf, spacing), sdf, spacing)


def _below_surface(points, sdf, spacing):
    over = sdf(points) + 0.5 * spacing
    out = np.flatnonzero(over > 0)
    if len(out):
        step = 1e-4 * spacing * np.eye(3)
        slope = np.stack([sdf(points[out] + s) - sdf(points[out] - s) for s in step], axis=1)
        slope /= np.maximum(np.linalg.norm(slope, axis=1), 1e-12)[:, None]
        points[out] -= over[out][:, None] * slope
    return points


def box(centre, size, spacing, fill="lattice", turn=None, **more):
    if fill == "lattice":
        points = bricks(centre, size, spacing, turn)
    else:
        sdf = box_sdf(centre, size, turn)
        points = blue_noise(sdf, centre, float(np.linalg.norm(size)) / 2, spacing)
    return body(points, float(np.prod(size)), **more)


def bricks(centre, size, spacing, turn=None):
    """Points in the middles of equal bricks that fill a box exactly."""
    counts = [max(1, round(s / spacing)) for s in size]
    axes = [((np.arange(n) + 0.5) / n - 0.5) * s for n, s in zip(counts, size, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.array(centre) + grid @ (np.eye(3) if turn is None else turn).T


def ball(centre, radius, spacing, fill="lattice", **more):
    points = _filled(fill, ball_sdf(centre, radius), centre, radius, spacing)
    return body(points, 4 / 3 * np.pi * radius**3, **more)


def cylinder(centre, radius, height, spacing, fill="lattice", **more):
    reach = float(np.hypot(radius, height / 2))
    points = _filled(fill, cylinder_sdf(centre, radius, height), centre, reach, spacing)
    return body(points, np.pi * radius**2 * height, **more)


def _filled(fill, sdf, centre, reach, spacing):
    if fill == "lattice":
        return lattice(sdf, centre, reach, spacing)
    return blue_noise(sdf, centre, reach, spacing)


# ---------------------------------------------------------------- surface points and planes


def ball_surface(centre, radius, count):
    """Spread points evenly on a sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z * z)
    return np.array(centre) + radius * np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def box_surface(centre, size, count=9, turn=None):
    axis = np.linspace(-0.5, 0.5, count)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    skin = grid[np.abs(grid).max(axis=1) > 0.499] * np.array(size)
    return np.array(centre) + skin @ (np.eye(3) if turn is None else turn).T


def floor(height=0.0):
    return Plane((0.0, 0.0, 1.0), height)
