"""Take hold of a rubber ball, lift it, swing it about, let it go and poke it."""

import numpy as np

from corporeal.mpm.problem import FLOOR, Body, Problem
from corporeal.mpm.warp import WarpEngine
from corporeal.types import Law

CELL = 0.01
"""Grid spacing [m]."""


def a_ball(radius: float = 0.04) -> Body:
    """Fill a ball of soft rubber that lies on the floor."""
    axis = np.arange(-radius + CELL / 4, radius, CELL / 2)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    points = points[np.linalg.norm(points, axis=1) < radius] + [0, 0, radius]
    one = np.ones(len(points))
    return Body(
        name="ball",
        position=points,
        velocity=np.zeros_like(points),
        volume=one * (CELL / 2) ** 3,
        density=one * 1100.0,
        law=np.full(len(points), Law.NEO_HOOKEAN.value),
        young=one * 2e5,
        poisson=one * 0.45,
        yield_stress=0 * one,
        hardening=0 * one,
        friction_angle=0 * one,
        cohesion=0 * one,
        viscosity=one * 5.0,
    )


def main() -> float:
    """Return how far the ball trails behind the hand, over the hand's distance from the axis."""
    ball = a_ball()
    friction, restitution = np.full((2, 2), 0.5), np.zeros((2, 2))
    engine = WarpEngine(Problem((ball,), CELL, friction, restitution, planes=(FLOOR,)))
    weight = float(ball.volume @ ball.density)
    hand = np.array([0.0, 0.0, 0.08])
    engine.drag(0, (0.0, 0.0, 0.08), tuple(hand), stiffness=200.0)
    for step in range(1, 61):
        time = step / 60
        lift, angle = min(time / 0.3, 1.0), 4.0 * max(time - 0.3, 0.0)
        hand = np.array([0.1 * np.sin(angle), 0.1 * (np.cos(angle) - 1), 0.08 + 0.15 * lift])
        engine.drag(0, None, tuple(hand), stiffness=200.0)
        engine.advance(time)
    trail = float(np.linalg.norm((engine.measure().centre[0] - hand)[:2])) / 0.1
    print(f"{weight * 1e3:.0f} g in hand: it trails by {100 * trail:.0f} % of the circle's radius")
    engine.drag(0, None, tuple(hand), stiffness=0.0)
    engine.poke(0, tuple(engine.measure().centre[0]), (0.0, 0.0, 0.5 * weight))
    engine.advance(1.3)
    print(f"let go and poked: {engine.measure().push_work:.3f} J of work were done on it")
    return trail


if __name__ == "__main__":
    main()
