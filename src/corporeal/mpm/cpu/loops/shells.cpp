// Forces of shells on their vertices, before particles lie down, in five phases: where vertices are, angles at hinges,
// stress and moments in triangles, forces on their corners, and their sums. Batches are of eight.
typedef mpm::Flat<f8> Flat;
typedef mpm::Membrane<f8> Membrane;
typedef float f4 __attribute__((vector_size(16)));
typedef float f4u __attribute__((vector_size(16), aligned(4)));
// Wall of each lane.
struct LaneWall : mpm::ShellMaterial<f8> {
  f8 thickness, strength[mpm::BRANCHES], decay;   // as the columns that follow
  MPM_INLINE static LaneWall of(const ShellMesh &M, const int *kind) {
    LaneWall t;
    f8 *to = &t.law;
    const i8 all = *(const i8u *)kind;
    const bool same = !Simd::any(all != kind[0]);
    const float *row = M.wall + WALL_COLUMNS * (size_t)kind[0];
    for (int k = WALL_LAW; k <= WALL_DECAY; k++) to[k] = Simd::all(row[k]);
    for (int l = 1; l < 8 && !same; l++)
      for (int k = WALL_LAW; k <= WALL_DECAY; k++) to[k][l] = M.wall[WALL_COLUMNS * (size_t)kind[l] + k];
    return t;
  }
};
struct Shells {
  static inline f8 load(const float *a, int channel) { return *(const f8u *)(a + 8 * channel); }
  static inline void store(float *a, int channel, f8 value) { *(f8u *)(a + 8 * channel) = value; }
  static inline double sum(f8 a) {
    double total = 0;
    for (int l = 0; l < 8; l++) total += a[l];
    return total;
  }
  // Places of two vertices of each lane, component by component.
  static inline void places(const int *place, const int *first, const int *second, i8 *a, i8 *b) {
    f8 r[8];
    for (int l = 0; l < 8; l++) {
      const f4 low = *(const f4u *)(place + 4 * (size_t)first[l]), high = *(const f4u *)(place + 4 * (size_t)second[l]);
      r[l] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
    }
    Simd::turn(r);
    for (int d = 0; d < 3; d++) a[d] = (i8)r[d], b[d] = (i8)r[4 + d];
  }
  static inline void difference(const i8 *a, const i8 *b, float unit, f8 *edge) {
    for (int d = 0; d < 3; d++) edge[d] = Simd::flo(b[d] - a[d]) * unit;
  }
  // Edges of eight triangles from their first corners [m].
  static inline void edges(const ShellMesh &M, int batch, float unit, f8 *u, f8 *v) {
    const int *corner = M.triangle + 24 * batch;
    i8 a[3], b[3], c[3], again[3];
    places(M.place, corner, corner + 8, a, b);
    places(M.place, corner + 16, corner + 16, c, again);
    difference(a, b, unit, u);
    difference(a, c, unit, v);
  }
  static void hinges(const ShellMesh &M, int batch, float unit) {
    const int *vertex = M.hinge + 32 * batch;
    i8 a[3], b[3], o[3], q[3];
    f8 e[3], first[3], second[3];
    places(M.place, vertex, vertex + 8, a, b);
    places(M.place, vertex + 16, vertex + 24, o, q);
    difference(a, b, unit, e);
    difference(a, o, unit, first);
    difference(a, q, unit, second);
    const f8 angle = Flat::dihedral_angle(e, first, second);
    store(M.turn, batch, mpm::Math<f8>::wrapped(angle - load(M.rest_angle, batch)));
  }
  // Strain and relax one kind of strain of both branches; adds what they resist with, gives the work on them.
  static inline f8 relax(const float *decay, i8 kind, f8 poisson, const f8 *strength, const f8 *grown,
                         float *branch, f8 *strain) {
    f8 work = Simd::all(0.0f);
    for (int b = 0; b < mpm::BRANCHES; b++, branch += 8 * 3) {
      f8 kept, fresh, mean[3], stress[3];
      for (int l = 0; l < 8; l++) kept[l] = decay[4 * kind[l] + b], fresh[l] = decay[4 * kind[l] + mpm::BRANCHES + b];
      for (int k = 0; k < 3; k++) {
        const f8 old = load(branch, k), now = kept * old + fresh * grown[k];
        store(branch, k, now);
        mean[k] = 0.5f * (old + now);
        strain[k] += strength[b] * now;
      }
      Flat::plane_stress(poisson, mean, stress);
      work += strength[b] * Flat::contract(stress, grown);
    }
    return work;
  }
  // Stress of the membrane, once it has yielded: B, F = (f g) and the history are then of what is left.
  MPM_RARE static void yield(const mpm::ShellMaterial<f8> &t, const f8 *C, const f8 *u, const f8 *v, f8 plastic, f8 volume,
                             float *state, f8 *B, f8 *f, f8 *g, f8 *stress, double *report) {
    Membrane membrane;
    f8 factor[3], grown, work;
    membrane.principal(C);
    if (membrane.flow(t, plastic, factor, grown, work)) {
      const f8 old[4] = {B[0], B[1], B[2], B[3]};
      const i8 yields = grown > 0.0f;
      for (int i = 0; i < 4; i += 2) {
        B[i] = Simd::pick(yields, old[i] * factor[0] + old[i + 1] * factor[2], old[i]);
        B[i + 1] = Simd::pick(yields, old[i] * factor[2] + old[i + 1] * factor[1], old[i + 1]);
      }
      for (int k = 0; k < 4; k++) store(state, BARE_REST + k, B[k]);
      store(state, SHELL_PLASTIC_STRAIN, plastic + grown);
      report[SHELL_PLASTIC] += sum(work * volume);
      Flat::deformation(u, v, B, f, g);
    }
    membrane.stress(t, stress);
  }
  // Let eight triangles yield and relax; leaves their membranes' forces and their moments at hinges.
  static void triangles(const ShellMesh &M, int batch, float unit, double *report) {
    const float *rest = M.rest + 8 * TRIANGLE_CHANNELS * (size_t)batch;
    float *state = M.state + 8 * SHELL_STATE_CHANNELS * (size_t)batch;
    const LaneWall t = LaneWall::of(M, (const int *)rest + 8 * TRIANGLE_WALL);
    const f8 zero = Simd::all(0.0f), area = load(rest, TRIANGLE_AREA), volume = area * t.thickness;
    f8 u[3], v[3], B[4], f[3], g[3], C[3], stress[3], work, second[3] = {zero, zero, zero}, third[3] = {zero, zero, zero};
    edges(M, batch, unit, u, v);

    // The membrane.
    for (int k = 0; k < 4; k++) B[k] = load(state, BARE_REST + k);
    Flat::deformation(u, v, B, f, g);
    Flat::metric(f, g, C);
    const f8 plastic = load(state, SHELL_PLASTIC_STRAIN);
    if (!Membrane::direct_stress(t, C, plastic, stress)) yield(t, C, u, v, plastic, volume, state, B, f, g, stress, report);
    Flat::pull(f, g, stress, B, second, third);

    // Curvature and the plastic hinge.
    const int from = M.first_slot[batch], to = M.first_slot[batch + 1];
    f8 bend[3] = {zero, zero, zero}, elastic[3], moment[3];
    for (int s = from; s < to; s++) {
      const int *half = M.slot + 8 * (size_t)s;
      f8 turn;
      for (int l = 0; l < 8; l++) turn[l] = M.turn[half[l] >> 2];
      for (int k = 0; k < 3; k++) bend[k] += load(M.curvature + 24 * (size_t)s, k) * turn;
    }
    for (int k = 0; k < 3; k++) elastic[k] = bend[k] - load(state, PLASTIC_CURVATURE + k);
    Flat::plane_stress(t.poisson, elastic, moment);
    for (int k = 0; k < 3; k++) moment[k] *= t.bending;
    const f8 square = Membrane::squared_moment(moment);
    if (Simd::any(square > t.hinge_moment * t.hinge_moment)) {
      const f8 kept = Membrane::moment_return(t, square);
      for (int k = 0; k < 3; k++) {
        moment[k] *= kept;
        const f8 turned = (1.0f - kept) * elastic[k];
        store(state, PLASTIC_CURVATURE + k, load(state, PLASTIC_CURVATURE + k) + turned);
        elastic[k] = turned;
      }
      report[SHELL_PLASTIC] += sum(Flat::contract(moment, elastic) * area);
    }

    // Maxwell branches.
    if (Simd::any(t.strength[0] + t.strength[1] > 0.0f)) {
      const i8 kind = Simd::whole(t.decay);
      f8 strain[3] = {zero, zero, zero}, turned[3] = {zero, zero, zero}, change[3];
      for (int k = 0; k < 4; k++) B[k] = load(rest, TRIANGLE_REST + k);
      Flat::deformation(u, v, B, f, g);
      Flat::metric(f, g, C);
      for (int k = 0; k < 3; k++) {
        const f8 green = 0.5f * C[k];
        change[k] = green - load(state, LAST_GREEN + k);
        store(state, LAST_GREEN + k, green);
      }
      work = t.stiffness * volume * relax(M.decay, kind, t.poisson, t.strength, change, state + 8 * SHELL_BRANCH_STRAIN, strain);
      for (int k = 0; k < 3; k++) {
        change[k] = bend[k] - load(state, LAST_BEND + k);
        store(state, LAST_BEND + k, bend[k]);
      }
      work += t.bending * area * relax(M.decay, kind, t.poisson, t.strength, change, state + 8 * SHELL_BRANCH_BEND, turned);
      report[SHELL_VISCOUS] += sum(work);
      Flat::plane_stress(t.poisson, strain, stress);
      for (int k = 0; k < 3; k++) stress[k] *= t.stiffness;
      Flat::pull(f, g, stress, B, second, third);
      Flat::plane_stress(t.poisson, turned, stress);
      for (int k = 0; k < 3; k++) moment[k] += t.bending * stress[k];
    }

    float *pull = M.pull + 96 * (size_t)batch;
    for (int d = 0; d < 3; d++) {
      store(pull, d, second[d] * volume);
      store(pull, 3 + d, third[d] * volume);
      store(pull, 6 + d, u[d]);
      store(pull, 9 + d, v[d]);
    }
    for (int k = 0; k < 3; k++) moment[k] *= area;
    for (int s = from; s < to; s++) {
      const float *curvature = M.curvature + 24 * (size_t)s;
      const f8 c[3] = {load(curvature, 0), load(curvature, 1), load(curvature, 2)}, half = Flat::contract(moment, c);
      for (int l = 0; l < 8; l++) M.half[M.slot[8 * (size_t)s + l] >> 1] = half[l];
    }
  }
  // Forces of eight triangles on their corners.
  static void corners(const ShellMesh &M, int batch) {
    const f8 zero = Simd::all(0.0f);
    const float *pull = M.pull + 96 * (size_t)batch;
    f8 u[3], v[3], normal[3], moment[3] = {zero, zero, zero}, weight[3], r[8], last[8];
    for (int d = 0; d < 3; d++) u[d] = load(pull, 6 + d), v[d] = load(pull, 9 + d);
    for (int s = M.first_slot[batch]; s < M.first_slot[batch + 1]; s += 3)
      for (int k = 0; k < 3; k++) {
        const int *slot = M.slot + 8 * (size_t)(s + k);
        f8 whole;
        for (int l = 0; l < 8; l++) {
          const float *half = M.half + (slot[l] >> 2) * 2;
          whole[l] = half[0] + half[1];
        }
        const i8 against = (*(const i8u *)slot & 1) != 0;
        moment[k] += Simd::pick(against, -whole, whole);
      }
    Flat::cross(u, v, normal);
    Flat::bending_weights(u, v, normal, moment, weight);
    for (int d = 0; d < 3; d++) {
      const f8 second = load(pull, d), third = load(pull, 3 + d);
      r[d] = weight[0] * normal[d] - (second + third);
      r[4 + d] = weight[1] * normal[d] + second;
      last[d] = weight[2] * normal[d] + third;
    }
    r[3] = r[7] = zero;
    for (int k = 3; k < 8; k++) last[k] = zero;
    Simd::turn(r);
    Simd::turn(last);
    float *corner = M.corner + 96 * (size_t)batch;
    for (int l = 0; l < 8; l++) {
      *(f8u *)(corner + 12 * l) = r[l];
      *(f4u *)(corner + 12 * l + 8) = __builtin_shufflevector(last[l], last[l], 0, 1, 2, 3);
    }
  }
  // Fetch places and numbers of a batch of particles.
  static inline void fetch(const float *q) {
    __builtin_prefetch(q + 8 * XI);
    __builtin_prefetch(q + 8 * (XI + 2));
    __builtin_prefetch(q + 8 * ID);
  }
  // Where one block's vertices are.
  static void look(const ShellMesh &M, const Field &field, const int *block) {
    for (int slot = block[0]; slot < block[1]; slot++) {
      if (!(slot & 7)) fetch(field.part + (size_t)(slot + 16) * CHANNELS);
      const int *q = (const int *)(field.part + (size_t)(slot & ~7) * CHANNELS) + (slot & 7);
      const int vertex = M.vertex[q[8 * ID]];
      if (vertex < 0) continue;
      for (int d = 0; d < 3; d++) M.place[4 * (size_t)vertex + d] = q[8 * (XI + d)];
    }
  }
  // Add up the forces on some vertices.
  static void vertices(const ShellMesh &M, int low, int high) {
    for (int vertex = low; vertex < high; vertex++) {
      f4 force = f4{0, 0, 0, 0};
      for (int k = M.first_corner[vertex]; k < M.first_corner[vertex + 1]; k++)
        force += *(const f4u *)(M.corner + 4 * (size_t)M.corners[k]);
      *(f4u *)(M.force + 4 * (size_t)vertex) = force;
    }
  }
};
const ShellMesh &shell = *world->shell;
if (piece == SHELL_PLACES) {
  const int *chore = world->chore + 2 * index;
  for (int number = chore[0]; number < chore[1]; number++) {
    const int *task = world->task + 4 * number;
    const Field &field = world->field[task[0]];
    if (!field.shells) continue;
    for (int b = task[1]; b < task[2]; b++) Shells::look(shell, field, field.block + BLOCK_INTEGERS * b);
  }
} else if (piece == SHELL_VERTICES) {
  const int low = index * SHELL_VERTICES_PER_TASK, high = low + SHELL_VERTICES_PER_TASK;
  Shells::vertices(shell, low, high < shell.vertices ? high : shell.vertices);
} else {
  const int count = piece == SHELL_HINGES ? shell.hinges : shell.triangles, first = index * SHELL_BATCHES_PER_TASK;
  const int end = first + SHELL_BATCHES_PER_TASK < count ? first + SHELL_BATCHES_PER_TASK : count;
  const float unit = (float)(world->dx / CELL_UNITS);
  double *report = shell.report + SHELL_REPORT_COLUMNS * index;
  for (int batch = first; batch < end; batch++) {
    if (piece == SHELL_HINGES) Shells::hinges(shell, batch, unit);
    if (piece == SHELL_TRIANGLES) Shells::triangles(shell, batch, unit, report);
    if (piece == SHELL_CORNERS) Shells::corners(shell, batch);
  }
}
