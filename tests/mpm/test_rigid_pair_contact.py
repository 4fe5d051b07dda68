"""Where two rigid bodies touch that meet at a node: beyond the edge of neither."""

import numpy as np
import pytest
import warp as wp
from laws.asked import on_device
from point_bodies import board, problem, step_together

from corporeal.mpm import formulas
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.formulas import one_lane_contact
from corporeal.mpm.physics import contact
from corporeal.mpm.reference.engine import ReferenceEngine

wp.set_module_options(formulas.formula_options())
UP = np.array([0.0, 0.0, 1.0])


def edge(far, towards):
    """Mean offset [dx] of a body below a face that ends ``far`` from the node, towards it."""
    mean = float(contact.half_space_mean(np.array(-far)))
    return -mean * np.array([np.cos(towards), np.sin(towards), 0.0]) - 0.4 * UP


def touched(first, second):
    return contact.touching_offset(first[None], second[None], UP[None], 1.0)[0]


@pytest.mark.parametrize("far", [0.1, 0.5, 1.0, 1.4])
def test_a_node_beyond_an_edge_acts_at_the_edge(far):
    whole = -0.4 * UP
    there = far * np.array([np.cos(0.7), np.sin(0.7), 0.0])
    assert touched(edge(far, 0.7), whole) == pytest.approx(there, abs=2e-3)
    assert touched(whole, edge(far, 0.7)) == pytest.approx(there, abs=2e-3)


def test_a_node_inside_of_both_acts_where_it_is():
    assert touched(edge(-0.1, 0.7), edge(-1.0, 2.0)) == pytest.approx(0.0)


def test_a_node_beyond_two_edges_acts_where_they_cross():
    """Of edges along one another the farther one counts; opposite ones leave no such place."""
    across = touched(edge(0.5, 0.0), edge(0.8, np.pi / 2))
    assert across == pytest.approx([0.5, 0.8, 0.0], abs=2e-3)
    askew = touched(edge(0.5, 0.0), edge(0.8, 1.2))
    assert askew[0] == pytest.approx(0.5, abs=2e-3)
    assert askew @ [np.cos(1.2), np.sin(1.2), 0.0] == pytest.approx(0.8, abs=2e-3)
    along = touched(edge(0.5, 0.0), edge(0.8, 0.0))
    assert along == pytest.approx([0.8, 0.0, 0.0], abs=2e-3)
    between = touched(edge(0.5, 0.0), edge(0.3, np.pi))
    assert between == pytest.approx([0.1, 0.0, 0.0], abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True], ids=["block first", "board first"])
def test_a_block_over_an_edge_moves_as_in_the_reference(turned):
    """The board ends .4 cells behind the next nodes."""
    below = board(np.array([0.008, 0.0, -0.04]), size=np.array([0.4, 0.12, 0.08]))
    start, size = np.array([0.26, 0.02, 0.0755]), np.array([0.2, 0.15, 0.15])
    one = board(start, size=size, velocity=(0.1, 0.05, -0.2))
    bodies = (below, one) if turned else (one, below)
    given = problem(*bodies, planes=(), gravity=(0.0, 0.0, -9.81), restitution=0.0)
    ours, sure = CpuEngine(given, threads=1), ReferenceEngine(given)
    step_together(ours, sure, 20)
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-4, abs=1e-4)


# ---------------------------------------------------------------- native twins


@wp.kernel
def touched_in_single(
    table: wp.array(dtype=wp.float32),
    a: wp.array(dtype=wp.vec3d),
    c: wp.array(dtype=wp.vec3d),
    n: wp.array(dtype=wp.vec3d),
    out: wp.array(dtype=wp.vec3d),
):
    i = wp.tid()
    out[i] = one_lane_contact.touching_offset(table, a[i], c[i], n[i])


@wp.func_native("""
  double *to = (double *)out.data + 3 * i;
  const double *p = (const double *)a.data + 3 * i, *q = (const double *)c.data + 3 * i;
  mpm::Touched<double>::shift((const double *)table.data, p, q, (const double *)n.data + 3 * i, to);
""")
def touched_double(
    table: wp.array(dtype=wp.float64),
    a: wp.array(dtype=wp.vec3d),
    c: wp.array(dtype=wp.vec3d),
    n: wp.array(dtype=wp.vec3d),
    out: wp.array(dtype=wp.vec3d),
    i: int,
): ...


@wp.kernel
def touched_in_double(
    table: wp.array(dtype=wp.float64),
    a: wp.array(dtype=wp.vec3d),
    c: wp.array(dtype=wp.vec3d),
    n: wp.array(dtype=wp.vec3d),
    out: wp.array(dtype=wp.vec3d),
):
    touched_double(table, a, c, n, out, wp.tid())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_places_are_those_of_numpy_in_either_precision(dtype):
    rng, count = np.random.default_rng(5), 400
    normal = contact.unit(rng.normal(size=(count, 3)))
    # As far aside as fields are felt, and at an angle: what is nearly parallel amplifies rounding.
    one, other = (rng.uniform(-0.85, 0.85, (count, 3)) for _ in range(2))
    exact = contact.touching_offset(one, other, normal, 1.0)
    kernel, kind = {np.float32: (touched_in_single, wp.float32), np.float64: (touched_in_double, wp.float64)}[dtype]
    sent = [wp.array(v, dtype=wp.vec3d, device="cpu") for v in (one, other, normal)]
    table = wp.array(contact.face_table().astype(dtype), dtype=kind, device="cpu")
    out = wp.zeros(count, dtype=wp.vec3d, device="cpu")
    wp.launch(kernel, dim=count, inputs=[table, *sent], outputs=[out], device="cpu")
    found = out.numpy()
    steady = np.linalg.norm(exact, axis=1) < 2.0
    assert 0.2 < np.mean(np.any(exact[steady] != 0.0, axis=1)) < 1.0
    np.testing.assert_allclose(found[steady], exact[steady], atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("fast", ["cpu", "cuda"])
def test_a_board_that_slides_below_an_edge_throws_nothing_up_as_in_the_reference(fast):
    """At 3 m/s, .3 cells from the ends of both: nodes there lean by more than 18°."""
    size = np.array([0.4, 0.2, 0.04])
    below = board(np.array([0.0, 0.0, -0.02]), size=size, velocity=(3.0, 0.0, 0.0))
    fall, block = (0.0, 0.0, -0.02), np.array([0.15, 0.15, 0.15])
    one = board(np.array([-0.11, 0.01, 0.07501]), size=block, velocity=fall)
    given = problem(below, one, planes=(), gravity=(0.0, 0.0, 0.0))
    ours = CpuEngine(given, threads=1) if fast == "cpu" else on_device(given)
    sure = ReferenceEngine(given)
    step_together(ours, sure, 20)
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.pair_impulse[0, 1] > 0
    assert -0.02 < theirs.momentum[1, 2] / theirs.mass[1] < 0.0
    assert mine.momentum == pytest.approx(theirs.momentum, rel=1e-2, abs=0.01)
