// Loads on single particles of one field, between scatter and forces: the wind on the faces that
// particles bear. Particles hand impulses to the nodes, a rigid body of its own adds them up.
typedef mpm::Air<double> Air;
const double TWO_PI = 2 * acos(-1.0);
const double dt = world->dt, middle = world->time + 0.5 * dt;
for (int n = 0; n < world->wind_loads; n++) {
  WindLoad &W = world->wind_load[n];
  if (W.field != index || middle < W.start || middle >= W.end) continue;
  Field &field = world->field[W.field];
  double gust = 0, air[3], total[3] = {0, 0, 0};
  for (int k = 0; k < mpm::GUST_SINES; k++)
    gust += W.signal[k] * sin(TWO_PI * W.signal[mpm::GUST_SINES + k] * middle + W.signal[2 * mpm::GUST_SINES + k]);
  for (int d = 0; d < 3; d++) air[d] = W.wind[d] * (1.0 + W.gust * gust);
  if (W.free) {
    double *s = W.rigid, moment[3] = {0, 0, 0};
    for (int p = 0; p < W.count; p++) {
      if (W.face[p] == W.face[p + 1]) continue;
      double r[3], seen[3], J[3] = {0, 0, 0};
      const double *point = W.point + 5 * p, *w = s + SPIN;
      for (int i = 0; i < 3; i++) {
        const double *row = s + TURN + 3 * i;
        r[i] = row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
      }
      for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        seen[i] = air[i] - s[SPEED + i] - (w[j] * r[k] - w[k] * r[j]);
      }
      for (int a = W.face[p]; a < W.face[p + 1]; a++) {
        double area[3];
        Air::turned(s + TURN, W.area + 3 * a, area);
        Air::press(W.half_rho_c, area, seen, point[3], dt, J);
      }
      for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        total[i] += J[i];
        moment[i] += r[j] * J[k] - r[k] * J[j];
      }
    }
    for (int i = 0; i < 3; i++) {
      const double *row = s + INERTIA + 3 * i;
      double spin = row[0] * moment[0] + row[1] * moment[1] + row[2] * moment[2];
      W.work += total[i] * (s[SPEED + i] + s[KICK + i] + 0.5 * total[i] / s[0]);
      W.work += moment[i] * (s[SPIN + i] + 0.5 * spin);
    }
    for (int i = 0; i < 3; i++) {
      s[SPEED + i] += total[i] / s[0];
      s[MOMENT + i] += moment[i];
    }
  } else {
    for (int b = 0; b < field.blocks; b++) {
      const int *block = field.block + BLOCK_INTEGERS * b;
      for (int slot = block[0]; slot < block[1]; slot++) {
        const float *q = field.part + (size_t)(slot & ~7) * CHANNELS;
        const float *past = field.history + (size_t)(slot & ~7) * HISTORY_CHANNELS;
        const int lane = slot & 7, p = ((const int *)(q + 8 * ID))[lane] - W.first;
        if (p < 0 || p >= W.count || W.face[p] == W.face[p + 1]) continue;
        const int law = (int)field.material[MATERIAL_COLUMNS * ((const int *)(q + 8 * MT))[lane] + LAW];
        double F[9], seen[3], J[3] = {0, 0, 0};
        for (int i = 0; i < 9; i++)
          F[i] = W.rigid ? W.rigid[TURN + i]
                         : (mpm::remembers(law) ? past + 8 * TM : q + 8 * DE)[8 * i + lane] +
                               (i % 4 == 0);
        for (int d = 0; d < 3; d++) seen[d] = air[d] - q[8 * (VE + d) + lane];
        for (int a = W.face[p]; a < W.face[p + 1]; a++) {
          double area[3];
          Air::turned(F, W.area + 3 * a, area);
          Air::press(W.half_rho_c, area, seen, q[8 * MA + lane], dt, J);
        }
        W.work += Hand::over(world, field, q, lane, J);
        for (int d = 0; d < 3; d++) total[d] += J[d];
      }
    }
  }
  for (int d = 0; d < 3; d++) W.impulse[d] += total[d];
}
