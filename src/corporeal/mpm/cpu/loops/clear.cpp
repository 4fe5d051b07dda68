// Empty a range of one field's node blocks.
int *task = world->list + 4 * index;
const Field &field = world->field[task[0]];
const bool laid = world->clock->laid && !field.shells;
for (int b = laid ? task[2] : task[1]; b < task[2]; b++) {
  int *used = field.used + b;
  if (!(*used & 1 << field.side)) continue;
  *used &= ~(1 << field.side);
  f8 *node = (f8 *)field.node + (size_t)b * 64;
  for (int i = 0; i < 64; i++) node[i] = Simd::all(0.0f);
}
