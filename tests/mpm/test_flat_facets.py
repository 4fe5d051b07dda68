"""What is round rolls on flat faces of rigid bodies: the engines agree, and nothing is lost."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import on_device
from point_bodies import CELL, SIZE, board, body, flat_faces, problem, round_body, step_together

from corporeal.core.types import Keyframes
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.physics.flat_facets import facets_of, lies_over_facet
from corporeal.mpm.reference.engine import ReferenceEngine

TOP = 0.2
ENGINES = {"cpu": lambda p: CpuEngine(p, threads=1), "cuda": on_device}


def over(centre, **given):
    """A ball over a heavy board that falls, in either order."""
    return round_body(centre, **given), board(np.array([0.0, 0.0, TOP - SIZE[2] / 2]))


def test_a_box_has_six_faces_that_end_at_its_edges():
    surface, rows = flat_faces(SIZE)
    facets = facets_of(surface, rows)
    assert len(facets.row) == 6 and len(facets.point) == len(surface)
    assert facets.row[:, 3] == pytest.approx(np.abs(facets.row[:, :3] @ SIZE) / 2)
    top = facets.row[facets.row[:, 2] > 0.5][0]
    mine = facets.point[int(top[9]) : int(top[10])]
    along = np.array([0.0, 0.19, 0.2, 0.225])
    held = lies_over_facet(mine, top[:3], top[8], np.stack([along, 0 * along, 0.05 + 0 * along], axis=1))
    assert held.tolist() == [True, True, True, False]


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True], ids=["ball first", "board first"])
@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_a_ball_on_a_board_moves_as_in_the_reference(engine, turned):
    bodies = over((0.02, 0.01, TOP + 0.0505), velocity=(0.5, 0.1, -0.3))
    given = problem(*(bodies[::-1] if turned else bodies), planes=(), gravity=(1.0, 0.0, -9.81))
    ours, sure = ENGINES[engine](given), ReferenceEngine(given)
    step_together(ours, sure, 25)
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0
    assert mine.momentum == pytest.approx(theirs.momentum, rel=1e-6, abs=1e-7)
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-6, abs=1e-7)
    assert mine.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-4, abs=1e-9)
    moved = theirs.momentum.sum(axis=0) - theirs.external_impulse.sum(axis=0)
    assert moved == pytest.approx(given.bodies[int(turned)].velocity[0] * theirs.mass[int(turned)])


@pytest.mark.slow
@pytest.mark.parametrize("known", [False, True], ids=["on nodes", "round"])
@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_a_thin_board_that_is_moved_has_its_own_surface(engine, known):
    """Fast engines took it for a point at its centre, and a ball bounced in the air beside it."""
    up = Keyframes((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.3)), ((0.0, 0.0, 0.0),) * 2)
    size = np.array([0.4, 0.12, 1.5 * CELL])
    middle = np.array([0.0, 0.0, TOP - size[2] / 2])
    moved = replace(board(middle, size), path=up, pivot=(0.0, 0.0, TOP - size[2]))
    falling = round_body((0.12, 0.03, TOP + 0.06), velocity=(0.3, 0.1, -0.5))
    if not known:
        falling = replace(falling, curvature=np.zeros((0, 12)))
    given = problem(falling, moved, planes=())
    ours, sure = ENGINES[engine](given), ReferenceEngine(given)
    step_together(ours, sure, 20)
    assert sure.measure().pair_impulse[0, 1] > 0
    apart = np.abs(ours.snapshot().position - sure.snapshot().position).max()
    assert apart < (2e-4 if known else 0.05) * CELL


@pytest.mark.parametrize("engine", ["cpu", "cuda", "reference"])
def test_a_thin_board_lies_on_what_is_held_still_and_has_no_mesh(engine):
    """It has no surface points: the processor's engine gave it one, in its middle."""
    still = Keyframes((0.0, 1.0), ((0.0, 0.0, 0.0),) * 2, ((0.0, 0.0, 0.0),) * 2)
    deep = np.array([0.2, 0.12, 0.12])
    held = board(np.array([0.0, 0.0, -deep[2] / 2]), deep, path=still, pivot=(0.0, 0.0, 0.0))
    held = replace(held, surface=np.zeros((0, 3)), curvature=np.zeros((0, 12)))
    thick = 0.5 * CELL
    lies = board(np.array([0.0, 0.0, 0.2 * CELL + thick / 2]), np.array([0.16, 0.1, thick]))
    run = (ENGINES | {"reference": ReferenceEngine})[engine](
        problem(lies, held, planes=(), restitution=0.0, gravity=(0.0, 0.0, -9.81))
    )
    run.advance(0.08)
    under = run.measure().centre[0, 2] - thick / 2
    assert under == pytest.approx(0.0, abs=0.06 * CELL)


@pytest.mark.parametrize("engine", ["cpu", "cuda", "reference"])
def test_a_tiny_ball_is_not_held_by_the_far_face_of_a_sheet(engine):
    """That face lies less than the reach of contact behind its top, and looks the other way."""
    radius, size = 0.05 * CELL, np.array([0.2, 0.12, 0.05 * CELL])
    high = np.array([0.0, 0.0, TOP + radius])
    model = round_body((0.0, 0.0, 0.0), count=40)
    rows = model.curvature.copy()
    rows[:, 6], rows[:, 8] = radius, 0.4 * radius
    given = {"surface": high + radius * rows[:, :3], "curvature": rows, "velocity": (0.0, 0.0, 0.2)}
    tiny = body(high[None], rigid=True, spacing=radius, **given)
    surface, faces = flat_faces(size)
    middle = np.array([0.0, 0.0, TOP - size[2] / 2])
    sheet = board(middle, np.array([0.2, 0.12, CELL]), surface=surface + middle, curvature=faces)
    engines = ENGINES | {"reference": ReferenceEngine}
    run = engines[engine](problem(tiny, sheet, planes=(), gravity=(0.0, 0.0, 0.0)))
    run.advance(2e-3)
    found = run.measure()
    assert found.momentum[0, 2] == pytest.approx(0.2 * found.mass[0], rel=1e-6)


@pytest.mark.parametrize("engine", ["cpu", "cuda", "reference"])
def test_a_ball_leaves_a_sheet_straight_up(engine):
    """Nodes see matter on both sides of a sheet: their normals lean, and threw it aside."""
    size = np.array([0.4, 0.4, 0.02 * CELL])
    surface, faces = flat_faces(size)
    middle = np.array([0.0, 0.0, size[2] / 2])
    layer = np.array([0.4, 0.4, 0.4 * CELL])
    sheet = board(middle, layer, surface=surface + middle, curvature=faces)
    start, down = (0.0, 0.0, size[2] + 0.065), (0.0, 0.0, -3.0)
    falling = round_body(start, radius=0.055, count=646, velocity=down)
    given = problem(falling, sheet, gravity=(0.0, 0.0, 0.0), friction=0.6, restitution=0.8)
    run = (ENGINES | {"reference": ReferenceEngine})[engine](given)
    run.advance(0.01)
    found = run.measure()
    left = found.momentum[0] / found.mass[0]
    assert left[2] > 2.0
    assert np.abs(left[:2]).max() < 0.03


def valley(turned):
    """Two heavy boards as one body, whose faces meet at a right angle below a ball."""
    size = np.array([0.16, 0.4, 0.06])
    first = board(np.zeros(3), size)
    halves = []
    for side in (-1.0, 1.0):
        c = np.sqrt(0.5)
        turn = np.array([[c, 0.0, -side * c], [0.0, 1.0, 0.0], [side * c, 0.0, c]])
        # The end of each lies at the origin, its upper face towards the other one.
        shift = np.array([side * 0.08, 0.0, -0.03])
        rows = first.curvature.copy()
        rows[:, :3] = rows[:, :3] @ turn.T
        halves.append([(first.position + shift) @ turn.T, (first.surface + shift) @ turn.T, rows])
    points, surface, rows = (np.concatenate(both) for both in zip(*halves, strict=True))
    below = body(points, rigid=True, surface=surface, curvature=rows, density=8000.0, name="valley")
    ball = round_body((0.0, 0.01, 0.05 * np.sqrt(2) + 5e-4), velocity=(0.1, 0.4, -0.3), density=2000.0)
    return (below, ball) if turned else (ball, below)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True], ids=["ball first", "valley first"])
@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_a_ball_in_a_valley_meets_both_faces_and_nothing_else(engine, turned):
    """As in the reference; and what it loses along the valley is what friction takes."""
    given = problem(*valley(turned), planes=(), gravity=(0.0, 0.0, -9.81), friction=0.0)
    ours, sure = ENGINES[engine](given), ReferenceEngine(given)
    step_together(ours, sure, 20)
    mine, theirs = ours.measure(), sure.measure()
    one = int(turned)
    assert theirs.pair_impulse[0, 1] > 0
    assert mine.momentum[one] == pytest.approx(theirs.momentum[one], rel=1e-3, abs=1e-4)
    for now in (mine, theirs):
        assert now.momentum[one, 1] == pytest.approx(0.4 * now.mass[one], rel=1e-6)
