// Support of a rigid body along a normal at a node: a search among its surface points for mpm::Surface::begins that
// skips runs of neighbouring points of which none can be the result. All in the body's frame.
struct Runs {
  enum { RUNS_HELD = 128 };   // more than that are searched in the order of their place
  const Field &F;
  const double *x, *n, around, behind;
  double along, aside;   // of a run's middle
  inline const double *look(int s) {
    const double *run = F.show + 6 * s, d[3] = {run[2] - x[0], run[3] - x[1], run[4] - x[2]};
    along = Vec::dot(d, n), aside = Vec::dot(d, d) - along * along;
    return run;
  }
  inline void within(int s, double &least) const {
    const double *run = F.show + 6 * s, *points = F.shown + 3 * (int)run[0];
    const double at = mpm::Surface::around_line(points, (int)(run[1] - run[0]), x, n, around, behind);
    if (at < least) least = at;
  }
  // Runs around the line, those that may begin first before the others.
  inline double first() {
    double low[RUNS_HELD], least = mpm::VAST;
    int held[RUNS_HELD], count = 0;
    for (int s = 0; s < F.shows; s++) {
      const double *run = look(s), reach = around + run[5], from = along - run[5] * mpm::REACH_BOUND_FACTOR;
      if (aside > reach * reach * mpm::REACH_BOUND_FACTOR || from > least) continue;
      if (along + run[5] * mpm::REACH_BOUND_FACTOR < -behind) continue;
      if (count < RUNS_HELD)
        held[count] = s, low[count++] = from;
      else
        within(s, least);
    }
    for (; count > 0; count--) {
      int next = 0;
      for (int i = 1; i < count; i++)
        if (low[i] < low[next]) next = i;
      if (low[next] > least) break;
      within(held[next], least);
      held[next] = held[count - 1], low[next] = low[count - 1];
    }
    return least;
  }
  inline double by_line() {
    double nearest = mpm::VAST, there = mpm::VAST;
    for (int s = 0; s < F.shows; s++) {
      const double *run = look(s), off = sqrt(aside > 0 ? aside : 0.0) - run[5] * mpm::REACH_BOUND_FACTOR;
      if (off > 0 && off * off > nearest) continue;
      mpm::Surface::by_line(F.shown + 3 * (int)run[0], (int)(run[1] - run[0]), x, n, behind, nearest, there);
    }
    return there;
  }
};
