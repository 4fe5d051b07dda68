// Of three candidates, the one along which two fields are farthest apart.
int from = (int)((long long)stage->touches * index / PARTS),
    to = (int)((long long)stage->touches * (index + 1) / PARTS);
for (int t = from; t < to; t++) {
  Touch &T = touches[t];
  if (T.c < 0) continue;
  float best = -1e30f;
  int pick = 0;
  for (int q = 0; q < 3; q++) {
    if (T.n[0][q] == 0 && T.n[1][q] == 0 && T.n[2][q] == 0) continue;
    float wide = (q == 0 ? 0.1f : 0.05f) - T.far[0][q] - T.far[1][q];
    if (wide > best) best = wide, pick = q;
  }
  for (int d = 0; d < 3; d++) T.chosen[d] = T.n[d][pick];
  T.weight = sides[T.a].m < sides[T.c].m ? sides[T.a].m : sides[T.c].m;
}
