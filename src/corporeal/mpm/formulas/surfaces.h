// Surfaces of rigid bodies for contact: points, round and curved surfaces, flat faces, wetted points.
#pragma once
#include "contact.h"
namespace mpm {
namespace {
// Support of a thin rigid body along n at x: the least (p - x) . n of its points
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
// A search over all points.
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
// physics/curved_surface.py. row: normal, arc's direction, radii of ball and arc, reach, inside; types.CURVATURE_ROW.
struct Round {
  // Angle from the normal, no larger than that up to which a point stands for its surroundings.
  CUDA_CALLABLE static inline double bounded(double angle, double reach, double radius, bool &beyond) {
    const double most = reach < MAX_ARC_ANGLE_RAD * radius ? reach / radius : MAX_ARC_ANGLE_RAD;
    beyond |= angle > most || angle < -most;
    return angle > most ? most : angle < -most ? -most : angle;
  }
  // Whether the point is the surface in that direction at all, and not its neighbours.
  CUDA_CALLABLE static inline bool shift(const double *row, const double *d, double *out) {
    bool beyond = false;
    const double *n = row, *e = row + 3, ball = row[6], arc = row[7], reach = row[8];
    double outward = 0, ahead = 0, aside[3], square = 0;
    for (int i = 0; i < 3; i++) outward += d[i] * n[i], ahead += d[i] * e[i], out[i] = 0;
    if (arc > 0 && sqrt(outward * outward + ahead * ahead) > MIN_ARC_COMPONENT) {
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
// A surface around a point that curves along an arc and across it, outwards or inwards, and a round body
// that meets it: twin of physics/curved_surface.py. row: types.CURVATURE_ROW.
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
    if (d <= MIN_CENTRE_DISTANCE_RATIO) return false;
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
    if (moved <= 0 || sqrt(outward * outward + ahead * ahead) <= MIN_ARC_COMPONENT) return;
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
    const double radius = ball(round), spread = CURVED_PATCH_RATIO * face[8];
    double n[3], c[3], d[3], h = 0, aside = 0;
    turn(R, face, m);
    turn(S, round, n);
    if (m[0] * n[0] + m[1] * n[1] + m[2] * n[2] > -FACING_POINTS_COSINE) return false;
    for (int k = 0; k < CURVED_CONTACT_ITERATIONS; k++) {
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
    return NEAREST_POINT_FACTOR * NEAREST_POINT_FACTOR * square < own && alike > 0 && ball(other) > 0;
  }
  // How far from there nodes misjudge the gap by more than it is: they take both surfaces for planes.
  CUDA_CALLABLE static inline double misjudged(const double *round, const double *row, double dx) {
    const double least = row[10] < row[11] ? row[10] : row[11], most = row[10] < row[11] ? row[11] : row[10];
    const double own = 1.0 / ball(round), bent = own + (-least > most ? -least : most);
    return FACET_REPLACES_NODES_DX * dx + sqrt((0.5 * dx + CURVED_GAP_ERROR_DX2 * bent * dx * dx) / (own + least));
  }
  // Speed at which a way straight ahead leads into a hollow within a step, from the square of the speed along it.
  CUDA_CALLABLE static inline double inward(const double *round, const double *row, double square, double dt) {
    const double least = row[10] < row[11] ? row[10] : row[11];
    return least < 0 ? -0.5 * least / (1.0 + least * ball(round)) * square * dt : 0.0;
  }
};
// A flat face of a rigid body, on which round bodies roll: twin of physics/flat_facets.py. row: normal, offset;
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
    return FACET_REPLACES_NODES_DX * dx + sqrt((0.5 * radius + CURVED_GAP_ERROR_DX2 * dx) * dx);
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
  // Face whose normal is nearest to sign times n, and its cosine.
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
    return dot(mean, mean) - along * along + FACE_SCATTER_DX * FACE_SCATTER_DX;
  }
  // Two faces that face each other, from which n leans less than OPPOSED_FACES_COSINE, and which are farthest apart
  // by value; whether there are any.
  CUDA_CALLABLE static inline bool facing(const SeenFaces &A, const SeenFaces &C, const double *n, double dx, int &a, int &c) {
    double best = -VAST, p[3], d[3];
    for (int i = 0; i < A.count; i++) {
      A.outward(i, p);
      const double cosine = dot(p, n);
      if (cosine <= OPPOSED_FACES_COSINE) continue;
      Curved::turn_back(C.turn, p, d);
      for (int k = 0; k < C.count; k++) {
        if (dot(C.row(k), d) >= -FACET_NORMAL_COSINE) continue;
        const double apart = (A.height(i) + C.height(k)) / dx;
        if (apart < FLAT_BODY_GAP_DX && apart + cosine > best) best = apart + cosine, a = i, c = k;
      }
    }
    return best > -VAST;
  }
  // Normal from a to c of the faces along which they meet, in place of a node's whose tilt causes more approach
  // than there is: twin of flat_facets.facet_normals. u: speed of a over c.
  CUDA_CALLABLE static inline void along(const SeenFaces &A, const SeenFaces &C, const double *u, double dx, double *n) {
    double cosine, other, p[3], q[3], found[3], square = 0;
    int a = A.most(n, 1.0, cosine), c = C.most(n, -1.0, other);
    if (cosine <= FACET_NORMAL_COSINE && other <= FACET_NORMAL_COSINE) {
      if (!facing(A, C, n, dx, a, c)) return;
      cosine = other = 1.0;
    }
    A.outward(a, p), C.outward(c, q);
    const double one = cosine > FACET_NORMAL_COSINE ? C.aside(q) : 0.0, two = other > FACET_NORMAL_COSINE ? A.aside(p) : 0.0;
    for (int i = 0; i < 3; i++) found[i] = one * p[i] - two * q[i], square += found[i] * found[i];
    const double size = sqrt(square);
    const double approach = dot(u, n), real = dot(u, found) / size;
    if (approach <= 0.0 || approach <= 2.0 * real) return;
    for (int i = 0; i < 3; i++) n[i] = found[i] / size;
  }
};
// Where the surface of a rigid body lies for a liquid: twin of wetted_faces in physics/contact.py. Rows of
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
  // Whether a row may belong to another face than a known one: its normal differs and points to the liquid.
  static CUDA_CALLABLE inline bool other(const double *p, const double *X, const Wetted &known) {
    return dot(p + 3, known.normal) <= WETTED_NORMAL_COSINE && dot(X, p + 3) > dot(p, p + 3);
  }
  // Find the faces around X, the nearest first; how many. Rows gives each row, how far it lies from X,
  // squared, and whether it may belong to a face that is not yet known.
  template <class Rows>
  static CUDA_CALLABLE inline int faces(Rows &rows, const double *x, const double *X, double dx, Wetted *face) {
    for (int f = 0; f < MAX_WETTED_FACES; f++) {
      double near = WETTED_REACH_DX * dx * WETTED_REACH_DX * dx;
      const double *first = 0;
      rows.know(X, face, f);
      for (int i = 0; i < rows.count; i++) {
        const double d = rows.square(i);
        if (d < near && rows.open(i)) near = d, first = rows.at(i);
      }
      if (!first) return f;
      const double root = sqrt(near) + WETTED_PATCH_DX * dx, far = root * root;
      double n[3] = {0, 0, 0}, above = 0, weight = 0;
      for (int i = 0; i < rows.count; i++) {
        const double *p = rows.at(i), d = rows.square(i);
        if (d > far || dot(p + 3, first + 3) < WETTED_NORMAL_COSINE || !rows.open(i)) continue;
        const double u = 1.0 - (d - near) / (far - near), w = u * u;
        for (int k = 0; k < 3; k++) n[k] += w * p[3 + k], above += w * (x[k] - p[k]) * p[3 + k];
        weight += w;
      }
      const double size = sqrt(dot(n, n));
      for (int k = 0; k < 3; k++) face[f].normal[k] = n[k] / size;
      face[f].height = above / weight;
    }
    return MAX_WETTED_FACES;
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
  const double *row[MAX_WETTED_POINTS];
  double away[MAX_WETTED_POINTS];
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
}  // namespace
}  // namespace mpm
