// Second look at the particles around listed nodes, and only them: where a field's mass lies there,
// and its outward gradient of volume. One task: a run of blocks in one plane of one field.
struct Marked {
  // Which lanes stand in cells of their block that are marked: a bit for each.
  static inline int of(u64 cells, i8 bit, i8 on) {
    const i8 none = i8{0, 0, 0, 0, 0, 0, 0, 0};
    const i8 half = bit > 31 ? none + (int)(cells >> 32) : none + (int)cells;
    const i8 in = on & ((half >> (bit & 31) & 1) != 0);
#if defined(__AVX__)
    return __builtin_ia32_movmskps256((f8)in);
#else
    int lanes = 0;
    for (int l = 0; l < 8; l++) lanes |= (in[l] & 1) << l;
    return lanes;
#endif
  }
};
int *task = world->task + 4 * index;
Field &field = world->field[task[0]];
alignas(64) f8 arena[512];
for (int b = task[1]; b < task[2]; b++) {
  const int *record = field.block + BLOCK * b;
  u64 any = 0;
  for (int i = 0; i < 27; i++) any |= field.near[2 * record[NEIGHBOURS + i]];
  if (!any) continue;
  int used = 0;
  for (int s = record[0]; s < record[1]; s += 8) {
    const float *q = field.part + (size_t)s * CHANNELS;
    int live = record[1] - s < 8 ? record[1] - s : 8, lanes = 0, several = 0;
    i8 cell[3];
    alignas(32) int low[3][8], home[8];
    i8 place = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int d = 0; d < 3; d++) {
      cell[d] = (*(i8u *)(q + 8 * (XI + d)) - HALF) >> PLACE;
      *(i8 *)low[d] = cell[d];
      place = place * 8 + (cell[d] - (4 * record[2 + d] - 1));
    }
    *(i8 *)home = place;
    const i8 on = i8{0, 1, 2, 3, 4, 5, 6, 7} < live;
    i8 strayed = i8{0, 0, 0, 0, 0, 0, 0, 0}, bit = strayed;
    for (int d = 0; d < 3; d++) {
      strayed |= (cell[d] >> 2) != record[2 + d];
      bit = bit * 4 + (cell[d] & 3);
    }
    if (!Simd::any(strayed & on)) {
      lanes = Marked::of(field.near[2 * record[OWN_BLOCK]], bit, on);
      if (lanes) several = Marked::of(field.near[2 * record[OWN_BLOCK] + 1], bit, on);
    }
    for (int l = 0; l < live && Simd::any(strayed & on); l++) {
      int x = low[0][l], y = low[1][l], z = low[2][l];
      const int *near = record + NEIGHBOURS + (((x >> 2) - record[2] + 1) * 3 + (y >> 2) - record[3] + 1) * 3 +
                        (z >> 2) - record[4] + 1;
      int bit = (x & 3) * 16 + (y & 3) * 4 + (z & 3);
      lanes |= (int)(field.near[2 * *near] >> bit & 1) << l;
      several |= (int)(field.near[2 * *near + 1] >> bit & 1) << l;
    }
    if (!lanes) continue;
    if (!used)
      for (int i = 0; i < 512; i++) arena[i] = Simd::all(0.0f);
    used = 1;
    // Lanes of a node: mass, mass times offset 3, outward gradient of volume 3.
    f8 w[3][3], g[3][3], fr[3], r[8], W[3][3][8], V = Simd::all(0.0f);
    f8 m = *(f8u *)(q + 8 * MA), zero = Simd::all(0.0f);
    if (several) {
      f8 H[9];
      for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
      H[0] += 1.0f;
      H[4] += 1.0f;
      H[8] += 1.0f;
      V = *(f8u *)(q + 8 * VO) * mpm::Strain<f8>::determinant(H);
    }
    r[0] = m;
    r[7] = zero;
    for (int d = 0; d < 3; d++) {
      fr[d] = Simd::flo(*(i8u *)(q + 8 * (XI + d)) - (cell[d] << PLACE)) * PER_UNIT;
      mpm::Spline<f8>::weights(fr[d], w[d]);
      mpm::Spline<f8>::slopes(fr[d], g[d]);
      r[1 + d] = m * fr[d];
      r[4 + d] = V;
    }
    alignas(32) float plain[9][8];
    for (int d = 0; d < 3; d++)
      for (int i = 0; i < 3; i++) {
        if (!several) {
          *(f8 *)plain[3 * d + i] = w[d][i];
          continue;
        }
        for (int k = 0; k < 7; k++) W[d][i][k] = k == 4 + d ? g[d][i] : w[d][i];
        W[d][i][7] = zero;
        Simd::turn(W[d][i]);
      }
    Simd::turn(r);
    for (int l = 0; l < live; l++) {
      if (!(lanes >> l & 1)) continue;
      f8 *a = arena + home[l];
      float mass = r[l][0];
      f8 x1 = f8{0, mass, 0, 0, 0, 0, 0, 0}, y1 = f8{0, 0, mass, 0, 0, 0, 0, 0},
         z1 = f8{0, 0, 0, mass, 0, 0, 0, 0}, ri = r[l];
      if (!several) {            // planes need no gradient
        float w0 = plain[6][l], w1 = plain[7][l], w2 = plain[8][l];
        for (int i = 0; i < 3; i++, ri -= x1) {
          f8 rj = ri;
          for (int j = 0; j < 3; j++, rj -= y1) {
            float wij = plain[i][l] * plain[3 + j][l];
            f8 *h = a + i * 64 + j * 8;
            h[0] += (wij * w0) * rj;
            h[1] += (wij * w1) * (rj - z1);
            h[2] += (wij * w2) * (rj - z1 - z1);
          }
        }
        continue;
      }
      for (int i = 0; i < 3; i++, ri -= x1) {
        f8 rj = ri;
        for (int j = 0; j < 3; j++, rj -= y1) {
          f8 wij = W[0][i][l] * W[1][j][l];
          f8 *h = a + i * 64 + j * 8;
          h[0] += wij * W[2][0][l] * rj;
          h[1] += wij * W[2][1][l] * (rj - z1);
          h[2] += wij * W[2][2][l] * (rj - z1 - z1);
        }
      }
    }
  }
  if (!used) continue;
  const Reached reached(field, record);
  for (int n = 0; n < 27; n++) {
    const u64 mine = reached.nodes(n) & Grid::arena(n);
    int pool = record[NEIGHBOURS + n], j = mine ? field.where[4 * pool + 3] : 0;
    if (!j) continue;
    const Junction &J = junctions[j - 1];
    int q = 0;
    while (q < J.fields && J.field[q] != task[0]) q++;
    if (q == J.fields) continue;
    int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
    for (u64 left = J.mask & J.have[q] & mine; left; left &= left - 1) {
      int i = __builtin_ctzll(left);
      const f8 &h = arena[(x + (i >> 4)) * 64 + (y + (i >> 2 & 3)) * 8 + z + (i & 3)];
      if (!(h[0] > 0)) continue;
      const Meet &M = meets[Grid::meet(J, i)];
      int s = M.side;
      while (sides[s].field != task[0]) s++;
      for (int d = 0; d < 3; d++) {
        sides[s].mean[d] += h[1 + d];
        sides[s].out[d] += h[4 + d];
      }
    }
  }
}
