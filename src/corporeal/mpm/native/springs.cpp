// Springs, one after the other: tethers of particles to rigid bodies, joints of rigid bodies, and
// grips from outside. Same formulas as springs.py and grip.py.
struct Spring {
  static inline void turned(const double *s, const double *r, double *out) {
    for (int i = 0; i < 3; i++) {
      const double *row = s + RIGID_TURN + 3 * i;
      out[i] = row[0] * r[0] + row[1] * r[1] + row[2] * r[2];
    }
  }
  static inline void cross(const double *a, const double *b, double *c) {
    for (int i = 0; i < 3; i++) {
      int j = (i + 1) % 3, k = (i + 2) % 3;
      c[i] = a[j] * b[k] - a[k] * b[j];
    }
  }
  // Velocity of a rigid body at an arm from its centre.
  static inline void velocity(const double *s, const double *r, double *v) {
    cross(s + RIGID_SPIN, r, v);
    for (int i = 0; i < 3; i++) v[i] += s[RIGID_SPEED + i];
  }
  // Impulse and angular impulse; the spin follows at once.
  static inline void strike(double *s, const double *J, const double *L) {
    for (int i = 0; i < 3; i++) {
      const double *row = s + RIGID_INERTIA + 3 * i;
      s[RIGID_SPEED + i] += J[i] / s[0];
      s[RIGID_MOMENT + i] += L[i];
      s[RIGID_SPIN + i] += row[0] * L[0] + row[1] * L[1] + row[2] * L[2];
    }
  }
  // [r]x W: columns r x W_j.
  static inline void lever(const double *r, const double *W, double M[3][3]) {
    for (int j = 0; j < 3; j++) {
      double column[3] = {W[j], W[3 + j], W[6 + j]}, out[3];
      cross(r, column, out);
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
    const int *block = field.block + NB * b;
    for (int slot = block[0]; slot < block[1]; slot++) {
      const float *q = field.part + (size_t)(slot & ~7) * NC;
      const int lane = slot & 7, p = ((const int *)(q + 8 * ID))[lane] - T.first;
      if (p < 0 || p >= T.count || T.rate[p] == 0) continue;
      double x[3], arm[3], va[3], J[3], about[3], lost = 0;
      Hand::place(world, field, q, lane, x);
      Spring::turned(s, T.anchor + 3 * p, arm);
      Spring::velocity(s, arm, va);
      double rate = T.rate[p], brake = 2.0 * T.damping * rate, mass = q[8 * MA + lane];
      double given = mass * dt;
      for (int d = 0; d < 3; d++) {
        double u = x[d] - s[RIGID_CENTRE + d] - arm[d], v = q[8 * (VE + d) + lane] - va[d];
        J[d] = -given * (rate * rate * u + brake * v);
        lost += v * (v + 0.5 * J[d] / mass);
        J[d] -= mass * world->kick[d];   // its weight
        x[d] -= s[RIGID_CENTRE + d];
      }
      T.lost += given * brake * lost;
      Hand::over(world, field, q, lane, J, false);
      Spring::cross(x, J, about);
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
      const double *p = c + RIGID_TURN + 3 * i, *q = a + RIGID_TURN + 3 * j;
      Q[3 * i + j] = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    }
  turn[0] = 0.5 * (Q[7] - Q[5]);
  turn[1] = 0.5 * (Q[2] - Q[6]);
  turn[2] = 0.5 * (Q[3] - Q[1]);
  double sine = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  double angle = sine > 1e-12 ? atan2(sine, 0.5 * (Q[0] + Q[4] + Q[8] - 1.0)) / sine : 1.0;
  double stiff = N.damping + 0.5 * N.stiffness * dt, M[6][7], La[3][3], Lc[3][3];
  Spring::lever(ra, a + RIGID_INERTIA, La);
  Spring::lever(rc, c + RIGID_INERTIA, Lc);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int k = (j + 1) % 3, l = (j + 2) % 3;   // column j of L [r]x
      double across = La[i][k] * ra[l] - La[i][l] * ra[k] + Lc[i][k] * rc[l] - Lc[i][l] * rc[k];
      M[i][j] = (i == j ? 1.0 / a[0] + 1.0 / c[0] : 0.0) - across;
      M[i][3 + j] = M[3 + j][i] = -La[i][j] - Lc[i][j];
      M[3 + i][3 + j] = a[RIGID_INERTIA + 3 * i + j] + c[RIGID_INERTIA + 3 * i + j] +
                        (i == j ? 1.0 / (dt * stiff) : 0.0);
    }
  for (int i = 0; i < 3; i++) {
    double gap = c[RIGID_CENTRE + i] + rc[i] - a[RIGID_CENTRE + i] - ra[i];
    M[i][6] = va[i] + a[RIGID_KICK + i] - vc[i] - c[RIGID_KICK + i] - 0.2 / dt * gap;
    M[3 + i][6] = a[RIGID_SPIN + i] - c[RIGID_SPIN + i] - N.stiffness / stiff * angle * turn[i];
  }
  Spring::solve(M);
  double J[3], back[3], La_[3], Lc_[3];
  for (int i = 0; i < 3; i++) {
    J[i] = M[i][6];
    back[i] = -J[i];
  }
  Spring::cross(ra, back, La_);
  Spring::cross(rc, J, Lc_);
  for (int i = 0; i < 3; i++) {
    La_[i] -= M[3 + i][6];
    Lc_[i] += M[3 + i][6];
  }
  Spring::strike(a, back, La_);
  Spring::strike(c, J, Lc_);
  for (int i = 0; i < 3; i++) {
    double w = c[RIGID_SPIN + i] - a[RIGID_SPIN + i];
    N.lost += N.damping * dt * w * w;
  }
}
for (int n = 0; n < world->grips; n++) {
  Grip &G = world->grip[n];
  Field &field = world->field[G.field];
  double x[3] = {0, 0, 0}, v[3] = {0, 0, 0}, J[3], arm[3], about[3];
  double k = 0.25 * G.mass / (dt * dt), c = 0.5 * G.mass / dt;
  if (G.stiffness < k) k = G.stiffness;
  if (G.damping < c) c = G.damping;
  for (int turn = 0; turn < (G.rigid ? 1 : 2); turn++) {   // look at what is held, then pull
    if (turn == 0 && G.rigid) {
      Spring::turned(G.rigid, G.arm, arm);
      Spring::velocity(G.rigid, arm, v);
      for (int d = 0; d < 3; d++) x[d] = G.rigid[RIGID_CENTRE + d] + arm[d];
    }
    for (int b = 0; !G.rigid && b < field.blocks; b++) {
      const int *block = field.block + NB * b;
      for (int slot = block[0]; slot < block[1]; slot++) {
        const float *q = field.part + (size_t)(slot & ~7) * NC;
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
    if (turn == 0)
      for (int d = 0; d < 3; d++)
        J[d] = dt * (k * (G.target[d] - x[d]) - c * v[d]);
  }
  if (G.rigid) {
    double before[3], after[3];
    Spring::cross(arm, J, about);
    Spring::velocity(G.rigid, arm, before);
    Spring::strike(G.rigid, J, about);
    Spring::velocity(G.rigid, arm, after);
    for (int d = 0; d < 3; d++)
      G.work += J[d] * (0.5 * (before[d] + after[d]) + G.rigid[RIGID_KICK + d]);
  }
  for (int d = 0; d < 3; d++) G.impulse[d] += J[d];
}
