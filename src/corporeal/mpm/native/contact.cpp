// One step's contact, from first to last: rigid bodies put mass on their grids, nodes where fields
// meet are listed, surfaces looked at, normals chosen, gaps measured, impulses solved, rigid bodies
// moved. Same formulas as contact.py and encounter.py; design: physics, section 2 C to G.
const int CENTRE = 1, TURN = 4, REST = 13, SPEED = 22, MOMENT = 25, INERTIA = 28, SPIN = 37,
          RADIUS = 40, KICK = 41;
constexpr double WALL_REACH = 0.51, LATTICE_GAP = 0.05, LATTICE_SLOPE = 0.25, LATTICE_START = 0.7,
             DEEPEST = 1.25, PATCH = 0.1, SLOWEST = 0.05, POINT_REACH = 0.3;

struct Meet {             // a node where fields meet
  int at[3], count, first, last, stiff, several;
  int field[MOST], slot[MOST];
  double m[MOST], mean[MOST][3], out[MOST][3], v[MOST][3];
  double spare[7];
};
struct Touch {            // a possible contact of a with c, or with plane -1 - c
  int meet, a, c, fa, fc, active, stiff, bounce;
  double x[3], n[3], chosen[3], candidate[3][3], far_a[3], far_c[3];
  double gap, target, mu, inverse, J[3], before[3], approach;
};
struct Close {            // a particle near a node where two fields meet
  double x[3];
  float F[9];
  float reach, stretch;
  int field, count, id[27], at[27];
};
static_assert(sizeof(Meet) <= 704 && sizeof(Touch) <= 448 && sizeof(Close) <= 304, "memory");

struct Face {             // a half space u < s through the quadratic spline
  static inline double mean(double s) {
    s = s < -1.5 ? -1.5 : s > 1.5 ? 1.5 : s;
    double n = s > 0 ? -s : s, w = n + 1.5, weight, moment;
    if (n < -0.5) {
      weight = w * w * w / 6.0;
      moment = w * w * w * w / 8.0 - w * w * w / 4.0;
    } else {
      weight = 0.5 + 0.75 * n - n * n * n / 3.0;
      moment = -13.0 / 64.0 + 0.375 * n * n - 0.25 * n * n * n * n;
    }
    if (s > 0) weight = 1.0 - weight;
    return weight > 1e-12 ? moment / weight : n;
  }
  // Inverse of mean, from a table of 4097 values over [-1.5, 0].
  static inline double face(const double *table, double p) {
    double f = ((p < -1.5 ? -1.5 : p > 0.0 ? 0.0 : p) + 1.5) * (4096.0 / 1.5);
    int i = f < 4095.0 ? (int)f : 4095;
    return table[i] + (table[i + 1] - table[i]) * (f - i);
  }
  static inline double touching(double s) {
    s = fabs(s);
    if (s > DEEPEST) s = DEEPEST;
    double over = s - LATTICE_START;
    return -mean(s) - mean(-s) + LATTICE_GAP + LATTICE_SLOPE * (over > 0 ? over : 0.0);
  }
};
struct Vec {
  static inline double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static inline void cross(const double *a, const double *b, double *c) {
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
    c[0] = x;
    c[1] = y;
  }
  static inline void apply(const double *A, const double *b, double *c) {
    double x = dot(A, b), y = dot(A + 3, b), z = dot(A + 6, b);
    c[0] = x;
    c[1] = y;
    c[2] = z;
  }
  static inline double unit(double *a) {
    double l = sqrt(dot(a, a));
    for (int i = 0; i < 3; i++) a[i] = l > 1e-30 ? a[i] / l : 0.0;
    return l;
  }
  // C = A B, or A Bt
  static inline void times(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
  }
  static inline void times_transposed(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        C[3 * i + j] = dot(A + 3 * i, B + 3 * j);
  }
  static inline int floor_int(double a) {
    int i = (int)a;
    return i - (a < i);
  }
};
struct Body6 {            // a rigid body's state
  static inline void turn(double *s, const double *w, double dt, double *Q) {
    double a[3] = {w[0] * dt, w[1] * dt, w[2] * dt}, t = sqrt(Vec::dot(a, a));
    double K[9] = {0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0}, K2[9], R[9];
    Vec::times(K, K, K2);
    double f = t < 1e-6 ? 1.0 - t * t / 6.0 : sin(t) / t;
    double g = t < 1e-6 ? 0.5 - t * t / 24.0 : (1.0 - cos(t)) / (t * t);
    for (int i = 0; i < 9; i++) R[i] = f * K[i] + g * K2[i] + (i % 4 == 0);
    Vec::times(R, s + TURN, Q);
  }
  static inline void spin_up(double *s, const double *Q, double *w) {
    double A[9], B[9];
    Vec::times(Q, s + REST, A);
    Vec::times_transposed(A, Q, B);
    for (int i = 0; i < 9; i++) s[INERTIA + i] = B[i];
    Vec::apply(B, s + MOMENT, w);
  }
  static inline void velocity(const double *s, const double *x, double *v) {
    double r[3] = {x[0] - s[CENTRE], x[1] - s[CENTRE + 1], x[2] - s[CENTRE + 2]};
    Vec::cross(s + SPIN, r, v);
    for (int i = 0; i < 3; i++) v[i] += s[SPEED + i];
  }
  static inline double softness(const double *s, const double *x, const double *n) {
    double r[3] = {x[0] - s[CENTRE], x[1] - s[CENTRE + 1], x[2] - s[CENTRE + 2]}, t[3], u[3];
    Vec::cross(r, n, t);
    Vec::apply(s + INERTIA, t, u);
    return 1.0 / s[0] + Vec::dot(t, u);
  }
  static inline void hit(double *s, const double *x, const double *J) {
    double r[3] = {x[0] - s[CENTRE], x[1] - s[CENTRE + 1], x[2] - s[CENTRE + 2]}, t[3], u[3];
    Vec::cross(r, J, t);
    Vec::apply(s + INERTIA, t, u);
    for (int i = 0; i < 3; i++) {
      s[SPEED + i] += J[i] / s[0];
      s[MOMENT + i] += t[i];
      s[SPIN + i] += u[i];
    }
  }
};
struct Grid {
  static inline int block(const Field &f, int x, int y, int z) {   // window coordinates
    if (x < 0 || y < 0 || z < 0 || x >= f.dim[0] || y >= f.dim[1] || z >= f.dim[2]) return -1;
    return f.table[(x * f.dim[1] + y) * f.dim[2] + z];
  }
  static inline int slot(const Field &f, const int *node) {        // world node to node slot
    int x = node[0] - 4 * f.origin[0], y = node[1] - 4 * f.origin[1],
        z = node[2] - 4 * f.origin[2];
    if (x < 0 || y < 0 || z < 0) return -1;
    int b = block(f, x >> 2, y >> 2, z >> 2);
    return b < 0 ? -1 : b * 64 + (x & 3) * 16 + (y & 3) * 4 + (z & 3);
  }
};

const double dx = world->dx, dt = world->dt, inv = 1.0 / dx;
const int fields = world->fields, planes = world->planes, all = fields + planes,
          books = world->names - planes;
Meet *meets = (Meet *)world->contact_memory;
Touch *touches = (Touch *)world->pair_memory;
Close *closes = (Close *)world->near_memory;
int nm = 0, nt = 0, nc = 0, stiff_any = 0;
world->full = 0;

// ---- rigid bodies: forces, then mass on the nodes where somebody else is
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  if (!F.rigids) continue;
  double *s = F.rigid;
  if (!world->again) {
    for (int i = 0; i < 3; i++) s[SPEED + i] += s[KICK + i];
    double Q[9];
    for (int i = 0; i < 9; i++) Q[i] = s[TURN + i];
    Body6::spin_up(s, Q, s + SPIN);
  }
  // Forget last step's blocks, move the window, mark the blocks that others reach.
  for (int b = 0; b < F.pool; b++) {
    int *w = F.where + 4 * b;
    F.table[(w[0] * F.dim[1] + w[1]) * F.dim[2] + w[2]] = -1;
    for (int i = 0; i < 512; i++) F.node[(size_t)b * 512 + i] = 0;
  }
  F.pool = 0;
  F.blocks = 0;
  for (int i = 0; i < 3; i++)
    F.origin[i] = (Vec::floor_int((s[CENTRE + i] - s[RADIUS]) * inv - 1.0) >> 2) - 1;
}
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  if (!F.rigids) continue;
  double *s = F.rigid;
  int low[3] = {1 << 28, 1 << 28, 1 << 28}, high[3] = {-1, -1, -1}, marked = 0;
  for (int g = 0; g < fields; g++) {
    Field &G = world->field[g];
    if (g == f) continue;
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
          if (!G.rigids) {
            int b = Grid::block(G, x + F.origin[0] - G.origin[0], y + F.origin[1] - G.origin[1],
                                z + F.origin[2] - G.origin[2]);
            if (b < 0) continue;
          } else {
            // Both spheres must reach the block.
            double far = 0, mine = 0;
            for (int i = 0; i < 3; i++) {
              int c = i == 0 ? x : i == 1 ? y : z;
              double mid = (4.0 * (c + F.origin[i]) + 1.5) * dx;
              double q = fabs(mid - G.rigid[CENTRE + i]) - 3.6 * dx;
              double p = fabs(mid - s[CENTRE + i]) - 3.6 * dx;
              far += q > 0 ? q * q : 0;
              mine += p > 0 ? p * p : 0;
            }
            double R = G.rigid[RADIUS], S = s[RADIUS];
            if (far > R * R || mine > S * S) continue;
          }
          F.table[(x * F.dim[1] + y) * F.dim[2] + z] = -2;
          int c[3] = {x, y, z};
          for (int i = 0; i < 3; i++) {
            if (c[i] < low[i]) low[i] = c[i];
            if (c[i] > high[i]) high[i] = c[i];
          }
          marked++;
        }
  }
  if (F.surfaces == 0)
    for (int w = 0; w < planes; w++) {
      const double *P = world->plane + 4 * w;
      if (Vec::dot(P, s + CENTRE) - P[3] > s[RADIUS] + 3 * dx) continue;
      for (int x = 0; x < F.dim[0]; x++)
        for (int y = 0; y < F.dim[1]; y++)
          for (int z = 0; z < F.dim[2]; z++) {
            double c[3] = {(4.0 * (x + F.origin[0]) + 1.5) * dx, (4.0 * (y + F.origin[1]) + 1.5) * dx,
                           (4.0 * (z + F.origin[2]) + 1.5) * dx};
            if (Vec::dot(P, c) - P[3] > 3.5 * dx) continue;
            F.table[(x * F.dim[1] + y) * F.dim[2] + z] = -2;
            int k[3] = {x, y, z};
            for (int i = 0; i < 3; i++) {
              if (k[i] < low[i]) low[i] = k[i];
              if (k[i] > high[i]) high[i] = k[i];
            }
            marked++;
          }
    }
  if (!marked) continue;
  const double *Q = s + TURN;
  double edge_low[3], edge_high[3];
  for (int i = 0; i < 3; i++) {
    edge_low[i] = (4.0 * (low[i] + F.origin[i]) - 1.5) * dx;
    edge_high[i] = (4.0 * (high[i] + F.origin[i]) + 4.5) * dx;
  }
  for (int p = 0; p < F.points; p++) {
    const double *q = F.point + 5 * p;
    double x[3];
    int out = 0;
    for (int i = 0; i < 3; i++) {
      x[i] = s[CENTRE + i] + Vec::dot(Q + 3 * i, q);
      out |= (x[i] < edge_low[i]) | (x[i] > edge_high[i]);
    }
    if (out) continue;
    int base[3];
    double w[3][3];
    for (int i = 0; i < 3; i++) {
      double c = x[i] * inv;
      base[i] = Vec::floor_int(c - 0.5);
      double fr = c - base[i];
      w[i][0] = 0.5 * (1.5 - fr) * (1.5 - fr);
      w[i][1] = 0.75 - (fr - 1) * (fr - 1);
      w[i][2] = 0.5 * (fr - 0.5) * (fr - 0.5);
      base[i] -= 4 * F.origin[i];
    }
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
          }
          float *node = F.node + ((size_t)*t * 64 + (X & 3) * 16 + (Y & 3) * 4 + (Z & 3)) * 8;
          node[0] += (float)(q[3] * w[0][i] * w[1][j] * w[2][k]);
          used = 1;
        }
    if (used) F.block[F.blocks++] = p;
  }
  // Marks that no particle reached.
  for (int x = low[0]; x <= high[0]; x++)
    for (int y = low[1]; y <= high[1]; y++)
      for (int z = low[2]; z <= high[2]; z++) {
        int *t = F.table + (x * F.dim[1] + y) * F.dim[2] + z;
        if (*t == -2) *t = -1;
      }
}

Bonds::hold(world);

// ---- the list of nodes where fields meet each other or a plane
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  if (world->again)
    for (size_t i = 0; i < (size_t)F.pool * 64; i++) F.node[8 * i + 7] = 0;
}
for (int f = 0; f < fields && !world->full; f++) {
  Field &F = world->field[f];
  for (int b = 0; b < F.pool && !world->full; b++) {
    const int *w = F.where + 4 * b;
    int at[3] = {w[0] + F.origin[0], w[1] + F.origin[1], w[2] + F.origin[2]};
    double mid[3] = {(4 * at[0] + 1.5) * dx, (4 * at[1] + 1.5) * dx, (4 * at[2] + 1.5) * dx};
    for (int g = f + 1; g < all; g++) {
      int other = -1;
      const double *P = 0;
      if (g < fields) {
        Field &G = world->field[g];
        if (!G.pool || world->friction[f * all + g] < 0) continue;   // bonded
        other = Grid::block(G, at[0] - G.origin[0], at[1] - G.origin[1], at[2] - G.origin[2]);
        if (other < 0) continue;
      } else {
        if (F.rigids && F.surfaces) continue;
        P = world->plane + 4 * (g - fields);
        if (Vec::dot(P, mid) - P[3] > 3.2 * dx) continue;
      }
      for (int i = 0; i < 64; i++) {
        float *a = F.node + ((size_t)b * 64 + i) * 8, *c = 0;
        if (!(a[0] > 0)) continue;
        int node[3] = {4 * at[0] + (i >> 4), 4 * at[1] + ((i >> 2) & 3), 4 * at[2] + (i & 3)};
        if (P) {
          double h = (P[0] * node[0] + P[1] * node[1] + P[2] * node[2]) * dx - P[3];
          if (h > WALL_REACH * dx) continue;
        } else {
          c = world->field[g].node + ((size_t)other * 64 + i) * 8;
          if (!(c[0] > 0)) continue;
        }
        int k = (int)a[7] - 1;
        if (k < 0 && c) k = (int)c[7] - 1;
        if (k < 0) {
          if (nm >= world->most_contacts) {
            world->full = 1;
            break;
          }
          k = nm++;
          Meet &M = meets[k];
          for (int d = 0; d < 3; d++) M.at[d] = node[d];
          M.count = M.stiff = M.several = 0;
        }
        Meet &M = meets[k];
        for (int side = 0; side < 2; side++) {
          float *n = side ? c : a;
          if (!n || n[7] != 0.0f || M.count == MOST) continue;
          n[7] = (float)(k + 1);
          int q = M.count++;
          M.field[q] = side ? g : f;
          M.slot[q] = (side ? other : b) * 64 + i;
          M.m[q] = 0;
          for (int d = 0; d < 3; d++) M.mean[q][d] = M.out[q][d] = 0, M.v[q][d] = n[1 + d];
          if (world->field[M.field[q]].rigids) M.stiff = 1;
        }
        if (M.count > 1) M.several = 1;
      }
      if (world->full) break;
    }
  }
}
for (int k = 0; k < nm && !world->full; k++) {
  Meet &M = meets[k];
  M.first = nt;
  if (nt + 15 + MOST * planes > world->most_pairs) {
    world->full = 1;
    break;
  }
  for (int a = 0; a < M.count; a++)
    for (int c = a + 1; c < M.count + planes; c++) {
      int w = c - M.count;
      Touch &T = touches[nt];
      T.fa = M.field[a];
      Field &A = world->field[T.fa];
      for (int d = 0; d < 3; d++) T.x[d] = M.at[d] * dx;
      if (w >= 0) {
        const double *P = world->plane + 4 * w;
        if (A.rigids && A.surfaces) continue;
        if (Vec::dot(P, T.x) - P[3] > WALL_REACH * dx) continue;
        for (int d = 0; d < 3; d++) T.n[d] = T.chosen[d] = -P[d];
      }
      if (w < 0 && world->friction[T.fa * all + M.field[c]] < 0) continue;   // bonded
      T.meet = k;
      T.a = a;
      T.c = w >= 0 ? -1 - w : c;
      T.fc = w >= 0 ? fields + w : M.field[c];
      for (int q = 0; q < 3; q++) T.far_a[q] = -1e30, T.far_c[q] = 1e30;
      nt++;
    }
  M.last = nt;
}

// ---- second look at the particles around those nodes, and only them
for (int k = 0; k < nm && !world->full; k++) {
  Meet &M = meets[k];
  for (int q = 0; q < M.count; q++) {
    Field &F = world->field[M.field[q]];
    int x = M.at[0] - 4 * F.origin[0], y = M.at[1] - 4 * F.origin[1], z = M.at[2] - 4 * F.origin[2];
    for (int i = x - 2; i <= x; i++)
      for (int j = y - 2; j <= y; j++)
        for (int l = z - 2; l <= z; l++) {
          if (i < 0 || j < 0 || l < 0) continue;
          int b = Grid::block(F, i >> 2, j >> 2, l >> 2);
          if (b < 0) continue;
          u64 bit = 1ull << ((i & 3) * 16 + (j & 3) * 4 + (l & 3));
          F.near[2 * b] |= bit;
          if (M.several) F.near[2 * b + 1] |= bit;
        }
  }
}
struct Look {
  // Remember a particle near nodes where fields meet, with the nodes it reaches.
  static inline void close(Close &C, int f, const double *c, const int *base, const double *Fp,
                           double volume) {
    double rows = 0, columns = 0;
    for (int i = 0; i < 3; i++) {
      double r = fabs(Fp[3 * i]) + fabs(Fp[3 * i + 1]) + fabs(Fp[3 * i + 2]);
      double q = fabs(Fp[i]) + fabs(Fp[3 + i]) + fabs(Fp[6 + i]);
      rows = r > rows ? r : rows;
      columns = q > columns ? q : columns;
      C.x[i] = c[i];
    }
    for (int i = 0; i < 9; i++) C.F[i] = (float)Fp[i];
    C.reach = (float)(0.5 * cbrt(volume));
    C.stretch = (float)(sqrt(rows * columns) * 1.000001);   // no direction stretches more
    C.field = f;
    for (int i = 0; i < 3; i++) C.x[i] -= base[i];
  }
  static inline void add(Meet &M, int f, const float *v, double dx) {
    int q = 0;
    while (q < M.count && M.field[q] != f) q++;
    if (q == M.count) return;
    M.m[q] += v[0];
    for (int d = 0; d < 3; d++) {
      M.mean[q][d] += v[1 + d] * dx;
      M.out[q][d] += v[4 + d];
    }
  }
};
alignas(64) f8 arena[512];
for (int f = 0; f < fields && nm && !world->full; f++) {
  Field &F = world->field[f];
  if (F.rigids) {
    for (int e = 0; e < F.blocks; e++) {
      const double *p = F.point + 5 * F.block[e];
      double c[3], w[3][3], g[3][3];
      int base[3], several = 0;
      for (int i = 0; i < 3; i++) {
        c[i] = (F.rigid[CENTRE + i] + Vec::dot(F.rigid + TURN + 3 * i, p)) * inv - 4.0 * F.origin[i];
        base[i] = Vec::floor_int(c[i] - 0.5);
        double fr = c[i] - base[i];
        w[i][0] = 0.5 * (1.5 - fr) * (1.5 - fr);
        w[i][1] = 0.75 - (fr - 1) * (fr - 1);
        w[i][2] = 0.5 * (fr - 0.5) * (fr - 0.5);
        g[i][0] = (fr - 1.5) * inv;
        g[i][1] = -2 * (fr - 1) * inv;
        g[i][2] = (fr - 0.5) * inv;
      }
      if (nc >= world->most_nears) {
        world->full = 1;
        break;
      }
      Close &C = closes[nc];
      C.count = 0;
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          for (int k = 0; k < 3; k++) {
            int X = base[0] + i, Y = base[1] + j, Z = base[2] + k;
            int pool = Grid::block(F, X >> 2, Y >> 2, Z >> 2);
            if (X < 0 || Y < 0 || Z < 0 || pool < 0) continue;
            int id = (int)F.node[((size_t)pool * 64 + (X & 3) * 16 + (Y & 3) * 4 + (Z & 3)) * 8 + 7];
            if (!id) continue;
            if (meets[id - 1].several) {
              several = 1;
              C.at[C.count] = 9 * i + 3 * j + k;
              C.id[C.count++] = id - 1;
            }
            double mw = p[3] * w[0][i] * w[1][j] * w[2][k];
            float v[7] = {(float)mw, (float)(mw * (c[0] - X)), (float)(mw * (c[1] - Y)),
                          (float)(mw * (c[2] - Z)), (float)(p[4] * g[0][i] * w[1][j] * w[2][k]),
                          (float)(p[4] * w[0][i] * g[1][j] * w[2][k]),
                          (float)(p[4] * w[0][i] * w[1][j] * g[2][k])};
            Look::add(meets[id - 1], f, v, dx);
          }
      if (!several) continue;
      Look::close(C, f, c, base, F.rigid + TURN, p[4]);
      nc++;
    }
    continue;
  }
  const float slope = (float)inv;
  for (int b = 0; b < F.blocks && !world->full; b++) {
    const int *record = F.block + NB * b;
    u64 any = 0;
    for (int i = 0; i < 27; i++) any |= F.near[2 * record[5 + i]];
    if (!any) continue;
    for (int i = 0; i < 512; i++) arena[i] = Simd::all(0.0f);
    int used = 0;
    for (int s = record[0]; s < record[1]; s += 8) {
      const float *q = F.part + (size_t)s * NC;
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
      for (int l = 0; l < live; l++) {
        int x = low[0][l], y = low[1][l], z = low[2][l];
        const int *near = record + 5 + (((x >> 2) - record[2] + 1) * 3 + (y >> 2) - record[3] + 1) * 3 +
                          (z >> 2) - record[4] + 1;
        int bit = (x & 3) * 16 + (y & 3) * 4 + (z & 3);
        lanes |= (int)(F.near[2 * *near] >> bit & 1) << l;
        several |= (int)(F.near[2 * *near + 1] >> bit & 1) << l;
      }
      if (!lanes) continue;
      used = 1;
      // Lanes of a node: mass, mass times offset 3, outward gradient of volume 3.
      f8 H[9], w[3][3], g[3][3], fr[3], r[8], W[3][3][8];
      for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
      H[0] += 1.0f;
      H[4] += 1.0f;
      H[8] += 1.0f;
      f8 V = *(f8u *)(q + 8 * VO) * (H[0] * (H[4] * H[8] - H[5] * H[7]) -
                                     H[1] * (H[3] * H[8] - H[5] * H[6]) +
                                     H[2] * (H[3] * H[7] - H[4] * H[6]));
      f8 m = *(f8u *)(q + 8 * MA), zero = Simd::all(0.0f);
      r[0] = m;
      r[7] = zero;
      for (int d = 0; d < 3; d++) {
        fr[d] = Simd::flo(*(i8u *)(q + 8 * (XI + d)) - (cell[d] << PLACE)) * PER_UNIT;
        Simd::spline(fr[d], w[d]);
        g[d][0] = (fr[d] - 1.5f) * slope;
        g[d][1] = (1.0f - fr[d]) * (2.0f * slope);
        g[d][2] = (fr[d] - 0.5f) * slope;
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
        if (!(several >> l & 1)) continue;
        if (nc >= world->most_nears) {
          world->full = 1;
          break;
        }
        double c[3], Fp[9];
        int base[3];
        Close &C = closes[nc++];
        C.count = 0;
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++) {
            int x = low[0][l] + i - 4 * record[2] + 4, y = low[1][l] + j - 4 * record[3] + 4,
                z = low[2][l] - 4 * record[4] + 4;
            const int *near = record + 5 + ((x >> 2) * 3 + (y >> 2)) * 3;
            size_t row = (x & 3) * 16 + (y & 3) * 4;
            for (int k = 0; k < 3; k++) {
              size_t slot = (size_t)near[(z + k) >> 2] * 64 + row + ((z + k) & 3);
              int id = (int)F.node[slot * 8 + 7];
              if (!id || !meets[id - 1].several) continue;
              C.at[C.count] = 9 * i + 3 * j + k;
              C.id[C.count++] = id - 1;
            }
          }
        for (int d = 0; d < 3; d++) {
          c[d] = ((const int *)q)[8 * (XI + d) + l] * (1.0 / UNIT);
          base[d] = low[d][l];
        }
        for (int k = 0; k < 9; k++) Fp[k] = H[k][l];
        Look::close(C, f, c, base, Fp, q[8 * VO + l]);
      }
    }
    if (!used) continue;
    for (int i = 0; i < 8; i++)
      for (int j = 0; j < 8; j++) {
        const int *near = record + 5 + (((i + 3) >> 2) * 3 + ((j + 3) >> 2)) * 3;
        size_t row = ((i + 3) & 3) * 16 + ((j + 3) & 3) * 4;
        for (int k = 0; k < 8; k++) {
          const f8 &h = arena[i * 64 + j * 8 + k];
          if (!(h[0] > 0)) continue;
          float id = F.node[((size_t)near[(k + 3) >> 2] * 64 + row + ((k + 3) & 3)) * 8 + 7];
          if (id != 0.0f) Look::add(meets[(int)id - 1], f, (const float *)&h, dx);
        }
      }
  }
}
for (int k = 0; k < nm; k++) {     // wipe the marks, whatever happened
  Meet &M = meets[k];
  for (int q = 0; q < M.count; q++) {
    Field &F = world->field[M.field[q]];
    int x = M.at[0] - 4 * F.origin[0], y = M.at[1] - 4 * F.origin[1], z = M.at[2] - 4 * F.origin[2];
    for (int i = (x - 2) >> 2; i <= x >> 2; i++)
      for (int j = (y - 2) >> 2; j <= y >> 2; j++)
        for (int l = (z - 2) >> 2; l <= z >> 2; l++) {
          int b = Grid::block(F, i, j, l);
          if (b >= 0) F.near[2 * b] = F.near[2 * b + 1] = 0;
        }
  }
}
world->contacts = nm;
world->pairs = nt;
world->nears = nc;
if (world->full) return;

// ---- normals: the separating axis among three, smoothed over neighbours
for (int k = 0; k < nm; k++)
  for (int q = 0; q < meets[k].count; q++)
    for (int d = 0; d < 3; d++)
      if (meets[k].m[q] > 0) meets[k].mean[q][d] /= meets[k].m[q];
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  if (T.c < 0) continue;
  Meet &M = meets[T.meet];
  for (int d = 0; d < 3; d++) {
    T.candidate[0][d] = M.out[T.a][d] - M.out[T.c][d];
    T.candidate[1][d] = M.out[T.a][d];
    T.candidate[2][d] = -M.out[T.c][d];
  }
  for (int q = 0; q < 3; q++) Vec::unit(T.candidate[q]);
}
for (int p = 0; p < nc; p++) {
  Close &C = closes[p];
  for (int e = 0; e < C.count; e++) {
    int i = C.at[e];
    Meet &M = meets[C.id[e]];
    double r[3] = {(C.x[0] - i / 9) * dx, (C.x[1] - i / 3 % 3) * dx, (C.x[2] - i % 3) * dx};
    for (int t = M.first; t < M.last; t++) {
      Touch &T = touches[t];
      if (T.c < 0 || (T.fa != C.field && T.fc != C.field)) continue;
      bool first = T.fa == C.field;
      for (int q = 0; q < 3; q++) {
        const double *n = T.candidate[q];
        double h = Vec::dot(r, n), most = C.reach * C.stretch;
        if (first ? h + most <= T.far_a[q] : h - most >= T.far_c[q]) continue;
        double a0 = C.F[0] * n[0] + C.F[3] * n[1] + C.F[6] * n[2];
        double a1 = C.F[1] * n[0] + C.F[4] * n[1] + C.F[7] * n[2];
        double a2 = C.F[2] * n[0] + C.F[5] * n[1] + C.F[8] * n[2];
        double R = C.reach * sqrt(a0 * a0 + a1 * a1 + a2 * a2);
        if (first) {
          if (h + R > T.far_a[q]) T.far_a[q] = h + R;
        } else if (h - R < T.far_c[q]) {
          T.far_c[q] = h - R;
        }
      }
    }
  }
}
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  if (T.c < 0) continue;
  double best = -1e300;
  int pick = 0;
  for (int q = 0; q < 3; q++) {
    const double *n = T.candidate[q];
    if (n[0] == 0 && n[1] == 0 && n[2] == 0) continue;
    double wide = T.far_c[q] - T.far_a[q] + (q == 0 ? 0.1 : 0.05) * dx;
    if (wide > best) best = wide, pick = q;
  }
  for (int d = 0; d < 3; d++) T.chosen[d] = T.candidate[pick][d];
}
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  if (T.c < 0) continue;
  Meet &M = meets[T.meet];
  Field &F = world->field[T.fa];
  double sum[3] = {0, 0, 0};
  for (int i = 0; i < 27; i++) {
    int node[3] = {M.at[0] + i / 9 - 1, M.at[1] + i / 3 % 3 - 1, M.at[2] + i % 3 - 1};
    int slot = Grid::slot(F, node);
    if (slot < 0) continue;
    int id = (int)F.node[(size_t)slot * 8 + 7];
    if (!id) continue;
    Meet &O = meets[id - 1];
    for (int o = O.first; o < O.last; o++) {
      Touch &U = touches[o];
      if (U.fa != T.fa || U.fc != T.fc) continue;
      double a = O.m[U.a], c = O.m[U.c], weight = a < c ? a : c;
      for (int d = 0; d < 3; d++) sum[d] += weight * U.chosen[d];
    }
  }
  Vec::unit(sum);
  for (int d = 0; d < 3; d++) T.n[d] = sum[d];
}

// ---- gaps
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  Meet &M = meets[T.meet];
  T.gap = 1e30;
  if (!(M.m[T.a] > 0) || (T.n[0] == 0 && T.n[1] == 0 && T.n[2] == 0)) continue;
  double pa = Vec::dot(M.mean[T.a], T.n) * inv;
  if (T.c < 0) {
    const double *P = world->plane + 4 * (-1 - T.c);
    double h = (Vec::dot(P, T.x) - P[3]) * inv;
    T.gap = (-Face::mean(-h) - pa - Face::touching(h)) * dx;
  } else if (M.m[T.c] > 0) {
    double pc = Vec::dot(M.mean[T.c], T.n) * inv;
    double s = 0.5 * (Face::face(world->face, pa) - Face::face(world->face, -pc));
    T.gap = (pc - pa - Face::touching(s)) * dx;
  }
}

// ---- rigid bodies against planes: their surface points
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  if (!F.rigids || !F.surfaces) continue;
  const double *s = F.rigid;
  for (int w = 0; w < planes; w++) {
    const double *P = world->plane + 4 * w;
    if (Vec::dot(P, s + CENTRE) - P[3] > s[RADIUS] + POINT_REACH * dx) continue;
    for (int p = 0; p < F.surfaces; p++) {
      double x[3];
      for (int i = 0; i < 3; i++) x[i] = s[CENTRE + i] + Vec::dot(s + TURN + 3 * i, F.surface + 3 * p);
      double gap = Vec::dot(P, x) - P[3];
      if (gap >= POINT_REACH * dx) continue;
      if (nt >= world->most_pairs) {
        world->full = 1;
        world->pairs = nt;
        return;
      }
      Touch &T = touches[nt++];
      T.meet = -1;
      T.a = 0;
      T.c = -1 - w;
      T.fa = f;
      T.fc = fields + w;
      T.gap = gap;
      for (int d = 0; d < 3; d++) {
        T.x[d] = x[d];
        T.n[d] = -P[d];
      }
    }
  }
}
world->pairs = nt;

// ---- impulses
Bonds::join(world);
struct Solver {
  static inline void velocity(World *w, Meet *meets, const Touch &T, int side, double *v) {
    int f = side ? T.fc : T.fa, q = side ? T.c : T.a;
    if (f >= w->fields) {
      v[0] = v[1] = v[2] = 0;
    } else if (w->field[f].rigids) {
      Body6::velocity(w->field[f].rigid, T.x, v);
    } else {
      for (int i = 0; i < 3; i++) v[i] = meets[T.meet].v[q][i];
    }
  }
  static inline void slip(World *w, Meet *meets, const Touch &T, double *u) {
    double c[3];
    velocity(w, meets, T, 0, u);
    velocity(w, meets, T, 1, c);
    for (int i = 0; i < 3; i++) u[i] -= c[i];
  }
  // Relative velocity as the step began, before its forces: what friction's work is booked with.
  static inline void before(World *w, Meet *meets, const Touch &T, double *u) {
    for (int i = 0; i < 3; i++) u[i] = 0;
    for (int side = 0; side < 2; side++) {
      int f = side ? T.fc : T.fa, q = side ? T.c : T.a;
      if (f >= w->fields) continue;
      const Field &F = w->field[f];
      double v[3], sign = side ? -1.0 : 1.0;
      if (F.rigids) {
        Body6::velocity(F.rigid, T.x, v);
        for (int i = 0; i < 3; i++) v[i] -= F.rigid[KICK + i];
      } else {
        for (int i = 0; i < 3; i++) v[i] = F.node[(size_t)meets[T.meet].slot[q] * 8 + 4 + i];
      }
      for (int i = 0; i < 3; i++) u[i] += sign * v[i];
    }
  }
  static inline double softness(World *w, Meet *meets, const Touch &T, const double *n) {
    double sum = 0;
    for (int side = 0; side < 2; side++) {
      int f = side ? T.fc : T.fa, q = side ? T.c : T.a;
      if (f >= w->fields) continue;
      if (w->field[f].rigids)
        sum += Body6::softness(w->field[f].rigid, T.x, n);
      else
        sum += 1.0 / w->field[f].node[(size_t)meets[T.meet].slot[q] * 8];
    }
    return sum;
  }
  // One projection of one contact onto its Coulomb cone; by how much it changed the velocity.
  static inline double relax(World *w, Meet *meets, Touch &T) {
    double u[3], d[3], t[3];
    slip(w, meets, T, u);
    double un = Vec::dot(u, T.n), old = Vec::dot(T.J, T.n);
    double jn = old + (un - T.target) / T.inverse;
    if (jn <= 0) {
      if (old == 0) return 0;
      jn = 0;
    }
    for (int i = 0; i < 3; i++) {
      d[i] = u[i] - un * T.n[i];
      t[i] = T.J[i] - old * T.n[i];
    }
    double size = sqrt(Vec::dot(d, d));
    if (size > 1e-14) {
      double soft = T.inverse;
      if (T.stiff) {
        double e[3] = {d[0] / size, d[1] / size, d[2] / size};
        soft = softness(w, meets, T, e);
      }
      for (int i = 0; i < 3; i++) t[i] += d[i] / soft;
    }
    double length = sqrt(Vec::dot(t, t));
    if (length > T.mu * jn) {
      double scale = T.mu * jn / length;
      for (int i = 0; i < 3; i++) t[i] *= scale;
    }
    for (int i = 0; i < 3; i++) {
      double next = jn * T.n[i] + t[i];
      d[i] = next - T.J[i];
      T.J[i] = next;
    }
    for (int side = 0; side < 2; side++) {
      int f = side ? T.fc : T.fa, q = side ? T.c : T.a;
      if (f >= w->fields) continue;
      double sign = side ? 1.0 : -1.0, J[3] = {sign * d[0], sign * d[1], sign * d[2]};
      if (w->field[f].rigids) {
        Body6::hit(w->field[f].rigid, T.x, J);
      } else {
        double im = 1.0 / w->field[f].node[(size_t)meets[T.meet].slot[q] * 8];
        for (int i = 0; i < 3; i++) meets[T.meet].v[q][i] += im * J[i];
      }
    }
    return sqrt(Vec::dot(d, d)) * T.inverse;
  }
};
double *scratch = world->ledger;      // [all][all][8]: hit, normal sum, weighted place 3
for (int i = 0; i < all * all * 8; i++) scratch[i] = 0;
int hits = 0, stacked = 0;
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  T.active = T.gap < 1e29;
  if (!T.active) continue;
  double u[3];
  Solver::slip(world, meets, T, u);
  for (int i = 0; i < 3; i++) {
    T.J[i] = 0;
  }
  Solver::before(world, meets, T, T.before);
  int ra = world->field[T.fa].rigids, rc = T.fc < fields ? world->field[T.fc].rigids : 1;
  T.stiff = ra || (T.fc < fields && rc);
  T.mu = world->friction[T.fa * all + T.fc];
  T.inverse = Solver::softness(world, meets, T, T.n);
  T.target = (T.gap > 0 ? T.gap : 0.0) / dt;
  T.bounce = 0;
  double un = Vec::dot(u, T.n), e = world->restitution[T.fa * all + T.fc];
  if (T.stiff) stiff_any = 1;
  // What neither closes now nor shares a body with others that may push it: leave it out.
  if (!T.stiff && T.meet >= 0 && meets[T.meet].last - meets[T.meet].first == 1 && un <= T.target)
    T.active = 0;
  if (ra && rc && T.fc < fields) stacked = 1;
  if (!(ra && rc) || e <= 0) continue;
  double kick[3] = {0, 0, 0};
  for (int i = 0; i < 3; i++) {
    kick[i] = world->field[T.fa].rigid[KICK + i];
    if (T.fc < fields) kick[i] -= world->field[T.fc].rigid[KICK + i];
  }
  double before = un - Vec::dot(kick, T.n);
  if (before <= SLOWEST) continue;
  bool closing = un * dt > T.gap;
  T.approach = before;
  T.bounce = closing || T.gap < PATCH * dx;
  if (closing) {
    scratch[(T.fa * all + T.fc) * 8] = 1;
    hits = 1;
  }
}
if (hits)
  for (int t = 0; t < nt; t++) {
    Touch &T = touches[t];
    if (T.active && T.bounce && scratch[(T.fa * all + T.fc) * 8] > 0)
      T.target = -world->restitution[T.fa * all + T.fc] * T.approach;
  }
// Rigid bodies on one another have only each other to yield: with few sweeps stacks creep.
int sweeps = hits || stacked ? 100 : 10;
for (int k = 0; k < nm; k++) {
  if (meets[k].stiff) continue;
  for (int s = 0; s < 10; s++) {
    bool moved = false;
    for (int t = meets[k].first; t < meets[k].last; t++)
      if (touches[t].active && Solver::relax(world, meets, touches[t]) > 0) moved = true;
    if (!moved || meets[k].last - meets[k].first == 1) break;
  }
}
if (stiff_any) {
  // The rest in one list: pairs of bodies, then bodies on planes, then their surface points.
  int *order = world->order, n = 0;
  for (int pass = 0; pass < 2; pass++) {
    double place = 0;
    for (int kind = 0; kind < 3 && pass; kind++)
      for (int i = 0; i < all * all; i++) {
        double next = place + scratch[8 * i + 5 + kind];
        scratch[8 * i + 5 + kind] = place;
        place = next;
      }
    for (int t = 0; t < nt; t++) {
      Touch &T = touches[t];
      if (!T.active || (T.meet >= 0 && !meets[T.meet].stiff)) continue;
      int kind = T.meet < 0 ? 2 : T.fc >= fields ? 1 : 0;
      double *row = scratch + (T.fa * all + T.fc) * 8 + 5 + kind;
      if (pass)
        order[(int)*row] = t;
      else
        n++;
      *row += 1;
    }
  }
  // After ten sweeps, what is left may creep by a few thousandths of a cell per second.
  double fine = 2e-3 * dx;
  for (int s = 0; s < sweeps; s++) {
    double most = 0;
    // Contacts of two rigid bodies go forwards, then backwards: with one order for all sweeps the
    // first would carry more, and stacks creep to one side. So do the planes below a stack; a lone
    // block on a plane, which has few sweeps, would creep if they turned about.
    for (int first = 0, last; first < n; first = last) {
      Touch &F = touches[order[first]];
      bool turned = s & 1 && world->field[F.fa].rigids &&
                    (F.fc < fields ? world->field[F.fc].rigids : stacked);
      for (last = first; last < n; last++) {
        Touch &T = touches[order[last]];
        if (T.fa != F.fa || T.fc != F.fc || (T.meet < 0) != (F.meet < 0)) break;
      }
      for (int i = first; i < last; i++) {
        Touch &T = touches[order[turned ? first + last - 1 - i : i]];
        double change = Solver::relax(world, meets, T);
        if (change > most) most = change;
      }
    }
    if (most == 0 || (s >= 10 && most < fine)) break;
  }
}

// ---- write back, and enter the books
for (int k = 0; k < nm; k++)
  for (int q = 0; q < meets[k].count; q++) {
    Field &F = world->field[meets[k].field[q]];
    if (F.rigids) continue;
    float *node = F.node + (size_t)meets[k].slot[q] * 8;
    for (int i = 0; i < 3; i++) node[1 + i] = (float)meets[k].v[q][i];
  }
double loss = 0;
for (int t = 0; t < nt; t++) {
  Touch &T = touches[t];
  if (!T.active) continue;
  double jn = Vec::dot(T.J, T.n);
  if (jn <= 0) continue;
  double u[3];
  Solver::slip(world, meets, T, u);
  for (int i = 0; i < 3; i++) loss += (T.J[i] - jn * T.n[i]) * 0.5 * (T.before[i] + u[i]);
  double *row = scratch + (T.fa * all + T.fc) * 8;
  row[1] += jn;
  for (int i = 0; i < 3; i++) row[2 + i] += jn * T.x[i];
  if (T.fc >= fields)
    for (int i = 0; i < 3; i++) world->plane_impulse[((T.fc - fields) * books + T.fa) * 3 + i] -= T.J[i];
}
*world->friction_loss += loss;
for (int a = 0; a < fields; a++)
  for (int c = a + 1; c < all; c++) {
    double *row = scratch + (a * all + c) * 8;
    if (row[1] <= 0) continue;
    if (c < fields) {
      world->pair_impulse[a * books + c] += row[1];
      world->pair_impulse[c * books + a] = world->pair_impulse[a * books + c];
    }
    // In the books planes come after the bodies, which share one field in the control.
    int name = c < fields ? c : books + c - fields;
    for (int side = 0; side < 2; side++) {
      int i = side ? name * world->names + a : a * world->names + name;
      if (!(world->first_contact[i] >= 0)) {
        world->first_contact[i] = world->time;
        for (int d = 0; d < 3; d++) world->contact_point[3 * i + d] = row[2 + d] / row[1];
      }
      world->last_contact[i] = world->time;
    }
  }

Bonds::part(world);

// ---- rigid bodies move; the angular momentum is exact, the turn follows it at mid-step
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  if (!F.rigids) continue;
  double *s = F.rigid, half[9], w[3], Q[9];
  Body6::turn(s, s + SPIN, 0.5 * dt, half);
  Body6::spin_up(s, half, w);
  Body6::turn(s, w, dt, Q);
  // One step of Gram-Schmidt keeps it a rotation.
  Vec::unit(Q);
  double d = Vec::dot(Q, Q + 3);
  for (int i = 0; i < 3; i++) Q[3 + i] -= d * Q[i];
  Vec::unit(Q + 3);
  Vec::cross(Q, Q + 3, Q + 6);
  for (int i = 0; i < 9; i++) s[TURN + i] = Q[i];
  Body6::spin_up(s, Q, s + SPIN);
  for (int i = 0; i < 3; i++) s[CENTRE + i] += dt * s[SPEED + i];
}
