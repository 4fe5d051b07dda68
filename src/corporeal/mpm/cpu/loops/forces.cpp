// Momentum and force to velocity on a range of one field's node blocks, with gravity's kick; empties
// the same range of the next step's nodes. Blocks that nothing reaches are empty already.
int *task = world->list + 4 * index;
const Field &field = world->field[task[0]];
const float dt = (float)world->dt;
const f8 g = f8{0, (float)world->kick[0], (float)world->kick[1], (float)world->kick[2], 0, 0, 0, 0};
const f8 h = f8{0, dt, dt, dt, 0, 0, 0, 0};
const int now = 1 << field.side, later = world->clock->fused ? 3 - now : 0;
for (int b = task[1]; b < task[2]; b++) {
  int *used = field.used + b;
  f8 *node = (f8 *)field.node + (size_t)b * 64, *next = (f8 *)field.next + (size_t)b * 64;
  if (*used & later) {
    *used &= ~later;
    for (int i = 0; i < 64; i++) next[i] = Simd::all(0.0f);
  }
  field.have[b] = 0;
  if (!(*used & now)) continue;
  u64 have = 0;
  for (int i = 0; i < 64; i++) {
    f8 a = node[i];
    float m = a[0];
    if (m > (float)mpm::MIN_NODE_MASS_KG) {
      f8 p = __builtin_shufflevector(a, a, 0, 1, 2, 3, 1, 2, 3, 7);
      f8 f = __builtin_shufflevector(a, a, 0, 4, 5, 6, 0, 0, 0, 0);
      a = (p + h * f) * (1.0f / m) + g;
      a[0] = m;
      have |= 1ull << i;
      node[i] = a;
    } else {
      node[i] = Simd::all(0.0f);
    }
  }
  field.have[b] = have;
}
