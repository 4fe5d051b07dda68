// Nodes to one block's particles: velocities, affine parts, places, strain, return map and stress.
struct Gather {
  f8 speed2 = Simd::all(0.0f), wave2 = speed2;
  double plastic = 0, viscous = 0;
  int astray = 0;

  // Moments of 27 nodes for one lane: of velocity u, and of velocity times the node's number along
  // each axis.
  static inline void lane(const f8 *g, const Row *W, int l, f8 &u, f8 &x, f8 &y, f8 &z) {
    f8 c[3];
#pragma unroll
    for (int i = 0; i < 3; i++) {
      f8 s[3];
#pragma unroll
      for (int j = 0; j < 3; j++) {
        const f8 *h = g + i * LAYER + j * 8;
        const Row *w = W + (i * 3 + j) * 3;
        f8 b = w[2][l] * h[2], t = w[1][l] * h[1] + b;
        s[j] = w[0][l] * h[0] + t;
        z = (i || j) ? z + (t + b) : t + b;
      }
      f8 t = s[1] + s[2];
      y = i ? y + (t + s[2]) : t + s[2];
      c[i] = s[0] + t;
    }
    x = c[1] + c[2];
    u = c[0] + x;
    x += c[2];
  }
  static inline void fill(const Field &field, const int *block, f8 *arena) {
    int low[3], high[3], box[6];
    Simd::range(field, block, low, high, box);
    for (int i = low[0]; i <= high[0]; i++)
      for (int j = low[1]; j <= high[1]; j++) {
        const int *near = block + 5 + (((i + 3) >> 2) * 3 + ((j + 3) >> 2)) * 3;
        f8 *h = arena + i * LAYER + j * 8;
        size_t row = ((i + 3) & 3) * 16 + ((j + 3) & 3) * 4;
        const f8 *g0 = (f8 *)field.node + (size_t)near[0] * 64 + row;
        const f8 *g1 = (f8 *)field.node + (size_t)near[1] * 64 + row;
        const f8 *g2 = (f8 *)field.node + (size_t)near[2] * 64 + row;
        if (low[2] == 0) h[0] = g0[3];
        for (int k = 0; k < 4; k++) h[1 + k] = g1[k];
        if (high[2] > 4)
          for (int k = 0; k < 3; k++) h[5 + k] = g2[k];
      }
  }
  // Cells of a block's arena whose nodes it has.
  static inline void allowed(const Field &field, const int *block, int *least, int *most) {
    const int own = 5 + 13, step[3] = {9, 3, 1}, none = field.pool - 1;
    for (int d = 0; d < 3; d++) {
      least[d] = block[own - step[d]] == none;
      most[d] = block[own + step[d]] == none ? 2 : 5;
    }
  }
  inline void batch(const World *world, const Field &field, const int *block, int s, const f8 *arena,
                    const int *least, const int *most) {
    const float dt = (float)world->dt, step = (float)(world->dt / world->dx), dx = (float)world->dx;
    float *q = field.part + (size_t)s * NC, *past = field.history + (size_t)s * NH;
    for (int k = 0; k < NC * 8; k += 16) __builtin_prefetch(q + 2 * NC * 8 + k, 1, 3);
    int live = block[1] - s < 8 ? block[1] - s : 8;
    alignas(64) float W[27][8];
    alignas(32) int base[8];
    f8 D[3], u[8], c0[8], c1[8], c2[8];
    Simd::weights(q, block, D, W, base);
    for (int l = live; l < 8; l++) u[l] = c0[l] = c1[l] = c2[l] = Simd::all(0.0f);
    for (int l = 0; l < live; l++) lane(arena + base[l], W, l, u[l], c0[l], c1[l], c2[l]);
    Simd::turn(u);
    Simd::turn(c0);
    Simd::turn(c1);
    Simd::turn(c2);
    for (int k = 1; k < 7; k++) {
      c0[k] -= D[0] * u[k];
      c1[k] -= D[1] * u[k];
      c2[k] -= D[2] * u[k];
    }
    Stuff t = Stuff::of(field, (const int *)(q + 8 * MT));
    f8 keep = 1.0f - Simd::low(Simd::all(1.0f), dt * t.keep);
    i8 alive = i8{0, 1, 2, 3, 4, 5, 6, 7} < live;
    f8 on = Simd::pick(alive, Simd::all(1.0f), Simd::all(0.0f));

    // Velocity, affine part and place; L is the grid's gradient times dx.
    f8 L[9], C[9], B[9], v2 = Simd::all(0.0f);
    i8 off = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int k = 0; k < 3; k++) {
      f8u *v = (f8u *)(q + 8 * (VE + k));
      f8 now = u[1 + k] + keep * (*v - u[4 + k]);
      *v = now;
      v2 += now * now;
      f8 col_new[3] = {c0[1 + k], c1[1 + k], c2[1 + k]};
      f8 col_old[3] = {c0[4 + k], c1[4 + k], c2[4 + k]};
      for (int j = 0; j < 3; j++) {
        f8u *c = (f8u *)(q + 8 * (AF + 3 * k + j));
        f8 grad = 4.0f * col_new[j];
        B[3 * k + j] = *c;
        C[3 * k + j] = grad + keep * (*c - 4.0f * col_old[j]);
        *c = C[3 * k + j];
        L[3 * k + j] = grad;
      }
      f8 move = u[1 + k] * on * (step * (float)UNIT);
      move += Simd::pick(move < 0.0f, Simd::all(-0.5f), Simd::all(0.5f));
      i8u *x = (i8u *)(q + 8 * (XI + k));
      i8 next = *x + Simd::whole(move);
      *x = next;
      i8 inside = ((next - HALF) >> PLACE) - (4 * block[2 + k] - 1);
      off |= (inside < least[k]) | (inside > most[k]);
    }
    if (Simd::any(off & alive)) astray = 1;
    speed2 = Simd::high(speed2, v2 * on);

    // Strain: H += dt L (1 + H).
    f8 H[9], A[9];
    float rate = step;
    for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
    for (int k = 0; k < 9; k++) A[k] = L[k] * (on * rate);
    const f8 relief = field.swells ? u[7] - Simd::swelling(q) : Simd::all(0.0f);
    follow(A, H);
    // b - 1 = H + Ht + H Ht
    f8 E[6];
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        E[n++] = H[3 * i + j] + H[3 * j + i] + H[3 * i] * H[3 * j] + H[3 * i + 1] * H[3 * j + 1] +
                 H[3 * i + 2] * H[3 * j + 2];
    f8 minors = H[0] * H[4] - H[1] * H[3] + H[0] * H[8] - H[2] * H[6] + H[4] * H[8] - H[5] * H[7];
    f8 det = H[0] * (H[4] * H[8] - H[5] * H[7]) - H[1] * (H[3] * H[8] - H[5] * H[6]) +
             H[2] * (H[3] * H[7] - H[4] * H[6]);
    f8 j1 = H[0] + H[4] + H[8] + minors + det;   // J - 1
    f8 volume = *(f8u *)(q + 8 * VO);
    f8 stress[6], wave = t.lambda + 2.0f * t.mu;
    for (int k = 0; k < 6; k++) stress[k] = Simd::all(0.0f);
    i8 fixed = t.law == 0.0f, neo = t.law == 1.0f, logarithmic = (t.law >= 2.0f) & (t.law < 5.0f);
    if (Simd::any(fixed)) {
      f8 tau[6], c;
      Laws::corotated(t, E, j1, tau, c);
      take(fixed, tau, stress);
      wave = Simd::pick(fixed, c, wave);
    }
    if (Simd::any(neo)) {
      f8 tau[6], c;
      Laws::neo_hookean(t, E, j1, tau, c);
      take(neo, tau, stress);
      wave = Simd::pick(neo, c, wave);
    }
    if (Simd::any(logarithmic)) {
      f8 e[6];
      Function::half_log(E, e);
      if (Simd::any((t.law >= 3.0f) & logarithmic)) plastic += flow(t, on, volume, A, past, e, H);
      f8 tr = t.lambda * (e[0] + e[3] + e[5]);
      for (int k = 0; k < 6; k++) e[k] = 2.0f * t.mu * e[k];
      for (int k = 0; k < 6; k += k == 3 ? 2 : 3) e[k] += tr;
      take(logarithmic, e, stress);
    }
    if (field.swells) {   // pressure from the mean swelling around, not from one's own
      f8 jm = Simd::high(j1 + relief, Simd::all(-0.999f));
      f8 p = Simd::pick(fixed, (1.0f + jm) * jm - (1.0f + j1) * j1,
                        Math::log1p((jm - j1) / (1.0f + j1)));
      for (int k = 0; k < 6; k += k == 3 ? 2 : 3) stress[k] += t.lambda * p;
    }
    if (Simd::any(t.visc > 0.0f)) {
      f8 eta = t.visc * Simd::high(1.0f + j1, Simd::all(0.0f)) * (1.0f / dx), w = Simd::all(0.0f);
      int k = 0;
      for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
          f8 d = C[3 * i + j] + C[3 * j + i];
          stress[k++] += eta * d;
          // Work of the stress that acted in this step, which the old affine part made.
          w += (i == j ? 0.5f : 1.0f) * (B[3 * i + j] + B[3 * j + i]) *
               (L[3 * i + j] + L[3 * j + i]);
        }
      w *= eta * volume * on * (dt / dx);
      for (int l = 0; l < 8; l++) viscous += w[l];
    }
    wave2 = Simd::high(wave2, on * wave / t.rho);
    for (int k = 0; k < 9; k++) *(f8u *)(q + 8 * (DE + k)) = H[k];
    f8 scale = volume * (-4.0f / dx) * on;
    for (int k = 0; k < 6; k++) *(f8u *)(q + 8 * (ST + k)) = scale * stress[k];
  }
  static inline void take(i8 where, const f8 *from, f8 *to) {
    for (int k = 0; k < 6; k++) to[k] = Simd::pick(where, from[k], to[k]);
  }
  // (1 + H) <- (1 + M) (1 + H)
  static inline void follow(const f8 *M, f8 *H) {
    f8 G[9];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        G[3 * i + j] = H[3 * i + j] + M[3 * i + j] + M[3 * i] * H[j] + M[3 * i + 1] * H[3 + j] +
                       M[3 * i + 2] * H[6 + j];
    for (int k = 0; k < 9; k++) H[k] = G[k];
  }
  // Strain e and F = 1 + H after plastic flow; the whole motion goes on by A. Returns the work.
  static inline double flow(const Stuff &t, f8 on, f8 volume, const f8 *A, float *past, f8 *e, f8 *H) {
    i8 grain = t.law == 3.0f, ductile = t.law == 4.0f;
    f8 ep = *(f8u *)(past + 8 * EP), vc = *(f8u *)(past + 8 * VC), zero = Simd::all(0.0f);
    f8 change = zero, lost = zero, moved[6], X[6];
    for (int k = 0; k < 6; k++) moved[k] = zero;
    if (Simd::any(grain)) {
      f8 s[6], m[6], d, v = vc;
      for (int k = 0; k < 6; k++) s[k] = e[k];
      f8 w = Laws::sand(t, s, m, d, v);
      take(grain, s, e);
      take(grain, m, moved);
      change = Simd::pick(grain, d, change);
      lost = Simd::pick(grain, w, lost);
      *(f8u *)(past + 8 * VC) = Simd::pick(grain & (on > 0.0f), v, vc);
    }
    if (Simd::any(ductile)) {
      f8 s[6], m[6], d;
      for (int k = 0; k < 6; k++) s[k] = e[k];
      f8 w = Laws::metal(t, s, m, d, ep);
      take(ductile, s, e);
      take(ductile, m, moved);
      change = Simd::pick(ductile, d, change);
      lost = Simd::pick(ductile, w, lost);
    }
    *(f8u *)(past + 8 * EP) = ep + 0.81649658f * change * on;
    if (Simd::any(Sym::bound(moved) > 0.0f)) {
      Function::expm1(moved, X);
      f8 M[9] = {X[0], X[1], X[2], X[1], X[3], X[4], X[2], X[4], X[5]};
      follow(M, H);
    }
    f8 G[9];
    for (int k = 0; k < 9; k++) G[k] = *(f8u *)(past + 8 * (TM + k));
    follow(A, G);
    for (int k = 0; k < 9; k++) *(f8u *)(past + 8 * (TM + k)) = G[k];
    lost *= volume * on;
    double work = 0;
    for (int k = 0; k < 8; k++) work += lost[k];
    return work;
  }
  void block(const World *world, const Field &field, const int *block) {
    alignas(64) f8 arena[ARENA];
    int least[3], most[3];
    allowed(field, block, least, most);
    fill(field, block, arena);
    for (int s = block[0]; s < block[1]; s += 8) batch(world, field, block, s, arena, least, most);
  }
  void report(double *row) const {
    float top = 0, fast = 0;
    for (int l = 0; l < 8; l++) {
      // NaN fails every comparison: it counts as infinite.
      if (!(speed2[l] <= top)) top = speed2[l] < INFINITY ? speed2[l] : INFINITY;
      if (!(wave2[l] <= fast)) fast = wave2[l] < INFINITY ? wave2[l] : INFINITY;
    }
    row[SPEED2] = top;
    row[WAVE2] = fast;
    row[PLASTIC] += plastic;
    row[VISCOUS] += viscous;
    row[ASTRAY] = astray;
  }
};
