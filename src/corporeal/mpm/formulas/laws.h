// Constitutive laws of both fast engines: the twins of mpm/laws, in float32, as templates on the
// width. A law is a struct Rule<NUMBER, R>; the dispatch is generated from the menu of
// mpm/laws, which the preamble gives as the enum Law and as lists:
//   MPM_ELASTIC(X)  laws whose stress follows from b - 1: Rule has stress and energy;
//   MPM_PLASTIC(X)  laws with a return map on the logarithmic strain of HENCKY: Rule has flow;
//   MPM_LIQUID(X)   those of them that take any shape;
//   MPM_BULKY(X)    laws whose pressure may come from a mean volume: Rule has mean_pressure and
//                   mean_energy.
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
constexpr float ROOT_2_3 = 0.81649658f;   // sqrt(2/3)
// Scalar functions that keep the precision of small arguments.
template <class R> struct Math {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  // ln(1 + x), exact for small x.
  CUDA_CALLABLE static inline R log1p(R x) {
    R y = 1.0f + x;
    M k = (S::bits(y) - 0x3f3504f3) >> 23;
    R scaled = S::from_bits(S::bits(y) - (k << 23)) - 1.0f;
    R f = S::pick(k == 0, x, scaled);
    R z = f / (2.0f + f), s = z * z;
    R p = 2.0f / 9.0f + s * (2.0f / 11.0f);
    p = 2.0f / 7.0f + s * p;
    p = 2.0f / 5.0f + s * p;
    p = 2.0f / 3.0f + s * p;
    return z * (2.0f + s * p) + S::flo(k) * 0.69314718f;
  }
  // exp(x) - 1, exact for small x.
  CUDA_CALLABLE static inline R expm1(R x) {
    x = S::low(S::high(x, S::all(-60.0f)), S::all(60.0f));
    R t = x * 1.44269504f;
    M k = S::whole(t + S::pick(t < 0.0f, S::all(-0.5f), S::all(0.5f)));
    R n = S::flo(k);
    R r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
    R p = 1.0f / 720.0f + r * (1.0f / 5040.0f);
    p = 1.0f / 120.0f + r * p;
    p = 1.0f / 24.0f + r * p;
    p = 1.0f / 6.0f + r * p;
    p = 0.5f + r * p;
    p = r + r * r * p;
    R two = S::from_bits((k + 127) << 23);
    return S::pick(k == 0, p, two * p + (two - 1.0f));
  }
  // ln x of a positive number.
  CUDA_CALLABLE static inline R log(R x) {
    M k = (S::bits(x) - 0x3f3504f3) >> 23;
    return log1p(S::from_bits(S::bits(x) - (k << 23)) - 1.0f) + S::flo(k) * 0.69314718f;
  }
  CUDA_CALLABLE static inline R exp(R x) {
    x = S::low(S::high(x, S::all(-80.0f)), S::all(80.0f));
    R t = x * 1.44269504f;
    M k = S::whole(t + S::pick(t < 0.0f, S::all(-0.5f), S::all(0.5f)));
    R n = S::flo(k);
    R r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
    return S::from_bits((k + 127) << 23) * (1.0f + expm1(r));
  }
  // Angle from the first axis to (x, y) [rad]; 0 of nothing. Relative to it exact where it is small (Cephes' atanf).
  CUDA_CALLABLE static inline R angle(R y, R x) {
    R ax = S::size(x), ay = S::size(y), low = S::low(ax, ay), high = S::high(S::high(ax, ay), S::all((float)TINY));
    M steep = ay > ax, half = low > 0.41421356f * high;
    R t = S::pick(half, low - high, low) / S::pick(half, low + high, high), s = t * t;
    R p = -1.38776856e-1f + s * 8.05374449e-2f;
    p = 1.99777106e-1f + s * p;
    p = -3.33329491e-1f + s * p;
    R a = t + t * s * p;
    a = S::pick(half, 0.78539816f + a, a);
    a = S::pick(steep, 1.57079633f - a, a);
    a = S::pick(x < 0.0f, 3.14159265f - a, a);
    return S::pick(y < 0.0f, -a, a);
  }
  // The same angle from -pi to pi, of one within one turn of that.
  CUDA_CALLABLE static inline R wrapped(R a) {
    a = S::pick(a > 3.14159265f, (a - 6.28125f) - 1.93530718e-3f, a);
    return S::pick(a < -3.14159265f, (a + 6.28125f) + 1.93530718e-3f, a);
  }
  // x^y of a positive number.
  CUDA_CALLABLE static inline R power(R x, R y) { return exp(y * log(x)); }
  CUDA_CALLABLE static inline void rotate(R &app, R &aqq, R &apq, R &arp, R &arq, R *V, int p, int q) {
    R zero = S::all(0.0f), one = S::all(1.0f);
    M small = S::size(apq) < (S::size(app) + S::size(aqq)) * 1e-9f + 1e-30f;
    R tau = (aqq - app) * 0.5f / S::pick(small, one, apq);
    R h = S::root(1.0f + tau * tau);
    R t = 1.0f / (S::size(tau) + h);
    t = S::pick(tau < 0.0f, -t, t);
    t = S::pick(small, zero, t);
    R c = 1.0f / S::root(1.0f + t * t), s = t * c, tp = t * apq;
    app = app - tp;
    aqq = aqq + tp;
    apq = zero;
    R a = arp, b = arq;
    arp = c * a - s * b;
    arq = s * a + c * b;
    for (int i = 0; i < 3; i++) {
      R x = V[3 * i + p], y = V[3 * i + q];
      V[3 * i + p] = c * x - s * y;
      V[3 * i + q] = s * x + c * y;
    }
  }
  // E = V diag(l) Vt of a symmetric matrix (00 01 02 11 12 22) by four sweeps of Jacobi.
  CUDA_CALLABLE static inline void eigen(const R *E, R *l, R *V) {
    R z = S::all(0.0f), o = S::all(1.0f);
    R a00 = E[0], a01 = E[1], a02 = E[2], a11 = E[3], a12 = E[4], a22 = E[5];
    for (int i = 0; i < 9; i++) V[i] = z;
    V[0] = V[4] = V[8] = o;
    for (int sweep = 0; sweep < 4; sweep++) {
      rotate(a00, a11, a01, a02, a12, V, 0, 1);
      rotate(a00, a22, a02, a01, a12, V, 0, 2);
      rotate(a11, a22, a12, a01, a02, V, 1, 2);
      R off = S::size(a01) + S::size(a02) + S::size(a12);
      R on = S::size(a00) + S::size(a11) + S::size(a22);
      if (sweep > 0 && !S::any(off > on * 1e-8f)) break;
    }
    l[0] = a00;
    l[1] = a11;
    l[2] = a22;
  }
  // S = U diag(t) Ut as 00 01 02 11 12 22.
  CUDA_CALLABLE static inline void compose(const R *U, const R *t, R *A) {
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        A[n++] = t[0] * U[3 * i] * U[3 * j] + t[1] * U[3 * i + 1] * U[3 * j + 1] +
                 t[2] * U[3 * i + 2] * U[3 * j + 2];
  }
};
// Symmetric matrices as 00 01 02 11 12 22.
template <class R> struct Sym {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  // C = A B of matrices that commute.
  CUDA_CALLABLE static inline void times(const R *A, const R *B, R *C) {
    R c[6] = {A[0] * B[0] + A[1] * B[1] + A[2] * B[2], A[0] * B[1] + A[1] * B[3] + A[2] * B[4],
               A[0] * B[2] + A[1] * B[4] + A[2] * B[5], A[1] * B[1] + A[3] * B[3] + A[4] * B[4],
               A[1] * B[2] + A[3] * B[4] + A[4] * B[5], A[2] * B[2] + A[4] * B[4] + A[5] * B[5]};
    for (int k = 0; k < 6; k++) C[k] = c[k];
  }
  CUDA_CALLABLE static inline void invert(const R *A, R *B) {
    R c[6] = {A[3] * A[5] - A[4] * A[4], A[2] * A[4] - A[1] * A[5], A[1] * A[4] - A[2] * A[3],
               A[0] * A[5] - A[2] * A[2], A[1] * A[2] - A[0] * A[4], A[0] * A[3] - A[1] * A[1]};
    R per = 1.0f / (A[0] * c[0] + A[1] * c[1] + A[2] * c[2]);
    for (int k = 0; k < 6; k++) B[k] = c[k] * per;
  }
  // A = a A + b 1
  CUDA_CALLABLE static inline void scale(R *A, float a, float b) {
    for (int k = 0; k < 6; k++) A[k] *= a;
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) A[k] += b;
  }
  // Largest sum of sizes in a row: no eigenvalue is larger (Gershgorin).
  CUDA_CALLABLE static inline R bound(const R *A) {
    R a = S::size(A[1]), b = S::size(A[2]), c = S::size(A[4]);
    return S::high(S::high(S::size(A[0]) + a + b, S::size(A[3]) + a + c),
                      S::size(A[5]) + b + c);
  }
  // Deviator of a strain; returns its size.
  CUDA_CALLABLE static inline R deviator(const R *e, R mean, R *h) {
    for (int k = 0; k < 6; k++) h[k] = e[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) h[k] -= mean;
    return S::root(h[0] * h[0] + h[3] * h[3] + h[5] * h[5] +
                      2.0f * (h[1] * h[1] + h[2] * h[2] + h[4] * h[4]));
  }
};
// Functions of symmetric matrices: by series where the argument is small in all lanes, else by
// eigenvalues.
template <class R> struct Function {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  // Y = ln(1 + X)/2 = Z + Z^3/3 + Z^5/5 + ... with Z = X/(2 + X), to 1e-7 of itself.
  CUDA_CALLABLE static inline void half_log(const R *X, R *Y) {
    R Z[6], W[6], P[6];
    if (S::any(Sym<R>::bound(X) > 0.3f)) return by_values(X, 0, Y);
    for (int k = 0; k < 6; k++) Z[k] = X[k];
    Sym<R>::scale(Z, 1.0f, 2.0f);
    Sym<R>::invert(Z, Z);
    Sym<R>::times(X, Z, Z);
    Sym<R>::times(Z, Z, W);
    for (int k = 0; k < 6; k++) P[k] = W[k];
    Sym<R>::scale(P, 1.0f / 7.0f, 1.0f / 5.0f);
    Sym<R>::times(W, P, P);
    Sym<R>::scale(P, 1.0f, 1.0f / 3.0f);
    Sym<R>::times(W, P, P);
    Sym<R>::times(Z, P, P);
    for (int k = 0; k < 6; k++) Y[k] = Z[k] + P[k];
  }
  // Y = (1 + X)^1/2 - 1: Pade's approximant (8 X + 4 X^2)/(16 + 12 X + X^2), and one step of Newton.
  CUDA_CALLABLE static inline void root(const R *X, R *Y) {
    R A[6], B[6];
    if (S::any(Sym<R>::bound(X) > 0.6f)) return by_values(X, 1, Y);
    Sym<R>::times(X, X, A);
    for (int k = 0; k < 6; k++) {
      B[k] = 12.0f * X[k] + A[k];
      A[k] = 8.0f * X[k] + 4.0f * A[k];
    }
    Sym<R>::scale(B, 1.0f, 16.0f);
    Sym<R>::invert(B, B);
    Sym<R>::times(A, B, Y);
    Sym<R>::times(Y, Y, A);
    for (int k = 0; k < 6; k++) {
      A[k] = X[k] - 2.0f * Y[k] - A[k];
      B[k] = 2.0f * Y[k];
    }
    Sym<R>::scale(B, 1.0f, 2.0f);
    Sym<R>::invert(B, B);
    Sym<R>::times(A, B, A);
    for (int k = 0; k < 6; k++) Y[k] += A[k];
  }
  // Y = exp(X) - 1
  CUDA_CALLABLE static inline void expm1(const R *X, R *Y) {
    R A[6];
    if (S::any(Sym<R>::bound(X) > 0.3f)) return by_values(X, 2, Y);
    for (int k = 0; k < 6; k++) A[k] = X[k];
    Sym<R>::scale(A, 1.0f / 6.0f, 1.0f);
    for (int n = 5; n > 1; n--) {
      Sym<R>::times(X, A, A);
      Sym<R>::scale(A, 1.0f / n, 1.0f);
    }
    Sym<R>::times(X, A, Y);
  }
  MPM_RARE CUDA_CALLABLE static void by_values(const R *X, int which, R *Y) {
    R l[3], U[9];
    Math<R>::eigen(X, l, U);
    for (int i = 0; i < 3; i++) {
      R low = S::high(l[i], S::all(-0.9999f));
      if (which == 0) l[i] = 0.5f * Math<R>::log1p(low);
      if (which == 1) l[i] = low / (1.0f + S::root(1.0f + low));
      if (which == 2) l[i] = Math<R>::expm1(l[i]);
    }
    Math<R>::compose(U, l, Y);
  }
};
// How the elastic part of a particle's strain is described: H = F - 1, so that float32 does not round
// small strains away.
template <class R> struct Strain {
  // b - 1 = H + Ht + H Ht, as 00 01 02 11 12 22
  CUDA_CALLABLE static inline void left(const R *H, R *E) {
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        E[n++] = H[3 * i + j] + H[3 * j + i] + H[3 * i] * H[3 * j] + H[3 * i + 1] * H[3 * j + 1] +
                 H[3 * i + 2] * H[3 * j + 2];
  }
  // J - 1
  CUDA_CALLABLE static inline R volume(const R *H) {
    R minors = H[0] * H[4] - H[1] * H[3] + H[0] * H[8] - H[2] * H[6] + H[4] * H[8] - H[5] * H[7];
    return H[0] + H[4] + H[8] + minors + determinant(H);
  }
  CUDA_CALLABLE static inline R determinant(const R *F) {
    return F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
           F[2] * (F[3] * F[7] - F[4] * F[6]);
  }
  // J, in double precision.
  CUDA_CALLABLE static inline R whole(const R *H) {
    R F[9];
    for (int i = 0; i < 9; i++) F[i] = H[i] + (i % 4 == 0);
    return determinant(F);
  }
  // Eigenvalues of FtF - 1 (Smith 1961): squares of stretches, less 1; in double precision.
  CUDA_CALLABLE static inline void squares(const R *H, R *l) {
    R E[6];
    int n = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        E[n++] = H[3 * i + j] + H[3 * j + i] + H[i] * H[j] + H[3 + i] * H[3 + j] + H[6 + i] * H[6 + j];
    R mean = (E[0] + E[3] + E[5]) / 3, a = E[0] - mean, b = E[3] - mean, c = E[5] - mean;
    R s = sqrt((a * a + b * b + c * c + 2 * (E[1] * E[1] + E[2] * E[2] + E[4] * E[4])) / 6);
    R cubic = a * (b * c - E[4] * E[4]) - E[1] * (E[1] * c - E[4] * E[2]) +
                   E[2] * (E[1] * E[4] - b * E[2]);
    R r = s > 1e-100 ? 0.5 * cubic / (s * s * s) : 0;
    R angle = acos(r < -1 ? -1 : r > 1 ? 1 : r) / 3;
    l[0] = mean + 2 * s * cos(angle);
    l[2] = mean + 2 * s * cos(angle + 2.0943951023931953);
    l[1] = 3 * mean - l[0] - l[2];
  }
  // (1 + H) <- (1 + M) (1 + H)
  CUDA_CALLABLE static inline void follow(const R *M, R *H) {
    R G[9];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        G[3 * i + j] = H[3 * i + j] + M[3 * i + j] + M[3 * i] * H[j] + M[3 * i + 1] * H[3 + j] +
                       M[3 * i + 2] * H[6 + j];
    for (int k = 0; k < 9; k++) H[k] = G[k];
  }
};
// Whether a law has a return map: its particles store more than F - 1.
CUDA_CALLABLE inline bool remembers(int law) {
#define MPM_REMEMBERS(NUMBER) || law == NUMBER
  return false MPM_PLASTIC(MPM_REMEMBERS);
#undef MPM_REMEMBERS
}
// Whether a law takes any shape: its particles' deformation is not stored.
CUDA_CALLABLE inline bool liquid(int law) {
#define MPM_POURS(NUMBER) || law == NUMBER
  return false MPM_LIQUID(MPM_POURS);
#undef MPM_POURS
}
// The numbers of a particle's material that its law reads: columns LAW to INDEX of the table.
template <class R> struct Material {
  R law, mu, lambda, yield, hard, cone, apex, drag, index;
};
// Result of a law at a trial strain.
template <class R> struct Response {
  R tau[6];            // Kirchhoff stress after the return map [Pa]: 00 01 02 11 12 22
  R wave;              // bound on rho c^2 at this strain [Pa]
  R j1;                // J - 1 of the trial strain
  R plastic;           // increment of the equivalent plastic strain
  R opened;            // volume correction of granular matter after the return map
  R work;              // plastic work per rest volume [J/m^3]
};
// A law: specialised below by its number.
template <int NUMBER, class R> struct Rule;
template <class R> struct Rule<COROTATED, R> {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  // tau = 2 mu V (V - 1) + lambda J (J - 1), V the left stretch; c its wave modulus.
  CUDA_CALLABLE static inline void stress(const Material<R> &t, const R *E, R j1, R *tau,
                                          R &c) {
    M turned = j1 < -1.0f;
    R J = 1.0f + j1, l = t.lambda * J * j1;
    if (S::any(turned)) {
      inverted(t, E, turned, tau);
    } else {
      R V1[6], V2[6];
      Function<R>::root(E, V1);
      Sym<R>::times(V1, V1, V2);
      for (int k = 0; k < 6; k++) tau[k] = 2.0f * t.mu * (V1[k] + V2[k]);
    }
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) tau[k] += l;
    R most = S::root(1.0f + Sym<R>::bound(E));
    J = S::high(J, S::all(1.0f));
    c = 2.0f * t.mu * most * (2.0f * most - 1.0f) + t.lambda * J * (2.0f * J - 1.0f);
  }
  // The same where det F < 0: the smallest stretch is negative there.
  MPM_RARE CUDA_CALLABLE static void inverted(const Material<R> &t, const R *E, M turned, R *tau) {
    R l[3], U[9], g[3];
    Math<R>::eigen(E, l, U);
    for (int i = 0; i < 3; i++) {
      l[i] = S::high(l[i], S::all(-0.9999f));
      g[i] = S::root(1.0f + l[i]);
    }
    R least = S::low(g[0], S::low(g[1], g[2]));
    for (int i = 0; i < 3; i++) {
      M flip = turned & (g[i] == least);
      R s = S::pick(flip, -g[i], g[i]);
      l[i] = 2.0f * t.mu * s * S::pick(flip, s - 1.0f, l[i] / (1.0f + g[i]));
    }
    Math<R>::compose(U, l, tau);
  }
  // Kirchhoff pressure of the mean volume J e^log_volume_ratio over its bulk modulus, and a bound on its slope.
  CUDA_CALLABLE static inline R mean_pressure(R j1, R log_volume_ratio, R &slope) {
    R m1 = j1 + (1.0f + j1) * Math<R>::expm1(log_volume_ratio), most = S::high(m1, S::all(0.0f));
    slope = (1.0f + most) * (1.0f + 2.0f * most);
    return (1.0f + m1) * m1;
  }
  // Its energy likewise: (J - 1)^2/2
  CUDA_CALLABLE static inline double mean_energy(double J, double log_volume_ratio) {
    const double m1 = J * exp(log_volume_ratio) - 1;
    return 0.5 * m1 * m1;
  }
  // mu |V - 1|^2 + lambda/2 (J - 1)^2
  CUDA_CALLABLE static inline double energy(double mu, double lambda, const double *H) {
    double l[3], sum = 0, J = Strain<double>::whole(H);
    Strain<double>::squares(H, l);
    for (int i = 0; i < 3; i++) {
      double square = 1 + l[i] > 1e-12 ? 1 + l[i] : 1e-12;
      double s = sqrt(square) * (i == 2 && J < 0 ? -1 : 1) - 1;
      sum += s * s;
    }
    return mu * sum + 0.5 * lambda * (J - 1) * (J - 1);
  }
};
// Energy of volume (ln J)^2/2 of a mean volume J e^log_volume_ratio, over its bulk modulus.
template <class R> struct Logarithmic {
  CUDA_CALLABLE static inline R mean_pressure(R j1, R log_volume_ratio, R &slope) {
    slope = Lanes<R>::all(1.0f);
    return Math<R>::log1p(j1) + log_volume_ratio;
  }
  CUDA_CALLABLE static inline double mean_energy(double J, double log_volume_ratio) {
    const double grown = log(J) + log_volume_ratio;
    return 0.5 * grown * grown;
  }
};
template <class R> struct Rule<NEO_HOOKEAN, R> : Logarithmic<R> {
  typedef Lanes<R> S;
  // tau = mu (b - 1) + lambda ln J; c its wave modulus.
  CUDA_CALLABLE static inline void stress(const Material<R> &t, const R *E, R j1, R *tau,
                                          R &c) {
    R l = t.lambda * Math<R>::log1p(S::high(j1, S::all(-0.999f)));
    for (int k = 0; k < 6; k++) tau[k] = t.mu * E[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) tau[k] += l;
    R bound = S::high(S::high(E[0] + S::size(E[1]) + S::size(E[2]),
                                     E[3] + S::size(E[1]) + S::size(E[4])),
                          E[5] + S::size(E[2]) + S::size(E[4]));
    c = t.lambda + 2.0f * t.mu * (1.0f + S::high(bound, S::all(0.0f)));
  }
  // mu/2 (|F|^2 - 3 - 2 ln J) + lambda/2 (ln J)^2
  CUDA_CALLABLE static inline double energy(double mu, double lambda, const double *H) {
    double sum = 0, log_j = log(Strain<double>::whole(H));
    for (int i = 0; i < 9; i++) sum += H[i] * H[i] + (i % 4 == 0 ? 2 * H[i] : 0);
    return 0.5 * mu * (sum - 2 * log_j) + 0.5 * lambda * log_j * log_j;
  }
};
// Laws with a return map have the stress and the energy of this one.
template <class R> struct Rule<HENCKY, R> : Logarithmic<R> {
  typedef Lanes<R> S;
  // tau = 2 mu e + lambda tr(e), in place of e = ln V. Its wave modulus is lambda + 2 mu throughout.
  CUDA_CALLABLE static inline void stress(const Material<R> &t, R *e) {
    R tr = t.lambda * (e[0] + e[3] + e[5]);
    for (int k = 0; k < 6; k++) e[k] = 2.0f * t.mu * e[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) e[k] += tr;
  }
  // mu |ln V|^2 + lambda/2 (tr ln V)^2
  CUDA_CALLABLE static inline double energy(double mu, double lambda, const double *H) {
    double l[3], sum = 0, trace = 0;
    Strain<double>::squares(H, l);
    for (int i = 0; i < 3; i++) {
      double s = 0.5 * log(1 + l[i] > 1e-12 ? 1 + l[i] : 1e-12);
      sum += s * s;
      trace += s;
    }
    return mu * sum + 0.5 * lambda * trace * trace;
  }
};
template <class R> struct Rule<DRUCKER_PRAGER, R> {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  // Return strain to the cone; gives the change, the slip, the volume correction, and the plastic
  // work per rest volume with the stress after the return.
  CUDA_CALLABLE static inline R flow(const Material<R> &t, R, R *e, R *moved, R &change, R &vc) {
    R zero = S::all(0.0f), h[6], tr = e[0] + e[3] + e[5] + vc, start = tr * (1.0f / 3.0f);
    R mean = start, n = Sym<R>::deviator(e, mean - vc * (1.0f / 3.0f), h), out = tr - t.apex;
    R slip = n + t.cone * (3.0f * t.lambda + 2.0f * t.mu) / (2.0f * t.mu) * out;
    slip = S::low(S::high(slip, zero), n);
    M apex = out > 0.0f;
    R scale = 1.0f - slip / S::high(n, S::all(1e-30f));
    scale = S::pick(apex, zero, scale);
    mean = S::pick(apex, t.apex * (1.0f / 3.0f), mean);
    R after = 3.0f * mean;
    // Beyond the apex only the change of volume is new slip.
    R opened = S::pick(apex, vc, zero), gone = start - mean - opened * (1.0f / 3.0f);
    R work = 2.0f * t.mu * (scale * (1.0f - scale) * n * n + after * gone) +
              3.0f * t.lambda * after * gone;
    R shift = mean - start + vc * (1.0f / 3.0f);
    for (int k = 0; k < 6; k++) moved[k] = (scale - 1.0f) * h[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) moved[k] += shift;
    for (int k = 0; k < 6; k++) e[k] = scale * h[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) e[k] += mean;
    out -= opened;
    change = S::pick(apex, S::root(n * n + out * out * (1.0f / 3.0f)), slip);
    vc = tr - after;
    return work;
  }
};
template <class R> struct Rule<VON_MISES, R> {
  typedef Lanes<R> S;
  // Return strain to the cylinder: the same.
  CUDA_CALLABLE static inline R flow(const Material<R> &t, R ep, R *e, R *moved, R &change, R &) {
    R h[6], n = Sym<R>::deviator(e, (e[0] + e[3] + e[5]) * (1.0f / 3.0f), h);
    R dg = (2.0f * t.mu * n - ROOT_2_3 * (t.yield + t.hard * ep)) /
            (2.0f * t.mu + (2.0f / 3.0f) * t.hard);
    dg = S::high(dg, S::all(0.0f));
    R less = dg / S::high(n, S::all(1e-30f));
    for (int k = 0; k < 6; k++) {
      moved[k] = -less * h[k];
      e[k] += moved[k];
    }
    change = dg;
    return 2.0f * t.mu * n * (1.0f - less) * dg;
  }
};
template <class R> struct Rule<FLUID, R> {
  typedef Lanes<R> S;
  // Shear of a step: mu D + drag D^index = excess. Newton's steps rise to it from below.
  CUDA_CALLABLE static inline R slip(const Material<R> &t, R excess) {
    R q = S::high(excess, S::all(0.0f)), plain = q / S::high(t.mu + t.drag, S::all(1e-30f));
    typename S::Mask bent = (t.index != 1.0f) & (q > 0.0f) & (t.drag > 0.0f);
    if (!S::any(bent)) return plain;
    R one = S::all(1.0f), mu = S::pick(bent, t.mu, one), drag = S::pick(bent, t.drag, one);
    R n = S::pick(bent, t.index, one);
    q = S::pick(bent, q, one);
    R D = S::low(q / (2.0f * mu), Math<R>::power(q / (2.0f * drag), 1.0f / n));
    D = S::high(D, S::all(1e-30f));
    for (int k = 0; k < 12; k++) {
      R power = drag * Math<R>::power(D, n);
      D = D - (mu * D + power - q) / (mu + n * power / D);
      D = S::high(D, S::all(1e-30f));
    }
    return S::pick(bent, D, plain);
  }
  // Return strain to the flow curve at its rate: the same.
  CUDA_CALLABLE static inline R flow(const Material<R> &t, R, R *e, R *moved, R &change, R &) {
    R h[6], n = Sym<R>::deviator(e, (e[0] + e[3] + e[5]) * (1.0f / 3.0f), h);
    R gone = 0.70710678f * slip(t, 1.41421356f * t.mu * n - 0.57735027f * t.yield);
    R less = gone / S::high(n, S::all(1e-30f));
    for (int k = 0; k < 6; k++) {
      moved[k] = -less * h[k];
      e[k] += moved[k];
    }
    change = gone;
    return 2.0f * t.mu * n * (1.0f - less) * gone;
  }
};
// Dispatch: nothing below depends on a law but Hencky's.
// The law of each lane, on E = b - 1, exact for small strains.
template <class R> struct Laws {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  CUDA_CALLABLE static inline M is(const Material<R> &t, Law law) { return t.law == (float)law; }
  // Lanes whose law has a return map: they also store EP, VC and TM.
  CUDA_CALLABLE static inline M flows(const Material<R> &t) {
#define MPM_FLOWS(NUMBER) | is(t, NUMBER)
    return S::bits(S::all(0.0f)) MPM_PLASTIC(MPM_FLOWS);
#undef MPM_FLOWS
  }
  // Lanes whose law takes any shape.
  CUDA_CALLABLE static inline M pours(const Material<R> &t) {
#define MPM_POURS(NUMBER) | is(t, NUMBER)
    return S::bits(S::all(0.0f)) MPM_LIQUID(MPM_POURS);
#undef MPM_POURS
  }
  CUDA_CALLABLE static inline void take(M where, const R *from, R *to) {
    for (int k = 0; k < 6; k++) to[k] = S::pick(where, from[k], to[k]);
  }
  // Stress at the trial strain H of each lane's law, after its return map, which changes H.
  // plastic: equivalent plastic strain so far; opened: volume correction so far.
  CUDA_CALLABLE static inline void respond(const Material<R> &t, R plastic, R opened, R *H,
                                           Response<R> &a) {
    R E[6];
    Strain<R>::left(H, E);
    a.j1 = Strain<R>::volume(H);
    a.wave = t.lambda + 2.0f * t.mu;
    a.plastic = a.work = S::all(0.0f);
    a.opened = opened;
    for (int k = 0; k < 6; k++) a.tau[k] = S::all(0.0f);
    const M flowing = flows(t), logarithmic = is(t, HENCKY) | flowing;
#define MPM_STRESS(NUMBER) stressed<NUMBER>(t, E, a);
    MPM_ELASTIC(MPM_STRESS)
#undef MPM_STRESS
    if (S::any(logarithmic)) {
      R e[6];
      Function<R>::half_log(E, e);
      if (S::any(flowing)) flow(t, plastic, e, H, a);
      Rule<HENCKY, R>::stress(t, e);
      take(logarithmic, e, a.tau);
    }
  }
  template <Law NUMBER>
  CUDA_CALLABLE static inline void stressed(const Material<R> &t, const R *E, Response<R> &a) {
    const M mine = is(t, NUMBER);
    if (!S::any(mine)) return;
    R tau[6], c;
    Rule<NUMBER, R>::stress(t, E, a.j1, tau, c);
    take(mine, tau, a.tau);
    a.wave = S::pick(mine, c, a.wave);
  }
  // Return maps: strain e and F = 1 + H after plastic flow.
  CUDA_CALLABLE static inline void flow(const Material<R> &t, R plastic, R *e, R *H,
                                        Response<R> &a) {
    R moved[6], X[6];
    for (int k = 0; k < 6; k++) moved[k] = S::all(0.0f);
#define MPM_FLOW(NUMBER) returned<NUMBER>(t, plastic, e, moved, a);
    MPM_PLASTIC(MPM_FLOW)
#undef MPM_FLOW
    if (S::any(Sym<R>::bound(moved) > 0.0f)) {
      Function<R>::expm1(moved, X);
      R M9[9] = {X[0], X[1], X[2], X[1], X[3], X[4], X[2], X[4], X[5]};
      Strain<R>::follow(M9, H);
    }
  }
  template <Law NUMBER>
  CUDA_CALLABLE static inline void returned(const Material<R> &t, R plastic, R *e, R *moved,
                                            Response<R> &a) {
    const M mine = is(t, NUMBER);
    if (!S::any(mine)) return;
    R s[6], m[6], d, v = a.opened;
    for (int k = 0; k < 6; k++) s[k] = e[k];
    R w = Rule<NUMBER, R>::flow(t, plastic, s, m, d, v);
    take(mine, s, e);
    take(mine, m, moved);
    a.plastic = S::pick(mine, ROOT_2_3 * d, a.plastic);
    a.work = S::pick(mine, w, a.work);
    a.opened = S::pick(mine, v, a.opened);
  }
  // The part of lambda that acts on the mean dilatation of nearly incompressible matter [Pa].
  CUDA_CALLABLE static inline R mean_bulk(const Material<R> &t) {
    return S::high(t.lambda - (float)LOCAL_BULK_RATIO * t.mu, S::all(0.0f));
  }
  // Kirchhoff pressure of that part at the volume J e^log_volume_ratio [Pa]; adds its bound on rho c^2 to wave.
  CUDA_CALLABLE static inline R mean_pressure(const Material<R> &t, R bulk, R j1, R log_volume_ratio, R &wave) {
    R p = S::all(0.0f), slope = p;
    j1 = S::high(j1, S::all((float)MIN_VOLUME_RATIO - 1.0f));
#define MPM_MEAN(NUMBER) averaged<NUMBER>(t, j1, log_volume_ratio, p, slope);
    MPM_BULKY(MPM_MEAN)
#undef MPM_MEAN
    wave += bulk * slope;
    return bulk * p;
  }
  template <Law NUMBER>
  CUDA_CALLABLE static inline void averaged(const Material<R> &t, R j1, R log_volume_ratio, R &p, R &slope) {
    const M mine = is(t, NUMBER);
    if (!S::any(mine)) return;
    R c, own = Rule<NUMBER, R>::mean_pressure(j1, log_volume_ratio, c);
    p = S::pick(mine, own, p);
    slope = S::pick(mine, c, slope);
  }
};
// Stored energy per rest volume [J/m^3], in double precision.
CUDA_CALLABLE inline double stored_energy(int law, double mu, double lambda, const double *H) {
#define MPM_ENERGY(NUMBER) \
  if (law == NUMBER) return Rule<NUMBER, float>::energy(mu, lambda, H);
  MPM_ELASTIC(MPM_ENERGY)
#undef MPM_ENERGY
  if (law == HENCKY || remembers(law)) return Rule<HENCKY, float>::energy(mu, lambda, H);
  return NAN;
}
// The same of a mean volume J e^log_volume_ratio on which the part bulk of lambda acts.
CUDA_CALLABLE inline double mean_energy(int law, double bulk, const double *H, double log_volume_ratio) {
  const double J = Strain<double>::whole(H);
#define MPM_MEAN(NUMBER) \
  if (law == NUMBER) return bulk * Rule<NUMBER, float>::mean_energy(J, log_volume_ratio);
  MPM_BULKY(MPM_MEAN)
#undef MPM_MEAN
  return NAN;
}
}  // namespace
}  // namespace mpm
