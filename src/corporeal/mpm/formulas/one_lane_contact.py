"""Scalar versions of the contact formulas for Warp kernels: see ``one_lane``."""

from corporeal.mpm.quiet_warp import wp


@wp.func_native("return mpm::Face<float>::gap((const float *)table.data, mean_a, mean_c);")
def gap_between(table: wp.array(dtype=wp.float32), mean_a: wp.float32, mean_c: wp.float32) -> wp.float32: ...


@wp.func_native("return mpm::Face<float>::gap_to_plane(mean, height);")
def gap_to_plane(mean: wp.float32, height: wp.float32) -> wp.float32: ...


@wp.func_native("return mpm::Face<float>::gap_to_surface(mean, height);")
def gap_to_surface(mean: wp.float32, height: wp.float32) -> wp.float32: ...


@wp.func_native("return mpm::Face<float>::gap_to_thin(mean, height);")
def gap_to_thin(mean: wp.float32, height: wp.float32) -> wp.float32: ...


@wp.func_native("""
  const double *from = (const double *)points.data + 3 * first;
  const mpm::AllShown all = {from, count, &x.c[0], &n.c[0], around, behind};
  return mpm::Surface::begins(all);
""")
def surface_begins(
    points: wp.array(dtype=wp.vec3d),
    first: int,
    count: int,
    x: wp.vec3d,
    n: wp.vec3d,
    around: wp.float64,
    behind: wp.float64,
) -> wp.float64: ...


@wp.func_native("""
  const double *from = (const double *)places.data + 3 * first;
  return mpm::Surface::thin_there(from, count, &x.c[0], far);
""")
def sees_thin_place(places: wp.array(dtype=wp.vec3d), first: int, count: int, x: wp.vec3d, far: wp.float64) -> bool: ...


@wp.func_native("""
  const double *from = (const double *)rows.data + 6 * first;
  mpm::Wetted face[mpm::MAX_WETTED_FACES];
  mpm::AllWetted all = {from, &place.c[0], count, 0, face};
  const int found = mpm::Wetted::faces(all, &x.c[0], &place.c[0], dx, face);
  if (number >= found) return wp::vec4d(0.0, 0.0, 0.0, (double)mpm::VAST);
  const double *n = face[number].normal;
  return wp::vec4d(n[0], n[1], n[2], face[number].height);
""")
def wetted_face(
    rows: wp.array(dtype=wp.vec3d), first: int, count: int, x: wp.vec3d, place: wp.vec3d, dx: wp.float64, number: int
) -> wp.vec4d: ...


@wp.func_native("""
  wp::vec_t<4, wp::float64> out;
  const double *row = (const double *)rows.data + mpm::CURVATURE_ROW * number;
  out[3] = mpm::Round::shift(row, &towards.c[0], &out.c[0]) ? 1.0 : 0.0;
  return out;
""")
def shift_to_contact(rows: wp.array(dtype=wp.float64), number: int, towards: wp.vec3d) -> wp.vec4d: ...


@wp.func_native("""
  return mpm::Facet::near((const double *)rows.data + mpm::FACET_ROW * number, &x.c[0], radius);
""")
def facet_near(rows: wp.array(dtype=wp.float64), number: int, x: wp.vec3d, radius: wp.float64) -> bool: ...


@wp.func_native("""
  const double *row = (const double *)rows.data + mpm::FACET_ROW * number;
  return mpm::Facet::holds(row, (const double *)points.data, &x.c[0]);
""")
def facet_holds(
    rows: wp.array(dtype=wp.float64), number: int, points: wp.array(dtype=wp.vec3d), x: wp.vec3d
) -> bool: ...


SeenFromNode = wp.types.vector(length=8, dtype=wp.float64)
"""Where a node is in a body's frame [m]; the body's mean offset from there in the world [cells]; its first flat face,
and how many it has."""


@wp.func_native("""
  const double *some = (const double *)rows.data;
  mpm::SeenFaces A = {some + mpm::FACET_ROW * (int)a[6], (int)a[7], &R.data[0][0]};
  mpm::SeenFaces C = {some + mpm::FACET_ROW * (int)c[6], (int)c[7], &S.data[0][0]};
  for (int i = 0; i < 3; i++) {
    A.x[i] = a[i], A.mean[i] = a[3 + i];
    C.x[i] = c[i], C.mean[i] = c[3 + i];
  }
  mpm::SeenFaces::along(A, C, &u.c[0], dx, &n.c[0]);
  return n;
""")
def facet_normal_at(
    rows: wp.array(dtype=wp.float64),
    a: SeenFromNode,
    R: wp.mat33d,
    c: SeenFromNode,
    S: wp.mat33d,
    u: wp.vec3d,
    dx: wp.float64,
    n: wp.vec3d,
) -> wp.vec3d: ...


CurvedMeeting = wp.types.vector(length=7, dtype=wp.float64)
"""Place of a contact in the frame of what is round, normal of the face in the world, and gap."""


@wp.func_native("""
  const double *row = (const double *)rows.data + mpm::CURVATURE_ROW * q;
  return mpm::Curved::may(row, (const double *)&points[q], &centre.c[0], far, first != 0);
""")
def curved_may(
    rows: wp.array(dtype=wp.float64),
    points: wp.array(dtype=wp.vec3d),
    q: int,
    centre: wp.vec3d,
    far: wp.float64,
    first: int,
) -> bool: ...


@wp.func_native("""
  return mpm::Curved::ball((const double *)rows.data + mpm::CURVATURE_ROW * p);
""")
def ball_radius(rows: wp.array(dtype=wp.float64), p: int) -> wp.float64: ...


@wp.func_native("""
  wp::vec_t<7, wp::float64> out;
  const double *row = (const double *)rows.data, *x = (const double *)points.data;
  const bool met = mpm::Curved::meet(row + mpm::CURVATURE_ROW * p, x + 3 * p, &S.data[0][0],
                                     row + mpm::CURVATURE_ROW * q, x + 3 * q, &R.data[0][0],
                                     &apart.c[0], reach, &out.c[0], &out.c[3], out.c[6]);
  if (!met) out.c[6] = mpm::VAST;
  return out;
""")
def curved_meet(
    rows: wp.array(dtype=wp.float64),
    points: wp.array(dtype=wp.vec3d),
    p: int,
    S: wp.mat33d,
    q: int,
    R: wp.mat33d,
    apart: wp.vec3d,
    reach: wp.float64,
) -> CurvedMeeting: ...


@wp.func_native("""
  const double *row = (const double *)rows.data, *at = (const double *)points.data;
  double own = 0;
  for (int i = 0; i < 3; i++) own += (x.c[i] - at[3 * p + i]) * (x.c[i] - at[3 * p + i]);
  for (int o = first; o < first + count; o++)
    if (mpm::Curved::taken(row + mpm::CURVATURE_ROW * p, own, &x.c[0], row + mpm::CURVATURE_ROW * o,
                           at + 3 * o))
      return false;
  return true;
""")
def curved_owns(
    rows: wp.array(dtype=wp.float64), points: wp.array(dtype=wp.vec3d), p: int, first: int, count: int, x: wp.vec3d
) -> bool: ...


@wp.func_native("""
  const double *row = (const double *)rows.data;
  return mpm::Curved::misjudged(row + mpm::CURVATURE_ROW * p, row + mpm::CURVATURE_ROW * q, dx);
""")
def curved_misjudged(rows: wp.array(dtype=wp.float64), p: int, q: int, dx: wp.float64) -> wp.float64: ...


@wp.func_native("""
  const double *row = (const double *)rows.data;
  return mpm::Curved::inward(row + mpm::CURVATURE_ROW * p, row + mpm::CURVATURE_ROW * q, square,
  dt);
""")
def curved_inward(
    rows: wp.array(dtype=wp.float64), p: int, q: int, square: wp.float64, dt: wp.float64
) -> wp.float64: ...


@wp.func_native("return mpm::Facet::misjudged(radius, dx);")
def facet_misjudged(radius: wp.float64, dx: wp.float64) -> wp.float64: ...


@wp.func_native("return mpm::Facet::replaces(&apart.c[0], cosine, reach, alike);")
def facet_replaces(apart: wp.vec3d, cosine: wp.float64, reach: wp.float64, alike: wp.float64) -> bool: ...


@wp.func_native("""
  wp::vec_t<3, wp::float64> out;
  mpm::Touched<float>::shift((const float *)table.data, &a.c[0], &c.c[0], &n.c[0], &out.c[0]);
  return out;
""")
def touching_offset(table: wp.array(dtype=wp.float32), a: wp.vec3d, c: wp.vec3d, n: wp.vec3d) -> wp.vec3d: ...


@wp.func_native("return mpm::Face<float>::gap_of_liquid(mean, height, full);")
def gap_of_liquid(mean: wp.float32, height: wp.float32, full: wp.float32) -> wp.float32: ...


@wp.func_native("return mpm::Support<float>::reach(&F.data[0][0], n[0], n[1], n[2], radius);")
def support_reach(F: wp.mat33, n: wp.vec3, radius: wp.float32) -> wp.float32: ...


@wp.func_native("return mpm::Impact::approach(speed, kick, feigned);")
def approach_of(speed: wp.float64, kick: wp.float64, feigned: wp.float64) -> wp.float64: ...


@wp.func_native("return mpm::Impact::begins(approach, speed, gap, dt);")
def impact_begins(approach: wp.float64, speed: wp.float64, gap: wp.float64, dt: wp.float64) -> bool: ...


@wp.func_native("return mpm::Impact::target(e, approach, speed, gap, dt, dx);")
def impact_target(
    e: wp.float64, approach: wp.float64, speed: wp.float64, gap: wp.float64, dt: wp.float64, dx: wp.float64
) -> wp.float64: ...


(SUPPORT_ROW, SUPPORT_ROLE, SUPPORT_RESTITUTION, SUPPORT_LEAST_GAP, SUPPORT_IMPACT_SPEED, SUPPORT_SUMS) = (
    17,
    0,
    1,
    2,
    3,
    4,
)
"""Columns of ``ImpactSupport`` in impact_support.h: how many, and some of them; from BACKING_SUMS on sums."""
STRUCK_PAIR, HELD_PAIR = 1, 2
"""What its role may be, where it is not 0: waiting."""
SupportSums = wp.types.vector(length=SUPPORT_ROW - SUPPORT_SUMS, dtype=wp.float64)


@wp.func_native("return mpm::ImpactSupport::near(gap, least, speed, dx);")
def support_near(gap: wp.float64, least: wp.float64, speed: wp.float64, dx: wp.float64) -> bool: ...


@wp.func_native(f"""
  static_assert(mpm::ImpactSupport::ROW == {SUPPORT_ROW} && mpm::ImpactSupport::COUNT == {SUPPORT_SUMS} &&
                mpm::ImpactSupport::STRUCK == {STRUCK_PAIR} && mpm::ImpactSupport::HELD == {HELD_PAIR}, "");
  wp::vec_t<{SUPPORT_ROW - SUPPORT_SUMS}, wp::float64> sums;
  mpm::ImpactSupport::adds(&x.c[0], &n.c[0], &sums.c[0]);
  return sums;
""")
def support_adds(x: wp.vec3d, n: wp.vec3d) -> SupportSums: ...


@wp.func_native("""
  mpm::ImpactSupport::hold((double *)rows.data, (const double *)restitution.data,
                     (const double *)laws.data, (const double *)light.data, light.shape[0], dx);
""")
def support_hold(
    rows: wp.array2d(dtype=wp.float64),
    restitution: wp.array2d(dtype=wp.float64),
    laws: wp.array2d(dtype=wp.float64),
    light: wp.array(dtype=wp.float64),
    dx: wp.float64,
): ...


@wp.func_native("return mpm::ImpactSupport::held(gap, dt, dx);")
def supported_speed(gap: wp.float64, dt: wp.float64, dx: wp.float64) -> wp.float64: ...


@wp.func_native("""
  return mpm::Impact::bounce(e, (const double *)laws.data + mpm::ImpactSupport::RESTITUTION_LAW_NUMBERS * pair, speed);
""")
def restitution_at_speed(
    e: wp.float64, laws: wp.array2d(dtype=wp.float64), pair: int, speed: wp.float64
) -> wp.float64: ...


@wp.func_native("return mpm::Keep::steps(travel);")
def normal_cache_steps(travel: wp.float64) -> int: ...


@wp.func_native("return mpm::Impact::closing(gap, dt);")
def closing_speed(gap: wp.float64, dt: wp.float64) -> wp.float64: ...


@wp.func_native("return mpm::Coulomb::push(old, speed, target, softness);")
def normal_impulse(old: wp.float64, speed: wp.float64, target: wp.float64, softness: wp.float64) -> wp.float64: ...


@wp.func_native("""
  wp::vec_t<3, wp::float64> J;
  mpm::Coulomb::limit(friction, push, &n.c[0], &rub.c[0], &J.c[0]);
  return J;
""")
def within_cone(friction: wp.float64, push: wp.float64, n: wp.vec3d, rub: wp.vec3d) -> wp.vec3d: ...


@wp.func_native("return mpm::WallStress::span(mass, full, height, dx, dt);")
def wall_span(mass: wp.float64, full: wp.float64, height: wp.float64, dx: wp.float64, dt: wp.float64) -> wp.float64: ...


@wp.func_native("""
  wp::vec_t<3, wp::float64> J;
  const mpm::FlowCurve flow{curve.c[0], curve.c[1], curve.c[2]};
  mpm::WallStress::drag(softness, span, flow, push, &n.c[0], &rub.c[0], &J.c[0]);
  return J;
""")
def drag_impulse(
    softness: wp.float64, span: wp.float64, curve: wp.vec3d, push: wp.float64, n: wp.vec3d, rub: wp.vec3d
) -> wp.vec3d: ...
