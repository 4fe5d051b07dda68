// Candidate normals where two fields meet: g_a - g_c, g_a and -g_c.
int from = (int)((long long)stage->sides * index / PARTS),
    to = (int)((long long)stage->sides * (index + 1) / PARTS);
for (int s = from; s < to; s++)
  for (int d = 0; d < 3; d++) sides[s].mean[d] /= sides[s].m;
from = (int)((long long)stage->touches * index / PARTS);
to = (int)((long long)stage->touches * (index + 1) / PARTS);
for (int t = from; t < to; t++) {
  const Touch &T = touches[t];
  Aim &aim = aims[t];
  aim.fa = T.c < 0 ? -1 : T.fa;
  aim.fc = T.c < 0 ? -1 : T.fc;
  if (T.c < 0) continue;
  const Side &A = sides[T.a], &C = sides[T.c];
  float n[3][3];
  for (int d = 0; d < 3; d++) {
    n[0][d] = A.out[d] - C.out[d];
    n[1][d] = A.out[d];
    n[2][d] = -C.out[d];
  }
  // What is small against the cell has no face of its own.
  const bool point = world->field[T.fa].thin == 2, other = world->field[T.fc].thin == 2;
  for (int d = 0; d < 3 && point != other; d++) n[0][d] = n[point ? 1 : 2][d] = 0;
  for (int q = 0; q < 4; q++) {
    double v[3] = {0, 0, 0};
    for (int d = 0; d < 3 && q < 3; d++) v[d] = n[q][d];
    Vec::unit(v);
    for (int d = 0; d < 3; d++) aim.n[d][q] = (float)v[d];
    aim.far[0][q] = aim.far[1][q] = (float)(q < 3 ? -mpm::VAST : mpm::VAST);
  }
  aim.weight = A.m < C.m ? A.m : C.m;
}
