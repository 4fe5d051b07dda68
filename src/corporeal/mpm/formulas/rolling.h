// Rolling friction of one contact, in double precision at either width. Twin of reference/rolling_contacts.py.
#pragma once
#include "rigid.h"
namespace mpm {
namespace {
// One side of a contact of rigid bodies; a plane has neither inverse mass nor inverse inertia.
struct RollingSide {
  double light, inertia[9], arm[3];   // 1/M [1/kg], I^-1 [1/(kg m^2)], contact less centre [m]
};
struct Rolling {
  // How far an impulse along d moves the place of contact of both sides together [1/kg].
  CUDA_CALLABLE static inline double softness(const RollingSide &a, const RollingSide &c, const double *d) {
    double lever[3], turned[3], soft = a.light + c.light;
    Vec::cross(a.arm, d, lever);
    Vec::apply(a.inertia, lever, turned);
    soft += Vec::dot(lever, turned);
    Vec::cross(c.arm, d, lever);
    Vec::apply(c.inertia, lever, turned);
    return soft + Vec::dot(lever, turned);
  }
  // Angular impulse M [N m s], -M on a and +M on c, against the part across n of a relative spin
  // w = w_a - w_c, at most `most`; and the impulse f [N s], -f on a and +f on c, by which friction
  // keeps the place of contact from slipping meanwhile: none where it slips already. J is what the
  // contact transmits. Returns the energy that is taken [J].
  CUDA_CALLABLE static inline double brake(const RollingSide &a, const RollingSide &c, const double *w,
                                           const double *n, const double *J, double mu, double most,
                                           double *M, double *f) {
    const double along = Vec::dot(w, n), jn = Vec::dot(J, n);
    double e[3], ia[3], ic[3], B[3], D[3], t[3];
    for (int i = 0; i < 3; i++) e[i] = w[i] - along * n[i], M[i] = f[i] = 0;
    const double spin = Vec::unit(e);
    Vec::apply(a.inertia, e, ia);
    Vec::apply(c.inertia, e, ic);
    const double alone = Vec::dot(e, ia) + Vec::dot(e, ic);
    if (spin <= MIN_SLIP_SPEED || most <= 0 || alone <= 0) return 0;
    double given = spin / alone < most ? spin / alone : most, soft = alone;
    Vec::cross(ia, a.arm, B);
    Vec::cross(ic, c.arm, D);
    for (int i = 0; i < 3; i++) B[i] += D[i];
    const double out = Vec::dot(B, n);
    for (int i = 0; i < 3; i++) D[i] = B[i] - out * n[i];
    const double slips = Vec::unit(D), stiff = softness(a, c, D);
    if (slips > 0) {
      const double together = alone - slips * slips / stiff;
      const double held = together > 0 && spin / together < most ? spin / together : most;
      for (int i = 0; i < 3; i++) {
        f[i] = -held * slips / stiff * D[i];
        t[i] = J[i] - jn * n[i] + f[i];
      }
      if (Vec::dot(t, t) <= mu * mu * jn * jn)
        given = held, soft = together;
      else
        f[0] = f[1] = f[2] = 0;
    }
    for (int i = 0; i < 3; i++) M[i] = given * e[i];
    return given * (spin - 0.5 * soft * given);
  }
};
}  // namespace
}  // namespace mpm
