// One task on particles: some blocks of one column of one field. Nodes give particles their motion, or
// particles lay the nodes of a step, or both, the second for the step after. Tasks of one colour never
// overlap.
int *task = world->task + 4 * (index >> 1);
const Field &field = world->field[task[0]];
const bool fused = world->clock->fused, bare = index & 1;
Gather gather;
double work = 0;
for (int b = task[1]; b < task[2]; b++) {
  const int *block = field.block + BLOCK * b;
  if (!bare) gather.block(world, field, block);
  if (bare || fused) work += Scatter::block(world, field, block, bare ? field.node : field.next);
}
double *report = world->report + REPORT * (index >> 1);
if (!bare) gather.report(report);
report[WORK] += work;
