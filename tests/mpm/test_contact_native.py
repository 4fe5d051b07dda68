"""The native pieces of contact: every way through them follows the reference or says the same."""

import numpy as np
import pytest
from cost.phase_clock import PhaseClock
from point_bodies import round_body
from test_cpu import CELL, ball, body, problem, side_by_side

from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import FLOOR, Plane

WALL = Plane((1.0, 0.0, 0.0), -0.053)
SLOPE = Plane((0.6, 0.0, 0.8), -0.009)


@pytest.mark.parametrize("planes", [(FLOOR,), (SLOPE,), (FLOOR, WALL), (FLOOR, SLOPE)])
def test_one_plane_or_several_hold_a_body_as_in_the_reference(planes):
    """A plane alone has a way of its own; a corner has the way of bodies that meet."""
    falling = body(ball((0, 0, 0.055), 0.05), velocity=(-0.5, 0.2, -0.8))
    fast, sure = side_by_side(problem(falling, planes=planes), 30)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL
    ours, theirs = fast.measure(), sure.measure()
    assert (np.abs(theirs.plane_impulse).max(axis=(1, 2)) > 0).all()
    assert ours.plane_impulse == pytest.approx(theirs.plane_impulse, rel=1e-4, abs=1e-6)
    assert ours.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-3)
    assert ours.contact_point == pytest.approx(theirs.contact_point, abs=1e-5, nan_ok=True)


def three(stiff=False):
    """Two balls on the floor and one that falls between them."""
    return problem(
        body(ball((-0.045, 0, 0.055), 0.05), rigid=stiff),
        body(ball((0.063, 0, 0.055), 0.05)),
        body(ball((0.01, 0.01, 0.14), 0.05), velocity=(0, 0, -1.0)),
    )


@pytest.mark.parametrize("stiff", [False, True])
def test_three_bodies_and_the_floor_meet_as_in_the_reference(stiff):
    fast, sure = side_by_side(three(stiff), 25)
    ours, theirs = fast.measure(), sure.measure()
    assert (theirs.pair_impulse[2, :2] > 0).all()
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-4 * CELL
    assert ours.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-3)


def test_what_is_rounded_rolls_on_planes_as_in_the_reference():
    rolling = round_body((0, 0, 0.05), velocity=(0.4, 0.1, -0.2))
    fast, sure = side_by_side(problem(rolling, planes=(FLOOR, WALL)), 60)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL
    ours, theirs = fast.measure(), sure.measure()
    assert theirs.plane_impulse[0, 0, 2] > 0 and theirs.momentum[0, 0] > 0
    assert ours.momentum == pytest.approx(theirs.momentum, rel=1e-9, abs=1e-12)
    assert ours.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-9, abs=1e-12)


def test_lists_that_are_too_short_are_lengthened_and_nothing_changes():
    short, roomy = CpuEngine(three(), threads=1), CpuEngine(three(), threads=1)
    short.contact.stage["most_touches"] = 8
    for engine in (short, roomy):
        engine.advance(0.03)
    assert short.contact.stage["most_touches"][0] > roomy.contact.stage["most_touches"][0]
    assert np.array_equal(short.snapshot().position, roomy.snapshot().position)
    assert short.measure().friction_loss == roomy.measure().friction_loss


@pytest.mark.parametrize("stiff", [False, True])
def test_contact_does_not_depend_on_the_number_of_threads(stiff):
    one, many = CpuEngine(three(stiff), threads=1), CpuEngine(three(stiff), threads=3)
    many.program.smallest_share = 10
    many.connect()
    for engine in (one, many):
        engine.advance(0.03)
    assert np.array_equal(one.snapshot().position, many.snapshot().position)
    for name in ("pair_impulse", "plane_impulse", "friction_loss", "contact_point"):
        ours, theirs = getattr(one.measure(), name), getattr(many.measure(), name)
        assert np.array_equal(ours, theirs, equal_nan=True), name


def bricks(centre, edge=0.08):
    axis = (np.arange(8) + 0.5) / 8 * edge - edge / 2
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3) + centre


def tower(count):
    """Cubes on one another, which touch the floor at their corners and edges."""
    centres = [np.array([0.003, 0.007, 0.04 + 0.08 * k]) for k in range(count)]
    skin = bricks(np.zeros(3), 0.08) * (8 / 7)
    skin = skin[np.abs(skin).max(axis=1) > 0.0399]
    cubes = [body(bricks(c), rigid=True, surface=skin + c) for c in centres]
    return problem(*cubes, restitution=0.0, gravity_ramp=0.05), np.array(centres)


def test_a_tower_of_rigid_cubes_creeps_by_less_than_a_hundredth_of_a_cell():
    given, centres = tower(5)
    engine = CpuEngine(given, threads=1)
    engine.advance(0.4)
    moved = np.abs(engine.measure().centre - centres) / CELL
    assert moved[:, :2].max() < 0.01
    assert moved[:, 2].max() < 0.02


def test_at_rest_rigid_contacts_begin_with_what_they_bore_before():
    """A stack that stands needs a few sweeps, not the hundred of the first touch."""
    engine = CpuEngine(tower(3)[0], threads=1)
    engine.advance(0.2)
    assert engine.contact.stage["pasts"][0] > 50
    assert engine.contact.stage["sweeps"][0] < 10


def test_bodies_more_than_a_cell_and_a_quarter_apart_are_not_looked_at():
    """Their splines overlap, but no gap between them closes in a step."""
    low, high = bricks(np.array([0.0, 0.0, 0.2])), bricks(np.array([0.0, 0.0, 0.2]))
    high[:, 2] += 0.08 + 1.2 * CELL
    given = problem(body(low), body(high, velocity=(0, 0, -0.5)), planes=(), gravity=(0.0, 0.0, 0.0))
    engine = CpuEngine(given, threads=1)
    engine.advance(0.1 * CELL / 0.5)
    assert engine.contact.stage["touches"][0] == 0
    assert engine.measure().pair_impulse[0, 1] == 0
    engine.advance(1.0 * CELL / 0.5)
    assert engine.contact.stage["touches"][0] > 0
    engine.advance(2.0 * CELL / 0.5)
    assert engine.measure().pair_impulse[0, 1] > 0


def test_a_body_between_two_that_are_far_apart_meets_both_as_in_the_reference():
    """The outer two share blocks of nodes, but nothing else: who lies between is not forgotten."""
    side = 4 * CELL
    near = bricks(np.array([0.0, 0.0, 0.2]), side)
    far = near + np.array([side + 1.5 * CELL, 0.0, 0.0])
    lid = near + np.array([0.5 * side + 0.75 * CELL, 0.0, side - 0.2 * CELL])
    bodies = (body(near), body(far), body(lid, velocity=(0, 0, -1.0)))
    fast, sure = side_by_side(problem(*bodies, planes=()), 20)
    ours, theirs = fast.measure(), sure.measure()
    assert (theirs.pair_impulse[2, :2] > 0).all()
    assert ours.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-3)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-4 * CELL


def mat_on_a_slab(apart):
    """A soft mat on a rigid slab one cell thick, whose surface points are so far apart [m]."""
    axis, flat = np.arange(-0.3, 0.3, CELL / 2), np.arange(-0.3, 0.301, apart)
    mat = np.stack(np.meshgrid(axis, axis, [0.0, CELL / 2], indexing="ij"), -1).reshape(-1, 3)
    slab, lift = mat - (0, 0, 1.5 * CELL), (0, 0, CELL / 4)
    faces = np.stack(np.meshgrid(flat, flat, [-CELL, 0.0], indexing="ij"), -1).reshape(-1, 3)
    return problem(body(slab + lift, rigid=True, surface=faces), body(mat + lift, velocity=(0, 0, -0.1)), planes=())


@pytest.mark.slow
def test_a_mat_on_a_slab_meets_it_as_in_the_reference():
    """Nodes pass over runs of the slab's surface points that are far from their line."""
    fast, sure = side_by_side(mat_on_a_slab(0.02), 6)
    ours, theirs = fast.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0
    assert ours.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-4)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL


def test_nodes_look_only_at_surface_points_near_their_line():
    """Every node looked at every point: a mat on a table took 18 ms a step, and did not end."""

    def solving(apart):
        engine = CpuEngine(mat_on_a_slab(apart), threads=1)
        engine.advance(4 * engine.stable_step())
        clock, before = PhaseClock(engine.program), engine.steps.count
        engine.advance(engine.time + 20 * engine.stable_step())
        return clock.seconds()["solve"] / (engine.steps.count - before)

    assert solving(0.005) < 5.0 * solving(0.02)  # 16 times as many points
