"""Wind, springs and rigid inclusions on the device engine follow the reference."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import on_device
from test_cuda import CELL, ball, body, problem, side_by_side

from corporeal.core.errors import UserError
from corporeal.core.types import Law, Push, Wind
from corporeal.mpm.problem import InteractiveEngine, Joint, Tether, WindFaces
from corporeal.mpm.reference.engine import ReferenceEngine

STORM = Wind((20.0, 3.0, 0.0), gust=0.4, start=0.002, end=1.0)


def bricks(low, high):
    axes = [np.arange(a + CELL / 4, b, CELL / 2) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def sailing(points, **more):
    """A body whose outer particles have a face that looks away from its centre."""
    out = points - points.mean(axis=0)
    far = np.linalg.norm(out, axis=1)
    skin = np.flatnonzero(far > far.max() - 0.6 * CELL)
    area = out[skin] / far[skin, None] * 1e-4
    return body(points, wind=STORM, faces=WindFaces(area, skin), **more)


def compared(given, steps, position=2e-6):
    ours, sure = side_by_side(given, steps)
    assert ours.stable_step() == pytest.approx(sure.stable_step(), rel=0.15)
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < position * CELL
    mine, theirs = ours.measure(), sure.measure()
    scale = np.abs(theirs.momentum).max()
    assert mine.momentum == pytest.approx(theirs.momentum, abs=2e-5 * scale)
    assert mine.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-4, abs=1e-9)
    assert mine.elastic == pytest.approx(theirs.elastic, rel=1e-3, abs=1e-9)
    assert mine.viscous_loss == pytest.approx(theirs.viscous_loss, rel=1e-3, abs=1e-12)
    return mine, theirs


def test_wind_moves_soft_and_rigid_bodies_as_in_the_reference():
    given = problem(
        sailing(ball((0, 0, 0.3)), law=Law.VON_MISES, velocity=(1.0, 0, 0)),
        sailing(ball((0.2, 0, 0.3)) * [1, 0.7, 1], rigid=True, velocity=(0, 2.0, 0)),
        planes=(),
    )
    mine, theirs = compared(given, 20)
    assert np.abs(theirs.momentum).max() > 1e-3
    assert mine.push_work == pytest.approx(theirs.push_work, rel=0.02)
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-4, abs=1e-7)


def test_tethers_pull_as_in_the_reference():
    crown = body(ball((0, 0, 0.3)), young_pa=0.0, density=50.0, loss=0.0, velocity=(0.3, 0, 0))
    tied = replace(crown, tether=Tether(0, np.full(len(crown.position), 30.0), 0.2))
    post = body(bricks((-0.02, -0.02, 0.0), (0.02, 0.02, 0.2)), rigid=True)
    mine, theirs = compared(problem(post, tied, planes=(), excluded_pairs=((0, 1),)), 20)
    assert theirs.viscous_loss > 0 and theirs.elastic[1] != 0.0
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-4, abs=1e-6)


def test_joints_hold_and_spring_as_in_the_reference():
    foot = body(bricks((-0.04, -0.04, -0.1), (0.04, 0.04, 0.0)), rigid=True)
    rod = body(bricks((-0.02, -0.02, 0.0), (0.02, 0.02, 0.2)), rigid=True)
    pushed = replace(rod, push=Push((5.0, 1.0, 0.0)))
    joint = Joint(0, 1, (0.0, 0.0, 0.0), 20.0, 0.1)
    given = problem(foot, pushed, planes=(), joints=(joint,), excluded_pairs=((0, 1),))
    mine, theirs = compared(given, 20, position=1e-9)
    assert theirs.elastic[1] > 0 and theirs.pair_impulse[0, 1] == 0
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-9, abs=1e-12)


def test_a_rigid_frame_holds_its_cushion_as_in_the_reference():
    frame = body(bricks((-0.1, -0.1, 0.0), (0.1, 0.1, 0.06)), rigid=True, density=700.0)
    cushion = body(bricks((-0.1, -0.1, 0.06), (0.1, 0.1, 0.12)), young_pa=5e4)
    stone = body(ball((0.03, 0.0, 0.165), 0.04), rigid=True, density=3000.0, velocity=(0, 0, -1.0))
    given = problem(frame, cushion, stone, bonds=((0, 1),), planes=())
    mine, theirs = compared(given, 20)
    assert theirs.pair_impulse[1, 2] > 0 and theirs.pair_impulse[0, 1] == 0
    assert mine.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-3)


@pytest.mark.parametrize("rigid", [False, True])
def test_wind_and_grips_reach_a_body_as_in_the_reference(rigid):
    given = problem(body(ball((0, 0, 0.3)), rigid=rigid, young_pa=3e4))
    ours, sure = on_device(given), ReferenceEngine(given)
    assert isinstance(ours, InteractiveEngine)
    start = ours.measure().potential.sum()
    for engine in (ours, sure):
        for step in range(36):
            if step == 2:
                engine.apply_impulse(0, (0.05, 0.0, 0.31), (-0.1, 0.02, 0.0))
            if step == 4:
                engine.attach_spring(0, (0.0, 0.05, 0.3), (0.0, 0.2, 0.4), 300.0)
            if step == 24:
                engine.attach_spring(0, None, (0.1, 0.2, 0.4), 100.0)
            if step == 32:
                engine.attach_spring(0, None, (0.0, 0.0, 0.0), 0.0)
            engine.step(1e-3)
    mine, theirs = ours.measure(), sure.measure()
    scale = np.abs(theirs.momentum).max()
    assert mine.momentum == pytest.approx(theirs.momentum, abs=2e-5 * scale)
    assert mine.momentum == pytest.approx(mine.external_impulse, abs=1e-5 * scale)
    gained = (mine.kinetic + mine.elastic + mine.potential).sum() + mine.viscous_loss - start
    # At the mean velocity of a step no energy comes from nowhere; the transfer takes some of it.
    assert 0.995 * gained < mine.push_work < 1.15 * gained
    with pytest.raises(UserError, match="not held"):
        ours.attach_spring(0, None, (0.0, 0.0, 0.0), 5.0)
