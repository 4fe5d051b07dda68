// Springs, one after the other: tethers of particles to rigid bodies, joints of rigid bodies, and
// grips from outside. Same formulas as physics/springs.py and spring_grips.py.
struct Spring {
  static inline void turned(const double *s, const double *r, double *out) {
    Vec::apply(s + TURN, r, out);
  }
  // Velocity of a rigid body at an arm from its centre.
  static inline void velocity(const double *s, const double *r, double *v) {
    mpm::Body::velocity(s + SPEED, s + SPIN, r, v);
  }
  // Impulse and angular impulse; the spin follows at once.
  static inline void strike(double *s, const double *J, const double *L) {
    for (int i = 0; i < 3; i++) {
      const double *row = s + INERTIA + 3 * i;
      s[SPEED + i] += J[i] / s[0];
      s[MOMENT + i] += L[i];
      s[SPIN + i] += row[0] * L[0] + row[1] * L[1] + row[2] * L[2];
    }
  }
  // [r]x W: columns r x W_j.
  static inline void lever(const double *r, const double *W, double M[3][3]) {
    for (int j = 0; j < 3; j++) {
      double column[3] = {W[j], W[3 + j], W[6 + j]}, out[3];
      Vec::cross(r, column, out);
      for (int i = 0; i < 3; i++) M[i][j] = out[i];
    }
  }
  // Gauss with row exchange; the answer replaces the last column.
  static inline void solve(double M[6][7]) {
    for (int k = 0; k < 6; k++) {
      int best = k;
      for (int i = k + 1; i < 6; i++)
        if (fabs(M[i][k]) > fabs(M[best][k])) best = i;
      for (int j = k; j < 7; j++) {
        double kept = M[k][j];
        M[k][j] = M[best][j];
        M[best][j] = kept;
      }
      for (int i = 0; i < 6; i++) {
        if (i == k) continue;
        double f = M[i][k] / M[k][k];
        for (int j = k; j < 7; j++) M[i][j] -= f * M[k][j];
      }
    }
    for (int k = 0; k < 6; k++) M[k][6] /= M[k][k];
  }
};
const double dt = world->dt;
for (int n = 0; n < world->tethers; n++) {
  Tether &T = world->tether[n];
  Field &field = world->field[T.field];
  double *s = T.holder, total[3] = {0, 0, 0}, moment[3] = {0, 0, 0};
  for (int b = 0; b < field.blocks; b++) {
    const int *block = field.block + BLOCK_INTEGERS * b;
    for (int slot = block[0]; slot < block[1]; slot++) {
      const float *q = field.part + (size_t)(slot & ~7) * CHANNELS;
      const int lane = slot & 7, p = ((const int *)(q + 8 * ID))[lane] - T.first;
      if (p < 0 || p >= T.count || T.rate[p] == 0) continue;
      double x[3], arm[3], va[3], J[3], about[3], lost = 0;
      Hand::place(world, field, q, lane, x);
      Spring::turned(s, T.anchor + 3 * p, arm);
      Spring::velocity(s, arm, va);
      double rate = T.rate[p], brake = 2.0 * T.damping * rate, mass = q[8 * MA + lane];
      double given = mass * dt;
      for (int d = 0; d < 3; d++) {
        double u = x[d] - s[CENTRE + d] - arm[d], v = q[8 * (VE + d) + lane] - va[d];
        J[d] = -given * (rate * rate * u + brake * v);
        lost += v * (v + 0.5 * J[d] / mass);
        J[d] -= mass * world->kick[d];   // its weight
        x[d] -= s[CENTRE + d];
      }
      T.lost += given * brake * lost;
      Hand::over(world, field, q, lane, J, false);
      Vec::cross(x, J, about);
      for (int d = 0; d < 3; d++) {
        total[d] -= J[d];
        moment[d] -= about[d];
      }
    }
  }
  Spring::strike(s, total, moment);
}
for (int n = 0; n < world->joints; n++) {
  Joint &N = world->joint[n];
  double *a = N.first, *c = N.second, ra[3], rc[3], va[3], vc[3], Q[9], turn[3];
  Spring::turned(a, N.arm_first, ra);
  Spring::turned(c, N.arm_second, rc);
  Spring::velocity(a, ra, va);
  Spring::velocity(c, rc, vc);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double *p = c + TURN + 3 * i, *q = a + TURN + 3 * j;
      Q[3 * i + j] = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    }
  double angle = mpm::Body::turned(Q, turn);
  double stiff = N.damping + 0.5 * N.stiffness * dt, M[6][7], La[3][3], Lc[3][3];
  Spring::lever(ra, a + INERTIA, La);
  Spring::lever(rc, c + INERTIA, Lc);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int k = (j + 1) % 3, l = (j + 2) % 3;   // column j of L [r]x
      double across = La[i][k] * ra[l] - La[i][l] * ra[k] + Lc[i][k] * rc[l] - Lc[i][l] * rc[k];
      M[i][j] = (i == j ? 1.0 / a[0] + 1.0 / c[0] : 0.0) - across;
      M[i][3 + j] = M[3 + j][i] = -La[i][j] - Lc[i][j];
      M[3 + i][3 + j] = a[INERTIA + 3 * i + j] + c[INERTIA + 3 * i + j] +
                        (i == j ? 1.0 / (dt * stiff) : 0.0);
    }
  for (int i = 0; i < 3; i++) {
    double gap = c[CENTRE + i] + rc[i] - a[CENTRE + i] - ra[i];
    M[i][6] = va[i] + a[KICK + i] - vc[i] - c[KICK + i] - mpm::JOINT_GAP_FRACTION_PER_STEP / dt * gap;
    M[3 + i][6] = a[SPIN + i] - c[SPIN + i] - N.stiffness / stiff * angle * turn[i];
  }
  Spring::solve(M);
  double J[3], back[3], La_[3], Lc_[3];
  for (int i = 0; i < 3; i++) {
    J[i] = M[i][6];
    back[i] = -J[i];
  }
  Vec::cross(ra, back, La_);
  Vec::cross(rc, J, Lc_);
  for (int i = 0; i < 3; i++) {
    La_[i] -= M[3 + i][6];
    Lc_[i] += M[3 + i][6];
  }
  Spring::strike(a, back, La_);
  Spring::strike(c, J, Lc_);
  for (int i = 0; i < 3; i++) {
    double w = c[SPIN + i] - a[SPIN + i];
    N.lost += N.damping * dt * w * w;
  }
}
for (int n = 0; n < world->grips; n++) {
  Grip &G = world->grip[n];
  Field &field = world->field[G.field];
  double x[3] = {0, 0, 0}, v[3] = {0, 0, 0}, J[3], arm[3], about[3];
  for (int turn = 0; turn < (G.rigid ? 1 : 2); turn++) {   // measure what is held, then pull
    if (turn == 0 && G.rigid) {
      Spring::turned(G.rigid, G.arm, arm);
      Spring::velocity(G.rigid, arm, v);
      for (int d = 0; d < 3; d++) x[d] = G.rigid[CENTRE + d] + arm[d];
    }
    for (int b = 0; !G.rigid && b < field.blocks; b++) {
      const int *block = field.block + BLOCK_INTEGERS * b;
      for (int slot = block[0]; slot < block[1]; slot++) {
        const float *q = field.part + (size_t)(slot & ~7) * CHANNELS;
        const int lane = slot & 7, p = ((const int *)(q + 8 * ID))[lane] - G.first;
        if (p < 0 || p >= G.count || G.share[p] == 0) continue;
        if (turn == 0) {
          double place[3];
          Hand::place(world, field, q, lane, place);
          for (int d = 0; d < 3; d++) {
            x[d] += G.share[p] * place[d];
            v[d] += G.share[p] * q[8 * (VE + d) + lane];
          }
        } else {
          double part[3];
          for (int d = 0; d < 3; d++) part[d] = G.share[p] * J[d];
          G.work += Hand::over(world, field, q, lane, part);
        }
      }
    }
    if (turn == 0) {
      const double away[3] = {G.target[0] - x[0], G.target[1] - x[1], G.target[2] - x[2]};
      mpm::Grips::pull(G.stiffness, G.damping, G.mass, away, v, dt, J);
    }
  }
  if (G.rigid) {
    double before[3], after[3];
    Vec::cross(arm, J, about);
    Spring::velocity(G.rigid, arm, before);
    Spring::strike(G.rigid, J, about);
    Spring::velocity(G.rigid, arm, after);
    for (int d = 0; d < 3; d++)
      G.work += J[d] * (0.5 * (before[d] + after[d]) + G.rigid[KICK + d]);
  }
  for (int d = 0; d < 3; d++) G.impulse[d] += J[d];
}
