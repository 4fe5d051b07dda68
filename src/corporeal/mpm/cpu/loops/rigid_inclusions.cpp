// Rigid inclusions: a frame and the soft nodes inside it are one rigid body while contact acts on it.
// Same formulas as physics/inclusions.py.
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
  // Blocks of a field that the 27 nodes from base on lie in; whether there is any.
  struct Blocks {
    int in[3], block[8];   // the first node within its block, and two blocks along each axis
    inline bool find(const Field &S, const int *base) {
      int first[3], last[3];
      bool some = false;
      for (int i = 0; i < 3; i++) {
        const int c = base[i] - 4 * S.origin[i];
        first[i] = c >> 2, last[i] = (c + 2) >> 2, in[i] = c & 3;
        if (last[i] < 0 || first[i] >= S.dim[i]) return false;
      }
      for (int n = 0; n < 8; n++) {
        const int a[3] = {n >> 2 ? last[0] : first[0], n >> 1 & 1 ? last[1] : first[1], n & 1 ? last[2] : first[2]};
        bool out = false;
        for (int i = 0; i < 3; i++) out |= a[i] < 0 || a[i] >= S.dim[i];
        block[n] = out ? -1 : S.table[(a[0] * S.dim[1] + a[1]) * S.dim[2] + a[2]];
        some |= block[n] >= 0;
      }
      return some;
    }
    // Slot of one of the nodes where it has mass; -1: it has none.
    inline int slot(const Field &S, int x, int y, int z) const {
      x += in[0], y += in[1], z += in[2];
      const int b = block[(x >> 2) * 4 + (y >> 2) * 2 + (z >> 2)], at = (x & 3) * 16 + (y & 3) * 4 + (z & 3);
      return b < 0 || !(S.have[b] >> at & 1) ? -1 : b * 64 + at;
    }
  };
  // The frame's volume on the soft field's nodes, by slot; lists those that it reaches.
  static inline void spread(const World *world, Bond &B) {
    const Field &S = world->field[B.soft];
    const double *s = world->field[B.frame].rigid;
    B.count = 0;
    for (int p = 0; p < B.points; p++) {
      const double *q = B.point + 4 * p;
      int base[3];
      double c[3];
      for (int i = 0; i < 3; i++) {
        double r = s[TURN + 3 * i] * q[0] + s[TURN + 3 * i + 1] * q[1] + s[TURN + 3 * i + 2] * q[2];
        c[i] = (s[CENTRE + i] + r) / world->dx;
        base[i] = (int)floor(c[i] - 0.5);
      }
      Blocks near;
      if (!near.find(S, base)) continue;   // most points of a frame are far from soft nodes
      float w[3][3];
      for (int i = 0; i < 3; i++) mpm::Spline<float>::weights((float)(c[i] - base[i]), w[i]);
      for (int i = 0; i < 9; i++) {
        const float column = (float)q[3] * w[0][i / 3] * w[1][i % 3];
        for (int z = 0; z < 3; z++) {
          const int e = near.slot(S, i / 3, i % 3, z);
          if (e < 0) continue;
          if (B.volume[e] == 0) B.slot[B.count++] = e;
          B.volume[e] += column * w[2][z] + (float)mpm::TINY;
        }
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
        if (stiff < (float)mpm::MIN_FRAME_VOLUME_FRACTION * (stiff + soft)) continue;
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
      for (int i = 0; i < 4; i++) s[FRAME_MASS + i] = s[i];
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
      s[INVERSE_MASS] = 1.0 / M;
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
      for (int i = 0; i < 3; i++) r[i] = s[FRAME_MASS + 1 + i] - s[CENTRE + i];
      Vec::cross(s + SPIN, r, u);
      for (int i = 0; i < 3; i++) s[SPEED + i] += u[i];
      for (int i = 0; i < 4; i++) s[i] = s[FRAME_MASS + i];
      s[INVERSE_MASS] = 1.0 / s[0];
      mpm::Body::inverse_inertia(s + TURN, s + REST_INVERSE_INERTIA, s + INERTIA);
      invert(s + INERTIA, Q);
      Vec::apply(Q, s + SPIN, s + MOMENT);
    }
  }
};
