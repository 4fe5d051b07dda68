// Constitutive laws on eight particles at once.
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
  static inline Stuff of(const Field &field, const int *kind) {
    Stuff t;
    f8 *to = &t.law;
    i8 all = *(const i8u *)kind;
    if (!Simd::any(all != kind[0])) {
      const float *row = field.material + NM * kind[0];
      for (int k = 0; k < 10; k++) to[k] = Simd::all(row[k]);
      return t;
    }
    alignas(32) float lane[10][8];
    for (int l = 0; l < 8; l++) {
      const float *row = field.material + NM * kind[l];
      for (int k = 0; k < 10; k++) lane[k][l] = row[k];
    }
    for (int k = 0; k < 10; k++) to[k] = *(f8 *)lane[k];
    return t;
  }
};
// Symmetric matrices as 00 01 02 11 12 22.
struct Sym {
  // C = A B of matrices that commute.
  static inline void times(const f8 *A, const f8 *B, f8 *C) {
    f8 c[6] = {A[0] * B[0] + A[1] * B[1] + A[2] * B[2], A[0] * B[1] + A[1] * B[3] + A[2] * B[4],
               A[0] * B[2] + A[1] * B[4] + A[2] * B[5], A[1] * B[1] + A[3] * B[3] + A[4] * B[4],
               A[1] * B[2] + A[3] * B[4] + A[4] * B[5], A[2] * B[2] + A[4] * B[4] + A[5] * B[5]};
    for (int k = 0; k < 6; k++) C[k] = c[k];
  }
  static inline void invert(const f8 *A, f8 *B) {
    f8 c[6] = {A[3] * A[5] - A[4] * A[4], A[2] * A[4] - A[1] * A[5], A[1] * A[4] - A[2] * A[3],
               A[0] * A[5] - A[2] * A[2], A[1] * A[2] - A[0] * A[4], A[0] * A[3] - A[1] * A[1]};
    f8 per = 1.0f / (A[0] * c[0] + A[1] * c[1] + A[2] * c[2]);
    for (int k = 0; k < 6; k++) B[k] = c[k] * per;
  }
  // A = a A + b 1
  static inline void scale(f8 *A, float a, float b) {
    for (int k = 0; k < 6; k++) A[k] *= a;
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) A[k] += b;
  }
  // Largest sum of sizes in a row: no eigenvalue is larger (Gershgorin).
  static inline f8 bound(const f8 *A) {
    f8 a = Simd::size(A[1]), b = Simd::size(A[2]), c = Simd::size(A[4]);
    return Simd::high(Simd::high(Simd::size(A[0]) + a + b, Simd::size(A[3]) + a + c),
                      Simd::size(A[5]) + b + c);
  }
};
// Functions of symmetric matrices: by series where the argument is small in all lanes, else by
// eigenvalues.
struct Function {
  // Y = ln(1 + X)/2 = Z + Z^3/3 + Z^5/5 + ... with Z = X/(2 + X), to 1e-7 of itself.
  static inline void half_log(const f8 *X, f8 *Y) {
    f8 Z[6], W[6], P[6];
    if (Simd::any(Sym::bound(X) > 0.3f)) return by_values(X, 0, Y);
    for (int k = 0; k < 6; k++) Z[k] = X[k];
    Sym::scale(Z, 1.0f, 2.0f);
    Sym::invert(Z, Z);
    Sym::times(X, Z, Z);
    Sym::times(Z, Z, W);
    for (int k = 0; k < 6; k++) P[k] = W[k];
    Sym::scale(P, 1.0f / 7.0f, 1.0f / 5.0f);
    Sym::times(W, P, P);
    Sym::scale(P, 1.0f, 1.0f / 3.0f);
    Sym::times(W, P, P);
    Sym::times(Z, P, P);
    for (int k = 0; k < 6; k++) Y[k] = Z[k] + P[k];
  }
  // Y = (1 + X)^1/2 - 1: Pade's approximant (8 X + 4 X^2)/(16 + 12 X + X^2), and one step of Newton.
  static inline void root(const f8 *X, f8 *Y) {
    f8 A[6], B[6];
    if (Simd::any(Sym::bound(X) > 0.6f)) return by_values(X, 1, Y);
    Sym::times(X, X, A);
    for (int k = 0; k < 6; k++) {
      B[k] = 12.0f * X[k] + A[k];
      A[k] = 8.0f * X[k] + 4.0f * A[k];
    }
    Sym::scale(B, 1.0f, 16.0f);
    Sym::invert(B, B);
    Sym::times(A, B, Y);
    Sym::times(Y, Y, A);
    for (int k = 0; k < 6; k++) {
      A[k] = X[k] - 2.0f * Y[k] - A[k];
      B[k] = 2.0f * Y[k];
    }
    Sym::scale(B, 1.0f, 2.0f);
    Sym::invert(B, B);
    Sym::times(A, B, A);
    for (int k = 0; k < 6; k++) Y[k] += A[k];
  }
  // Y = exp(X) - 1
  static inline void expm1(const f8 *X, f8 *Y) {
    f8 A[6];
    if (Simd::any(Sym::bound(X) > 0.3f)) return by_values(X, 2, Y);
    for (int k = 0; k < 6; k++) A[k] = X[k];
    Sym::scale(A, 1.0f / 6.0f, 1.0f);
    for (int n = 5; n > 1; n--) {
      Sym::times(X, A, A);
      Sym::scale(A, 1.0f / n, 1.0f);
    }
    Sym::times(X, A, Y);
  }
  __attribute__((noinline)) static void by_values(const f8 *X, int which, f8 *Y) {
    f8 l[3], U[9];
    Math::eigen(X, l, U);
    for (int i = 0; i < 3; i++) {
      f8 low = Simd::high(l[i], Simd::all(-0.9999f));
      if (which == 0) l[i] = 0.5f * Math::log1p(low);
      if (which == 1) l[i] = low / (1.0f + Simd::root(1.0f + low));
      if (which == 2) l[i] = Math::expm1(l[i]);
    }
    Math::compose(U, l, Y);
  }
};
// Constitutive laws (design: physics, section 3) on E = b - 1, exact for small strains.
struct Laws {
  // tau = 2 mu V (V - 1) + lambda J (J - 1), V the left stretch; c its wave modulus.
  static inline void corotated(const Stuff &t, const f8 *E, f8 j1, f8 *tau, f8 &c) {
    i8 turned = j1 < -1.0f;
    f8 J = 1.0f + j1, l = t.lambda * J * j1;
    if (Simd::any(turned)) {
      inverted(t, E, turned, tau);
    } else {
      f8 V1[6], V2[6];
      Function::root(E, V1);
      Sym::times(V1, V1, V2);
      for (int k = 0; k < 6; k++) tau[k] = 2.0f * t.mu * (V1[k] + V2[k]);
    }
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) tau[k] += l;
    f8 most = Simd::root(1.0f + Sym::bound(E));
    J = Simd::high(J, Simd::all(1.0f));
    c = 2.0f * t.mu * most * (2.0f * most - 1.0f) + t.lambda * J * (2.0f * J - 1.0f);
  }
  // The same where det F < 0: the smallest stretch is negative there.
  __attribute__((noinline)) static void inverted(const Stuff &t, const f8 *E, i8 turned, f8 *tau) {
    f8 l[3], U[9], g[3];
    Math::eigen(E, l, U);
    for (int i = 0; i < 3; i++) {
      l[i] = Simd::high(l[i], Simd::all(-0.9999f));
      g[i] = Simd::root(1.0f + l[i]);
    }
    f8 least = Simd::low(g[0], Simd::low(g[1], g[2]));
    for (int i = 0; i < 3; i++) {
      i8 flip = turned & (g[i] == least);
      f8 s = Simd::pick(flip, -g[i], g[i]);
      l[i] = 2.0f * t.mu * s * Simd::pick(flip, s - 1.0f, l[i] / (1.0f + g[i]));
    }
    Math::compose(U, l, tau);
  }
  static inline void neo_hookean(const Stuff &t, const f8 *E, f8 j1, f8 *tau, f8 &c) {
    f8 l = t.lambda * Math::log1p(Simd::high(j1, Simd::all(-0.999f)));
    for (int k = 0; k < 6; k++) tau[k] = t.mu * E[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) tau[k] += l;
    f8 bound = Simd::high(Simd::high(E[0] + Simd::size(E[1]) + Simd::size(E[2]),
                                     E[3] + Simd::size(E[1]) + Simd::size(E[4])),
                          E[5] + Simd::size(E[2]) + Simd::size(E[4]));
    c = t.lambda + 2.0f * t.mu * (1.0f + Simd::high(bound, Simd::all(0.0f)));
  }
  // Deviator of a strain; returns its size.
  static inline f8 deviator(const f8 *e, f8 mean, f8 *h) {
    for (int k = 0; k < 6; k++) h[k] = e[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) h[k] -= mean;
    return Simd::root(h[0] * h[0] + h[3] * h[3] + h[5] * h[5] +
                      2.0f * (h[1] * h[1] + h[2] * h[2] + h[4] * h[4]));
  }
  // Strain to the cone; gives what it changed by, the slip, the volume correction, and the plastic
  // work per rest volume with the stress after the return.
  static inline f8 sand(const Stuff &t, f8 *e, f8 *moved, f8 &change, f8 &vc) {
    f8 zero = Simd::all(0.0f), h[6], tr = e[0] + e[3] + e[5] + vc, start = tr * (1.0f / 3.0f);
    f8 mean = start, n = deviator(e, mean - vc * (1.0f / 3.0f), h), out = tr - t.apex;
    f8 slip = n + t.cone * (3.0f * t.lambda + 2.0f * t.mu) / (2.0f * t.mu) * out;
    slip = Simd::low(Simd::high(slip, zero), n);
    i8 apex = out > 0.0f;
    f8 scale = 1.0f - slip / Simd::high(n, Simd::all(1e-30f));
    scale = Simd::pick(apex, zero, scale);
    mean = Simd::pick(apex, t.apex * (1.0f / 3.0f), mean);
    f8 after = 3.0f * mean;
    // Beyond the apex what was open before is no new slip: only the change is.
    f8 opened = Simd::pick(apex, vc, zero), gone = start - mean - opened * (1.0f / 3.0f);
    f8 work = 2.0f * t.mu * (scale * (1.0f - scale) * n * n + after * gone) +
              3.0f * t.lambda * after * gone;
    f8 shift = mean - start + vc * (1.0f / 3.0f);
    for (int k = 0; k < 6; k++) moved[k] = (scale - 1.0f) * h[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) moved[k] += shift;
    for (int k = 0; k < 6; k++) e[k] = scale * h[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) e[k] += mean;
    out -= opened;
    change = Simd::pick(apex, Simd::root(n * n + out * out * (1.0f / 3.0f)), slip);
    vc = tr - after;
    return work;
  }
  static inline f8 metal(const Stuff &t, f8 *e, f8 *moved, f8 &change, f8 ep) {
    const float R = 0.81649658f;
    f8 h[6], n = deviator(e, (e[0] + e[3] + e[5]) * (1.0f / 3.0f), h);
    f8 dg = (2.0f * t.mu * n - R * (t.yield + t.hard * ep)) /
            (2.0f * t.mu + (2.0f / 3.0f) * t.hard);
    dg = Simd::high(dg, Simd::all(0.0f));
    f8 less = dg / Simd::high(n, Simd::all(1e-30f));
    for (int k = 0; k < 6; k++) {
      moved[k] = -less * h[k];
      e[k] += moved[k];
    }
    change = dg;
    return 2.0f * t.mu * n * (1.0f - less) * dg;
  }
};
