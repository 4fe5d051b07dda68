// List the blocks where fields meet each other or a plane, and number what is in them. One task:
// it reads blocks, and their nodes only where fields meet.
struct Find {
  static inline bool apart(const Field &A, const Field &B) {
    for (int i = 0; i < 3; i++)
      if (A.origin[i] + A.dim[i] <= B.origin[i] || B.origin[i] + B.dim[i] <= A.origin[i]) return true;
    return false;
  }
  // Height of the lowest and highest corner of a box of blocks over a plane.
  static inline double lowest(const double *P, const Field &F, double dx) {
    double h = -P[3];
    for (int i = 0; i < 3; i++) {
      double a = 4.0 * F.origin[i] * dx, b = 4.0 * (F.origin[i] + F.dim[i]) * dx;
      h += P[i] * (P[i] > 0 ? a : b);
    }
    return h;
  }
  static inline u64 have(const Field &F, int block) {
    if (!F.rigids) return F.have[block];
    const float *node = F.node + (size_t)block * 512;
    u64 m = 0;
    for (int i = 0; i < 64; i++) m |= (u64)(node[8 * i] > 0.0f) << i;
    return m;
  }
};
// The box around a field's particles in a block of nodes and the blocks next to it [units].
struct Around {
  long long low[3], high[3];
  inline void begin() {
    for (int d = 0; d < 3; d++) low[d] = 1ll << 60, high[d] = -low[d];
  }
  inline void add(const Field &F, int home) {
    const int *box = F.box + 6 * home;
    for (int d = 0; d < 3; d++) {
      const long long shift = (long long)F.origin[d] * (4 << PLACE);
      if (shift + box[d] < low[d]) low[d] = shift + box[d];
      if (shift + box[3 + d] > high[d]) high[d] = shift + box[3 + d];
    }
  }
  inline void all(const Field &F) {
    begin();
    for (int home = 0; home < F.blocks; home++) add(F, home);
  }
  inline void up(const Field &F, const int *at) {
    begin();
    for (int n = 0; n < 27; n++) {
      const int there[3] = {at[0] + n / 9 - 1, at[1] + n / 3 % 3 - 1, at[2] + n % 3 - 1};
      const int b = Grid::block(F, there), home = b < 0 ? -1 : F.home[b];
      if (home >= 0) add(F, home);
    }
  }
  // Whether the particles in a block of nodes alone are not so far apart: nor are those around it then.
  static inline bool side_by_side(const Field &F, int f, const Field &G, int g, double far) {
    if (F.home[f] < 0 || G.home[g] < 0) return false;
    Around mine, other;
    mine.begin();
    mine.add(F, F.home[f]);
    other.begin();
    other.add(G, G.home[g]);
    return !apart(F, mine, G, other, far);
  }
  // Whether the particles of two fields are so far apart along an axis that no gap closes in a step.
  static inline bool apart(const Field &F, const Around &A, const Field &G, const Around &B, double far) {
    far += F.flows || G.flows ? mpm::LOOSE_CONTACT_REACH_DX : mpm::DENSE_CONTACT_REACH_DX;
    far += F.widest_wall + G.widest_wall;
    for (int d = 0; d < 3; d++)
      if (B.low[d] - A.high[d] > far * CELL_UNITS || A.low[d] - B.high[d] > far * CELL_UNITS) return true;
    return false;
  }
};
Bonds::hold(world);
const double meanwhile = 2.0 * world->clock->speed * dt * inv;
const int points = Points::most(world);
int count = 0, meet = 0, side = 0, touch = 0, choice = 0;
for (int f = 0; f < fields; f++) {
  Field &F = world->field[f];
  int near[64], nears = 0, wall_of[WALLS], walls = 0;
  Around mine, other;
  bool lone = true;         // although others are near
  if (!F.rigids) mine.all(F);
  for (int g = f + 1; g < fields && nears < 64; g++) {
    const Field &G = world->field[g];
    if (!G.pool || Find::apart(F, G)) continue;
    near[nears++] = g;
    if (lone && !F.rigids && !G.rigids) {
      other.all(G);
      lone = Around::apart(F, mine, G, other, meanwhile);
    } else {
      lone = false;
    }
  }
  for (int w = 0; w < planes && walls < WALLS; w++) {
    const double *P = world->plane + 4 * w;
    if (!F.pointed && F.floor < 0 && Find::lowest(P, F, dx) <= Grid::reach(world, f) * dx)
      wall_of[walls++] = w;
  }
  if (lone && !walls) continue;
  for (int b = 0; b < F.pool; b++) {
    int *w = F.where + 4 * b;
    if (w[3] || (!F.rigids && !F.have[b])) continue;
    Junction J;
    J.fields = 0;
    for (int i = 0; i < 3; i++) J.at[i] = w[i] + F.origin[i];
    J.field[J.fields] = f;
    J.block[J.fields++] = b;
    for (int i = 0; i < nears && J.fields < FIELDS_IN_BLOCK; i++) {
      int other = Grid::block(world->field[near[i]], J.at);
      if (other < 0) continue;
      J.field[J.fields] = near[i];
      J.block[J.fields++] = other;
    }
    bool low = false;
    for (int i = 0; i < walls; i++)
      low |= !Grid::over(world->plane + 4 * wall_of[i], J.at, dx, Grid::reach(world, f));
    if (J.fields < 2 && !low) continue;
    J.mask = J.several = 0;
    int found = 0;
    for (int q = 0; q < J.fields; q++) J.have[q] = Find::have(world->field[J.field[q]], J.block[q]);
    Around box[FIELDS_IN_BLOCK];
    int known = 0, pairs = 0;
    for (int q = 0; q < J.fields; q++) J.met[q] = 0;
    for (int a = 0; a < J.fields; a++)
      for (int c = a + 1; c < J.fields; c++) {
        if (world->friction[J.field[a] * all + J.field[c]] < 0) continue;   // bonded
        u64 both = J.have[a] & J.have[c];
        if (!both) continue;
        const Field &A = world->field[J.field[a]], &C = world->field[J.field[c]];
        if (!A.rigids && !C.rigids && !Around::side_by_side(A, J.block[a], C, J.block[c], meanwhile)) {
          if (!(known >> a & 1)) box[a].up(A, J.at);
          if (!(known >> c & 1)) box[c].up(C, J.at);
          known |= 1 << a | 1 << c;
          if (Around::apart(A, box[a], C, box[c], meanwhile)) continue;
        }
        J.met[a] |= 1 << c;
        pairs += !A.rigids && !C.rigids;
        J.several |= both;
        const bool wet = (A.patches && C.pours) || (C.patches && A.pours);
        found += Grid::count(both) * (wet ? mpm::MAX_WETTED_FACES : 1);
      }
    J.mask = J.several;
    // Planes, where a field may touch more than one; else they cost nothing but here: contact_stand.
    const Walls wall(world, J.at);
    for (int q = 0; q < J.fields; q++) {
      const Field &G = world->field[J.field[q]];
      if (G.floor >= 0 || G.pointed) continue;
      for (int v = 0; v < wall.count; v++) J.mask |= wall.of(world, J.field[q], v, J.several) & J.have[q];
    }
    for (int q = 0; q < J.fields; q++) {
      const Field &G = world->field[J.field[q]];
      if (G.pointed) continue;
      for (int v = 0; v < wall.count; v++)
        found += Grid::count(wall.of(world, J.field[q], v, J.several) & J.have[q] & J.mask);
    }
    if (!J.mask) continue;
    J.meet = meet;
    J.side = side;
    J.touch = touch;
    J.choice = choice;
    choice += pairs;
    meet += Grid::count(J.mask);
    for (int q = 0; q < J.fields; q++) side += Grid::count(J.mask & J.have[q]);
    touch += found;
    J.last = touch;
    if (count < stage->most_junctions) {
      junctions[count] = J;
      for (int q = 0; q < J.fields; q++)
        world->field[J.field[q]].where[4 * J.block[q] + 3] = count + 1;
    }
    count++;
  }
}
world->full = count > stage->most_junctions || meet > stage->most_meets ||
              side > stage->most_sides || touch + points > stage->most_touches;
int kept = count < stage->most_junctions ? count : stage->most_junctions;
if (world->full)       // begin again with more memory
  for (int j = 0; j < kept; j++)
    for (int q = 0; q < junctions[j].fields; q++)
      world->field[junctions[j].field[q]].where[4 * junctions[j].block[q] + 3] = 0;
stage->junctions = world->full ? 0 : count;
stage->meets = world->full ? 0 : meet;
stage->sides = world->full ? 0 : side;
stage->touches = world->full ? 0 : touch;
stage->choices = world->full ? 0 : choice;
world->parts = stage->junctions ? LIST_PARTS : 0;
world->turns = stage->junctions ? world->rigids : 0;
for (int k = 0; k < COLOURS; k++) {
  world->looks[k] = stage->junctions ? world->colour[k] : 0;
  world->spreads[k] = world->reaches[k] = 0;   // until contact_list counts them
}
// Whether all normals are chosen anew: see normal_cache_steps in physics/contact.py.
stage->anew = world->clock->count % mpm::Keep::steps(world->clock->speed * dt * inv) == 0;
Kept::enter(stage);
