// List the nodes of some blocks, the fields there and their possible contacts.
int from = (int)((long long)stage->junctions * index / LIST_PARTS),
    to = (int)((long long)stage->junctions * (index + 1) / LIST_PARTS);
bool asked = false, shells = false;
for (int j = from; j < to; j++) {
  Junction &J = junctions[j];
  int k = J.meet, s = J.side, t = J.touch;
  Pairs pairs(J);
  unsigned char number[FIELDS_IN_BLOCK][FIELDS_IN_BLOCK];   // of a pair of fields; NONE: they never meet here
  int choice_of[Pairs::MOST];
  for (int a = 0; a < J.fields; a++)
    for (int c = 0; c < J.fields; c++) number[a][c] = Pairs::NONE;
  u64 bits[Pairs::MOST][2];   // what is known of each pair
  J.chosen = 0;
  for (int p = 0, made = J.choice; p < pairs.count; p++) {
    const int a = J.field[pairs.a[p]], c = J.field[pairs.c[p]];
    number[pairs.a[p]][pairs.c[p]] = (unsigned char)p;
    choice_of[p] = -1;
    bits[p][0] = bits[p][1] = 0;
    if (!world->field[a].rigids && !world->field[c].rigids) {
      Choice &mine = choices[choice_of[p] = made++];
      mine = Choice{{J.at[0], J.at[1], J.at[2]}, a, c, 0, {0, 0}};
      const Choice *before = Kept::find(stage, mine);
      for (int k = 0; k < 2 && before; k++) mine.bits[k] = bits[p][k] = before->bits[k] & pairs.nodes[p];
    }
    J.chosen |= pairs.nodes[p] & ~(bits[p][0] | bits[p][1]);
  }
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
      if (F.is_shell) {
        stage->spread[s - 1] = Spread{{0, 0, 0, 0, 0, 0}, 0, 0};
        shells = true;
      }
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
          if (!(wall.of(world, A.field, w, J.several) >> i & 1) || F.pointed) continue;
          T.c = -1 - wall.plane[w];
          T.fc = fields + wall.plane[w];
        } else {
          T.c = M.side + c;
          T.fc = sides[T.c].field;
          if (number[here[a]][here[c]] == Pairs::NONE) continue;
          const Field &G = world->field[T.fc];
          if ((F.patches && G.pours) || (G.patches && F.pours)) faces = mpm::MAX_WETTED_FACES;
        }
        const int pair = w >= 0 ? -1 : number[here[a]][here[c]];
        T.choice = pair < 0 ? -1 : choice_of[pair];
        T.known = pair < 0 ? 0 : (int)(bits[pair][0] >> i & 1) | (int)(bits[pair][1] >> i & 1) << 1;
        T.lean = pair < 0 ? -1 : pairs.lean[pair]++;
        if (pair >= 0) leans[T.lean].touch = t;
        T.meet = k;
        T.a = M.side + a;
        T.fa = A.field;
        t++;
        for (int f = 1; f < faces; f++, t++) {
          touches[t] = T;
          touches[t].face = f;
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
for (int k = 0; k < COLOURS && shells; k++)
  __atomic_store_n(world->spreads + k, world->colour[k], __ATOMIC_RELAXED);
