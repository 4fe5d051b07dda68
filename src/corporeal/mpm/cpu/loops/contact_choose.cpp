// Choose, of three candidate normals, that of the largest gap between two fields, unless one is cached.
const int begun = (int)((long long)stage->junctions * index / LIST_PARTS),
          ended = (int)((long long)stage->junctions * (index + 1) / LIST_PARTS);
for (int j = begun; j < ended; j++) {
  const Junction &J = junctions[j];
  for (int t = J.touch; t < J.last && J.chosen; t++) {
    const Touch &T = touches[t];
    const Aim &A = aims[t];
    if (T.known || T.c < 0) continue;
    float best = -(float)mpm::VAST;
    int pick = 0;
    for (int q = 0; q < 3; q++) {
      if (A.n[0][q] == 0 && A.n[1][q] == 0 && A.n[2][q] == 0) continue;
      float wide = (float)(q == 0 ? mpm::FIRST_BIAS : mpm::OTHER_BIAS) - A.far[0][q] - A.far[1][q];
      if (wide > best) best = wide, pick = q;
    }
    for (int d = 0; d < 3; d++) leans[T.lean].u[d] = A.weight * A.n[d][pick];
    if (T.choice < 0) continue;
    u64 *bits = choices[T.choice].bits;
    for (int k = 0; k < 2; k++) bits[k] |= (u64)((pick + 1) >> k & 1) << Grid::node(meets[T.meet].at);
  }
}
