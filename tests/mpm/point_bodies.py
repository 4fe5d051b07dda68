"""Small bodies of material points, and the problem that they make."""

import numpy as np

from corporeal.core.types import Law
from corporeal.mpm.problem import FLOOR, Body, Problem

CELL = 0.02
"""Grid spacing [m]."""
SIZE = np.array([0.4, 0.12, 0.06])
"""Of a board [m]."""
NUMBERS = {
    "density": 1000.0,
    "young_pa": 1e5,
    "poisson": 0.3,
    "yield_stress": 2e3,
    "hardening": 1e4,
    "friction_angle": np.radians(30.0),
    "cohesion": 200.0,
    "loss": 0.2,
    "vibration": 300.0,
}
"""What every point of a body is made of, in SI units."""


def ball(centre, radius=0.05, spacing=CELL / 2):
    axis = np.arange(-radius + spacing / 2, radius, spacing)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    return points[np.linalg.norm(points, axis=1) < radius] + centre


def body(points, law=Law.NEO_HOOKEAN, velocity=(0, 0, 0), spacing=CELL / 2, **given):
    """One body of points; ``given`` replaces numbers, and gives other fields of ``Body``."""
    one = np.ones(len(points))
    numbers = {k: given.pop(k, usual) for k, usual in NUMBERS.items()}
    return Body(
        name=given.pop("name", "ball"),
        position=points,
        velocity=np.tile(np.array(velocity, float), (len(points), 1)),
        volume=one * spacing**3,
        law=np.full(len(points), law.value),
        **{k: one * v for k, v in numbers.items()},
        **given,
    )


def round_body(centre, radius=0.05, count=200, **given):
    """A rigid ball that touches through rounded points (Fibonacci's spiral)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle, r = np.pi * (1 + 5**0.5) * np.arange(count), np.sqrt(1 - z * z)
    normal = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    along = np.stack([-np.sin(angle), np.cos(angle), 0 * z], axis=1)
    radii = np.tile([radius, 0.0, 0.4 * radius, 1.0], (count, 1))
    rows = np.concatenate([normal, along, radii], axis=1)
    surface = centre + radius * normal
    return body(ball(centre, radius), rigid=True, surface=surface, curvature=rows, **given)


def flat_faces(size, distance=0.012):
    """Points inside the faces of a box around the origin, and rows that say which way they look."""
    points, rows = [], []
    for axis in range(3):
        one, two = (np.arange(-s / 2 + distance / 2, s / 2, distance) for s in np.delete(size, axis))
        grid = np.stack(np.meshgrid(one, two, indexing="ij"), -1).reshape(-1, 2)
        for side in (-1.0, 1.0):
            points.append(np.insert(grid, axis, side * size[axis] / 2, axis=1))
            row = np.zeros((len(grid), 12))
            row[:, axis], row[:, 8] = side, 2.4 * distance
            rows.append(row)
    return np.concatenate(points), np.concatenate(rows)


def board(middle, size=SIZE, **given):
    """A rigid box that touches on its flat faces."""
    axes = [np.arange(-s / 2 + CELL / 4, s / 2, CELL / 2) for s in size]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    surface, rows = flat_faces(size)
    usual = {"surface": surface + middle, "curvature": rows, "density": 8000.0}
    return body(points + middle, rigid=True, name="board", **usual | given)


def problem(*bodies, planes=(FLOOR,), friction=0.4, restitution=0.5, **given):
    count = len(bodies) + len(planes)
    return Problem(
        bodies,
        CELL,
        friction=np.full((count, count), friction),
        restitution=np.full((count, count), restitution),
        planes=planes,
        **given,
    )


def step_together(ours, sure, steps):
    """Step two engines by the steps that both of them allow."""
    for _ in range(steps):
        dt = min(ours.stable_step(), sure.stable_step())
        ours.step(dt)
        sure.step(dt)
    return ours, sure
