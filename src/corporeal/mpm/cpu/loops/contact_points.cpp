// Contacts of rigid bodies at their surface points: with planes, and of round bodies with flat faces of
// others. Twin of reference/surface_point_contacts.py. Not inlined: that costs 5 % where nothing is rigid.
struct Points {
  // Where the rounded surface around point p ends in a direction, both in the body's frame, and the gap
  // there, from that of the point itself; whether it is below reach.
  static inline bool touching(const Field &F, int p, const double *towards, double reach, double &gap,
                              double *at) {
    const double *row = F.curvature + mpm::CURVATURE_ROW * p;
    double shift[3] = {0, 0, 0};
    if (row[6] + row[7] > 0) {
      if (gap >= reach + 2 * row[8]) return false;   // neither part goes farther than the point's reach
      if (!mpm::Round::shift(row, towards, shift)) return false;
      gap -= Vec::dot(towards, shift);
    }
    for (int i = 0; i < 3; i++) at[i] = F.surface[3 * p + i] + shift[i];
    return gap < reach;
  }
  static inline void turn(const double *s, const double *v, double *out) {   // into the world
    for (int i = 0; i < 3; i++) out[i] = Vec::dot(s + TURN + 3 * i, v);
  }
  static inline void turn_back(const double *s, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = v[0] * s[TURN + i] + v[1] * s[TURN + 3 + i] + v[2] * s[TURN + 6 + i];
  }
  // Enter a contact of a's with c's at a point; side: whose surface point it is, 0 or 1.
  static inline void enter(const World *w, Touch &T, int number, int a, int c, int side, double gap) {
    T.meet = -1;
    T.face = side;
    T.choice = -1;
    T.a = number;
    T.c = -1 - c;
    T.fa = a;
    T.fc = c;
    T.gap = gap;
    T.active = 1;
    T.span = T.instead = 0;
    T.mu = w->friction[a * (w->fields + w->planes) + c];
    T.target = Impact::closing(gap, w->dt);
    for (int i = 0; i < 3; i++) T.J[i] = 0;
  }
  // The body that rolls on such a contact, if any does.
  static inline const Field *rolls(const World *w, const Touch &T) {
    return T.meet >= 0 ? 0 : &w->field[T.face ? T.fc : T.fa];
  }
  static inline bool has(const Field &F) { return F.rigids && F.surfaces && F.rigid[INVERSE_MASS] != 0; }
  static inline bool low(const World *w, const Field &F, int v) {
    const double *P = w->plane + 4 * v;
    return Vec::dot(P, F.rigid + CENTRE) - P[3] <= F.rigid[RADIUS] + mpm::SURFACE_POINT_REACH_DX * w->dx;
  }
  MPM_RARE static int on_planes(const World *w, Touch *list) {
    const double reach = mpm::SURFACE_POINT_REACH_DX * w->dx;
    int count = 0;
    for (int f = 0; f < w->fields; f++) {
      const Field &F = w->field[f];
      const double *s = F.rigid;
      for (int v = 0; v < w->planes && has(F); v++) {
        if (!low(w, F, v)) continue;
        const double *P = w->plane + 4 * v, centre = Vec::dot(P, s + CENTRE) - P[3];
        double up[3], at[3];             // the plane's normal in the body's frame
        turn_back(s, P, up);
        const double towards[3] = {-up[0], -up[1], -up[2]};
        for (int p = 0; p < F.surfaces; p++) {
          double gap = centre + Vec::dot(up, F.surface + 3 * p);
          if (!touching(F, p, towards, reach, gap, at)) continue;
          Touch &T = list[count++];
          enter(w, T, p, f, w->fields + v, 0, gap);
          turn(s, at, T.x);
          for (int i = 0; i < 3; i++) T.x[i] += s[CENTRE + i], T.normal[i] = -P[i];
        }
      }
    }
    return count;
  }
  // Whether rounded points of body f may meet flat or curved faces of body g.
  static inline bool may(const World *w, int f, int g) {
    const Field &F = w->field[f], &G = w->field[g];
    if (f == g || !has(F) || !F.rolls || !G.rigids || !(G.facets || G.bends)) return false;
    if (w->friction[f * (w->fields + w->planes) + g] < 0) return false;   // never in contact
    double square = 0, most = F.rigid[RADIUS] + G.rigid[RADIUS] + mpm::SURFACE_POINT_REACH_DX * w->dx;
    for (int i = 0; i < 3; i++) {
      const double d = F.rigid[CENTRE + i] - G.rigid[CENTRE + i];
      square += d * d;
    }
    return square < most * most;
  }
  MPM_RARE static int on_facets(const World *w, Touch *list, int room) {
    int count = 0;
    for (int f = 0; f < w->fields; f++)
      for (int g = 0; g < w->fields; g++)
        if (w->field[g].facets && may(w, f, g)) count += with_facets(w, f, g, list + count, room - count);
    return count;
  }
  MPM_RARE static int with_facets(const World *w, int f, int g, Touch *list, int room) {
    const Field &F = w->field[f], &G = w->field[g];
    const double *s = F.rigid, *t = G.rigid, reach = mpm::SURFACE_POINT_REACH_DX * w->dx;
    double apart[3], centre[3];
    for (int i = 0; i < 3; i++) apart[i] = s[CENTRE + i] - t[CENTRE + i];
    turn_back(t, apart, centre);
    int count = 0;
    for (int k = 0; k < G.facets; k++) {
      const double *row = G.facet + mpm::FACET_ROW * k;
      if (!mpm::Facet::near(row, centre, s[RADIUS] + reach)) continue;
      double n[3], up[3], at[3], x[3], y[3];
      turn(t, row, n);
      turn_back(s, n, up);
      const double towards[3] = {-up[0], -up[1], -up[2]}, height = Vec::dot(row, centre) - row[3];
      for (int p = 0; p < F.surfaces && count < room; p++) {
        const double *curvature = F.curvature + mpm::CURVATURE_ROW * p;
        double gap = height + Vec::dot(up, F.surface + 3 * p);
        const double radius = curvature[6] + curvature[7];   // its centre is on this side of the face
        if (radius <= 0 || !touching(F, p, towards, reach, gap, at) || gap <= -reach || gap <= -radius) continue;
        turn(s, at, x);
        for (int i = 0; i < 3; i++) at[i] = x[i] + apart[i];
        turn_back(t, at, y);
        if (!mpm::Facet::holds(row, G.facet_point, y)) continue;
        Touch &T = list[count++];
        enter(w, T, k * F.surfaces + p, f < g ? f : g, f < g ? g : f, f > g, gap);
        for (int i = 0; i < 3; i++) T.x[i] = x[i] + s[CENTRE + i], T.normal[i] = f < g ? -n[i] : n[i];
      }
    }
    return count;
  }
  MPM_RARE static int on_curves(const World *w, Touch *list, int room) {
    int count = 0;
    for (int f = 0; f < w->fields; f++)
      for (int g = 0; g < w->fields; g++)
        if (w->field[g].bends && may(w, f, g)) count += Meets(w, f, g).all(list + count, room - count);
    return count;
  }
  // Round points of body f on curved ones of body g. Where both are round, those of the first body count.
  struct Meets {
    enum { MOST_BENT = 8192 };   // more than a body has surface points
    const World *w;
    const Field &F, &G;
    const double *s, *t, reach;
    int f, g, nears, near[MOST_BENT];
    double apart[3], low[3], high[3];
    Meets(const World *w, int f, int g)
        : w(w), F(w->field[f]), G(w->field[g]), s(F.rigid), t(G.rigid), reach(mpm::SURFACE_POINT_REACH_DX * w->dx), f(f), g(g) {
      for (int i = 0; i < 3; i++) apart[i] = s[CENTRE + i] - t[CENTRE + i];
    }
    const double *row(int q) const { return G.curvature + mpm::CURVATURE_ROW * q; }
    // List curved points of g near f, and the box around them, in the world from f's centre.
    bool find() {
      double centre[3], x[3];
      turn_back(t, apart, centre);
      nears = 0;
      for (int i = 0; i < 3; i++) low[i] = mpm::VAST, high[i] = -mpm::VAST;
      for (int q = 0; q < G.surfaces && nears < MOST_BENT; q++) {
        if (!mpm::Curved::may(row(q), G.surface + 3 * q, centre, s[RADIUS] + reach, f < g)) continue;
        near[nears++] = q;
        turn(t, G.surface + 3 * q, x);
        for (int i = 0; i < 3; i++) {
          x[i] -= apart[i];
          if (x[i] - row(q)[8] < low[i]) low[i] = x[i] - row(q)[8];
          if (x[i] + row(q)[8] > high[i]) high[i] = x[i] + row(q)[8];
        }
      }
      return nears > 0;
    }
    // The curved point nearest to a place in g's frame, on its side; -1: none.
    int nearest(const double *x) const {
      int best = -1;
      double least = mpm::VAST;
      for (int k = 0; k < nears; k++) {
        const double *q = G.surface + 3 * near[k], *n = row(near[k]);
        const double d[3] = {x[0] - q[0], x[1] - q[1], x[2] - q[2]}, square = Vec::dot(d, d);
        if (square < least && Vec::dot(d, n) > 0) least = square, best = near[k];
      }
      return best;
    }
    // Whether a place in f's frame belongs to point p and not to its neighbours.
    bool owns(int p, const double *x) const {
      const double *round = F.curvature + mpm::CURVATURE_ROW * p, *at = F.surface + 3 * p;
      const double d[3] = {x[0] - at[0], x[1] - at[1], x[2] - at[2]}, own = Vec::dot(d, d);
      for (int o = 0; o < F.surfaces; o++)
        if (mpm::Curved::taken(round, own, x, F.curvature + mpm::CURVATURE_ROW * o, F.surface + 3 * o)) return false;
      return true;
    }
    bool meet(int p, Touch &T) const {
      const double *round = F.curvature + mpm::CURVATURE_ROW * p, radius = mpm::Curved::ball(round);
      double x[3], y[3], m[3], gap;
      turn(s, F.surface + 3 * p, y);
      for (int i = 0; i < 3; i++)
        if (y[i] < low[i] - reach - round[8] || y[i] > high[i] + reach + round[8]) return false;
      for (int i = 0; i < 3; i++) x[i] = F.surface[3 * p + i] - radius * round[i];
      mpm::Curved::carry(s + TURN, t + TURN, apart, x, y);
      const int q = nearest(y);
      if (q < 0 || !mpm::Curved::meet(round, F.surface + 3 * p, s + TURN, row(q), G.surface + 3 * q, t + TURN, apart,
                                      reach, x, m, gap))
        return false;
      if (!owns(p, x)) return false;
      enter(w, T, G.facets * F.surfaces + p, f < g ? f : g, f < g ? g : f, f > g, gap);
      turn(s, x, y);
      T.instead = mpm::Curved::misjudged(round, row(q), w->dx);
      for (int i = 0; i < 3; i++) T.x[i] = y[i] + s[CENTRE + i], T.normal[i] = f < g ? -m[i] : m[i];
      for (int i = 0; i < 3; i++) y[i] = T.x[i] + radius * m[i];   // centre of the round body
      T.target -= mpm::Curved::inward(round, row(q), along(y, m), w->dt);
      return true;
    }
    // How fast a place of f moves over g, across a normal, squared.
    double along(const double *x, const double *m) const {
      double v[3], u[3];
      Body6::velocity(s, x, v);
      Body6::velocity(t, x, u);
      for (int i = 0; i < 3; i++) v[i] -= u[i];
      const double n = Vec::dot(v, m), square = Vec::dot(v, v) - n * n;
      return square > 0 ? square : 0.0;
    }
    int all(Touch *list, int room) {
      int count = 0;
      if (!find()) return 0;
      for (int p = 0; p < F.surfaces && count < room; p++)
        if (mpm::Curved::ball(F.curvature + mpm::CURVATURE_ROW * p) > 0) count += meet(p, list[count]);
      return count;
    }
  };
  // How many contacts on points there may be.
  MPM_RARE static int most(const World *w) {
    int count = 0;
    for (int f = 0; f < w->fields; f++) {
      const Field &F = w->field[f];
      if (!has(F)) continue;
      for (int v = 0; v < w->planes; v++) count += low(w, F, v) ? F.surfaces : 0;
      for (int g = 0; g < w->fields; g++) count += may(w, f, g) ? F.surfaces : 0;
    }
    return count;
  }
  // Radius around a contact with a face in which contacts at nodes are ignored [m].
  static inline double instead(const World *w, const Touch &P) {
    return P.instead > 0 ? P.instead : mpm::Facet::misjudged(rolls(w, P)->rigid[RADIUS], w->dx);
  }
  // Contacts at nodes that repeat those on flat and curved faces, less accurately, transmit nothing.
  MPM_RARE static void instead_of_nodes(const World *w, Touch *touches, int nodes, int first, int all) {
    for (int q = first; q < all; q++) {
      const Touch &P = touches[q];
      const double reach = instead(w, P);
      const bool bent = P.instead > 0 || w->field[P.face ? P.fa : P.fc].thin;
      const double alike = bent ? mpm::CURVED_NORMAL_COSINE : mpm::FACET_NORMAL_COSINE;
      for (int t = 0; t < nodes; t++) {
        Touch &T = touches[t];
        if (!T.active || T.fa != P.fa || T.fc != P.fc) continue;
        double d[3];
        for (int i = 0; i < 3; i++) d[i] = T.x[i] - P.x[i];
        if (mpm::Facet::replaces(d, Vec::dot(T.normal, P.normal), reach, alike)) T.active = 0;
      }
    }
  }
  // Nor do those whose normals lie between the normals of several such faces: in a valley.
  MPM_RARE static void nor_in_valleys(const World *w, Touch *touches, int nodes, int first, int all) {
    for (int t = 0; t < nodes && all - first > 1; t++) {
      Touch &T = touches[t];
      if (!T.active || T.c < 0 || !w->field[T.fa].rigids || !w->field[T.fc].rigids) continue;
      double rest[3] = {T.normal[0], T.normal[1], T.normal[2]};
      for (int turn = 0; turn < mpm::VALLEY_ITERATIONS; turn++) {
        const Touch *best = 0;
        double most = 0;
        for (int q = first; q < all; q++) {
          const Touch &P = touches[q];
          if (P.fa != T.fa || P.fc != T.fc) continue;
          const double cosine = Vec::dot(rest, P.normal), reach = instead(w, P);
          double d[3];
          for (int i = 0; i < 3; i++) d[i] = T.x[i] - P.x[i];
          if (cosine > most && Vec::dot(d, d) < reach * reach) most = cosine, best = &P;
        }
        if (!best) break;
        for (int i = 0; i < 3; i++) rest[i] -= most * best->normal[i];
      }
      if (Vec::dot(rest, rest) < 1.0 - mpm::FACET_NORMAL_COSINE * mpm::FACET_NORMAL_COSINE) T.active = 0;
    }
  }
};
