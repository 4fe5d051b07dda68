"""Small bodies of material points, and the problem that they make."""

import numpy as np

from corporeal.mpm.problem import FLOOR, Body, Problem
from corporeal.types import Law

CELL = 0.02
"""Grid spacing [m]."""
NUMBERS = {
    "density": 1000.0,
    "young": 1e5,
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
    return body(ball(centre, radius), rigid=True, surface=surface, rounding=rows, **given)


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
