// How far fields reach along the candidate normals: s(n) = max (x·n + R), R = r0 ‖Fᵀn‖, over the
// particles around each node. Tasks: those of the particles, then one per field for rigid bodies.
struct Own {                // a contact as its own field sees it: normals away from it
  float n[3][3], spare[2];
  int touch;
  float far[4];
};
struct Support {
  f8 F[9], reach, most;         // reach: r0; most: no direction stretches that more
  // One particle of a rigid body at one node, seen from either side.
  static inline void see(Aim &A, int f, f4 x, f4 y, f4 z, float reach) {
    if (A.fa != f && A.fc != f) return;
    const f4 h = x * *(f4 *)A.n[0] + y * *(f4 *)A.n[1] + z * *(f4 *)A.n[2];
    f4 &far = *(f4 *)A.far[A.fa == f ? 0 : 1];
    far = __builtin_elementwise_max(far, (A.fa == f ? h : -h) + reach);
  }
  static inline f4 all(float a) { return f4{a, a, a, a}; }
  // Eight particles at one node, seen from either side. Most of them cannot reach farther.
  inline void see(Own &A, f8 x, f8 y, f8 z, i8 in) const {
    f8 h[3];
    for (int k = 0; k < 3; k++) h[k] = x * A.n[0][k] + y * A.n[1][k] + z * A.n[2][k];
    if (!Simd::any(in & ((h[0] + most > A.far[0]) | (h[1] + most > A.far[1]) |
                         (h[2] + most > A.far[2]))))
      return;
    for (int k = 0; k < 3; k++) {
      h[k] += mpm::Support<f8>::reach(F, A.n[0][k], A.n[1][k], A.n[2][k], reach);
      h[k] = Simd::pick(in, h[k], Simd::all(-(float)mpm::VAST));
    }
    // The largest of eight, three times at once.
    const f8 p = Simd::high(__builtin_shufflevector(h[0], h[1], 0, 8, 2, 10, 4, 12, 6, 14),
                            __builtin_shufflevector(h[0], h[1], 1, 9, 3, 11, 5, 13, 7, 15)),
             q = Simd::high(h[2], __builtin_shufflevector(h[2], h[2], 1, 1, 3, 3, 5, 5, 7, 7)),
             r = Simd::high(__builtin_shufflevector(p, q, 0, 1, 8, 8, 4, 5, 12, 12),
                            __builtin_shufflevector(p, q, 2, 3, 10, 10, 6, 7, 14, 14));
    const f4 top = __builtin_shufflevector(r, r, 0, 1, 2, 3),
             over = __builtin_shufflevector(r, r, 4, 5, 6, 7), now = top > over ? top : over;
    *(f4 *)A.far = now > *(f4 *)A.far ? now : *(f4 *)A.far;
  }
  inline void stretch() {
    f8 rows = Simd::all(0.0f), columns = rows;
    for (int i = 0; i < 3; i++) {
      rows = Simd::high(rows, Simd::size(F[3 * i]) + Simd::size(F[3 * i + 1]) + Simd::size(F[3 * i + 2]));
      columns = Simd::high(columns, Simd::size(F[i]) + Simd::size(F[3 + i]) + Simd::size(F[6 + i]));
    }
    most = reach * Simd::root(rows * columns) * (float)mpm::REACH_BOUND_FACTOR;
  }
};
if (index >= world->chores) {
  const int f = index - world->chores;
  const Field &F = world->field[f];
  if (!F.rigids) return;
  for (int e = 0; e < F.blocks; e++) {
    const double *p = F.point + 5 * F.block[e];
    int base[3];
    float x[3];
    for (int i = 0; i < 3; i++) {
      double c = (F.rigid[CENTRE + i] + Vec::dot(F.rigid + TURN + 3 * i, p)) * inv;
      base[i] = Grid::floor_int(c - 0.5);
      x[i] = (float)(c - base[i]);
    }
    float reach = 0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        const int *row = 0;
        int last = 1 << 30;
        for (int k = 0; k < 3; k++) {
          const int X = base[0] + i, Y = base[1] + j, Z = base[2] + k;
          if (Z >> 2 != last) {
            int at[3] = {X >> 2, Y >> 2, last = Z >> 2}, b = Grid::block(F, at);
            row = b < 0 ? 0 : (const int *)F.node + ((size_t)b * 64 + (X & 3) * 16 + (Y & 3) * 4) * 8;
          }
          const int id = row ? row[8 * (Z & 3) + 7] : 0;
          if (!id) continue;
          if (reach == 0) reach = (float)(0.5 * cbrt(p[4]) * inv);
          for (int t = (id & 0xffffff) - 1, end = t + (id >> 24); t < end; t++)
            Support::see(aims[t], f, Support::all(x[0] - i), Support::all(x[1] - j),
                         Support::all(x[2] - k), reach);
        }
      }
  }
  return;
}
alignas(64) int map[512];   // node of the arena to its field's first contact + 1, and how many << 24
const int ROOM = 1024;    // at least what one block of nodes can hold
alignas(64) Own own[ROOM];
f8 volume = Simd::all(0.0f);
Support support;
const int *chore = world->chore + 2 * index;
for (int number = chore[0]; number < chore[1]; number++) {
  const int *task = world->task + 4 * number;
  const Field &field = world->field[task[0]];
  for (int b = task[1]; b < task[2]; b++) {
    const int *record = field.block + BLOCK_INTEGERS * b;
    int any = 0;
    for (int i = 0; i < 27; i++) any |= field.where[4 * record[NEIGHBOURS + i] + 3];
    if (!any) continue;
    const Reached reached(field, record);
    for (int n = 0; n < 27;) {
    int owns = 0;
    u64 layers[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    for (; n < 27 && owns + 64 * (FIELDS_IN_BLOCK - 1) <= ROOM; n++) {
      const u64 mine = reached.nodes(n) & Grid::arena(n);
      int j = mine ? field.where[4 * record[NEIGHBOURS + n] + 3] : 0;
      if (!j) continue;
      const Junction &J = junctions[j - 1];
      u64 have = 0;
      for (int q = 0; q < J.fields; q++) have |= J.field[q] == task[0] ? J.have[q] : 0;
      int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
      for (u64 left = J.chosen & have & mine; left; left &= left - 1) {
        int i = __builtin_ctzll(left), begin = owns;
        const Meet &M = meets[Grid::meet(J, i)];
        for (int t = M.touch; t < M.touch + M.touches; t++) {
          const Aim &A = aims[t];
          if (touches[t].known || (A.fa != task[0] && A.fc != task[0])) continue;
          Own &O = own[owns++];
          const float sign = A.fa == task[0] ? 1.0f : -1.0f;
          for (int d = 0; d < 3; d++)
            for (int k = 0; k < 3; k++) O.n[d][k] = sign * A.n[d][k];
          *(f4 *)O.far = *(f4 *)A.far[A.fa == task[0] ? 0 : 1];
          O.touch = t;
        }
        if (owns == begin) continue;
        const int X = x + (i >> 4), row = (y + (i >> 2 & 3)) * 8 + z + (i & 3);
        map[X * 64 + row] = (begin + 1) | (owns - begin) << 24;
        layers[X] |= 1ull << row;
      }
    }
    for (int s = record[0]; s < record[1] && owns; s += 8) {
      const float *q = field.part + (size_t)s * CHANNELS;
      Nearby P;
      if (!P.find(record, q, s, layers)) continue;
      f8 V = *(f8u *)(q + 8 * VO);
      for (int k = 0; k < 9; k++) support.F[k] = *(f8u *)(q + 8 * (DE + k));
      for (int k = 0; k < 9; k += 4) support.F[k] += 1.0f;
      if (field.half_wall || Simd::any(V != volume)) {
        volume = V;
        for (int l = 0; l < 8; l++) support.reach[l] = (float)(0.5 * cbrt((double)V[l]) * inv);
      }
      if (field.half_wall) {   // vertices of shells reach as far as the wall
        const f8 wall = HalfWall::of(field, q, record[1] - s);
        support.reach = Simd::pick(wall > 0.0f, wall, support.reach);
        volume = Simd::all(0.0f);
      }
      support.stretch();
      for (int i = P.low[0]; i <= P.high[0] + 2; i++) {
        const f8 x = P.at[0] - (float)i;
        for (u64 left = layers[i] & P.box; left; left &= left - 1) {
          const int row = __builtin_ctzll(left), j = row >> 3, k = row & 7;
          const i8 in = P.in[0][i] & P.in[1][j] & P.in[2][k];
          if (!Simd::any(in)) continue;
          const f8 y = P.at[1] - (float)j, z = P.at[2] - (float)k;
          const int id = map[i * 64 + row];
          for (int t = (id & 0xffffff) - 1, end = t + (id >> 24); t < end; t++)
            support.see(own[t], x, y, z, in);
        }
      }
    }
    for (int o = 0; o < owns; o++) {
      Aim &A = aims[own[o].touch];
      *(f4 *)A.far[A.fa == task[0] ? 0 : 1] = *(f4 *)own[o].far;
    }
    }
  }
}
