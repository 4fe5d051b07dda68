"""The production engine follows the reference, keeps its word, and says what went wrong."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from point_bodies import CELL, ball, body, problem, step_together

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law, Push
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.reference.engine import ReferenceEngine


def side_by_side(given, steps):
    return step_together(CpuEngine(given, threads=1), ReferenceEngine(given), steps)


@pytest.mark.slow
@pytest.mark.parametrize("law", list(Law))
def test_every_law_moves_as_in_the_reference_through_impact_and_friction(law):
    low = body(ball((0, 0, 0.055), 0.05), law, (0, 0, -0.5))
    high = body(ball((0.02, 0.01, 0.155), 0.05), law, (0, 0, -1.5))
    fast, sure = side_by_side(problem(low, high), 25)
    here, there = fast.snapshot(), sure.snapshot()
    assert np.abs(here.position - there.position).max() < 2e-5 * CELL
    assert np.abs(here.deformation - there.deformation).max() < 1e-4
    assert np.abs(here.motion - there.motion).max() < 1e-4
    assert np.abs(here.plastic_strain - there.plastic_strain).max() < 1e-4
    ours, theirs = fast.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0 and theirs.plane_impulse[0, 0, 2] > 0
    assert ours.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-4)
    assert ours.plane_impulse == pytest.approx(theirs.plane_impulse, rel=1e-4, abs=1e-6)
    assert ours.elastic == pytest.approx(theirs.elastic, rel=1e-3)
    for loss in ("friction_loss", "plastic_loss"):
        assert getattr(ours, loss) == pytest.approx(getattr(theirs, loss), rel=1e-3, abs=1e-7)
    assert ours.viscous_loss == pytest.approx(theirs.viscous_loss, rel=0.05)
    assert ours.first_contact == pytest.approx(theirs.first_contact, nan_ok=True)
    assert ours.contact_point == pytest.approx(theirs.contact_point, abs=1e-5, nan_ok=True)


@pytest.mark.slow
@pytest.mark.parametrize("law", list(Law))
@pytest.mark.parametrize("stretch", [(40.0, -15.0, 25.0), (-25.0, -25.0, 5.0)])
def test_every_law_holds_far_beyond_where_its_series_do(law, stretch):
    """Small strains are taken by series, others by eigenvalues; a body here sees both."""
    points = ball((0, 0, 0), 0.05)
    given = problem(
        body(points, law, young_pa=1e4, yield_stress=5e2, loss=0.0),
        body(points + np.array([0.5, 0, 0]), law, young_pa=1e4, yield_stress=5e2, loss=0.0),
        planes=(),
        gravity=(0.0, 0.0, 0.0),
    )
    shear = np.array([[0, 9.0, 0], [0, 0, -6.0], [4.0, 0, 0]])
    given.bodies[0].velocity[:] = points @ (np.diag(stretch) + shear).T
    fast, sure = side_by_side(given, 40)
    here, there = fast.snapshot(), sure.snapshot()
    size = np.linalg.norm(there.motion - np.eye(3), axis=(1, 2))
    assert size.max() > 0.5
    assert np.abs(here.position - there.position).max() < 2e-4 * CELL
    assert np.abs(here.deformation - there.deformation).max() < 1e-3
    assert np.abs(here.plastic_strain - there.plastic_strain).max() < 1e-3
    assert fast.measure().elastic == pytest.approx(sure.measure().elastic, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("stiff", [(False, True), (True, True)])
def test_rigid_bodies_move_as_in_the_reference(stiff):
    low, high = ball((0, 0, 0.055), 0.05), ball((0.02, 0.01, 0.155), 0.05)
    given = problem(
        body(low, velocity=(0, 0, -0.5), rigid=stiff[0], surface=low),
        body(high, velocity=(0.3, 0, -1.5), rigid=stiff[1], density=3000.0),
    )
    fast, sure = side_by_side(given, 40)
    # The production engine stops sweeping when little is left to gain.
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-4 * CELL
    ours, theirs = fast.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0 and theirs.plane_impulse[0, 0, 2] > 0
    assert ours.momentum == pytest.approx(theirs.momentum, rel=1e-3, abs=1e-4)
    assert ours.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("stiff", [False, True])
def test_one_shared_field_moves_as_in_the_reference(stiff):
    low = body(ball((0, 0, 0.055), 0.05), velocity=(0, 0, -0.5))
    high = body(ball((0.02, 0.01, 0.155), 0.05), velocity=(0, 0, -1.5), rigid=stiff)
    fast, sure = side_by_side(problem(low, high, contact="single"), 25)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL


def test_pushes_and_ramped_gravity_enter_as_in_the_reference():
    push = Push((2.0, 0.0, 1.0), 0.0031, 0.0117)
    given = problem(
        body(ball((0, 0, 0.3), 0.05), push=push),
        body(ball((0.3, 0, 0.3), 0.05), push=push, rigid=True),
        gravity_ramp=0.01,
    )
    fast, sure = CpuEngine(given), ReferenceEngine(given)
    for engine in (fast, sure):
        engine.advance(0.02)
    ours, theirs = fast.measure(), sure.measure()
    assert ours.external_impulse == pytest.approx(theirs.external_impulse)
    assert ours.momentum == pytest.approx(ours.external_impulse, rel=1e-5, abs=1e-7)
    assert ours.push_work == pytest.approx(theirs.push_work, rel=0.02)


def fall():
    stone = ball((0, 0, 0.17), 0.05)
    return problem(
        body(ball((0, 0, 0.06), 0.05), Law.DRUCKER_PRAGER, (1.0, 0, -1.0)),
        body(stone, rigid=True, surface=stone, name="stone"),
    )


def test_going_on_from_a_saved_state_changes_nothing():
    straight, broken = CpuEngine(fall()), CpuEngine(fall())
    for engine in (straight, broken):
        engine.advance(0.05)
    again = CpuEngine(fall())
    again.restore(broken.save())
    for engine in (straight, again):
        engine.advance(0.1)
    assert straight.steps.count == again.steps.count
    for name, value in vars(straight.snapshot()).items():
        assert np.array_equal(value, getattr(again.snapshot(), name)), name
    for name, value in vars(straight.measure()).items():
        assert np.array_equal(value, getattr(again.measure(), name), equal_nan=True), name


def crowd():
    """A pile of everything: all laws, a rigid body, contacts, a push, a tall pole."""
    axes = [np.arange(0, size, CELL / 2) for size in (0.03, 0.03, 0.5)]
    pole = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3) + np.array((-0.2, 0, 0.01))
    laws = [body(ball((0.11 * k, 0, 0.055), 0.05), law) for k, law in enumerate(Law)]
    stone = ball((0.1, 0.02, 0.16), 0.05)
    duck = ball((0.3, 0.01, 0.16), 0.05)
    return problem(
        *laws,
        body(pole, velocity=(0.5, 0, -2.0)),
        body(stone, velocity=(0, 0, -2.0), rigid=True, surface=stone, name="stone"),
        body(duck, velocity=(0, 0, -2.0), push=Push((5.0, 0.0, 0.0), 0.004, 0.006)),
    )


@pytest.mark.parametrize("threads", [2, 3, 4, 11])
def test_the_number_of_threads_changes_nothing(threads):
    one, many = CpuEngine(crowd(), threads=1), CpuEngine(crowd(), threads=threads)
    many.program.smallest_share = 10
    many.connect()
    assert many.program.hands == threads
    assert many.world["colour"][0, 4:].any()
    for engine in (one, many):
        engine.advance(0.012)
    assert one.measure().pair_impulse.max() > 0
    for name, value in one.save().items():
        assert np.array_equal(value, many.save()[name], equal_nan=True), name


@pytest.mark.parametrize("poisson", [0.2, 0.48])
def test_steps_are_those_of_each_matter_and_not_of_the_fastest_with_the_greatest_loss(poisson):
    """A couch of firm foam with a limp, lossy pillow: branches stiffen the pillow alone."""
    points = ball((0, 0, 0.05), 0.05)
    limp = points[:, 0] > 0.0
    mixed = body(points, velocity=(0, 0, -1.0), poisson=poisson)
    mixed.young_pa[:] = np.where(limp, 5e3, 6e4)
    mixed.loss[:] = np.where(limp, 1.1, 0.2)
    fast, sure = CpuEngine(problem(mixed), threads=1), ReferenceEngine(problem(mixed))
    assert fast.stable_step() == pytest.approx(sure.stable_step(), rel=1e-3)
    step_together(fast, sure, 10)
    assert fast.stable_step() == pytest.approx(sure.stable_step(), rel=0.02)


def test_steps_taken_one_by_one_are_the_steps_of_a_run():
    run, single = CpuEngine(crowd()), CpuEngine(crowd())
    run.advance(0.008)
    while single.time < 0.008:
        left = 0.008 - single.time
        single.step(left / max(1, np.ceil(left / single.stable_step() - 1e-9)))
    assert run.steps.count == single.steps.count
    here, there = run.snapshot(), single.snapshot()
    assert np.abs(here.position - there.position).max() < 1e-9 * CELL


def test_a_body_may_travel_as_far_as_it_likes():
    engine = CpuEngine(problem(body(ball((0, 0, 0), 0.03), velocity=(30.0, 0, 0)), planes=()))
    engine.advance(0.5)
    assert engine.measure().centre[0] == pytest.approx([15.0, 0, -0.5 * 9.81 * 0.25], abs=2e-3)


def test_a_body_that_flies_apart_is_an_error_a_person_can_read():
    points = ball((0, 0, 0.1), 0.04)
    given = problem(body(points, name="duck"))
    given.bodies[0].velocity[0] = np.inf
    engine = CpuEngine(given)
    with pytest.raises(SimulationError, match="'duck'"):
        engine.advance(0.1)
    assert engine.lost.any()
    assert engine.time == 0.0


def test_a_lone_rigid_body_keeps_its_angular_momentum():
    points = ball((0, 0, 0), 0.05) * np.array([1.0, 0.7, 0.4])
    given = problem(body(points, rigid=True), planes=(), gravity=(0.0, 0.0, 0.0))
    spin = np.array([3.0, 20.0, 1.0])
    given.bodies[0].velocity[:] = np.cross(spin, points)
    engine = CpuEngine(given)
    before = engine.measure()
    engine.advance(1.0)
    after = engine.measure()
    assert after.angular_momentum == pytest.approx(before.angular_momentum, rel=1e-12)
    assert after.kinetic == pytest.approx(before.kinetic, rel=1e-3)


@pytest.mark.slow
def test_two_processes_may_compile_at_once(tmp_path):
    code = (
        f"import warp as wp; wp.config.kernel_cache_dir = {str(tmp_path)!r}\n"
        "import numpy as np\n"
        "from corporeal.mpm.cpu.layout import WORLD_RECORD\n"
        "from corporeal.mpm.cpu.program import CpuProgram\n"
        "CpuProgram(np.zeros(1, WORLD_RECORD.dtype), 1)\n"
    )
    running = [subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE) for _ in range(2)]
    for process in running:
        _, words = process.communicate(timeout=200)
        assert process.returncode == 0, words


def test_the_control_books_its_floor_as_the_floor():
    """With one field for all, a touch of the floor once went down as a touch of the bodies."""
    balls = [body(ball((x, 0, 0.059), 0.06), velocity=(0, 0, -1)) for x in (0.0, 0.3)]
    engine = CpuEngine(problem(*balls, contact="single"))
    engine.advance(0.02)
    first = engine.measure().first_contact
    assert np.isnan(first[0, 1])
    assert np.isfinite(first[0, 2])


def test_bodies_that_travel_together_are_sorted_together(monkeypatch):
    """Particles lie down anew after every sort of any body, so sorts must not come one by one."""
    balls = [body(ball((0.1537 * k, 0, 0), 0.05), velocity=(2.0, 0, 0), loss=0.0) for k in range(4)]
    engine = CpuEngine(problem(*balls, planes=(), gravity=(0.0, 0.0, 0.0)))
    sorts = []
    monkeypatch.setattr(engine, "connect", lambda go=engine.connect: (sorts.append(1), go()))
    engine.advance(6 * CELL / 2.0)
    assert 3 <= len(sorts) <= 8


def test_nodes_are_empty_where_nothing_lies_whichever_field_is_sorted():
    """Where one field was sorted, those of the others took each other's place and kept old nodes.

    What came to a block of nodes again that it had just left met what lay there before.
    """
    centre = np.array([0.4, 0.0, 14.5 * CELL - 0.0451])  # its top is where it reaches a block more
    still = body(ball(centre))
    breathing = replace(still, velocity=40.0 * (still.position - centre))
    other = body(ball((0.0, 0.0, 0.2)))
    engine = CpuEngine(problem(other, breathing, planes=(), gravity=(0.0, 0.0, 0.0)), threads=1)
    reached = set()
    for _ in range(150):
        engine.step(engine.stable_step())
        reached.add(int((engine.window[1].used > 0).sum()))
        engine._sort({0})
        window, record = engine.window[1], engine.field[1]
        for side, nodes in ((record["side"], window.node), (1 - record["side"], window.next)):
            clean = (window.used >> int(side)) & 1 == 0
            assert not nodes[: len(clean)][clean].any()
    assert len(reached) > 1
