// Momentum to velocity on a range of one field's node blocks, with gravity's kick; clears the free lane.
// Tasks share the blocks of a field by number.
int *task = world->list + 4 * index;
Field &field = world->field[task[0]];
const f8 g = f8{0, (float)world->kick[0], (float)world->kick[1], (float)world->kick[2], 0, 0, 0, 0};
for (size_t i = (size_t)task[1] * 64; i < (size_t)task[2] * 64; i++) {
  f8u *node = (f8u *)field.node + i;
  f8 a = *node;
  float m = a[0];
  if (m > 1e-30f) {
    a = a * (1.0f / m) + g;
    a[0] = m;
    a[7] = 0.0f;
    *node = a;
  } else {
    *node = Simd::all(0.0f);
  }
}
