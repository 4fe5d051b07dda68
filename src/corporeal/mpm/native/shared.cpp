// What every native piece shares. Warp pastes each piece into a function body, so helpers are
// static members of local structs. Vectors are GCC/clang extensions: they compile on any CPU.
typedef float f8 __attribute__((vector_size(32)));
typedef int i8 __attribute__((vector_size(32)));
typedef float f8u __attribute__((vector_size(32), aligned(4)));
typedef int i8u __attribute__((vector_size(32), aligned(4)));
typedef unsigned long long u64;
typedef float Row[8];
typedef int Call(void);

// A particle's place is fixed point: 2^22 units per cell, relative to its field's window.
const int PLACE = 22, UNIT = 1 << 22, HALF = 1 << 21;
constexpr float PER_UNIT = 1.0f / 4194304.0f;

// Channels of a particle batch [channel][8]. Velocity gradients are per cell: dx times the usual.
const int XI = 0, VE = 3, AF = 6, DE = 15, ST = 24, MA = 30, VO = 31, MT = 32, ID = 33, NC = 34;
// Channels of what batches of matter that flows remember besides.
const int EP = 0, VC = 1, TM = 2, NH = 11;
// Columns of the table of materials.
const int LAW = 0, MU = 1, LAMBDA = 2, YIELD = 3, HARD = 4, CONE = 5, APEX = 6, VISC = 7, KEEP = 8,
          RHO = 9, PUSH = 10, NM = 16;
// Columns of a task's report.
const int SPEED2 = 0, WAVE2 = 1, PLASTIC = 2, VISCOUS = 3, ASTRAY = 4, WORK = 5, NR = 8;
// Nodes from one layer of an arena of 8 x 8 x 8 to the next: with 64, what is read in the third layer
// would wait for what was just written in the first, 4096 bytes before.
const int LAYER = 66, ARENA = 8 * LAYER;
const int COLOURS = 8;  // of tasks on particles: those of one colour never overlap
const int NB = 32;      // ints of a block's record: start, end, coordinates 3, neighbours 27
const int MOST = 6;     // fields that may meet at one node

struct Post {             // one thread's, on a cache line of its own
  u64 share;              // its tasks of this phase: epoch 24 bits, next 20, end 20
  u64 busy, spare[6];
};
struct Crew {
  Call *nap;              // the system's sched_yield, or null
  int *phase;             // [phases][4]: piece, first task, how many, or where in World that stands
  int phases, threads, now, piece, first, count, started, spare;
  u64 fill0[2];
  int epoch, stopped;     // a line of their own
  u64 fill1[7];
  int done, spare2;
  u64 fill2[7];
  Post post[64];
};
struct Bond {               // a frame and the soft nodes it holds in this step: see bond.py
  int *slot;
  float *mass, *volume;
  double *point;            // [points][4] near the soft body: place in the frame's frame, volume
  double per_soft;          // volume per mass [m^3/kg]
  int frame, soft, points, count;
};
struct Thing {            // a body, as far as uniform accelerations go
  double mass, push[3], from, to;
  double *rigid;
  int field, first, last, spare;    // rows of the field's materials
};
struct Clock {
  Thing *thing;
  double *external_impulse, *push_work;
  double until, given, stable, speed, wave, smallest, largest, gravity[3], ramp;
  double courant, rigid_courant, fall;
  long long count, budget;
  int things, started, last, laid, fuse, fused, pushed, spare;
};
// Nodes: mass, momentum 3, force of stress 3, mass times height over the node [cells] along "level",
// or times J - 1 where the field swells; after the forces mass, velocity 3, velocity as it was 3, mean
// height or swelling. While a step reads its nodes, the next one's are laid.
struct Field {
  float *part, *node, *next, *history, *material;
  int *table, *block, *where;
  int *used;                // which of the two sets of nodes hold anything in a node block: bits
  u64 *near;
  int *home, *box;          // block of particles at a node block, -1: none; lowest, highest place in it
  u64 *have;                // nodes with mass of each node block, once forces have acted
  double *point;            // rigid: [P][5] place in the body's frame, mass, volume
  double *rigid;            // rigid: its state, see rigid.cpp
  double *surface;          // rigid: [S][3] in the body's frame
  double *clump;            // rigid: [clumps][6] first and last point, middle, radius
  double mass, slowing;     // slowing: how much viscosity shortens steps
  int origin[3], dim[3];    // in blocks; the window's corner and size
  int blocks, pool, rigids, points, surfaces, pushed, swells, flows;
  int floor;                // the only plane that the window reaches, or -1
  float level[3];           // its normal, or 0
  int side, clumps;         // side: of the two sets of nodes, which this step reads
};
struct Blow {               // a body in the wind: see blow.py
  double *area, *point, *rigid, *impulse, *signal;
  int *face;
  double wind[3], gust, start, end, half_rho_c, work;
  int field, first, count, free;
};
struct Tether {             // particles of a field on springs to a rigid body: see springs.py
  double *anchor, *rate, *holder;
  double damping, lost;
  int field, first, count;
};
struct Joint {              // two rigid bodies: arms in their own frames
  double *first, *second;
  double arm_first[3], arm_second[3], stiffness, damping, lost;
};
struct Grip {               // a spring from a body to a point outside: see grip.py
  double *share, *rigid, *impulse;
  double arm[3], target[3], stiffness, damping, mass, work;
  int field, first, count;
};
struct World {
  Crew *crew;
  Clock *clock;
  Field *field;
  int *task, *list, *contact_memory;
  double *report, *plane, *friction, *restitution;
  double *plane_impulse, *pair_impulse, *friction_loss, *first_contact, *last_contact;
  double *contact_point, *face;
  Blow *blow;
  Bond *bond;
  Tether *tether;
  Joint *joint;
  Grip *grip;
  double dx, dt, time, kick[3];
  int fields, planes, tasks, full;
  int names, again;   // bodies and planes in the books; a repeated call after more memory
  int blows, blown, bonds;   // bodies in the wind; tasks on them
  int tethers, joints, grips, sprung;   // sprung: whether there is any of them
  int stop;           // why the steps end after this phase; 0: they go on
  int nodes, colour[COLOURS];            // tasks on nodes, and on particles of each colour
  int bare_nodes, bare[COLOURS];          // the same where this step's nodes are still to be laid
  int stands;                       // tasks on nodes that may stand on a plane
  int parts, looks[COLOURS];              // tasks on contacts, and on particles for contact; 0 without any
  int rigids, turns;                // fields, where some are rigid; tasks to look at those
};

struct Simd {
  static inline f8 all(float a) { return f8{a, a, a, a, a, a, a, a}; }
  static inline f8 pick(i8 m, f8 a, f8 b) { return m ? a : b; }
  static inline f8 root(f8 a) { return __builtin_elementwise_sqrt(a); }
  static inline f8 high(f8 a, f8 b) { return a > b ? a : b; }
  static inline f8 low(f8 a, f8 b) { return a < b ? a : b; }
  static inline f8 size(f8 a) { return (f8)((i8)a & 0x7fffffff); }
  static inline bool any(i8 m) {
    return m[0] | m[1] | m[2] | m[3] | m[4] | m[5] | m[6] | m[7];
  }
  static inline float most(f8 a) {
    a = high(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
    a = high(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
    return high(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6))[0];
  }
  static inline f8 flo(i8 a) { return __builtin_convertvector(a, f8); }
  static inline i8 whole(f8 a) { return __builtin_convertvector(a, i8); }
  // J - 1 of a batch, of H = F - 1.
  static inline f8 swelling(const float *q) {
    f8 H[9];
    for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
    f8 minors = H[0] * H[4] - H[1] * H[3] + H[0] * H[8] - H[2] * H[6] + H[4] * H[8] - H[5] * H[7];
    f8 det = H[0] * (H[4] * H[8] - H[5] * H[7]) - H[1] * (H[3] * H[8] - H[5] * H[6]) +
             H[2] * (H[3] * H[7] - H[4] * H[6]);
    return H[0] + H[4] + H[8] + minors + det;
  }
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
  // Quadratic B-spline weights at a fraction f in [0.5, 1.5).
  static inline void spline(f8 f, f8 *w) {
    f8 a = 1.5f - f, b = f - 1.0f, c = f - 0.5f;
    w[0] = 0.5f * a * a;
    w[1] = 0.75f - b * b;
    w[2] = 0.5f * c * c;
  }
  // Nodes of a block's arena that its particles reach, first and last along each axis; and the
  // lowest and highest places of its particles, six.
  static inline void range(const Field &field, const int *block, int *low, int *high, int *box) {
    for (int d = 0; d < 3; d++) {
      const i8 zero = i8{0, 0, 0, 0, 0, 0, 0, 0};
      i8 least = zero + 0x7fffffff, most = ~least;
      for (int s = block[0]; s < block[1]; s += 8) {
        i8 x = *(const i8u *)(field.part + (size_t)s * NC + 8 * (XI + d));
        if (block[1] - s < 8) x = i8{0, 1, 2, 3, 4, 5, 6, 7} < block[1] - s ? x : zero + x[0];
        least = x < least ? x : least;
        most = x > most ? x : most;
      }
      box[d] = __builtin_reduce_min(least);
      box[3 + d] = __builtin_reduce_max(most);
      const int first = 4 * block[2 + d] - 1;
      low[d] = ((box[d] - HALF) >> PLACE) - first;
      high[d] = ((box[3 + d] - HALF) >> PLACE) - first;
      low[d] = low[d] < 0 ? 0 : low[d] > 5 ? 5 : low[d];
      high[d] = (high[d] < 0 ? 0 : high[d] > 5 ? 5 : high[d]) + 2;
    }
  }
  // Of a batch in a block: distances from the first node, weights of 27 nodes, and the first node's
  // place in the block's arena of 8 x 8 x 8. Who strayed is kept inside: its step counts no more.
  static inline void weights(const float *q, const int *block, f8 *D, Row *W, int *base) {
    f8 w[3][3];
    const i8 zero = i8{0, 0, 0, 0, 0, 0, 0, 0};
    i8 at = zero;
    for (int d = 0; d < 3; d++) {
      i8 x = *(const i8u *)(q + 8 * (XI + d)), cell = (x - HALF) >> PLACE;
      D[d] = flo(x - (cell << PLACE)) * PER_UNIT;
      spline(D[d], w[d]);
      cell -= 4 * block[2 + d] - 1;
      cell = cell < 0 ? zero : cell > 5 ? zero + 5 : cell;
      at += cell * (d == 0 ? LAYER : d == 1 ? 8 : 1);
    }
    *(i8 *)base = at;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        f8 wij = w[0][i] * w[1][j];
        for (int k = 0; k < 3; k++) *(f8 *)W[(i * 3 + j) * 3 + k] = wij * w[2][k];
      }
  }
};
// Numbers too small for float32's full precision cost a hundred times as much as zero, and come in
// crowds where motion dies out: they count as zero inside a piece.
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
