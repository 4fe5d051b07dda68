"""Prescribed motion: what a path means, in NumPy and in C++, and where it is refused."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import on_device
from laws.bodies import box, problem
from point_bodies import CELL, board
from point_bodies import problem as posed

from corporeal.core.errors import UserError
from corporeal.core.types import Keyframes, Push
from corporeal.mpm import formulas
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.formulas import one_lane
from corporeal.mpm.physics import prescribed_motion, rigid
from corporeal.mpm.problem import Joint
from corporeal.mpm.quiet_warp import wp
from corporeal.mpm.reference.engine import ReferenceEngine

wp.set_module_options(formulas.formula_options())

STILL = (0.0, 0.0, 0.0)
WAVY = Keyframes(
    time=(0.1, 0.3, 0.4, 0.9),
    shift=(STILL, (0.1, 0.0, 0.0), (0.1, 0.0, 0.2), (0.0, 0.3, 0.2)),
    turn=(STILL, (0.0, 0.0, 9.0), STILL, (1.0, -2.0, 0.5)),
)
PIVOT = (0.2, -0.1, 0.4)


def mover(**more):
    more.setdefault("path", WAVY)
    return box((0.25, -0.1, 0.45), (0.1, 0.1, 0.1), 0.0125, rigid=True, pivot=PIVOT, **more)


def test_a_path_passes_through_its_rows_and_rests_before_and_after():
    rows, frame = prescribed_motion.path_rows(WAVY, PIVOT), np.eye(3)
    for time, shift, turn in zip(WAVY.time, WAVY.shift, WAVY.turn, strict=True):
        frame = rigid.rotation_matrix(np.array(turn)) @ frame
        found = prescribed_motion.path_pose(rows, time)
        np.testing.assert_allclose(found.place, np.array(PIVOT) + shift, atol=1e-12)
        np.testing.assert_allclose(found.rotation, frame, atol=1e-12)
    for outside, row in ((0.0, 0.1), (2.0, 0.9)):
        for a, b in zip(
            prescribed_motion.path_pose(rows, outside), prescribed_motion.path_pose(rows, row), strict=True
        ):
            np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_path_at_rest_rests():
    """A monotone cubic overshoots nowhere; an ordinary spline would."""
    rows = prescribed_motion.path_rows(WAVY, PIVOT)
    for time in np.linspace(0.3, 0.4, 11):
        assert prescribed_motion.path_pose(rows, time).place[0] == pytest.approx(PIVOT[0] + 0.1, abs=1e-12)


@pytest.mark.slow
def test_speeds_of_a_path_are_smooth_and_no_larger_than_stated():
    guide = prescribed_motion.PathFollower.of(mover())
    centre = np.array([0.25, -0.1, 0.45])
    h = 1e-5
    poses = [prescribed_motion.path_pose(guide.rows, t) for t in np.arange(0.0, 1.0, h)]
    middle = np.array([p.place + p.rotation @ guide.arm for p in poses])
    speed = np.linalg.norm(np.diff(middle, axis=0), axis=1) / h
    assert speed.max() < guide.fastest
    assert np.linalg.norm(middle[0] - centre) < 1e-12
    # It starts and stops at once where its first and last row say so, and nowhere else.
    under_way = np.diff(speed[int(0.1 / h) + 2 : int(0.9 / h) - 2])
    assert np.abs(under_way).max() < 0.01 * speed.max()


Doubles = wp.array(dtype=wp.float64)


@wp.kernel
def follow(
    path: wp.array2d(dtype=wp.float64),
    arm: wp.vec3d,
    end: Doubles,
    x: wp.array(dtype=wp.vec3d),
    R: wp.array(dtype=wp.mat33d),
    out: wp.array(dtype=one_lane.PathMotion),
):
    i = wp.tid()
    rows = path.shape[0] - 1
    out[i] = one_lane.follow_path(path, 1, rows, arm, end[i], wp.float64(0.01), x[i], R[i])


def test_a_path_in_c_is_the_one_in_numpy():
    rng, guide, count = np.random.default_rng(3), prescribed_motion.PathFollower.of(mover()), 200
    end = rng.uniform(-0.1, 1.1, count)
    before = [prescribed_motion.path_pose(guide.rows, t - 0.01) for t in end]
    R = np.stack([p.rotation for p in before])
    x = np.stack([p.place for p in before]) + R @ guide.arm
    padded = np.concatenate([np.full((1, guide.rows.shape[1]), np.nan), guide.rows])
    kinds = (wp.float64, wp.float64, wp.vec3d, wp.mat33d)
    sent = [wp.array(a, dtype=k, device="cpu") for a, k in zip((padded, end, x, R), kinds, strict=True)]
    out = wp.zeros(count, dtype=one_lane.PathMotion, device="cpu")
    arm = wp.vec3d(*guide.arm.tolist())
    wp.launch(follow, count, [sent[0], arm, *sent[1:], out], device="cpu")
    for k, found in enumerate(out.numpy()):
        exact = guide.follow(float(end[k]), 0.01, x[k], R[k])
        np.testing.assert_allclose(found[:3], exact.velocity, atol=1e-10)
        np.testing.assert_allclose(found[3:6], exact.spin, atol=1e-9)
        np.testing.assert_allclose(found[6:].reshape(3, 3), exact.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("posed", "said"),
    [
        (problem(replace(mover(), rigid=False), cell=0.025), "is not rigid"),
        (problem(mover(push=Push((1.0, 0.0, 0.0))), cell=0.025), "is pushed too"),
        (
            problem(mover(), replace(mover(), path=None), cell=0.025, joints=(Joint(0, 1, STILL, 1.0, 1.0),)),
            "is tied to another body",
        ),
        (problem(mover(), cell=0.025, contact="single"), "shares one velocity field"),
    ],
)
def test_a_path_that_cannot_be_followed_is_refused(posed, said):
    with pytest.raises(UserError, match=said.replace("(", r"\(")):
        ReferenceEngine(posed)


def test_nothing_else_moves_what_follows_a_path():
    run = ReferenceEngine(problem(mover(), cell=0.025))
    with pytest.raises(UserError, match="follows a path"):
        run.apply_impulse(0, PIVOT, (1.0, 0.0, 0.0))


def gripped():
    """A rigid cube and two fingers that close a quarter of a cell farther than there is room."""
    size, finger = np.array([4.0, 4.0, 4.0]) * CELL, np.array([2.0, 5.0, 5.0]) * CELL
    bodies = [board(np.zeros(3), size)]
    for side in (-1.0, 1.0):
        closes = Keyframes((0.0, 0.1), (STILL, (-side * 0.5 * CELL, 0.0, 0.0)), (STILL, STILL))
        middle = np.array([side * ((size[0] + finger[0]) / 2 + 0.25 * CELL), 0.0, 0.0])
        bodies.append(replace(board(middle, finger), path=closes, pivot=STILL))
    return posed(*bodies, planes=(), restitution=0.0, friction=0.5, gravity=STILL)


@pytest.mark.parametrize("engine", ["cpu", "cuda", "reference"])
def test_what_two_fingers_close_on_stays_in_the_middle_and_upright(engine):
    """By symmetry; the finger whose contacts were solved last had its way, and tilted it by .7°."""
    engines = {"cpu": lambda p: CpuEngine(p, threads=1), "cuda": on_device, "reference": ReferenceEngine}
    given = gripped()
    run, start = engines[engine](given), given.bodies[0].position
    run.advance(0.1)
    now, found = run.snapshot().position[: len(start)], run.measure()
    assert found.pair_impulse[0, 1:].min() > 0.0
    middle = now.mean(axis=0)
    assert np.abs(middle).max() < 0.03 * CELL
    U, _, Vt = np.linalg.svd((now - middle).T @ start)
    tilt = np.degrees(np.arccos(min(1.0, (np.trace(U @ Vt) - 1.0) / 2.0)))
    assert tilt < 0.1
