// Contact: places of faces around a node, and impulses of contacts. Twins of physics/contact.py.
// Lengths are in cells. Numbers in capitals are those of mpm/constants.py, in every header.
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
// Half spaces as a node sees them through its quadratic spline; R: double or float.
template <class R> struct Face {
  // Of a half space u < n that holds the smaller part of a node's spline, -1.5 <= n <= 0: its share …
  CUDA_CALLABLE static inline R least(R n) {
    const R w = n + R(1.5), far = w * w * w / R(6.0), near = R(0.5) + R(0.75) * n - n * n * n / R(3.0);
    return n < R(-0.5) ? far : near;
  }
  // … and its share times its mean offset, which the rest of the spline has, too.
  CUDA_CALLABLE static inline R moment(R n) {
    const R w = n + R(1.5), far = w * w * w * w / R(8.0) - w * w * w / R(4.0);
    const R near = R(-13.0 / 64.0) + R(0.375) * n * n - R(0.25) * n * n * n * n;
    return n < R(-0.5) ? far : near;
  }
  CUDA_CALLABLE static inline R enough(R share) {
    return share > R(MIN_HALF_SPACE_WEIGHT) ? share : R(MIN_HALF_SPACE_WEIGHT);
  }
  // Share of a node's spline that the half space u < s fills.
  CUDA_CALLABLE static inline R filled(R s) {
    s = s < R(-1.5) ? R(-1.5) : s > R(1.5) ? R(1.5) : s;
    const R weight = least(s > 0 ? -s : s);
    return enough(s > 0 ? R(1.0) - weight : weight);
  }
  // Mean offset e(s) of the half space u < s.
  CUDA_CALLABLE static inline R mean(R s) {
    s = s < R(-1.5) ? R(-1.5) : s > R(1.5) ? R(1.5) : s;
    const R n = s > 0 ? -s : s, weight = filled(s);
    return weight > R(MIN_HALF_SPACE_WEIGHT) ? moment(n) / weight : n;
  }
  // The same of a lattice of two points per cell and axis, the first a quarter of a cell behind the face.
  CUDA_CALLABLE static inline R lattice(R s) {
    s = s > R(1.5) ? R(1.5) : s;
    R weight = 0, moment = 0;
    for (int k = 0; k < LATTICE_ROWS; k++) {
      const R u = s - R(PARTICLE_RADIUS_DX) * R(1 + 2 * k), a = u < 0 ? -u : u, t = R(1.5) - a;
      const R w = a < R(0.5) ? R(0.75) - a * a : a < R(1.5) ? R(0.5) * t * t : R(0.0);
      weight += w;
      moment += w * u;
    }
    return weight > R(MIN_HALF_SPACE_WEIGHT) ? moment / weight : s - R(PARTICLE_RADIUS_DX);
  }
  // Where the face lies: the inverse of mean, from a table of FACE_TABLE_INTERVALS + 1 values over [-1.5, 0].
  CUDA_CALLABLE static inline R place(const R *table, R p) {
    R f = ((p < R(-1.5) ? R(-1.5) : p > R(0.0) ? R(0.0) : p) + R(1.5)) * R(FACE_TABLE_INTERVALS / 1.5);
    int i = f < R(FACE_TABLE_INTERVALS - 1) ? (int)f : FACE_TABLE_INTERVALS - 1;
    return table[i] + (table[i + 1] - table[i]) * (f - i);
  }
  // Where material ends whose offsets have that mean and standard deviation, from a table of
  // FACE_TABLE_INTERVALS + 1 values over [0, SPLINE_DEVIATION_DX]: twin of contact.face_of_spread.
  CUDA_CALLABLE static inline R of_spread(const R *table, R mean, R deviation) {
    R f = (deviation < R(SPLINE_DEVIATION_DX) ? deviation : R(SPLINE_DEVIATION_DX)) * R(FACE_TABLE_INTERVALS / SPLINE_DEVIATION_DX);
    int i = f < R(FACE_TABLE_INTERVALS - 1) ? (int)f : FACE_TABLE_INTERVALS - 1;
    return mean + table[i] + (table[i + 1] - table[i]) * (f - i);
  }
  // Distance t(s) of the mean offsets of two half spaces that touch.
  CUDA_CALLABLE static inline R touching(R s) {
    s = s < 0 ? -s : s;
    if (s > R(MAX_FACE_DEPTH_DX)) s = R(MAX_FACE_DEPTH_DX);
    const R n = -s, over = s - R(LATTICE_START_DX), less = least(n), m = moment(n), fills = enough(less);
    const R ahead = m / enough(R(1.0) - less), behind = fills > R(MIN_HALF_SPACE_WEIGHT) ? m / fills : n;
    return -ahead - behind + R(LATTICE_GAP_DX) + R(LATTICE_SLOPE) * (over > 0 ? over : R(0.0));
  }
  // Open distance along n, from a to c, of two fields whose mean offsets along it are a and c.
  CUDA_CALLABLE static inline R gap(const R *table, R a, R c) {
    return c - a - touching(overlap(table, a, c));
  }
  // How deep each of them lies in the other where both are a half space.
  CUDA_CALLABLE static inline R overlap(const R *table, R a, R c) {
    return R(0.5) * (place(table, a) - place(table, -c));
  }
  // The same to a plane, h below the node.
  CUDA_CALLABLE static inline R gap_to_plane(R a, R h) { return -mean(-h) - a - touching(h); }
  // The same to a wall of a liquid that fills the half space above it as far as the node tells; full: the
  // node's mass over that of a full cell.
  CUDA_CALLABLE static inline R gap_of_liquid(R a, R h, R full) {
    const R off = mean(h) - a;
    const bool like = full >= R(MIN_FILLED_FRACTION) && off < R(HALF_SPACE_TOLERANCE_DX) && off > R(-HALF_SPACE_TOLERANCE_DX);
    return h > R(WALL_REACH) && (h > R(LIQUID_WALL_REACH_DX) || !like) ? R(VAST) : gap_to_plane(a, h);
  }
  // The same to a surface; none for nodes deep inside of a field.
  CUDA_CALLABLE static inline R gap_to_surface(R a, R h) {
    return h > R(WALL_REACH) ? R(VAST) : gap_to_plane(a, h);
  }
  // The same to a thin body: its surface is exact, and the field a lattice.
  CUDA_CALLABLE static inline R gap_to_thin(R a, R h) { return h > R(WALL_REACH) ? R(VAST) : lattice(h) - a; }
};
// Where two rigid bodies touch that meet at a node: in both of them. Twin of contact.touching_offset. R: of the table.
template <class R> struct Touched {
  // How far it is along the plane of contact, and which way, to the edge of a body that does not reach the
  // node; 0 where it does. mean: its mean offset.
  CUDA_CALLABLE static inline double to_edge(const R *table, const double *mean, const double *n, double *way) {
    double along = 0, square = 0;
    for (int i = 0; i < 3; i++) along += mean[i] * n[i];
    for (int i = 0; i < 3; i++) way[i] = mean[i] - along * n[i], square += way[i] * way[i];
    const double size = sqrt(square), face = Face<R>::place(table, R(-size));
    for (int i = 0; i < 3; i++) way[i] = face < 0 ? way[i] / size : 0.0;
    return face < 0 ? -face : 0.0;
  }
  // The shortest way along that plane from the node to where both are; a, c: their mean offsets.
  CUDA_CALLABLE static inline void shift(const R *table, const double *a, const double *c, const double *n,
                                         double *out) {
    double p[3], q[3], cosine = 0;
    const double far = to_edge(table, a, n, p), other = to_edge(table, c, n, q);
    for (int i = 0; i < 3; i++) cosine += p[i] * q[i];
    const double apart = 1.0 - cosine * cosine;
    double first = far >= other ? far : 0.0, second = far >= other ? 0.0 : other;
    if (far * cosine < other && other * cosine < far) {   // neither edge alone decides
      first = apart > PARALLEL_EDGE_SINE2 ? (far - other * cosine) / apart : 0.5 * far;
      second = apart > PARALLEL_EDGE_SINE2 ? (other - far * cosine) / apart : 0.5 * other;
    }
    for (int i = 0; i < 3; i++) out[i] = first * p[i] + second * q[i];
  }
};
// Normals of layers. Twin of contact.layer_normals.
struct LayerNormal {
  // The normal n of a contact with a layer, as that is; square: weight times xx, yy, zz, xy, xz, yz of its
  // offsets about their mean.
  CUDA_CALLABLE static inline void turn(const float *square, double weight, const double *n, double *out) {
    const double per = 1.0 / weight, least = LAYER_DEVIATION_DX * LAYER_DEVIATION_DX;
    const double a = square[0] * per + least, b = square[1] * per + least, c = square[2] * per + least;
    const double d = square[3] * per, e = square[4] * per, f = square[5] * per;
    double m[3] = {(b * c - f * f) * n[0] + (e * f - c * d) * n[1] + (d * f - b * e) * n[2],
                   (e * f - c * d) * n[0] + (a * c - e * e) * n[1] + (d * e - a * f) * n[2],
                   (d * f - b * e) * n[0] + (d * e - a * f) * n[1] + (a * b - d * d) * n[2]};
    const double size = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    const double cosine = size > 0 ? (m[0] * n[0] + m[1] * n[1] + m[2] * n[2]) / size : 0.0;
    double share = (cosine - MIN_LAYER_COSINE) / (FULL_LAYER_COSINE - MIN_LAYER_COSINE);
    share = share < 0 ? 0.0 : share > 1 ? 1.0 : share;
    for (int i = 0; i < 3; i++) out[i] = n[i] + (share > 0 ? share * (m[i] / size - n[i]) : 0.0);
    const double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int i = 0; i < 3 && length > 0; i++) out[i] /= length;
  }
};
// How far a particle reaches along n: r0 |Ft n|.
template <class R> struct Support {
  CUDA_CALLABLE static inline R reach(const R *F, float x, float y, float z, R r0) {
    const R a = F[0] * x + F[3] * y + F[6] * z, b = F[1] * x + F[4] * y + F[7] * z,
            c = F[2] * x + F[5] * y + F[8] * z;
    return r0 * Lanes<R>::root(a * a + b * b + c * c);
  }
};
// For how many steps a choice of candidate normals is kept, at a speed of so many cells a step.
struct Keep {
  CUDA_CALLABLE static inline int steps(double speed) {
    int n = NORMAL_CACHE_STEPS;
    while (n > 1 && n * speed > NORMAL_CACHE_TRAVEL_DX) n /= 2;
    return n;
  }
};
// Order in which contacts are swept: number k is k times the stride, modulo their number.
struct Scatter {
  CUDA_CALLABLE static inline int stride(int count) {
    int step = (int)(SWEEP_STRIDE_FRACTION * count);
    while (step > 1 && shared(step, count)) step--;
    return step > 1 ? step : 1;
  }
  // Whether two numbers have a common divisor.
  CUDA_CALLABLE static inline bool shared(int a, int b) {
    while (b) {
      const int rest = a % b;
      a = b;
      b = rest;
    }
    return a > 1;
  }
};
// Newton's law of restitution where a rigid body meets another or a plane. Speeds along n [m/s], the
// one that may rebound leaves out what forces added in this step and is never more than there is. A body
// that rolls on its surface points meets the next one at up to its spin times their distance: not counted.
struct Impact {
  CUDA_CALLABLE static inline double approach(double speed, double kick, double feigned) {
    const double all = kick > 0 ? speed - kick : speed;
    return all > MIN_REBOUND_SPEED + feigned ? all : 0.0;
  }
  // Whether a contact closes fast enough to begin an impact of its pair.
  CUDA_CALLABLE static inline bool begins(double approach, double speed, double gap, double dt) {
    return approach > MIN_REBOUND_SPEED && speed * dt > gap;
  }
  // Speed that a contact of a pair in an impact may keep: all near ones rebound.
  CUDA_CALLABLE static inline double target(double e, double approach, double speed, double gap,
                                            double dt, double dx) {
    const bool rebounds = approach > MIN_REBOUND_SPEED && (speed * dt > gap || gap < IMPACT_PATCH_DX * dx);
    return rebounds ? -e * approach : closing(gap, dt);
  }
  // Restitution at the approach speed of an impact. law: the speed at which it is e, slope, exponent, least and most.
  CUDA_CALLABLE static inline double bounce(double e, const double *law, double speed) {
    double now = e;
    if (law[2] != 0) now *= pow((speed > TINY_DOUBLE ? speed : TINY_DOUBLE) / law[0], -law[2]);
    now -= law[1] * (speed - law[0]);
    return now < law[3] ? law[3] : now > law[4] ? law[4] : now;
  }
  // Speed at which a gap may close within a step.
  CUDA_CALLABLE static inline double closing(double gap, double dt) {
    return (gap > 0 ? gap : 0.0) / dt;
  }
};
// How a liquid flows at a wall: yield stress [Pa]; drag = K/d^n [Pa (s/m)^n]; index n.
struct FlowCurve {
  double yield, drag, index;
};
// Shear stress of a sticking liquid on a wall: twin of physics/wall_stress.py. Herschel and Bulkley's flow curve
// tau = yield + K (u/d)^n of a layer d = WALL_LAYER_DX dx thick whose other side slips by u.
struct WallStress {
  // Area of the wall times time [m^2 s] that acts on a node of mass m, h cells over the wall: its spline's
  // weight on the wall over that of the half space above it; full: mass of a full cell.
  CUDA_CALLABLE static inline double span(double m, double full, double h, double dx, double dt) {
    const double a = h < 0 ? -h : h, t = 1.5 - a, on = a < 0.5 ? 0.75 - a * a : t > 0 ? 0.5 * t * t : 0.0;
    return m / full * on / Face<double>::filled(h) * dx * dx * dt;
  }
  // Slip u that is left of one of `free` [m/s]: u + softness span tau(u) = free.
  CUDA_CALLABLE static inline double slip(double free, double softness, double span, const FlowCurve &f) {
    const double s = softness * span, q = free - s * f.yield, drag = s * f.drag;
    if (q <= 0) return 0.0;
    if (f.index == 1 || drag == 0) return q / (1.0 + drag);
    double u = 0.5 * q, other = pow(0.5 * q / drag, 1.0 / f.index);   // from below, where it stays and rises
    if (other < u) u = other;
    if (u < TINY) u = TINY;
    for (int k = 0; k < 12; k++) {
      const double power = drag * pow(u, f.index);
      u -= (u + power - q) / (1.0 + f.index * power / u);
      if (u < TINY) u = TINY;
    }
    return u;
  }
  // J = J_n n + J_t, from a tangential impulse t that would end the slip.
  CUDA_CALLABLE static inline void drag(double softness, double span, const FlowCurve &f, double jn,
                                        const double *n, const double *t, double *J) {
    const double free = softness * sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    const double scale = free > 0 ? 1.0 - slip(free, softness, span, f) / free : 0.0;
    for (int i = 0; i < 3; i++) J[i] = jn * n[i] + scale * t[i];
  }
};
// One projection of one contact onto its Coulomb cone; n points from a to c, and so does what a
// gives to c. Impulses J [N s], velocities u = v_a - v_c [m/s], softness 1/m_eff [1/kg].
struct Coulomb {
  // Normal impulse that leaves the approach speed its target; contacts only push.
  CUDA_CALLABLE static inline double push(double old, double speed, double target, double softness) {
    double jn = old + (speed - target) / softness;
    return jn <= 0 ? 0.0 : jn;
  }
  // Share of a tangential impulse that the cone leaves: |J_t| <= mu J_n.
  CUDA_CALLABLE static inline double share(double size, double limit) {
    return size > limit ? limit / size : 1.0;
  }
  // J = J_n n + J_t, from a tangential impulse that may be too large.
  CUDA_CALLABLE static inline void limit(double mu, double jn, const double *n, const double *t,
                                         double *J) {
    double scale = share(sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]), mu * jn);
    for (int i = 0; i < 3; i++) J[i] = jn * n[i] + scale * t[i];
  }
};
}  // namespace
}  // namespace mpm
