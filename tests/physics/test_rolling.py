"""What is drawn round rolls over floors and boards, in bowls and on domes; corners do not."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.special import ellipk

import corporeal as co
from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.mpm.state import ParticleConstants

SLOPE, G = np.radians(5), 9.81
DOWN_SLOPE = (G * np.sin(SLOPE), 0.0, -G * np.cos(SLOPE))
THICK, RADIUS, MARBLE = 0.02, 0.012, 0.02
BOARD = co.box("steel", (0.5, 0.1, THICK))


def posed(*solids, gravity=(0.0, 0.0, -G), known=True):
    """Make a scene's problem; the control does not know what is round."""
    problem = co.pose_problem(co.prepare_scene(co.build_scene(*solids, gravity=gravity)))
    bodies = problem.bodies
    if not known:
        bodies = tuple(replace(b, curvature=np.zeros((0, CURVATURE_COLUMNS))) for b in bodies)
    return replace(problem, bodies=bodies, gravity_ramp=0.0)


def moved(problem, time):
    """Let it run; where the first body has gone [m], and its velocity [m/s]."""
    engine = co.build_engine(problem)
    start = engine.measure().centre[0].copy()
    engine.advance(time)
    found = engine.measure()
    return found.centre[0] - start, found.momentum[0] / found.mass[0]


def ideal(problem, radius, time):
    """½ g sin θ t²/(1 + I/(m r²)) [m], with the inertia that the particles have."""
    matter = ParticleConstants.of(problem)
    share = matter.inertia[0][1, 1] / (matter.total[0] * radius**2)
    return 0.5 * G * np.sin(SLOPE) * time**2 / (1 + share)


def lying_cylinder(radius, at):
    shape = trimesh.creation.cylinder(radius, 0.06, sections=32)
    shape.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    return co.solid("steel", np.array(shape.vertices) + at, shape.faces)


@pytest.mark.slow
@pytest.mark.parametrize("on_board", [False, True], ids=["floor", "board"])
@pytest.mark.parametrize("shape", ["ball", "cylinder"])
def test_what_is_round_rolls_down_five_degrees_as_far_as_it_should(shape, on_board):
    radius, under = {"ball": RADIUS, "cylinder": 0.02}[shape], THICK * on_board
    at = (-0.2, 0.0, radius + under)
    one = co.ball("glass", radius, at) if shape == "ball" else lying_cylinder(radius, at)
    problem = posed(one, *[BOARD] * on_board, gravity=DOWN_SLOPE)
    way, _ = moved(problem, 0.5)
    assert way[0] == pytest.approx(ideal(problem, radius, 0.5), rel=0.015)
    assert np.abs(way[1:]).max() < 0.02 * radius


@pytest.mark.slow
def test_a_marble_that_rolls_slowly_over_a_board_goes_on():
    """It slides first: 5/7 of .3 m/s are left when it rolls, a bit less by its own inertia."""
    marble = co.ball("glass", RADIUS, (-0.2, 0.0, THICK + RADIUS), velocity=(0.3, 0.0, 0.0))
    problem = posed(marble, BOARD)
    way, speed = moved(problem, 0.9)
    matter = ParticleConstants.of(problem)
    rolling = 0.3 / (1 + matter.inertia[0][1, 1] / (matter.total[0] * RADIUS**2))
    assert speed[0] == pytest.approx(rolling, rel=0.005)
    assert way[0] > 0.17
    stopped, _ = moved(posed(marble, BOARD, known=False), 0.9)
    assert stopped[0] < 0.03  # the control: nodes of the grid are a road with bumps


def ramp(slope, low=0.05, length=0.5, wide=0.1):
    """Give a block of steel whose upper side falls along +x, and its upper edge's height [m]."""
    high = low + length * np.tan(slope)
    outline = [(0, 0), (length, 0), (length, low), (0, high)]
    corners = [(x, y, z) for y in (-wide, wide) for x, z in outline]
    return trimesh.convex.convex_hull(np.array(corners, dtype=float)), high


@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "radius"), [(15, 0.03), (10, 0.02)], ids=["hole", "far node"])
def test_a_ball_rolls_down_a_ramp_without_a_hop(degrees, radius):
    """The first fell into a hole between the ramp's points, the second hit a node 3.4 cells off."""
    slope, time = np.radians(degrees), 0.55
    shape, high = ramp(slope)
    out, down = np.array([np.sin(slope), 0, np.cos(slope)]), [np.cos(slope), 0, -np.sin(slope)]
    start = np.array([0.05, 0.0, high - 0.05 * np.tan(slope)]) + radius * out
    steel = co.ball("steel", radius, tuple(start))
    problem = posed(steel, co.solid("steel", np.array(shape.vertices), shape.faces))
    way, _ = moved(problem, time)
    share = ideal(problem, radius, time) / np.sin(SLOPE) * np.sin(slope)
    assert way @ down == pytest.approx(share, rel=0.015)
    assert way @ out == pytest.approx(0.0, abs=0.005 * radius)


def test_a_ball_rolls_over_the_thin_end_of_a_wedge():
    """The last centimetres before its edge, thinner than a cell, threw the ball up at .36 m/s."""
    slope, radius, start = np.radians(15), 0.02, 0.42
    shape, high = ramp(slope, low=0.0)
    out = np.array([np.sin(slope), 0, np.cos(slope)])
    at = np.array([start, 0.0, high - start * np.tan(slope)]) + radius * out
    steel = co.ball("steel", radius, tuple(at))
    engine = co.build_engine(posed(steel, co.solid("steel", np.array(shape.vertices), shape.faces)))
    rising = []
    for time in np.linspace(0.02, 0.36, 18):
        engine.advance(time)
        found = engine.measure()
        rising.append(found.momentum[0, 2] / found.mass[0])
    assert max(rising) < 0.02
    along = found.momentum[0, 0] / found.mass[0]
    at_foot = np.sqrt(2 * 5 / 7 * G * (0.5 - start) * np.tan(slope))
    assert along == pytest.approx(at_foot * np.cos(slope), rel=0.1)


def test_a_marble_rolls_over_the_edge_and_falls():
    marble = co.ball("glass", RADIUS, (0.22, 0.0, THICK + RADIUS), velocity=(0.4, 0.0, 0.0))
    way, _ = moved(posed(marble, BOARD), 0.35)
    assert way[0] > 0.05
    assert way[2] == pytest.approx(-THICK, abs=0.004)


@pytest.mark.parametrize("on_board", [False, True], ids=["floor", "board"])
@pytest.mark.parametrize("shape", ["die", "eighty faces"])
def test_a_die_and_a_ball_of_eighty_faces_stay_where_they_lie(shape, on_board):
    mesh = trimesh.creation.box((0.016,) * 3)
    if shape == "eighty faces":
        mesh = trimesh.creation.icosphere(1, RADIUS)
        flat = trimesh.geometry.align_vectors(mesh.face_normals[0], [0, 0, -1])
        mesh.apply_transform(flat)
    low = mesh.vertices[:, 2].min() - THICK * on_board
    one = co.solid("glass", np.array(mesh.vertices) - [0, 0, low], mesh.faces)
    way, speed = moved(posed(one, *[BOARD] * on_board, gravity=DOWN_SLOPE), 0.5)
    assert np.abs(way).max() < 0.05 * RADIUS
    assert np.abs(speed).max() < 5e-3


def hollow(radius, depth, wall):
    """Give a round block of steel on the floor with a part of a ball taken out of it."""
    angle = np.linspace(np.arccos(1 - depth / radius), 0, 20)
    inside = np.stack([radius * np.sin(angle), radius + wall - radius * np.cos(angle)], axis=1)
    wide = inside[0, 0] + wall
    line = np.concatenate([[[0, 0], [wide, 0], [wide, inside[0, 1]]], inside])
    shape = trimesh.creation.revolve(line, sections=64)
    return co.solid("steel", np.array(shape.vertices), shape.faces)


@pytest.mark.slow
def test_a_marble_swings_in_a_bowl_as_a_pendulum_does():
    """ω² = g/((R - r)(1 + I/(m r²))), 5 g/(7 (R - r)) for a ball; at 20° it is .8 % slower."""
    R, wall, lean = 0.06, 0.008, np.radians(20)
    way = np.array([np.sin(lean), 0.0, -np.cos(lean)])
    at = np.array([0.0, 0.0, R + wall]) + (R - MARBLE) * way
    problem = posed(co.ball("glass", MARBLE, tuple(at)), hollow(R, 0.025, wall))
    matter = ParticleConstants.of(problem)
    share = matter.inertia[0][1, 1] / (matter.total[0] * MARBLE**2)
    period = 4 * ellipk(np.sin(lean / 2) ** 2) * np.sqrt((R - MARBLE) * (1 + share) / G)
    engine = co.build_engine(problem)
    engine.advance(0.48 * period)
    found = engine.measure()
    x, speed = found.centre[1, 0] - found.centre[0, 0], -found.momentum[0, 0] / found.mass[0]
    # Just before it turns on the other side: from there it goes on as cos ωt does.
    furthest = (R - MARBLE) * np.sin(lean)
    left = np.arctan2(speed * period / (2 * np.pi), x) / (2 * np.pi)
    assert left == pytest.approx(0.02, abs=0.005)
    assert x > 0.97 * furthest
    assert found.impact_loss < 1e-3 * found.mass[0] * G * (R - MARBLE) * (1 - np.cos(lean))


@pytest.mark.slow
def test_a_marble_rolls_off_a_dome():
    """θ'' = g sin θ/((R + r)(1 + I/(m r²))) until the dome no longer bears it."""
    R, start = 0.08, np.radians(10)
    angle = np.linspace(np.pi / 2, 0, 30)
    line = np.concatenate([[[0, 0]], R * np.stack([np.sin(angle), np.cos(angle)], axis=1)])
    dome = trimesh.creation.revolve(line, sections=80)
    at = (R + MARBLE) * np.array([np.sin(start), 0.0, np.cos(start)])
    solid = co.solid("steel", np.array(dome.vertices), dome.faces)
    problem = posed(co.ball("glass", MARBLE, tuple(at)), solid)
    matter = ParticleConstants.of(problem)
    share = matter.inertia[0][1, 1] / (matter.total[0] * MARBLE**2)
    square = G / ((R + MARBLE) * (1 + share))
    time, theta, speed = 0.22, start, 0.0
    for _ in range(2000):
        speed += square * np.sin(theta) * time / 2000
        theta += speed * time / 2000
    engine = co.build_engine(problem)
    engine.advance(time)
    found = engine.measure()
    ball = found.centre[0] - [found.centre[1, 0], 0.0, 0.0]
    assert np.arctan2(ball[0], ball[2]) == pytest.approx(theta, rel=0.02)
    assert np.hypot(ball[0], ball[2]) == pytest.approx(R + MARBLE, rel=2e-3)
