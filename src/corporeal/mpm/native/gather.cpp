// Grid to particles, one task: velocities, affine parts, places, strain, return map and stress.
struct Math {
  // ln(1 + x), exact for small x.
  static inline f8 log1p(f8 x) {
    f8 y = 1.0f + x;
    i8 k = ((i8)y - 0x3f3504f3) >> 23;
    f8 scaled = (f8)((i8)y - (k << 23)) - 1.0f;
    f8 f = Simd::pick(k == 0, x, scaled);
    f8 z = f / (2.0f + f), s = z * z;
    f8 p = 2.0f / 9.0f + s * (2.0f / 11.0f);
    p = 2.0f / 7.0f + s * p;
    p = 2.0f / 5.0f + s * p;
    p = 2.0f / 3.0f + s * p;
    return z * (2.0f + s * p) + Simd::flo(k) * 0.69314718f;
  }
  // exp(x) - 1, exact for small x.
  static inline f8 expm1(f8 x) {
    x = Simd::low(Simd::high(x, Simd::all(-60.0f)), Simd::all(60.0f));
    f8 t = x * 1.44269504f;
    i8 k = Simd::whole(t + Simd::pick(t < 0.0f, Simd::all(-0.5f), Simd::all(0.5f)));
    f8 n = Simd::flo(k);
    f8 r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
    f8 p = 1.0f / 720.0f + r * (1.0f / 5040.0f);
    p = 1.0f / 120.0f + r * p;
    p = 1.0f / 24.0f + r * p;
    p = 1.0f / 6.0f + r * p;
    p = 0.5f + r * p;
    p = r + r * r * p;
    f8 two = (f8)((k + 127) << 23);
    return Simd::pick(k == 0, p, two * p + (two - 1.0f));
  }
  static inline void rotate(f8 &app, f8 &aqq, f8 &apq, f8 &arp, f8 &arq, f8 *V, int p, int q) {
    f8 zero = Simd::all(0.0f), one = Simd::all(1.0f);
    i8 small = Simd::size(apq) < (Simd::size(app) + Simd::size(aqq)) * 1e-9f + 1e-30f;
    f8 tau = (aqq - app) * 0.5f / Simd::pick(small, one, apq);
    f8 h = Simd::root(1.0f + tau * tau);
    f8 t = 1.0f / (Simd::size(tau) + h);
    t = Simd::pick(tau < 0.0f, -t, t);
    t = Simd::pick(small, zero, t);
    f8 c = 1.0f / Simd::root(1.0f + t * t), s = t * c, tp = t * apq;
    app = app - tp;
    aqq = aqq + tp;
    apq = zero;
    f8 a = arp, b = arq;
    arp = c * a - s * b;
    arq = s * a + c * b;
    for (int i = 0; i < 3; i++) {
      f8 x = V[3 * i + p], y = V[3 * i + q];
      V[3 * i + p] = c * x - s * y;
      V[3 * i + q] = s * x + c * y;
    }
  }
  // E = V diag(l) Vt of a symmetric matrix (00 01 02 11 12 22) by four sweeps of Jacobi.
  static inline void eigen(const f8 *E, f8 *l, f8 *V) {
    f8 z = Simd::all(0.0f), o = Simd::all(1.0f);
    f8 a00 = E[0], a01 = E[1], a02 = E[2], a11 = E[3], a12 = E[4], a22 = E[5];
    for (int i = 0; i < 9; i++) V[i] = z;
    V[0] = V[4] = V[8] = o;
    for (int sweep = 0; sweep < 4; sweep++) {
      rotate(a00, a11, a01, a02, a12, V, 0, 1);
      rotate(a00, a22, a02, a01, a12, V, 0, 2);
      rotate(a11, a22, a12, a01, a02, V, 1, 2);
      f8 off = Simd::size(a01) + Simd::size(a02) + Simd::size(a12);
      f8 on = Simd::size(a00) + Simd::size(a11) + Simd::size(a22);
      if (sweep > 0 && !Simd::any(off > on * 1e-8f)) break;
    }
    l[0] = a00;
    l[1] = a11;
    l[2] = a22;
  }
  // S = U diag(t) Ut as 00 01 02 11 12 22.
  static inline void compose(const f8 *U, const f8 *t, f8 *S) {
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        S[n++] = t[0] * U[3 * i] * U[3 * j] + t[1] * U[3 * i + 1] * U[3 * j + 1] +
                 t[2] * U[3 * i + 2] * U[3 * j + 2];
  }
};
// Material of each lane.
struct Stuff {
  f8 law, mu, lambda, yield, hard, cone, apex, visc, keep, rho;
};
// Laws in principal form (design: physics, section 3). H = F - 1 keeps small strains exact.
struct Laws {
  // Principal strain eps to the cone or cylinder; returns the plastic work per rest volume, with
  // the stress after the return.
  static inline f8 sand(const Stuff &t, f8 *eps, f8 &change, f8 &vc) {
    f8 zero = Simd::all(0.0f), h[3], work = zero;
    for (int i = 0; i < 3; i++) eps[i] += vc * (1.0f / 3.0f);
    f8 tr = eps[0] + eps[1] + eps[2], mean = tr * (1.0f / 3.0f);
    for (int i = 0; i < 3; i++) h[i] = eps[i] - mean;
    f8 n = Simd::root(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    f8 out = tr - t.apex;
    f8 slip = n + t.cone * (3.0f * t.lambda + 2.0f * t.mu) / (2.0f * t.mu) * out;
    slip = Simd::low(Simd::high(slip, zero), n);
    i8 apex = out > 0.0f;
    f8 scale = 1.0f - slip / Simd::high(n, Simd::all(1e-30f));
    scale = Simd::pick(apex, zero, scale);
    mean = Simd::pick(apex, t.apex * (1.0f / 3.0f), mean);
    f8 after = 3.0f * mean;
    // Beyond the apex what was open before is no new slip: only the change is.
    f8 opened = Simd::pick(apex, vc, zero);
    for (int i = 0; i < 3; i++) {
      f8 next = scale * h[i] + mean;
      work += (2.0f * t.mu * next + t.lambda * after) * (eps[i] - next - opened * (1.0f / 3.0f));
      eps[i] = next;
    }
    out -= opened;
    change = Simd::pick(apex, Simd::root(n * n + out * out * (1.0f / 3.0f)), slip);
    vc = tr - after;
    return work;
  }
  static inline f8 metal(const Stuff &t, f8 *eps, f8 &change, f8 ep) {
    const float R = 0.81649658f;
    f8 zero = Simd::all(0.0f);
    f8 mean = (eps[0] + eps[1] + eps[2]) * (1.0f / 3.0f), h[3];
    for (int i = 0; i < 3; i++) h[i] = eps[i] - mean;
    f8 n = Simd::root(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    f8 dg = (2.0f * t.mu * n - R * (t.yield + t.hard * ep)) /
            (2.0f * t.mu + (2.0f / 3.0f) * t.hard);
    dg = Simd::high(dg, zero);
    f8 scale = 1.0f - dg / Simd::high(n, Simd::all(1e-30f));
    for (int i = 0; i < 3; i++) eps[i] = scale * h[i] + mean;
    change = dg;
    return 2.0f * t.mu * n * scale * dg;
  }
};

int *task = world->task + 4 * index;
Field &field = world->field[task[0]];
const float dt = (float)world->dt, step = (float)(world->dt / world->dx);
const float dx = (float)world->dx;
f8 speed2 = Simd::all(0.0f), wave2 = Simd::all(0.0f);
double plastic = 0, viscous = 0;
int astray = 0;
alignas(64) f8 arena[512];
for (int b = task[1]; b < task[2]; b++) {
  const int *block = field.block + NB * b;
  for (int i = 0; i < 8; i++)
    for (int j = 0; j < 8; j++) {
      int ib = (i + 3) >> 2, jb = (j + 3) >> 2;
      const int *near = block + 5 + (ib * 3 + jb) * 3;
      f8 *h = arena + i * 64 + j * 8;
      size_t row = ((i + 3) & 3) * 16 + ((j + 3) & 3) * 4;
      const f8u *g0 = (f8u *)field.node + (size_t)near[0] * 64 + row;
      const f8u *g1 = (f8u *)field.node + (size_t)near[1] * 64 + row;
      const f8u *g2 = (f8u *)field.node + (size_t)near[2] * 64 + row;
      h[0] = g0[3];
      for (int k = 0; k < 4; k++) h[1 + k] = g1[k];
      for (int k = 0; k < 3; k++) h[5 + k] = g2[k];
    }
  for (int s = block[0]; s < block[1]; s += 8) {
    float *q = field.part + (size_t)s * NC;
    int live = block[1] - s < 8 ? block[1] - s : 8;
    alignas(32) float W[9][8], D[3][8];
    alignas(32) int base[8];
    i8 at = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int d = 0; d < 3; d++) {
      i8 x = *(i8u *)(q + 8 * (XI + d));
      i8 cell = (x - HALF) >> PLACE;
      f8 f = Simd::flo(x - (cell << PLACE)) * PER_UNIT;
      f8 w[3];
      Simd::spline(f, w);
      *(f8 *)D[d] = f;
      for (int k = 0; k < 3; k++) *(f8 *)W[3 * d + k] = w[k];
      at = at * 8 + (cell - (4 * block[2 + d] - 1));
    }
    *(i8 *)base = at;
    f8 u[8], c0[8], c1[8], c2[8];
    for (int l = 0; l < 8; l++) {
      const f8 *g = arena + base[l];
      float w0 = W[6][l], w1 = W[7][l], w2 = W[8][l];
      f8 v = Simd::all(0.0f), x = v, y = v, z = v;
#pragma unroll
      for (int i = 0; i < 3; i++) {
        float wi = W[i][l];
        f8 ci = Simd::all(0.0f);
#pragma unroll
        for (int j = 0; j < 3; j++) {
          float w = wi * W[3 + j][l];
          const f8 *h = g + i * 64 + j * 8;
          f8 h1 = w1 * h[1], h2 = w2 * h[2];
          f8 s0 = (w0 * h[0] + h1 + h2) * w, s1 = (h1 + 2.0f * h2) * w;
          ci += s0;
          z += s1;
          if (j == 1) y += s0;
          if (j == 2) y += 2.0f * s0;
        }
        v += ci;
        if (i == 1) x += ci;
        if (i == 2) x += 2.0f * ci;
      }
      u[l] = v;
      c0[l] = x - D[0][l] * v;
      c1[l] = y - D[1][l] * v;
      c2[l] = z - D[2][l] * v;
    }
    Simd::turn(u);
    Simd::turn(c0);
    Simd::turn(c1);
    Simd::turn(c2);

    Stuff t;
    alignas(32) float prop[10][8];
    for (int l = 0; l < 8; l++) {
      const float *row = field.material + NM * ((int *)(q + 8 * MT))[l];
      for (int k = 0; k < 10; k++) prop[k][l] = row[k];
    }
    t.law = *(f8 *)prop[LAW];
    t.mu = *(f8 *)prop[MU];
    t.lambda = *(f8 *)prop[LAMBDA];
    t.yield = *(f8 *)prop[YIELD];
    t.hard = *(f8 *)prop[HARD];
    t.cone = *(f8 *)prop[CONE];
    t.apex = *(f8 *)prop[APEX];
    t.visc = *(f8 *)prop[VISC];
    t.rho = *(f8 *)prop[RHO];
    f8 keep = 1.0f - Simd::low(Simd::all(1.0f), dt * *(f8 *)prop[KEEP]);
    const i8 count = i8{0, 1, 2, 3, 4, 5, 6, 7};
    i8 alive = count < live;
    f8 on = Simd::pick(alive, Simd::all(1.0f), Simd::all(0.0f));

    // Velocity, affine part and place; L is the grid's gradient times dx.
    f8 L[9], C[9], B[9], v2 = Simd::all(0.0f);
    i8 off = i8{0, 0, 0, 0, 0, 0, 0, 0};
    for (int k = 0; k < 3; k++) {
      f8u *v = (f8u *)(q + 8 * (VE + k));
      f8 now = u[1 + k] + keep * (*v - u[4 + k]);
      *v = now;
      v2 += now * now;
      f8 col_new[3] = {c0[1 + k], c1[1 + k], c2[1 + k]};
      f8 col_old[3] = {c0[4 + k], c1[4 + k], c2[4 + k]};
      for (int j = 0; j < 3; j++) {
        f8u *c = (f8u *)(q + 8 * (AF + 3 * k + j));
        f8 grad = 4.0f * col_new[j];
        B[3 * k + j] = *c;
        C[3 * k + j] = grad + keep * (*c - 4.0f * col_old[j]);
        *c = C[3 * k + j];
        L[3 * k + j] = grad;
      }
      f8 move = u[1 + k] * on * (step * (float)UNIT);
      move += Simd::pick(move < 0.0f, Simd::all(-0.5f), Simd::all(0.5f));
      i8u *x = (i8u *)(q + 8 * (XI + k));
      i8 next = *x + Simd::whole(move);
      *x = next;
      i8 inside = ((next - HALF) >> PLACE) - (4 * block[2 + k] - 1);
      off |= (inside < 0) | (inside > 5);
    }
    if (Simd::any(off & alive)) astray = 1;
    speed2 = Simd::high(speed2, v2 * on);

    // Strain: H += dt L (1 + H).
    f8 H[9], A[9];
    float rate = step;
    for (int k = 0; k < 9; k++) H[k] = *(f8u *)(q + 8 * (DE + k));
    for (int k = 0; k < 9; k++) A[k] = L[k] * (on * rate);
    f8 G[9];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        G[3 * i + j] = H[3 * i + j] + A[3 * i + j] + A[3 * i] * H[j] + A[3 * i + 1] * H[3 + j] +
                       A[3 * i + 2] * H[6 + j];
    for (int k = 0; k < 9; k++) H[k] = G[k];
    // b - 1 = H + Ht + H Ht
    f8 E[6];
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        E[n++] = H[3 * i + j] + H[3 * j + i] + H[3 * i] * H[3 * j] + H[3 * i + 1] * H[3 * j + 1] +
                 H[3 * i + 2] * H[3 * j + 2];
    f8 minors = H[0] * H[4] - H[1] * H[3] + H[0] * H[8] - H[2] * H[6] + H[4] * H[8] - H[5] * H[7];
    f8 det = H[0] * (H[4] * H[8] - H[5] * H[7]) - H[1] * (H[3] * H[8] - H[5] * H[6]) +
             H[2] * (H[3] * H[7] - H[4] * H[6]);
    f8 j1 = H[0] + H[4] + H[8] + minors + det;   // J - 1
    f8 volume = *(f8u *)(q + 8 * VO);
    f8 stress[6], wave = t.lambda + 2.0f * t.mu;
    for (int k = 0; k < 6; k++) stress[k] = Simd::all(0.0f);

    i8 neo = t.law == 1.0f;
    if (Simd::any(neo)) {
      f8 l = t.lambda * Math::log1p(Simd::high(j1, Simd::all(-0.999f)));
      for (int k = 0; k < 6; k++)
        stress[k] = Simd::pick(neo, t.mu * E[k] + (k == 0 || k == 3 || k == 5 ? l : 0.0f * l),
                               stress[k]);
      f8 bound = Simd::high(Simd::high(E[0] + Simd::size(E[1]) + Simd::size(E[2]),
                                       E[3] + Simd::size(E[1]) + Simd::size(E[4])),
                            E[5] + Simd::size(E[2]) + Simd::size(E[4]));
      f8 w = t.lambda + 2.0f * t.mu * (1.0f + Simd::high(bound, Simd::all(0.0f)));
      wave = Simd::pick(neo, w, wave);
    }
    if (Simd::any((t.law != 1.0f) & (t.law < 5.0f))) {
      f8 l[3], U[9], sigma[3], s1[3], p[3];
      Math::eigen(E, l, U);
      for (int i = 0; i < 3; i++) {
        l[i] = Simd::high(l[i], Simd::all(-0.9999f));
        sigma[i] = Simd::root(1.0f + l[i]);
        s1[i] = l[i] / (1.0f + sigma[i]);
        p[i] = Simd::all(0.0f);
      }
      i8 fixed = t.law == 0.0f;
      if (Simd::any(fixed)) {
        // An inverted particle has its smallest stretch negative.
        i8 turned = j1 < -1.0f;
        f8 least = Simd::low(sigma[0], Simd::low(sigma[1], sigma[2]));
        f8 most = Simd::high(sigma[0], Simd::high(sigma[1], sigma[2]));
        f8 lj = t.lambda * (1.0f + j1) * j1;
        for (int i = 0; i < 3; i++) {
          i8 flip = turned & (sigma[i] == least);
          f8 g = Simd::pick(flip, -sigma[i], sigma[i]);
          f8 g1 = Simd::pick(flip, g - 1.0f, s1[i]);
          p[i] = Simd::pick(fixed, 2.0f * t.mu * g * g1 + lj, p[i]);
        }
        f8 J = Simd::high(1.0f + j1, Simd::all(1.0f));
        most = Simd::high(most, Simd::all(1.0f));
        f8 w = 2.0f * t.mu * most * (2.0f * most - 1.0f) + t.lambda * J * (2.0f * J - 1.0f);
        wave = Simd::pick(fixed, w, wave);
      }
      i8 log_law = t.law >= 2.0f;
      if (Simd::any(log_law)) {
        f8 eps[3], old[3], lost = Simd::all(0.0f), change = lost;
        for (int i = 0; i < 3; i++) old[i] = eps[i] = 0.5f * Math::log1p(l[i]);
        i8 flow = t.law >= 3.0f;
        if (Simd::any(flow)) {
          f8 ep = *(f8u *)(q + 8 * EP), vc = *(f8u *)(q + 8 * VC);
          i8 grain = t.law == 3.0f;
          if (Simd::any(grain)) {
            f8 e[3] = {eps[0], eps[1], eps[2]}, d, v = vc;
            f8 w = Laws::sand(t, e, d, v);
            for (int i = 0; i < 3; i++) eps[i] = Simd::pick(grain, e[i], eps[i]);
            change = Simd::pick(grain, d, change);
            lost = Simd::pick(grain, w, lost);
            *(f8u *)(q + 8 * VC) = Simd::pick(grain & alive, v, vc);
          }
          i8 ductile = t.law == 4.0f;
          if (Simd::any(ductile)) {
            f8 e[3] = {eps[0], eps[1], eps[2]}, d;
            f8 w = Laws::metal(t, e, d, ep);
            for (int i = 0; i < 3; i++) eps[i] = Simd::pick(ductile, e[i], eps[i]);
            change = Simd::pick(ductile, d, change);
            lost = Simd::pick(ductile, w, lost);
          }
          *(f8u *)(q + 8 * EP) = ep + 0.81649658f * change * on;
          lost *= volume * on;
          for (int k = 0; k < 8; k++) plastic += lost[k];
          // H = U diag(exp(new - old)) Ut (1 + H) - 1
          f8 g[3], S[6];
          for (int i = 0; i < 3; i++) g[i] = Math::expm1(eps[i] - old[i]);
          Math::compose(U, g, S);
          f8 M[9] = {S[0], S[1], S[2], S[1], S[3], S[4], S[2], S[4], S[5]};
          for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
              f8 h = H[3 * i + j] + M[3 * i + j] + M[3 * i] * H[j] + M[3 * i + 1] * H[3 + j] +
                     M[3 * i + 2] * H[6 + j];
              G[3 * i + j] = Simd::pick(flow, h, H[3 * i + j]);
            }
          for (int k = 0; k < 9; k++) H[k] = G[k];
          // The whole motion, plastic part included.
          for (int k = 0; k < 9; k++) G[k] = *(f8u *)(q + 8 * (TM + k));
          for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
              *(f8u *)(q + 8 * (TM + 3 * i + j)) =
                  G[3 * i + j] + A[3 * i + j] + A[3 * i] * G[j] + A[3 * i + 1] * G[3 + j] + A[3 * i + 2] * G[6 + j];
        }
        f8 tr = eps[0] + eps[1] + eps[2];
        for (int i = 0; i < 3; i++)
          p[i] = Simd::pick(log_law, 2.0f * t.mu * eps[i] + t.lambda * tr, p[i]);
      }
      f8 S[6];
      Math::compose(U, p, S);
      for (int k = 0; k < 6; k++) stress[k] = Simd::pick(neo, stress[k], S[k]);
    }
    if (Simd::any(t.visc > 0.0f)) {
      f8 eta = t.visc * Simd::high(1.0f + j1, Simd::all(0.0f)) * (1.0f / dx), w = Simd::all(0.0f);
      int k = 0;
      for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
          f8 d = C[3 * i + j] + C[3 * j + i];
          stress[k++] += eta * d;
          // Work of the stress that acted in this step, which the old affine part made.
          w += (i == j ? 0.5f : 1.0f) * (B[3 * i + j] + B[3 * j + i]) *
               (L[3 * i + j] + L[3 * j + i]);
        }
      w *= eta * volume * on * (dt / dx);
      for (int l = 0; l < 8; l++) viscous += w[l];
    }
    wave2 = Simd::high(wave2, on * wave / t.rho);
    for (int k = 0; k < 9; k++) *(f8u *)(q + 8 * (DE + k)) = H[k];
    f8 scale = volume * (-4.0f / dx) * on;
    for (int k = 0; k < 6; k++) *(f8u *)(q + 8 * (ST + k)) = scale * stress[k];
  }
}
double *report = world->report + NR * index;
float top = 0, fast = 0;
for (int l = 0; l < 8; l++) {
  // NaN fails every comparison: keep it visible.
  if (!(speed2[l] <= top)) top = speed2[l];
  if (!(wave2[l] <= fast)) fast = wave2[l];
}
report[SPEED2] = top;
report[WAVE2] = fast;
report[PLASTIC] += plastic;
report[VISCOUS] += viscous;
report[ASTRAY] = astray;
