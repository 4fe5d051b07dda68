// Nodes of a field that meet only the one plane it can reach: no search, one contact
// each. The node's last lane has the mean height of the field's mass over it. Tasks as in forces.cpp.
const int *task = world->list + 4 * index;
const Field &F = world->field[task[0]];
Entry &book = stage->stand[index];
book = Entry{task[0], fields + F.floor, 0, {0, 0, 0}, {0, 0, 0}, 0};
if (F.floor >= 0) {
  const double *P = world->plane + 4 * F.floor;
  const double mu = world->friction[task[0] * all + fields + F.floor], per = 1.0 / dt;
  const bool sticks = Grid::sticks(world, task[0], fields + F.floor), slides = F.pours && !sticks;
  const double reach = Grid::reach(world, task[0]);
  for (int b = task[1]; b < task[2]; b++) {
    const int *w = F.where + 4 * b;
    const int at[3] = {w[0] + F.origin[0], w[1] + F.origin[1], w[2] + F.origin[2]};
    if (Grid::over(P, at, dx, reach)) continue;
    u64 left = Grid::wall(P, at, dx, reach) & F.have[b];
    if (w[3]) left &= ~junctions[w[3] - 1].mask;
    for (; left; left &= left - 1) {
      const int i = __builtin_ctzll(left);
      float *node = F.node + ((size_t)b * 64 + i) * 8;
      const double m = node[0], v[3] = {node[1], node[2], node[3]}, fall = -Vec::dot(P, v);
      if (fall <= 0 && !sticks) continue;
      const double x[3] = {(4 * at[0] + (i >> 4)) * dx, (4 * at[1] + (i >> 2 & 3)) * dx,
                           (4 * at[2] + (i & 3)) * dx};
      const double h = (Vec::dot(P, x) - P[3]) * inv;
      const double near = Face::gap_to_plane(-node[7], h);
      const double gap = (slides ? Face::gap_of_liquid(-node[7], h, node[0] / F.full)
                          : h > mpm::WALL_REACH ? mpm::VAST : near) * dx;
      const double push = m * (fall - (gap > 0 ? gap * per : 0.0)), jn = push > 0 ? push : 0.0;
      const bool drags = sticks && near < mpm::LIQUID_TOUCH_DX;
      if (jn <= 0 && !drags) continue;
      double slip[3], size = 0, u[3], was[3], scale;
      for (int d = 0; d < 3; d++) {
        slip[d] = v[d] + fall * P[d];
        size += slip[d] * slip[d];
      }
      size = sqrt(size);
      if (drags) {
        const double span = WallStress::span(m, F.full, h, dx, dt);
        scale = size > 0 ? 1.0 - WallStress::slip(size, 1.0 / m, span, *(const mpm::FlowCurve *)F.flows_by) / size : 0.0;
      } else {
        scale = sticks ? 0.0 : Coulomb::share(size * m, h > mpm::WALL_REACH ? 0.0 : mu * jn);
      }
      book.normal += jn;
      for (int d = 0; d < 3; d++) {
        const double t = scale * m * slip[d], J = t - jn * P[d];
        u[d] = v[d] - J / m;
        was[d] = node[4 + d];
        node[1 + d] = (float)u[d];
        book.place[d] += jn * x[d];
        book.J[d] += J;
        book.loss += t * 0.5 * (was[d] + u[d]);
        book.impact -= jn * P[d] * 0.5 * (was[d] + u[d]);
      }
    }
  }
}
