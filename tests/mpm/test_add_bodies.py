"""Bodies that join a running problem change nothing for the others, and the books stay right."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.mpm.cpu.engine import CpuEngine

FOAM, STONE, MORE = 0, 1, 2


@pytest.fixture(scope="module")
def problems():
    """A foam ball and a stone in free fall, and the same with two more."""
    here = [co.ball("seat_foam", radius=0.05, at=(0, 0, 2.0)), co.ball("granite", radius=0.05, at=(0.5, 0, 2.0))]
    more = [co.ball("granite", radius=0.05, at=(1.0, 0, 1.0)), co.ball("seat_foam", radius=0.05, at=(1.5, 0, 1.0))]
    few, all_ = (co.pose_problem(co.prepare_scene(co.build_scene(*s))) for s in (here, here + more))
    assert few.cell == all_.cell
    for old, new in zip(few.bodies, all_.bodies, strict=False):
        np.testing.assert_array_equal(old.position, new.position)
    return few, all_


@pytest.mark.slow
@pytest.mark.parametrize("contact", ["multi", "single"])
def test_who_was_there_goes_on_as_if_nothing_had_happened(problems, contact):
    few, more = (replace(p, contact=contact) for p in problems)
    engine = CpuEngine(few, 1)
    engine.set_gravity((0.3, 0.0, -5.0))
    engine.apply_impulse(FOAM, (0.0, 0.03, 2.0), (0.005, 0.0, 0.0))
    engine.attach_spring(STONE, (0.5, 0.0, 2.0), (0.5, 0.0, 2.5), 40.0)
    engine.advance(0.01)
    after = engine.with_added_bodies(more)
    old = engine.snapshot()
    count = len(old.position)
    assert after.time == engine.time
    for name in ("position", "velocity", "deformation", "motion", "plastic_strain"):
        now = getattr(after.snapshot(), name)[:count]
        np.testing.assert_allclose(now, getattr(old, name), atol=1e-7)
    engine.advance(0.02)
    after.advance(0.02)
    # In one shared field, what is out of reach is not felt either.
    np.testing.assert_allclose(after.snapshot().position[:count], engine.snapshot().position, atol=1e-6)
    # Who joined falls under the present gravity.
    falls = after.measure().momentum[MORE:] / after.measure().mass[MORE:, None]
    np.testing.assert_allclose(falls, np.tile([0.003, 0.0, -0.05], (2, 1)), atol=1e-4)


@pytest.mark.parametrize("contact", ["multi", "single"])
def test_momentum_is_that_of_the_impulses_and_energy_that_of_the_work(problems, contact):
    few, more = (replace(p, contact=contact) for p in problems)
    engine = CpuEngine(few, 1)
    engine.advance(0.01)
    before = engine.measure()
    after = engine.with_added_bodies(more)
    now = after.measure()
    added = now.potential.sum() - before.potential.sum()
    assert added == pytest.approx(float(9.81 * now.mass[MORE:].sum()), rel=1e-3)
    assert now.push_work - before.push_work == pytest.approx(added, rel=1e-9)
    np.testing.assert_array_equal(now.external_impulse[:MORE], before.external_impulse)
    assert not now.external_impulse[MORE:].any()
    assert now.pair_impulse.shape == (4, 4) and now.first_contact.shape == (5, 5)
    after.advance(0.03)
    end = after.measure()
    np.testing.assert_allclose(end.momentum, end.external_impulse, atol=2e-5)


def test_added_bodies_meet_the_others(problems):
    few, more = problems
    bodies = list(more.bodies)
    over = bodies[MORE].position - np.array([1.0, 0.0, 1.0]) + np.array([0.5, 0.0, 2.12])
    bodies[MORE] = replace(
        bodies[MORE],
        position=over,
        surface=bodies[MORE].surface - np.array([1.0, 0.0, 1.0]) + np.array([0.5, 0.0, 2.12]),
        velocity=np.tile([0.0, 0.0, -2.0], (len(over), 1)),
    )
    engine = CpuEngine(few, 1)
    engine.advance(0.005)
    after = engine.with_added_bodies(replace(more, bodies=tuple(bodies)))
    after.advance(0.03)
    end = after.measure()
    assert end.first_contact[STONE, MORE] > 0.005
    assert end.pair_impulse[STONE, MORE] > 0.0
    assert np.isnan(end.first_contact[FOAM, MORE])
    fallen = end.momentum[STONE, 2] / end.mass[STONE]
    assert fallen < -0.3 - 0.5, "it was struck from above"
