// Normals smoothed over neighbours, gaps, and the impulses of nodes that move no rigid body; those
// are independent of one another. A part: some blocks of nodes.
struct Solver {
  // Mass of a node over that of a full cell.
  static inline double filled(const World *w, const Side &S) { return S.m / w->field[S.field].full; }
  static inline double gap(const World *w, const Side *sides, const Touch &T, double inv) {
    const double *n = T.normal;
    const Side &A = sides[T.a];
    double pa = A.mean[0] * n[0] + A.mean[1] * n[1] + A.mean[2] * n[2];
    if (T.c < 0) {
      const double *P = w->plane + 4 * (-1 - T.c);
      double h = (Vec::dot(P, T.x) - P[3]) * inv;
      if (Grid::slides(w, A.field, -1 - T.c)) return Face::gap_of_liquid(pa, h, filled(w, A));
      if (w->field[A.field].is_shell) return shell_gap_to_plane(w, T, A, h);
      return Face::gap_to_surface(pa, h);
    }
    const Side &C = sides[T.c];
    double pc = C.mean[0] * n[0] + C.mean[1] * n[1] + C.mean[2] * n[2];
    const Field &F = w->field[A.field], &G = w->field[C.field];
    if (liquid(F, G)) {
      const double mean = F.rigids ? -pc : pa, h = T.gap * inv, full = filled(w, F.rigids ? C : A);
      return T.mu < mpm::STICKING_FRICTION ? Face::gap_of_liquid(mean, h, full) : Face::gap_to_surface(mean, h);
    }
    if (F.is_shell || G.is_shell) return shell_gap(w, sides, T, inv);
    if (!F.thin && !G.thin) {
      const double apart = Face::gap(w->face, pa, pc);
      const bool flat = F.flat && G.flat && apart <= mpm::FLAT_BODY_GAP_DX;
      if (!flat && !thin_there(w, F, G, T)) return apart;
    }
    const double sa = F.surfaces ? -begins(w, F, T.x, n, -inv) : 0, sc = G.surfaces ? begins(w, G, T.x, n, inv) : 0;
    if (!F.surfaces) return Face::gap_to_thin(pa, sc);
    return G.surfaces ? sc - sa : Face::gap_to_thin(-pc, -sa);
  }
  static inline double along(const Side &S, const double *n) { return S.mean[0] * n[0] + S.mean[1] * n[1] + S.mean[2] * n[2]; }
  // Where a shell ends along n, or against it for a negative sign, and how far its particles lie about their mean
  // along n: what the node of a side sees of it.
  static inline double shell_face(const World *w, const Side &S, int number, const double *n, double sign,
                                  double &deviation) {
    const Spread &P = ((const Stage *)w->contact_memory)->spread[number];
    const float *q = P.square;
    const double square = (q[0] * n[0] * n[0] + q[1] * n[1] * n[1] + q[2] * n[2] * n[2] +
                           2.0 * (q[3] * n[0] * n[1] + q[4] * n[0] * n[2] + q[5] * n[1] * n[2])) / S.m;
    const double mean = sign * along(S, n);
    deviation = sqrt(square > 0 ? square : 0.0);
    return Face::of_spread(w->spread_face, mean, deviation) + P.half_wall / S.m;
  }
  static inline double shell_gap_to_plane(const World *w, const Touch &T, const Side &A, double h) {
    double deviation;
    const double face = shell_face(w, A, T.a, T.normal, 1.0, deviation);
    return h > mpm::WALL_REACH && deviation > mpm::MAX_LAYER_DEVIATION_DX ? mpm::VAST : h - face;
  }
  // Open distance of two fields of which one is a shell, or both are.
  static inline double shell_gap(const World *w, const Side *sides, const Touch &T, double inv) {
    const double *n = T.normal;
    const Side &A = sides[T.a], &C = sides[T.c];
    const Field &F = w->field[A.field], &G = w->field[C.field];
    double deviation;
    const double sa = F.is_shell   ? shell_face(w, A, T.a, n, 1.0, deviation)
                      : F.surfaces ? -begins(w, F, T.x, n, -inv) : 0.0;
    const double sc = G.is_shell   ? -shell_face(w, C, T.c, n, -1.0, deviation)
                      : G.surfaces ? begins(w, G, T.x, n, inv) : 0.0;
    if (!F.is_shell && !F.surfaces) return Face::gap_to_thin(along(A, n), sc);
    return G.is_shell || G.surfaces ? sc - sa : Face::gap_to_thin(-along(C, n), -sa);
  }
  // Let the normal of a contact be that of the shells there, where they are layers across it.
  static inline void along_layers(const World *w, const Side *sides, Touch &T) {
    const int side[2] = {T.a, T.c};
    double sum[3] = {0, 0, 0}, n[3];
    for (int k = 0; k < 2; k++) {
      const Side &S = sides[side[k]];
      if (!w->field[S.field].is_shell) continue;
      mpm::LayerNormal::turn(((const Stage *)w->contact_memory)->spread[side[k]].square, S.m, T.normal, n);
      for (int i = 0; i < 3; i++) sum[i] += n[i];
    }
    Vec::unit(sum);
    for (int i = 0; i < 3; i++) T.normal[i] = sum[i];
  }
  // What is known of a contact of fields that deform, of which one is a shell: see Together.
  static inline void see_shell(const World *w, const Side *sides, Touch &T, double inv) {
    double u[3];
    along_layers(w, sides, T);
    slip(sides, T, u);
    T.target = Vec::dot(u, T.normal);
    T.gap = shell_gap(w, sides, T, inv) * w->dx;
  }
  // Whether a pair of a block's fields that deform holds a shell.
  static inline bool shell(const World *w, const Junction &J, const Pairs &pairs, int p) {
    return w->field[J.field[pairs.a[p]]].is_shell || w->field[J.field[pairs.c[p]]].is_shell;
  }
  // Whether two rigid bodies meet at a node where one of them is thin, though not as a whole.
  static inline bool thin_there(const World *w, const Field &F, const Field &G, const Touch &T) {
    if ((!F.slims && !G.slims) || !F.surfaces || !G.surfaces) return false;
    for (int side = 0; side < 2; side++) {
      const Field &B = side ? G : F;
      double q[3], d[3];
      inside(B, T.x, T.normal, q, d);
      if (mpm::Surface::thin_there(B.slim, B.slims, q, mpm::NODE_SIGHT_DX * w->dx)) return true;
    }
    return false;
  }
  // A place and a direction in a rigid body's frame.
  static inline void inside(const Field &F, const double *x, const double *n, double *q, double *d) {
    const double *s = F.rigid;
    double r[3];
    for (int i = 0; i < 3; i++) r[i] = x[i] - s[CENTRE + i];
    for (int i = 0; i < 3; i++) {
      q[i] = s[TURN + i] * r[0] + s[TURN + 3 + i] * r[1] + s[TURN + 6 + i] * r[2];
      d[i] = s[TURN + i] * n[0] + s[TURN + 3 + i] * n[1] + s[TURN + 6 + i] * n[2];
    }
  }
  // The flat faces of a side, from its node.
  static inline mpm::SeenFaces seen(const World *w, const Side &S, const double *x) {
    const Field &F = w->field[S.field];
    mpm::SeenFaces seen = {F.facet, F.facets, F.rigid + TURN, {}, {S.mean[0], S.mean[1], S.mean[2]}};
    double d[3];
    inside(F, x, x, seen.x, d);
    return seen;
  }
  // Where bodies of flat faces meet and the tilt of a node's normal causes a false approach, take that of the faces.
  static inline void along_faces(const World *w, const Side *sides, Touch &T) {
    double u[3], v[3];
    Body6::velocity(w->field[T.fa].rigid, T.x, u);
    Body6::velocity(w->field[T.fc].rigid, T.x, v);
    for (int i = 0; i < 3; i++) u[i] -= v[i];
    mpm::SeenFaces::along(seen(w, sides[T.a], T.x), seen(w, sides[T.c], T.x), u, w->dx, T.normal);
  }
  // How high the node of a liquid is over a wall [m]; 0 for what is no liquid.
  static inline double height(const World *w, const Touch &T) {
    if (T.choice >= 0) return 0.0;
    if (T.c >= 0) return liquid(w->field[T.fa], w->field[T.fc]) ? T.gap : 0.0;
    const double *P = w->plane + 4 * (-1 - T.c);
    return w->field[T.fa].pours ? Vec::dot(P, T.x) - P[3] : 0.0;
  }
  // Which side of a contact is a liquid that sticks to a wall, whose normal and height are known: 0: none.
  static inline int sticks(const World *w, const Touch &T) {
    if (T.choice >= 0) return 0;
    if (T.c < 0) return Grid::sticks(w, T.fa, T.fc) ? 1 : 0;
    if (!liquid(w->field[T.fa], w->field[T.fc])) return 0;
    return Grid::sticks(w, T.fa, T.fc) ? 1 : Grid::sticks(w, T.fc, T.fa) ? 2 : 0;
  }
  // Over what area and time such a wall drags on the node; 0 where the liquid does not touch it. h: of
  // the node over the wall [cells].
  static inline double span(const World *w, const Side *sides, const Touch &T, int side, double h) {
    const Side &S = sides[side == 1 ? T.a : T.c];
    const double sign = side == 1 ? 1.0 : -1.0;
    const double mean = sign * (S.mean[0] * T.normal[0] + S.mean[1] * T.normal[1] + S.mean[2] * T.normal[2]);
    if (h > mpm::LIQUID_WALL_REACH_DX || Face::gap_to_plane(mean, h) >= mpm::LIQUID_TOUCH_DX) return 0.0;
    return WallStress::span(S.m, w->field[S.field].full, h, w->dx, w->dt);
  }
  // Whether a liquid meets a rigid body with wetted points.
  static inline bool liquid(const Field &F, const Field &G) {
    return (F.patches && G.pours) || (G.patches && F.pours);
  }
  // Which of eight wetted points are as near to X as that: bits.
  static inline int close(const Field &F, int start, const double *X, double reach) {
    const float limit = (float)(reach * reach);
    f8 d = mpm::Lanes<f8>::all(0.0f);
    for (int i = 0; i < 3; i++) {
      f8 at;
      __builtin_memcpy(&at, F.places + (size_t)i * F.wets + start, sizeof at);
      at -= mpm::Lanes<f8>::all((float)X[i]);
      d += at * at;
    }
    return mpm::Lanes<f8>::which(d <= mpm::Lanes<f8>::all(limit));
  }
  // How high such a node lies over one of the body's faces, and along which normal they meet there;
  // the contacts before it are of the other faces. How many of them there are.
  static inline int wet(const World *w, const Side *sides, const double *x, const Touch &T, mpm::Wetted *face) {
    const Side &S = sides[w->field[T.fa].patches ? T.c : T.a];
    const Field &F = w->field[w->field[T.fa].patches ? T.fa : T.fc];
    const double *s = F.rigid;
    double y[3], X[3];   // the node and the liquid's place, in the body's frame
    for (int i = 0; i < 3; i++) {
      y[i] = X[i] = 0;
      for (int k = 0; k < 3; k++) {
        const double r = x[k] - s[CENTRE + k];
        y[i] += s[TURN + 3 * k + i] * r;
        X[i] += s[TURN + 3 * k + i] * (r + S.mean[k] * w->dx);
      }
    }
    mpm::NearWetted rows;
    rows.count = 0;
    const double reach = mpm::WETTED_REACH_DX * w->dx;
    for (int p = 0; p < F.patches; p++) {
      const double *patch = F.patch + 6 * p;
      if (mpm::Wetted::square(patch + 2, X) > (patch[5] + reach) * (patch[5] + reach)) continue;
      for (int start = (int)patch[0], end = (int)patch[1]; start < end; start += 8) {
        // Eight at once in single precision, which lets some more through than are near.
        int left = close(F, start, X, mpm::WETTED_SEARCH_FACTOR * reach);
        if (end - start < 8) left &= (1 << (end - start)) - 1;
        for (; left && rows.count < mpm::MAX_WETTED_POINTS; left &= left - 1) {
          const double *row = F.wetted_points + 6 * (start + __builtin_ctz(left));
          const double d = mpm::Wetted::square(row, X);
          if (d <= reach * reach) rows.add(row, d);
        }
      }
    }
    const int found = mpm::Wetted::faces(rows, y, X, w->dx, face);
    for (int f = 0; f < found; f++) {
      double n[3];
      for (int i = 0; i < 3; i++) n[i] = Vec::dot(s + TURN + 3 * i, face[f].normal);
      for (int i = 0; i < 3; i++) face[f].normal[i] = w->field[T.fa].patches ? n[i] : -n[i];
    }
    return found;
  }
  // Where a rigid body begins along n, or against it for a negative scale; in cells.
  static inline double begins(const World *w, const Field &F, const double *x, const double *n,
                              double scale) {
    double q[3], d[3];
    inside(F, x, n, q, d);
    for (int i = 0; i < 3 && scale < 0; i++) d[i] = -d[i];
    Runs runs = {F, q, d, mpm::SURFACE_SEARCH_RADIUS_DX * w->dx, mpm::NODE_SIGHT_DX * w->dx, 0, 0};
    return mpm::Surface::begins(runs) * (scale < 0 ? -scale : scale);
  }
  // Relative velocity at the begin of the step, before its forces: friction's work in the ledger is computed with it.
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
  // Flow curve of the liquid of a contact, at its wall.
  static inline const mpm::FlowCurve &flows(const World *w, const Touch &T) {
    return *(const mpm::FlowCurve *)w->field[T.c >= 0 && w->field[T.fc].pours ? T.fc : T.fa].flows_by;
  }
  // One projection of one contact onto its Coulomb cone; whether it changed anything.
  static inline bool relax(const World *w, Side *sides, Touch &T) {
    double u[3], d[3], t[3], next[3];
    slip(sides, T, u);
    double un = Vec::dot(u, T.normal), old = Vec::dot(T.J, T.normal);
    if (un <= T.target && old == 0 && T.span == 0) return false;   // as below, but without a division to wait for
    double jn = Coulomb::push(old, un, T.target, T.inverse);
    if (jn == 0 && old == 0 && T.span == 0) return false;
    for (int i = 0; i < 3; i++) {
      d[i] = u[i] - un * T.normal[i];
      t[i] = T.J[i] - old * T.normal[i] + d[i] / T.inverse;
    }
    if (T.span > 0)
      WallStress::drag(T.inverse, T.span, flows(w, T), jn, T.normal, t, next);
    else
      Coulomb::limit(T.mu, jn, T.normal, t, next);
    bool moved = false;
    for (int i = 0; i < 3; i++) {
      d[i] = next[i] - T.J[i];
      moved |= d[i] != 0;
      T.J[i] = next[i];
      sides[T.a].v[i] -= sides[T.a].inverse * d[i];
      if (T.c >= 0) sides[T.c].v[i] += sides[T.c].inverse * d[i];
    }
    return moved;
  }
};
// Normals of some pairs of fields, weighted by their masses, added up over the 27 nodes around each
// node of a block: one axis after the other; node by node for a pair that meets at few.
struct Smooth {
  enum { MOST = 24, FEW = 10 };
  f4 grid[MOST][216];        // of the block and one layer around; then sums, of the block
  static inline void sum(const f4 *from, f4 *to, int rows, int step, int inner) {
    for (int r = 0; r < rows; r++)
      for (int k = 0; k < 4; k++)
        for (int i = 0; i < inner; i++) {
          const f4 *g = from + (r * step + k) * inner + i;
          to[(r * 4 + k) * inner + i] = g[0] + g[inner] + g[2 * inner];
        }
  }
  inline void empty(int many) {
    for (int p = 0; p < many; p++)
      for (int i = 0; i < 216; i++) grid[p][i] = f4{0, 0, 0, 0};
  }
  // Add another block's contacts to some pairs of this one, from low on.
  inline void add(const Junction &J, const Pairs &mine, const Junction &O, int n, int low, int many,
                  const Lean *leans) {
    const Pairs others(O);
    const u64 margin = Grid::margin(n);
    const int x = 4 * (n / 9 - 1) + 1, y = 4 * (n / 3 % 3 - 1) + 1, z = 4 * (n % 3 - 1) + 1;
    for (int p = low, o = 0; p < low + many; p++) {   // both are in order
      const int a = J.field[mine.a[p]], c = J.field[mine.c[p]];
      while (o < others.count && (O.field[others.a[o]] < a || (O.field[others.a[o]] == a && O.field[others.c[o]] < c))) o++;
      if (o == others.count) break;
      if (O.field[others.a[o]] != a || O.field[others.c[o]] != c) continue;
      for (u64 left = others.nodes[o] & margin; left; left &= left - 1) {
        const int i = __builtin_ctzll(left);
        const Lean &L = leans[others.lean[o] + Grid::count(others.nodes[o] & Grid::below(i))];
        grid[p - low][((x + (i >> 4)) * 6 + y + (i >> 2 & 3)) * 6 + z + (i & 3)] = f4{L.u[0], L.u[1], L.u[2], 0};
      }
    }
  }
  static inline bool few(const Pairs &mine, int p) { return Grid::count(mine.nodes[p]) < FEW; }
  inline void up(const Pairs &mine, int low, int many) {
    f4 z[144], y[96];
    for (int p = 0; p < many; p++) {
      if (few(mine, low + p)) continue;
      sum(grid[p], z, 36, 6, 1);
      sum(z, y, 6, 6, 4);
      sum(y, grid[p], 1, 6, 16);
    }
  }
  inline f4 around(int p, bool few, int i) const {
    if (!few) return grid[p][i];
    const f4 *g = grid[p] + ((i >> 4) * 6 + (i >> 2 & 3)) * 6 + (i & 3);
    f4 x[3];
    for (int k = 0; k < 3; k++, g += 36)
      x[k] = (g[0] + g[1] + g[2]) + (g[6] + g[7] + g[8]) + (g[12] + g[13] + g[14]);
    return x[0] + x[1] + x[2];
  }
};
// Contacts of two fields of which neither is rigid, several at once: number by number, so that loops over
// them become vectors.
struct Together {
  enum { BATCH = 64, WIDE = 8 };
  int touch[BATCH], count = 0;
  double normal[3][BATCH], mean[6][BATCH], slip[3][BATCH];
  double size[BATCH], speed[BATCH], gap[BATCH];
  inline void add(int t, const Touch &T, const Side *sides, f4 along) {
    const Side &A = sides[T.a], &C = sides[T.c];
    touch[count] = t;
    for (int d = 0; d < 3; d++) {
      normal[d][count] = along[d];
      mean[d][count] = A.mean[d];
      mean[3 + d][count] = C.mean[d];
      slip[d][count] = A.v[d] - C.v[d];
    }
    count++;
  }
  // Prefetch what is read soon.
  static inline void ahead(const void *from, const void *to) {
    for (const char *line = (const char *)from; line < (const char *)to; line += 64) __builtin_prefetch(line, 1);
  }
  // Unit normals, and along them how fast sides come nearer and how far apart they are [cells].
  inline void find(const double *table) {
    for (int first = 0; first < count; first += WIDE) {
      double n[3][WIDE], near[2][WIDE], off[WIDE], far[WIDE], fast[WIDE], l[WIDE];
      for (int i = 0; i < WIDE; i++) {
        const int k = first + i;
        const double x = normal[0][k], y = normal[1][k], z = normal[2][k], length = sqrt(x * x + y * y + z * z);
        l[i] = length;
        n[0][i] = length > mpm::TINY ? x / length : 0.0;
        n[1][i] = length > mpm::TINY ? y / length : 0.0;
        n[2][i] = length > mpm::TINY ? z / length : 0.0;
        fast[i] = slip[0][k] * n[0][i] + slip[1][k] * n[1][i] + slip[2][k] * n[2][i];
        near[0][i] = mean[0][k] * n[0][i] + mean[1][k] * n[1][i] + mean[2][k] * n[2][i];
        near[1][i] = mean[3][k] * n[0][i] + mean[4][k] * n[1][i] + mean[5][k] * n[2][i];
      }
      for (int i = 0; i < WIDE; i++) off[i] = Face::overlap(table, near[0][i], near[1][i]);
      for (int i = 0; i < WIDE; i++) far[i] = near[1][i] - near[0][i] - Face::touching(off[i]);
      for (int i = 0; i < WIDE; i++) {
        const int k = first + i;
        size[k] = l[i], speed[k] = fast[i], gap[k] = far[i];
        for (int d = 0; d < 3; d++) normal[d][k] = n[d][i];
      }
    }
  }
  // Store it; target: the speed, until the contact is known to be active.
  inline void give(Touch *touches, const double *table, double dx) {
    find(table);
    for (int i = 0; i < count; i++) {
      Touch &T = touches[touch[i]];
      for (int d = 0; d < 3; d++) T.normal[d] = normal[d][i];
      T.active = size[i] > mpm::TINY;
      T.target = speed[i];
      T.gap = gap[i] * dx;
    }
    count = 0;
  }
};
const int from = (int)((long long)stage->junctions * index / LIST_PARTS),
          to = (int)((long long)stage->junctions * (index + 1) / LIST_PARTS);
int entries = 0;
Smooth smooth;
Together together = {};
if (from < to) {
  Entry *book = stage->entry + junctions[from].touch;
  for (int j = from; j < to; j++) {
    const Junction &J = junctions[j];
    const int end = J.meet + Grid::count(J.mask);
    const Junction *around[27];
    const Pairs pairs(J);
    const int last_side = meets[end - 1].side + meets[end - 1].sides;
    Together::ahead(sides + J.side, sides + last_side);
    if (J.several) {
      Together::ahead(touches + J.touch, touches + J.last);
      for (int n = 0; n < 27; n++) {
        int at[3] = {J.at[0] + n / 9 - 1, J.at[1] + n / 3 % 3 - 1, J.at[2] + n % 3 - 1}, other = 0;
        for (int q = 0; q < J.fields - 1 && !other; q++) {   // of two that meet there, one is before the last
          int b = Grid::block(world->field[J.field[q]], at);
          if (b >= 0) other = world->field[J.field[q]].where[4 * b + 3];
        }
        around[n] = other && junctions[other - 1].several ? &junctions[other - 1] : 0;
      }
    }
    for (Side *S = sides + J.side; S < sides + last_side; S++)   // from the moments that particles gave
      for (int d = 0; d < 3; d++) S->mean[d] /= S->m;
    if (J.several) {
      for (int low = 0; low < pairs.count; low += Smooth::MOST) {
        const int many = pairs.count - low < Smooth::MOST ? pairs.count - low : Smooth::MOST;
        smooth.empty(many);
        for (int n = 0; n < 27; n++)
          if (around[n]) smooth.add(J, pairs, *around[n], n, low, many, leans);
        smooth.up(pairs, low, many);
        for (int p = 0; p < many; p++) {
          const bool few = Smooth::few(pairs, low + p);
          const Lean *L = leans + pairs.lean[low + p];
          for (u64 left = pairs.nodes[low + p]; left; left &= left - 1, L++) {
            const f4 sum = smooth.around(p, few, __builtin_ctzll(left));
            Touch &T = touches[L->touch];
            if (T.choice < 0) {
              for (int d = 0; d < 3; d++) T.normal[d] = sum[d];
              continue;
            }
            together.add(L->touch, T, sides, sum);
            if (together.count == Together::BATCH) together.give(touches, world->face, dx);
          }
        }
        together.give(touches, world->face, dx);
        for (int p = low; p < low + many && stage->spread; p++)
          for (int k = 0; k < Grid::count(pairs.nodes[p]) && Solver::shell(world, J, pairs, p); k++) {
            Touch &T = touches[leans[pairs.lean[p] + k].touch];
            if (T.choice >= 0 && T.active) Solver::see_shell(world, sides, T, inv);
          }
      }
    }
    for (int k = J.meet; k < end; k++) {
      Meet &M = meets[k];
      int active = 0, nears = M.stiff, faces = 0;
      mpm::Wetted face[mpm::MAX_WETTED_FACES];
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        Touch &T = touches[t];
        for (int d = 0; d < 3; d++) T.J[d] = 0;
        for (int d = 0; d < 3 && (T.choice < 0 || M.stiff); d++) T.x[d] = M.at[d] * dx;
        if (T.choice >= 0) {
          nears |= T.active & (int)(T.target > 0);   // without a branch
          continue;
        }
        T.active = 0;
        if (T.c < 0) {
          for (int d = 0; d < 3; d++) T.normal[d] = -world->plane[4 * (-1 - T.c) + d];
        } else if (Solver::liquid(world->field[T.fa], world->field[T.fc])) {
          if (T.face == 0) faces = Solver::wet(world, sides, T.x, T, face);
          if (T.face >= faces) continue;
          for (int d = 0; d < 3; d++) T.normal[d] = face[T.face].normal[d];
          T.gap = face[T.face].height;
        } else if (Vec::unit(T.normal) <= mpm::TINY) {
          continue;
        } else if (world->field[T.fa].is_shell || world->field[T.fc].is_shell) {
          Solver::along_layers(world, sides, T);
        } else if (world->field[T.fa].flat && world->field[T.fc].flat) {
          Solver::along_faces(world, sides, T);
        }
        double u[3];
        Solver::slip(sides, T, u);
        T.active = 1;
        nears |= Vec::dot(u, T.normal) > 0 || Solver::sticks(world, T);
      }
      // Where no contact closes none transmits anything, and no node changes.
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        Touch &T = touches[t];
        if (!nears) T.active = 0;
        if (!T.active) continue;
        double speed = T.target, u[3];
        if (T.choice < 0) {
          Solver::slip(sides, T, u);
          speed = Vec::dot(u, T.normal);
        }
        const double high = Solver::height(world, T);
        const int sticks = Solver::sticks(world, T);
        T.mu = world->friction[T.fa * all + T.fc];
        if (T.choice < 0) T.gap = Solver::gap(world, sides, T, inv) * dx;
        T.span = sticks ? Solver::span(world, sides, T, sticks, high * inv) : 0.0;
        T.active = T.gap < mpm::VAST * dx || T.span > 0;   // else there is no contact
        if (!T.active) continue;
        T.target = Impact::closing(T.gap, dt);
        if (sticks || high > mpm::WALL_REACH * dx) T.mu = 0.0;
        if (M.stiff) continue;
        T.inverse = sides[T.a].inverse + (T.c < 0 ? 0.0 : sides[T.c].inverse);
        if (M.touches == 1) T.active = (int)(T.span > 0) | (int)(speed > T.target);
        active += T.active;
      }
      if (!active) continue;
      for (int s = 0; s < (active == 1 ? 1 : mpm::SWEEPS); s++) {   // one alone is solved at once
        bool moved = false;
        for (int t = M.touch; t < M.touch + M.touches; t++)
          if (touches[t].active && Solver::relax(world, sides, touches[t])) moved = true;
        if (!moved) break;
      }
      for (int s = M.side; s < M.side + M.sides; s++) {
        float *node = world->field[sides[s].field].node + (size_t)sides[s].slot * 8;
        for (int i = 0; i < 3; i++) node[1 + i] = (float)sides[s].v[i];
      }
      for (int t = M.touch; t < M.touch + M.touches; t++) {
        const Touch &T = touches[t];
        double jn = T.active ? Vec::dot(T.J, T.normal) : 0.0;
        if (jn <= 0 && (!T.active || T.span == 0)) continue;
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
          book[e].place[i] += jn * (M.at[i] * dx);
          book[e].J[i] += T.J[i];
          book[e].loss += (T.J[i] - jn * T.normal[i]) * 0.5 * (was[i] + u[i]);
          book[e].impact += jn * T.normal[i] * 0.5 * (was[i] + u[i]);
        }
      }
    }
  }
}
stage->entries[index] = entries;
