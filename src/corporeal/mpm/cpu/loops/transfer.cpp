// One chore on particles: tasks of one field one after the other, each some blocks of one column. Nodes
// give particles their motion, or particles are scattered to the nodes, or both, the second for the step
// after; but in fields with shells, whose forces need all vertices to have moved. Chores of one colour never overlap.
const int *chore = world->chore + 2 * (index >> 1);
const bool bare = index & 1;
for (int number = chore[0]; number < chore[1]; number++) {
  const int *task = world->task + 4 * number;
  const Field &field = world->field[task[0]];
  const bool fused = world->clock->fused && !field.shells;
  if (bare && world->clock->laid && !field.shells) continue;
  Gather gather;
  double work = 0;
  for (int b = task[1]; b < task[2]; b++) {
    const int *block = field.block + BLOCK_INTEGERS * b;
    if (!bare) gather.block(world, field, block);
    if (bare || fused) work += Scatter::block(world, field, block, bare ? field.node : field.next);
  }
  double *report = world->report + REPORT_COLUMNS * task[3];
  if (!bare) gather.report(report);
  report[REPORT_WORK] += work;
}
