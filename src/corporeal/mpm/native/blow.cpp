// Loads on single particles of one field, between scatter and forces: the wind on the faces that
// particles bear. Particles hand impulses to the nodes, a rigid body of its own adds them up.
struct Load {
  // Area vector after a deformation, cof(F) N (Nanson's formula).
  static inline void turned(const double *F, const double *N, double *a) {
    for (int i = 0; i < 3; i++) {
      const double *p = F + 3 * ((i + 1) % 3), *q = F + 3 * ((i + 2) % 3);
      a[i] = (p[1] * q[2] - p[2] * q[1]) * N[0] + (p[2] * q[0] - p[0] * q[2]) * N[1] +
             (p[0] * q[1] - p[1] * q[0]) * N[2];
    }
  }
  // Impulse of the air on a face: see wind.py.
  static inline void press(double half_rho_c, const double *a, const double *seen, double mass,
                           double dt, double *J) {
    double size = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    double along = a[0] * seen[0] + a[1] * seen[1] + a[2] * seen[2];
    if (size < 1e-30 || along >= 0) return;
    double against = -along / size;
    double speed = sqrt(seen[0] * seen[0] + seen[1] * seen[1] + seen[2] * seen[2]);
    double force = half_rho_c * size * against * against * against / speed;
    double given = force * dt / (1.0 + force * dt / (mass * against));
    for (int i = 0; i < 3; i++) J[i] -= given * a[i] / size;
  }
};
const double dt = world->dt, middle = world->time + 0.5 * dt;
for (int n = 0; n < world->blows; n++) {
  Blow &B = world->blow[n];
  if (B.field != index || middle < B.start || middle >= B.end) continue;
  Field &field = world->field[B.field];
  double gust = 0, air[3], total[3] = {0, 0, 0};
  for (int k = 0; k < 8; k++)
    gust += B.signal[k] * sin(6.283185307179586 * B.signal[8 + k] * middle + B.signal[16 + k]);
  for (int d = 0; d < 3; d++) air[d] = B.wind[d] * (1.0 + B.gust * gust);
  if (B.free) {
    double *s = B.rigid, moment[3] = {0, 0, 0};
    for (int p = 0; p < B.count; p++) {
      if (B.face[p] == B.face[p + 1]) continue;
      double r[3], seen[3], J[3] = {0, 0, 0};
      const double *point = B.point + 5 * p, *w = s + RIGID_SPIN;
      for (int i = 0; i < 3; i++) {
        const double *row = s + RIGID_TURN + 3 * i;
        r[i] = row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
      }
      for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        seen[i] = air[i] - s[RIGID_SPEED + i] - (w[j] * r[k] - w[k] * r[j]);
      }
      for (int a = B.face[p]; a < B.face[p + 1]; a++) {
        double area[3];
        Load::turned(s + RIGID_TURN, B.area + 3 * a, area);
        Load::press(B.half_rho_c, area, seen, point[3], dt, J);
      }
      for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        total[i] += J[i];
        moment[i] += r[j] * J[k] - r[k] * J[j];
      }
    }
    for (int i = 0; i < 3; i++) {
      const double *row = s + RIGID_INERTIA + 3 * i;
      double spin = row[0] * moment[0] + row[1] * moment[1] + row[2] * moment[2];
      B.work += total[i] * (s[RIGID_SPEED + i] + s[RIGID_KICK + i] + 0.5 * total[i] / s[0]);
      B.work += moment[i] * (s[RIGID_SPIN + i] + 0.5 * spin);
    }
    for (int i = 0; i < 3; i++) {
      s[RIGID_SPEED + i] += total[i] / s[0];
      s[RIGID_MOMENT + i] += moment[i];
    }
  } else {
    for (int b = 0; b < field.blocks; b++) {
      const int *block = field.block + NB * b;
      for (int slot = block[0]; slot < block[1]; slot++) {
        const float *q = field.part + (size_t)(slot & ~7) * NC;
        const float *past = field.history + (size_t)(slot & ~7) * NH;
        const int lane = slot & 7, p = ((const int *)(q + 8 * ID))[lane] - B.first;
        if (p < 0 || p >= B.count || B.face[p] == B.face[p + 1]) continue;
        const int law = (int)field.material[NM * ((const int *)(q + 8 * MT))[lane] + LAW];
        double F[9], seen[3], J[3] = {0, 0, 0};
        for (int i = 0; i < 9; i++)
          F[i] = B.rigid ? B.rigid[RIGID_TURN + i]
                         : (law == 3 || law == 4 ? past + 8 * TM : q + 8 * DE)[8 * i + lane] +
                               (i % 4 == 0);
        for (int d = 0; d < 3; d++) seen[d] = air[d] - q[8 * (VE + d) + lane];
        for (int a = B.face[p]; a < B.face[p + 1]; a++) {
          double area[3];
          Load::turned(F, B.area + 3 * a, area);
          Load::press(B.half_rho_c, area, seen, q[8 * MA + lane], dt, J);
        }
        B.work += Hand::over(world, field, q, lane, J);
        for (int d = 0; d < 3; d++) total[d] += J[d];
      }
    }
  }
  for (int d = 0; d < 3; d++) B.impulse[d] += total[d];
}
