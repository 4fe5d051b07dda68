// Rigid bodies, in double precision at either width. Twins of physics/rigid.py and springs.py.
// Matrices row by row.
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
struct Vec {
  CUDA_CALLABLE static inline double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  CUDA_CALLABLE static inline void cross(const double *a, const double *b, double *c) {
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
    c[0] = x;
    c[1] = y;
  }
  // c = A b
  CUDA_CALLABLE static inline void apply(const double *A, const double *b, double *c) {
    double x = dot(A, b), y = dot(A + 3, b), z = dot(A + 6, b);
    c[0] = x;
    c[1] = y;
    c[2] = z;
  }
  // a/|a|; zero stays zero. Returns |a|.
  CUDA_CALLABLE static inline double unit(double *a) {
    double l = sqrt(dot(a, a));
    for (int i = 0; i < 3; i++) a[i] = l > TINY ? a[i] / l : 0.0;
    return l;
  }
  CUDA_CALLABLE static inline void times(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
  }
  // C = A Bt
  CUDA_CALLABLE static inline void times_transposed(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) C[3 * i + j] = dot(A + 3 * i, B + 3 * j);
  }
};
struct Body {
  // Q = exp([w dt]x) R (Rodrigues' formula).
  CUDA_CALLABLE static inline void turn(const double *R, const double *w, double dt, double *Q) {
    double a[3] = {w[0] * dt, w[1] * dt, w[2] * dt}, t = sqrt(Vec::dot(a, a));
    double K[9] = {0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0}, K2[9], E[9];
    Vec::times(K, K, K2);
    double f = t < SMALL_ROTATION_RAD ? 1.0 - t * t / 6.0 : sin(t) / t;
    double g = t < SMALL_ROTATION_RAD ? 0.5 - t * t / 24.0 : (1.0 - cos(t)) / (t * t);
    for (int i = 0; i < 9; i++) E[i] = f * K[i] + g * K2[i] + (i % 4 == 0);
    Vec::times(E, R, Q);
  }
  // I^-1 = R I0^-1 Rt [1/(kg m^2)].
  MPM_INLINE CUDA_CALLABLE static void inverse_inertia(const double *R, const double *rest, double *out) {
    double A[9], B[9];
    Vec::times(R, rest, A);
    Vec::times_transposed(A, R, B);
    for (int i = 0; i < 9; i++) out[i] = B[i];
  }
  // Orthonormal rows again (Gram and Schmidt), as one step leaves a rotation.
  CUDA_CALLABLE static inline void straighten(double *Q) {
    Vec::unit(Q);
    double d = Vec::dot(Q, Q + 3);
    for (int i = 0; i < 3; i++) Q[3 + i] -= d * Q[i];
    Vec::unit(Q + 3);
    Vec::cross(Q, Q + 3, Q + 6);
  }
  // Free turn of dt with constant angular momentum L, in the w of mid-step.
  CUDA_CALLABLE static inline void advance(const double *R, const double *rest, const double *L,
                                           const double *w, double dt, double *Q) {
    double half[9], inertia[9], middle[3];
    turn(R, w, 0.5 * dt, half);
    inverse_inertia(half, rest, inertia);
    Vec::apply(inertia, L, middle);
    turn(R, middle, dt, Q);
    straighten(Q);
  }
  // V + w x r [m/s].
  CUDA_CALLABLE static inline void velocity(const double *speed, const double *spin, const double *r,
                                            double *v) {
    Vec::cross(spin, r, v);
    for (int i = 0; i < 3; i++) v[i] += speed[i];
  }
  // Rotation vector of a turn by less than half a revolution: axis, times what is returned.
  CUDA_CALLABLE static inline double turned(const double *Q, double *axis) {
    axis[0] = 0.5 * (Q[7] - Q[5]);
    axis[1] = 0.5 * (Q[2] - Q[6]);
    axis[2] = 0.5 * (Q[3] - Q[1]);
    double sine = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    return sine > MIN_ROTATION_SINE ? atan2(sine, 0.5 * (Q[0] + Q[4] + Q[8] - 1.0)) / sine : 1.0;
  }
};
// Prescribed motion: twin of physics/prescribed_motion.py. A path has KEY_ROW columns a row.
struct Path {
  CUDA_CALLABLE static inline void cubics(const double *c, double t, double *x) {
    for (int i = 0; i < 3; i++, c += 4) x[i] = c[0] + t * (c[1] + t * (c[2] + t * c[3]));
  }
  // Place [m] and rotation at a time [s]; at rest before the first row and after the last.
  CUDA_CALLABLE static inline void pose(const double *path, int rows, double time, double *x, double *R) {
    int low = 0, high = rows - 1;
    while (low < high) {
      int middle = (low + high + 1) / 2;
      if (path[KEY_ROW * middle + KEY_START] <= time)
        low = middle;
      else
        high = middle - 1;
    }
    const double *row = path + KEY_ROW * low;
    double t = time - row[KEY_START], turn[3];
    t = t < 0 ? 0 : t > row[KEY_SPAN] ? row[KEY_SPAN] : t;
    cubics(row + KEY_PLACE, t, x);
    cubics(row + KEY_TURN, t, turn);
    Body::turn(row + KEY_FRAME, turn, 1.0, R);
  }
  // Velocity V, spin w and rotation Q that put a body, its centre now at x and turned by R, at the end
  // of a step on the path; arm: of its centre at the start from the path's first place.
  CUDA_CALLABLE static inline void follow(const double *path, int rows, const double *arm, double end,
                                          double dt, const double *x, const double *R, double *V,
                                          double *w, double *Q) {
    double place[3], r[3], turn[9];
    pose(path, rows, end, place, Q);
    Vec::apply(Q, arm, r);
    for (int i = 0; i < 3; i++) V[i] = (place[i] + r[i] - x[i]) / dt;
    Vec::times_transposed(Q, R, turn);
    double angle = Body::turned(turn, w);
    for (int i = 0; i < 3; i++) w[i] *= angle / dt;
  }
};
}  // namespace
}  // namespace mpm
