// Rigid inclusions: a frame and the soft nodes inside it are one rigid body while contact acts on it.
// Same formulas as inclusions.py; design: physics, section 5.1.
struct Bonds {
  static inline void invert(const double *A, double *B) {
    double r[3][3];
    for (int i = 0; i < 3; i++) Vec::cross(A + 3 * ((i + 1) % 3), A + 3 * ((i + 2) % 3), r[i]);
    double det = A[0] * r[0][0] + A[1] * r[0][1] + A[2] * r[0][2];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) B[3 * i + j] = r[j][i] / det;
  }
  // I += m (|r|^2 1 - r rt)
  static inline void add(double *I, double m, const double *r) {
    double q = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) I[3 * i + j] += m * ((i == j ? q : 0.0) - r[i] * r[j]);
  }
  static inline void place(const World *world, const Field &S, int slot, double *x) {
    const int *w = S.where + 4 * (slot >> 6);
    const int in[3] = {slot >> 4 & 3, slot >> 2 & 3, slot & 3};
    for (int i = 0; i < 3; i++) x[i] = (4 * (w[i] + S.origin[i]) + in[i]) * world->dx;
  }
  // Slot of a node of the world in a field; -1: none.
  static inline int slot(const Field &S, int x, int y, int z) {
    int c[3] = {x - 4 * S.origin[0], y - 4 * S.origin[1], z - 4 * S.origin[2]}, out = 0;
    for (int i = 0; i < 3; i++) out |= c[i] < 0 || c[i] >> 2 >= S.dim[i];
    int b = out ? -1 : S.table[((c[0] >> 2) * S.dim[1] + (c[1] >> 2)) * S.dim[2] + (c[2] >> 2)];
    return b < 0 ? -1 : b * 64 + (c[0] & 3) * 16 + (c[1] & 3) * 4 + (c[2] & 3);
  }
  // The frame's volume on the soft field's nodes, by slot; lists those that it reaches.
  static inline void spread(const World *world, Bond &B) {
    const Field &S = world->field[B.soft];
    const double *s = world->field[B.frame].rigid;
    B.count = 0;
    for (int p = 0; p < B.points; p++) {
      const double *q = B.point + 4 * p;
      int base[3];
      float w[3][3];
      for (int i = 0; i < 3; i++) {
        double r = s[TURN + 3 * i] * q[0] + s[TURN + 3 * i + 1] * q[1] + s[TURN + 3 * i + 2] * q[2];
        double c = (s[CENTRE + i] + r) / world->dx;
        base[i] = (int)floor(c - 0.5);
        mpm::Spline<float>::weights((float)(c - base[i]), w[i]);
      }
      for (int i = 0; i < 27; i++) {
        int e = slot(S, base[0] + i / 9, base[1] + i / 3 % 3, base[2] + i % 3);
        if (e < 0) continue;
        float *node = S.node + (size_t)e * 8;
        if (!(node[0] > 0)) continue;
        if (B.volume[e] == 0) B.slot[B.count++] = e;
        B.volume[e] += (float)q[3] * w[0][i / 9] * w[1][i / 3 % 3] * w[2][i % 3] + (float)mpm::TINY;
      }
    }
  }
  // Soft nodes where the frame has its share of the volume; contact takes them for empty.
  static inline void hold(World *world) {
    if (world->again) return;
    for (int k = 0; k < world->bonds; k++) {
      Bond &B = world->bond[k];
      spread(world, B);
      int reached = B.count;
      B.count = 0;
      for (int e = 0; e < reached; e++) {
        float *node = world->field[B.soft].node + (size_t)B.slot[e] * 8;
        float stiff = B.volume[B.slot[e]], soft = node[0] * (float)B.per_soft;
        B.volume[B.slot[e]] = 0;
        if (stiff < (float)mpm::HELD_SHARE * (stiff + soft)) continue;
        B.slot[B.count] = B.slot[e];
        B.mass[B.count++] = node[0];
        node[0] = 0;
        world->field[B.soft].have[B.slot[e] >> 6] &= ~(1ull << (B.slot[e] & 63));
      }
    }
  }
  // Common centre, velocity from summed momentum, spin from summed angular momentum.
  static inline void join(World *world) {
    for (int k = 0; k < world->bonds; k++) {
      const Bond &B = world->bond[k];
      const Field &S = world->field[B.soft];
      double *s = world->field[B.frame].rigid, M = s[0], P[3], X[3], I[9], r[3], p[3], l[3];
      for (int i = 0; i < 4; i++) s[OWN + i] = s[i];
      for (int i = 0; i < 3; i++) {
        X[i] = M * s[CENTRE + i];
        P[i] = M * s[SPEED + i];
      }
      for (int e = 0; e < B.count; e++) {
        place(world, S, B.slot[e], r);
        M += B.mass[e];
        for (int i = 0; i < 3; i++) {
          X[i] += B.mass[e] * r[i];
          P[i] += B.mass[e] * S.node[(size_t)B.slot[e] * 8 + 1 + i];
        }
      }
      invert(s + INERTIA, I);
      for (int i = 0; i < 3; i++) {
        X[i] /= M;
        r[i] = s[CENTRE + i] - X[i];
        p[i] = s[0] * s[SPEED + i];
      }
      Vec::cross(r, p, l);
      add(I, s[0], r);
      for (int i = 0; i < 3; i++) s[MOMENT + i] += l[i];
      for (int e = 0; e < B.count; e++) {
        place(world, S, B.slot[e], r);
        for (int i = 0; i < 3; i++) {
          r[i] -= X[i];
          p[i] = B.mass[e] * S.node[(size_t)B.slot[e] * 8 + 1 + i];
        }
        Vec::cross(r, p, l);
        add(I, B.mass[e], r);
        for (int i = 0; i < 3; i++) s[MOMENT + i] += l[i];
      }
      s[0] = M;
      s[LIGHT] = 1.0 / M;
      for (int i = 0; i < 3; i++) {
        s[CENTRE + i] = X[i];
        s[SPEED + i] = P[i] / M;
      }
      invert(I, s + INERTIA);
      Vec::apply(s + INERTIA, s + MOMENT, s + SPIN);
    }
  }
  // v = V + omega x r for the nodes and for the frame, which gets its own mass and inertia back.
  static inline void part(World *world) {
    for (int k = 0; k < world->bonds; k++) {
      const Bond &B = world->bond[k];
      const Field &S = world->field[B.soft];
      double *s = world->field[B.frame].rigid, r[3], u[3], Q[9];
      for (int e = 0; e < B.count; e++) {
        place(world, S, B.slot[e], r);
        for (int i = 0; i < 3; i++) r[i] -= s[CENTRE + i];
        Vec::cross(s + SPIN, r, u);
        float *node = S.node + (size_t)B.slot[e] * 8;
        node[0] = B.mass[e];
        for (int i = 0; i < 3; i++) node[1 + i] = (float)(s[SPEED + i] + u[i]);
      }
      for (int i = 0; i < 3; i++) r[i] = s[OWN + 1 + i] - s[CENTRE + i];
      Vec::cross(s + SPIN, r, u);
      for (int i = 0; i < 3; i++) s[SPEED + i] += u[i];
      for (int i = 0; i < 4; i++) s[i] = s[OWN + i];
      s[LIGHT] = 1.0 / s[0];
      mpm::Body::inverse_inertia(s + TURN, s + REST, s + INERTIA);
      invert(s + INERTIA, Q);
      Vec::apply(Q, s + SPIN, s + MOMENT);
    }
  }
};
