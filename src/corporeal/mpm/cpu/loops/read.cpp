// Reads one field's particles: what they are doing, spread into arrays in the problem's order, and
// added up by body. All in double precision; sums over fixed runs of blocks, so threads change nothing.
const Reading &R = *(Reading *)memory.data;
struct Read {
  // Energy in a particle's Maxwell branches [J/m^3].
  static double held(const float *t, const float *branch, int l) {
    double sum = 0, E[6];
    for (int b = 0; b < mpm::BRANCHES; b++, branch += 8 * BRANCH_CHANNELS) {
      for (int k = 0; k < 6; k++) E[k] = branch[8 * (BRANCH_STRAIN + k) + l];
      sum += mpm::branch_energy(t[SHEAR + b], t[BULK + b], E, branch[8 * BRANCH_DILATATION + l]);
    }
    return sum;
  }
  static void particle(const Reading &R, const float *q, const float *past, const float *branch, int l,
                       double *row) {
    const float *t = R.material + MATERIAL_COLUMNS * ((const int *)q)[8 * MT + l];
    int n = ((const int *)q)[8 * ID + l], law = (int)t[LAW];
    double x[3], v[3], C[9], H[9], m = q[8 * MA + l], v2 = 0, c2 = 0, spread = 0.25 * R.dx * R.dx;
    for (int i = 0; i < 3; i++) {
      x[i] = (((const int *)q)[8 * (XI + i) + l] / (double)CELL_UNITS + 4.0 * R.origin[i]) * R.dx;
      v[i] = q[8 * (VE + i) + l];
      v2 += v[i] * v[i];
    }
    for (int i = 0; i < 9; i++) H[i] = q[8 * (DE + i) + l];
    if (R.position) {
      const float *whole = mpm::remembers(law) ? past + 8 * TM : q + 8 * DE;
      for (int i = 0; i < 3; i++) {
        R.position[3 * (size_t)n + i] = x[i];
        R.velocity[3 * (size_t)n + i] = v[i];
      }
      for (int i = 0; i < 9; i++) {
        R.strain[9 * (size_t)n + i] = H[i] + (i % 4 == 0);
        R.motion[9 * (size_t)n + i] = whole[8 * i + l] + (double)(i % 4 == 0);
      }
      if (past) R.plastic[n] = past[8 * EP + l];
      return;
    }
    for (int i = 0; i < 9; i++) {
      C[i] = q[8 * (AF + i) + l] / R.dx;
      c2 += C[i] * C[i];
    }
    row += BODY_SUMS * R.owner[((const int *)q)[8 * MT + l]];
    for (int i = 0; i < 3; i++) {
      int j = (i + 1) % 3, k = (i + 2) % 3;
      row[i] += m * x[i];
      row[3 + i] += m * v[i];
      row[6 + i] += m * (x[j] * v[k] - x[k] * v[j] + spread * (C[3 * k + j] - C[3 * j + k]));
    }
    row[9] += 0.5 * m * (v2 + spread * c2);
    if (!t[STRAINLESS]) {
      const mpm::Material<float> kind = {t[LAW], t[MU], t[LAMBDA]};
      const double bulk = R.uses_mean_dilatation ? mpm::Laws<float>::mean_bulk(kind) : 0;
      double psi = mpm::stored_energy(law, t[MU], t[LAMBDA] - bulk, H);
      if (R.uses_mean_dilatation) psi += mpm::mean_energy(law, bulk, H, past[8 * LOG_VOLUME_RATIO + l]);
      row[10] += q[8 * VO + l] * psi;
    }
    if (branch) row[11] += q[8 * VO + l] * held(t, branch, l);
    if (!(v2 <= row[12])) row[12] = v2;
  }
};
for (int run = low; run < high; run++) {
  int first = (int)((long long)R.blocks * run / R.runs);
  int last = (int)((long long)R.blocks * (run + 1) / R.runs);
  for (int b = first; b < last; b++)
    for (int s = R.block[BLOCK_INTEGERS * b]; s < R.block[BLOCK_INTEGERS * b + 1]; s++)
      Read::particle(R, R.part + (size_t)(s & ~7) * CHANNELS,
                     R.history ? R.history + (size_t)(s & ~7) * HISTORY_CHANNELS : 0,
                     R.branch ? R.branch + (size_t)(s & ~7) * MAXWELL_CHANNELS : 0, s & 7,
                     R.sum ? R.sum + (size_t)BODY_SUMS * R.owners * run : 0);
}
