// Write down the nodes of some blocks, the fields there and their possible contacts.
int from = (int)((long long)stage->junctions * index / PARTS),
    to = (int)((long long)stage->junctions * (index + 1) / PARTS);
bool asked = false;
for (int j = from; j < to; j++) {
  Junction &J = junctions[j];
  int k = J.meet, s = J.side, t = J.touch;
  int choice_of[FIELDS_IN_BLOCK][FIELDS_IN_BLOCK];
  u64 bits[FIELDS_IN_BLOCK * (FIELDS_IN_BLOCK - 1) / 2][2];   // what is known of each pair
  for (int a = 0, p = 0; a < J.fields; a++)
    for (int c = a + 1; c < J.fields; c++) {
      choice_of[a][c] = -1;
      if (!(J.met[a] >> c & 1) || world->field[J.field[a]].rigids || world->field[J.field[c]].rigids) continue;
      Choice &mine = choices[J.choice + p];
      mine = Choice{{J.at[0], J.at[1], J.at[2]}, J.field[a], J.field[c], 0, {0, 0}};
      const Choice *before = Kept::find(stage, mine);
      for (int k = 0; k < 2; k++) bits[p][k] = before ? before->bits[k] : 0;
      choice_of[a][c] = p++;
    }
  J.chosen = 0;
  const Walls wall(world, J.at);
  for (u64 left = J.mask; left; left &= left - 1) {
    int i = __builtin_ctzll(left);
    Meet &M = meets[k];
    M.at[0] = 4 * J.at[0] + (i >> 4);
    M.at[1] = 4 * J.at[1] + (i >> 2 & 3);
    M.at[2] = 4 * J.at[2] + (i & 3);
    M.side = s;
    M.touch = t;
    M.stiff = 0;
    int here[FIELDS_IN_BLOCK];           // which of the block's fields each side is
    for (int q = 0; q < J.fields; q++) {
      if (!(J.have[q] >> i & 1)) continue;
      here[s - M.side] = q;
      Side &S = sides[s++];
      const Field &F = world->field[J.field[q]];
      S.field = J.field[q];
      S.slot = J.block[q] * 64 + i;
      const float *node = F.node + (size_t)S.slot * 8;
      S.m = node[0];
      S.inverse = 1.0 / node[0];
      for (int d = 0; d < 3; d++) {
        S.v[d] = node[1 + d];
        S.mean[d] = F.rigids ? node[1 + d] : 0.0f;
        S.out[d] = F.rigids ? node[4 + d] : 0.0f;
      }
      M.stiff |= F.rigids;
    }
    M.sides = s - M.side;
    for (int a = 0; a < M.sides; a++) {
      const Side &A = sides[M.side + a];
      const Field &F = world->field[A.field];
      for (int c = a + 1; c < M.sides + wall.count; c++) {
        int w = c - M.sides, faces = 1;
        Touch &T = touches[t];
        T.face = 0;
        if (w >= 0) {
          if (!(wall.of(world, A.field, w, J.several) >> i & 1) || (F.rigids && F.surfaces)) continue;
          T.c = -1 - wall.plane[w];
          T.fc = fields + wall.plane[w];
        } else {
          T.c = M.side + c;
          T.fc = sides[T.c].field;
          if (!(J.met[here[a]] >> here[c] & 1)) continue;
          const Field &G = world->field[T.fc];
          if ((F.patches && G.pours) || (G.patches && F.pours)) faces = mpm::WETTED_FACES;
        }
        const int pair = w >= 0 ? -1 : choice_of[here[a]][here[c]];
        const int pick = pair < 0 ? 0 : (int)(bits[pair][0] >> i & 1) | (int)(bits[pair][1] >> i & 1) << 1;
        if (w < 0 && !pick) J.chosen |= 1ull << i;
        leans[t] = Lean{{0, 0, 0}, (unsigned char)here[a], (unsigned char)(w >= 0 ? 255 : here[c]), (unsigned char)i,
                        (unsigned char)pick};
        T.choice = pair < 0 ? -1 : J.choice + pair;
        for (int b = 0; b < 2 && pick; b++) choices[T.choice].bits[b] |= (u64)(pick >> b & 1) << i;
        T.meet = k;
        T.a = M.side + a;
        T.fa = A.field;
        t++;
        for (int f = 1; f < faces; f++, t++) {
          touches[t] = T;
          touches[t].face = f;
          leans[t] = leans[t - 1];
        }
      }
    }
    M.touches = t - M.touch;
    // A rigid body's nodes know their contacts: its particles are in no order that others share.
    for (int q = M.side; q < s && M.sides > 1; q++)
      if (world->field[sides[q].field].rigids)
        ((int *)world->field[sides[q].field].node)[(size_t)sides[q].slot * 8 + 7] =
            (M.touch + 1) | M.touches << 24;
    k++;
  }
  asked |= J.chosen != 0;
}
for (int k = 0; k < COLOURS && asked; k++)
  __atomic_store_n(world->reaches + k, world->colour[k], __ATOMIC_RELAXED);
