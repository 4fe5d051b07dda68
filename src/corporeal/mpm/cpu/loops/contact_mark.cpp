// Scatter one rigid body to the nodes of blocks that another field or a plane reaches: mass, mass times
// offset and outward gradient of volume. Its velocity there follows from its motion.
const int MATES = 32;     // near rigid bodies that are tested one by one
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
  // Whether a body's particles, in their box, may reach a block's nodes.
  static inline bool near(const double *s, const double *mid, double dx) {
    const double *R = s + TURN, *box = s + LOCAL_BOX;
    for (int i = 0; i < 3; i++) {
      double r = 0, e = 0;
      for (int j = 0; j < 3; j++) {
        r += R[3 * j + i] * (mid[j] - s[CENTRE + j]);
        e += fabs(R[3 * j + i]) * 3.0 * dx;
      }
      if (r + e < box[i] || r - e > box[3 + i]) return false;
    }
    return true;
  }
  // Whether a ball reaches a marked block.
  inline bool reach(const Field &F, const double *mid, double radius, double inv) const {
    int from[3], to[3];
    for (int i = 0; i < 3; i++) {
      from[i] = (Grid::floor_int((mid[i] - radius) * inv - 1.5) >> 2) - F.origin[i];
      to[i] = (Grid::floor_int((mid[i] + radius) * inv + 1.5) >> 2) - F.origin[i];
      if (from[i] < low[i]) from[i] = low[i];
      if (to[i] > high[i]) to[i] = high[i];
    }
    for (int x = from[0]; x <= to[0]; x++)
      for (int y = from[1]; y <= to[1]; y++)
        for (int z = from[2]; z <= to[2]; z++)
          if (F.table[(x * F.dim[1] + y) * F.dim[2] + z] != -1) return true;
    return false;
  }
  // Row of four nodes of a marked block, which gets memory now if it has none; or nothing.
  static inline f8u *row(Field &F, int X, int Y, int z) {
    const int x = X >> 2, y = Y >> 2;
    if (X < 0 || Y < 0 || z < 0 || x >= F.dim[0] || y >= F.dim[1] || z >= F.dim[2]) return 0;
    int *t = F.table + (x * F.dim[1] + y) * F.dim[2] + z;
    if (*t == -1) return 0;
    if (*t == -2) {
      *t = F.pool;
      int *w = F.where + 4 * F.pool++;
      w[0] = x;
      w[1] = y;
      w[2] = z;
      w[3] = 0;
    }
    return (f8u *)F.node + (size_t)*t * 64 + (X & 3) * 16 + (Y & 3) * 4;
  }
} marks;
// A particle shares no node with a rigid body whose box is farther than two splines are wide.
struct Mates {
  static inline void meet(const double *s, const double *g, double dx, double *out) {
    for (int i = 0; i < 3; i++) {
      double e = 0;
      out[9 + i] = 0;
      for (int j = 0; j < 3; j++) {
        const double *R = g + TURN;
        out[3 * i + j] = R[i] * s[TURN + j] + R[3 + i] * s[TURN + 3 + j] + R[6 + i] * s[TURN + 6 + j];
        out[9 + i] += R[3 * j + i] * (s[CENTRE + j] - g[CENTRE + j]);
        e += fabs(R[3 * j + i]) * 3.0 * dx;
      }
      out[12 + i] = g[LOCAL_BOX + i] - e;
      out[15 + i] = g[LOCAL_BOX + 3 + i] + e;
    }
  }
  // Whether a ball reaches a mate's box.
  static inline bool reach(const double *o, const double *q, double radius) {
    bool in = true;
    for (int i = 0; i < 3; i++) {
      double y = o[9 + i] + Vec::dot(o + 3 * i, q);
      in &= y + radius >= o[12 + i] && y - radius <= o[15 + i];
    }
    return in;
  }
  // Those whose boxes it reaches; how many.
  static inline int near(const double (*other)[18], int mates, const double *q, double radius, int *found) {
    int count = 0;
    for (int m = 0; m < mates; m++)
      if (reach(other[m], q, radius)) found[count++] = m;
    return count;
  }
  // Whether a point lies in the box of any of some.
  static inline bool any(const double (*other)[18], const int *some, int count, const double *q) {
    for (int k = 0; k < count; k++)
      if (reach(other[some[k]], q, 0.0)) return true;
    return false;
  }
};

double other[MATES][18];   // of rigid bodies near: our frame to theirs 12, then their box
int mates = 0;
bool soft = false;
for (int g = 0; g < fields; g++) {
  const Field &G = world->field[g];
  if (g == index || world->friction[index * all + g] < 0) continue;   // bonded
  int from[3], to[3], none = 0;   // common blocks, in F's window
  for (int i = 0; i < 3; i++) {
    int shift = G.origin[i] - F.origin[i];
    from[i] = shift > 0 ? shift : 0;
    to[i] = shift + G.dim[i] < F.dim[i] ? shift + G.dim[i] : F.dim[i];
    none |= from[i] >= to[i];
  }
  if (none) continue;
  if (G.rigids && mates < MATES)
    Mates::meet(s, G.rigid, dx, other[mates++]);
  else
    soft = true;
  for (int x = from[0]; x < to[0]; x++)
    for (int y = from[1]; y < to[1]; y++)
      for (int z = from[2]; z < to[2]; z++) {
        int at[3] = {x + F.origin[0], y + F.origin[1], z + F.origin[2]};
        double mid[3] = {(4.0 * at[0] + 1.5) * dx, (4.0 * at[1] + 1.5) * dx,
                         (4.0 * at[2] + 1.5) * dx};
        if (G.rigids ? !Marks::near(G.rigid, mid, dx) : Grid::block(G, at) < 0) continue;
        if (Marks::near(s, mid, dx)) marks.add(F, x, y, z);
      }
}
for (int w = 0; w < planes && !F.pointed; w++) {
  const double *P = world->plane + 4 * w;
  if (Vec::dot(P, s + CENTRE) - P[3] > s[RADIUS] + 3 * dx) continue;
  soft = true;
  for (int x = 0; x < F.dim[0]; x++)
    for (int y = 0; y < F.dim[1]; y++)
      for (int z = 0; z < F.dim[2]; z++) {
        double mid[3] = {(4.0 * (x + F.origin[0]) + 1.5) * dx, (4.0 * (y + F.origin[1]) + 1.5) * dx,
                         (4.0 * (z + F.origin[2]) + 1.5) * dx};
        if (Vec::dot(P, mid) - P[3] <= 3.5 * dx) marks.add(F, x, y, z);
      }
}
if (marks.high[0] < 0) return;
for (int c = 0; c < F.clumps; c++) {
  const double *clump = F.clump + 6 * c;
  int close[MATES];          // no point of the clump lies in another's box
  const int closes = soft ? 0 : Mates::near(other, mates, clump + 2, clump[5], close);
  if (!soft && !closes) continue;
  double mid[3];
  for (int i = 0; i < 3; i++) mid[i] = s[CENTRE + i] + Vec::dot(s + TURN + 3 * i, clump + 2);
  if (!marks.reach(F, mid, clump[5], inv)) continue;
  for (int p = (int)clump[0]; p < (int)clump[1]; p++) {
    const double *q = F.point + 5 * p;
    if (!soft && !Mates::any(other, close, closes, q)) continue;
    int base[3], out = 0;
    float fr[3];
    f8 w[3][3];
    const i8 lanes = i8{0, 0, 0, 0, 1, 2, 3, 0};
    for (int i = 0; i < 3; i++) {
      double x = (s[CENTRE + i] + Vec::dot(s + TURN + 3 * i, q)) * inv;
      base[i] = Grid::floor_int(x - 0.5);
      double f = x - base[i];   // doubles: nearly zero must not become zero
      fr[i] = (float)f;
      double n[3], slope[3];
      mpm::Spline<double>::weights(f, n);
      mpm::Spline<double>::slopes(f, slope);
      for (int k = 0; k < 3; k++)
        w[i][k] = Simd::pick(lanes == i + 1, Simd::all((float)slope[k]), Simd::all((float)n[k]));
      base[i] -= 4 * F.origin[i];
      out |= base[i] + 2 < 4 * marks.low[i] || base[i] > 4 * marks.high[i] + 3;
    }
    if (out) continue;
    const float m = (float)q[3], v = (float)q[4];
    const f8 x1 = f8{0, m, 0, 0, 0, 0, 0, 0}, y1 = f8{0, 0, m, 0, 0, 0, 0, 0},
             z1 = f8{0, 0, 0, m, 0, 0, 0, 0};
    f8 ri = f8{m, m * fr[0], m * fr[1], m * fr[2], v, v, v, 0};
    bool used = false;
    for (int i = 0; i < 3; i++, ri -= x1) {
      f8 rj = ri;
      for (int j = 0; j < 3; j++, rj -= y1) {
        const f8 wij = w[0][i] * w[1][j];
        f8 r = rj;
        int last = -1;
        f8u *row = 0;
        for (int k = 0; k < 3; k++, r -= z1) {
          const int Z = base[2] + k;
          if (Z >> 2 != last) {
            last = Z >> 2;
            row = Marks::row(F, base[0] + i, base[1] + j, last);
          }
          if (!row) continue;
          row[Z & 3] += wij * w[2][k] * r;
          used = true;
        }
      }
    }
    if (used) F.block[F.blocks++] = p;
  }
}
// Marks that no particle reached.
for (int x = marks.low[0]; x <= marks.high[0]; x++)
  for (int y = marks.low[1]; y <= marks.high[1]; y++)
    for (int z = marks.low[2]; z <= marks.high[2]; z++) {
      int *t = F.table + (x * F.dim[1] + y) * F.dim[2] + z;
      if (*t == -2) *t = -1;
    }
