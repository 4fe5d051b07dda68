"""Scalar versions of the formulas for Warp kernels, on GPUs and in tests.

Every function is a call into the headers beside this file and holds no formula of its own.
"""

from corporeal.mpm.quiet_warp import wp

(
    RESPONSE_STRAIN,
    RESPONSE_WAVE,
    RESPONSE_J1,
    RESPONSE_PLASTIC_STRAIN,
    RESPONSE_OPENED,
    RESPONSE_PLASTIC_WORK,
    RESPONSE_LENGTH,
) = 6, 15, 16, 17, 18, 19, 20
"""First places in a ``Response``: F - 1 after the return map (9), bound on ρ c² [Pa], J - 1 of the trial strain,
increment of the equivalent plastic strain, volume correction of granular material, plastic work per rest volume [J/m³];
before them τ (6: 00 01 02 11 12 22) [Pa].
"""
Response = wp.types.vector(length=RESPONSE_LENGTH, dtype=wp.float32)


@wp.func_native(f"""
  mpm::Material<float> t = {{law, mu, lam, yield_stress, hardening, cone, apex, drag, flow_index}};
  float F[9];
  for (int k = 0; k < 9; k++) F[k] = H.data[k / 3][k % 3];
  mpm::Response<float> a;
  mpm::Laws<float>::respond(t, plastic, opened, F, a);
  wp::vec_t<{RESPONSE_LENGTH}, wp::float32> r;
  for (int k = 0; k < {RESPONSE_STRAIN}; k++) r[k] = a.tau[k];
  for (int k = 0; k < 9; k++) r[{RESPONSE_STRAIN} + k] = F[k];
  r[{RESPONSE_WAVE}] = a.wave;
  r[{RESPONSE_J1}] = a.j1;
  r[{RESPONSE_PLASTIC_STRAIN}] = a.plastic;
  r[{RESPONSE_OPENED}] = a.opened;
  r[{RESPONSE_PLASTIC_WORK}] = a.work;
  return r;
""")
def law_response(
    law: wp.float32,
    mu: wp.float32,
    lam: wp.float32,
    yield_stress: wp.float32,
    hardening: wp.float32,
    cone: wp.float32,
    apex: wp.float32,
    drag: wp.float32,
    flow_index: wp.float32,
    H: wp.mat33,
    plastic: wp.float32,
    opened: wp.float32,
) -> Response: ...


@wp.func_native("""
  mpm::Material<float> t = {law, mu, lam};
  return mpm::Laws<float>::mean_bulk(t);
""")
def mean_bulk(law: wp.float32, mu: wp.float32, lam: wp.float32) -> wp.float32: ...


@wp.func_native("""
  mpm::Material<float> t = {law};
  float F[9], wave = 0.0f;
  for (int k = 0; k < 9; k++) F[k] = H.data[k / 3][k % 3];
  float p = mpm::Laws<float>::mean_pressure(t, bulk, mpm::Strain<float>::volume(F), log_volume_ratio, wave);
  return wp::vec_t<2, wp::float32>(p, wave);
""")
def mean_pressure(law: wp.float32, bulk: wp.float32, H: wp.mat33, log_volume_ratio: wp.float32) -> wp.vec2:
    """Kirchhoff pressure of the mean dilatation and what it adds to ρ c² [Pa]."""
    ...


@wp.func_native("return mpm::remembers((int)law);")
def law_has_branches(law: wp.float32) -> wp.bool: ...


@wp.func_native("return mpm::liquid((int)law);")
def law_is_liquid(law: wp.float32) -> wp.bool: ...


BranchState = wp.types.vector(length=14, dtype=wp.float32)
"""What two branches remember: strain (6: 00 01 02 11 12 22) and θ of one after the other."""


@wp.func_native("""
  float D[9], q, r;
  mpm::Branch<float>::kept(dt, time, q, r);
  float trace = mpm::Branch<float>::deviator(&A.data[0][0], D);
  wp::vec_t<14, wp::float32> m = memory;
  mpm::Branch<float>::follow(D, q, r, &m.c[first]);
  m.c[first + 6] = q * m.c[first + 6] + r * trace;
  return m;
""")
def advance_branch(A: wp.mat33, dt: wp.float32, time: wp.float32, memory: BranchState, first: int) -> BranchState: ...


StressVector = wp.types.vector(length=6, dtype=wp.float32)


@wp.func_native("""
  wp::vec_t<6, wp::float32> tau;
  for (int k = 0; k < 6; k++) tau.c[k] = 0.0f;
  mpm::Branch<float>::press(shear, bulk, &memory.c[first], memory.c[first + 6], &tau.c[0]);
  return tau;
""")
def branch_stress(shear: wp.float32, bulk: wp.float32, memory: BranchState, first: int) -> StressVector: ...


@wp.func_native("""
  wp::mat_t<3, 3, wp::float32> n;
  for (int d = 0; d < 3; d++) mpm::Spline<float>::weights(f[d], n.data[d]);
  return n;
""")
def spline_weights(f: wp.vec3) -> wp.mat33: ...


@wp.func_native("""
  wp::mat_t<3, 3, wp::float32> g;
  for (int d = 0; d < 3; d++) mpm::Spline<float>::slopes(f[d], g.data[d]);
  return g;
""")
def spline_slopes(f: wp.vec3) -> wp.mat33: ...


@wp.func_native("""
  wp::mat_t<3, 3, wp::float64> Q;
  mpm::Body::advance(&R.data[0][0], &rest.data[0][0], &moment.c[0], &spin.c[0], dt, &Q.data[0][0]);
  return Q;
""")
def integrate_rotation(
    R: wp.mat33d, rest: wp.mat33d, moment: wp.vec3d, spin: wp.vec3d, dt: wp.float64
) -> wp.mat33d: ...


@wp.func_native("""
  wp::mat_t<3, 3, wp::float64> I;
  mpm::Body::inverse_inertia(&R.data[0][0], &rest.data[0][0], &I.data[0][0]);
  return I;
""")
def inverse_inertia(R: wp.mat33d, rest: wp.mat33d) -> wp.mat33d: ...


@wp.func_native("""
  wp::vec_t<3, wp::float64> axis;
  double angle = mpm::Body::turned(&R.data[0][0], &axis.c[0]);
  return wp::mul(axis, angle);
""")
def rotation_vector(R: wp.mat33d) -> wp.vec3d: ...


BrakeVector = wp.types.vector(length=7, dtype=wp.float64)
"""Angular impulse (3) [N m s], impulse (3) [N s] and the energy that they take [J]."""


@wp.func_native("""
  mpm::RollingSide a, c;
  a.light = light_a;
  c.light = light_c;
  for (int i = 0; i < 9; i++) {
    a.inertia[i] = inertia_a.data[i / 3][i % 3];
    c.inertia[i] = inertia_c.data[i / 3][i % 3];
  }
  for (int i = 0; i < 3; i++) {
    a.arm[i] = arm_a.c[i];
    c.arm[i] = arm_c.c[i];
  }
  wp::vec_t<7, wp::float64> r;
  double *to = &r.c[0];
  r.c[6] = mpm::Rolling::brake(a, c, &spin.c[0], &n.c[0], &J.c[0], friction, most, to, to + 3);
  return r;
""")
def rolling_brake(
    light_a: wp.float64,
    inertia_a: wp.mat33d,
    arm_a: wp.vec3d,
    light_c: wp.float64,
    inertia_c: wp.mat33d,
    arm_c: wp.vec3d,
    spin: wp.vec3d,
    n: wp.vec3d,
    J: wp.vec3d,
    friction: wp.float64,
    most: wp.float64,
) -> BrakeVector: ...


PathMotion = wp.types.vector(length=15, dtype=wp.float64)
"""Velocity (3), spin (3) and rotation (9)."""


@wp.func_native("""
  wp::vec_t<15, wp::float64> a;
  const double *rows = (const double *)path.data + mpm::KEY_ROW * first;
  double *to = &a.c[0];
  mpm::Path::follow(rows, count, &arm.c[0], end, dt, &x.c[0], &R.data[0][0], to, to + 3, to + 6);
  return a;
""")
def follow_path(
    path: wp.array2d(dtype=wp.float64),
    first: int,
    count: int,
    arm: wp.vec3d,
    end: wp.float64,
    dt: wp.float64,
    x: wp.vec3d,
    R: wp.mat33d,
) -> PathMotion: ...


@wp.func_native("""
  wp::vec_t<3, wp::float32> a;
  mpm::Air<float>::turned(&F.data[0][0], &area.c[0], &a.c[0]);
  return a;
""")
def turned_area(F: wp.mat33, area: wp.vec3) -> wp.vec3: ...


@wp.func_native("""
  wp::vec_t<3, wp::float32> J;
  mpm::Air<float>::press(half_rho_c, &area.c[0], &seen.c[0], mass, dt, &J.c[0]);
  return J;
""")
def wind_impulse(half_rho_c: wp.float32, area: wp.vec3, seen: wp.vec3, mass: wp.float32, dt: wp.float32) -> wp.vec3: ...


@wp.func_native("""
  wp::vec_t<3, wp::float64> J;
  mpm::Grips::pull(stiffness, damping, mass, &away.c[0], &velocity.c[0], dt, &J.c[0]);
  return J;
""")
def grip_spring_impulse(
    stiffness: wp.float64, damping: wp.float64, mass: wp.float64, away: wp.vec3d, velocity: wp.vec3d, dt: wp.float64
) -> wp.vec3d: ...


@wp.func_native("return mpm::Clocks::ramped(time, ramp);")
def ramped_time(time: wp.float64, ramp: wp.float64) -> wp.float64: ...
