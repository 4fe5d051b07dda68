// Second pass over the particles around listed nodes: the mean offset of a field's mass there,
// and its outward gradient of volume. One chore: tasks of one field, each a run of blocks.
// Eight particles' shares of 27 nodes, mass, mass times offset 3 and outward gradient of volume 3, are
// products of one factor along each axis.
struct Shares {
  f8 factor[3][3][8];       // axis, node, particle: a lane for each share
  // Channels that will be read soon.
  static inline void ahead(const float *q) {
    for (int k = 0; k < 3; k += 2) __builtin_prefetch(q + 8 * (XI + k));
    for (int k = 0; k < 9; k += 2) __builtin_prefetch(q + 8 * (DE + k));
    __builtin_prefetch(q + 8 * MA);
  }
  inline void find(const float *q, const i8 *cell, bool several) {
    const f8 zero = Simd::all(0.0f), m = *(const f8u *)(q + 8 * MA);
    f8 V = zero;
    if (several) {
      f8 H[9];
      for (int k = 0; k < 9; k++) H[k] = *(const f8u *)(q + 8 * (DE + k));
      for (int k = 0; k < 9; k += 4) H[k] += 1.0f;
      V = *(const f8u *)(q + 8 * VO) * mpm::Strain<f8>::determinant(H);
    }
    for (int d = 0; d < 3; d++) {
      const f8 at = Simd::flo(*(const i8u *)(q + 8 * (XI + d)) - (cell[d] << PLACE)) * PER_UNIT;
      f8 w[3], slope[3];
      mpm::Spline<f8>::weights(at, w);
      mpm::Spline<f8>::slopes(at, slope);
      for (int i = 0; i < 3; i++) {
        f8 *row = factor[d][i];
        for (int k = 0; k < 7; k++) row[k] = k == 1 + d ? w[i] * (at - (float)i) : k == 4 + d ? slope[i] : w[i];
        row[7] = zero;
        for (int k = 0; k < 7 && d == 0; k++) row[k] *= k < 4 ? m : V;
        Simd::turn(row);
      }
    }
  }
  // Sum of neighbours in one cell, into the rows of nodes of which one is listed.
  inline void add(f8 *arena, const u64 *layers, int cell, int first, int end) const {
    for (int i = 0; i < 3; i++) {
      const u64 rows = layers[(cell >> 6) + i] >> (cell & 63) & 0x070707ull;
      for (int j = 0; j < 3; j++) {
        if (!(rows >> (8 * j) & 7)) continue;
        f8 *h = arena + cell + i * 64 + j * 8, h0 = h[0], h1 = h[1], h2 = h[2];
        for (int l = first; l < end; l++) {
          const f8 a = factor[0][i][l] * factor[1][j][l];
          h0 += a * factor[2][0][l];
          h1 += a * factor[2][1][l];
          h2 += a * factor[2][2][l];
        }
        h[0] = h0;
        h[1] = h1;
        h[2] = h2;
      }
    }
  }
};
alignas(64) f8 arena[512];
Shares shares;
const int *chore = world->chore + 2 * index;
for (int number = chore[0]; number < chore[1]; number++) {
  const int *task = world->task + 4 * number;
  const Field &field = world->field[task[0]];
  for (int b = task[1]; b < task[2]; b++) {
    const int *record = field.block + BLOCK_INTEGERS * b;
    for (int s = record[0]; s < record[1] && s < record[0] + 16; s += 8) Shares::ahead(field.part + (size_t)s * CHANNELS);
    const Asked asked(stage, field, task[0], record);
    if (!asked.count) continue;
    asked.empty(arena);
    for (int s = record[0]; s < record[1]; s += 8) {
      const float *q = field.part + (size_t)s * CHANNELS;
      Shares::ahead(q + 8 * 2 * CHANNELS);
      i8 cell[3], place = i8{0, 0, 0, 0, 0, 0, 0, 0};   // in the arena
      for (int d = 0; d < 3; d++) {
        cell[d] = (*(const i8u *)(q + 8 * (XI + d)) - HALF_CELL_UNITS) >> PLACE;
        place = place * 8 + (cell[d] - (4 * record[2 + d] - 1));
      }
      const int live = record[1] - s < 8 ? record[1] - s : 8;
      // Runs of neighbours in one cell.
      int ends = Simd::which(place != __builtin_shufflevector(place, place, 1, 2, 3, 4, 5, 6, 7, 7)) | 1 << (live - 1);
      ends &= (2 << (live - 1)) - 1;
      bool known = false;
      for (int first = 0, end; ends; first = end, ends &= ends - 1) {
        end = __builtin_ctz(ends) + 1;
        if (!asked.by(place[first])) continue;
        if (!known) shares.find(q, cell, asked.several);
        known = true;
        shares.add(arena, asked.layers, place[first], first, end);
      }
    }
    for (int e = 0; e < asked.count; e++) {
      f8 h = arena[asked.at[e]];
      if (!(h[0] > 0)) continue;
      h[0] = h[7] = 0.0f;   // the mass is known
      *(f8u *)&sides[asked.side[e]].m += h;
    }
  }
}
