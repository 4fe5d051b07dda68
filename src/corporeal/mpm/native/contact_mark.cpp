// One rigid body puts itself on the nodes of blocks that somebody else reaches: mass, mass times
// offset and outward gradient of volume. Its velocity there follows from its motion.
Field &F = world->field[index];
if (!F.rigids) return;
const double *s = F.rigid;
struct Marks {
  int low[3] = {1 << 28, 1 << 28, 1 << 28}, high[3] = {-1, -1, -1};
  inline void add(Field &F, int x, int y, int z) {
    F.table[(x * F.dim[1] + y) * F.dim[2] + z] = -2;
    int c[3] = {x, y, z};
    for (int i = 0; i < 3; i++) {
      if (c[i] < low[i]) low[i] = c[i];
      if (c[i] > high[i]) high[i] = c[i];
    }
  }
  // Whether a ball around a body's centre reaches a block.
  static inline bool ball(const double *s, const double *mid, double dx) {
    double far = 0;
    for (int i = 0; i < 3; i++) {
      double q = fabs(mid[i] - s[CENTRE + i]) - 3.6 * dx;
      far += q > 0 ? q * q : 0;
    }
    return far <= s[RADIUS] * s[RADIUS];
  }
} marks;
for (int g = 0; g < fields; g++) {
  const Field &G = world->field[g];
  if (g == index) continue;
  int from[3], to[3], none = 0;   // common blocks, in F's window
  for (int i = 0; i < 3; i++) {
    int shift = G.origin[i] - F.origin[i];
    from[i] = shift > 0 ? shift : 0;
    to[i] = shift + G.dim[i] < F.dim[i] ? shift + G.dim[i] : F.dim[i];
    none |= from[i] >= to[i];
  }
  if (none) continue;
  for (int x = from[0]; x < to[0]; x++)
    for (int y = from[1]; y < to[1]; y++)
      for (int z = from[2]; z < to[2]; z++) {
        int at[3] = {x + F.origin[0], y + F.origin[1], z + F.origin[2]};
        double mid[3] = {(4.0 * at[0] + 1.5) * dx, (4.0 * at[1] + 1.5) * dx,
                         (4.0 * at[2] + 1.5) * dx};
        if (G.rigids ? Marks::ball(G.rigid, mid, dx) && Marks::ball(s, mid, dx)
                     : Grid::block(G, at) >= 0)
          marks.add(F, x, y, z);
      }
}
for (int w = 0; w < planes && !F.surfaces; w++) {
  const double *P = world->plane + 4 * w;
  if (Vec::dot(P, s + CENTRE) - P[3] > s[RADIUS] + 3 * dx) continue;
  for (int x = 0; x < F.dim[0]; x++)
    for (int y = 0; y < F.dim[1]; y++)
      for (int z = 0; z < F.dim[2]; z++) {
        double mid[3] = {(4.0 * (x + F.origin[0]) + 1.5) * dx, (4.0 * (y + F.origin[1]) + 1.5) * dx,
                         (4.0 * (z + F.origin[2]) + 1.5) * dx};
        if (Vec::dot(P, mid) - P[3] <= 3.5 * dx) marks.add(F, x, y, z);
      }
}
if (marks.high[0] < 0) return;
double edge_low[3], edge_high[3];
for (int i = 0; i < 3; i++) {
  edge_low[i] = (4.0 * (marks.low[i] + F.origin[i]) - 1.5) * dx;
  edge_high[i] = (4.0 * (marks.high[i] + F.origin[i]) + 4.5) * dx;
}
for (int p = 0; p < F.points; p++) {
  const double *q = F.point + 5 * p;
  double x[3];
  int out = 0;
  for (int i = 0; i < 3; i++) {
    x[i] = s[CENTRE + i] + Vec::dot(s + TURN + 3 * i, q);
    out |= (x[i] < edge_low[i]) | (x[i] > edge_high[i]);
  }
  if (out) continue;
  int base[3];
  float w[3][3], g[3][3], fr[3];
  for (int i = 0; i < 3; i++) {
    double c = x[i] * inv;
    base[i] = Vec::floor_int(c - 0.5);
    double f = c - base[i];   // doubles: what is nearly nothing must not become nothing
    fr[i] = (float)f;
    w[i][0] = (float)(0.5 * (1.5 - f) * (1.5 - f));
    w[i][1] = (float)(0.75 - (f - 1) * (f - 1));
    w[i][2] = (float)(0.5 * (f - 0.5) * (f - 0.5));
    g[i][0] = fr[i] - 1.5f;
    g[i][1] = 2.0f - 2.0f * fr[i];
    g[i][2] = fr[i] - 0.5f;
    base[i] -= 4 * F.origin[i];
  }
  float m = (float)q[3], v = (float)q[4];
  int used = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) {
        int X = base[0] + i, Y = base[1] + j, Z = base[2] + k;
        if (X < 0 || Y < 0 || Z < 0 || X >> 2 >= F.dim[0] || Y >> 2 >= F.dim[1] ||
            Z >> 2 >= F.dim[2])
          continue;
        int *t = F.table + ((X >> 2) * F.dim[1] + (Y >> 2)) * F.dim[2] + (Z >> 2);
        if (*t == -1) continue;
        if (*t == -2) {
          *t = F.pool;
          int *wh = F.where + 4 * F.pool++;
          wh[0] = X >> 2;
          wh[1] = Y >> 2;
          wh[2] = Z >> 2;
          wh[3] = 0;
        }
        float a = m * w[0][i] * w[1][j] * w[2][k];
        f8u *node = (f8u *)F.node + (size_t)*t * 64 + (X & 3) * 16 + (Y & 3) * 4 + (Z & 3);
        *node += f8{a, a * (fr[0] - i), a * (fr[1] - j), a * (fr[2] - k),
                    v * g[0][i] * w[1][j] * w[2][k], v * w[0][i] * g[1][j] * w[2][k],
                    v * w[0][i] * w[1][j] * g[2][k], 0.0f};
        used = 1;
      }
  if (used) F.block[F.blocks++] = p;
}
// Marks that no particle reached.
for (int x = marks.low[0]; x <= marks.high[0]; x++)
  for (int y = marks.low[1]; y <= marks.high[1]; y++)
    for (int z = marks.low[2]; z <= marks.high[2]; z++) {
      int *t = F.table + (x * F.dim[1] + y) * F.dim[2] + z;
      if (*t == -2) *t = -1;
    }
