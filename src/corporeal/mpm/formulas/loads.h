// Loads: wind on faces, grips, gravity that fades in. Twins of physics/wind_pressure.py and spring_grips.py.
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
// R: double or float.
template <class R> struct Air {
  // Area vector after a deformation, cof(F) N (Nanson's formula).
  CUDA_CALLABLE static inline void turned(const R *F, const R *N, R *a) {
    for (int i = 0; i < 3; i++) {
      const R *p = F + 3 * ((i + 1) % 3), *q = F + 3 * ((i + 2) % 3);
      a[i] = (p[1] * q[2] - p[2] * q[1]) * N[0] + (p[2] * q[0] - p[0] * q[2]) * N[1] +
             (p[0] * q[1] - p[1] * q[0]) * N[2];
    }
  }
  // Adds the air's impulse on a face [N s]; no face becomes faster than the air.
  CUDA_CALLABLE static inline void press(R half_rho_c, const R *a, const R *seen, R mass, R dt, R *J) {
    R size = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    R along = a[0] * seen[0] + a[1] * seen[1] + a[2] * seen[2];
    if (size < R(TINY) || along >= 0) return;
    R against = -along / size;
    R speed = sqrt(seen[0] * seen[0] + seen[1] * seen[1] + seen[2] * seen[2]);
    R force = half_rho_c * size * against * against * against / speed;
    R given = force * dt / (R(1.0) + force * dt / (mass * against));
    for (int i = 0; i < 3; i++) J[i] -= given * a[i] / size;
  }
};
struct Grips {
  // Impulse of a grip's spring in a step [N s]; k and c at most what the step can follow.
  CUDA_CALLABLE static inline void pull(double stiffness, double damping, double mass, const double *away,
                                        const double *v, double dt, double *J) {
    double k = GRIP_STIFFNESS * mass / (dt * dt), c = GRIP_DAMPING * mass / dt;
    if (stiffness < k) k = stiffness;
    if (damping < c) c = damping;
    for (int d = 0; d < 3; d++) J[d] = dt * (k * away[d] - c * v[d]);
  }
};
struct Clocks {
  // Integral of gravity's share from 0 to a time [s].
  CUDA_CALLABLE static inline double ramped(double time, double ramp) {
    return time < ramp ? 0.5 * time * time / ramp : time - 0.5 * ramp;
  }
};
}  // namespace
}  // namespace mpm
