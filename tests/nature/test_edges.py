"""Where rigid bodies end."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import corporeal as co

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
    posed = co.pose_problem(co.prepare(co.build_scene(*solids, gravity=gravity)))
    engine = co.build_engine(replace(posed, gravity_ramp=0.0))
    start = engine.measure().centre[-1].copy()
    engine.advance(time)
    return engine, engine.measure().centre[-1] - start


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
