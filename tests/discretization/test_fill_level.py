"""What lies loose in a vessel has the shape of its hollow, up to its level."""

from itertools import pairwise

import numpy as np
import pytest

from corporeal.discretization.cavity import measure_cavity
from corporeal.discretization.fill_level import fill_to_volume
from corporeal.discretization.mesh_measures import measure_object
from corporeal.geometry.mesh import signed_volume

R, WALL, BASE, HEIGHT = 0.035, 0.003, 0.005, 0.1


def turned(profile, segments=64):
    """Turn an outline (r, z) about the z axis: vertices and triangles."""
    profile = np.array(profile)
    turn = 2 * np.pi * np.arange(segments) / segments
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    vertices = np.concatenate([np.column_stack([r * ring, np.full(segments, z)]) for r, z in profile])
    triangles = []
    for k in range(len(profile) - 1):
        for i in range(segments):
            a, b = k * segments + i, k * segments + (i + 1) % segments
            triangles += [(a, b, b + segments), (a, b + segments, a + segments)]
    return vertices, np.array(triangles)


def measured(profile):
    vertices, triangles = turned(profile)
    part = np.zeros(len(triangles), np.int64)
    anatomy = measure_object(vertices, triangles, part, np.random.default_rng(0))
    return anatomy, anatomy.members[0]


OPEN = [*((1e-5, 0.0), (R, 0.0), (R, HEIGHT), (R - WALL, HEIGHT)), *((R - WALL, BASE), (1e-5, BASE))]
CLOSED = [(1e-5, 0.0), (R, 0.0), (R, HEIGHT), (1e-5, HEIGHT)]


@pytest.mark.slow
@pytest.mark.parametrize("fill", [0.3, 0.6])
def test_a_tumbler_holds_so_much_up_to_its_level(fill):
    volume = fill * np.pi * (R - WALL) ** 2 * (HEIGHT - BASE)
    lies = fill_to_volume(*measured(OPEN), 0.0, volume)
    assert signed_volume(lies.mesh) == pytest.approx(volume, rel=0.02)
    top = lies.mesh.vertices[:, 2].max()
    assert top - BASE == pytest.approx(fill * (HEIGHT - BASE), rel=0.02)
    assert top == pytest.approx(lies.level, abs=1e-5)


def test_a_closed_can_that_is_drawn_by_its_outside_is_hollow_behind_its_wall():
    room = np.pi * (R - WALL) ** 2 * (HEIGHT - 2 * WALL)
    lies = fill_to_volume(*measured(CLOSED), WALL, 0.5 * room)
    assert signed_volume(lies.mesh) == pytest.approx(0.5 * room, rel=0.02)
    assert lies.level == pytest.approx(HEIGHT / 2, rel=0.02)


def test_what_has_no_room_is_not_poured():
    room = np.pi * (R - WALL) ** 2 * (HEIGHT - BASE)
    assert fill_to_volume(*measured(OPEN), 0.0, 1.2 * room) is None
    assert fill_to_volume(*measured([(1e-5, 0.0), (0.1, 0.0), (0.1, 0.01), (1e-5, 0.01)]), 0.006, 1e-6) is None


BOWL = [
    *((1e-5, 0.0), (0.03, 0.0), (0.05, 0.02), (0.07, 0.06)),
    *((0.067, 0.06), (0.047, 0.023), (0.028, 0.004), (1e-5, 0.004)),
]
MORTAR = [(1e-5, 0.0), (0.05, 0.0), (0.06, 0.08), (0.045, 0.08), (0.035, 0.02), (1e-5, 0.02)]
CAN = [(1e-5, 0.0), (R, 0.0), (R, HEIGHT), (R - WALL, HEIGHT), (R - WALL, 0.095), (1e-5, 0.095)]


def cones(*rings):
    """Volume of truncated cones between rings (r, z)."""
    return sum(np.pi * (z - y) * (a * a + a * b + b * b) / 3 for (a, y), (b, z) in pairwise(rings))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("profile", "volume"),
    [(BOWL, cones((0.028, 0.004), (0.047, 0.023), (0.067, 0.06))), (MORTAR, cones((0.035, 0.02), (0.045, 0.08)))],
)
def test_a_wide_bowl_and_a_thick_one_are_filled_in_their_hollow(profile, volume):
    anatomy, member = measured(profile)
    room = measure_cavity(anatomy, member, 0.0015, np.random.default_rng(0))
    assert room.volume == pytest.approx(volume, rel=0.03)
    lies = fill_to_volume(anatomy, member, 0.0015, 0.5 * volume)
    assert lies is not None
    assert np.hypot(*lies.mesh.vertices[:, :2].T).max() < profile[3][0]


def test_what_is_drawn_full_is_not_filled_over_its_lid():
    anatomy, member = measured(CAN)
    room = measure_cavity(anatomy, member, 0.001, np.random.default_rng(0))
    inside = np.hypot(*room.points[:, :2].T) < R - WALL
    assert room.points[inside, 2].max() < 0.095
