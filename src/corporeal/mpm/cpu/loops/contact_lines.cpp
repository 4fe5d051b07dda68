// Projections of the contacts that move rigid bodies, in one list, onto their Coulomb cones.
struct List {
  // K gains 1/M + [r]ᵀ I⁻¹ [r] of a rigid body: K e·e is its inverse mass along e.
  static inline void soften(double *K, const double *s, const double *r) {
    double A[3][3], B[3][3];
    for (int i = 0; i < 3; i++) {
      double e[3] = {i == 0, i == 1, i == 2};
      Vec::cross(r, e, A[i]);
      Vec::apply(s + INERTIA, A[i], B[i]);
    }
    const int at[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
    for (int k = 0; k < 6; k++)
      K[k] += Vec::dot(A[at[k][0]], B[at[k][1]]) + (at[k][0] == at[k][1]) * s[INVERSE_MASS];
  }
  static inline double along(const double *K, const double *e) {
    return K[0] * e[0] * e[0] + K[3] * e[1] * e[1] + K[5] * e[2] * e[2] +
           2 * (K[1] * e[0] * e[1] + K[2] * e[0] * e[2] + K[4] * e[1] * e[2]);
  }
  static inline void velocity(const double *s, double m, const double *r, double *u, double sign) {
    if (!s) return;
    double v[3] = {0, 0, 0};
    if (m < 0) {
      Vec::cross(s + SPIN, r, v);
      s += SPEED;
    }
    for (int i = 0; i < 3; i++) u[i] += sign * (s[i] + v[i]);
  }
  static inline void slip(const Line &R, double *u) {
    for (int i = 0; i < 3; i++) u[i] = 0;
    velocity(R.a, R.ma, R.ra, u, 1.0);
    velocity(R.c, R.mc, R.rc, u, -1.0);
  }
  static inline void hit(double *s, double m, const double *r, const double *J, double sign) {
    if (!s) return;
    if (m >= 0) {
      for (int i = 0; i < 3; i++) s[i] += sign * m * J[i];
      return;
    }
    if (s[INVERSE_MASS] == 0) return;
    double t[3], u[3], each = sign * s[INVERSE_MASS];
    Vec::cross(r, J, t);
    Vec::apply(s + INERTIA, t, u);
    for (int i = 0; i < 3; i++) {
      s[SPEED + i] += each * J[i];
      s[MOMENT + i] += sign * t[i];
      s[SPIN + i] += sign * u[i];
    }
  }
  // One projection of one contact onto its Coulomb cone; by how much it changed the velocity.
  static MPM_INLINE double relax(Line &R, double *u) {   // in line, or sweeps would round otherwise
    slip(R, u);
    double un = Vec::dot(u, R.n), old = Vec::dot(R.J, R.n), d[3], t[3];
    double jn = Coulomb::push(old, un, R.target, R.inverse), next[3];
    if (jn == 0 && old == 0 && R.span == 0) return 0;
    for (int i = 0; i < 3; i++) {
      d[i] = u[i] - un * R.n[i];
      t[i] = R.J[i] - old * R.n[i];
    }
    double size = sqrt(Vec::dot(d, d)), soft = R.inverse;
    if (size > mpm::MIN_SLIP_SPEED) {
      double e[3] = {d[0] / size, d[1] / size, d[2] / size};
      soft = along(R.K, e);
      for (int i = 0; i < 3; i++) t[i] += d[i] / soft;
    }
    if (R.span > 0)
      WallStress::drag(soft, R.span, *(const mpm::FlowCurve *)R.flows_by, jn, R.n, t, next);
    else
      Coulomb::limit(R.mu, jn, R.n, t, next);
    for (int i = 0; i < 3; i++) {
      d[i] = next[i] - R.J[i];
      R.J[i] = next[i];
    }
    hit(R.a, R.ma, R.ra, d, -1.0);
    hit(R.c, R.mc, R.rc, d, 1.0);
    return sqrt(Vec::dot(d, d)) * R.inverse;
  }
  // Start from the force of the last step where it is still compressive (warm start).
  static inline void remember(Line &R, const double *force, double dt) {
    double jn = Vec::dot(force, R.n) * dt, t[3];
    if (jn <= 0) return;
    for (int i = 0; i < 3; i++) t[i] = force[i] * dt - jn * R.n[i];
    Coulomb::limit(R.mu, jn, R.n, t, R.J);
    hit(R.a, R.ma, R.ra, R.J, -1.0);
    hit(R.c, R.mc, R.rc, R.J, 1.0);
  }
  // By place, whatever order they were found in (Shell's method).
  static inline void sort(const Line *lines, int *order, int n) {
    for (int gap = n / 2; gap > 0; gap /= 2)
      for (int i = gap; i < n; i++) {
        const int moved = order[i];
        int j = i;
        for (; j >= gap && lines[order[j - gap]].key > lines[moved].key; j -= gap) order[j] = order[j - gap];
        order[j] = moved;
      }
  }
  // Projections of contacts in order, until they change little; how many sweeps that took. Contacts
  // of two rigid bodies go forwards, then backwards: with one order for all sweeps the first would
  // carry more, and stacks creep to one side. So do the planes below a stack; a lone block on a
  // plane, which has few sweeps, would creep if they turned about.
  // ends: where each group of contacts ends in that order.
  static inline int sweep(Line *lines, const int *order, const int *ends, int n, int most_sweeps, int least,
                          double still, bool stacked) {
    double u[3];
    for (int s = 0; s < most_sweeps; s++) {
      double most = 0;
      for (int first = 0, last; first < n; first = last) {
        const Line &F = lines[order[first]];
        const bool turned = s & 1 && F.ma < 0 && (F.c ? F.mc < 0 : stacked);
        last = ends[F.group];
        if (F.waits) continue;
        const int count = last - first, stride = Scatter::stride(count);
        for (int i = 0; i < count; i++) {
          const long long k = turned ? count - 1 - i : i;
          double change = relax(lines[order[first + (int)(k * stride % count)]], u);
          if (change > most) most = change;
        }
      }
      if (most == 0 || (s >= least && most < still)) return s + 1;
    }
    at_once(lines, n);
    return most_sweeps;
  }
  // Whether a rigid body meets one of prescribed motion there.
  static inline bool guided(const Line &R) {
    return !R.waits && R.ma < 0 && R.c && R.mc < 0 && (R.a[INVERSE_MASS] == 0 || R.c[INVERSE_MASS] == 0);
  }
  // Bodies of prescribed motion may leave no room between: then sweeps do not converge, and end as the last
  // contacts have it. Solved all at once, contacts press what is in between equally from all sides.
  MPM_RARE static void at_once(Line *lines, int n) {
    bool any = false;
    for (int i = 0; i < n && !any; i++) any = guided(lines[i]);
    for (int s = 0; s < mpm::SIMULTANEOUS_SWEEPS && any; s++) {
      double u[3];
      int count = 0;
      for (int i = 0; i < n; i++)
        if (!lines[i].waits) {
          Line &R = lines[i];
          for (int d = 0; d < 3; d++) R.change[d] = -R.J[d];
          relax(R, u);
          for (int d = 0; d < 3; d++) R.change[d] += R.J[d];
          hit(R.a, R.ma, R.ra, R.change, 1.0);   // and back: the other contacts start from the same motion
          hit(R.c, R.mc, R.rc, R.change, -1.0);
          count += Vec::dot(R.change, R.change) > 0;
        }
      any = count > 0;
      for (int i = 0; i < n && any; i++) {
        Line &R = lines[i];
        if (R.waits) continue;
        for (int d = 0; d < 3; d++) {
          R.J[d] -= R.change[d];
          R.change[d] /= count;
          R.J[d] += R.change[d];
        }
        hit(R.a, R.ma, R.ra, R.change, -1.0);
        hit(R.c, R.mc, R.rc, R.change, 1.0);
      }
    }
  }
  // Along n: how fast a contact closes, and how fast without what forces added in this step.
  static inline double closing(const Line &R, const Field *body, double &approach) {
    double u[3], kick = 0;
    slip(R, u);
    const double speed = Vec::dot(u, R.n);
    if (R.ma < 0) kick += Vec::dot(R.a + KICK, R.n);
    if (R.c && R.mc < 0) kick -= Vec::dot(R.c + KICK, R.n);
    const double *w = R.a + SPIN, turns = body ? sqrt(Vec::dot(w, w)) : 0.0;
    approach = Impact::approach(speed, kick, body ? turns * body->spacing : 0.0);
    return speed;
  }
  static inline int first_slot(u64 key, int slots) {
    return (int)((key * 0x9e3779b97f4a7c15ull) >> 32) & (slots - 1);
  }
  static inline void side(const World *w, Side *sides, int f, int s, const double *x, double *&at,
                          double &m, double *r, double *K) {
    at = 0;
    m = 0;
    if (f >= w->fields) return;
    if (w->field[f].rigids) {
      at = w->field[f].rigid;
      m = -1;
      for (int i = 0; i < 3; i++) r[i] = x[i] - at[CENTRE + i];
      soften(K, at, r);
    } else {
      at = sides[s].v;
      m = sides[s].inverse;
      K[0] += m;
      K[3] += m;
      K[5] += m;
    }
  }
};
