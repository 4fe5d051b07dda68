// Reads one field's particles: what they are doing, spread into arrays in the problem's order, and
// added up by body. All in double precision; sums over fixed runs of blocks, so threads change nothing.
struct Reading {
  const float *part, *history, *material;
  const int *block, *owner;             // owner of each row of materials
  double *position, *velocity, *strain, *motion, *plastic;
  double *sum;                          // [runs][owners][12]
  double dx;
  int origin[3], runs, owners, blocks, swells;
};
const Reading &R = *(Reading *)memory.data;
struct Read {
  static double determinant(const double *A) {
    return A[0] * (A[4] * A[8] - A[5] * A[7]) - A[1] * (A[3] * A[8] - A[5] * A[6]) +
           A[2] * (A[3] * A[7] - A[4] * A[6]);
  }
  // Eigenvalues of FtF - 1 (Smith 1961), H = F - 1.
  static void values(const double *H, double *l) {
    double E[6];
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        E[n++] = H[3 * i + j] + H[3 * j + i] + H[i] * H[j] + H[3 + i] * H[3 + j] + H[6 + i] * H[6 + j];
    double mean = (E[0] + E[3] + E[5]) / 3, a = E[0] - mean, b = E[3] - mean, c = E[5] - mean;
    double s = sqrt((a * a + b * b + c * c + 2 * (E[1] * E[1] + E[2] * E[2] + E[4] * E[4])) / 6);
    double cubic = a * (b * c - E[4] * E[4]) - E[1] * (E[1] * c - E[4] * E[2]) +
                   E[2] * (E[1] * E[4] - b * E[2]);
    double r = s > 1e-100 ? 0.5 * cubic / (s * s * s) : 0;
    double angle = acos(r < -1 ? -1 : r > 1 ? 1 : r) / 3;
    l[0] = mean + 2 * s * cos(angle);
    l[2] = mean + 2 * s * cos(angle + 2.0943951023931953);
    l[1] = 3 * mean - l[0] - l[2];
  }
  // Stored energy per rest volume: see elasticity.py. The trace of the stress that acts tells the
  // pressure where it is given, else one's own J does.
  static double stored(int law, double mu, double lambda, const double *H, const double *pressed) {
    double F[9], l[3], sum = 0, trace = 0;
    if (law > 4) return 0;
    for (int i = 0; i < 9; i++) F[i] = H[i] + (i % 4 == 0);
    double J = determinant(F);
    if (law == 1) {
      for (int i = 0; i < 9; i++) sum += H[i] * H[i] + (i % 4 == 0 ? 2 * H[i] : 0);
      double log_j = log(J), p = pressed ? (*pressed - mu * sum) / 3 : lambda * log_j;
      return 0.5 * mu * (sum - 2 * log_j) + 0.5 * p * log_j;
    }
    double pull = 0;
    values(H, l);
    for (int i = 0; i < 3; i++) {
      double square = 1 + l[i] > 1e-12 ? 1 + l[i] : 1e-12;
      double s = law == 0 ? sqrt(square) * (i == 2 && J < 0 ? -1 : 1) - 1 : 0.5 * log(square);
      sum += s * s;
      trace += s;
      pull += 2 * mu * (law == 0 ? s * (1 + s) : s);
    }
    if (pressed) return mu * sum + (*pressed - pull) / 6 * (law == 0 ? 1 - 1 / J : trace);
    if (law == 0) trace = J - 1;
    return mu * sum + 0.5 * lambda * trace * trace;
  }
  // Trace of the elastic stress that acts: what is kept, less its viscous part.
  static double acting(const Reading &R, const float *q, int l, double visc, const double *H,
                       const double *C) {
    double F[9], pull = (double)q[8 * ST + l] + q[8 * (ST + 3) + l] + q[8 * (ST + 5) + l];
    for (int i = 0; i < 9; i++) F[i] = H[i] + (i % 4 == 0);
    double J = determinant(F), thick = visc * (J > 0 ? J : 0);
    return -0.25 * R.dx / q[8 * VO + l] * pull - 2 * thick * (C[0] + C[4] + C[8]);
  }
  static void particle(const Reading &R, const float *q, const float *past, int l, double *row) {
    const float *t = R.material + NM * ((const int *)q)[8 * MT + l];
    int n = ((const int *)q)[8 * ID + l], law = (int)t[LAW];
    double x[3], v[3], C[9], H[9], m = q[8 * MA + l], v2 = 0, c2 = 0, spread = 0.25 * R.dx * R.dx;
    for (int i = 0; i < 3; i++) {
      x[i] = (((const int *)q)[8 * (XI + i) + l] / (double)UNIT + 4.0 * R.origin[i]) * R.dx;
      v[i] = q[8 * (VE + i) + l];
      v2 += v[i] * v[i];
    }
    for (int i = 0; i < 9; i++) H[i] = q[8 * (DE + i) + l];
    if (R.position) {
      const float *whole = law == 3 || law == 4 ? past + 8 * TM : q + 8 * DE;
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
    row += 12 * R.owner[((const int *)q)[8 * MT + l]];
    for (int i = 0; i < 3; i++) {
      int j = (i + 1) % 3, k = (i + 2) % 3;
      row[i] += m * x[i];
      row[3 + i] += m * v[i];
      row[6 + i] += m * (x[j] * v[k] - x[k] * v[j] + spread * (C[3 * k + j] - C[3 * j + k]));
    }
    row[9] += 0.5 * m * (v2 + spread * c2);
    double trace = acting(R, q, l, t[VISC], H, C);
    row[10] += q[8 * VO + l] * stored(law, t[MU], t[LAMBDA], H, R.swells ? &trace : 0);
    if (!(v2 <= row[11])) row[11] = v2;
  }
};
for (int run = low; run < high; run++) {
  int first = (int)((long long)R.blocks * run / R.runs);
  int last = (int)((long long)R.blocks * (run + 1) / R.runs);
  for (int b = first; b < last; b++)
    for (int s = R.block[NB * b]; s < R.block[NB * b + 1]; s++)
      Read::particle(R, R.part + (size_t)(s & ~7) * NC,
                     R.history ? R.history + (size_t)(s & ~7) * NH : 0, s & 7,
                     R.sum ? R.sum + (size_t)12 * R.owners * run : 0);
}
