// The end of one step and the beginning of the next: what the tasks report, how long the next step may
// be, what gravity and pushes give in it, and whether the steps go on.
const int CENTRE = 1, TURN = 4, SPEED = 22, SPIN = 37, RADIUS = 40, KICK = 41;
const int REACHED = 1, STRAYED = 2, PAUSED = 3, INFINITE = 4;
struct Pace {
  static inline double size(const double *a) {
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  }
  // Integral of gravity's share from 0 to a time.
  static inline double ramped(double time, double ramp) {
    if (ramp <= 0.0) return time;
    return time < ramp ? 0.5 * time * time / ramp : time - 0.5 * ramp;
  }
  // Largest stable step: dt = s dx/(c + |v|), and the falls of what is rigid.
  static inline double stable(const World *w, const Clock *c) {
    double limit = 1.0, fastest = c->wave + c->speed;
    if (w->tasks) {
      double step = c->courant * w->dx / (fastest > 1e-30 ? fastest : 1e-30);
      if (step < limit) limit = step;
    }
    for (int b = 0; b < c->things; b++) {
      const double *s = c->thing[b].rigid;
      if (!s) continue;
      double v = size(s + SPEED) + size(s + SPIN) * s[RADIUS];
      double step = c->rigid_courant * w->dx / (v > 1e-30 ? v : 1e-30);
      if (step < limit) limit = step;
    }
    return c->fall < limit ? c->fall : limit;
  }
  static inline void close(World *w, Clock *c) {
    if (w->tasks) {
      double speed2 = 0, wave = 0;
      int bad = 0, astray = 0;
      for (int i = 0; i < w->tasks; i++) {
        const double *r = w->report + NR * i;
        double rate = sqrt(r[WAVE2]) * w->field[w->task[4 * i]].slowing;
        bad |= !(r[SPEED2] < 1e300) | !(rate < 1e300);
        astray |= r[ASTRAY] != 0;
        if (r[SPEED2] > speed2) speed2 = r[SPEED2];
        if (rate > wave) wave = rate;
      }
      c->speed = sqrt(speed2);
      c->wave = wave;
      if (astray) w->stop = STRAYED;
      if (bad) w->stop = INFINITE;
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
    if (!w->stop && c->given == 0 && w->time >= c->until) w->stop = REACHED;
    c->budget--;
  }
  static inline void open(World *w, Clock *c) {
    c->last = 0;
    if (c->given > 0) {
      w->dt = c->given;
    } else {
      double left = c->until - w->time, count = ceil(left / c->stable - 1e-9);
      w->dt = left / (count > 1 ? count : 1);
      c->last = count <= 1;
    }
    w->again = 0;
    kick(w, c);
    if (c->pushed) c->laid = 0;
    // Pushes need to know the step: while there is one, particles lie down when the step begins.
    c->fused = c->fuse && !c->pushed;
    w->bare_nodes = c->laid ? 0 : w->nodes;
    for (int k = 0; k < COLOURS; k++) w->bare[k] = c->laid ? 0 : w->colour[k];
  }
  // Velocity that gravity and pushes give in this step; enters it in the books.
  static inline void kick(World *w, Clock *c) {
    double start = w->time, end = start + w->dt;
    double share = ramped(end, c->ramp) - ramped(start, c->ramp);
    for (int i = 0; i < 3; i++) w->kick[i] = c->gravity[i] * share;
    for (int f = 0; f < w->fields; f++) w->field[f].pushed = 0;
    c->pushed = 0;
    for (int b = 0; b < c->things; b++) {
      Thing &T = c->thing[b];
      double push[3] = {0, 0, 0}, low = start > T.from ? start : T.from, high = end < T.to ? end : T.to;
      if (high > low)
        for (int i = 0; i < 3; i++) push[i] = T.push[i] * (high - low);
      bool moved = push[0] != 0 || push[1] != 0 || push[2] != 0;
      for (int m = T.first; m < T.last; m++)
        for (int i = 0; i < 3; i++) w->field[T.field].material[NM * m + PUSH + i] = (float)push[i];
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
if (!world->stop && clock->budget <= 0) world->stop = PAUSED;
clock->stable = Pace::stable(world, clock);
clock->started = !world->stop;
if (!world->stop) Pace::open(world, clock);
