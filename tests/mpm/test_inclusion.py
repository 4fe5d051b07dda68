"""A frame with a cushion on it: rigid where it is stiff, soft where it is soft, one object."""

from dataclasses import replace

import numpy as np
import pytest
from laws.bodies import Stuff, box, box_surface, floor, problem

from corporeal.core.registry import load_backend
from corporeal.discretization.build_model import label_clusters, label_rigid_inclusions
from corporeal.mpm.physics.rigid import mass_and_inertia
from corporeal.mpm.problem import ENGINES
from corporeal.mpm.reference.inclusions import join_bodies
from corporeal.simulation.ledger_row import ledger_row

CELL = 0.05
FOAM = Stuff(young_pa=2.5e5, poisson=0.35, density=30.0)
WOOD = Stuff(density=700.0)
STEEL = Stuff(density=7850.0)
SIDE, HEIGHT = 0.2, 0.1


def chair(cell=CELL, offset=0.3, spin=0.0, **more):
    """Give a frame and the cushion on it: .2 x .2 m, .1 and .2 m high."""
    z, xy = offset * cell, 0.1 + 0.3 * cell
    low = (xy, xy, z + 0.05)
    surface = box_surface(low, (SIDE, SIDE, HEIGHT))
    frame = box(low, (SIDE, SIDE, HEIGHT), cell / 2, stuff=WOOD, rigid=True, surface=surface,
                spin=(0.0, spin, 0.0), name="frame", **more)  # fmt: skip
    cushion = box((xy, xy, z + 0.2), (SIDE,) * 3, cell / 2, stuff=FOAM, name="cushion", **more)
    return frame, cushion


def block(cell=CELL, offset=0.3, velocity=(0.0, 0.0, -1.0), gap=0.5):
    centre = (0.1 + 0.3 * cell, 0.1 + 0.3 * cell, 0.35 + (offset + gap) * cell)
    return box(centre, (SIDE, SIDE, HEIGHT), cell / 2, stuff=STEEL, rigid=True, velocity=velocity,
               name="block")  # fmt: skip


@pytest.fixture(params=["reference", "cpu"])
def engine(request):
    chosen = load_backend("engine", request.param, ENGINES)
    chosen.round_off = {"reference": 1e-12, "cpu": 1e-5}[request.param]
    return chosen


def shape_error(before, after):
    """Largest distance after the best rigid motion [m]."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    U, _, Vt = np.linalg.svd(a.T @ b)
    return np.abs(a @ U @ Vt - b).max()


def test_a_frame_joined_to_points_keeps_momentum_and_inertia_to_round_off():
    rng = np.random.default_rng(0)
    x, m = rng.normal(size=(40, 3)), rng.uniform(1.0, 2.0, 40)
    v, spin = np.array([1.0, -2.0, 0.5]), np.array([0.3, 1.0, -2.0])
    none = np.zeros(40)
    own = mass_and_inertia(x[:25], m[:25], none[:25])
    u = v + np.cross(spin, x)
    speed, moment = m[:25] @ u[:25] / own.total, own.inertia @ spin
    whole, common, total = join_bodies(own, (speed, moment), m[25:], x[25:], u[25:])
    everything = mass_and_inertia(x, m, none)
    assert whole.centre == pytest.approx(everything.centre, rel=1e-12)
    assert whole.inertia == pytest.approx(everything.inertia, rel=1e-12)
    assert common == pytest.approx(m @ u / m.sum(), rel=1e-12)
    assert np.linalg.solve(whole.inertia, total) == pytest.approx(spin, rel=1e-12)


def test_an_impact_on_a_cushion_reaches_its_frame_with_all_momentum_and_no_change_of_shape(engine):
    frame, cushion = chair(spin=3.0)
    run = engine(problem(frame, cushion, block(), cell=CELL, bonds=((0, 1),), transfer="apic"))
    start, before = run.measure(), run.snapshot().position
    run.advance(0.012)
    end, after = run.measure(), run.snapshot().position
    scale = np.abs(start.momentum).max()
    gained = end.momentum.sum(axis=0) - start.momentum.sum(axis=0)
    turned = end.angular_momentum.sum(axis=0) - start.angular_momentum.sum(axis=0)
    assert np.abs(gained).max() < engine.round_off * scale
    assert np.abs(turned).max() < engine.round_off * scale
    assert end.momentum[0, 2] < -1e-3 * scale
    n = len(frame.position)
    assert shape_error(before[:n], after[:n]) < engine.round_off * CELL
    energy = [m.kinetic.sum() + m.elastic.sum() for m in (start, end)]
    assert 0.95 * energy[0] < energy[1] < 1.001 * energy[0]


def test_a_chair_in_free_flight_turns_as_one_body(engine):
    frame, cushion = chair(spin=0.0)
    both = np.concatenate([frame.position, cushion.position])
    turning = [replace(b, velocity=np.cross([0.0, 4.0, 0.0], b.position - both.mean(axis=0)))
               for b in (frame, cushion)]  # fmt: skip
    run = engine(problem(*turning, cell=CELL, bonds=((0, 1),), transfer="apic"))
    before = run.snapshot().position
    run.advance(0.02)
    assert shape_error(before, run.snapshot().position) < 0.05 * CELL
    measured = run.measure()
    assert measured.pair_impulse[0, 1] == 0.0


@pytest.mark.slow
def test_a_ball_on_the_arm_of_a_chair_bounces_off_wood():
    """The frame's own surface meets others with its restitution, bond or not."""
    frame, cushion = chair()
    top = 0.1 + 0.3 * CELL
    beside = replace(cushion, position=np.add(cushion.position, (SIDE, 0.0, -0.1)))
    centre = (0.1 + 0.3 * CELL, 0.1 + 0.3 * CELL, top + 0.05 + 0.2 * CELL)
    stone = box(centre, (0.1,) * 3, CELL / 2, stuff=WOOD, rigid=True, velocity=(0.0, 0.0, -1.0))
    given = problem(frame, beside, stone, cell=CELL, bonds=((0, 1),), restitution=0.5)
    run = load_backend("engine", "reference", ENGINES)(given)
    run.advance(0.03)
    speed = run.measure().momentum[:, 2] / run.measure().mass
    assert speed[2] - speed[0] == pytest.approx(0.5, abs=0.1)


@pytest.mark.slow
def test_a_chair_stands(engine):
    frame, cushion = chair()
    run = engine(
        problem(
            frame,
            cushion,
            cell=CELL,
            bonds=((0, 1),),
            friction=0.5,
            planes=[floor(0.3 * CELL)],
            gravity=(0.0, 0.0, -9.81),
        )
    )
    run.advance(0.05)
    m = run.measure()
    moved = m.centre[0] - frame.position.mean(axis=0)
    assert np.abs(moved).max() < 1e-3 * CELL
    assert m.plane_impulse[0, :, 2].sum() == pytest.approx(m.mass.sum() * 9.81 * 0.05, rel=0.05)


def test_a_frame_as_thin_as_foil_holds_what_is_soft_around_it(engine):
    """A can's tab on its lid: the steel is a thousandth of a cell thick, and must not fall off."""
    lid = box((0.1, 0.1, 0.3), (4 * CELL, 4 * CELL, CELL), CELL / 2, stuff=FOAM, fill="lattice")
    tab = box((0.1, 0.1, 0.3), (CELL, CELL, CELL / 2), CELL / 2, stuff=STEEL, rigid=True)
    tab = replace(tab, volume=tab.volume * 2e-3)
    held = replace(lid, velocity=np.tile([0.0, 0.0, 1.0], (len(lid.position), 1)))
    run = engine(problem(held, tab, cell=CELL, bonds=((1, 0),), transfer="apic"))
    run.advance(0.02)
    m = run.measure()
    speed = m.momentum[:, 2] / m.mass
    assert speed[1] == pytest.approx(speed[0], rel=0.1)
    assert m.momentum[:, 2].sum() == pytest.approx(m.mass[0], rel=1e-5)


def test_the_ledger_adds_up_what_belongs_to_one_object():
    frame, cushion = chair()
    given = problem(cushion, frame, block(), cell=CELL, bonds=((1, 0),), planes=[floor()])
    run = load_backend("engine", "cpu", ENGINES)(given)
    run.advance(0.03)
    row = ledger_row(given, run.snapshot(), run.measure(), run.steps)
    whole = run.measure()
    assert row.mass == pytest.approx([whole.mass[:2].sum(), whole.mass[2]])
    assert row.momentum.sum(axis=0) == pytest.approx(whole.momentum.sum(axis=0))
    assert row.plane_impulse.sum(axis=1) == pytest.approx(whole.plane_impulse.sum(axis=1))
    assert row.pair_impulse[0, 1] == pytest.approx(whole.pair_impulse[:2, 2].sum())
    assert row.first_contact[0, 1] == np.nanmin(whole.first_contact[:2, 2])
    assert row.gap.shape == row.overlap.shape == (2, 2)


def test_particles_that_hang_together_make_one_frame():
    rng = np.random.default_rng(3)
    legs = [np.add(rng.uniform(0.0, 0.05, (200, 3)), (x, 0.0, 0.0)) for x in (0.0, 0.5)]
    label = label_clusters(np.concatenate(legs), 0.03)
    assert len(np.unique(label)) == 2
    assert np.unique(label[:200]).size == np.unique(label[200:]).size == 1


def test_a_wire_with_few_particles_is_still_one_frame():
    particles = np.array([[0.0, 0, 0], [1.0, 0, 0], [5.0, 0, 0]])
    wire = np.stack([np.linspace(0, 1, 21), np.zeros(21), np.zeros(21)], 1)
    bare = np.array([[9.0, 0, 0]])
    found = label_rigid_inclusions(particles, np.concatenate([wire, bare]), 0.1)
    assert found.of_particle.tolist() == [0, 0, 1]
    owner = found.of_point.tolist()
    assert owner == [0] * 21 + [1], "a surface without matter goes with the nearest"


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 0.3, 0.7])
def test_a_block_sinks_into_a_cushion_on_a_frame_as_into_one_on_a_fine_grid(offset):
    """The fine grid, one field and a stiff frame in it, says 10.26 mm."""
    cell = 0.025
    frame, cushion = chair(cell, offset)
    load_ = block(cell, offset, velocity=(0.0, 0.0, 0.0), gap=0.0)
    given = problem(
        frame, cushion, load_, cell=cell, bonds=((0, 1),), friction=0.5,
        planes=[floor(offset * cell)], gravity=(0.0, 0.0, -9.81),
    )  # fmt: skip
    run = load_backend("engine", "cpu", ENGINES)(given)
    start, deepest = run.measure().centre, 0.0
    for k in range(40):
        run.advance(0.06 + 0.0005 * k)
        deepest = max(deepest, start[2, 2] - run.measure().centre[2, 2])
    assert 0.94 < deepest / 0.01026 < 1.10
    assert np.abs(run.measure().centre[0] - start[0]).max() < 1e-4 * cell
