"""The engine for CUDA cards, run on the processor: it follows the reference and keeps its word."""

from dataclasses import dataclass, fields

import numpy as np
import pytest
from laws import asked
from laws.asked import CARD, on_device
from point_bodies import CELL, ball, body, problem, round_body, step_together

from corporeal.core.errors import SimulationError, UserError
from corporeal.core.types import Law, Push
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cuda import program
from corporeal.mpm.cuda.engine import CudaEngine
from corporeal.mpm.problem import ENGINES, Problem
from corporeal.mpm.reference.engine import ReferenceEngine

ARCHITECTURES = [86, 90, 120]
OLDEST = ARCHITECTURES[:1]

AS_IT_WAS = pytest.mark.skipif(bool(CARD), reason="a card adds in no fixed order")
"""Bit for bit is asked of the processor alone."""


def on_processor(given):
    return CudaEngine(given, device="cpu")


def side_by_side(given, steps):
    return step_together(on_device(given), ReferenceEngine(given), steps)


def fall(law=Law.DRUCKER_PRAGER):
    stone = ball((0, 0, 0.17))
    return problem(
        body(ball((0, 0, 0.06)), law, (1.0, 0, -1.0)),
        body(stone, velocity=(0, 0, -2.0), rigid=True, surface=stone, name="stone"),
    )


def same(here, there):
    for name, value in vars(here).items():
        assert np.array_equal(value, getattr(there, name), equal_nan=True), name


# ---------------------------------------------------------------- the reference


@pytest.mark.slow
@pytest.mark.parametrize("law", list(Law))
def test_every_law_moves_as_in_the_reference_through_impact_and_friction(law):
    low = body(ball((0, 0, 0.055)), law, (0, 0, -0.5))
    high = body(ball((0.02, 0.01, 0.155)), law, (0, 0, -1.5))
    ours, sure = side_by_side(problem(low, high), 20)
    here, there = ours.snapshot(), sure.snapshot()
    assert np.abs(here.position - there.position).max() < 2e-6 * CELL
    assert np.abs(here.velocity - there.velocity).max() < 2e-5
    assert np.abs(here.deformation - there.deformation).max() < 2e-6
    assert np.abs(here.motion - there.motion).max() < 2e-6
    assert np.abs(here.plastic_strain - there.plastic_strain).max() < 2e-6
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0 and theirs.plane_impulse[0, 0, 2] > 0
    for name in ("mass", "centre", "momentum", "kinetic", "elastic", "potential", "speed"):
        assert getattr(mine, name) == pytest.approx(getattr(theirs, name), rel=2e-5, abs=1e-7)
    for name in ("pair_impulse", "plane_impulse", "external_impulse", "angular_momentum"):
        assert getattr(mine, name) == pytest.approx(getattr(theirs, name), rel=2e-5, abs=1e-6)
    for name in ("friction_loss", "plastic_loss", "viscous_loss"):
        assert getattr(mine, name) == pytest.approx(getattr(theirs, name), rel=1e-4, abs=1e-8)
    for name in ("first_contact", "last_contact"):
        assert getattr(mine, name) == pytest.approx(getattr(theirs, name), abs=1e-9, nan_ok=True)
    # A mean of places, weighted by impulses: no nearer than these are, times a cell.
    place = pytest.approx(theirs.contact_point, abs=2e-5 * CELL, nan_ok=True)
    assert mine.contact_point == place


@pytest.mark.parametrize("law", [Law.COROTATED, Law.NEO_HOOKEAN, Law.HENCKY])
def test_what_is_stiff_in_bulk_takes_its_pressure_from_around_as_in_the_reference(law):
    soft = body(ball((0, 0, 0.055)), law, (0.3, 0, -1.0), poisson=0.47, young_pa=5e4)
    ours, sure = side_by_side(problem(soft), 20)
    assert sure.matter.uses_mean_dilatation.all()
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-6 * CELL
    assert ours.measure().elastic == pytest.approx(sure.measure().elastic, rel=1e-4)


@pytest.mark.parametrize("pointed", [True, False])
def test_a_rigid_ball_on_a_soft_one_moves_as_in_the_reference(pointed):
    low, high = ball((0, 0, 0.055)), ball((0.02, 0.01, 0.155))
    given = problem(
        body(low, velocity=(0, 0, -0.5)),
        body(high, velocity=(0.3, 0, -1.5), rigid=True, density=3000.0, surface=high if pointed else np.zeros((0, 3))),
    )
    ours, sure = side_by_side(given, 30)
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-6 * CELL
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0 and theirs.plane_impulse[0, 0, 2] > 0
    assert mine.momentum == pytest.approx(theirs.momentum, rel=1e-5, abs=1e-6)
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-5, abs=1e-6)
    assert mine.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-4)


def test_what_is_rounded_rolls_as_in_the_reference():
    ours, sure = side_by_side(problem(round_body((0, 0, 0.05), velocity=(0.4, 0.1, -0.2))), 40)
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-6 * CELL
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.plane_impulse[0, 0, 2] > 0
    assert mine.momentum == pytest.approx(theirs.momentum, rel=1e-5, abs=1e-7)
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-5, abs=1e-7)


def test_one_shared_field_moves_as_in_the_reference():
    low = body(ball((0, 0, 0.055)), velocity=(0, 0, -0.5))
    high = body(ball((0.02, 0.01, 0.155)), velocity=(0, 0, -1.5), young_pa=2e5)
    ours, sure = side_by_side(problem(low, high, contact="single"), 24)
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-6 * CELL
    assert np.isfinite(ours.measure().first_contact[0, 2])
    assert np.isnan(ours.measure().first_contact[0, 1])


def test_pushes_and_ramped_gravity_enter_as_in_the_reference():
    push = Push((2.0, 0.0, 1.0), 0.0031, 0.0117)
    given = problem(
        body(ball((0, 0, 0.3)), push=push), body(ball((0.3, 0, 0.3)), push=push, rigid=True), gravity_ramp=0.01
    )
    ours, sure = on_device(given), ReferenceEngine(given)
    for engine in (ours, sure):
        engine.advance(0.02)
    mine, theirs = ours.measure(), sure.measure()
    assert mine.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-12)
    assert mine.momentum == pytest.approx(mine.external_impulse, rel=1e-5, abs=1e-7)
    assert mine.push_work == pytest.approx(theirs.push_work, rel=0.02)


# ---------------------------------------------------------------- time and memory


def test_a_frame_ends_exactly_where_it_should():
    engine = on_device(fall())
    engine.advance(1 / 60)
    assert engine.time == 1 / 60
    assert engine.steps.count > 3
    assert 0 < engine.steps.smallest <= engine.steps.largest <= 1 / 60


@AS_IT_WAS
def test_going_on_from_a_saved_state_changes_nothing():
    straight, broken = on_device(fall()), on_device(fall())
    for engine in (straight, broken):
        engine.advance(0.03)
    again = on_device(fall())
    again.restore(broken.save())
    for engine in (straight, again):
        engine.advance(0.06)
    assert straight.steps == again.steps
    same(straight.snapshot(), again.snapshot())
    same(straight.measure(), again.measure())


def test_too_little_room_is_enlarged_and_nothing_is_lost_or_done_twice():
    given = fall(Law.NEO_HOOKEAN)
    ample, cramped = on_device(given), on_device(given)
    cramped.arrays.contacts = cramped.memory.contacts(given, 2)
    cramped.arrays.grid = cramped.memory.grid(given, 4)
    for engine in (ample, cramped):
        engine.advance(0.04)
    assert cramped.arrays.contacts.room > 2 and cramped.arrays.grid.room > 4
    assert ample.steps == cramped.steps
    assert ample.measure().pair_impulse[0, 1] > 0
    apart = np.abs(ample.snapshot().position - cramped.snapshot().position).max()
    assert apart < 1e-5 * CELL
    mine, theirs = ample.measure(), cramped.measure()
    assert mine.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-14)
    assert mine.viscous_loss == pytest.approx(theirs.viscous_loss, rel=1e-4)


def test_a_table_of_blocks_that_is_full_is_searched_once_and_then_enlarged():
    """A table of eight for more blocks than that: who looked for one went round in it for ever."""
    engine = on_device(fall())
    engine.arrays.grid = engine.memory.grid(engine.problem, 2)
    engine.program.forget()
    engine.advance(0.002)
    assert engine.arrays.grid.room > 16
    assert engine.measure().mass.sum() > 0 and engine.time == 0.002


def test_a_body_may_travel_as_far_as_it_likes():
    engine = on_device(problem(body(ball((0, 0, 0), 0.03), velocity=(30, 0, 0)), planes=()))
    engine.advance(0.5)
    assert engine.measure().centre[0] == pytest.approx([15.0, 0, -0.5 * 9.81 * 0.25], abs=2e-3)


@pytest.mark.parametrize("rigid", [False, True])
def test_a_body_that_flies_apart_is_an_error_a_person_can_read(rigid):
    given = problem(body(ball((0, 0, 0.1)), name="duck", rigid=rigid))
    engine = on_device(given)
    engine.advance(0.01)
    good = engine.save()
    broken = {k: v.copy() for k, v in good.items()}
    broken["rigid.speed" if rigid else "particle.velocity"][0, 0] = np.inf
    engine.restore(broken)
    with pytest.raises(SimulationError, match="'duck'"):
        engine.advance(0.1)
    assert engine.lost.any()
    assert engine.time == 0.01
    engine.restore(good)
    engine.advance(0.02)
    assert not engine.measure().lost.any()


# ---------------------------------------------------------------- what it refuses


def test_laws_are_asked_of_the_card_that_is_named_and_of_no_other(monkeypatch):
    given = problem(body(ball((0, 0, 0.1), 0.02)))
    for build in (asked.on_device, asked.production):
        monkeypatch.setattr(asked, "CARD", "cuda:77")
        with pytest.raises(UserError, match="cuda:77"):
            build(given)
        monkeypatch.setattr(asked, "CARD", "cpu")
        assert isinstance(build(given), CudaEngine)
    monkeypatch.setattr(asked, "CARD", "")
    assert isinstance(asked.production(given), CpuEngine)


def test_without_a_card_it_says_what_to_do():
    if program.wp.get_cuda_devices():
        pytest.skip("there is a card")
    with pytest.raises(UserError, match="--engine cpu"):
        CudaEngine(problem(body(ball((0, 0, 0.1)))))
    assert ENGINES["cuda"] == "corporeal.mpm.cuda.engine:CudaEngine"


def test_what_it_cannot_do_it_names():
    rigid = problem(body(ball((0, 0, 0.1)), rigid=True), contact="single")
    with pytest.raises(UserError, match="shared field"):
        on_device(rigid)


def test_what_a_later_contract_asks_for_is_refused_and_not_left_out():
    @dataclass(frozen=True)
    class Charged(Problem):
        charge: tuple[float, ...] = ()

    told = {f.name: getattr(problem(body(ball((0, 0, 0.1), 0.02))), f.name) for f in fields(Problem)}
    on_device(Charged(**told))
    with pytest.raises(UserError, match="charge"):
        on_device(Charged(**told, charge=(1.0,)))


# ---------------------------------------------------------------- cards


def assert_compiles(module, folder, architectures):
    made = program.wp.compile_aot_module(module, arch=architectures, module_dir=folder)
    written = [path.suffixes[-2:] for path in made if path.stat().st_size > 10_000]
    assert written == [[f".sm{arch}", ".cubin"] for arch in architectures]


@pytest.mark.slow
def test_rigid_inclusions_compile_for_cards_without_one(tmp_path):
    assert_compiles(program.bonds, tmp_path, ARCHITECTURES)


@pytest.mark.slow
@pytest.mark.parametrize("module", program.KERNEL_MODULES, ids=lambda m: m.__name__.split(".")[-1])
def test_every_kernel_compiles_for_cards_without_one(module, tmp_path):
    """For the oldest card, which has the fewest instructions; the transfers for all of them."""
    everywhere = module in (program.kernels, program.scatter)
    assert_compiles(module, tmp_path, ARCHITECTURES if everywhere else OLDEST)


@pytest.mark.gpu
@pytest.mark.skipif(not program.wp.get_cuda_devices(), reason="needs a CUDA device")
@pytest.mark.parametrize("law", list(Law))
def test_a_card_moves_objects_as_the_processor_does(law):
    card, here = CudaEngine(fall(law)), on_processor(fall(law))
    for engine in (card, here):
        engine.advance(0.05)
    apart = np.abs(card.snapshot().position - here.snapshot().position).max()
    assert apart < 1e-3 * CELL
