// How far fields reach along the candidate normals: s(n) = max (x·n + R), R = r0 ‖Fᵀn‖, over the
// particles around each node. Tasks: those of the particles, then one per field for rigid bodies.
struct Support {
  // One particle at one node, seen from either side.
  static inline void see(Touch &T, bool first, float x, float y, float z, const float *F,
                         float reach, float most) {
    const f4 nx = *(f4 *)T.n[0], ny = *(f4 *)T.n[1], nz = *(f4 *)T.n[2];
    f4 &far = *(f4 *)T.far[first ? 0 : 1];
    f4 h = x * nx + y * ny + z * nz;
    if (!first) h = -h;
    f4 open = h + most;
    auto closer = open > far;
    if (!(closer[0] | closer[1] | closer[2])) return;
    f4 a = F[0] * nx + F[3] * ny + F[6] * nz, b = F[1] * nx + F[4] * ny + F[7] * nz,
       c = F[2] * nx + F[5] * ny + F[8] * nz;
    h += reach * __builtin_elementwise_sqrt(a * a + b * b + c * c);
    far = h > far ? h : far;
  }
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
    for (int i = 0; i < 27; i++) {
      int node[3] = {base[0] + i / 9, base[1] + i / 3 % 3, base[2] + i % 3};
      int at[3] = {node[0] >> 2, node[1] >> 2, node[2] >> 2};
      int b = Grid::block(F, at);
      if (b < 0 || !F.where[4 * b + 3]) continue;
      const Junction &J = junctions[F.where[4 * b + 3] - 1];
      int bit = (node[0] & 3) * 16 + (node[1] & 3) * 4 + (node[2] & 3);
      if (!(J.several >> bit & 1)) continue;
      const Meet &M = meets[Grid::meet(J, bit)];
      if (reach == 0) reach = (float)(0.5 * cbrt(p[4]) * inv);
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        Touch &T = touches[t];
        if (T.c >= 0 && (T.fa == f || T.fc == f))
          Support::see(T, T.fa == f, x[0] - i / 9, x[1] - i / 3 % 3, x[2] - i % 3, Q, reach, reach);
      }
    }
  }
  return;
}
int *task = world->task + 4 * index;
Field &field = world->field[task[0]];
alignas(64) int map[512];   // node of the arena to one more than its meet
for (int b = task[1]; b < task[2]; b++) {
  const int *record = field.block + NB * b;
  u64 any = 0;
  for (int i = 0; i < 27; i++) any |= field.near[2 * record[5 + i] + 1];
  if (!any) continue;
  for (int i = 0; i < 512; i++) map[i] = 0;
  for (int n = 0; n < 27; n++) {
    int j = field.where[4 * record[5 + n] + 3];
    if (!j) continue;
    const Junction &J = junctions[j - 1];
    int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
    for (u64 left = J.several; left; left &= left - 1) {
      int i = __builtin_ctzll(left), ax = x + (i >> 4), ay = y + (i >> 2 & 3), az = z + (i & 3);
      if (!((ax | ay | az) & ~7)) map[ax * 64 + ay * 8 + az] = Grid::meet(J, i) + 1;
    }
  }
  for (int s = record[0]; s < record[1]; s += 8) {
    const float *q = field.part + (size_t)s * NC;
    int live = record[1] - s < 8 ? record[1] - s : 8;
    alignas(32) int low[3][8];
    for (int d = 0; d < 3; d++) *(i8 *)low[d] = (*(i8u *)(q + 8 * (XI + d)) - HALF) >> PLACE;
    for (int l = 0; l < live; l++) {
      int x = low[0][l], y = low[1][l], z = low[2][l];
      int near = record[5 + (((x >> 2) - record[2] + 1) * 3 + (y >> 2) - record[3] + 1) * 3 +
                        (z >> 2) - record[4] + 1];
      if (!(field.near[2 * near + 1] >> ((x & 3) * 16 + (y & 3) * 4 + (z & 3)) & 1)) continue;
      float F[9], at[3];
      for (int k = 0; k < 9; k++) F[k] = q[8 * (DE + k) + l] + (k % 4 == 0);
      for (int d = 0; d < 3; d++)
        at[d] = (float)(((const int *)q)[8 * (XI + d) + l] - (low[d][l] << PLACE)) * PER_UNIT;
      float reach = (float)(0.5 * cbrt((double)q[8 * VO + l]) * inv), most = reach * Support::most(F);
      const int *home = map + ((x - 4 * record[2] + 1) * 8 + y - 4 * record[3] + 1) * 8 + z -
                        4 * record[4] + 1;
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          for (int k = 0; k < 3; k++) {
            int id = home[i * 64 + j * 8 + k];
            if (!id) continue;
            const Meet &M = meets[id - 1];
            for (int t = M.touch; t < M.touch + M.touches; t++) {
              Touch &T = touches[t];
              if (T.c < 0 || (T.fa != task[0] && T.fc != task[0])) continue;
              Support::see(T, T.fa == task[0], at[0] - i, at[1] - j, at[2] - k, F, reach, most);
            }
          }
    }
  }
}
