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

