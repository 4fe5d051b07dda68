"""Splines, contact, rigid bodies and loads in C++, alone, against float64 NumPy."""

import re

import numpy as np
import pytest

from corporeal.mpm import constants, formulas
from corporeal.mpm.formulas import one_lane, one_lane_contact
from corporeal.mpm.physics import (
    contact,
    contact_impulses,
    grid_spline,
    impact_support,
    rigid,
    spring_grips,
    springs,
    wall_stress,
    wind_pressure,
)
from corporeal.mpm.quiet_warp import wp

wp.set_module_options(formulas.formula_options(cpu_compiler_flags="-march=native -O3 -ffp-contract=fast"))

COUNT = 4000
SINGLE, DOUBLE = 2e-6, 1e-13
"""What is allowed in float32 and in float64, as a share of the largest value."""
D = wp.float64
Floats, Doubles = wp.array(dtype=wp.float32), wp.array(dtype=wp.float64)
Vectors, Vectors64 = wp.array(dtype=wp.vec3), wp.array(dtype=wp.vec3d)
Matrices, Matrices64 = wp.array(dtype=wp.mat33), wp.array(dtype=wp.mat33d)


def sent(array, dtype):
    return wp.array(np.ascontiguousarray(array), dtype=dtype, device="cpu")


def run(kernel, *inputs, out, threads=COUNT):
    """Launch a kernel whose last parameter is its result, of shape and dtype ``out``."""
    shape, dtype = out
    result = wp.zeros(shape, dtype=dtype, device="cpu")
    wp.launch(kernel, threads, [*inputs, result], device="cpu")
    return result.numpy()


@pytest.fixture(name="rng")
def generator():
    return np.random.default_rng(5)


def unit_vectors(rng):
    return contact.unit(rng.normal(size=(COUNT, 3)))


def rotations(rng):
    """Rotation matrices and their rotation vectors, by up to 3 rad."""
    turns = unit_vectors(rng) * rng.uniform(0.0, 3.0, COUNT)[:, None]
    turns[0] = 0.0
    return np.stack([rigid.rotation_matrix(turn) for turn in turns]), turns


# ---------------------------------------------------------------- splines


@wp.kernel
def splines_at_one_lane(f: Vectors, out: wp.array2d(dtype=wp.mat33)):
    i = wp.tid()
    out[0, i] = one_lane.spline_weights(f[i])
    out[1, i] = one_lane.spline_slopes(f[i])


@wp.func_native("""
  typedef mpm::f8 R;
  const R *from = (const R *)f.data;
  R *to = (R *)out.data + 6 * i;
  mpm::Spline<R>::weights(from[i], to);
  mpm::Spline<R>::slopes(from[i], to + 3);
""")
def splines_eight(f: Floats, i: int, out: Floats): ...


@wp.kernel
def splines_at_eight_lanes(f: Floats, out: Floats):
    splines_eight(f, wp.tid(), out)


def test_splines_and_slopes_are_those_of_float64_at_both_widths(rng):
    f = rng.uniform(0.5, 1.5, (COUNT, 3)).astype(np.float32)
    exact = grid_spline.stencil(f.astype(np.float64), np.zeros(COUNT, np.int64), 1.0)
    exact = np.stack([exact.spline, exact.slope]).swapaxes(2, 3)
    one = run(splines_at_one_lane, sent(f, wp.vec3), out=((2, COUNT), wp.mat33))
    np.testing.assert_allclose(one, exact, atol=SINGLE)
    flat = sent(f[:, 0], wp.float32)
    out = run(splines_at_eight_lanes, flat, out=(6 * COUNT, wp.float32), threads=COUNT // 8)
    eight = out.reshape(-1, 2, 3, 8).transpose(1, 0, 3, 2).reshape(2, COUNT, 3)
    np.testing.assert_allclose(eight, exact[:, :, 0], atol=SINGLE)


# ---------------------------------------------------------------- contact


@wp.kernel
def gaps(table: Floats, a: Floats, c: Floats, h: Floats, out: wp.array2d(dtype=wp.float32)):
    i = wp.tid()
    out[0, i] = one_lane_contact.gap_between(table, a[i], c[i])
    out[1, i] = one_lane_contact.gap_to_plane(a[i], h[i])
    out[2, i] = one_lane_contact.gap_to_thin(a[i], h[i])


@wp.func_native("""
  double *to = (double *)out.data;
  const double *p = (const double *)a.data, *q = (const double *)c.data;
  to[i] = mpm::Face<double>::gap((const double *)table.data, p[i], q[i]);
  to[n + i] = mpm::Face<double>::gap_to_plane(p[i], ((const double *)h.data)[i]);
  to[2 * n + i] = mpm::Face<double>::gap_to_thin(p[i], ((const double *)h.data)[i]);
""")
def gaps_double(table: Doubles, a: Doubles, c: Doubles, h: Doubles, n: int, i: int, out: Doubles): ...


@wp.kernel
def gaps_in_double(table: Doubles, a: Doubles, c: Doubles, h: Doubles, n: int, out: Doubles):
    gaps_double(table, a, c, h, n, wp.tid(), out)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_open_distances_are_those_of_numpy_in_either_precision(dtype, rng):
    # Nearer to 0, where a field fills the spline, the tables of faces there and here part company.
    a, c = rng.uniform(-1.4, -0.1, COUNT), rng.uniform(0.1, 1.4, COUNT)
    a, c, h = (value.astype(dtype) for value in (a, c, rng.uniform(-1.5, 0.5, COUNT)))
    normal = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
    table = contact.half_space_face(np.linspace(-1.5, 0.0, 4097)).astype(dtype)
    mean = [value.astype(np.float64)[:, None] * normal for value in (a, c)]
    exact = np.stack(
        [
            contact.gap_between(*mean, normal, 1.0),
            contact.gap_to_wall(mean[0], h.astype(np.float64), normal, 1.0),
            contact.gap_to_thin(mean[0], h.astype(np.float64), normal, 1.0),
        ]
    )
    if dtype == np.float32:
        given = [sent(value, wp.float32) for value in (table, a, c, h)]
        found = run(gaps, *given, out=((3, COUNT), wp.float32))
    else:
        given = [sent(value, wp.float64) for value in (table, a, c, h)]
        found = run(gaps_in_double, *given, COUNT, out=(3 * COUNT, wp.float64)).reshape(3, COUNT)
        assert np.abs(found[1:] - exact[1:]).max() < DOUBLE
    assert np.abs(found - exact).max() < SINGLE


def test_the_numbers_of_the_method_are_written_from_python():
    listed = dict(re.findall(r"constexpr (\w+ \w+) = ([^;]+);", formulas.cpp_preamble()))
    assert {name: float(value) for name, value in listed.items()} == {
        f"{constants.cpp_type(value)} {name}": value for name, value in constants.constants_by_name().items()
    }
    assert {"double LATTICE_GAP_DX", "double MAX_FACE_DEPTH_DX", "int SWEEPS"} <= listed.keys()


@wp.func_native("""
  const double *of = (const double *)table.data, *p = (const double *)mean.data;
  ((double *)out.data)[i] = mpm::Face<double>::of_spread(of, p[i], ((const double *)deviation.data)[i]);
""")
def spread_face(table: Doubles, mean: Doubles, deviation: Doubles, i: int, out: Doubles): ...


@wp.kernel
def spread_faces(table: Doubles, mean: Doubles, deviation: Doubles, out: Doubles):
    spread_face(table, mean, deviation, wp.tid(), out)


def test_faces_of_shells_are_those_of_numpy(rng):
    mean, deviation = rng.uniform(-1.4, 1.4, COUNT), rng.uniform(0.0, 0.6, COUNT)
    given = [sent(value, wp.float64) for value in (contact.spread_table(), mean, deviation)]
    found = run(spread_faces, *given, out=(COUNT, wp.float64))
    assert np.abs(found - contact.face_of_spread(mean, deviation)).max() < DOUBLE


@wp.kernel
def reaches(F: Matrices, n: Vectors, r0: Floats, out: Floats):
    i = wp.tid()
    out[i] = one_lane_contact.support_reach(F[i], n[i], r0[i])


@wp.func_native("""
  typedef mpm::f8 R;
  const float *along = (const float *)n.data;
  const R *from = (const R *)F.data + 9 * i, radius = ((const R *)r0.data)[i];
  ((R *)out.data)[i] = mpm::Support<R>::reach(from, along[0], along[1], along[2], radius);
""")
def reach_eight(F: Floats, n: Floats, r0: Floats, i: int, out: Floats): ...


@wp.kernel
def reaches_of_eight(F: Floats, n: Floats, r0: Floats, out: Floats):
    reach_eight(F, n, r0, wp.tid(), out)


def test_particles_reach_as_far_as_their_stretch_says_at_both_widths(rng):
    F = (np.eye(3) + 0.3 * rng.normal(size=(COUNT, 3, 3))).astype(np.float32)
    n, r0 = unit_vectors(rng).astype(np.float32), rng.uniform(0.1, 0.5, COUNT).astype(np.float32)
    exact = r0 * np.linalg.norm(np.einsum("pij,pi->pj", F.astype(np.float64), n), axis=1)
    given = [sent(F, wp.mat33), sent(n, wp.vec3), sent(r0, wp.float32)]
    assert np.abs(run(reaches, *given, out=(COUNT, wp.float32)) - exact).max() < SINGLE
    exact = r0 * np.linalg.norm(np.einsum("pij,i->pj", F.astype(np.float64), n[0]), axis=1)
    lanes = F.reshape(-1, 8, 9).transpose(0, 2, 1).ravel()
    given = [sent(value, wp.float32) for value in (lanes, n[0], r0)]
    found = run(reaches_of_eight, *given, out=(COUNT, wp.float32), threads=COUNT // 8)
    assert np.abs(found - exact).max() < SINGLE


@wp.kernel
def steps_kept_in_native_text(travel: Doubles, out: wp.array(dtype=wp.int32)):
    out[wp.tid()] = one_lane_contact.normal_cache_steps(travel[wp.tid()])


def test_normals_of_what_moves_farther_in_a_step_are_chosen_more_often():
    eighth = constants.NORMAL_CACHE_TRAVEL_DX / constants.NORMAL_CACHE_STEPS
    travel = np.array([0.0, eighth, 1.01 * eighth, 2.5 * eighth, 7.5 * eighth, 1e3])
    out = ((len(travel),), wp.int32)
    found = run(steps_kept_in_native_text, sent(travel, D), out=out, threads=len(travel))
    assert found.tolist() == [8, 8, 4, 2, 1, 1]
    assert [contact.normal_cache_steps(v) for v in travel.tolist()] == found.tolist()


@wp.kernel
def projections(J: Vectors64, u: Vectors64, n: Vectors64, soft: Doubles, mu: Doubles, out: Vectors64):
    """One projection of a contact of two nodes, as the loops put it together."""
    i = wp.tid()
    un = wp.dot(u[i], n[i])
    old = wp.dot(J[i], n[i])
    push = one_lane_contact.normal_impulse(old, un, D(0.1), soft[i])
    rub = J[i] - old * n[i] + (u[i] - un * n[i]) / soft[i]
    out[i] = one_lane_contact.within_cone(mu[i], push, n[i], rub)


def test_one_projection_onto_coulombs_cone_is_that_of_numpy(rng):
    J, u, n = rng.normal(size=(COUNT, 3)), rng.normal(size=(COUNT, 3)), unit_vectors(rng)
    heavy, mu = rng.uniform(0.5, 2.0, COUNT), rng.uniform(0.0, 1.5, COUNT)
    exact = np.empty((COUNT, 3))
    for i in range(COUNT):
        movers = contact_impulses.Movers(
            np.array([1.0 / heavy[i], 0.0]),
            np.zeros((2, 3, 3)),
            np.zeros((2, 3)),
            np.stack([u[i] + J[i] / heavy[i], np.zeros(3)]),
            np.zeros((2, 3)),
        )
        # ``solve`` begins with no impulse: from u + J/m the first projection gives J's next value.
        pair = (np.array([value]) for value in (0, 1))
        one = contact_impulses.ContactList(*pair, np.zeros((1, 3)), n[i : i + 1], np.zeros(1), mu[i : i + 1])
        exact[i] = contact_impulses.solve(one, movers, np.array([0.1]), 1)[0]
    numbers = [sent(value, wp.float64) for value in (1.0 / heavy, mu)]
    found = run(projections, *(sent(value, wp.vec3d) for value in (J, u, n)), *numbers, out=(COUNT, wp.vec3d))
    along = np.sum(found * n, axis=1)
    rubbed = np.linalg.norm(found - along[:, None] * n, axis=1)
    assert (along == 0.0).any() and (rubbed < 0.99 * mu * along).any()
    assert (rubbed <= mu * along * (1.0 + DOUBLE) + DOUBLE).all()
    assert np.abs(found - exact).max() < 1e-12


@wp.kernel
def spans(m: Doubles, h: Doubles, full: D, dx: D, dt: D, out: Doubles):
    i = wp.tid()
    out[i] = one_lane_contact.wall_span(m[i], full, h[i], dx, dt)


@wp.kernel
def drags(span: Doubles, soft: Doubles, curve: Vectors64, n: Vectors64, t: Vectors64, out: Vectors64):
    i = wp.tid()
    out[i] = one_lane_contact.drag_impulse(soft[i], span[i], curve[i], D(0.25), n[i], t[i])


def test_what_a_wall_drags_on_a_liquid_is_that_of_numpy(rng):
    dx, dt, full = 0.01, 2e-4, 1.1e-3
    mass, height = rng.uniform(0.0, full, COUNT), rng.uniform(-1.45, 1.5, COUNT) * dx
    exact = wall_stress.drag_span(mass, full, height, dx, dt)
    given = [sent(mass, wp.float64), sent(height / dx, wp.float64)]
    found = run(spans, *given, full, dx, dt, out=(COUNT, wp.float64))
    assert np.abs(found - exact).max() < 1e-12 * exact.max()
    index = np.where(rng.uniform(size=COUNT) < 0.3, 1.0, rng.uniform(0.2, 1.5, COUNT))
    curve = np.column_stack([rng.uniform(0, 2e4, COUNT), rng.uniform(0, 1e4, COUNT), index])
    soft, n = rng.uniform(100.0, 1e4, COUNT), unit_vectors(rng)
    t = np.cross(n, rng.normal(size=(COUNT, 3))) * 1e-4
    layers = np.column_stack([exact, curve])
    drag = np.array([wall_stress.drag_impulse(*row) for row in zip(t, soft, layers, strict=True)])
    given = [sent(a, wp.float64) for a in (exact, soft)]
    found = run(drags, *given, *(sent(a, wp.vec3d) for a in (curve, n, t)), out=(COUNT, wp.vec3d))
    assert np.abs(found - (0.25 * n + drag)).max() < 1e-9 * np.abs(t).max()
    left = np.linalg.norm(t - drag, axis=1) * soft
    stress = curve[:, 0] + curve[:, 1] * left ** curve[:, 2]
    moves = left > 1e-12
    pull = np.linalg.norm(drag, axis=1)
    assert 0.05 < moves.mean() < 0.95
    assert pull[moves] == pytest.approx((exact * stress)[moves], rel=1e-6)
    assert (pull <= exact * stress * (1.0 + 1e-6)).all()


@wp.kernel
def targets(e: Doubles, u: Doubles, kick: Doubles, f: Doubles, g: Doubles, dt: D, dx: D, out: Doubles):
    i = wp.tid()
    approach = one_lane_contact.approach_of(u[i], kick[i], f[i])
    out[i] = one_lane_contact.closing_speed(g[i], dt)
    if e[i] > D(0.0) and one_lane_contact.impact_begins(approach, u[i], g[i], dt):
        out[i] = one_lane_contact.impact_target(e[i], approach, u[i], g[i], dt, dx)


def test_what_rebounds_and_how_fast_is_as_in_numpy(rng):
    dx, dt = 0.01, 1e-3
    u, kick = rng.uniform(-0.3, 1.0, COUNT), rng.uniform(-0.1, 0.1, COUNT)
    e = rng.uniform(0.1, 1.0, COUNT) * (rng.uniform(size=COUNT) > 0.2)
    gap = rng.uniform(-0.2, 0.2, COUNT) * dx
    contacts = contact_impulses.ContactList(*[np.zeros((COUNT, *shape)) for shape in [()] * 2 + [(3,)] * 2 + [()] * 2])
    feigned = rng.uniform(0.0, 0.2, COUNT)
    rebound = contact_impulses.ReboundRules(np.arange(COUNT), e, kick, feigned)
    exact, hit = contact_impulses.target_speeds(contacts._replace(gap=gap), u, rebound, dx, dt)
    assert 0.1 < hit.mean() < 0.9 and (exact[hit] < 0.0).all() and (exact[~hit] >= 0.0).all()
    given = [sent(value, wp.float64) for value in (e, u, kick, feigned, gap)]
    found = run(targets, *given, dt, dx, out=(COUNT, wp.float64))
    assert np.abs(found - exact).max() < DOUBLE


@wp.kernel
def bounces(e: Doubles, laws: wp.array2d(dtype=D), v: Doubles, out: Doubles):
    i = wp.tid()
    out[i] = one_lane_contact.restitution_at_speed(e[i], laws, i, v[i])


def test_restitution_at_the_speed_of_an_impact_is_as_in_numpy(rng):
    e, v = rng.uniform(0.1, 1.0, COUNT), rng.uniform(0.0, 9.0, COUNT)
    power = np.where(rng.uniform(size=COUNT) < 0.5, 0.25, 0.0)
    law = np.column_stack([rng.uniform(0.1, 9.0, COUNT), rng.uniform(0, 0.05, COUNT), power])
    law = np.column_stack([law, rng.uniform(0.0, 0.3, COUNT), rng.uniform(0.5, 1.0, COUNT)])
    exact = np.array([impact_support.restitution_at_speed(*row) for row in zip(e, law, v, strict=True)])
    assert 0.05 < (exact == law[:, 4]).mean() < 0.6
    table = wp.array(law, dtype=D, device="cpu")
    found = run(bounces, sent(e, wp.float64), table, sent(v, wp.float64), out=(COUNT, wp.float64))
    assert np.abs(found - exact).max() < DOUBLE


# ---------------------------------------------------------------- rigid bodies


@wp.kernel
def turns(R: Matrices64, rest: Matrices64, L: Vectors64, dt: D, out: wp.array2d(dtype=wp.mat33d)):
    i = wp.tid()
    now = one_lane.inverse_inertia(R[i], rest[i])
    out[0, i] = now
    out[1, i] = one_lane.integrate_rotation(R[i], rest[i], L[i], now * L[i], dt)


@pytest.mark.parametrize("dt", [1e-9, 0.01, 0.3])
def test_a_free_turn_is_that_of_numpy(dt, rng):
    R = rotations(rng)[0]
    A = rng.normal(size=(COUNT, 3, 3))
    inertia = A @ A.swapaxes(1, 2) + np.eye(3)
    L = rng.normal(size=(COUNT, 3))
    given = [sent(R, wp.mat33d), sent(np.linalg.inv(inertia), wp.mat33d), sent(L, wp.vec3d)]
    found = run(turns, *given, dt, out=((2, COUNT), wp.mat33d))
    for i in range(0, COUNT, 10):
        assert np.abs(found[0, i] - rigid.world_inverse_inertia(R[i], inertia[i])).max() < DOUBLE
        assert np.abs(found[1, i] - rigid.integrate_rotation(R[i], inertia[i], L[i], dt)).max() < DOUBLE
    assert np.abs(found[1] @ found[1].swapaxes(1, 2) - np.eye(3)).max() < DOUBLE


@wp.kernel
def turn_vectors(R: Matrices64, out: Vectors64):
    out[wp.tid()] = one_lane.rotation_vector(R[wp.tid()])


def test_the_vector_of_a_rotation_is_found_again(rng):
    R, vectors = rotations(rng)
    found = run(turn_vectors, sent(R, wp.mat33d), out=(COUNT, wp.vec3d))
    assert np.abs(found - vectors).max() < 1e-12
    assert np.abs(found - np.stack([springs.rotation_vector(each) for each in R])).max() < DOUBLE


# ---------------------------------------------------------------- loads


@wp.kernel
def winds(F: Matrices, N: Vectors, u: Vectors, m: Floats, air: float, dt: float, out: Vectors):
    i = wp.tid()
    out[i] = one_lane.wind_impulse(air, one_lane.turned_area(F[i], N[i]), u[i], m[i], dt)


@wp.func_native("""
  typedef const double *Numbers;
  double area[3], *to = (double *)out.data + 3 * i, mass = ((Numbers)m.data)[i];
  mpm::Air<double>::turned((Numbers)F.data + 9 * i, (Numbers)N.data + 3 * i, area);
  for (int d = 0; d < 3; d++) to[d] = 0.0;
  mpm::Air<double>::press(air, area, (Numbers)u.data + 3 * i, mass, dt, to);
""")
def wind_double(F: Matrices64, N: Vectors64, u: Vectors64, m: Doubles, air: D, dt: D, i: int, out: Vectors64): ...


@wp.kernel
def winds_in_double(F: Matrices64, N: Vectors64, u: Vectors64, m: Doubles, air: D, dt: D, out: Vectors64):
    wind_double(F, N, u, m, air, dt, wp.tid(), out)


def test_wind_presses_on_a_deformed_face_as_in_numpy_in_either_precision(rng):
    F = (np.eye(3) + 0.2 * rng.normal(size=(COUNT, 3, 3))).astype(np.float32)
    N, seen = (rng.normal(size=(2, COUNT, 3)) * [[[1e-3]], [[5.0]]]).astype(np.float32)
    mass, dt = rng.uniform(1e-4, 1e-2, COUNT).astype(np.float32), 1e-3
    air = wind_pressure.HALF_RHO_C
    wide = F.astype(np.float64)
    cofactor = np.linalg.det(wide)[:, None, None] * np.linalg.inv(wide).swapaxes(1, 2)
    area = np.einsum("pij,pj->pi", cofactor, N.astype(np.float64))
    exact = wind_pressure.wind_impulses(area, seen.astype(np.float64), mass.astype(np.float64), dt)
    assert (exact == 0.0).all(axis=1).any()
    largest = np.abs(exact).max()
    given = [sent(F, wp.mat33), sent(N, wp.vec3), sent(seen, wp.vec3), sent(mass, wp.float32)]
    found = run(winds, *given, air, dt, out=(COUNT, wp.vec3))
    assert np.abs(found - exact).max() < SINGLE * largest
    kinds = (wp.mat33d, wp.vec3d, wp.vec3d, wp.float64)
    given = [sent(value.astype(np.float64), kind) for value, kind in zip((F, N, seen, mass), kinds, strict=True)]
    found = run(winds_in_double, *given, air, dt, out=(COUNT, wp.vec3d))
    assert np.abs(found - exact).max() < DOUBLE * largest


@wp.kernel
def holds(k: Doubles, c: Doubles, m: Doubles, x: Vectors64, v: Vectors64, dt: D, out: Vectors64):
    i = wp.tid()
    out[i] = one_lane.grip_spring_impulse(k[i], c[i], m[i], x[i], v[i], dt)


def hold(mass):
    """Give a hold on one particle of some mass."""
    return spring_grips.GripHold(np.zeros(1, np.int64), np.ones(1), mass, np.zeros(3))


def test_a_grip_pulls_as_in_numpy_and_no_more_than_a_step_can_follow(rng):
    k, c, m = rng.uniform(size=(3, COUNT)) * [[4e5], [400.0], [1.0]]
    away, v, dt = rng.normal(size=(COUNT, 3)), rng.normal(size=(COUNT, 3)), 1e-3
    exact = np.stack(
        [
            spring_grips.Grip(
                spring_grips.GripHold(np.zeros(1, np.int64), np.ones(1), m[i], np.zeros(3)), away[i], k[i], c[i]
            ).impulse(np.zeros(3), v[i], dt)
            for i in range(COUNT)
        ]
    )
    assert 0.1 < (k > 0.25 * m / dt**2).mean() < 0.9
    numbers = [sent(value, wp.float64) for value in (k, c, m)]
    motion = [sent(value, wp.vec3d) for value in (away, v)]
    found = run(holds, *numbers, *motion, dt, out=(COUNT, wp.vec3d))
    assert np.abs(found - exact).max() < DOUBLE * np.abs(exact).max()


@wp.kernel
def ramps(time: Doubles, ramp: D, out: Doubles):
    out[wp.tid()] = one_lane.ramped_time(time[wp.tid()], ramp)


@pytest.mark.parametrize("ramp", [0.0, 0.5])
def test_gravity_that_fades_in_gives_what_its_integral_says(ramp):
    time = np.linspace(0.0, 2.0, COUNT)
    share = np.minimum(time / ramp, 1.0) if ramp else np.ones(COUNT)
    steps = 0.5 * (share[1:] + share[:-1]) * np.diff(time)
    exact = np.concatenate([[0.0], np.cumsum(steps)])
    found = run(ramps, sent(time, wp.float64), ramp, out=(COUNT, wp.float64))
    assert np.abs(found - exact).max() < 1e-6
