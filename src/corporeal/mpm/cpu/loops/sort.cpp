// Sorts one field's particles by block, material and cell, in four stages with Python's memory between.
Sorting &S = *(Sorting *)memory.data;
struct Stage {
  static inline i8 block(const float *q, int d) {
    return (*(const i8u *)(q + 8 * (XI + d)) - HALF_CELL_UNITS) >> (PLACE + 2);
  }
  // Range of blocks, and whether a particle is lost.
  static void survey(Sorting &S) {
    i8 low[3], high[3];
    for (int d = 0; d < 3; d++) low[d] = i8{} + (1 << 30), high[d] = -low[d];
    i8 lost = i8{}, away = lost;
    for (int r = 0; r < S.olds; r++)
      for (int s = S.old[RUN_INTEGERS * r]; s < S.old[RUN_INTEGERS * r + 1]; s += 8) {
        const float *q = S.part + (size_t)s * CHANNELS;
        i8 alive = i8{0, 1, 2, 3, 4, 5, 6, 7} < S.old[RUN_INTEGERS * r + 1] - s;
        f8 x[3], v = Simd::all(0.0f);
        i8 out = i8{};
        for (int d = 0; d < 3; d++) {
          i8 b = block(q, d), first = i8{} + b[0];
          b = alive ? b : first;
          out |= alive & (b != S.old[RUN_INTEGERS * r + 2 + d]);
          low[d] = b < low[d] ? b : low[d];
          high[d] = b > high[d] ? b : high[d];
          x[d] = Simd::flo(*(const i8u *)(q + 8 * (XI + d))) * PER_UNIT + 4.0f * S.origin[d];
          lost |= alive & ~(Simd::size(x[d]) < (float)S.farthest);
          v += Simd::size(*(const f8u *)(q + 8 * (VE + d)));
        }
        lost |= alive & ~(v < (float)mpm::VAST);
        away -= out;
        for (int w = 0; w < S.planes; w++) {
          const double *P = S.plane + 4 * w;
          f8 h = x[0] * (float)P[0] + x[1] * (float)P[1] + x[2] * (float)P[2] - (float)P[3];
          lost |= alive & ~(h > (float)-S.deepest);
        }
      }
    S.lost = Simd::any(lost);
    S.out_of_block = __builtin_reduce_add(away);
    for (int d = 0; d < 3; d++) {
      S.low[d] = 1 << 30;
      S.high[d] = -(1 << 30);
      for (int l = 0; l < 8; l++) {
        if (low[d][l] < S.low[d]) S.low[d] = low[d][l];
        if (high[d][l] > S.high[d]) S.high[d] = high[d][l];
      }
    }
  }
  // Keys, how many share one, blocks and slots needed.
  static void count(Sorting &S) {
    for (int r = 0; r < S.olds; r++)
      for (int s = S.old[RUN_INTEGERS * r]; s < S.old[RUN_INTEGERS * r + 1]; s += 8) {
        const float *q = S.part + (size_t)s * CHANNELS;
        i8 line = i8{}, inner = *(const i8u *)(q + 8 * MT);
        for (int d = 0; d < 3; d++) {
          line = line * S.dim[d] + (block(q, d) - S.low[d] + 1);
          inner = inner * 4 + (((*(const i8u *)(q + 8 * (XI + d)) - HALF_CELL_UNITS) >> PLACE) & 3);
        }
        *(i8u *)(S.line + s) = line;
        *(i8u *)(S.inner + s) = inner;
        int live = S.old[RUN_INTEGERS * r + 1] - s < 8 ? S.old[RUN_INTEGERS * r + 1] - s : 8;
        for (int l = 0; l < live; l++) {
          S.count[S.line[s + l]]++;
          S.bin[S.inner[s + l]]++;
          S.edge[S.line[s + l]] |= edges(S.inner[s + l]);
        }
      }
    S.blocks = S.slots = 0;
    for (int i = 0; i < S.dim[0] * S.dim[1] * S.dim[2]; i++) {
      S.blocks += S.count[i] > 0;
      S.slots += (S.count[i] + 7) & ~7;
    }
  }
  // Two stable counting sorts, records of blocks, and the table of node blocks that they reach.
  static void rank(Sorting &S) {
    int sum = 0;
    for (int i = 0; i < S.bins; i++) {
      int n = S.bin[i];
      S.bin[i] = sum;
      sum += n;
    }
    for (int r = 0; r < S.olds; r++)
      for (int s = S.old[RUN_INTEGERS * r]; s < S.old[RUN_INTEGERS * r + 1]; s++) S.middle[S.bin[S.inner[s]]++] = s;
    int line = 0, slot = 0, b = 0;
    for (int x = 0; x < S.dim[0]; x++)
      for (int y = 0; y < S.dim[1]; y++)
        for (int z = 0; z < S.dim[2]; z++, line++) {
          int n = S.count[line];
          if (!n) continue;
          int *record = S.block + BLOCK_INTEGERS * b++;
          record[0] = slot;
          record[1] = slot + n;
          record[2] = x;
          record[3] = y;
          record[4] = z;
          S.count[line] = slot;
          slot += (n + 7) & ~7;
          for (int k = 0; k < 27; k++)
            if (near(S.edge[line], k)) S.table[reached(S, line, k)] = 0;
        }
    for (int i = 0; i < S.slots; i++) S.order[i] = -1;
    for (int i = 0; i < sum; i++) S.order[S.count[S.line[S.middle[i]]]++] = S.middle[i];
    line = S.pool = 0;
    for (int x = 0; x < S.dim[0]; x++)
      for (int y = 0; y < S.dim[1]; y++)
        for (int z = 0; z < S.dim[2]; z++, line++) {
          if (S.table[line] < 0) continue;
          int *w = S.where + 4 * S.pool;
          w[0] = x;
          w[1] = y;
          w[2] = z;
          w[3] = 0;
          S.table[line] = S.pool++;
        }
    // The last is empty: it represents neighbours out of reach.
    const int none = S.pool++;
    for (int d = 0; d < 4; d++) S.where[4 * none + d] = 0;
    for (b = 0; b < S.blocks; b++) {
      int *record = S.block + BLOCK_INTEGERS * b;
      line = (record[2] * S.dim[1] + record[3]) * S.dim[2] + record[4];
      for (int k = 0; k < 27; k++)
        record[NEIGHBOURS + k] = near(S.edge[line], k) ? S.table[reached(S, line, k)] : none;
    }
  }
  // A particle reaches its cell's node and two more, and may move by a cell: along each axis the
  // block below (1, 2, 4) from the first cell only, the block above (8, 16, 32) from all others.
  static inline int edges(int inner) {
    int bits = 0;
    for (int d = 0; d < 3; d++) bits |= (inner >> (4 - 2 * d) & 3 ? 8 : 1) << d;
    return bits;
  }
  static inline bool near(int edge, int k) {
    const int step[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
    bool in = true;
    for (int d = 0; d < 3; d++) in &= step[d] == 0 || (edge >> (step[d] < 0 ? d : 3 + d) & 1);
    return in;
  }
  static inline int reached(const Sorting &S, int line, int k) {
    return line + ((k / 9 - 1) * S.dim[1] + k / 3 % 3 - 1) * S.dim[2] + k % 3 - 1;
  }
  // Copy some blocks' particles; padding of a batch is placed at its block's first particle.
  static void copy(const Sorting &S, int low, int high) {
    for (int b = low; b < high; b++) {
      const int *record = S.block + BLOCK_INTEGERS * b;
      for (int s = record[0]; s < record[1]; s += 8) {
        float *q = S.to + (size_t)s * CHANNELS, *past = S.past_to + (size_t)s * HISTORY_CHANNELS;
        for (int l = 0; l < 8; l++) {
          int source = S.order[s + l], there = source < 0 ? S.order[record[0]] : source;
          const float *p = S.part + (size_t)(there & ~7) * CHANNELS + (there & 7);
          for (int k = 0; k < CHANNELS; k++) q[8 * k + l] = p[8 * k];
          if (S.flows) {
            const float *h = S.history + (size_t)(there & ~7) * HISTORY_CHANNELS + (there & 7);
            for (int k = 0; k < HISTORY_CHANNELS; k++) past[8 * k + l] = h[8 * k];
          }
          if (S.relaxes) {
            const float *e = S.branch + (size_t)(there & ~7) * MAXWELL_CHANNELS + (there & 7);
            float *to = S.branch_to + (size_t)s * MAXWELL_CHANNELS;
            for (int k = 0; k < MAXWELL_CHANNELS; k++) to[8 * k + l] = e[8 * k];
          }
          if (source >= 0) continue;
          q[8 * MA + l] = 0;
          ((int *)q)[8 * ID + l] = -1;
          for (int k = VE; k < AF + 9; k++) q[8 * k + l] = 0;
        }
        for (int d = 0; d < 3; d++) *(i8u *)(q + 8 * (XI + d)) -= (S.low[d] - 1) * (4 << PLACE);
      }
    }
  }
};
if (stage == SORT_SURVEY) Stage::survey(S);
if (stage == COUNT) Stage::count(S);
if (stage == RANK) Stage::rank(S);
if (stage == SORT_COPY) Stage::copy(S, low, high);
