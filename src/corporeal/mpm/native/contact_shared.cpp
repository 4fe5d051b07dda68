// What the contact pieces share. Their order: start, mark, find, stand, list, look, face, reach, choose,
// solve, settle. Same formulas as contact.py and encounter.py; design: physics, section 2 C to G.
// Offsets, gaps and normals' supports are in cells; velocities, masses and impulses SI.
const int CENTRE = 1, TURN = 4, REST = 13, SPEED = 22, MOMENT = 25, INERTIA = 28, SPIN = 37,
          RADIUS = 40, KICK = 41, BOX = 48;
constexpr double WALL_REACH = 0.51, LATTICE_GAP = 0.05, LATTICE_SLOPE = 0.25, LATTICE_START = 0.7,
             DEEPEST = 1.25, POINT_REACH = 0.3;
const int HERE = 12;      // fields in one block of nodes
const int PARTS = 16;     // parts that a list is cut into, whoever works on them
const int WALLS = 32;     // planes that a block of nodes may reach
const int ENTRIES = 8;    // entries looked back at

typedef float f4 __attribute__((vector_size(16), aligned(4)));

struct Junction {         // a block of nodes where fields meet each other or a plane
  int at[3], fields, meet, side, touch, last;
  int field[HERE], block[HERE];
  u64 mask, several, have[HERE];
  int met[HERE];            // of the fields here, those that each may meet: bits
};
struct Meet {             // one such node
  int at[3], side, sides, touch, touches, stiff;
};
struct Side {             // one field there
  int field, slot;
  float m, mean[3], out[3];
  double v[3], inverse;
};
struct Aim {              // candidate normals of a possible contact of two fields
  float n[3][4];          // component by component
  float far[2][4];        // how far the first reaches along them, and the second against them
  int fa, fc;             // the fields; -1 for a plane
  float chosen[3], weight;
};
struct Touch {            // a possible contact of side a with side c, or with plane -1 - c
  int meet, a, c, fa, fc, active, bounce, spare;
  double x[3], normal[3], gap, target, inverse, mu, approach, J[3], before[3];
};
struct Entry {            // what some contacts of one pair add to the books
  int a, c;
  double normal, place[3], J[3], loss;
};
struct Past {             // force of a contact in the last step
  u64 key;
  double force[3];
};
struct Line {              // a contact in the list of those that move rigid bodies
  double *a, *c;          // velocity of a node or state of a rigid body; 0: a plane
  double ma, mc;          // inverse masses of nodes; negative: a rigid body
  double n[3], ra[3], rc[3], K[6], inverse, target, mu, J[3];
  u64 key;
  int touch, group;
};
struct Stage {
  Junction *junction;
  Meet *meet;
  Side *side;
  Touch *touch;
  Aim *aim;
  Entry *entry, *stand;
  Line *line;
  Past *past;
  int *slot;              // where each past contact stands, by its key; slots: a power of two
  double *pair;           // [all][all][8]
  int *order;
  int most_junctions, most_meets, most_sides, most_touches;
  int slots, pasts, sweeps;
  int junctions, meets, sides, touches, points;
  int entries[PARTS];
};

static_assert(sizeof(Junction) <= 304 && sizeof(Meet) <= 32 && sizeof(Side) <= 72 &&
                  sizeof(Touch) <= 168 && sizeof(Aim) <= 104 && sizeof(Entry) <= 72 && sizeof(Past) <= 32 && sizeof(Line) <= 248,
              "as memory.py says");

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
  static inline void times(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
  }
  static inline void times_transposed(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) C[3 * i + j] = dot(A + 3 * i, B + 3 * j);
  }
  static inline int floor_int(double a) {
    int i = (int)a;
    return i - (a < i);
  }
};
struct Body6 {            // a rigid body's state
  static inline void turn(const double *s, const double *w, double dt, double *Q) {
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
};
struct Grid {
  static inline int block(const Field &f, const int *at) {         // block of the world to its slot
    int x = at[0] - f.origin[0], y = at[1] - f.origin[1], z = at[2] - f.origin[2];
    if (x < 0 || y < 0 || z < 0 || x >= f.dim[0] || y >= f.dim[1] || z >= f.dim[2]) return -1;
    return f.table[(x * f.dim[1] + y) * f.dim[2] + z];
  }
  static inline u64 below(int i) { return (1ull << i) - 1; }
  static inline int count(u64 m) { return __builtin_popcountll(m); }
  static inline int meet(const Junction &J, int i) { return J.meet + count(J.mask & below(i)); }
  // Nodes of neighbour n of 27 that lie in a block's arena, which has one node before it and three
  // after it; or, with a margin, in the block and one layer around it.
  static inline u64 arena(int n) {
    const u64 x[3] = {0xffff000000000000ull, ~0ull, 0x0000ffffffffffffull},
              y[3] = {0xf000f000f000f000ull, ~0ull, 0x0fff0fff0fff0fffull},
              z[3] = {0x8888888888888888ull, ~0ull, 0x7777777777777777ull};
    return x[n / 9] & y[n / 3 % 3] & z[n % 3];
  }
  static inline u64 margin(int n) {
    const u64 x[3] = {0xffff000000000000ull, ~0ull, 0x000000000000ffffull},
              y[3] = {0xf000f000f000f000ull, ~0ull, 0x000f000f000f000full},
              z[3] = {0x8888888888888888ull, ~0ull, 0x1111111111111111ull};
    return x[n / 9] & y[n / 3 % 3] & z[n % 3];
  }
  // Whether a block lies so high over a plane that none of its nodes can touch it.
  static inline bool over(const double *P, const int *at, double dx) {
    double h = -P[3];
    for (int d = 0; d < 3; d++) h += P[d] * (4.0 * at[d] + (P[d] > 0 ? 0 : 3)) * dx;
    return h > WALL_REACH * dx;
  }
  // Nodes of a block that a plane may touch.
  static inline u64 wall(const double *P, const int *at, double dx) {
    double h[3][4];
    for (int d = 0; d < 3; d++)
      for (int k = 0; k < 4; k++) h[d][k] = P[d] * (4 * at[d] + k) * dx;
    const double top = P[3] + WALL_REACH * dx;
    u64 mask = 0;
    for (int i = 0; i < 4; i++)
      for (int j = 0; j < 4; j++) {
        double left = top - h[0][i] - h[1][j];
        u64 row = (h[2][0] <= left) | (h[2][1] <= left) << 1 | (h[2][2] <= left) << 2 |
                  (h[2][3] <= left) << 3;
        mask |= row << (16 * i + 4 * j);
      }
    return mask;
  }
};

// Those of a batch's particles that reach listed nodes, and the nodes around them: low to high + 2.
struct Nearby {
  i8 lanes, in[3][8];       // in: whose splines reach each layer of nodes
  f8 at[3];                 // places in their block's arena
  int low[3], high[3];      // cells in it
  // Cells of a batch in their block's arena.
  static inline i8 cells(const int *record, const float *q, int d) {
    return ((*(const i8u *)(q + 8 * (XI + d)) - HALF) >> PLACE) - (4 * record[2 + d] - 1);
  }
  // Whether a cell's particles reach listed nodes. Kind: 0 where fields meet anything, 1 where they
  // meet each other.
  static inline int listed(const Field &field, const int *record, int x, int y, int z, int kind) {
    x += 3;
    y += 3;
    z += 3;
    const int other = record[5 + ((x >> 2) * 3 + (y >> 2)) * 3 + (z >> 2)];
    return (int)(field.near[2 * other + kind] >> ((x & 3) * 16 + (y & 3) * 4 + (z & 3)) & 1);
  }
  static inline bool any(const Field &field, const int *record, const float *q, int s, int kind) {
    const int live = record[1] - s < 8 ? record[1] - s : 8;
    alignas(32) int home[3][8];
    for (int d = 0; d < 3; d++) *(i8 *)home[d] = cells(record, q, d);
    for (int l = 0; l < live; l++)
      if (listed(field, record, home[0][l], home[1][l], home[2][l], kind)) return true;
    return false;
  }
  inline bool find(const Field &field, const int *record, const float *q, int s, int kind) {
    const int live = record[1] - s < 8 ? record[1] - s : 8;
    alignas(32) int home[3][8], near[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    for (int d = 0; d < 3; d++) *(i8 *)home[d] = cells(record, q, d);
    bool some = false;
    for (int l = 0; l < live; l++) {
      near[l] = -listed(field, record, home[0][l], home[1][l], home[2][l], kind);
      some |= near[l];
    }
    if (!some) return false;
    lanes = *(i8 *)near;
    for (int d = 0; d < 3; d++) {
      const i8 cell = *(i8 *)home[d];
      at[d] = Simd::flo(*(const i8u *)(q + 8 * (XI + d)) - ((4 * record[2 + d] - 1) << PLACE)) * PER_UNIT;
      low[d] = __builtin_reduce_min(lanes ? cell : i8{} + 8);
      high[d] = __builtin_reduce_max(lanes ? cell : i8{} - 8);
      for (int i = low[d]; i <= high[d] + 2; i++) {
        const i8 from = i - cell;
        in[d][i - low[d]] = lanes & (from >= 0) & (from <= 2);
      }
    }
    return true;
  }
};

Stage *stage = (Stage *)world->contact_memory;
const double dx = world->dx, dt = world->dt, inv = 1.0 / dx;
const int fields = world->fields, planes = world->planes, all = fields + planes;
Junction *junctions = stage->junction;
Meet *meets = stage->meet;
Side *sides = stage->side;
Touch *touches = stage->touch;
Aim *aims = stage->aim;
