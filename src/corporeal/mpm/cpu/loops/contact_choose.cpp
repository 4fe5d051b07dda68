// Of three candidates, the one along which two fields are farthest apart.
int from = (int)((long long)stage->touches * index / PARTS),
    to = (int)((long long)stage->touches * (index + 1) / PARTS);
for (int t = from; t < to; t++) {
  Aim &A = aims[t];
  if (A.fa < 0) continue;
  float best = -(float)mpm::VAST;
  int pick = 0;
  for (int q = 0; q < 3; q++) {
    if (A.n[0][q] == 0 && A.n[1][q] == 0 && A.n[2][q] == 0) continue;
    float wide = (float)(q == 0 ? mpm::FIRST_BIAS : mpm::OTHER_BIAS) - A.far[0][q] - A.far[1][q];
    if (wide > best) best = wide, pick = q;
  }
  for (int d = 0; d < 3; d++) leans[t].u[d] = A.weight * A.n[d][pick];
}
