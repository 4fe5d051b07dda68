// Maxwell branches: strain that relaxes. Twin of physics/maxwell_branches.py.
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
// Symmetric tensors: 00 01 02 11 12 22.
template <class R> struct Branch {
  // dt grad v less a third of its trace; returns the trace.
  CUDA_CALLABLE static inline R deviator(const R *L, R *A) {
    R trace = L[0] + L[4] + L[8];
    for (int k = 0; k < 9; k++) A[k] = L[k];
    for (int k = 0; k < 9; k += 4) A[k] -= trace * (1.0f / 3.0f);
    return trace;
  }
  // Shares q of old and r of new strain that a step leaves: e^-dt/T, (1 - e^-dt/T) T/dt.
  CUDA_CALLABLE static inline void kept(double dt, double time, float &q, float &r) {
    double left = exp(-dt / time);
    q = (float)left;
    r = (float)((1.0 - left) * time / dt);
  }
  // E = q (E + A E + E At + A E At) + r (A + At + A At).
  CUDA_CALLABLE static inline void follow(const R *A, R q, R r, R *E) {
    const R S[9] = {E[0], E[1], E[2], E[1], E[3], E[4], E[2], E[4], E[5]};
    R X[9];  // A E
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        X[3 * i + j] = A[3 * i] * S[j] + A[3 * i + 1] * S[3 + j] + A[3 * i + 2] * S[6 + j];
    int k = 0;
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++, k++) {
        const R *a = A + 3 * i, *b = A + 3 * j, *x = X + 3 * i;
        R carried = E[k] + X[3 * i + j] + X[3 * j + i] + (x[0] * b[0] + x[1] * b[1] + x[2] * b[2]);
        R fresh = a[j] + b[i] + (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        E[k] = q * carried + r * fresh;
      }
  }
  // Adds G dev E + K theta to a stress.
  CUDA_CALLABLE static inline void press(R G, R K, const R *E, R theta, R *tau) {
    R p = K * theta - G * (E[0] + E[3] + E[5]) * (1.0f / 3.0f);
    for (int k = 0; k < 6; k++) tau[k] += G * E[k];
    tau[0] += p;
    tau[3] += p;
    tau[5] += p;
  }
};
// G/2 (tr E - ln det(1 + E)) + K/2 theta^2 [J/m^3].
CUDA_CALLABLE inline double branch_energy(double G, double K, const double *E, double theta) {
  double first = E[0] + E[3] + E[5];
  double second = E[0] * E[3] + E[0] * E[5] + E[3] * E[5] - E[1] * E[1] - E[2] * E[2] - E[4] * E[4];
  double third = E[0] * (E[3] * E[5] - E[4] * E[4]) - E[1] * (E[1] * E[5] - E[4] * E[2]) +
                 E[2] * (E[1] * E[4] - E[3] * E[2]);
  // ln(1 + x) with all its digits where x is small (Kahan).
  double x = first + second + third, u = 1.0 + x, whole = u == 1.0 ? x : log(u) * x / (u - 1.0);
  return 0.5 * G * (first - whole) + 0.5 * K * theta * theta;
}
}  // namespace
}  // namespace mpm
