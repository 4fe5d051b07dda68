// How far fields reach along the candidate normals: s(n) = max (x·n + R), R = r0 ‖Fᵀn‖, over the
// particles around each node. Tasks: those of the particles, then one per field for rigid bodies.
struct Support {
  // One particle at one node, seen from either side. What cannot reach farther is most of them.
  static inline void see(Aim &A, int f, f4 x, f4 y, f4 z, const float *F, float reach, float most) {
    if (A.fa != f && A.fc != f) return;
    const bool first = A.fa == f;
    const f4 nx = *(f4 *)A.n[0], ny = *(f4 *)A.n[1], nz = *(f4 *)A.n[2];
    f4 &far = *(f4 *)A.far[first ? 0 : 1];
    f4 h = x * nx + y * ny + z * nz;
    if (!first) h = -h;
    if (!__builtin_reduce_or(h + most > far)) return;
    f4 a = F[0] * nx + F[3] * ny + F[6] * nz, b = F[1] * nx + F[4] * ny + F[7] * nz,
       c = F[2] * nx + F[5] * ny + F[8] * nz;
    h += reach * __builtin_elementwise_sqrt(a * a + b * b + c * c);
    far = __builtin_elementwise_max(far, h);
  }
  static inline f4 all(float a) { return f4{a, a, a, a}; }
  // No direction stretches more than this.
  static inline float most(const float *F) {
    float rows = 0, columns = 0;
    for (int i = 0; i < 3; i++) {
      float r = fabsf(F[3 * i]) + fabsf(F[3 * i + 1]) + fabsf(F[3 * i + 2]);
      float q = fabsf(F[i]) + fabsf(F[3 + i]) + fabsf(F[6 + i]);
      rows = r > rows ? r : rows;
      columns = q > columns ? q : columns;
    }
    return sqrtf(rows * columns) * 1.00001f;
  }
};
if (index >= world->tasks) {
  const int f = index - world->tasks;
  const Field &F = world->field[f];
  if (!F.rigids) return;
  float Q[9];
  for (int i = 0; i < 9; i++) Q[i] = (float)F.rigid[TURN + i];
  for (int e = 0; e < F.blocks; e++) {
    const double *p = F.point + 5 * F.block[e];
    int base[3];
    float x[3];
    for (int i = 0; i < 3; i++) {
      double c = (F.rigid[CENTRE + i] + Vec::dot(F.rigid + TURN + 3 * i, p)) * inv;
      base[i] = Vec::floor_int(c - 0.5);
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
                         Support::all(x[2] - k), Q, reach, reach);
        }
      }
  }
  return;
}
int *task = world->task + 4 * index;
Field &field = world->field[task[0]];
alignas(64) int map[512];   // node of the arena to its first contact + 1, and how many << 24
float volume = 0, radius = 0;
for (int b = task[1]; b < task[2]; b++) {
  const int *record = field.block + NB * b;
  u64 any = 0;
  for (int i = 0; i < 27; i++) any |= field.near[2 * record[5 + i] + 1];
  if (!any) continue;
  for (int i = 0; i < 512; i += 8) *(i8u *)(map + i) = i8{0, 0, 0, 0, 0, 0, 0, 0};
  for (int n = 0; n < 27; n++) {
    int j = field.where[4 * record[5 + n] + 3];
    if (!j) continue;
    const Junction &J = junctions[j - 1];
    int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
    for (u64 left = J.several & Grid::arena(n); left; left &= left - 1) {
      int i = __builtin_ctzll(left);
      const Meet &M = meets[Grid::meet(J, i)];
      map[(x + (i >> 4)) * 64 + (y + (i >> 2 & 3)) * 8 + z + (i & 3)] = (M.touch + 1) | M.touches << 24;
    }
  }
  for (int s = record[0]; s < record[1]; s += 8) {
    const float *q = field.part + (size_t)s * NC;
    int live = record[1] - s < 8 ? record[1] - s : 8;
    alignas(32) int low[3][8];
    alignas(32) float at[3][8];
    for (int d = 0; d < 3; d++) {
      i8 x = *(i8u *)(q + 8 * (XI + d)), cell = (x - HALF) >> PLACE;
      *(i8 *)low[d] = cell;
      *(f8 *)at[d] = Simd::flo(x - (cell << PLACE)) * PER_UNIT;
    }
    for (int l = 0; l < live; l++) {
      int x = low[0][l], y = low[1][l], z = low[2][l];
      int near = record[5 + (((x >> 2) - record[2] + 1) * 3 + (y >> 2) - record[3] + 1) * 3 +
                        (z >> 2) - record[4] + 1];
      if (!(field.near[2 * near + 1] >> ((x & 3) * 16 + (y & 3) * 4 + (z & 3)) & 1)) continue;
      float F[9];
      for (int k = 0; k < 9; k++) F[k] = q[8 * (DE + k) + l] + (k % 4 == 0);
      if (q[8 * VO + l] != volume) {
        volume = q[8 * VO + l];
        radius = (float)(0.5 * cbrt((double)volume) * inv);
      }
      const float most = radius * Support::most(F);
      const int *home = map + ((x - 4 * record[2] + 1) * 8 + y - 4 * record[3] + 1) * 8 + z -
                        4 * record[4] + 1;
      f4 X = Support::all(at[0][l]);
      for (int i = 0; i < 3; i++, X -= 1.0f) {
        f4 Y = Support::all(at[1][l]);
        for (int j = 0; j < 3; j++, Y -= 1.0f) {
          f4 Z = Support::all(at[2][l]);
          for (int k = 0; k < 3; k++, Z -= 1.0f) {
            int id = home[i * 64 + j * 8 + k];
            if (!id) continue;
            for (int t = (id & 0xffffff) - 1, end = t + (id >> 24); t < end; t++)
              Support::see(aims[t], task[0], X, Y, Z, F, radius, most);
          }
        }
      }
    }
  }
}
