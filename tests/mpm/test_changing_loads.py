"""Gravity and wind that change between two advances do what they say, and are in the ledger."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.core.errors import UserError
from corporeal.core.types import Wind
from corporeal.discretization.discretization_plan import QualityPreset
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.reference.engine import ReferenceEngine
from corporeal.pipeline.stages.fill import fill

ENGINES = (CpuEngine, ReferenceEngine)
LIGHT = (0.0, 0.0, -1.62)


@pytest.fixture(scope="module")
def problem():
    """A foam ball and a stone in free fall, in air that hardly moves."""
    air = Wind((1e-3, 0.0, 0.0))
    soft = co.ball("seat_foam", radius=0.05, at=(0, 0, 2.0))
    hard = co.ball("granite", radius=0.05, at=(0.5, 0, 2.0))
    scene = co.build_scene(soft, hard)
    ready = co.prepare_scene(replace(scene, objects=tuple(replace(o, wind=air) for o in scene.objects)))
    coarse = fill(ready.scene, ready.parts, ready.field, quality=QualityPreset(4, 16, 4000, 20e3, np.inf))
    return co.pose_problem(replace(ready, particles=coarse))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ENGINES)
def test_another_gravity_pulls_from_then_on(problem, kind):
    engine = kind(problem)
    engine.advance(0.01)
    before = engine.measure()
    engine.set_gravity(LIGHT)
    heavier = engine.measure()
    engine.advance(0.03)
    after = engine.measure()
    gained = (after.momentum - before.momentum) / before.mass[:, None]
    np.testing.assert_allclose(gained[:, 2], 0.02 * LIGHT[2], rtol=2e-2)
    # Momentum is that of the impulses; energy is that of the work.
    given = after.external_impulse - before.external_impulse
    np.testing.assert_allclose(after.momentum - before.momentum, given, atol=1e-6)
    lifted = heavier.potential.sum() - before.potential.sum()
    assert heavier.push_work - before.push_work == pytest.approx(lifted, rel=1e-9)
    assert lifted == pytest.approx((9.81 - 1.62) * float(-before.mass @ before.centre[:, 2]), 1e-5)


@pytest.mark.parametrize("kind", ENGINES)
def test_a_wind_acts_from_then_on_and_only_at_the_given_body(problem, kind):
    engine = kind(problem)
    engine.set_gravity((0.0, 0.0, 0.0))
    before = engine.measure().push_work
    engine.set_wind(0, (10.0, 0.0, 0.0))
    engine.advance(0.02)
    moved = engine.measure().momentum
    pressure = 0.5 * 1.2 * 10.0**2 * np.pi * 0.05**2 * 0.02
    assert 0.3 * pressure < moved[0, 0] < 2.0 * pressure
    assert abs(moved[1, 0]) < 1e-3 * moved[0, 0]
    done = engine.measure()
    given = done.push_work - before
    # Work is booked at the speed before each step: short by one over the number of steps.
    assert given == pytest.approx(done.kinetic.sum() + done.elastic.sum(), rel=0.1)


def test_both_engines_are_blown_alike(problem):
    ends = []
    for kind in ENGINES:
        engine = kind(problem)
        engine.set_gravity(LIGHT)
        engine.set_wind(0, (5.0, 5.0, 0.0))
        engine.advance(0.004)
        ends.append(engine.measure().momentum)
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-3 * np.abs(ends[0]).max())


def test_what_cannot_be_is_refused_in_a_sentence(problem):
    engine = CpuEngine(problem)
    with pytest.raises(UserError, match="finite"):
        engine.set_gravity((0.0, 0.0, float("nan")))
    with pytest.raises(UserError, match="no body 7"):
        engine.set_wind(7, (1.0, 0.0, 0.0))
    scene = co.build_scene(co.ball("granite", radius=0.05, at=(0, 0, 1.0)))
    with pytest.raises(UserError, match="without faces"):
        CpuEngine(co.pose_problem(co.prepare_scene(scene))).set_wind(0, (1.0, 0.0, 0.0))
