// Normals smoothed over neighbours, gaps, and the impulses of nodes that move no rigid body; those
// are independent of one another. A part: some blocks of nodes.
struct Solver {
  static inline double gap(const World *w, const Side *sides, const Touch &T, double inv) {
    const double *n = T.normal;
    const Side &A = sides[T.a];
    double pa = A.mean[0] * n[0] + A.mean[1] * n[1] + A.mean[2] * n[2];
    if (T.c < 0) {
      const double *P = w->plane + 4 * (-1 - T.c);
      double h = (Vec::dot(P, T.x) - P[3]) * inv;
      return -Face::mean(-h) - pa - Face::touching(h);
    }
    const Side &C = sides[T.c];
    double pc = C.mean[0] * n[0] + C.mean[1] * n[1] + C.mean[2] * n[2];
    double s = 0.5 * (Face::face(w->face, pa) - Face::face(w->face, -pc));
    return pc - pa - Face::touching(s);
  }
  // Relative velocity as the step began, before its forces: what friction's work is booked with.
  static inline void before(const World *w, const Side *sides, const Touch &T, double *u) {
    for (int i = 0; i < 3; i++) u[i] = 0;
    for (int side = 0; side < (T.c < 0 ? 1 : 2); side++) {
      const Side &S = sides[side ? T.c : T.a];
      const Field &F = w->field[S.field];
      double v[3], sign = side ? -1.0 : 1.0;
      if (F.rigids) {
        Body6::velocity(F.rigid, T.x, v);
        for (int i = 0; i < 3; i++) v[i] -= F.rigid[KICK + i];
      } else {
        for (int i = 0; i < 3; i++) v[i] = F.node[(size_t)S.slot * 8 + 4 + i];
      }
      for (int i = 0; i < 3; i++) u[i] += sign * v[i];
    }
  }
  static inline void slip(const Side *sides, const Touch &T, double *u) {
    for (int i = 0; i < 3; i++) u[i] = sides[T.a].v[i] - (T.c < 0 ? 0.0 : sides[T.c].v[i]);
  }
  // One projection of one contact onto its Coulomb cone; whether it changed anything.
  static inline bool relax(Side *sides, Touch &T) {
    double u[3], d[3], t[3];
    slip(sides, T, u);
    double un = Vec::dot(u, T.normal), old = Vec::dot(T.J, T.normal);
    double jn = old + (un - T.target) / T.inverse;
    if (jn <= 0) {
      if (old == 0) return false;
      jn = 0;
    }
    for (int i = 0; i < 3; i++) {
      d[i] = u[i] - un * T.normal[i];
      t[i] = T.J[i] - old * T.normal[i] + d[i] / T.inverse;
    }
    double length = sqrt(Vec::dot(t, t));
    double scale = length > T.mu * jn ? T.mu * jn / length : 1.0;
    bool moved = false;
    for (int i = 0; i < 3; i++) {
      double next = jn * T.normal[i] + scale * t[i];
      d[i] = next - T.J[i];
      moved |= d[i] != 0;
      T.J[i] = next;
      sides[T.a].v[i] -= sides[T.a].inverse * d[i];
      if (T.c >= 0) sides[T.c].v[i] += sides[T.c].inverse * d[i];
    }
    return moved;
  }
};
// Normals of some pairs of fields, weighted by their masses, added up over the 27 nodes around each
// node of a block: one axis after the other.
struct Smooth {
  enum { MOST = 8 };
  f4 grid[MOST][216];        // of the block and one layer around; then sums, of the block
  u64 pair[MOST];
  int pairs = 0, last = 0;   // last: what was found last, and is likely to be looked for next
  static inline u64 key(int a, int c) { return (u64)(unsigned)c << 32 | (unsigned)a; }
  inline int find(u64 which) {
    for (int k = 0; k < pairs; k++) {
      if (pair[last] == which) return last;
      last = last + 1 < pairs ? last + 1 : 0;
    }
    return pairs;
  }
  static inline void sum(const f4 *from, f4 *to, int rows, int step, int inner) {
    for (int r = 0; r < rows; r++)
      for (int k = 0; k < 4; k++)
        for (int i = 0; i < inner; i++) {
          const f4 *g = from + (r * step + k) * inner + i;
          to[(r * 4 + k) * inner + i] = g[0] + g[inner] + g[2 * inner];
        }
  }
  inline void up() {
    f4 z[144], y[96];
    for (int p = 0; p < pairs; p++) {
      sum(grid[p], z, 36, 6, 1);
      sum(z, y, 6, 6, 4);
      sum(y, grid[p], 1, 6, 16);
    }
  }
};
const int from = (int)((long long)stage->junctions * index / PARTS),
          to = (int)((long long)stage->junctions * (index + 1) / PARTS);
int entries = 0;
if (from < to) {
  Entry *book = stage->entry + junctions[from].touch;
  for (int j = from; j < to; j++) {
    const Junction &J = junctions[j];
    const int end = J.meet + Grid::count(J.mask);
    for (int begun = J.touch; begun < J.last && J.several;) {
      Smooth smooth;
      int t = begun;
      for (; t < J.last; t++) {
        const Touch &T = touches[t];
        const int p = T.c < 0 ? 0 : smooth.find(Smooth::key(T.fa, T.fc));
        if (T.c < 0 || p < smooth.pairs) continue;
        if (p == Smooth::MOST) break;
        smooth.pair[smooth.pairs++] = Smooth::key(T.fa, T.fc);
        for (int i = 0; i < 216; i++) smooth.grid[p][i] = f4{0, 0, 0, 0};
      }
      for (int n = 0; n < 27; n++) {
        int at[3] = {J.at[0] + n / 9 - 1, J.at[1] + n / 3 % 3 - 1, J.at[2] + n % 3 - 1}, other = 0;
        for (int q = 0; q < J.fields && !other; q++) {
          int b = Grid::block(world->field[J.field[q]], at);
          if (b >= 0) other = world->field[J.field[q]].where[4 * b + 3];
        }
        if (!other) continue;
        const Junction &O = junctions[other - 1];
        int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
        for (u64 left = O.several & Grid::margin(n); left; left &= left - 1) {
          int i = __builtin_ctzll(left);
          const Meet &M = meets[Grid::meet(O, i)];
          const int place = ((x + (i >> 4)) * 6 + y + (i >> 2 & 3)) * 6 + z + (i & 3);
          for (int o = M.touch; o < M.touch + M.touches; o++) {
            const Aim &U = aims[o];
            const int p = smooth.find(Smooth::key(U.fa, U.fc));
            if (p == smooth.pairs) continue;
            smooth.grid[p][place] = U.weight * f4{U.chosen[0], U.chosen[1], U.chosen[2], 0};
          }
        }
      }
      smooth.up();
      for (int s = begun; s < t; s++) {
        Touch &T = touches[s];
        if (T.c < 0) continue;
        const int *at = meets[T.meet].at;
        const f4 &sum = smooth.grid[smooth.find(Smooth::key(T.fa, T.fc))][(at[0] & 3) * 16 + (at[1] & 3) * 4 +
                                                             (at[2] & 3)];
        for (int d = 0; d < 3; d++) T.normal[d] = sum[d];
      }
      begun = t;
    }
    for (int k = J.meet; k < end; k++) {
      Meet &M = meets[k];
      int active = 0;
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        Touch &T = touches[t];
        for (int d = 0; d < 3; d++) {
          T.x[d] = M.at[d] * dx;
          T.J[d] = 0;
        }
        T.active = T.bounce = 0;
        if (T.c < 0) {
          for (int d = 0; d < 3; d++) T.normal[d] = -world->plane[4 * (-1 - T.c) + d];
        } else if (Vec::unit(T.normal) <= 1e-30) {
          continue;
        }
        double u[3];
        Solver::slip(sides, T, u);
        if (M.touches == 1 && !M.stiff && Vec::dot(u, T.normal) <= 0) continue;
        T.gap = Solver::gap(world, sides, T, inv) * dx;
        T.target = (T.gap > 0 ? T.gap : 0.0) / dt;
        T.mu = world->friction[T.fa * all + T.fc];
        T.active = 1;
        if (M.stiff) continue;
        T.inverse = sides[T.a].inverse + (T.c < 0 ? 0.0 : sides[T.c].inverse);
        if (M.touches == 1) T.active = Vec::dot(u, T.normal) > T.target;
        active += T.active;
      }
      if (!active) continue;
      for (int s = 0; s < (M.touches == 1 ? 1 : 10); s++) {
        bool moved = false;
        for (int t = M.touch; t < M.touch + M.touches; t++)
          if (touches[t].active && Solver::relax(sides, touches[t])) moved = true;
        if (!moved) break;
      }
      for (int s = M.side; s < M.side + M.sides; s++) {
        float *node = world->field[sides[s].field].node + (size_t)sides[s].slot * 8;
        for (int i = 0; i < 3; i++) node[1 + i] = (float)sides[s].v[i];
      }
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        const Touch &T = touches[t];
        double jn = T.active ? Vec::dot(T.J, T.normal) : 0.0;
        if (jn <= 0) continue;
        int e = entries - 1, last = entries > ENTRIES ? entries - ENTRIES : 0;
        while (e >= last && (book[e].a != T.fa || book[e].c != T.fc)) e--;
        if (e < last) {
          e = entries++;
          book[e] = Entry{T.fa, T.fc, 0, {0, 0, 0}, {0, 0, 0}, 0};
        }
        double u[3], was[3];
        Solver::slip(sides, T, u);
        Solver::before(world, sides, T, was);
        book[e].normal += jn;
        for (int i = 0; i < 3; i++) {
          book[e].place[i] += jn * T.x[i];
          book[e].J[i] += T.J[i];
          book[e].loss += (T.J[i] - jn * T.normal[i]) * 0.5 * (was[i] + u[i]);
        }
      }
    }
  }
}
stage->entries[index] = entries;
