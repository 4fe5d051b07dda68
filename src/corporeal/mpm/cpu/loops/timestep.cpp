// End of one step and beginning of the next: reports of the tasks, length of the next step,
// velocity change by gravity and pushes in it, and whether the steps go on.
struct Pace {
  static inline double size(const double *a) {
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  }
  // Largest stable step: dt = s dx/(c + |v|), and the limit for falling rigid bodies.
  static inline double stable(const World *w, const Clock *c) {
    double limit = mpm::MAX_STEP_S, fastest = c->wave + c->speed;
    if (w->tasks) {
      double step = c->courant * w->dx / (fastest > mpm::TINY ? fastest : mpm::TINY);
      if (step < limit) limit = step;
    }
    for (int b = 0; b < c->body_loads; b++) {
      const double *s = c->body_load[b].rigid;
      if (!s) continue;
      double v = size(s + SPEED) + size(s + SPIN) * s[RADIUS];
      double step = c->rigid_courant * w->dx / (v > mpm::TINY ? v : mpm::TINY);
      if (step < limit) limit = step;
    }
    if (w->shell_triangles) {
      const ShellMesh &M = *w->shell;
      double step = c->courant * w->dx / (M.wave + c->speed);
      if (M.bending_step < step) step = M.bending_step;
      if (step < limit) limit = step;
    }
    return c->fall < limit ? c->fall : limit;
  }
  static inline void close(World *w, Clock *c) {
    if (w->tasks) {
      double speed2 = 0, wave = 0;
      int bad = 0, astray = 0;
      for (int i = 0; i < w->tasks; i++) {
        const double *r = w->report + REPORT_COLUMNS * i;
        double rate = sqrt(r[WAVE2]);
        bad |= !(r[SPEED2] < mpm::VAST_DOUBLE) | !(rate < mpm::VAST_DOUBLE);
        astray |= r[REPORT_ASTRAY] != 0;
        if (r[SPEED2] > speed2) speed2 = r[SPEED2];
        if (rate > wave) wave = rate;
      }
      c->speed = sqrt(speed2);
      c->wave = wave;
      if (astray) w->stop = STOP_PARTICLE_STRAYED;
      if (bad) w->stop = STOP_INFINITE;
    }
    if (c->fused) {
      for (int f = 0; f < w->fields; f++) {
        Field &F = w->field[f];
        if (F.rigids) continue;
        float *now = F.node;
        F.node = F.next;
        F.next = now;
        F.side = !F.side;
      }
    }
    c->laid = c->fused;
    w->time = c->last ? c->until : w->time + w->dt;
    c->count++;
    if (w->dt < c->smallest) c->smallest = w->dt;
    if (w->dt > c->largest) c->largest = w->dt;
    if (!w->stop && c->given == 0 && w->time >= c->until) w->stop = STOP_TIME_REACHED;
    c->budget--;
  }
  static inline void open(World *w, Clock *c) {
    c->last = 0;
    if (c->given > 0) {
      w->dt = c->given;
    } else {
      double left = c->until - w->time, count = ceil(left / c->stable - mpm::STEP_ROUNDING);
      w->dt = left / (count > 1 ? count : 1);
      c->last = count <= 1;
    }
    w->again = 0;
    kick(w, c);
    if (w->shell_triangles) relax(*w->shell, w->dt);
    if (c->pushed) c->laid = 0;
    // Pushes depend on the step: while there is one, particles are scattered when the step begins.
    c->fused = c->fuse && !c->pushed;
    const bool bare = !c->laid || w->shelled;
    w->bare_nodes = bare ? w->nodes : 0;
    for (int k = 0; k < COLOURS; k++) w->bare[k] = bare ? w->colour[k] : 0;
  }
  // Fractions of strain that a step leaves in a material's branches.
  static inline void relax(float *row, double dt) {
    for (int k = 0; k < mpm::BRANCHES; k++)
      mpm::Branch<float>::kept(dt, row[BRANCH_TIME + k], row[BRANCH_KEPT + k], row[BRANCH_FRESH + k]);
  }
  static inline void relax(ShellMesh &M, double dt) {
    for (int k = 0; k < M.decays; k++)
      for (int b = 0; b < mpm::BRANCHES; b++) {
        float *decay = M.decay + 2 * mpm::BRANCHES * k + b;
        mpm::Branch<float>::kept(dt, M.branch_time[mpm::BRANCHES * k + b], decay[0], decay[mpm::BRANCHES]);
      }
  }
  // Move a body along its path in this step; adds the work of that, without contacts, to the ledger.
  static inline void guide(World *w, Clock *c, BodyLoad &T, int b) {
    double *s = T.rigid, V[3], spin[3], inertia[9], moment[3], work = 0;
    mpm::Path::follow(T.path, T.paths, T.arm, w->time + w->dt, w->dt, s + CENTRE, s + TURN, V, spin,
                      s + NEXT_ROTATION);
    mpm::Body::inverse_inertia(s + TURN, s + REST_INERTIA, inertia);   // R I Rt, of whichever I
    Vec::apply(inertia, spin, moment);
    for (int i = 0; i < 3; i++) {
      work += 0.5 * T.mass * (V[i] * V[i] - s[SPEED + i] * s[SPEED + i]);
      work += 0.5 * (spin[i] * moment[i] - s[SPIN + i] * s[MOMENT + i]);
      work -= T.mass * c->gravity[i] * V[i] * w->dt;
      c->external_impulse[3 * b + i] += T.mass * (V[i] - s[SPEED + i]);
    }
    *c->push_work += work;
    for (int i = 0; i < 3; i++) {
      s[SPEED + i] = V[i];
      s[SPIN + i] = spin[i];
      s[MOMENT + i] = moment[i];
      s[KICK + i] = 0;
    }
  }
  // Velocity change by gravity and pushes in this step; adds it to the ledger.
  static inline void kick(World *w, Clock *c) {
    double start = w->time, end = start + w->dt;
    double share = mpm::Clocks::ramped(end, c->ramp) - mpm::Clocks::ramped(start, c->ramp);
    for (int i = 0; i < 3; i++) w->kick[i] = c->gravity[i] * share;
    for (int f = 0; f < w->fields; f++) w->field[f].pushed = 0;
    c->pushed = 0;
    for (int b = 0; b < c->body_loads; b++) {
      BodyLoad &T = c->body_load[b];
      if (T.paths) {
        guide(w, c, T, b);
        continue;
      }
      double push[3] = {0, 0, 0}, low = start > T.start ? start : T.start, high = end < T.end ? end : T.end;
      if (high > low)
        for (int i = 0; i < 3; i++) push[i] = T.push[i] * (high - low);
      bool moved = push[0] != 0 || push[1] != 0 || push[2] != 0;
      for (int m = T.first; m < T.last; m++) {
        float *row = w->field[T.field].material + MATERIAL_COLUMNS * m;
        for (int i = 0; i < 3; i++) row[PUSH_VELOCITY + i] = (float)push[i];
        if (w->field[T.field].relaxes) relax(row, w->dt);
        if (row[CONSISTENCY] > 0) row[DRAG] = (float)(row[CONSISTENCY] * pow(w->dt, -(double)row[INDEX]));
      }
      if (moved && T.first < T.last) w->field[T.field].pushed = c->pushed = 1;
      for (int i = 0; i < 3; i++) {
        double k = w->kick[i] + push[i];
        if (T.rigid) {
          T.rigid[KICK + i] = k;
          *c->push_work += T.mass * push[i] * (T.rigid[SPEED + i] + 0.5 * k);
        }
        c->external_impulse[3 * b + i] += T.mass * k;
      }
    }
  }
};
Clock *clock = world->clock;
if (clock->started)
  Pace::close(world, clock);
if (!world->stop && clock->budget <= 0) world->stop = STOP_PAUSED;
clock->stable = Pace::stable(world, clock);
clock->started = !world->stop;
if (!world->stop) Pace::open(world, clock);
