// Empty a range of one field's node blocks.
int *task = world->list + 4 * index;
Field &field = world->field[task[0]];
for (size_t i = (size_t)task[1] * 64; i < (size_t)task[2] * 64; i++)
  ((f8u *)field.node)[i] = Simd::all(0.0f);
