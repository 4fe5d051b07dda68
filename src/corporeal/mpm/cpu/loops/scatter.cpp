// One block's particles to nodes.
struct Scatter {
  // Force of a uniform acceleration of some bodies of a shared field; its work.
  static inline double push(const World *world, const Field &field, const float *q, f8 m, f8 *r) {
    alignas(32) float push[3][8];
    double work = 0;
    for (int l = 0; l < 8; l++) {
      const float *t = field.material + MATERIAL_COLUMNS * ((const int *)(q + 8 * MT))[l];
      for (int k = 0; k < 3; k++) push[k][l] = t[PUSH_VELOCITY + k];
    }
    for (int k = 0; k < 3; k++) {
      f8 g = *(f8 *)push[k];  // velocity that the push gives in this step
      f8 e = g * (r[1 + k] + 0.5f * m * (g + (float)world->kick[k]));
      for (int l = 0; l < 8; l++) work += e[l];
      r[4 + k] += m * g * (float)(1.0 / world->dt);
    }
    return work;
  }
  // Forces of shells on their vertices, lane by lane.
  static inline void add_forces(const ShellMesh &M, const int *number, int n, f8 *r) {
    const f8 zero = Simd::all(0.0f);
    const float *next = (const float *)(number - 8 * ID) + 2 * 8 * CHANNELS;   // nobody has just moved it
    for (int k = 0; k < CHANNELS * 8; k += 16)
      if (k < 8 * DE || k >= 8 * ST) __builtin_prefetch(next + k);
    for (int l = 0; l < n; l++) {
      const int vertex = M.vertex[number[l]];
      if (vertex >= 0)
        r[l] += __builtin_shufflevector(zero, *(const f8u *)(M.force + 4 * (size_t)vertex), 0, 0, 0, 0, 8, 9, 10, 0);
    }
  }
  // One lane's share on its 27 nodes: r0 at the first, a more for every node along each axis.
  static inline void lane(f8 *g, const Row *W, int l, f8 r0, f8 a0, f8 a1, f8 a2) {
#pragma unroll
    for (int i = 0; i < 3; i++) {
      f8 r = r0;
#pragma unroll
      for (int j = 0; j < 3; j++) {
        f8 *h = g + i * ARENA_LAYER_NODES + j * 8;
        const Row *w = W + (i * 3 + j) * 3;
        f8 s = r + a2, t = s + a2;
        h[0] += w[0][l] * r;
        h[1] += w[1][l] * s;
        h[2] += w[2][l] * t;
        r += a1;
      }
      r0 += a0;
    }
  }
  // The same of neighbours in one cell, from lane l on: sums stay in registers, in the same order.
  static inline void lanes(f8 *g, const Row *W, int l, const f8 *r0, const f8 (*a)[8]) {
    f8 first[TOGETHER], r[TOGETHER];
#pragma unroll
    for (int n = 0; n < TOGETHER; n++) first[n] = r0[l + n];
#pragma unroll
    for (int i = 0; i < 3; i++) {
#pragma unroll
      for (int n = 0; n < TOGETHER; n++) r[n] = first[n];
#pragma unroll
      for (int j = 0; j < 3; j++) {
        f8 *h = g + i * ARENA_LAYER_NODES + j * 8, h0 = h[0], h1 = h[1], h2 = h[2];
        const Row *w = W + (i * 3 + j) * 3;
#pragma unroll
        for (int n = 0; n < TOGETHER; n++) {
          f8 s = r[n] + a[2][l + n], t = s + a[2][l + n];
          h0 += w[0][l + n] * r[n];
          h1 += w[1][l + n] * s;
          h2 += w[2][l + n] * t;
          r[n] += a[1][l + n];
        }
        h[0] = h0;
        h[1] = h1;
        h[2] = h2;
      }
#pragma unroll
      for (int n = 0; n < TOGETHER; n++) first[n] += a[0][l + n];
    }
  }
  static inline void batch(const World *world, const Field &field, const int *block, int s, f8 *arena,
                           const ClusterMean &pressure, double &work) {
    const float *q = field.part + (size_t)s * CHANNELS;
    alignas(64) float W[27][8];
    alignas(32) int base[8];
    f8 D[3];
    Simd::weights(q, block, D, W, base);
    f8 m = *(f8u *)(q + 8 * MA), zero = Simd::all(0.0f), r[8], a[3][8];
    r[0] = m;
    r[7] = zero;
    for (int k = 0; k < 3; k++) r[1 + k] = m * *(f8u *)(q + 8 * (VE + k));
    r[4] = r[5] = r[6] = zero;
    if (field.pushed) work += push(world, field, q, m, r);
    const int row[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const int n = block[1] - s < 8 ? block[1] - s : 8;
    f8 press = zero;
    if (field.uses_mean_dilatation)
      press = pressure.mean(ClusterMean::of(q, block), n) * *(f8u *)(q + 8 * VO) * (float)(-4.0 / world->dx);
    for (int j = 0; j < 3; j++) {
      a[j][0] = zero;
      a[j][7] = -m * field.level[j];
      for (int k = 0; k < 3; k++) {
        a[j][1 + k] = m * *(f8u *)(q + 8 * (AF + 3 * k + j));
        a[j][4 + k] = *(f8u *)(q + 8 * (ST + row[k][j]));
      }
      a[j][4 + j] += press;
      for (int k = 1; k < 8; k++) r[k] -= a[j][k] * D[j];
    }
    Simd::turn(r);
    if (field.shells) add_forces(*world->shell, (const int *)(q + 8 * ID), n, r);
    for (int j = 0; j < 3; j++) Simd::turn(a[j]);
    for (int l = 0; l < n;) {
      if (Simd::together(base, l, n)) {
        lanes(arena + base[l], W, l, r, a);
        l += TOGETHER;
      } else {
        lane(arena + base[l], W, l, r[l], a[0][l], a[1][l], a[2][l]);
        l++;
      }
    }
  }
  // Node blocks that are no longer empty.
  static inline void mark(const Field &field, const int *block, const int *low, const int *high,
                          const float *node) {
    int bit = 1 << (node == field.node ? field.side : !field.side);
    for (int i = (low[0] + 3) >> 2; i <= (high[0] + 3) >> 2; i++)
      for (int j = (low[1] + 3) >> 2; j <= (high[1] + 3) >> 2; j++)
        for (int k = (low[2] + 3) >> 2; k <= (high[2] + 3) >> 2; k++) {
          int *used = field.used + block[NEIGHBOURS + (i * 3 + j) * 3 + k];
          if (!(__atomic_load_n(used, __ATOMIC_RELAXED) & bit))
            __atomic_fetch_or(used, bit, __ATOMIC_RELAXED);
        }
  }
  // Mean pressures of the block's clusters.
  static void sum(const Field &field, const int *block, ClusterMean &pressure) {
    for (int s = block[0]; s < block[1]; s += 8) {
      const float *q = field.part + (size_t)s * CHANNELS, *past = field.history + (size_t)s * HISTORY_CHANNELS;
      pressure.add(ClusterMean::of(q, block), block[1] - s < 8 ? block[1] - s : 8,
                   *(f8u *)(q + 8 * VO), *(f8u *)(past + 8 * PRESSURE));
    }
  }
  static double block(const World *world, const Field &field, const int *block, float *node) {
    alignas(64) f8 arena[ARENA_FLOATS];
    double work = 0;
    int low[3], high[3];
    ClusterMean pressure;
    if (field.uses_mean_dilatation) sum(field, block, pressure);
    int *box = field.box + 6 * ((block - field.block) / BLOCK_INTEGERS);
    Simd::box(field, block, box);
    Simd::range(block, box, low, high);
    for (int i = low[0]; i <= high[0]; i++)
      for (int j = low[1]; j <= high[1]; j++)
        for (int k = 0; k < 8; k++) arena[i * ARENA_LAYER_NODES + j * 8 + k] = Simd::all(0.0f);
    for (int s = block[0]; s < block[1]; s += 8) batch(world, field, block, s, arena, pressure, work);
    mark(field, block, low, high, node);
    for (int i = low[0]; i <= high[0]; i++)
      for (int j = low[1]; j <= high[1]; j++) {
        const int *near = block + NEIGHBOURS + (((i + 3) >> 2) * 3 + ((j + 3) >> 2)) * 3;
        const f8 *h = arena + i * ARENA_LAYER_NODES + j * 8;
        size_t row = ((i + 3) & 3) * 16 + ((j + 3) & 3) * 4;
        f8 *g0 = (f8 *)node + (size_t)near[0] * 64 + row;
        f8 *g1 = (f8 *)node + (size_t)near[1] * 64 + row;
        f8 *g2 = (f8 *)node + (size_t)near[2] * 64 + row;
        if (low[2] == 0) g0[3] += h[0];
        for (int k = 0; k < 4; k++) g1[k] += h[1 + k];
        if (high[2] > 4)
          for (int k = 0; k < 3; k++) g2[k] += h[5 + k];
      }
    return work;
  }
};
