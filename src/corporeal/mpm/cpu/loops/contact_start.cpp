// Apply this step's gravity and push to rigid bodies, and clear their marks on the grid.
Field &F = world->field[index];
if (F.rigids) {
  double *s = F.rigid;
  for (int i = 0; i < 3; i++) s[SPEED + i] += s[KICK + i];
  Body6::spin_up(s);
  for (int b = 0; b < F.pool; b++) {
    const int *w = F.where + 4 * b;
    F.table[(w[0] * F.dim[1] + w[1]) * F.dim[2] + w[2]] = -1;
    for (int i = 0; i < 64; i++) ((f8u *)F.node)[(size_t)b * 64 + i] = Simd::all(0.0f);
  }
  F.pool = F.blocks = 0;
  for (int i = 0; i < 3; i++)
    F.origin[i] = (Grid::floor_int((s[CENTRE + i] - s[RADIUS]) * inv - 1.0) >> 2) - 1;
}
