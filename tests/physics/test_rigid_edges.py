"""Where rigid bodies end, and between two of their faces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import corporeal as co
from corporeal.core.types import Keyframes
from corporeal.mpm.state import ParticleConstants

G = 9.81
SIDE, TOP = 0.04, 0.06
"""Of a cube that hangs over a slab, and how high that is [m]."""


def solid(material, mesh, name):
    return co.solid(material, np.array(mesh.vertices), mesh.faces, name=name)


def box(size, at, degrees=0.0, about=(0, 0, 1)):
    mesh = trimesh.creation.box(size)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), about))
    mesh.apply_translation(at)
    return mesh


def run_of(*solids, gravity=(0.0, 0.0, -G), time=0.4):
    """Let a scene go; its engine, and how far the last body has come [m]."""
    posed = co.pose_problem(co.prepare_scene(co.build_scene(*solids, gravity=gravity)))
    engine = co.build_engine(replace(posed, gravity_ramp=0.0))
    start = engine.measure().centre[-1].copy()
    engine.advance(time)
    return engine, engine.measure().centre[-1] - start


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0, 20])
@pytest.mark.parametrize(("beyond", "falls"), [(-0.05, False), (0.15, True)])
def test_a_cube_falls_off_a_slab_once_its_middle_is_beyond_the_edge(degrees, beyond, falls):
    """By a twentieth of half its side before, by three of them after the edge, .1 and .3 cells."""
    slab = box((0.3, 0.3, TOP), (0.003, 0.004, TOP / 2))
    at = (0.153 + beyond * SIDE / 2, 0.004, TOP + SIDE / 2 + 1e-4)
    cube = box((SIDE,) * 3, at, degrees)
    _, way = run_of(solid("wood", slab, "slab"), solid("wood", cube, "cube"))
    if falls:
        assert way[2] < -0.1 * SIDE
    else:
        assert np.linalg.norm(way) < 0.01 * SIDE


def gutter(length=0.4):
    """Two faces at 45°, 15 mm over its underside."""
    flat = [(0, 0), (0.06, 0), (0.06, 0.06), (0.045, 0.06)]
    flat += [(0, 0.015), (-0.045, 0.06), (-0.06, 0.06), (-0.06, 0)]
    cap = np.array([(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 7), (4, 5, 7), (5, 6, 7)])
    n = len(flat)
    corners = [(x, y, z) for y in (-length / 2, length / 2) for x, z in flat]
    ring = [(k, (k + 1) % n) for k in range(n)]
    sides = [t for k, m in ring for t in ((k, m, n + m), (k, n + m, n + k))]
    mesh = trimesh.Trimesh(corners, np.concatenate([cap[:, ::-1], cap + n, sides]))
    mesh.fix_normals()
    assert mesh.is_watertight
    return mesh


@pytest.mark.slow
def test_a_ball_rolls_down_a_gutter_slower_than_on_a_plane():
    """It turns about a line r cos 45° below its middle: a = g sin θ/(1 + 2 I/(m r²))."""
    slope, radius, time = np.radians(5.0), 0.02, 0.5
    gravity = (0.0, G * np.sin(slope), -G * np.cos(slope))
    ball = trimesh.creation.icosphere(3, radius)
    ball.apply_translation((0.0, -0.12, 0.015 + np.sqrt(2) * radius + 1e-5))
    solids = solid("softwood", gutter(), "gutter"), solid("steel", ball, "ball")
    engine, way = run_of(*solids, gravity=gravity, time=time)
    matter = ParticleConstants.of(engine.problem)
    share = matter.inertia[1][0, 0] / (matter.total[1] * radius**2)
    ideal = 0.5 * G * np.sin(slope) * time**2 / (1.0 + 2.0 * share)
    assert way[1] == pytest.approx(ideal, rel=0.02)
    assert np.abs(way[[0, 2]]).max() < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("thick", [0.01, 0.03])
def test_a_board_pulled_away_drags_a_cube_by_friction_alone(thick):
    """At 3 m/s: v = μ g t until the board's end is under the cube's edge, and no throw.

    Normals of nodes lean near edges; a lean of 5° at that speed was an impact of .26 m/s.
    """
    speed, time, side = 3.0, 0.045, 0.06
    board = box((0.4, 0.2, thick), (0.0, 0.0, thick / 2))
    cube = box((side,) * 3, (0.0, 0.0, thick + side / 2 + 1e-4))
    solids = solid("softwood", board, "board"), solid("steel", cube, "cube")
    posed = co.pose_problem(co.prepare_scene(co.build_scene(*solids)))
    still, way = (0.0, 0.0, 0.0), (2 * speed * time, 0.0, 0.0)
    pulled = replace(posed.bodies[0], path=Keyframes((0.0, 2 * time), (still, way), (still, still)))
    given = replace(posed, bodies=(pulled, posed.bodies[1]), gravity_ramp=0.0)
    engine = co.build_engine(given)
    start = engine.measure().centre[1, 2]
    for part in (0.5, 1.0):
        engine.advance(part * time)
        now = engine.measure()
        friction = given.friction[0][1] * G * part * time
        assert now.momentum[1, 0] / now.mass[1] == pytest.approx(friction, rel=0.1)
        assert abs(now.centre[1, 2] - start) < 5e-4
