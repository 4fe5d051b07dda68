// Shared by every native piece. Warp pastes each piece into a function body, so helpers are
// static members of local structs. Formulas are not written here: mpm/formulas has them; nor are numbers
// and structs that Python knows: cpu/layout.py writes them in front.
using mpm::f8;
using mpm::i8;
using mpm::Vec;
typedef float f8u __attribute__((vector_size(32), aligned(4)));
typedef int i8u __attribute__((vector_size(32), aligned(4)));
typedef unsigned long long u64;
typedef float Row[8];
typedef int Call(void);
const int TOGETHER = 2;   // lanes in one cell that are moved at once
constexpr float PER_UNIT = 1.0f / CELL_UNITS;

struct Simd : mpm::Lanes<f8> {
  // Rows of eight lanes to lanes of eight rows.
  static inline void turn(f8 *r) {
    f8 a[8], b[8];
    for (int i = 0; i < 4; i++) {
      a[2 * i] = __builtin_shufflevector(r[2 * i], r[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
      a[2 * i + 1] = __builtin_shufflevector(r[2 * i], r[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    for (int i = 0; i < 2; i++) {
      b[4 * i] = __builtin_shufflevector(a[4 * i], a[4 * i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      b[4 * i + 1] = __builtin_shufflevector(a[4 * i], a[4 * i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
      b[4 * i + 2] = __builtin_shufflevector(a[4 * i + 1], a[4 * i + 3], 0, 1, 8, 9, 4, 5, 12, 13);
      b[4 * i + 3] =
          __builtin_shufflevector(a[4 * i + 1], a[4 * i + 3], 2, 3, 10, 11, 6, 7, 14, 15);
    }
    for (int i = 0; i < 4; i++) {
      r[i] = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
      r[i + 4] = __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
  }
  // Lowest and highest places of a block's particles, six.
  static inline void box(const Field &field, const int *block, int *box) {
    for (int d = 0; d < 3; d++) {
      const i8 zero = i8{0, 0, 0, 0, 0, 0, 0, 0};
      i8 least = zero + 0x7fffffff, most = ~least;
      for (int s = block[0]; s < block[1]; s += 8) {
        i8 x = *(const i8u *)(field.part + (size_t)s * CHANNELS + 8 * (XI + d));
        if (block[1] - s < 8) x = i8{0, 1, 2, 3, 4, 5, 6, 7} < block[1] - s ? x : zero + x[0];
        least = x < least ? x : least;
        most = x > most ? x : most;
      }
      box[d] = __builtin_reduce_min(least);
      box[3 + d] = __builtin_reduce_max(most);
    }
  }
  // Nodes of a block's arena that particles in a box reach, first and last along each axis.
  static inline void range(const int *block, const int *box, int *low, int *high) {
    for (int d = 0; d < 3; d++) {
      const int first = 4 * block[2 + d] - 1;
      low[d] = ((box[d] - HALF_CELL_UNITS) >> PLACE) - first;
      high[d] = ((box[3 + d] - HALF_CELL_UNITS) >> PLACE) - first;
      low[d] = low[d] < 0 ? 0 : low[d] > 5 ? 5 : low[d];
      high[d] = (high[d] < 0 ? 0 : high[d] > 5 ? 5 : high[d]) + 2;
    }
  }
  // Whether so many lanes from l on are in one cell.
  static inline bool together(const int *base, int l, int live) {
    if (l + TOGETHER > live) return false;
    bool same = true;
    for (int n = 1; n < TOGETHER; n++) same &= base[l] == base[l + n];
    return same;
  }
  // Of a batch in a block: distances from the first node, weights of 27 nodes, and the first node's
  // place in the block's arena of 8 x 8 x 8. A particle that strayed is kept inside: its step is discarded.
  static inline void weights(const float *q, const int *block, f8 *D, Row *W, int *base) {
    f8 w[3][3];
    const i8 zero = i8{0, 0, 0, 0, 0, 0, 0, 0};
    i8 at = zero;
    for (int d = 0; d < 3; d++) {
      i8 x = *(const i8u *)(q + 8 * (XI + d)), cell = (x - HALF_CELL_UNITS) >> PLACE;
      D[d] = flo(x - (cell << PLACE)) * PER_UNIT;
      mpm::Spline<f8>::weights(D[d], w[d]);
      cell -= 4 * block[2 + d] - 1;
      cell = cell < 0 ? zero : cell > 5 ? zero + 5 : cell;
      at += cell * (d == 0 ? ARENA_LAYER_NODES : d == 1 ? 8 : 1);
    }
    *(i8 *)base = at;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        f8 wij = w[0][i] * w[1][j];
        for (int k = 0; k < 3; k++) *(f8 *)W[(i * 3 + j) * 3 + k] = wij * w[2][k];
      }
  }
};
// Means over the particles of each 2 x 2 x 2 cells of a block, weighted by volume: of the dilatation of
// nearly incompressible matter and, as the adjoint, of its pressure (decision laws-mean-dilatation).
struct ClusterMean {
  float sum[64], volume[64];
  ClusterMean() {
    for (int k = 0; k < 64; k++) sum[k] = volume[k] = 0.0f;
  }
  // Cluster of each particle of a batch; a particle that strayed from the block has a cluster of its own.
  static inline i8 of(const float *q, const int *block) {
    i8 at = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int d = 0; d < 3; d++) {
      i8 x = *(const i8u *)(q + 8 * (XI + d));
      i8 pair = (((x - HALF_CELL_UNITS) >> PLACE) - 4 * block[2 + d] + 2) >> 1;
      pair = pair < 0 ? i8{0, 0, 0, 0, 0, 0, 0, 0} : pair > 3 ? i8{3, 3, 3, 3, 3, 3, 3, 3} : pair;
      at = 4 * at + pair;
    }
    return at;
  }
  inline void add(i8 at, int live, f8 v, f8 a) {
    for (int l = 0; l < live; l++) {
      sum[at[l]] += v[l] * a[l];
      volume[at[l]] += v[l];
    }
  }
  inline f8 mean(i8 at, int live) const {
    f8 a = Simd::all(0.0f);
    for (int l = 0; l < live; l++) a[l] = sum[at[l]] / volume[at[l]];
    return a;
  }
};
// Denormal float32 numbers cost a hundred times as much as zero, and come in
// large numbers where motion decays: they are flushed to zero inside a piece.
struct Flush {
#if defined(__SSE__)
  unsigned before = __builtin_ia32_stmxcsr();
  Flush() { __builtin_ia32_ldmxcsr(before | 0x8040); }
  ~Flush() { __builtin_ia32_ldmxcsr(before); }
#elif defined(__aarch64__)
  u64 before;
  Flush() {
    asm volatile("mrs %0, fpcr" : "=r"(before));
    asm volatile("msr fpcr, %0" : : "r"(before | (1ull << 24)));
  }
  ~Flush() { asm volatile("msr fpcr, %0" : : "r"(before)); }
#endif
} flush;
World *world = (World *)memory.data;
