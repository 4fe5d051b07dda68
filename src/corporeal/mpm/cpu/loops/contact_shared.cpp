// Shared by the contact pieces. Their order: start, mark, find, stand, list, look, face, reach, choose,
// solve, resolve. Same formulas as physics/contact.py and reference/contact.py; docs/explanation/contact.md.
// Offsets, gaps and normals' supports are in cells; velocities, masses and impulses SI.
const int WALLS = 32;     // planes that a block of nodes may reach
const int ENTRIES = 8;    // last entries that are searched

typedef float f4 __attribute__((vector_size(16), aligned(4)));

typedef mpm::Face<double> Face;
using mpm::ImpactSupport;
using mpm::Coulomb;
using mpm::Impact;
using mpm::Scatter;
using mpm::WallStress;
struct Body6 {            // a rigid body's state
  // A body of prescribed motion keeps its given spin.
  static inline void spin_up(double *s) {
    if (s[INVERSE_MASS] == 0) return;
    mpm::Body::inverse_inertia(s + TURN, s + REST_INVERSE_INERTIA, s + INERTIA);
    Vec::apply(s + INERTIA, s + MOMENT, s + SPIN);
  }
  static inline void velocity(const double *s, const double *x, double *v) {
    double r[3] = {x[0] - s[CENTRE], x[1] - s[CENTRE + 1], x[2] - s[CENTRE + 2]};
    mpm::Body::velocity(s + SPEED, s + SPIN, r, v);
  }
};
struct Grid {
  static inline int floor_int(double a) {
    int i = (int)a;
    return i - (a < i);
  }
  static inline int block(const Field &f, const int *at) {         // block of the world to its slot
    int x = at[0] - f.origin[0], y = at[1] - f.origin[1], z = at[2] - f.origin[2];
    if (x < 0 || y < 0 || z < 0 || x >= f.dim[0] || y >= f.dim[1] || z >= f.dim[2]) return -1;
    return f.table[(x * f.dim[1] + y) * f.dim[2] + z];
  }
  static inline int node(const int *at) { return (at[0] & 3) << 4 | (at[1] & 3) << 2 | (at[2] & 3); }   // in its block
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
  // Whether a field is a liquid that slides along a plane: its pressure pushes every node whose spline
  // reaches the plane.
  static inline bool slides(const World *w, int field, int plane) {
    const int all = w->fields + w->planes;
    return w->field[field].pours && w->friction[field * all + w->fields + plane] < mpm::STICKING_FRICTION;
  }
  // Whether a liquid sticks to another field or to a plane, which then drags on it.
  static inline bool sticks(const World *w, int field, int other) {
    return w->field[field].pours && w->friction[field * (w->fields + w->planes) + other] >= mpm::STICKING_FRICTION;
  }
  // How high nodes of a field can touch a plane [cells].
  static inline double reach(const World *w, int field) {
    if (w->field[field].is_shell) return mpm::SHELL_WALL_REACH_DX;
    return w->field[field].pours ? mpm::LIQUID_WALL_REACH_DX : mpm::WALL_REACH;
  }
  // Whether a block lies so high over a plane that none of its nodes can touch it.
  static inline bool over(const double *P, const int *at, double dx, double reach) {
    double h = -P[3];
    for (int d = 0; d < 3; d++) h += P[d] * (4.0 * at[d] + (P[d] > 0 ? 0 : 3)) * dx;
    return h > reach * dx;
  }
  // Nodes of a block that a plane may touch.
  static inline u64 wall(const double *P, const int *at, double dx, double reach) {
    double h[3][4];
    for (int d = 0; d < 3; d++)
      for (int k = 0; k < 4; k++) h[d][k] = P[d] * (4 * at[d] + k) * dx;
    const double top = P[3] + reach * dx;
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

// The pairs of a block's fields that meet somewhere in it, where, and their first lean.
struct Pairs {
  enum { MOST = FIELDS_IN_BLOCK * (FIELDS_IN_BLOCK - 1) / 2, NONE = 255 };
  unsigned char a[MOST], c[MOST];
  u64 nodes[MOST];
  int lean[MOST], count;
  Pairs(const Junction &J) : count(0) {
    int next = J.touch;
    for (int first = 0; first < J.fields; first++)
      for (int met = J.met[first]; met; met &= met - 1) {
        const int second = __builtin_ctz(met);
        a[count] = (unsigned char)first;
        c[count] = (unsigned char)second;
        nodes[count] = J.have[first] & J.have[second];
        lean[count] = next;
        next += Grid::count(nodes[count++]);
      }
  }
};

// The planes that a block of nodes may touch, and its nodes that may.
struct Walls {
  int plane[WALLS], count;
  u64 near[WALLS], wide[WALLS], shell[WALLS];   // wide: of liquids
  Walls(const World *w, const int *at) : count(0) {
    const bool shells = ((const Stage *)w->contact_memory)->spread != 0;
    const bool farther = shells && mpm::SHELL_WALL_REACH_DX > mpm::LIQUID_WALL_REACH_DX;
    const double reach = farther ? mpm::SHELL_WALL_REACH_DX : mpm::LIQUID_WALL_REACH_DX;
    for (int v = 0; v < w->planes && count < WALLS; v++) {
      const double *P = w->plane + 4 * v;
      if (Grid::over(P, at, w->dx, reach)) continue;
      near[count] = Grid::wall(P, at, w->dx, mpm::WALL_REACH);
      wide[count] = Grid::wall(P, at, w->dx, mpm::LIQUID_WALL_REACH_DX);
      shell[count] = shells ? Grid::wall(P, at, w->dx, mpm::SHELL_WALL_REACH_DX) : 0;
      plane[count++] = v;
    }
  }
  // Which nodes of a field a plane may touch; where fields meet there may be a body between.
  inline u64 of(const World *w, int field, int number, u64 several) const {
    if (w->field[field].is_shell) return shell[number];
    return near[number] | (w->field[field].pours ? wide[number] & ~several : 0);
  }
};

// A batch's particles and the nodes that they reach: low to high + 2.
struct Nearby {
  u64 box;                  // of nodes, in one layer
  i8 lanes, in[3][8];       // in: whose splines reach each layer of nodes
  f8 at[3];                 // places in their block's arena
  int low[3], high[3];      // cells in it
  // Cells of a batch in their block's arena.
  static inline i8 cells(const int *record, const float *q, int d) {
    return ((*(const i8u *)(q + 8 * (XI + d)) - HALF_CELL_UNITS) >> PLACE) - (4 * record[2 + d] - 1);
  }
  // Layers: nodes of the arena that are asked for, a bit for each.
  inline bool find(const int *record, const float *q, int s, const u64 *layers) {
    lanes = i8{0, 1, 2, 3, 4, 5, 6, 7} < record[1] - s;
    i8 cell[3];
    for (int d = 0; d < 3; d++) {
      cell[d] = cells(record, q, d);
      low[d] = __builtin_reduce_min(lanes ? cell[d] : i8{} + 8);
      high[d] = __builtin_reduce_max(lanes ? cell[d] : i8{} - 8);
    }
    const u64 row = (255ull >> (5 - high[2] + low[2])) << low[2], rows = row * 0x0101010101010101ull;
    box = rows & (~0ull >> (8 * (5 - high[1]))) & (~0ull << (8 * low[1]));
    u64 some = 0;
    for (int i = low[0]; i <= high[0] + 2; i++) some |= layers[i];
    if (!(some & box)) return false;
    for (int d = 0; d < 3; d++) {
      at[d] = Simd::flo(*(const i8u *)(q + 8 * (XI + d)) - ((4 * record[2 + d] - 1) << PLACE)) * PER_UNIT;
      for (int i = low[d]; i <= high[d] + 2; i++) {
        const i8 from = i - cell[d];
        in[d][i] = lanes & (from >= 0) & (from <= 2);
      }
    }
    return true;
  }
};

// Nodes of a block's arena that its particles reach, neighbour by neighbour.
struct Reached {
  u64 axis[3][3];
  Reached(const Field &field, const int *record) {
    const int *box = field.box + 6 * ((record - field.block) / BLOCK_INTEGERS);
    const u64 layer[3] = {0xffffull, 0x000f000f000f000full, 0x1111111111111111ull};
    const int step[3] = {16, 4, 1};
    for (int d = 0; d < 3; d++) {
      const int first = 4 * (record[2 + d] - 1);   // of the neighbour below
      const int low = ((box[d] - HALF_CELL_UNITS) >> PLACE) - first, high = ((box[3 + d] - HALF_CELL_UNITS) >> PLACE) - first + 2;
      for (int n = 0; n < 3; n++) {
        axis[d][n] = 0;
        for (int k = 0; k < 4; k++)
          if (4 * n + k >= low && 4 * n + k <= high) axis[d][n] |= layer[d] << (step[d] * k);
      }
    }
  }
  inline u64 nodes(int n) const { return axis[0][n / 9] & axis[1][n / 3 % 3] & axis[2][n % 3]; }
};

// Nodes of a block's arena that are listed.
struct Asked {
  u64 layers[8];            // layer by layer, a bit for each
  u64 cells[6];             // cells whose particles reach one of them
  int at[512], side[512], count;   // where each is in the arena, and the field's side there
  bool several;             // fields meet at some of them, so that gradients are needed
  Asked(const Stage *stage, const Field &field, int number, const int *record) : layers{}, count(0), several(false) {
    int listed[27], any = 0;
    for (int n = 0; n < 27; n++) any |= listed[n] = field.where[4 * record[NEIGHBOURS + n] + 3];
    if (!any) return;
    const Reached reached(field, record);
    for (int n = 0; n < 27; n++)
      if (listed[n]) list(stage, stage->junction[listed[n] - 1], number, n, reached.nodes(n) & Grid::arena(n));
    for (int x = 0; x < 6; x++) {
      u64 m = layers[x] | layers[x + 1] | layers[x + 2];
      m |= m >> 8 | m >> 16;
      cells[x] = m | m >> 1 | m >> 2;
    }
  }
  // Nodes of one neighbour. Sides are numbered node by node, and at a node field by field.
  inline void list(const Stage *stage, const Junction &J, int number, int n, u64 mine) {
    int q = 0;
    while (q < J.fields && J.field[q] != number) q++;
    if (q == J.fields) return;
    mine &= J.mask & J.have[q];
    several |= (mine & J.several) != 0;
    const int corner = (4 * (n / 9 - 1) + 1) * 64 + (4 * (n / 3 % 3 - 1) + 1) * 8 + 4 * (n % 3 - 1) + 1;
    for (; mine; mine &= mine - 1) {
      const int i = __builtin_ctzll(mine), node = corner + (i >> 4) * 64 + (i >> 2 & 3) * 8 + (i & 3);
      int s = stage->meet[Grid::meet(J, i)].side;
      for (int k = 0; k < q; k++) s += (int)(J.have[k] >> i & 1);
      __builtin_prefetch(stage->side[s].mean, 1);
      layers[node >> 6] |= 1ull << (node & 63);
      at[count] = node;
      side[count++] = s;
    }
  }
  inline bool by(int cell) const { return cells[cell >> 6] >> (cell & 63) & 1; }
  inline void empty(f8 *arena) const {
    for (int row = 0; row < 64; row++)
      if (layers[row >> 3] >> (8 * (row & 7)) & 255)
        for (int k = 0; k < 8; k++) arena[8 * row + k] = Simd::all(0.0f);
  }
};

// Half the walls of a batch's vertices of shells [cells], else 0.
struct HalfWall {
  static inline f8 of(const Field &field, const float *q, int live) {
    f8 wall = Simd::all(0.0f);
    for (int l = 0; l < 8 && l < live; l++) wall[l] = field.half_wall[((const int *)(q + 8 * ID))[l]];
    return wall;
  }
};

// Choices of the last step, by block and pair.
struct Kept {
  static inline int first(const Stage *stage, const Choice &C) {
    u64 key = 0;
    const int parts[5] = {C.at[0], C.at[1], C.at[2], C.a, C.c};
    for (int i = 0; i < 5; i++) key = (key ^ (u64)(unsigned)parts[i]) * 0x9e3779b97f4a7c15ull;
    return (int)(key >> 32) & (stage->kept_slots - 1);
  }
  static inline const Choice *find(const Stage *stage, const Choice &C) {
    if (!stage->kepts) return 0;
    for (int at = first(stage, C);; at = (at + 1) & (stage->kept_slots - 1)) {
      if (!stage->kept_slot[at]) return 0;
      const Choice &K = stage->kept[stage->kept_slot[at] - 1];
      if (K.a == C.a && K.c == C.c && K.at[0] == C.at[0] && K.at[1] == C.at[1] && K.at[2] == C.at[2]) return &K;
    }
  }
  // Keep this step's choices for the next one.
  static inline void keep(Stage *stage) {
    Choice *free = stage->kept;
    stage->kept = stage->choice;
    stage->choice = free;
    stage->kepts = stage->choices;
  }
  // Build their lookup table, empty if all are chosen anew.
  static inline void enter(Stage *stage) {
    if (stage->anew) stage->kepts = 0;
    if (!stage->kepts) return;
    stage->kept_slots = 64;
    while (stage->kept_slots < 2 * stage->kepts) stage->kept_slots *= 2;
    for (int i = 0; i < stage->kept_slots; i++) stage->kept_slot[i] = 0;
    for (int k = 0; k < stage->kepts; k++) {
      int at = first(stage, stage->kept[k]);
      while (stage->kept_slot[at]) at = (at + 1) & (stage->kept_slots - 1);
      stage->kept_slot[at] = k + 1;
    }
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
Lean *leans = stage->lean;
Choice *choices = stage->choice;
