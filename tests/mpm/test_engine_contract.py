"""Every engine keeps the contract, and says in a sentence what it cannot do."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import on_device
from point_bodies import ball, board, body, problem

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.types import Keyframes
from corporeal.mpm.engines import CAPABILITIES, DEFAULT_ENGINE, build_engine, engine_class, require, require_of_class
from corporeal.mpm.problem import ENGINES, BodySplit, Engine, InteractiveEngine, VariableLoadEngine

WHOLE = ("cpu", "reference")
"""Engines with every capability."""
SOFT, BOARD, MORE = 0, 1, 2
HIGH, ASIDE = np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.0, 0.0])
SIZE = np.array([0.2, 0.12, 0.06])


def falling():
    """A soft ball and a rigid board beside it, which turns as it falls."""
    given = problem(body(ball(HIGH)), board(HIGH + ASIDE, size=SIZE))
    one = given.bodies[BOARD]
    spin = np.cross([0.0, 2.0, 1.0], one.position - one.position.mean(axis=0))
    turning = replace(one, velocity=spin + 0.6 * ASIDE)
    return replace(given, bodies=(given.bodies[SOFT], turning))


@pytest.mark.parametrize("name", ENGINES)
def test_every_engine_on_the_menu_keeps_the_base_contract_under_its_name(name):
    given = falling()
    engine = on_device(given) if name == "cuda" else build_engine(given, name, threads=1)
    assert isinstance(engine, Engine) and engine.name == engine_class(name).name == name
    engine.step(engine.stable_step())
    assert engine.time > 0.0 and engine.steps.count == 1 and engine.problem is given
    saved, there = engine.save(), engine.snapshot().position
    engine.advance(2.0 * engine.time)
    engine.restore(saved)
    np.testing.assert_array_equal(engine.snapshot().position, there)


@pytest.mark.parametrize("name", WHOLE)
def test_these_engines_have_every_capability(name):
    for capability in CAPABILITIES:
        require_of_class(engine_class(name), capability)
    assert DEFAULT_ENGINE in WHOLE


def test_what_an_engine_cannot_do_is_reported_in_a_sentence():
    require_of_class(engine_class("cuda"), InteractiveEngine)
    for capability, words in CAPABILITIES.items():
        if capability is not InteractiveEngine:
            with pytest.raises(UserError) as said:
                require_of_class(engine_class("cuda"), capability)
            assert str(said.value) == f"The engine 'cuda' cannot {words}. Use the engine cpu."
    with pytest.raises(UserError, match="cannot change gravity or wind"):
        require(on_device(falling()), VariableLoadEngine)
    with pytest.raises(UnknownChoiceError):
        build_engine(falling(), "abacus")


@pytest.mark.parametrize("contact", ["multi", "single"])
@pytest.mark.parametrize("name", WHOLE)
def test_added_bodies_change_nothing_for_the_others_and_are_booked(name, contact):
    few = replace(falling(), contact=contact)
    more = problem(*few.bodies, body(ball(HIGH - ASIDE)), contact=contact)
    engine = build_engine(few, name, threads=1)
    engine.set_gravity((0.3, 0.0, -5.0))
    engine.attach_spring(BOARD, (0.5, 0.0, 1.0), (0.5, 0.0, 1.5), 40.0)
    engine.advance(0.004)
    before, held = engine.measure(), engine.snapshot().position
    after = engine.with_added_bodies(more)
    now, place, count = after.measure(), after.snapshot().position, len(held)
    assert after.time == engine.time and after.steps == engine.steps
    np.testing.assert_allclose(place[:count], held, atol=1e-7)
    np.testing.assert_allclose(after.grip_point(BOARD, place), engine.grip_point(BOARD, held), atol=1e-7)
    added = now.potential[MORE:].sum()
    assert now.push_work - before.push_work == pytest.approx(added, rel=1e-9)
    np.testing.assert_array_equal(now.external_impulse[:MORE], before.external_impulse)
    engine.advance(0.006)
    after.advance(0.006)
    old = engine.snapshot().position
    np.testing.assert_allclose(after.snapshot().position[:count], old, atol=1e-6)
    falls = after.measure().momentum[MORE] / after.measure().mass[MORE]
    np.testing.assert_allclose(falls, [0.0006, 0.0, -0.01], atol=1e-4)


@pytest.mark.parametrize("name", WHOLE)
def test_pieces_of_a_split_body_move_on_as_the_whole_did(name):
    engine = build_engine(falling(), name, threads=1)
    engine.attach_spring(SOFT, (0.0, 0.0, 1.0), (0.0, 0.0, 1.1), 10.0)
    engine.attach_spring(BOARD, (0.5, 0.0, 1.0), (0.5, 0.0, 1.1), 10.0)
    engine.advance(0.01)
    before, now = engine.measure(), engine.snapshot()
    mine = slice(len(engine.problem.bodies[SOFT].position), None)
    place = now.position[mine]
    piece = np.digitize(place[:, 0], [0.47, 0.53])
    surfaces = tuple(place[piece == k] for k in range(3))
    after = engine.with_split_body(BodySplit(BOARD, piece, place, now.velocity[mine], surfaces))
    there = after.measure()
    assert len(after.problem.bodies) == 4 and after.time == engine.time
    for name in ("mass", "momentum", "angular_momentum", "external_impulse"):
        whole, parts = getattr(before, name), getattr(there, name)
        scale = np.abs(whole[BOARD]).max()
        np.testing.assert_allclose(parts[SOFT], whole[SOFT], rtol=1e-6, atol=1e-9)
        if name != "angular_momentum":
            np.testing.assert_allclose(parts[1:].sum(axis=0), whole[BOARD], atol=1e-6 * scale)
    # A piece turns as the whole did, but for the share of a cell that its points stand for.
    turning = there.angular_momentum[1:].sum(axis=0)
    np.testing.assert_allclose(turning, before.angular_momentum[BOARD], rtol=0.02, atol=1e-3)
    assert there.first_contact.shape == (5, 5)
    position = after.snapshot().position
    assert after.grip_point(SOFT, position) is not None
    assert after.grip_point(BOARD, position) is None
    after.advance(0.012)
    fallen = after.measure()
    gained = (fallen.momentum - there.momentum)[1:].sum(axis=0)
    expected = [0.0, 0.0, -9.81 * 0.002 * before.mass[BOARD]]
    np.testing.assert_allclose(gained, expected, atol=1e-4 * before.mass[BOARD])


@pytest.mark.parametrize("name", WHOLE)
def test_what_follows_a_path_is_booked_by_the_gravity_that_is(name):
    """The work of lifting is what the potential gains, under another gravity too."""
    rise = Keyframes((0.0, 0.1), ((0.0, 0.0, 1.0), (0.0, 0.0, 1.1)), ((0.0,) * 3,) * 2)
    lifted = replace(board(HIGH, size=SIZE), path=rise, pivot=(0.0, 0.0, 1.0))
    engine = build_engine(problem(lifted), name, threads=1)
    engine.set_gravity((0.0, 0.0, -2.0))
    before = engine.measure()
    engine.advance(0.05)
    after = engine.measure()
    energy = [float((m.kinetic + m.potential).sum()) for m in (before, after)]
    assert after.push_work - before.push_work == pytest.approx(energy[1] - energy[0], rel=1e-3)
