"""Tethers, joints, and what is done to bodies from outside."""

from dataclasses import replace

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, box_surface, floor, problem

from corporeal.core.errors import UserError
from corporeal.core.types import Push
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import Joint, Tether
from corporeal.mpm.reference.engine import ReferenceEngine

CELL = 0.02
FALL = (0.0, 0.0, -9.81)
LOOSE = Stuff(young_pa=0.0, density=50.0)


def crown(rate, holder=0, damping=0.0, **more):
    """Return matter without stress, on springs."""
    body = ball((0, 0, 0.3), 0.05, CELL / 2, stuff=LOOSE, **more)
    return replace(body, tether=Tether(holder, np.full(len(body.position), rate), damping))


def post(density=1e10, size=(0.02, 0.02, 0.2), **more):
    return box((0, 0, 0.1), size, CELL / 2, stuff=Stuff(density=density), rigid=True, **more)


def test_a_tethered_crown_swings_at_its_own_frequency_and_keeps_its_energy(fast_engine):
    run = fast_engine(problem(post(), crown(20.0, velocity=(0.2, 0, 0)), cell=CELL, excluded_pairs=((0, 1),)))
    whole = run.measure().kinetic.sum()
    quarter = 0.5 * np.pi / 20.0
    for turn in range(1, 9):
        run.advance(turn * quarter)
        measure = run.measure()
        away = measure.centre[1, 0] / (0.2 / 20.0)
        assert away == pytest.approx(np.sin(turn * np.pi / 2), abs=0.04)
        energy = measure.kinetic.sum() + measure.elastic.sum()
        assert energy == pytest.approx(whole, rel=0.02)


def test_a_damped_tether_books_what_its_damper_takes(engine):
    given = problem(post(1e3), crown(30.0, damping=0.2, velocity=(0.2, 0, 0)), cell=CELL, excluded_pairs=((0, 1),))
    run = engine(given)
    before = run.measure()
    run.advance(0.05)
    after = run.measure()
    energy = (after.kinetic + after.elastic).sum()
    assert after.viscous_loss > 0.1 * before.kinetic.sum()
    # Within a swing the energy of symplectic Euler goes up and down by ω dt/2, here 2.5 %.
    assert energy + after.viscous_loss == pytest.approx(before.kinetic.sum(), rel=0.02)
    assert after.momentum.sum(axis=0) == pytest.approx(before.momentum.sum(axis=0), abs=1e-5 * before.momentum.max())
    assert after.angular_momentum.sum(axis=0) == pytest.approx(
        before.angular_momentum.sum(axis=0), abs=1e-4 * np.abs(before.angular_momentum).max()
    )


def test_a_tethered_crown_hangs_where_it_hung(fast_engine):
    """Its springs bear its weight from the start, and what holds them feels it."""
    held = post(1e3, surface=box_surface((0, 0, 0.1), (0.02, 0.02, 0.2)))
    given = problem(held, crown(20.0), cell=CELL, planes=(floor(),), gravity=FALL, excluded_pairs=((0, 1),))
    run = fast_engine(given)
    run.advance(0.5)
    measure = run.measure()
    assert np.abs(measure.centre[1] - [0, 0, 0.3]).max() < 2e-4
    impulse = measure.plane_impulse[0].sum(axis=0)
    assert impulse[2] == pytest.approx(measure.mass.sum() * 9.81 * 0.5, rel=0.02)


def hinged(stiffness, damping=0.0, push=None):
    """A rod on a heavy foot, jointed at the foot's top."""
    foot = box((0, 0, -0.04), (0.08, 0.08, 0.08), CELL, stuff=Stuff(density=1e13), rigid=True)
    rod = box((0, 0, 0.2), (0.04, 0.04, 0.4), CELL, rigid=True, push=push)
    joint = Joint(0, 1, (0.0, 0.0, 0.0), stiffness, damping)
    return problem(foot, rod, cell=CELL, joints=(joint,), excluded_pairs=((0, 1),))


def test_a_jointed_rod_swings_with_the_period_of_its_inertia_and_spring(fast_engine):
    """Small swings: T = 2π √(I/k), I = m (L²/3 + w²/12) about the joint."""
    given = hinged(20.0, push=Push((0.5, 0.0, 0.0), 0.0, 0.02))
    mass = 0.04 * 0.04 * 0.4 * 1000
    inertia = mass * (0.4**2 / 3 + 0.04**2 / 12)
    period = 2 * np.pi * np.sqrt(inertia / 20.0)
    run = fast_engine(given)
    run.advance(0.02)
    energy = run.measure().kinetic.sum()
    times = np.arange(0.02, 0.02 + 3 * period, 0.005)
    away = []
    for time in times:
        run.advance(float(time))
        away.append(run.measure().centre[1, 0])
    away = np.array(away)
    down = np.flatnonzero((away[:-1] > 0) & (away[1:] <= 0))
    zero = times[down] + 0.005 * away[down] / (away[down] - away[down + 1])
    assert np.diff(zero) == pytest.approx(period, rel=0.02)
    measure = run.measure()
    assert measure.kinetic.sum() + measure.elastic.sum() == pytest.approx(energy, rel=0.15)
    assert measure.kinetic.sum() + measure.elastic.sum() < 1.001 * energy


def test_a_joint_leans_as_far_as_its_spring_gives_way_and_keeps_its_point(fast_engine):
    """At rest the spring bears the push: k θ = m a L/2 cos θ."""
    given = hinged(20.0, damping=2.0, push=Push((5.0, 0.0, 0.0)))
    run = fast_engine(given)
    run.advance(1.0)
    R = run.snapshot().deformation[-1]
    lean = np.arcsin(R[0, 2])
    assert 20.0 * lean == pytest.approx(0.64 * 5.0 * 0.2 * np.cos(lean), rel=0.02)
    foot = run.measure().centre[1] - R @ np.array([0.0, 0.0, 0.2])
    assert np.abs(foot - run.measure().centre[0] - [0, 0, 0.04]).max() < 1e-3


def test_springs_act_as_in_the_reference():
    first, rod = hinged(20.0, 0.1, Push((5.0, 2.0, 0.0))).bodies
    leaves = crown(25.0, 1, 0.1, velocity=(0.1, 0.2, 0.3))
    given = problem(
        first,
        rod,
        leaves,
        cell=CELL,
        gravity=FALL,
        joints=(Joint(0, 1, (0.0, 0.0, 0.0), 20.0, 0.1),),
        excluded_pairs=((0, 1), (0, 2), (1, 2)),
    )
    fast, sure = CpuEngine(given, threads=1), ReferenceEngine(given)
    for _ in range(30):
        dt = min(fast.stable_step(), sure.stable_step())
        fast.step(dt)
        sure.step(dt)
    ours, theirs = fast.measure(), sure.measure()
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 1e-4 * CELL
    assert ours.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-4, abs=1e-6)
    assert ours.elastic == pytest.approx(theirs.elastic, rel=1e-3, abs=1e-9)
    assert ours.viscous_loss == pytest.approx(theirs.viscous_loss, rel=1e-3)


# ---------------------------------------------------------------- from outside


@pytest.mark.parametrize("rigid", [False, True])
def test_an_applied_impulse_gives_exactly_its_momentum(engine, rigid):
    body = ball((0, 0, 0), 0.06, CELL / 2, rigid=rigid)
    run = engine(problem(body, cell=CELL))
    run.advance(0.002)
    run.apply_impulse(0, (0.0, 0.06, 0.0), (0.3, 0.0, 0.1))
    run.advance(0.004)
    measure = run.measure()
    assert measure.momentum[0] == pytest.approx([0.3, 0, 0.1], rel=1e-4, abs=1e-6)
    assert measure.external_impulse[0] == pytest.approx([0.3, 0, 0.1])
    turned = np.cross([0.0, 0.06, 0.0], [0.3, 0, 0.1])
    exact = 1e-3 if rigid else 0.35
    assert measure.angular_momentum[0] == pytest.approx(turned, abs=exact * np.linalg.norm(turned))
    assert measure.kinetic.sum() + measure.elastic.sum() < 1.01 * measure.push_work
    if not rigid:
        assert np.all(np.abs(measure.angular_momentum[0]) <= np.abs(turned) + 1e-6)


def test_an_applied_impulse_moves_what_is_near_and_nothing_beyond_two_cells(engine):
    body = ball((0, 0, 0), 0.08, CELL / 2)
    run = engine(problem(body, cell=CELL))
    run.apply_impulse(0, (0.0, 0.0, 0.07), (0.1, 0.0, 0.0))
    now = run.snapshot()
    away = np.linalg.norm(now.position - [0, 0, 0.07], axis=1)
    speed = now.velocity[:, 0]
    assert np.all(speed[away > 2 * CELL] == 0.0)
    assert np.all(speed[away < 1.9 * CELL] > 0.0)
    assert speed[away < 0.5 * CELL].min() > 2 * speed[away > 1.5 * CELL].max()


@pytest.mark.parametrize("rigid", [False, True])
def test_what_is_pulled_hangs_below_the_hand_by_its_weight_over_the_spring(fast_engine, rigid):
    body = ball((0, 0, 0), 0.06, CELL / 2, stuff=Stuff(young_pa=2e5), rigid=rigid)
    weight = float(body.volume @ body.density) * 9.81
    run = fast_engine(problem(body, cell=CELL, gravity=FALL))
    run.attach_spring(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 500.0)
    run.advance(0.7)
    sunk = run.measure().centre[0, 2]
    assert sunk == pytest.approx(-weight / 500.0, rel=0.02)
    run.attach_spring(0, None, (0.1, 0.0, 0.0), 500.0)
    run.advance(1.4)
    measure = run.measure()
    assert measure.centre[0] == pytest.approx([0.1, 0.0, -weight / 500.0], abs=1.5e-3)
    run.attach_spring(0, None, (0.1, 0.0, 0.0), 0.0)
    run.advance(1.5)
    assert run.measure().momentum[0, 2] == pytest.approx(-weight * 0.1, rel=0.05)


@pytest.mark.parametrize("rigid", [False, True])
def test_hands_act_as_in_the_reference(rigid):
    given = problem(ball((0, 0, 0), 0.06, CELL / 2, rigid=rigid), cell=CELL, gravity=FALL)
    fast, sure = CpuEngine(given, threads=1), ReferenceEngine(given)
    for run in (fast, sure):
        run.apply_impulse(0, (0.0, 0.05, 0.0), (0.1, 0.0, 0.1))
        run.attach_spring(0, (0.0, 0.0, 0.05), (0.1, 0.0, 0.2), 300.0)
    for _ in range(30):
        dt = min(fast.stable_step(), sure.stable_step())
        fast.step(dt)
        sure.step(dt)
    ours, theirs = fast.measure(), sure.measure()
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 1e-4 * CELL
    assert ours.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-4, abs=1e-7)
    assert ours.push_work == pytest.approx(theirs.push_work, rel=1e-3)


def test_a_hand_that_grasps_nothing_is_reported(fast_engine):
    run = fast_engine(problem(ball((0, 0, 0), 0.06, CELL / 2), cell=CELL))
    with pytest.raises(UserError, match="no body 3"):
        run.apply_impulse(3, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(UserError, match="not finite"):
        run.apply_impulse(0, (0.0, 0.0, np.nan), (1.0, 0.0, 0.0))
    with pytest.raises(UserError, match="not held yet"):
        run.attach_spring(0, None, (0.0, 0.0, 0.0), 10.0)
    with pytest.raises(UserError, match="stiffness is -1"):
        run.attach_spring(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1.0)
