// Thin shells: dihedral angles, membranes in plane stress, moments, forces of corners. Twin of mpm/shells.
// Symmetric tensors in a triangle's plane: 11 22 12.
#pragma once
#include "laws.h"
namespace mpm {
namespace {
template <class R> struct Flat {
  // (1 - nu) e + nu tr e 1: over E/(1 - nu^2) the stress, over D the moments.
  CUDA_CALLABLE static inline void plane_stress(R nu, const R *e, R *s) {
    R trace = nu * (e[0] + e[1]), keep = 1.0f - nu;
    s[0] = keep * e[0] + trace;
    s[1] = keep * e[1] + trace;
    s[2] = keep * e[2];
  }
  CUDA_CALLABLE static inline R contract(const R *a, const R *b) {
    return a[0] * b[0] + a[1] * b[1] + 2.0f * (a[2] * b[2]);
  }
  CUDA_CALLABLE static inline R dot(const R *a, const R *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  CUDA_CALLABLE static inline void cross(const R *a, const R *b, R *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
  }
  // Angle by which a surface turns at a hinge, from its edge and both opposite vertices, seen from the edge's start:
  // (q x e) x (e x p) = e ((q x e) . p).
  CUDA_CALLABLE static inline R dihedral_angle(const R *e, const R *p, const R *q) {
    R first[3], second[3];
    cross(e, p, first);
    cross(q, e, second);
    return Math<R>::angle(Lanes<R>::root(dot(e, e)) * dot(second, p), dot(first, second));
  }
  // F = Ds B, of the edges from the first corner: its columns.
  CUDA_CALLABLE static inline void deformation(const R *u, const R *v, const R *B, R *f, R *g) {
    for (int d = 0; d < 3; d++) {
      f[d] = u[d] * B[0] + v[d] * B[2];
      g[d] = u[d] * B[1] + v[d] * B[3];
    }
  }
  // C - 1
  CUDA_CALLABLE static inline void metric(const R *f, const R *g, R *C) {
    C[0] = dot(f, f) - 1.0f;
    C[1] = dot(g, g) - 1.0f;
    C[2] = dot(f, g);
  }
  // Adds -F S Bt: of the second and the third corner, per volume.
  CUDA_CALLABLE static inline void pull(const R *f, const R *g, const R *S, const R *B, R *second, R *third) {
    for (int d = 0; d < 3; d++) {
      R a = f[d] * S[0] + g[d] * S[2], b = f[d] * S[2] + g[d] * S[1];
      second[d] -= a * B[0] + b * B[1];
      third[d] -= a * B[2] + b * B[3];
    }
  }
  // Forces of the moments at a triangle's sides, over its normal u x v: a weight for each corner. A side is called
  // like the corner opposite to it.
  CUDA_CALLABLE static inline void bending_weights(const R *u, const R *v, const R *normal, const R *moment, R *weight) {
    R uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ww = uu + vv - 2.0f * uv;
    R per = -1.0f / Lanes<R>::high(dot(normal, normal), Lanes<R>::all((float)TINY));
    R m0 = per * Lanes<R>::root(ww) * moment[0], m1 = per * Lanes<R>::root(vv) * moment[1];
    R m2 = per * Lanes<R>::root(uu) * moment[2];
    R foot0 = (uu - uv) / ww, foot1 = (vv - uv) / vv, foot2 = uv / uu;   // of corners, along their sides
    weight[0] = m0 - foot1 * m1 - (1.0f - foot2) * m2;
    weight[1] = m1 - foot2 * m2 - (1.0f - foot0) * m0;
    weight[2] = m2 - foot0 * m0 - (1.0f - foot1) * m1;
  }
};
template <class R> struct ShellMaterial {
  R law, mu, lambda, poisson;
  R yield_stress, hardening;   // yield stress and the moment of a plastic hinge: vast where nothing yields
  R stiffness, bending, hinge_moment;   // E/(1 - nu^2) [Pa], D [N m], sigma_y t^2/4 [N]
};
template <class R> struct Membrane {
  typedef Lanes<R> S;
  typedef typename S::Mask M;
  R c[2], e[2], cosine, sine;   // principal values of C - 1, their logarithmic strains, twice the direction

  CUDA_CALLABLE inline void principal(const R *C) {
    R mean = 0.5f * (C[0] + C[1]), half = 0.5f * (C[0] - C[1]);
    R radius = S::root(half * half + C[2] * C[2]), safe = S::high(radius, S::all((float)TINY));
    c[0] = mean + radius;
    c[1] = S::high(mean - radius, S::all((float)MIN_SQUARED_STRETCH - 1.0f));
    cosine = half / safe;
    sine = C[2] / safe;
    for (int i = 0; i < 2; i++) e[i] = 0.5f * Math<R>::log1p(c[i]);
  }
  CUDA_CALLABLE inline void tensor(R first, R second, R *out) const {
    R mean = 0.5f * (first + second), half = 0.5f * (first - second);
    out[0] = mean + half * cosine;
    out[1] = mean - half * cosine;
    out[2] = half * sine;
  }
  // Stretch across a neo-Hookean wall, squared and less 1; thin: -lambda/(lambda + 2 mu).
  CUDA_CALLABLE static inline R stretch_across(const ShellMaterial<R> &t, M wanted, R log_area, R thin) {
    R y = thin * log_area, across = S::all(0.0f), change = across;
    y = y - (1.0f + thin) * y * y;   // to second order
    for (int i = 0; i < NEO_HOOKEAN_ITERATIONS; i++) {
      across = Math<R>::expm1(2.0f * y);
      change = (t.mu * across + t.lambda * (log_area + y)) / (2.0f * t.mu * (1.0f + across) + t.lambda);
      y = y - change;
      if (!S::any(wanted & (S::size(change) > (float)NEO_HOOKEAN_ROUNDING))) break;
    }
    return across - 2.0f * change * (1.0f - change) * (1.0f + across);   // of y as it is now
  }
  // Second Piola-Kirchhoff stress without principal values: where all lanes are neo-Hookean, S = mu (1 - l3^2 C^-1), or
  // all are Hencky's, strained little (ln C/2 by the series of ``Function``), and none yields; else false.
  CUDA_CALLABLE static inline bool direct_stress(const ShellMaterial<R> &t, const R *C, R plastic, R *out) {
    const R det = C[0] + C[1] + C[0] * C[1] - C[2] * C[2];
    const R per = 1.0f / S::high(1.0f + det, S::all((float)MIN_SQUARED_STRETCH)), thin = -t.lambda / (t.lambda + 2.0f * t.mu);
    const M neo = t.law == (float)NEO_HOOKEAN, corotated = t.law == (float)COROTATED;
    if (!S::any(t.law != (float)NEO_HOOKEAN)) {
      const R log_area = 0.5f * Math<R>::log1p(S::high(det, S::all((float)MIN_SQUARED_STRETCH - 1.0f)));
      const R across = stretch_across(t, neo, log_area, thin);
      out[0] = t.mu * per * (det - C[1] - across * (1.0f + C[1]));
      out[1] = t.mu * per * (det - C[0] - across * (1.0f + C[0]));
      out[2] = t.mu * per * (1.0f + across) * C[2];
      return true;
    }
    const R shear = S::size(C[2]), most = S::high(S::size(C[0]), S::size(C[1])) + shear;
    if (S::any(neo | corotated | (most > 0.125f))) return false;
    const R half = 1.0f / (4.0f + 2.0f * (C[0] + C[1]) + C[0] * C[1] - C[2] * C[2]);
    const R Z[3] = {(2.0f * C[0] + C[0] * C[1] - C[2] * C[2]) * half, (2.0f * C[1] + C[0] * C[1] - C[2] * C[2]) * half,
                    2.0f * C[2] * half};
    const float third = 1.0f / 3.0f, fifth = 1.0f / 5.0f;
    const R W[3] = {Z[0] * Z[0] + Z[2] * Z[2], Z[1] * Z[1] + Z[2] * Z[2], Z[2] * (Z[0] + Z[1])};
    const R V[3] = {third * W[0] + fifth * (W[0] * W[0] + W[2] * W[2]), third * W[1] + fifth * (W[1] * W[1] + W[2] * W[2]),
                    third * W[2] + fifth * W[2] * (W[0] + W[1])};
    const R E[3] = {Z[0] + Z[0] * V[0] + Z[2] * V[2], Z[1] + Z[1] * V[1] + Z[2] * V[2], Z[2] + Z[0] * V[2] + Z[2] * V[1]};
    const R trace = E[0] + E[1], apart = E[0] - E[1], b = 2.0f * t.mu, y = thin * trace;
    const R p = t.stiffness * (1.0f + t.poisson) * trace, start = t.yield_stress + t.hardening * plastic;
    if (S::any(0.25f * (p * p + 3.0f * b * b * (apart * apart + 4.0f * E[2] * E[2])) > start * start)) return false;
    const R tau[3] = {b * (E[0] - y), b * (E[1] - y), b * E[2]};
    out[0] = per * ((1.0f + C[1]) * tau[0] - C[2] * tau[2]);
    out[1] = per * ((1.0f + C[0]) * tau[1] - C[2] * tau[2]);
    out[2] = per * ((1.0f + C[1]) * tau[2] - C[2] * tau[1]);
    return true;
  }
  // Strain to the yield surface, if any lane is beyond it (Simo and Hughes 1998, box 3.4); gives by which symmetric
  // tensor B is multiplied, the plastic strain and the plastic work per volume.
  CUDA_CALLABLE inline bool flow(const ShellMaterial<R> &t, R plastic, R *factor, R &grown, R &work) {
    R a = t.stiffness * (1.0f + t.poisson) / 3.0f, b = 2.0f * t.mu, H = t.hardening * (2.0f / 3.0f);
    R p0 = 3.0f * a * (e[0] + e[1]), q0 = b * (e[0] - e[1]), p = p0, q = q0;
    R start = t.yield_stress + t.hardening * plastic, gamma = S::all(0.0f);
    M yields = 0.5f * S::root(p * p + 3.0f * q * q) > start;
    if (!S::any(yields)) return false;
    for (int i = 0; i < RETURN_MAP_ITERATIONS; i++) {
      R u = 1.0f + a * gamma, w = 1.0f + b * gamma;
      R p2 = (p0 / u) * (p0 / u), q2 = 3.0f * (q0 / w) * (q0 / w), phi = 0.5f * S::root(p2 + q2);
      R slope = -0.25f * (p2 * a / u + q2 * b / w) / phi;
      R change = (phi - start - H * gamma * phi) / (slope - H * (phi + gamma * slope));
      gamma = S::pick(yields, S::high(gamma - change, S::all(0.0f)), S::all(0.0f));
      if (!S::any(yields & (S::size(change) > (float)RETURN_MAP_ROUNDING * gamma))) break;
    }
    p = p0 / (1.0f + a * gamma);
    q = q0 / (1.0f + b * gamma);
    R step[2] = {gamma * (p / 6.0f + q * 0.5f), gamma * (p / 6.0f - q * 0.5f)};
    tensor(Math<R>::exp(-step[0]), Math<R>::exp(-step[1]), factor);
    grown = gamma * S::root(p * p + 3.0f * q * q) / 3.0f;
    work = 0.5f * ((p + q) * step[0] + (p - q) * step[1]);
    for (int i = 0; i < 2; i++) {
      e[i] -= step[i];
      c[i] = S::pick(yields, Math<R>::expm1(2.0f * e[i]), c[i]);
    }
    return true;
  }
  // Second Piola-Kirchhoff stress.
  CUDA_CALLABLE inline void stress(const ShellMaterial<R> &t, R *out) const {
    R log_area = e[0] + e[1], thin = -t.lambda / (t.lambda + 2.0f * t.mu), y = thin * log_area;
    R tau[2] = {2.0f * t.mu * (e[0] - y), 2.0f * t.mu * (e[1] - y)};
    M neo = t.law == (float)NEO_HOOKEAN, corotated = t.law == (float)COROTATED;
    if (S::any(neo)) {
      const R across = stretch_across(t, neo, log_area, thin);
      for (int i = 0; i < 2; i++) tau[i] = S::pick(neo, t.mu * (c[i] - across), tau[i]);
    }
    if (S::any(corotated)) {
      R s[2] = {S::root(1.0f + c[0]), S::root(1.0f + c[1])}, more[2], area = s[0] * s[1];
      for (int i = 0; i < 2; i++) more[i] = c[i] / (1.0f + s[i]);
      R wider = more[0] + more[1] + more[0] * more[1];
      R thicker = -t.lambda * area * wider / (2.0f * t.mu + t.lambda * area * area);
      for (int i = 0; i < 2; i++)
        tau[i] = S::pick(corotated, 2.0f * t.mu * (s[i] * more[i] - (1.0f + thicker) * thicker), tau[i]);
    }
    tensor(tau[0] / (1.0f + c[0]), tau[1] / (1.0f + c[1]), out);
  }
  // Square of the equivalent moment.
  CUDA_CALLABLE static inline R squared_moment(const R *moment) {
    return moment[0] * moment[0] - moment[0] * moment[1] + moment[1] * moment[1] + 3.0f * moment[2] * moment[2];
  }
  // Factor by which it is brought back to that of the plastic hinge.
  CUDA_CALLABLE static inline R moment_return(const ShellMaterial<R> &t, R square) {
    return S::pick(square > t.hinge_moment * t.hinge_moment, t.hinge_moment / S::root(square), S::all(1.0f));
  }
};
}  // namespace
}  // namespace mpm
