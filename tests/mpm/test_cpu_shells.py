"""Shells on the production engine: as in the reference, whatever the threads, and across checkpoints."""

from dataclasses import replace

import numpy as np
import pytest
from point_bodies import ball, body, step_together
from shell_bodies import CELL, free, ringing_strip, sheet_triangles, shell_body, strip, tube

from corporeal.core.types import Law
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import FLOOR
from corporeal.mpm.reference.engine import ReferenceEngine

YIELDING = {"law": Law.VON_MISES, "yield_stress": 1e5, "hardening": 1e5}


def pressed_tube(speed=8.0, **given):
    """An open cylinder that is flattened from two sides."""
    points, triangle = tube()
    inward = np.zeros_like(points)
    inward[:, 0] = -speed * points[:, 0] * np.abs(points[:, 0]) / 0.03**2
    return shell_body(points, triangle, inward, **given)


def junction(speed=3.0):
    """Three sheets that share an edge: two of one winding, one of the other."""
    flat, _ = strip(0.04, 0.03)
    along = len(np.unique(flat[:, 1]))
    sheets, points = [], [flat[:along]]
    for turn in (0.0, 2.0, 4.5):
        c, s = np.cos(turn), np.sin(turn)
        beyond = flat[along:] @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        rows = np.concatenate([np.arange(along), sum(map(len, points)) + np.arange(len(beyond))])
        sheets.append(rows[sheet_triangles(len(rows) // along, along)])
        points.append(beyond)
    sheets[1] = sheets[1][:, ::-1]
    points = np.concatenate(points)
    swing = speed * np.sin(80.0 * points[:, ::-1])
    return shell_body(points, np.concatenate(sheets), swing)


def side_by_side(given, steps, threads=1):
    return step_together(CpuEngine(given, threads=threads), ReferenceEngine(given), steps)


CASES = {
    "strip": lambda: ringing_strip(),
    "hencky": lambda: ringing_strip(law=Law.HENCKY),
    "corotated": lambda: ringing_strip(law=Law.COROTATED),
    "lossy": lambda: ringing_strip(loss=0.3),
    "yielding": lambda: pressed_tube(**YIELDING),
    "lossy and yielding": lambda: pressed_tube(**YIELDING, loss=0.3),
    "junction": junction,
    "one triangle": lambda: shell_body(np.eye(3) * 0.02, np.array([[0, 1, 2]]), np.diag([1.0, -1.0, 2.0])),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_shells_move_as_in_the_reference(case):
    given = free(CASES[case]())
    start = given.bodies[0].position
    fast, sure = side_by_side(given, 200)
    here, there = fast.snapshot(), sure.snapshot()
    drift = np.ptp(there.position - start, axis=0).max()
    assert drift > 0.3 * CELL
    assert np.abs(here.position - there.position).max() < 1e-4 * CELL
    assert np.abs(here.motion - there.motion).max() < 1e-4
    ours, theirs = fast.measure(), sure.measure()
    assert (theirs.plastic_loss > 1e-3) == ("yielding" in case)
    assert (theirs.viscous_loss > 1e-4) == ("lossy" in case)
    assert ours.elastic == pytest.approx(theirs.elastic, rel=1e-3)
    assert ours.kinetic == pytest.approx(theirs.kinetic, rel=1e-3)
    for loss in ("plastic_loss", "viscous_loss"):
        assert getattr(ours, loss) == pytest.approx(getattr(theirs, loss), rel=1e-3, abs=1e-9)
    assert ours.momentum == pytest.approx(theirs.momentum, abs=1e-6)
    assert ours.external_impulse == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("case", ["strip", "lossy and yielding"])
def test_steps_are_as_long_as_in_the_reference(case):
    given = free(CASES[case]())
    fast, sure = side_by_side(given, 3)
    assert fast.stable_step() == pytest.approx(sure.stable_step(), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("contact", ["multi", "single"])
def test_a_shell_hits_the_floor_beside_a_solid_as_in_the_reference(contact):
    points, triangle = tube()
    shell = shell_body(points + np.array([0.0, 0.0, 0.004]), triangle, (0.0, 0.0, -2.0), loss=0.3)
    solid = body(ball((0.0, 0.0, 0.03), 0.012, CELL / 2), velocity=(1.0, 0.0, 0.0), spacing=CELL / 2)
    given = replace(
        free(solid, shell, planes=(FLOOR,), gravity=(0.0, 0.0, -9.81)),
        friction=np.full((3, 3), 0.3),
        restitution=np.zeros((3, 3)),
        contact=contact,
    )
    fast, sure = side_by_side(given, 100)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-4 * CELL
    ours, theirs = fast.measure(), sure.measure()
    assert (theirs.plane_impulse[0, :, 2] > 0).any() or contact == "single"
    assert ours.elastic == pytest.approx(theirs.elastic, rel=1e-3)
    assert ours.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-6)


def fine_tube():
    """Enough vertices for several threads."""
    points, triangle = tube(radius=0.06, length=0.15, spacing=CELL / 2)
    inward = -8.0 * points * [1.0, 0.0, 0.0] / 0.06
    return free(shell_body(points, triangle, inward, **YIELDING, loss=0.3))


@pytest.mark.parametrize("threads", [2, 4])
def test_the_number_of_threads_changes_nothing(threads):
    one, many = CpuEngine(fine_tube(), threads=1), CpuEngine(fine_tube(), threads=threads)
    for engine in (one, many):
        engine.advance(4e-3)
    assert many.program.hands == threads and one.measure().plastic_loss > 0
    same = one.save(), many.save()
    assert all(np.array_equal(same[0][name], same[1][name], equal_nan=True) for name in same[0])


def test_a_shell_resumes_bit_for_bit():
    given = free(pressed_tube(**YIELDING, loss=0.3))
    whole, first, after = (CpuEngine(given, threads=1) for _ in range(3))
    for _ in range(60):
        whole.step(5e-5)
    for _ in range(30):
        first.step(5e-5)
    after.restore(first.save())
    for _ in range(30):
        after.step(5e-5)
    assert np.array_equal(after.snapshot().position, whole.snapshot().position)
    assert after.measure().plastic_loss == pytest.approx(whole.measure().plastic_loss, rel=1e-12)
    assert after.measure().elastic == pytest.approx(whole.measure().elastic, rel=1e-12)


@pytest.mark.parametrize("contact", ["multi", "single"])
def test_a_body_that_joins_leaves_a_shells_history_alone(contact):
    given = replace(free(pressed_tube(**YIELDING, loss=0.3)), contact=contact)
    engine = CpuEngine(given, threads=1)
    for _ in range(60):
        engine.step(5e-5)
    joining = ringing_strip(loss=0.2)
    more = free(*given.bodies, replace(joining, position=joining.position + np.array([0.2, 0.0, 0.0])))
    after = engine.with_added_bodies(replace(more, contact=contact))
    before, now = engine.measure(), after.measure()
    assert before.plastic_loss > 1e-3 and now.plastic_loss == before.plastic_loss
    assert now.elastic == pytest.approx([before.elastic[0], 0.0], rel=1e-6, abs=1e-9)
    for one in (engine, after):
        for _ in range(30):
            one.step(5e-5)
    count = len(given.bodies[0].position)
    assert np.abs(after.snapshot().position[:count] - engine.snapshot().position).max() < 1e-4 * CELL


def test_a_shell_starts_from_where_another_run_left_it():
    given = free(pressed_tube(**YIELDING))
    before, after = CpuEngine(given, threads=1), CpuEngine(given, threads=1)
    for _ in range(60):
        before.step(5e-5)
    after.start_from(before.save(), {0})
    assert before.measure().plastic_loss > 1e-3
    assert after.measure().elastic == pytest.approx(before.measure().elastic, rel=1e-9)
    assert after.measure().kinetic[0] == pytest.approx(np.sum(given.bodies[0].velocity ** 2 * _mass(given)) / 2)


def _mass(given):
    return (given.bodies[0].volume * given.bodies[0].density)[:, None]
