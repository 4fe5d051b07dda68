// Material of each lane.
struct LaneMaterial : mpm::Material<f8> {
  f8 keep, rho, strainless;   // as the columns that follow
  MPM_INLINE static LaneMaterial of(const Field &field, const int *kind) {
    LaneMaterial t;
    f8 *to = &t.law;
    i8 all = *(const i8u *)kind;
    if (!Simd::any(all != kind[0])) {
      const float *row = field.material + MATERIAL_COLUMNS * kind[0];
      for (int k = LAW; k <= STRAINLESS; k++) to[k] = Simd::all(row[k]);
      return t;
    }
    alignas(32) float lane[STRAINLESS + 1][8];
    for (int l = 0; l < 8; l++) {
      const float *row = field.material + MATERIAL_COLUMNS * kind[l];
      for (int k = LAW; k <= STRAINLESS; k++) lane[k][l] = row[k];
    }
    for (int k = LAW; k <= STRAINLESS; k++) to[k] = *(f8 *)lane[k];
    return t;
  }
};
// Nodes to one block's particles: velocities, affine parts, places, strain, return map and stress.
struct Gather {
  typedef mpm::Laws<f8> Laws;
  typedef mpm::Strain<f8> Strain;
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
        const f8 *h = g + i * ARENA_LAYER_NODES + j * 8;
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
  // The same of neighbours in one cell, from lane l on: each node is loaded once.
  static inline void lanes(const f8 *g, const Row *W, int l, f8 *u, f8 *x, f8 *y, f8 *z) {
    f8 c[TOGETHER][3];
#pragma unroll
    for (int i = 0; i < 3; i++) {
      f8 s[TOGETHER][3];
#pragma unroll
      for (int j = 0; j < 3; j++) {
        const f8 *h = g + i * ARENA_LAYER_NODES + j * 8, h0 = h[0], h1 = h[1], h2 = h[2];
        const Row *w = W + (i * 3 + j) * 3;
#pragma unroll
        for (int n = l; n < l + TOGETHER; n++) {
          f8 b = w[2][n] * h2, t = w[1][n] * h1 + b;
          s[n - l][j] = w[0][n] * h0 + t;
          z[n] = (i || j) ? z[n] + (t + b) : t + b;
        }
      }
#pragma unroll
      for (int n = 0; n < TOGETHER; n++) {
        f8 t = s[n][1] + s[n][2];
        y[l + n] = i ? y[l + n] + (t + s[n][2]) : t + s[n][2];
        c[n][i] = s[n][0] + t;
      }
    }
#pragma unroll
    for (int n = 0; n < TOGETHER; n++) {
      x[l + n] = c[n][1] + c[n][2];
      u[l + n] = c[n][0] + x[l + n];
      x[l + n] += c[n][2];
    }
  }
  static inline void fill(const Field &field, const int *block, f8 *arena) {
    int low[3], high[3];
    Simd::range(block, field.box + 6 * ((block - field.block) / BLOCK_INTEGERS), low, high);   // as they were laid
    for (int i = low[0]; i <= high[0]; i++)
      for (int j = low[1]; j <= high[1]; j++) {
        const int *near = block + NEIGHBOURS + (((i + 3) >> 2) * 3 + ((j + 3) >> 2)) * 3;
        f8 *h = arena + i * ARENA_LAYER_NODES + j * 8;
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
    const int own = OWN_BLOCK, step[3] = {9, 3, 1}, none = field.pool - 1;
    for (int d = 0; d < 3; d++) {
      least[d] = block[own - step[d]] == none;
      most[d] = block[own + step[d]] == none ? 2 : 5;
    }
  }
  // Strain of the Maxwell branches after the step, and their stress, added to ``stress``; gives the work
  // per volume of the stress that acted in this step.
  static inline f8 relax(const Field &field, const int *kind, const f8 *L, float *branch, f8 *stress) {
    typedef mpm::Branch<f8> Branch;
    f8 A[9], trace = Branch::deviator(L, A), work = Simd::all(0.0f);
    f8 d[6] = {L[0], L[1] + L[3], L[2] + L[6], L[4], L[5] + L[7], L[8]};
    for (int b = 0; b < mpm::BRANCHES; b++, branch += 8 * BRANCH_CHANNELS) {
      f8 E[6], theta = *(f8u *)(branch + 8 * BRANCH_DILATATION), old[6], G, K, kept, fresh;
      for (int l = 0; l < 8; l++) {
        const float *row = field.material + MATERIAL_COLUMNS * kind[l];
        G[l] = row[SHEAR + b], K[l] = row[BULK + b], kept[l] = row[BRANCH_KEPT + b], fresh[l] = row[BRANCH_FRESH + b];
      }
      for (int k = 0; k < 6; k++) E[k] = *(f8u *)(branch + 8 * (BRANCH_STRAIN + k)), old[k] = Simd::all(0.0f);
      Branch::press(G, K, E, theta, old);
      for (int k = 0; k < 6; k++) work += old[k] * d[k];
      Branch::follow(A, kept, fresh, E);
      theta = kept * theta + fresh * trace;
      Branch::press(G, K, E, theta, stress);
      for (int k = 0; k < 6; k++) *(f8u *)(branch + 8 * (BRANCH_STRAIN + k)) = E[k];
      *(f8u *)(branch + 8 * BRANCH_DILATATION) = theta;
    }
    return work;
  }
  // How many times stiffer waves find each lane's matter with branches than without.
  static inline f8 stiffening(const Field &field, const int *kind) {
    f8 times;
    for (int l = 0; l < 8; l++) times[l] = field.material[MATERIAL_COLUMNS * kind[l] + STIFFENING];
    return times;
  }
  inline void batch(const World *world, const Field &field, const int *block, int s, const f8 *arena,
                    ClusterMean &dilatation, const int *least, const int *most) {
    const float dt = (float)world->dt, step = (float)(world->dt / world->dx), dx = (float)world->dx;
    float *q = field.part + (size_t)s * CHANNELS, *past = field.history + (size_t)s * HISTORY_CHANNELS;
    for (int k = 0; k < CHANNELS * 8; k += 16) __builtin_prefetch(q + 2 * CHANNELS * 8 + k, 1, 3);
    int live = block[1] - s < 8 ? block[1] - s : 8;
    alignas(64) float W[27][8];
    alignas(32) int base[8];
    f8 D[3], u[8], c0[8], c1[8], c2[8];
    Simd::weights(q, block, D, W, base);
    for (int l = live; l < 8; l++) u[l] = c0[l] = c1[l] = c2[l] = Simd::all(0.0f);
    for (int l = 0; l < live;) {
      if (Simd::together(base, l, live)) {
        lanes(arena + base[l], W, l, u, c0, c1, c2);
        l += TOGETHER;
      } else {
        lane(arena + base[l], W, l, u[l], c0[l], c1[l], c2[l]);
        l++;
      }
    }
    Simd::turn(u);
    Simd::turn(c0);
    Simd::turn(c1);
    Simd::turn(c2);
    for (int k = 1; k < 7; k++) {
      c0[k] -= D[0] * u[k];
      c1[k] -= D[1] * u[k];
      c2[k] -= D[2] * u[k];
    }
    const i8 cluster = field.uses_mean_dilatation ? ClusterMean::of(q, block) : *(i8 *)base;
    LaneMaterial t = LaneMaterial::of(field, (const int *)(q + 8 * MT));
    f8 keep = 1.0f - Simd::low(Simd::all(1.0f), dt * t.keep);
    i8 alive = i8{0, 1, 2, 3, 4, 5, 6, 7} < live;
    f8 on = Simd::pick(alive, Simd::all(1.0f), Simd::all(0.0f));

    // Velocity, affine part and place; L is the grid's gradient times dx.
    const f8 zero = Simd::all(0.0f);
    f8 L[9], v2 = zero;
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
        *c = grad + keep * (*c - 4.0f * col_old[j]);
        L[3 * k + j] = grad;
      }
      f8 move = u[1 + k] * on * (step * (float)CELL_UNITS);
      move += Simd::pick(move < 0.0f, Simd::all(-0.5f), Simd::all(0.5f));
      i8u *x = (i8u *)(q + 8 * (XI + k));
      i8 next = *x + Simd::whole(move);
      *x = next;
      i8 inside = ((next - HALF_CELL_UNITS) >> PLACE) - (4 * block[2 + k] - 1);
      off |= (inside < least[k]) | (inside > most[k]);
    }
    if (Simd::any(off & alive)) astray = 1;
    speed2 = Simd::high(speed2, v2 * on);

    if (!field.uses_mean_dilatation && !Simd::any(t.strainless == 0.0f)) return;

    // Trial strain: H += dt L (1 + H). Rigid bodies and vertices of shells do not strain.
    f8 H[9], A[9];
    float rate = step;
    for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
    for (int k = 0; k < 9; k++) A[k] = Simd::pick(t.strainless > 0.0f, zero, L[k] * (on * rate));
    Strain::follow(A, H);

    // Stress of the law, after the return map of matter that flows.
    const bool flows = Simd::any(Laws::flows(t));
    f8 ep = zero, vc = zero, volume = *(f8u *)(q + 8 * VO);
    if (flows) {
      ep = *(f8u *)(past + 8 * EP);
      vc = *(f8u *)(past + 8 * VC);
    }
    if (field.uses_mean_dilatation) t.lambda -= Laws::mean_bulk(t);
    mpm::Response<f8> a;
    Laws::respond(t, ep, vc, H, a);
    if (flows) {
      *(f8u *)(past + 8 * VC) = Simd::pick(on > 0.0f, a.opened, vc);
      *(f8u *)(past + 8 * EP) = ep + a.plastic * on;
      f8 G[9], lost = a.work * (volume * on);
      for (int k = 0; k < 9; k++) G[k] = *(f8u *)(past + 8 * (TM + k));
      Strain::follow(A, G);
      const i8 pours = Laws::pours(t);
      for (int k = 0; k < 9; k++) *(f8u *)(past + 8 * (TM + k)) = Simd::pick(pours, H[k], G[k]);
      double work = 0;
      for (int k = 0; k < 8; k++) work += lost[k];
      plastic += work;
    }
    f8 *stress = a.tau, wave = a.wave, j1 = a.j1;
    if (field.uses_mean_dilatation) {   // the rest of lambda waits for what the whole cluster does
      const f8 grown = A[0] + A[4] + A[8];
      dilatation.add(cluster, live, volume, grown);
      *(f8u *)(past + 8 * OWN_DILATATION) = grown;
      *(i8u *)(past + 8 * CLUSTER) = cluster;
      *(f8u *)(past + 8 * WAVE_BOUND) = wave;
    }
    if (field.relaxes) {
      float *branch = field.branch + (size_t)s * MAXWELL_CHANNELS;
      f8 w = relax(field, (const int *)(q + 8 * MT), A, branch, stress) * volume;
      for (int l = 0; l < 8; l++) viscous += w[l];
      wave *= stiffening(field, (const int *)(q + 8 * MT));
    }
    wave2 = Simd::high(wave2, on * wave / t.rho);
    for (int k = 0; k < 9; k++) *(f8u *)(q + 8 * (DE + k)) = H[k];
    f8 scale = volume * (-4.0f / dx) * on;
    for (int k = 0; k < 6; k++) *(f8u *)(q + 8 * (ST + k)) = scale * stress[k];
  }
  // Pressure of the mean dilatation, once all particles of the block's clusters are known.
  inline void press(const Field &field, const int *block, int s, const ClusterMean &dilatation) {
    float *q = field.part + (size_t)s * CHANNELS, *past = field.history + (size_t)s * HISTORY_CHANNELS;
    const int live = block[1] - s < 8 ? block[1] - s : 8;
    const LaneMaterial t = LaneMaterial::of(field, (const int *)(q + 8 * MT));
    const f8 zero = Simd::all(0.0f);
    const f8 on = Simd::pick(i8{0, 1, 2, 3, 4, 5, 6, 7} < live, zero + 1.0f, zero);
    f8 H[9], wave = *(f8u *)(past + 8 * WAVE_BOUND);
    for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
    const f8 grown = dilatation.mean(*(i8u *)(past + 8 * CLUSTER), live);
    const f8 log_volume_ratio = *(f8u *)(past + 8 * LOG_VOLUME_RATIO) + (grown - *(f8u *)(past + 8 * OWN_DILATATION)) * on;
    const f8 p = Laws::mean_pressure(t, Laws::mean_bulk(t), Strain::volume(H), log_volume_ratio, wave);
    *(f8u *)(past + 8 * LOG_VOLUME_RATIO) = log_volume_ratio;
    *(f8u *)(past + 8 * PRESSURE) = p * on;
    if (field.relaxes) wave *= stiffening(field, (const int *)(q + 8 * MT));
    wave2 = Simd::high(wave2, on * wave / t.rho);
  }
  void block(const World *world, const Field &field, const int *block) {
    alignas(64) f8 arena[ARENA_FLOATS];
    int least[3], most[3];
    ClusterMean dilatation;
    allowed(field, block, least, most);
    fill(field, block, arena);
    for (int s = block[0]; s < block[1]; s += 8)
      batch(world, field, block, s, arena, dilatation, least, most);
    if (field.uses_mean_dilatation)
      for (int s = block[0]; s < block[1]; s += 8) press(field, block, s, dilatation);
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
    row[REPORT_ASTRAY] = astray;
  }
};
