// Contacts that move rigid bodies, in one list: at nodes and, against planes, at their surface
// points. Then the ledger is updated and rigid bodies move.

struct Rounds {
  static_assert(PAIR_COLUMNS == ImpactSupport::ROW, "one row of a pair");
  static inline bool both_rigid(const Line &R) { return R.ma < 0 && (R.mc < 0 || !R.c); }
  // Where two rigid bodies touch that meet at a node: not beyond the edge of one of them.
  static inline void place(const World *w, const Side *sides, Touch &T, double dx) {
    double a[3], c[3], shift[3];
    for (int i = 0; i < 3; i++) {   // a body that is round all over has no edges
      a[i] = w->field[T.fa].edged ? sides[T.a].mean[i] : 0.0;
      c[i] = w->field[T.fc].edged ? sides[T.c].mean[i] : 0.0;
    }
    mpm::Touched<double>::shift(w->face, a, c, T.normal, shift);
    for (int i = 0; i < 3; i++) T.x[i] += shift[i] * dx;
  }
  // Find the pairs that approach now, and the bodies that support them; whether there are any.
  static inline bool find(const World *w, Stage *stage, int n, int all, double dt, double dx) {
    double *pair = stage->pair, approach;
    bool any = false;
    for (int i = 0; i < n; i++) {
      const Touch &T = stage->touch[stage->line[i].touch];
      const Line &R = stage->line[i];
      if (R.e <= 0) continue;
      const double speed = List::closing(R, Points::rolls(w, T), approach);
      if (!Impact::begins(approach, speed, T.gap, dt)) continue;
      for (int k = 0; k < PAIR_COLUMNS * all * all && !any; k++) pair[k] = 0;
      double *row = pair + PAIR_COLUMNS * (T.fa * all + T.fc);
      row[ImpactSupport::ROLE] = ImpactSupport::STRUCK;
      row[ImpactSupport::LEAST] = mpm::VAST_DOUBLE;
      if (approach > row[ImpactSupport::SPEED]) row[ImpactSupport::SPEED] = approach;
      any = true;
    }
    if (!any) return false;
    for (int i = 0; i < n; i++) {
      const Touch &T = stage->touch[stage->line[i].touch];
      double *row = pair + PAIR_COLUMNS * (T.fa * all + T.fc);
      if (row[ImpactSupport::ROLE] == ImpactSupport::STRUCK && T.gap < row[ImpactSupport::LEAST]) row[ImpactSupport::LEAST] = T.gap;
    }
    for (int i = 0; i < n; i++) {
      const Line &R = stage->line[i];
      const Touch &T = stage->touch[R.touch];
      double *row = pair + PAIR_COLUMNS * (T.fa * all + T.fc), sums[ImpactSupport::ROW - ImpactSupport::COUNT];
      if (!both_rigid(R)) continue;
      const double speed = List::closing(R, 0, approach);
      if (!ImpactSupport::near(T.gap, row[ImpactSupport::LEAST], speed, dx)) continue;
      ImpactSupport::adds(T.x, R.n, sums);
      for (int k = ImpactSupport::COUNT; k < ImpactSupport::ROW; k++) row[k] += sums[k - ImpactSupport::COUNT];
    }
    for (int f = 0; f < all; f++)
      stage->light[f] = f >= w->fields ? 0.0 : w->field[f].rigids ? w->field[f].rigid[INVERSE_MASS] : -1.0;
    ImpactSupport::hold(pair, w->restitution, w->restitution_law, stage->light, all, dx);
    return true;
  }
};
Line *lines = stage->line;
int nt = stage->touches, n = 0, stacked = 0;
bool pressed = false;         // a rigid body on a shell, whose nodes are light
double *pair = stage->pair;   // [all][all][PAIR_COLUMNS]
nt += Points::on_planes(world, touches + nt);
const int faces = nt;   // contacts of round bodies with faces of others begin here
nt += Points::on_facets(world, touches + nt, stage->most_touches - nt);
nt += Points::on_curves(world, touches + nt, stage->most_touches - nt);
stage->points = nt - stage->touches;
Points::instead_of_nodes(world, touches, stage->touches, faces, nt);
Points::nor_in_valleys(world, touches, stage->touches, faces, nt);
Bonds::join(world);
for (int t = world->turns ? 0 : stage->touches; t < nt; t++) {   // where none is rigid no node moves one
  Touch &T = touches[t];
  if (!T.active || (T.meet >= 0 && !meets[T.meet].stiff)) continue;
  int kind = T.meet < 0 ? 2 : T.fc >= fields ? 1 : 0;
  Line &R = lines[n++];
  R.touch = t;
  R.group = (kind * all + T.fa) * all + T.fc;
  R.key = (u64)(4 * R.group + T.face) << 48;
  if (T.meet < 0)
    R.key |= (u64)T.a;
  else
    for (int i = 0; i < 3; i++) R.key |= (u64)((meets[T.meet].at[i] + 0x8000) & 0xffff) << (32 - 16 * i);
  R.mu = T.mu;
  R.span = T.span;
  R.flows_by = world->field[T.fc < fields && world->field[T.fc].pours ? T.fc : T.fa].flows_by;
  for (int i = 0; i < 6; i++) R.K[i] = 0;
  for (int i = 0; i < 3; i++) {
    R.n[i] = T.normal[i];
    R.J[i] = 0;
  }
  if (kind == 0 && world->field[T.fa].rigids && world->field[T.fc].rigids) Rounds::place(world, sides, T, dx);
  List::side(world, sides, T.fa, T.a, T.x, R.a, R.ma, R.ra, R.K);
  List::side(world, sides, T.fc, T.c, T.x, R.c, R.mc, R.rc, R.K);
  R.inverse = List::along(R.K, R.n);
  double u[3];
  List::slip(R, u);
  R.target = T.target;
  R.e = Rounds::both_rigid(R) ? world->restitution[T.fa * all + T.fc] : 0.0;
  R.waits = 0;
  stacked |= R.ma < 0 && R.mc < 0;
  pressed |= world->field[T.fa].is_shell || (T.fc < fields && world->field[T.fc].is_shell);
  for (int i = 0; i < 3; i++) T.before[i] = u[i];
  const double *ka = R.ma < 0 ? R.a + KICK : 0, *kc = R.mc < 0 ? R.c + KICK : 0;
  double kick[3];
  for (int i = 0; i < 3; i++) {
    kick[i] = (ka ? ka[i] : 0.0) - (kc ? kc[i] : 0.0);
    T.before[i] -= kick[i];
  }
  for (int side = 0; side < 2; side++) {   // a node's velocity before this step's forces
    if ((side ? R.mc : R.ma) <= 0) continue;
    const Side &S = sides[side ? T.c : T.a];
    const float *node = world->field[S.field].node + (size_t)S.slot * 8;
    for (int i = 0; i < 3; i++) T.before[i] -= (side ? -1.0 : 1.0) * (S.v[i] - node[4 + i]);
  }
}
if (!n) stage->pasts = 0;
if (n) {
  // Pairs of bodies, then bodies on planes, then their surface points.
  int *order = stage->order, *place = order + n;
  const int groups = 3 * all * all;
  for (int i = 0; i <= groups; i++) place[i] = 0;
  for (int i = 0; i < n; i++) place[lines[i].group + 1]++;
  for (int i = 0; i < groups; i++) place[i + 1] += place[i];
  for (int i = 0; i < n; i++) order[place[lines[i].group]++] = i;   // place: where each group ends, from now on
  List::sort(lines, order, n);
  // Impacts of rigid bodies, one after the other: a struck body passes the impact on to what it touches.
  // In every round the pairs that approach now rebound together, those behind support light bodies, and
  // all others wait.
  int impacts = 0;
  for (; impacts < mpm::MAX_IMPACTS_PER_STEP && Rounds::find(world, stage, n, all, dt, dx); impacts++) {
    double approach;
    bool holds = false;
    for (int i = 0; i < n; i++) {
      Line &R = lines[i];
      const Touch &T = touches[R.touch];
      const double *row = pair + PAIR_COLUMNS * (T.fa * all + T.fc);
      R.waits = row[ImpactSupport::ROLE] == ImpactSupport::WAITS;
      if (R.waits) continue;
      for (int d = 0; d < 3; d++) R.J[d] = 0;
      R.target = ImpactSupport::held(T.gap, dt, dx);
      holds |= row[ImpactSupport::ROLE] == ImpactSupport::HELD;
      if (row[ImpactSupport::ROLE] == ImpactSupport::HELD) continue;
      const double speed = List::closing(R, Points::rolls(world, T), approach);
      R.target = Impact::target(row[ImpactSupport::BOUNCE], approach, speed, T.gap, dt, dx);
    }
    const int most = holds ? mpm::SUPPORTED_IMPACT_SWEEPS : mpm::IMPACT_SWEEPS;
    List::sweep(lines, order, place, n, most, mpm::SWEEPS, mpm::IMPACT_SWEEP_TOLERANCE_DX * dx, stacked);
    for (int i = 0; i < n; i++)
      for (int d = 0; d < 3 && !lines[i].waits; d++) touches[lines[i].touch].J[d] += lines[i].J[d];
  }
  for (int i = 0; i < n && impacts; i++) {
    lines[i].waits = 0;
    lines[i].target = touches[lines[i].touch].target;
    for (int d = 0; d < 3; d++) lines[i].J[d] = 0;
  }
  // Then all contacts together. Rigid bodies on one another only yield to each other: with few
  // sweeps stacks creep. So contacts begin with the forces of the last step, and sweeps end when what
  // they change would creep by less than a few thousandths of a cell per second.
  const int sweeps = impacts || stacked || pressed ? mpm::IMPACT_SWEEPS : mpm::SWEEPS;
  const bool known = stage->pasts > 0;
  if (known) {
    int *slot = stage->slot, last = stage->slots - 1;
    for (int i = 0; i <= last; i++) slot[i] = 0;
    for (int p = 0; p < stage->pasts; p++) {
      int at = List::first_slot(stage->past[p].key, stage->slots);
      while (slot[at]) at = (at + 1) & last;
      slot[at] = p + 1;
    }
    for (int i = 0; i < n; i++) {
      int at = List::first_slot(lines[i].key, stage->slots);
      while (slot[at] && stage->past[slot[at] - 1].key != lines[i].key) at = (at + 1) & last;
      if (slot[at]) List::remember(lines[i], stage->past[slot[at] - 1].force, dt);
    }
  }
  const int least = known && !impacts ? mpm::WARM_START_MIN_SWEEPS : mpm::SWEEPS;
  const double still = (impacts ? mpm::IMPACT_SWEEP_TOLERANCE_DX : mpm::SWEEP_TOLERANCE_DX) * dx;
  stage->sweeps = List::sweep(lines, order, place, n, sweeps, least, still, stacked);
  stage->pasts = 0;
  for (int i = 0; i < n; i++) {
    Touch &T = touches[lines[i].touch];
    for (int d = 0; d < 3; d++) T.J[d] += lines[i].J[d];
    if (lines[i].J[0] != 0 || lines[i].J[1] != 0 || lines[i].J[2] != 0) {
      Past &past = stage->past[stage->pasts++];
      past.key = lines[i].key;
      for (int d = 0; d < 3; d++) past.force[d] = lines[i].J[d] / dt;
    }
    for (int side = 0; side < 2; side++) {
      if ((side ? lines[i].mc : lines[i].ma) <= 0) continue;
      const Side &S = sides[side ? T.c : T.a];
      float *node = world->field[S.field].node + (size_t)S.slot * 8;
      for (int d = 0; d < 3; d++) node[1 + d] = (float)S.v[d];
    }
  }
}
// Rolling friction, after all that touches is solved; in single contacts, one after the other.
struct Rolls {
  static inline void side(const double *s, const double *r, mpm::RollingSide &out) {
    out.light = s ? s[INVERSE_MASS] : 0.0;
    for (int i = 0; i < 9; i++) out.inertia[i] = out.light > 0 ? s[INERTIA + i] : 0.0;
    for (int i = 0; i < 3; i++) out.arm[i] = s ? r[i] : 0.0;
  }
  static inline void give(World *w, double *s, const double *r, const double *M, const double *f, double sign) {
    if (!s) return;
    if (s[INVERSE_MASS] == 0) *w->clock->push_work -= sign * Vec::dot(M, s + SPIN);
    if (s[INVERSE_MASS] == 0) return;
    double u[3];
    List::hit(s, -1, r, f, sign);
    Vec::apply(s + INERTIA, M, u);
    for (int i = 0; i < 3; i++) {
      s[MOMENT + i] += sign * M[i];
      s[SPIN + i] += sign * u[i];
    }
  }
  static inline void brake(World *w, const Line &R, Touch &T, int all) {
    const Field *F = Points::rolls(w, T);
    const double most = w->rolling_resistance[T.fa * all + T.fc] * Vec::dot(T.J, T.normal);
    if (!F || most <= 0 || !F->rolls) return;
    const double *round = F->curvature + mpm::CURVATURE_ROW * (T.a % F->surfaces);
    if (round[6] + round[7] <= 0) return;
    mpm::RollingSide a, c;
    side(R.a, R.ra, a);
    side(R.c, R.rc, c);
    double spin[3], M[3], f[3];
    for (int i = 0; i < 3; i++) spin[i] = R.a[SPIN + i] - (R.c ? R.c[SPIN + i] : 0.0);
    *w->friction_loss += mpm::Rolling::brake(a, c, spin, R.n, T.J, R.mu, most, M, f);
    give(w, R.a, R.ra, M, f, -1.0);
    give(w, R.c, R.rc, M, f, 1.0);
    for (int i = 0; i < 3; i++) T.J[i] += f[i];
  }
};
for (int i = 0; i < n && world->rolling_resistance; i++) Rolls::brake(world, lines[i], touches[lines[i].touch], all);
struct Books {
  // Work that a contact's impulse J on a body of prescribed motion takes from its drive.
  static inline void react(World *w, const double *s, int body, const double *x, const double *J,
                           double sign) {
    if (s[INVERSE_MASS] != 0) return;
    double v[3];
    Body6::velocity(s, x, v);
    *w->clock->push_work -= sign * Vec::dot(J, v);
    for (int i = 0; i < 3; i++) w->clock->external_impulse[3 * body + i] -= sign * J[i];
  }
  static inline bool any(const Entry &e) { return e.normal > 0 || Vec::dot(e.J, e.J) > 0; }
  static inline void enter(World *w, double *pair, int all, const Entry &e) {
    double *row = pair + (e.a * all + e.c) * PAIR_COLUMNS;
    row[1] += e.normal;
    for (int i = 0; i < 3; i++) row[2 + i] += e.place[i];
    *w->friction_loss += e.loss;
    int bodies = w->names - w->planes, other = e.c < w->fields ? e.c : bodies + e.c - w->fields;
    *w->impact_loss += e.impact;
    w->impact_of_pair[e.a * w->names + other] += e.impact;
    w->impact_of_pair[other * w->names + e.a] += e.impact;
    if (e.c >= w->fields)
      for (int i = 0; i < 3; i++)
        w->plane_impulse[((e.c - w->fields) * bodies + e.a) * 3 + i] -= e.J[i];
  }
};
for (int i = 0; i < all * all; i++)
  for (int d = 1; d < 5; d++) pair[PAIR_COLUMNS * i + d] = 0;
for (int i = 0; i < world->stands; i++)
  if (Books::any(stage->stand[i])) Books::enter(world, pair, all, stage->stand[i]);
for (int p = 0; p < world->parts; p++) {
  int from = (int)((long long)stage->junctions * p / LIST_PARTS);
  for (int e = 0; e < stage->entries[p]; e++)
    Books::enter(world, pair, all, stage->entry[junctions[from].touch + e]);
}
for (int i = 0; i < n; i++) {
  const Touch &T = touches[lines[i].touch];
  double jn = Vec::dot(T.J, T.normal), u[3];
  if (jn <= 0 && lines[i].span == 0) continue;
  List::slip(lines[i], u);
  Entry e{T.fa, T.fc, jn, {jn * T.x[0], jn * T.x[1], jn * T.x[2]}, {T.J[0], T.J[1], T.J[2]}, 0};
  for (int d = 0; d < 3; d++) e.loss += (T.J[d] - jn * T.normal[d]) * 0.5 * (T.before[d] + u[d]);
  for (int d = 0; d < 3; d++) e.impact += jn * T.normal[d] * 0.5 * (T.before[d] + u[d]);
  Books::enter(world, pair, all, e);
  if (lines[i].ma < 0) Books::react(world, lines[i].a, T.fa, T.x, T.J, -1.0);
  if (lines[i].mc < 0) Books::react(world, lines[i].c, T.fc, T.x, T.J, 1.0);
}
const int bodies = world->names - planes;
for (int a = 0; a < fields; a++)
  for (int c = a + 1; c < all; c++) {
    const double *row = pair + (a * all + c) * PAIR_COLUMNS;
    if (row[1] <= 0) continue;
    if (c < fields) {
      world->pair_impulse[a * bodies + c] += row[1];
      world->pair_impulse[c * bodies + a] = world->pair_impulse[a * bodies + c];
    }
    // In the ledger planes follow the bodies, which share one field with a single velocity field.
    int name = c < fields ? c : bodies + c - fields;
    for (int side = 0; side < 2; side++) {
      int i = side ? name * world->names + a : a * world->names + name;
      if (!(world->first_contact[i] >= 0)) {
        world->first_contact[i] = world->time;
        for (int d = 0; d < 3; d++) world->contact_point[3 * i + d] = row[2 + d] / row[1];
      }
      world->last_contact[i] = world->time;
    }
  }
// Clear the marks for the next step.
for (int j = 0; j < stage->junctions; j++)
  for (int q = 0; q < junctions[j].fields; q++)
    world->field[junctions[j].field[q]].where[4 * junctions[j].block[q] + 3] = 0;
Bonds::part(world);
Kept::keep(stage);
// Rigid bodies move; the angular momentum is exact, the turn follows it at mid-step.
for (int f = 0; f < fields; f++) {
  const Field &F = world->field[f];
  if (!F.rigids) continue;
  double *s = F.rigid, Q[9];
  if (s[INVERSE_MASS] == 0) {
    double inertia[9], moment[3], work = 0;
    mpm::Body::inverse_inertia(s + NEXT_ROTATION, s + REST_INERTIA, inertia);
    Vec::apply(inertia, s + SPIN, moment);
    for (int i = 0; i < 3; i++) {
      work += 0.5 * s[SPIN + i] * (moment[i] - s[MOMENT + i]);
      s[MOMENT + i] = moment[i];
      s[CENTRE + i] += dt * s[SPEED + i];
    }
    for (int i = 0; i < 9; i++) s[TURN + i] = s[NEXT_ROTATION + i];
    *world->clock->push_work += work;
    continue;
  }
  mpm::Body::advance(s + TURN, s + REST_INVERSE_INERTIA, s + MOMENT, s + SPIN, dt, Q);
  for (int i = 0; i < 9; i++) s[TURN + i] = Q[i];
  Body6::spin_up(s);
  for (int i = 0; i < 3; i++) s[CENTRE + i] += dt * s[SPEED + i];
}
