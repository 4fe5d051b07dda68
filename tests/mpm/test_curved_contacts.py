"""What is round rolls on what is curved, outwards and inwards: the engines agree."""

import numpy as np
import pytest
from laws.asked import on_device
from point_bodies import CELL, body, problem, round_body, step_together

from corporeal.discretization.surface_curvature import point_reach
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.physics import curved_surface
from corporeal.mpm.reference.engine import ReferenceEngine

RADIUS, HOLLOW = 0.05, 0.2
ENGINES = {"cpu": lambda p: CpuEngine(p, threads=1), "cuda": on_device}


def sphere(count):
    """Unit vectors (Fibonacci's spiral), and tangents."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle, r = np.pi * (1 + 5**0.5) * np.arange(count), np.sqrt(1 - z * z)
    normal = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    return normal, np.stack([-np.sin(angle), np.cos(angle), 0 * z], axis=1)


def bowl(middle=(0.0, 0.0, HOLLOW), **given):
    """The lower part of a thick hollow ball that touches on its inside."""
    axis = np.arange(-0.24 + CELL / 4, 0.24, CELL / 2)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    away = np.linalg.norm(points, axis=1)
    points = points[(away > HOLLOW) & (away < 0.24) & (points[:, 2] < -0.08)]
    normal, along = sphere(3000)
    normal, along = normal[normal[:, 2] < -0.4], along[normal[:, 2] < -0.4]
    rows = np.zeros((len(normal), 12))
    rows[:, :3], rows[:, 3:6], rows[:, 10:] = -normal, along, -1 / HOLLOW
    rows[:, 8] = point_reach(HOLLOW * normal)
    surface = HOLLOW * normal + middle
    moved = {"surface": surface, "curvature": rows, "density": 8000.0}
    return body(points + middle, rigid=True, name="bowl", **moved | given)


def marble(centre, **given):
    one = round_body(centre, RADIUS, **given)
    rows = np.column_stack([one.curvature, np.full((len(one.curvature), 2), 1 / RADIUS)])
    return body(one.position, rigid=True, surface=one.surface, curvature=rows, velocity=one.velocity[0])


def in_bowl(lean, **given):
    way = np.array([np.sin(lean), 0.0, -np.cos(lean)])
    return marble(np.array([0.0, 0.0, HOLLOW]) + (HOLLOW - RADIUS) * way, **given)


CASES = {
    "marble in a bowl": lambda: (in_bowl(0.3, velocity=(0.3, 0.2, -0.2)), bowl()),
    "bowl around a marble": lambda: (bowl(), in_bowl(0.3, velocity=(0.3, 0.2, -0.2))),
    "marble on a marble": lambda: (
        marble((0.0, 0.0, 0.05), velocity=(0.1, 0.0, 0.0)),
        marble((0.02, 0.01, 0.1475), velocity=(0.2, 0.1, -0.4)),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_what_is_round_moves_as_in_the_reference(engine, case):
    given = problem(*CASES[case](), planes=(), gravity=(1.0, 0.0, -9.81), restitution=0.0)
    ours, sure = ENGINES[engine](given), ReferenceEngine(given)
    step_together(ours, sure, 20)
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL
    assert mine.momentum == pytest.approx(theirs.momentum, rel=1e-6, abs=1e-7)
    assert mine.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-4, abs=1e-9)
    moved = theirs.momentum.sum(axis=0) - theirs.external_impulse.sum(axis=0)
    start = sum(b.velocity[0] * m for b, m in zip(given.bodies, theirs.mass, strict=True))
    assert moved == pytest.approx(start)


@pytest.mark.parametrize("at", ["outside", "inside", "anywhere"])
def test_heights_over_a_torus(at):
    """A ring of radius .3 whose tube is .1 thick: round outside, a saddle inside.

    Exact where the ring runs in the normal's plane, of third order elsewhere.
    """
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 200))
    v = {"outside": 0 * v, "inside": 0 * v + np.pi, "anywhere": v}[at]
    out = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    ring = np.stack([-np.sin(u), np.cos(u), 0 * u], axis=1)
    normal = np.cos(v)[:, None] * out + np.sin(v)[:, None] * np.array([0.0, 0.0, 1.0])
    point = 0.3 * out + 0.1 * normal
    rows = np.zeros((200, 12))
    rows[:, :3], rows[:, 3:6] = normal, ring
    rows[:, 10], rows[:, 11] = np.cos(v) / (0.3 + 0.1 * np.cos(v)), 10.0
    size = 0.005 if at == "anywhere" else 0.03
    place = point + 0.02 * normal + size * rng.normal(size=(200, 3))
    over = curved_surface.height_over(rows, place - point)
    true = np.hypot(np.hypot(place[:, 0], place[:, 1]) - 0.3, place[:, 2]) - 0.1
    assert over.there.all()
    assert over.height == pytest.approx(true, abs=4e-5 if at == "anywhere" else 1e-12)
    assert (curved_surface.is_hollow(rows) == (np.cos(v) < 0)).all()
