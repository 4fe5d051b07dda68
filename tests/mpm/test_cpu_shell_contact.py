"""Contact of shells on the production engine: as in the reference, and where faces of walls are."""

import numpy as np
import pytest
from point_bodies import body, step_together
from shell_bodies import CELL, PVC, shell_body, strip

from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import FLOOR, Plane, Problem
from corporeal.mpm.reference.engine import ReferenceEngine

HALF_WALL_DX = 0.5 * PVC["thickness"] / CELL
SLOPE = Plane((0.6, 0.0, 0.8), 0.0)
LATTICE_DX = 0.5


def together(*bodies, planes=(FLOOR,), **given):
    """Bodies that rub and do not rebound."""
    count = len(bodies) + len(planes)
    none = np.zeros((count, count))
    return Problem(bodies, CELL, friction=none + 0.5, restitution=none, planes=planes, **given)


def sheet(place, velocity=(0.0, 0.0, 0.0), axes=(0, 1, 2), **given):
    """A flat strip with one corner at a place; ``axes`` say along which its length, width and wall lie."""
    points, triangle = strip(0.05, 0.03)
    turned = np.zeros_like(points)
    turned[:, list(axes)] = points
    return shell_body(turned + place, triangle, velocity, **given)


def cube(place, edge=0.03, velocity=(0.0, 0.0, 0.0), **given):
    """A cube of material points with one corner at a place."""
    spacing = LATTICE_DX * CELL
    axis = np.arange(spacing / 2, edge, spacing)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    return body(points + place, velocity=velocity, spacing=spacing, **given)


def box(place, edge=0.03, **given):
    """A rigid cube that knows its surface."""
    axis = np.linspace(0.0, edge, 7)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    skin = points[np.any((points == 0.0) | (points == edge), axis=1)]
    return cube(place, edge, rigid=True, surface=skin + place, **given)


FALLING = (0.3, 0.0, -1.0)
MEETINGS = {
    "flat on the floor": lambda: together(sheet((0.003, 0.001, 0.0016), FALLING)),
    "on a slope": lambda: together(sheet((0.003, 0.001, 0.003), FALLING), planes=(SLOPE,)),
    "in a corner": lambda: together(
        sheet((0.003, 0.001, 0.0016), (-1.0, 0.0, -1.0)), planes=(FLOOR, Plane((1.0, 0.0, 0.0), 0.0))
    ),
    "on its rim": lambda: together(sheet((0.003, 0.001, 0.0006), FALLING, axes=(0, 2, 1))),
    "on a rigid box": lambda: together(box((0.01, 0.0, 0.02)), sheet((0.003, 0.001, 0.0516), FALLING), planes=()),
    "below a rigid box": lambda: together(
        sheet((0.003, 0.001, 0.02), -np.array(FALLING)), box((0.01, 0.0, 0.0216)), planes=()
    ),
    "on a rigid body without surface points": lambda: together(
        cube((0.01, 0.0, 0.02), rigid=True), sheet((0.003, 0.001, 0.0516), FALLING), planes=()
    ),
    "on a soft cube": lambda: together(cube((0.01, 0.0, 0.02)), sheet((0.003, 0.001, 0.0516), FALLING), planes=()),
    "below a soft cube": lambda: together(
        sheet((0.003, 0.001, 0.02), -np.array(FALLING)), cube((0.01, 0.0, 0.0216)), planes=()
    ),
    "on another": lambda: together(
        sheet((0.003, 0.001, 0.0016)), sheet((0.013, -0.007, 0.0042), FALLING, axes=(1, 0, 2))
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MEETINGS)
def test_shells_meet_others_as_in_the_reference(name):
    given = MEETINGS[name]()
    fast, sure = step_together(CpuEngine(given, threads=1), ReferenceEngine(given), 40)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 1e-4 * CELL
    ours, theirs = fast.measure(), sure.measure()
    assert theirs.impact_loss > 0 and theirs.friction_loss > 0
    assert ours.impact_loss == pytest.approx(theirs.impact_loss, rel=1e-3)
    assert ours.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-3)
    assert ours.pair_impulse == pytest.approx(theirs.pair_impulse, rel=1e-3)
    most = np.abs(theirs.plane_impulse).max(initial=0.0)
    assert np.abs(ours.plane_impulse - theirs.plane_impulse).max(initial=0.0) <= 1e-3 * most


def test_contact_of_shells_does_not_depend_on_the_number_of_threads():
    given = MEETINGS["on another"]()
    one, many = CpuEngine(given, threads=1), CpuEngine(given, threads=3)
    many.program.smallest_share = 10
    many.connect()
    for engine in (one, many):
        engine.advance(0.005)
    assert one.measure().pair_impulse[0, 1] > 0
    assert np.array_equal(one.snapshot().position, many.snapshot().position)


def test_thick_walls_touch_where_they_end():
    """Two sheets of walls of a cell meet at a cell's distance, and not where solids would."""
    wall = {"thickness": CELL}
    low, high = sheet((0.003, 0.001, 0.1), **wall), sheet((0.003, 0.001, 0.1 + 1.2 * CELL), (0, 0, -0.5), **wall)
    engine = CpuEngine(together(low, high, planes=(), gravity=(0.0, 0.0, 0.0)), threads=1)
    engine.advance(0.1 * CELL / 0.5)
    assert engine.measure().pair_impulse[0, 1] == 0
    engine.advance(0.3 * CELL / 0.5)
    assert engine.measure().pair_impulse[0, 1] > 0


@pytest.mark.parametrize("above", [0.3, 1.2, 1.9])
def test_a_sheet_lies_at_half_its_wall_above_a_plane(above):
    """Wherever nodes of the grid are."""
    floor = Plane((0.0, 0.0, 1.0), above * CELL)
    height = above * CELL + HALF_WALL_DX * CELL
    engine = CpuEngine(together(sheet((0.003, 0.001, height + 0.0005)), planes=(floor,)), threads=1)
    engine.advance(0.05)
    place = engine.snapshot().position[:, 2]
    assert np.abs(place - height).max() < 0.02 * CELL


@pytest.mark.parametrize("place", [(0.004, 0.0, 0.0023), (0.004, 0.0, 0.004), (0.011, 0.002, 0.004)])
def test_a_rigid_box_lies_on_a_sheet_where_its_wall_ends(place):
    """Nodes at the box's edges lean; what they see of the sheet does not."""
    points, triangle = strip(0.06, 0.06)
    lying, landing = shell_body(points - np.array([0.011, 0.012, -0.001]), triangle), box(place)
    engine = CpuEngine(together(lying, landing), threads=1)
    start = engine.measure().centre[1, 2]
    engine.advance(0.05)
    height = place[2] + engine.measure().centre[1, 2] - start
    assert height == pytest.approx(PVC["thickness"], abs=0.03 * CELL)


def test_what_is_heavy_rebounds_little_from_a_sheet_on_the_floor():
    """Nodes of the sheet are far lighter than it: few sweeps leave more than half of its speed."""
    falling = box((0.01, 0.0, 0.003), velocity=(0.0, 0.0, -1.0), density=16000.0)
    engine = CpuEngine(together(sheet((0.003, 0.001, 0.001)), falling), threads=1)
    engine.advance(0.01)
    measured = engine.measure()
    assert measured.pair_impulse[0, 1] > 0
    assert abs(measured.momentum[1, 2] / measured.mass[1]) < 0.45
