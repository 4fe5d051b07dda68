// Candidate normals where two fields meet: g_a - g_c, g_a and -g_c; only the cached one, where
// there is one.
struct Candidate {
  static inline void unit(const Side &A, const Side &C, int which, float *n) {
    double v[3];
    for (int d = 0; d < 3; d++)
      v[d] = which == 0 ? A.out[d] - C.out[d] : which == 1 ? A.out[d] : -C.out[d];
    Vec::unit(v);
    for (int d = 0; d < 3; d++) n[d] = (float)v[d];
  }
};
const int from = (int)((long long)stage->touches * index / LIST_PARTS),
          to = (int)((long long)stage->touches * (index + 1) / LIST_PARTS);
for (int t = from; t < to; t++) {
  const Touch &T = touches[t];
  Aim &aim = aims[t];
  float n[3];
  if (T.known) {
    const Side &A = sides[T.a], &C = sides[T.c];
    const float weight = A.m < C.m ? A.m : C.m;
    Candidate::unit(A, C, T.known - 1, n);
    for (int d = 0; d < 3; d++) leans[T.lean].u[d] = weight * n[d];
    continue;
  }
  aim.fa = T.c < 0 ? -1 : T.fa;
  aim.fc = T.c < 0 ? -1 : T.fc;
  if (T.c < 0) continue;
  const Side &A = sides[T.a], &C = sides[T.c];
  aim.weight = A.m < C.m ? A.m : C.m;
  // A body that is small against the cell has no face of its own.
  const bool point = world->field[T.fa].thin == 2, other = world->field[T.fc].thin == 2;
  for (int q = 0; q < 4; q++) {
    const bool none = q == 3 || (point != other && (q == 0 || q == (point ? 1 : 2)));
    if (none)
      n[0] = n[1] = n[2] = 0;
    else
      Candidate::unit(A, C, q, n);
    for (int d = 0; d < 3; d++) aim.n[d][q] = n[d];
    aim.far[0][q] = aim.far[1][q] = (float)(q < 3 ? -mpm::VAST : mpm::VAST);
  }
}
