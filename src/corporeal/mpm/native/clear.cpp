// Empty a range of one field's node blocks.
int *task = world->list + 4 * index;
f8 *node = (f8 *)world->field[task[0]].node;
for (size_t i = (size_t)task[1] * 64; i < (size_t)task[2] * 64; i++) node[i] = Simd::all(0.0f);
