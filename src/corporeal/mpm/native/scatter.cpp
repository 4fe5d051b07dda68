// Particles to grid, one task: a run of blocks in one plane of one field. Node channels: mass,
// momentum with stress and push, momentum as it was, free. Same-parity planes never overlap.
int *task = world->task + 4 * index;
Field &field = world->field[task[0]];
const float dt = (float)world->dt;
double work = 0;
alignas(64) f8 arena[512];
for (int b = task[1]; b < task[2]; b++) {
  const int *block = field.block + NB * b;
  for (int i = 0; i < 512; i++) arena[i] = Simd::all(0.0f);
  for (int s = block[0]; s < block[1]; s += 8) {
    float *q = field.part + (size_t)s * NC;
    alignas(32) float W[9][8], D[3][8];
    alignas(32) int base[8];
    i8 at = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int d = 0; d < 3; d++) {
      i8 x = *(i8u *)(q + 8 * (XI + d));
      i8 cell = (x - HALF) >> PLACE;
      f8 f = Simd::flo(x - (cell << PLACE)) * PER_UNIT;
      f8 w[3];
      Simd::spline(f, w);
      *(f8 *)D[d] = f;
      for (int k = 0; k < 3; k++) *(f8 *)W[3 * d + k] = w[k];
      at = at * 8 + (cell - (4 * block[2 + d] - 1));
    }
    *(i8 *)base = at;
    f8 m = *(f8u *)(q + 8 * MA);
    f8 zero = Simd::all(0.0f);
    f8 r[8], a[3][8];
    for (int k = 0; k < 3; k++) {
      r[4 + k] = m * *(f8u *)(q + 8 * (VE + k));
      r[1 + k] = r[4 + k];
    }
    if (field.pushed) {
      alignas(32) float push[3][8];
      for (int l = 0; l < 8; l++) {
        const float *t = field.material + NM * ((int *)(q + 8 * MT))[l];
        for (int k = 0; k < 3; k++) push[k][l] = t[PUSH + k];
      }
      for (int k = 0; k < 3; k++) {
        f8 g = *(f8 *)push[k];  // velocity that the push gives in this step
        f8 e = g * (r[1 + k] + 0.5f * m * (g + (float)world->kick[k]));
        for (int l = 0; l < 8; l++) work += e[l];
        r[1 + k] += m * g;
      }
    }
    r[0] = m;
    r[7] = zero;
    const int row[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int j = 0; j < 3; j++) {
      a[j][0] = zero;
      a[j][7] = zero;
      for (int k = 0; k < 3; k++) {
        a[j][4 + k] = m * *(f8u *)(q + 8 * (AF + 3 * k + j));
        a[j][1 + k] = a[j][4 + k] + dt * *(f8u *)(q + 8 * (ST + row[k][j]));
      }
    }
    for (int k = 1; k < 7; k++)
      r[k] -= a[0][k] * *(f8 *)D[0] + a[1][k] * *(f8 *)D[1] + a[2][k] * *(f8 *)D[2];
    Simd::turn(r);
    for (int j = 0; j < 3; j++) Simd::turn(a[j]);
    int n = block[1] - s < 8 ? block[1] - s : 8;
    for (int l = 0; l < n; l++) {
      f8 a0 = a[0][l], a1 = a[1][l], a2 = a[2][l], z2 = a2 + a2, r0 = r[l];
      f8 *g = arena + base[l];
      float w0 = W[6][l], w1 = W[7][l], w2 = W[8][l];
#pragma unroll
      for (int i = 0; i < 3; i++) {
        float wi = W[i][l];
        f8 ri = r0;
#pragma unroll
        for (int j = 0; j < 3; j++) {
          float w = wi * W[3 + j][l];
          f8 *h = g + i * 64 + j * 8;
          h[0] += (w * w0) * ri;
          h[1] += (w * w1) * (ri + a2);
          h[2] += (w * w2) * (ri + z2);
          ri += a1;
        }
        r0 += a0;
      }
    }
  }
  for (int i = 0; i < 8; i++)
    for (int j = 0; j < 8; j++) {
      int ib = (i + 3) >> 2, jb = (j + 3) >> 2;
      const int *near = block + 5 + (ib * 3 + jb) * 3;
      f8 *h = arena + i * 64 + j * 8;
      size_t row = ((i + 3) & 3) * 16 + ((j + 3) & 3) * 4;
      f8u *g0 = (f8u *)field.node + (size_t)near[0] * 64 + row;
      f8u *g1 = (f8u *)field.node + (size_t)near[1] * 64 + row;
      f8u *g2 = (f8u *)field.node + (size_t)near[2] * 64 + row;
      g0[3] += h[0];
      for (int k = 0; k < 4; k++) g1[k] += h[1 + k];
      for (int k = 0; k < 3; k++) g2[k] += h[5 + k];
    }
}
world->report[NR * index + WORK] += work;
