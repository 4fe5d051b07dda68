"""Bodies too stiff to bend."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from laws import touching
from laws.bodies import Stuff, ball, ball_rounding, ball_surface, box, box_surface, floor, problem

import corporeal as co
from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.mpm.physics import impact_support

G = 9.81
DOWN = (0.0, 0.0, -G)
RADIUS, CELL = 0.05, 0.0125
STEEL = Stuff(density=7850.0)


def steel_ball(centre, **more):
    more.setdefault("surface", ball_surface(centre, RADIUS, 1000))
    return ball(centre, RADIUS, CELL / 2, stuff=STEEL, rigid=True, **more)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_a_rigid_ball_bounces_to_the_height_its_restitution_says(patient_engine, restitution):
    drop = 0.1
    start = (0.003, 0.002, drop + RADIUS)
    run = patient_engine(problem(steel_ball(start), cell=CELL, restitution=restitution, planes=[floor()], gravity=DOWN))
    fall = np.sqrt(2 * drop / G)
    before = run.measure()
    run.advance(fall + 0.005)
    assert run.measure().centre[0, 2] > RADIUS - 0.05 * CELL
    peak = 0.0
    for time in np.linspace(0.8, 1.2, 9) * fall * restitution + fall:
        run.advance(max(time, run.time))
        m = run.measure()
        peak = max(peak, m.centre[0, 2] - RADIUS)
        total = m.kinetic.sum() + m.potential.sum()
        assert total <= before.potential.sum() + 1e-3 * 7850 * 5.2e-4 * G * drop
    assert peak == pytest.approx(restitution**2 * drop, rel=0.03, abs=0.03 * CELL)


@pytest.mark.parametrize("law", [(1.2, 0.0, 0.25, 0.0, 0.9), (1.2, 0.2, 0.0, 0.1, 0.9)])
def test_each_rise_has_the_restitution_of_its_own_impact(patient_engine, law):
    """A power of the speed where a metal yields, a line where a ball is rated."""
    speed, e = 1.2, 0.5
    stone = steel_ball((0.003, 0.002, RADIUS + 0.001), velocity=(0, 0, -speed))
    given = problem(stone, cell=CELL, restitution=e, planes=[floor()], gravity=DOWN)
    run = patient_engine(replace(given, restitution_law=np.tile(law, (2, 2, 1))))
    before = run.measure()
    struck = np.sqrt(speed**2 + 2 * G * 0.001)
    for _ in range(3):
        expected = impact_support.restitution_at_speed(e, np.array(law), struck) * struck
        while run.measure().momentum[0, 2] <= 0.0:
            run.advance(run.time + 2e-3)
        while (now := run.measure()).momentum[0, 2] > 0.0:
            run.advance(run.time + 2e-3)
        # At its highest; what gravity does in a step or two is not known better.
        struck = np.sqrt(2 * G * (now.centre[0, 2] - RADIUS))
        assert struck == pytest.approx(expected, abs=0.008)
    measure = run.measure()
    given = measure.plane_impulse[0, 0, 2] - measure.mass[0] * G * measure.time
    gained = measure.momentum[0, 2] - before.momentum[0, 2]
    assert given == pytest.approx(gained, rel=1e-4)


def test_two_rigid_balls_rebound_as_newton_says(patient_engine):
    restitution, v, ratio, cell = 0.9, 1.0, 0.3, RADIUS / 5
    shift = np.array([0.13, 0.31, 0.22]) * cell
    far = shift + np.array([2 * RADIUS + 0.9 * cell, 0.0, 0.0])
    one = ball(shift, RADIUS, cell / 2, stuff=STEEL, rigid=True, velocity=(v, 0.0, 0.0))
    light = Stuff(density=7850.0 * ratio)
    two = ball(far, RADIUS, cell / 2, stuff=light, rigid=True, velocity=(-v / 2, 0.0, 0.0))
    run = patient_engine(problem(one, two, cell=cell, restitution=restitution))
    before = run.measure()
    run.advance(0.03)
    after = run.measure()
    u = after.momentum / after.mass[:, None]
    assert u[1, 0] - u[0, 0] == pytest.approx(restitution * 1.5 * v, rel=0.02)
    drift = np.abs(after.momentum.sum(0) - before.momentum.sum(0)).max()
    assert drift < run.round_off * np.abs(before.momentum).max()
    swing = np.abs(after.angular_momentum.sum(0) - before.angular_momentum.sum(0)).max()
    assert swing < 10 * run.round_off * np.abs(before.momentum).max() * RADIUS
    reduced = after.mass[0] * after.mass[1] / after.mass.sum()
    lost = 0.5 * reduced * (1.5 * v) ** 2 * (1 - restitution**2)
    assert before.kinetic.sum() - after.kinetic.sum() == pytest.approx(lost, rel=0.1)


def last_of_a_row(engine, gap, restitution):
    """Let a steel ball hit four others in a row, ``gap`` [cells] apart; velocities over its own."""
    given, until = touching.cradle(gap, restitution)
    run = engine(given)
    before = run.measure()
    run.advance(until)
    after = run.measure()
    drift = np.abs(after.momentum.sum(0) - before.momentum.sum(0)).max()
    assert drift < run.round_off * before.momentum.max()
    assert after.kinetic.sum() <= before.kinetic.sum() * (1.0 + 1e-9)
    return after.momentum[:, 0] / after.mass


GAPS = (0.0, 0.02, 0.1, 0.5)
SURE = [pytest.param("reference", gap, marks=pytest.mark.slow) for gap in (0.0, 0.5)]
CARDS = [pytest.param("cuda", gap, marks=pytest.mark.slow) for gap in GAPS]


@pytest.mark.parametrize(
    ("patient_engine", "gap"), [*(("cpu", gap) for gap in GAPS), *SURE, *CARDS], indirect=["patient_engine"]
)
def test_newtons_cradle_passes_an_impact_on_to_the_last_ball(patient_engine, gap):
    u = last_of_a_row(patient_engine, gap, restitution=1.0)
    assert u[-1] == pytest.approx(1.0, abs=0.05)
    assert np.abs(u[:-1]).max() < 0.05


def test_in_a_cradle_that_loses_energy_the_last_ball_is_slower(patient_engine):
    """Each impact hands on (1 + e)/2 of the speed."""
    u = last_of_a_row(patient_engine, 0.0, restitution=0.8)
    assert u[-1] == pytest.approx(0.9**4, rel=0.03)


def test_a_marble_lies_on_a_slab_though_it_is_smaller_than_a_cell(patient_engine):
    """Its radius is a quarter of a cell; taken for half spaces the two stayed .4 cells apart."""
    run = patient_engine(touching.marble_on(rigid=True))
    run.advance(0.3)
    m = run.measure()
    gap = m.centre[1, 2] - touching.MARBLE - touching.COUCH[2]
    assert abs(gap) < 1e-4
    assert abs(m.centre[0, 2] - touching.COUCH[2] / 2) < 1e-4 / 32
    assert np.abs(m.momentum[1] / m.mass[1]).max() < 1e-3


def test_a_marble_sinks_into_foam_by_no_more_than_a_part_of_its_radius(fast_engine):
    run = fast_engine(touching.marble_on(rigid=False))
    run.advance(0.6)
    gap = run.measure().centre[1, 2] - touching.MARBLE - touching.COUCH[2]
    assert abs(gap) < 0.3 * touching.MARBLE


@pytest.mark.parametrize(
    ("patient_engine", "speed"),
    [
        ("cpu", 10.0),
        ("cpu", 100.0),
        *(pytest.param(name, 100.0, marks=pytest.mark.slow) for name in ("reference", "cuda")),
    ],
    indirect=["patient_engine"],
)
def test_a_ball_rebounds_at_the_face_of_a_plate_thinner_than_a_cell(patient_engine, speed):
    cell, radius, thick = 0.00625, 0.02, 0.001
    at = np.array([0.13, 0.31, 0.3]) * cell
    size = (0.3, 0.3, thick)
    plate = box(at, size, cell / 2, stuff=STEEL, rigid=True, surface=box_surface(at, size, 41))
    above = at + np.array([0.003, 0.001, radius + thick / 2 + 1.5 * cell])
    surface = ball_surface(above, radius, 2000)
    fast = (0.0, 0.0, -speed)
    shot = ball(above, radius, cell / 2, stuff=STEEL, rigid=True, velocity=fast, surface=surface)
    run = patient_engine(problem(plate, shot, cell=cell, restitution=0.5, friction=0.3))
    gaps = []
    for k in range(60):
        run.advance((1.0 + 0.05 * k) * cell / speed)
        m = run.measure()
        gaps.append(m.centre[1, 2] - m.centre[0, 2] - radius - thick / 2)
    assert abs(min(gaps)) < 0.15 * cell
    u = m.momentum[:, 2] / m.mass
    assert u[1] - u[0] == pytest.approx(0.5 * speed, rel=0.05)


def test_a_rigid_ball_rolls_down_a_slope_without_slipping(patient_engine):
    """x = 5/14 g sin θ t² where μ ≥ 2/7 tan θ, and ω = v/R."""
    angle, time = np.radians(20), 0.25
    start = (0.003, 0.002, RADIUS)
    surface = ball_surface(start, RADIUS, 4000)
    gravity = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    run = patient_engine(
        problem(steel_ball(start, surface=surface), cell=CELL, friction=0.5, planes=[floor()], gravity=gravity)
    )
    run.advance(time)
    m = run.measure()
    rolled = m.centre[0, 0] - start[0]
    assert rolled == pytest.approx(5 / 14 * G * np.sin(angle) * time**2, rel=0.05)
    spin = m.angular_momentum[0] - np.cross(m.centre[0], m.momentum[0])
    inertia = 0.4 * m.mass[0] * RADIUS**2
    assert spin[1] / inertia * RADIUS == pytest.approx(m.momentum[0, 0] / m.mass[0], rel=0.05)


def test_a_rigid_ball_that_rolls_fast_does_not_hop_from_point_to_point(fast_engine):
    """Its facets would bounce: at 20° and e = .5 by half a cell within .6 s."""
    angle, radius = np.radians(20), 0.1
    cell = radius / 5
    start = (0.13 * cell, 0.31 * cell, radius)
    surface = ball_surface(start, radius, 5000)
    rolling = ball(start, radius, cell / 2, stuff=STEEL, rigid=True, surface=surface)
    run = fast_engine(
        problem(
            rolling,
            cell=cell,
            friction=0.5,
            restitution=0.5,
            planes=[floor()],
            gravity=(G * np.sin(angle), 0.0, -G * np.cos(angle)),
        )
    )
    highest = 0.0
    for time in np.linspace(0.01, 0.6, 60):
        run.advance(time)
        highest = max(highest, run.measure().centre[0, 2] - radius)
    assert highest < 0.05 * cell
    rolled = run.measure().centre[0, 0] - start[0]
    assert rolled == pytest.approx(5 / 14 * G * np.sin(angle) * 0.6**2, rel=0.1)


def rolled_share(engine, rounded, points=300, time=0.8):
    """How far a ball rolls down 5°, over 5/14 g sin θ t²."""
    angle = np.radians(5)
    start = (0.003, 0.002, RADIUS)
    surface = ball_surface(start, RADIUS, points)
    rows = ball_rounding(start, RADIUS, surface) if rounded else np.zeros((0, CURVATURE_COLUMNS))
    given = problem(
        steel_ball(start, surface=surface, curvature=rows),
        cell=CELL,
        friction=0.5,
        restitution=0.6,
        planes=[floor()],
        gravity=(G * np.sin(angle), 0.0, -G * np.cos(angle)),
    )
    run = engine(given)
    run.advance(time)
    m = run.measure()
    assert abs(m.centre[0, 2] - RADIUS) < (0.01 if rounded else 0.5) * CELL
    return (m.centre[0, 0] - start[0]) / (5 / 14 * G * np.sin(angle) * time**2)


def test_a_ball_that_is_known_to_be_round_rolls_as_far_as_a_ball(fast_engine):
    """Its own moment of inertia, made of particles, is within one per cent of 2/5 m r²."""
    assert rolled_share(fast_engine, rounded=True) == pytest.approx(1.0, abs=0.01)


def test_a_ball_of_corners_loses_speed_at_each(fast_engine):
    """The control: a wheel without a rim (McGeer 1990)."""
    assert rolled_share(fast_engine, rounded=False) < 0.9


def test_a_cube_that_is_let_go_on_its_edge_falls_flat():
    """It is 3.5 cells across: too large to be thin, and nodes near its edges see no half space."""
    size, top = 0.04, 0.08
    cube = trimesh.creation.box((size,) * 3)
    cube.apply_transform(trimesh.transformations.rotation_matrix(np.radians(15), [0, 1, 0]))
    cube.apply_translation((0.013, 0.004, top - cube.bounds[0][2] + 0.001))
    slab = co.box("wood", (0.3, 0.3, top), name="slab")
    one = co.solid("ice", np.array(cube.vertices), cube.faces, name="cube")
    given = co.pose_problem(co.prepare_scene(co.build_scene(slab, one)))
    assert 2.5 < size / given.cell < 4.5
    run = co.build_engine(given)
    run.advance(0.25)
    height = run.measure().centre[1, 2] - top
    assert height == pytest.approx(size / 2, abs=0.1 * given.cell)


def test_a_rigid_body_keeps_its_shape_to_the_last_digit(patient_engine):
    start = (0.003, 0.002, 0.1 + RADIUS)
    run = patient_engine(
        problem(
            steel_ball(start, spin=(3.0, 20.0, -5.0)),
            cell=CELL,
            restitution=0.5,
            friction=0.4,
            planes=[floor()],
            gravity=DOWN,
        )
    )
    rest = run.snapshot().position
    run.advance(0.2)
    now = run.snapshot().position
    pick = np.random.default_rng(0).integers(0, len(rest), (200, 2))
    before = np.linalg.norm(rest[pick[:, 0]] - rest[pick[:, 1]], axis=1)
    after = np.linalg.norm(now[pick[:, 0]] - now[pick[:, 1]], axis=1)
    assert np.abs(after - before).max() < run.round_off * 10 * RADIUS
