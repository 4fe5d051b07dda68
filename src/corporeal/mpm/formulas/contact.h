// Contact: where faces lie around a node, and what contacts transmit. Twins of physics/contact.py.
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
    return share > R(SMALLEST_WEIGHT) ? share : R(SMALLEST_WEIGHT);
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
    return weight > R(SMALLEST_WEIGHT) ? moment(n) / weight : n;
  }
  // The same of a lattice of two points per cell and axis, the first a quarter of a cell behind the face.
  CUDA_CALLABLE static inline R lattice(R s) {
    s = s > R(1.5) ? R(1.5) : s;
    R weight = 0, moment = 0;
    for (int k = 0; k < LATTICE_ROWS; k++) {
      const R u = s - R(PARTICLE_RADIUS) * R(1 + 2 * k), a = u < 0 ? -u : u, t = R(1.5) - a;
      const R w = a < R(0.5) ? R(0.75) - a * a : a < R(1.5) ? R(0.5) * t * t : R(0.0);
      weight += w;
      moment += w * u;
    }
    return weight > R(SMALLEST_WEIGHT) ? moment / weight : s - R(PARTICLE_RADIUS);
  }
  // Where the face lies: the inverse of mean, from a table of FACE_STEPS + 1 values over [-1.5, 0].
  CUDA_CALLABLE static inline R place(const R *table, R p) {
    R f = ((p < R(-1.5) ? R(-1.5) : p > R(0.0) ? R(0.0) : p) + R(1.5)) * R(FACE_STEPS / 1.5);
    int i = f < R(FACE_STEPS - 1) ? (int)f : FACE_STEPS - 1;
    return table[i] + (table[i + 1] - table[i]) * (f - i);
  }
  // Distance t(s) of the mean offsets of two half spaces that touch.
  CUDA_CALLABLE static inline R touching(R s) {
    s = s < 0 ? -s : s;
    if (s > R(DEEPEST)) s = R(DEEPEST);
    const R n = -s, over = s - R(LATTICE_START), less = least(n), m = moment(n), fills = enough(less);
    const R ahead = m / enough(R(1.0) - less), behind = fills > R(SMALLEST_WEIGHT) ? m / fills : n;
    return -ahead - behind + R(LATTICE_GAP) + R(LATTICE_SLOPE) * (over > 0 ? over : R(0.0));
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
    const bool like = full >= R(FILLED) && off < R(LIKE_HALF_SPACE) && off > R(-LIKE_HALF_SPACE);
    return h > R(WALL_REACH) && (h > R(HELD_BY_WALL) || !like) ? R(VAST) : gap_to_plane(a, h);
  }
  // The same to a surface; what is deep inside of a field does not feel it.
  CUDA_CALLABLE static inline R gap_to_surface(R a, R h) {
    return h > R(WALL_REACH) ? R(VAST) : gap_to_plane(a, h);
  }
  // The same to what is thin: its surface is exact, and the field a lattice.
  CUDA_CALLABLE static inline R gap_to_thin(R a, R h) { return h > R(WALL_REACH) ? R(VAST) : lattice(h) - a; }
};
// Where two rigid bodies touch that meet at a node: in both of them. Twin of contact.touched. R: of the table.
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
    if (far * cosine < other && other * cosine < far) {   // neither edge is all that counts
      first = apart > OPPOSITE ? (far - other * cosine) / apart : 0.5 * far;
      second = apart > OPPOSITE ? (other - far * cosine) / apart : 0.5 * other;
    }
    for (int i = 0; i < 3; i++) out[i] = first * p[i] + second * q[i];
  }
};
// Where the surface of a thin rigid body begins along n, seen from x: the least (p - x) . n of its points
// around that line; of none, that of the point nearest to the line. What is farther behind x than a node
// sees does not count; without any others it is VAST. Points three by three, in its frame.
struct Surface {
  // The least of those around the line alone; VAST: there are none.
  CUDA_CALLABLE static inline double around_line(const double *points, int count, const double *x,
                                                 const double *n, double around, double behind) {
    double best[4] = {VAST, VAST, VAST, VAST};
    const double square = around * around;
    int i = 0;
    for (; i + 4 <= count; i += 4) {   // four side by side, which become vectors
      double along[4], aside[4];
      for (int l = 0; l < 4; l++) {
        const double *p = points + 3 * (i + l);
        const double a = p[0] - x[0], b = p[1] - x[1], c = p[2] - x[2];
        along[l] = a * n[0] + b * n[1] + c * n[2];
        aside[l] = a * a + b * b + c * c - along[l] * along[l];
      }
      for (int l = 0; l < 4; l++) {
        const double at = ((aside[l] < square) & (along[l] > -behind)) ? along[l] : (double)VAST;
        best[l] = at < best[l] ? at : best[l];
      }
    }
    for (; i < count; i++) {
      const double *p = points + 3 * i;
      const double d[3] = {p[0] - x[0], p[1] - x[1], p[2] - x[2]};
      const double along = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
      const double aside = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along;
      if (aside < square && along > -behind && along < best[0]) best[0] = along;
    }
    const double one = best[0] < best[1] ? best[0] : best[1], two = best[2] < best[3] ? best[2] : best[3];
    const double least = one < two ? one : two;
    return least;
  }
  // How far along the line the point nearest to it is, if it is nearer than the nearest so far (squared).
  CUDA_CALLABLE static inline void by_line(const double *points, int count, const double *x, const double *n,
                                           double behind, double &nearest, double &there) {
    for (int i = 0; i < count; i++) {
      const double *p = points + 3 * i;
      const double d[3] = {p[0] - x[0], p[1] - x[1], p[2] - x[2]};
      const double along = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
      const double aside = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along;
      if (aside < nearest && along > -behind) nearest = aside, there = along;
    }
  }
  // Where it begins, by a search that knows the first point around the line and the one nearest to it.
  template <class Search> CUDA_CALLABLE static inline double begins(Search &search) {
    const double least = search.first();
    return least < VAST ? least : search.by_line();
  }
  // Whether one of the places where a body is thin is as near to x as a node sees.
  CUDA_CALLABLE static inline bool thin_there(const double *places, int count, const double *x, double far) {
    for (int i = 0; i < count; i++) {
      const double *p = places + 3 * i;
      const double d[3] = {p[0] - x[0], p[1] - x[1], p[2] - x[2]};
      if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < far * far) return true;
    }
    return false;
  }
};
// A search that looks at all points.
struct AllShown {
  const double *points;
  int count;
  const double *x, *n;
  double around, behind;
  CUDA_CALLABLE inline double first() const { return Surface::around_line(points, count, x, n, around, behind); }
  CUDA_CALLABLE inline double by_line() const {
    double nearest = VAST, there = VAST;
    Surface::by_line(points, count, x, n, behind, nearest, there);
    return there;
  }
};
// How far from a rounded surface point of a rigid body its surface goes on in a direction d: twin of
// physics/rounding.py. row: normal, arc's direction, radii of ball and arc, reach, inside; types.ROUNDING.
struct Round {
  // Angle from the normal, no larger than that up to which a point stands for its surroundings.
  CUDA_CALLABLE static inline double bounded(double angle, double reach, double radius, bool &beyond) {
    const double most = reach < MOST_LEAN * radius ? reach / radius : MOST_LEAN;
    beyond |= angle > most || angle < -most;
    return angle > most ? most : angle < -most ? -most : angle;
  }
  // Whether the point is the surface in that direction at all, and not its neighbours.
  CUDA_CALLABLE static inline bool shift(const double *row, const double *d, double *out) {
    bool beyond = false;
    const double *n = row, *e = row + 3, ball = row[6], arc = row[7], reach = row[8];
    double outward = 0, ahead = 0, aside[3], square = 0;
    for (int i = 0; i < 3; i++) outward += d[i] * n[i], ahead += d[i] * e[i], out[i] = 0;
    if (arc > 0 && sqrt(outward * outward + ahead * ahead) > SIDEWAYS) {
      const double a = bounded(atan2(ahead, outward), reach, ball + arc, beyond);
      for (int i = 0; i < 3; i++) out[i] += arc * (sin(a) * e[i] + (cos(a) - 1.0) * n[i]);
    }
    for (int i = 0; i < 3; i++) aside[i] = d[i] - outward * n[i], square += aside[i] * aside[i];
    if (ball > 0 && square > 0) {
      const double size = sqrt(square), a = bounded(atan2(size, outward), reach, ball, beyond);
      for (int i = 0; i < 3; i++) out[i] += ball * (sin(a) * aside[i] / size + (cos(a) - 1.0) * n[i]);
    }
    return !beyond || row[9] == 0;
  }
};
// A surface around a point that curves along an arc and across it, outwards or inwards, and what is round
// that meets it: twin of physics/curved.py. row: types.ROUNDING.
struct Curved {
  // Radius of the ball that lies under a round point, and that of the arc along which it moves.
  CUDA_CALLABLE static inline double ball(const double *row) { return row[6] > 0 ? row[6] : row[7] > 0 ? row[7] : 0.0; }
  CUDA_CALLABLE static inline double arc(const double *row) { return row[6] > 0 ? row[7] : 0.0; }
  CUDA_CALLABLE static inline bool bends(const double *row) { return row[10] != 0 || row[11] != 0; }
  CUDA_CALLABLE static inline bool hollow(const double *row) { return row[10] < 0 || row[11] < 0; }
  // Height over a curve of curvature k through the origin of what lies s along and h over its tangent there,
  // how far along the curve it lies, and how far the curve has turned; whether it is on the curve's side.
  CUDA_CALLABLE static inline bool over(double k, double s, double &h, double &way, double &sine, double &cosine) {
    const double d = 1.0 + k * h, t = k * s, w = sqrt(t * t + d * d);
    if (d <= NEAREST_MIDDLE) return false;
    h = (2.0 * h + k * (s * s + h * h)) / (w + 1.0);
    way = t * t > TINY ? atan2(t, d) / k : s / d;
    sine = t / w, cosine = d / w;
    return true;
  }
  // Height of a place, seen from the point, over the surface; its normal there, and how far aside that is,
  // squared. Exact for balls and cylinders, from inside and outside; else of third order.
  CUDA_CALLABLE static inline bool height(const double *row, const double *x, double &h, double *m, double &aside) {
    const double *n = row, *e = row + 3;
    const double f[3] = {n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]};
    double s = 0, t = 0, way, across, sine, cosine, leans, stands;
    h = 0;
    for (int i = 0; i < 3; i++) h += x[i] * n[i], s += x[i] * e[i], t += x[i] * f[i];
    if (!over(row[10], s, h, way, sine, cosine) || !over(row[11], t, h, across, leans, stands)) return false;
    for (int i = 0; i < 3; i++) m[i] = leans * f[i] + stands * (sine * e[i] + cosine * n[i]);
    aside = way * way + across * across;
    return true;
  }
  // Middle of the ball under a round point that looks in direction d, from the point.
  CUDA_CALLABLE static inline void middle(const double *row, const double *d, double *out) {
    const double *n = row, *e = row + 3, radius = ball(row), moved = arc(row);
    double outward = 0, ahead = 0;
    bool beyond = false;
    for (int i = 0; i < 3; i++) outward += d[i] * n[i], ahead += d[i] * e[i], out[i] = -radius * n[i];
    if (moved <= 0 || sqrt(outward * outward + ahead * ahead) <= SIDEWAYS) return;
    const double a = Round::bounded(atan2(ahead, outward), row[8], radius + moved, beyond);
    for (int i = 0; i < 3; i++) out[i] += moved * (sin(a) * e[i] + (cos(a) - 1.0) * n[i]);
  }
  // Out of a body's frame into the world, or back; R: three rows.
  CUDA_CALLABLE static inline void turn(const double *R, const double *x, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[3 * i] * x[0] + R[3 * i + 1] * x[1] + R[3 * i + 2] * x[2];
  }
  CUDA_CALLABLE static inline void turn_back(const double *R, const double *x, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2];
  }
  // A place in the frame of a body turned by S, in that of one turned by R; apart: of the first's middle
  // from the other's, in the world.
  CUDA_CALLABLE static inline void carry(const double *S, const double *R, const double *apart, const double *x, double *out) {
    double y[3];
    turn(S, x, y);
    for (int i = 0; i < 3; i++) y[i] += apart[i];
    turn_back(R, y, out);
  }
  // Whether a curved point may meet a round body at all; first: whether that body comes first.
  CUDA_CALLABLE static inline bool may(const double *row, const double *q, const double *centre, double far, bool first) {
    double square = 0;
    for (int i = 0; i < 3; i++) square += (q[i] - centre[i]) * (q[i] - centre[i]);
    const double most = far + row[8];
    return bends(row) && (first || hollow(row)) && square <= most * most;
  }
  // Where round point p touches the face around curved point q, each in its body's frame: the place in p's,
  // the face's normal in the world and the gap; whether it does, nearer than reach.
  CUDA_CALLABLE static inline bool meet(const double *round, const double *p, const double *S, const double *face,
                                        const double *q, const double *R, const double *apart, double reach,
                                        double *x, double *m, double &gap) {
    const double radius = ball(round), spread = CURVED_SPREAD * face[8];
    double n[3], c[3], d[3], h = 0, aside = 0;
    turn(R, face, m);
    turn(S, round, n);
    if (m[0] * n[0] + m[1] * n[1] + m[2] * n[2] > -FACING) return false;
    for (int k = 0; k < CURVED_TURNS; k++) {
      turn_back(S, m, d);
      for (int i = 0; i < 3; i++) d[i] = -d[i];
      middle(round, d, x);
      for (int i = 0; i < 3; i++) x[i] += p[i];
      carry(S, R, apart, x, c);
      for (int i = 0; i < 3; i++) c[i] -= q[i];
      if (!height(face, c, h, d, aside)) return false;
      turn(R, d, m);
      if (arc(round) <= 0) break;
    }
    gap = h - radius;
    if (gap >= reach || gap <= -reach || gap <= -radius || aside > spread * spread) return false;
    const double lean = -(m[0] * n[0] + m[1] * n[1] + m[2] * n[2]);
    if (radius * acos(lean < 1 ? lean : 1.0) > round[8]) return false;
    turn_back(S, m, d);
    for (int i = 0; i < 3; i++) x[i] -= radius * d[i];
    return true;
  }
  // Whether a place that lies `own` from its point, squared, is another round point's, o.
  CUDA_CALLABLE static inline bool taken(const double *round, double own, const double *x, const double *other, const double *o) {
    double square = 0, alike = 0;
    for (int i = 0; i < 3; i++) square += (x[i] - o[i]) * (x[i] - o[i]), alike += round[i] * other[i];
    return OWN_PLACE * OWN_PLACE * square < own && alike > 0 && ball(other) > 0;
  }
  // How far from there nodes misjudge the gap by more than it is: they take both surfaces for planes.
  CUDA_CALLABLE static inline double misjudged(const double *round, const double *row, double dx) {
    const double least = row[10] < row[11] ? row[10] : row[11], most = row[10] < row[11] ? row[11] : row[10];
    const double own = 1.0 / ball(round), bent = own + (-least > most ? -least : most);
    return FACET_NODES * dx + sqrt((0.5 * dx + BENT_NODES * bent * dx * dx) / (own + least));
  }
  // Speed at which a way straight ahead leads into a hollow within a step, from the square of the speed along it.
  CUDA_CALLABLE static inline double inward(const double *round, const double *row, double square, double dt) {
    const double least = row[10] < row[11] ? row[10] : row[11];
    return least < 0 ? -0.5 * least / (1.0 + least * ball(round)) * square * dt : 0.0;
  }
};
// A flat face of a rigid body, on which what is round rolls: twin of physics/facets.py. row: normal, offset;
// middle and radius of its points; how far the face goes on from one; the first and last of them.
struct Facet {
  enum { OFFSET = 3, MIDDLE = 4, AROUND = 7, REACH = 8, BEGIN = 9, END = 10 };
  // Whether a ball of radius r around x comes near the face at all.
  CUDA_CALLABLE static inline bool near(const double *row, const double *x, double r) {
    double h = -row[OFFSET], square = 0;
    for (int i = 0; i < 3; i++) {
      const double d = x[i] - row[MIDDLE + i];
      h += x[i] * row[i], square += d * d;
    }
    const double most = r + row[AROUND] + row[REACH];
    return h < r && h > -r && square < most * most;
  }
  // Whether a place lies over the face: one of its points is no farther aside.
  CUDA_CALLABLE static inline bool holds(const double *row, const double *points, const double *x) {
    const double limit = row[REACH] * row[REACH];
    for (int k = (int)row[BEGIN]; k < (int)row[END]; k++) {
      double along = 0, square = 0;
      for (int i = 0; i < 3; i++) {
        const double d = x[i] - points[3 * k + i];
        along += d * row[i], square += d * d;
      }
      if (square - along * along <= limit) return true;
    }
    return false;
  }
  // How far from there nodes misjudge the gap of a ball of this radius by more than it is: they take it for a plane, too.
  CUDA_CALLABLE static inline double misjudged(double radius, double dx) {
    return FACET_NODES * dx + sqrt((0.5 * radius + BENT_NODES * dx) * dx);
  }
  // Whether a contact on a node, apart from that on the face by d with normals that have this cosine, is the same as it.
  CUDA_CALLABLE static inline bool replaces(const double *d, double cosine, double reach, double alike) {
    return cosine > alike && d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < reach * reach;
  }
};
// Flat faces of a rigid body as a node sees them: rows of Facet, how the body is turned, where the node is in
// its frame, and its mean offset from there in the world [cells].
struct SeenFaces {
  const double *rows;
  int count;
  const double *turn;
  double x[3], mean[3];
  CUDA_CALLABLE inline const double *row(int k) const { return rows + FACET_ROW * k; }
  CUDA_CALLABLE inline void outward(int k, double *out) const { Curved::turn(turn, row(k), out); }
  static CUDA_CALLABLE inline double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  CUDA_CALLABLE inline double height(int k) const { return dot(row(k), x) - row(k)[Facet::OFFSET]; }
  // Which face looks most along sign times n, and how much it does.
  CUDA_CALLABLE inline int most(const double *n, double sign, double &cosine) const {
    double d[3];
    Curved::turn_back(turn, n, d);
    int best = 0;
    cosine = -2.0;
    for (int k = 0; k < count; k++) {
      const double c = sign * dot(row(k), d);
      if (c > cosine) cosine = c, best = k;
    }
    return best;
  }
  // How far its mean offset lies aside from a normal, squared, and what any may.
  CUDA_CALLABLE inline double aside(const double *n) const {
    const double along = dot(mean, n);
    return dot(mean, mean) - along * along + SEEN_ASIDE * SEEN_ASIDE;
  }
  // Two faces that look at one another, from which n leans less than FACES_MEET, and which are farthest apart
  // by value; whether there are any.
  CUDA_CALLABLE static inline bool facing(const SeenFaces &A, const SeenFaces &C, const double *n, double dx, int &a, int &c) {
    double best = -VAST, p[3], d[3];
    for (int i = 0; i < A.count; i++) {
      A.outward(i, p);
      const double cosine = dot(p, n);
      if (cosine <= FACES_MEET) continue;
      Curved::turn_back(C.turn, p, d);
      for (int k = 0; k < C.count; k++) {
        if (dot(C.row(k), d) >= -FACET_ALIKE) continue;
        const double apart = (A.height(i) + C.height(k)) / dx;
        if (apart < FLAT_APART && apart + cosine > best) best = apart + cosine, a = i, c = k;
      }
    }
    return best > -VAST;
  }
  // Normal from a to c of the faces along which they meet, in place of a node's whose lean feigns more approach
  // than there is: twin of facets.along_faces. u: speed of a over c.
  CUDA_CALLABLE static inline void along(const SeenFaces &A, const SeenFaces &C, const double *u, double dx, double *n) {
    double cosine, other, p[3], q[3], found[3], square = 0;
    int a = A.most(n, 1.0, cosine), c = C.most(n, -1.0, other);
    if (cosine <= FACET_ALIKE && other <= FACET_ALIKE) {
      if (!facing(A, C, n, dx, a, c)) return;
      cosine = other = 1.0;
    }
    A.outward(a, p), C.outward(c, q);
    const double one = cosine > FACET_ALIKE ? C.aside(q) : 0.0, two = other > FACET_ALIKE ? A.aside(p) : 0.0;
    for (int i = 0; i < 3; i++) found[i] = one * p[i] - two * q[i], square += found[i] * found[i];
    const double size = sqrt(square);
    const double approach = dot(u, n), real = dot(u, found) / size;
    if (approach <= 0.0 || approach <= 2.0 * real) return;
    for (int i = 0; i < 3; i++) n[i] = found[i] / size;
  }
};
// Where the surface of a rigid body lies for a liquid: twin of physics/contact.py wetted_faces. Rows of
// six: point and outward normal; X is the liquid's place, x the node.
struct Wetted {
  double normal[3], height;
  static CUDA_CALLABLE inline double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static CUDA_CALLABLE inline double square(const double *p, const double *X) {
    const double a = p[0] - X[0], b = p[1] - X[1], c = p[2] - X[2];
    return a * a + b * b + c * c;
  }
  // Whether a row may belong to another face than a known one: it looks another way, at the liquid.
  static CUDA_CALLABLE inline bool other(const double *p, const double *X, const Wetted &known) {
    return dot(p + 3, known.normal) <= WETTED_TURN && dot(X, p + 3) > dot(p, p + 3);
  }
  // Find the faces around X, the nearest first; how many. Rows gives each row, how far it lies from X,
  // squared, and whether it may belong to a face that is not yet known.
  template <class Rows>
  static CUDA_CALLABLE inline int faces(Rows &rows, const double *x, const double *X, double dx, Wetted *face) {
    for (int f = 0; f < WETTED_FACES; f++) {
      double near = WETTED_REACH * dx * WETTED_REACH * dx;
      const double *first = 0;
      rows.know(X, face, f);
      for (int i = 0; i < rows.count; i++) {
        const double d = rows.square(i);
        if (d < near && rows.open(i)) near = d, first = rows.at(i);
      }
      if (!first) return f;
      const double root = sqrt(near) + WETTED_PATCH * dx, far = root * root;
      double n[3] = {0, 0, 0}, above = 0, weight = 0;
      for (int i = 0; i < rows.count; i++) {
        const double *p = rows.at(i), d = rows.square(i);
        if (d > far || dot(p + 3, first + 3) < WETTED_TURN || !rows.open(i)) continue;
        const double u = 1.0 - (d - near) / (far - near), w = u * u;
        for (int k = 0; k < 3; k++) n[k] += w * p[3 + k], above += w * (x[k] - p[k]) * p[3 + k];
        weight += w;
      }
      const double size = sqrt(dot(n, n));
      for (int k = 0; k < 3; k++) face[f].normal[k] = n[k] / size;
      face[f].height = above / weight;
    }
    return WETTED_FACES;
  }
};
// All rows of a surface, one after the other, in no memory of their own.
struct AllWetted {
  const double *row, *X;
  int count, known;
  const Wetted *face;
  CUDA_CALLABLE inline const double *at(int i) const { return row + 6 * i; }
  CUDA_CALLABLE inline double square(int i) const { return Wetted::square(row + 6 * i, X); }
  CUDA_CALLABLE inline void know(const double *, const Wetted *faces, int many) { face = faces, known = many; }
  CUDA_CALLABLE inline bool open(int i) const {
    for (int f = 0; f < known; f++)
      if (!Wetted::other(row + 6 * i, X, face[f])) return false;
    return true;
  }
};
// Those that are near, with how far they are: what belongs to a known face is dropped.
struct NearWetted {
  const double *row[WETTED_ROWS];
  double away[WETTED_ROWS];
  int count;
  inline void add(const double *p, double d) { row[count] = p, away[count++] = d; }
  inline const double *at(int i) const { return row[i]; }
  inline double square(int i) const { return away[i]; }
  inline bool open(int) const { return true; }
  inline void know(const double *X, const Wetted *face, int many) {
    if (!many) return;
    const int before = count;
    count = 0;
    for (int i = 0; i < before; i++)
      if (Wetted::other(row[i], X, face[many - 1])) add(row[i], away[i]);
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
    int n = KEPT_STEPS;
    while (n > 1 && n * speed > KEPT_TRAVEL) n /= 2;
    return n;
  }
};
// In which order contacts are swept: number k is k times the stride, modulo their number.
struct Scatter {
  CUDA_CALLABLE static inline int stride(int count) {
    int step = (int)(SCATTER * count);
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
// that rolls on its surface points meets the next one at up to its spin times their distance: feigned.
struct Impact {
  CUDA_CALLABLE static inline double approach(double speed, double kick, double feigned) {
    const double all = kick > 0 ? speed - kick : speed;
    return all > SLOWEST_BOUNCE + feigned ? all : 0.0;
  }
  // Whether a contact closes fast enough to begin an impact of its pair.
  CUDA_CALLABLE static inline bool begins(double approach, double speed, double gap, double dt) {
    return approach > SLOWEST_BOUNCE && speed * dt > gap;
  }
  // Speed that a contact of a pair in an impact may keep: all near ones rebound.
  CUDA_CALLABLE static inline double target(double e, double approach, double speed, double gap,
                                            double dt, double dx) {
    const bool rebounds = approach > SLOWEST_BOUNCE && (speed * dt > gap || gap < PATCH * dx);
    return rebounds ? -e * approach : closing(gap, dt);
  }
  // Restitution at the speed of a blow. law: the speed at which it is e, slope, exponent, least and most.
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
// What a liquid that sticks bears on a wall: twin of physics/wall_stress.py. Herschel and Bulkley's flow curve
// tau = yield + K (u/d)^n of a layer d = WALL_LAYER dx thick whose other side slips by u.
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
