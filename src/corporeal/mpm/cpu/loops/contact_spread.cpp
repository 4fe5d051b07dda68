// Third look, at the particles of shells around listed nodes: how far they lie about their mean, and half the
// wall there. A chore as in contact_look, whose moments are complete.
struct Seen {               // from one node
  f8 square[6], half_wall;
  float mean[3];
  int side;
  inline void begin(const Side &S) {
    for (int k = 0; k < 6; k++) square[k] = Simd::all(0.0f);
    half_wall = square[0];
    for (int d = 0; d < 3; d++) mean[d] = S.mean[d] / S.m;
  }
  inline void add(f8 weight, f8 x, f8 y, f8 z, f8 wall) {
    x -= mean[0], y -= mean[1], z -= mean[2];
    const f8 a = weight * x, b = weight * y;
    square[0] += a * x, square[1] += b * y, square[2] += weight * z * z;
    square[3] += a * y, square[4] += a * z, square[5] += b * z;
    half_wall += weight * wall;
  }
  inline void give(Spread &S) const {
    f8 rows[8] = {square[0], square[1], square[2], square[3], square[4], square[5], half_wall, Simd::all(0.0f)};
    Simd::turn(rows);
    *(f8u *)S.square += ((rows[0] + rows[1]) + (rows[2] + rows[3])) + ((rows[4] + rows[5]) + (rows[6] + rows[7]));
  }
  // The spline of a node at distances from it of up to 1.5.
  static inline f8 spline(f8 x) {
    const f8 a = Simd::size(x), t = 1.5f - a;
    return Simd::pick(a < 0.5f, 0.75f - a * a, 0.5f * t * t);
  }
};
Seen seen[512];
int number_of[512];         // of a node of the arena, in seen
const int *chore = world->chore + 2 * index;
for (int number = chore[0]; number < chore[1]; number++) {
  const int *task = world->task + 4 * number;
  const Field &field = world->field[task[0]];
  if (!field.is_shell) continue;
  for (int b = task[1]; b < task[2]; b++) {
    const int *record = field.block + BLOCK_INTEGERS * b;
    const Asked asked(stage, field, task[0], record);
    for (int e = 0; e < asked.count; e++) {
      number_of[asked.at[e]] = e;
      seen[e].begin(sides[asked.side[e]]);
    }
    for (int s = record[0]; s < record[1] && asked.count; s += 8) {
      const float *q = field.part + (size_t)s * CHANNELS;
      Nearby P;
      if (!P.find(record, q, s, asked.layers)) continue;
      const f8 m = *(const f8u *)(q + 8 * MA), wall = HalfWall::of(field, q, record[1] - s);
      for (int i = P.low[0]; i <= P.high[0] + 2; i++) {
        const f8 x = P.at[0] - (float)i, along = m * Seen::spline(x);
        for (u64 left = asked.layers[i] & P.box; left; left &= left - 1) {
          const int row = __builtin_ctzll(left), j = row >> 3, k = row & 7;
          const i8 in = P.in[0][i] & P.in[1][j] & P.in[2][k];
          if (!Simd::any(in)) continue;
          const f8 y = P.at[1] - (float)j, z = P.at[2] - (float)k;
          const f8 weight = Simd::pick(in, along * Seen::spline(y) * Seen::spline(z), Simd::all(0.0f));
          seen[number_of[i * 64 + row]].add(weight, x, y, z, wall);
        }
      }
    }
    for (int e = 0; e < asked.count; e++) seen[e].give(stage->spread[asked.side[e]]);
  }
}
