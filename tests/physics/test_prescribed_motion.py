"""Bodies that move as told: a pusher, two fingers, a turntable."""

import numpy as np
import pytest
from laws.bodies import Stuff, box, box_surface, cylinder, floor, problem

from corporeal.core.types import Keyframes

G = 9.81
DOWN = (0.0, 0.0, -G)
STILL = (0.0, 0.0, 0.0)


def path(time, shift=None, turn=None):
    """Rows of shifts [m] along x, or of whole shifts, and of angles about z [rad] since 0."""
    along = np.zeros((len(time), 3)) if shift is None else np.array(shift, float)
    if along.ndim == 1:
        along = np.column_stack([along, 0 * along, 0 * along])
    steps = np.diff(np.zeros(len(time)) if turn is None else turn, prepend=0.0)
    turns = [(0.0, 0.0, float(a)) for a in steps]
    return Keyframes(tuple(map(float, time)), tuple(map(tuple, along.tolist())), tuple(turns))


# ---------------------------------------------------------------- a pusher

CELL, SIZE = 0.025, (0.2, 0.1, 0.1)


def pushed(friction, shift=((0.0, 1.0), (0.0, 0.5))):
    """A block on a floor and, beside it, what moves at half a metre per second."""
    middle, behind = (0.1, 0.05, 0.05), (-0.05, 0.05, 0.05)
    block = box(middle, SIZE, CELL / 2, rigid=True, surface=box_surface(middle, SIZE))
    thick = (0.1, 0.1, 0.1)
    pusher = box(behind, thick, CELL / 2, rigid=True, velocity=(0.5, 0.0, 0.0), path=path(*shift))
    table = np.zeros((3, 3))
    table[0, 2] = table[2, 0] = friction
    return problem(block, pusher, cell=CELL, friction=table, planes=[floor()], gravity=DOWN)


def test_a_pusher_pushes_as_hard_as_coulomb_says(fast_engine):
    """F = μ m g, and its work is F s: both are in the ledger as its mover's."""
    run = fast_engine(pushed(0.4))
    run.advance(0.2)
    before = run.measure()
    run.advance(0.6)
    after = run.measure()
    weight = after.mass[0] * G
    force = (after.external_impulse[1, 0] - before.external_impulse[1, 0]) / 0.4
    assert force == pytest.approx(0.4 * weight, rel=0.03)
    work = after.push_work - before.push_work
    assert work == pytest.approx(0.4 * weight * 0.2, rel=0.03)
    assert after.friction_loss - before.friction_loss == pytest.approx(work, rel=0.03)
    assert after.centre[0, 0] - before.centre[0, 0] == pytest.approx(0.2, abs=0.01 * CELL)


def test_a_pusher_of_what_slides_freely_pushes_not_at_all(fast_engine):
    run = fast_engine(pushed(0.0))
    run.advance(0.2)
    before = run.measure()
    run.advance(0.6)
    after = run.measure()
    force = (after.external_impulse[1, 0] - before.external_impulse[1, 0]) / 0.4
    assert abs(force) < 1e-3 * after.mass[0] * G


def test_what_is_pushed_slides_on_for_its_braking_distance(fast_engine):
    """v²/2 μ g after the pusher has stopped; the path ends there."""
    run = fast_engine(pushed(0.4, shift=((0.0, 0.4), (0.0, 0.2))))
    run.advance(0.4)
    left = run.measure().centre[0, 0]
    run.advance(0.8)
    m = run.measure()
    assert m.centre[0, 0] - left == pytest.approx(0.25 / (2 * 0.4 * G), rel=0.03)
    assert m.centre[1, 0] == pytest.approx(-0.05 + 0.2, abs=1e-9)


@pytest.mark.slow
def test_prescribed_motion_is_exact_and_in_the_ledger_to_the_last_digit(engine):
    """Momentum and energy change by what contacts, gravity and the mover give, and no more."""
    turn = np.linspace(0.0, 3.0, 7)
    told = path(np.linspace(0.0, 0.3, 7), shift=0.05 * np.sin(np.linspace(0.0, 6.0, 7)), turn=turn)
    size = (0.1, 0.06, 0.06)
    rod = box((0.0, 0.0, 0.2), size, CELL / 2, rigid=True, path=told, pivot=(0.03, 0.0, 0.2))
    soft = box((0.09, 0.0, 0.2), (0.075,) * 3, CELL / 2, stuff=Stuff(young_pa=2e4))
    run = engine(problem(rod, soft, cell=CELL, friction=0.3, gravity=DOWN))
    before = run.measure()
    run.advance(0.2)
    after = run.measure()
    assert after.pair_impulse[0, 1] > 1e-2
    gained = (after.momentum - before.momentum).sum(axis=0)
    given = after.external_impulse.sum(axis=0)
    assert np.abs(gained - given).max() < 10 * run.round_off * np.abs(given).max()
    k = 4
    start = np.array([-0.03, 0.0, 0.0])
    c, s = np.cos(turn[k]), np.sin(turn[k])
    there = [0.03 + told.shift[k][0] + c * start[0], s * start[0], 0.2]
    np.testing.assert_allclose(after.centre[0], there, atol=1e-9)

    def energy(m):
        lost = m.friction_loss + m.plastic_loss + m.viscous_loss
        return m.kinetic.sum() + m.elastic.sum() + m.potential.sum() + lost - m.push_work

    assert energy(after) - energy(before) < 0.02 * abs(after.push_work)


# ---------------------------------------------------------------- two fingers

FINE, SIDE = 0.0125, 0.1
WEIGHT = 1000.0 * SIDE**3 * G


def lifted(friction, engine):
    """Squeeze a soft cube, lift the fingers by 6 mm, and give the cube's rise and their force."""
    soft = Stuff(young_pa=2e5, poisson=0.0, density=1000.0)
    bodies = [box((0.0, 0.0, SIDE / 2), (SIDE,) * 3, FINE / 2, stuff=soft)]
    for side in (-1.0, 1.0):
        close = -side * 0.0015
        rows = [[0, 0, 0], [close, 0, 0], [close, 0, 0], [close, 0, 0.006], [close, 0, 0.006]]
        told = path([0.0, 0.15, 0.3, 1.1, 3.0], rows)
        middle = (side * (SIDE / 2 + 0.02 + 0.0005), 0.0, SIDE / 2)
        bodies.append(box(middle, (0.04, 0.15, 0.15), FINE / 2, rigid=True, path=told))
    table = np.zeros((4, 4))
    table[0, 1:3] = table[1:3, 0] = friction
    run = engine(problem(*bodies, cell=FINE, friction=table, planes=[floor()], gravity=DOWN, gravity_ramp=0.1))
    run.advance(0.3)
    start = run.measure()
    run.advance(1.1)
    end = run.measure()
    force = (end.pair_impulse[0, 1] - start.pair_impulse[0, 1]) / 0.8
    return end.centre[0, 2] - start.centre[0, 2], force


@pytest.mark.slow
def test_two_fingers_lift_a_block_where_friction_exceeds_its_weight(fast_engine):
    """2 μ N against m g, N from the ledger: it is held at 1.03 and lost at 0.97."""
    _, force = lifted(0.05, fast_engine)
    limit = WEIGHT / (2 * force)
    held, lost = (lifted(share * limit, fast_engine) for share in (1.03, 0.97))
    assert held[1] == pytest.approx(force, rel=0.02)
    assert lost[1] == pytest.approx(force, rel=0.02)
    assert held[0] > 0.8 * 0.006
    assert lost[0] < 0.2 * 0.006


# ---------------------------------------------------------------- a turntable


@pytest.mark.slow
def test_a_turntable_throws_a_coin_off_where_friction_ends(fast_engine):
    """ω² r = μ g: the coin stays where it lies up to this speed, and slides outwards beyond."""
    friction, radius, cell, height = 0.3, 0.1, 0.005, 0.02
    limit = np.sqrt(friction * G / radius)
    time = np.linspace(0.0, 1.0, 41)
    angle = limit * (0.85 * time + 0.15 * time**2)
    first = 0.85 * limit
    told = path(time, turn=angle)
    slab = box((radius, 0.0, 0.09), (0.07, 0.07, 0.02), cell / 2, rigid=True, path=told, pivot=(0.0, 0.0, 0.1))
    coin = cylinder(
        (radius, 0.0, 0.1 + height / 2),
        0.02,
        height,
        cell / 2,
        rigid=True,
        velocity=(0.0, first * radius, 0.0),
        spin=(0.0, 0.0, first),
    )
    run = fast_engine(problem(slab, coin, cell=cell, friction=friction, gravity=DOWN))
    before = run.measure()

    def outwards(share):
        """How far the coin slid when the table turns at a share of the limit [m]."""
        run.advance((share - 0.85) / 0.3)
        return float(np.hypot(*run.measure().centre[1, :2])) - radius

    slid = [outwards(share) for share in (0.98, 1.0, 1.03, 1.06)]
    assert slid[1] < 2e-4 * radius
    assert slid[2] > 1e-3 * radius
    assert slid[3] > 1e-2 * radius
    after = run.measure()
    gained = sum(m.sum() for m in (after.kinetic, after.potential))
    gained += after.friction_loss - sum(m.sum() for m in (before.kinetic, before.potential))
    assert gained == pytest.approx(after.push_work, rel=0.01)
