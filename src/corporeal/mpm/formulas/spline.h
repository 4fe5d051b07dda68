// Quadratic B-splines of the three nodes around a place, f cells from the first: f in [.5, 1.5).
#pragma once
#include "lanes.h"
namespace mpm {
namespace {
template <class R> struct Spline {
  CUDA_CALLABLE static inline void weights(R f, R *n) {
    R a = 1.5f - f, b = f - 1.0f, c = f - 0.5f;
    n[0] = 0.5f * a * a;
    n[1] = 0.75f - b * b;
    n[2] = 0.5f * c * c;
  }
  // Their derivatives [1/dx].
  CUDA_CALLABLE static inline void slopes(R f, R *g) {
    g[0] = f - 1.5f;
    g[1] = 2.0f - 2.0f * f;
    g[2] = f - 0.5f;
  }
};
}  // namespace
}  // namespace mpm
