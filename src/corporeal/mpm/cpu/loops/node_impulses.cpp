// Impulses from single particles to the nodes around them, between the scatter and the forces.
struct Hand {
  // Hand an impulse to the nodes around a particle; the work that it does on them, if asked for.
  static inline double over(const World *w, const Field &field, const float *q, int lane,
                            const double *J, bool counted = true) {
    int base[3];
    float W[3][3];
    for (int d = 0; d < 3; d++) {
      int x = ((const int *)(q + 8 * (XI + d)))[lane];
      base[d] = (x - HALF_CELL_UNITS) >> PLACE;
      float f = (float)(x - (base[d] << PLACE)) / CELL_UNITS;
      mpm::Spline<float>::weights(f, W[d]);
    }
    double work = 0, force[3], inverse = 1.0 / w->dt;
    for (int d = 0; d < 3; d++) force[d] = J[d] * inverse;
    for (int i = 0; i < 3; i++) {
      int x = base[0] + i, ix = (x >> 2) * field.dim[1], hx = (x & 3) * 16;
      for (int j = 0; j < 3; j++) {
        int y = base[1] + j, iy = (ix + (y >> 2)) * field.dim[2], hy = hx + (y & 3) * 4;
        double across = W[0][i] * W[1][j];
        for (int k = 0; k < 3; k++) {
          int z = base[2] + k;
          float *node = field.node + 8 * ((size_t)field.table[iy + (z >> 2)] * 64 + hy + (z & 3));
          double weight = across * W[2][k];
          if (counted) work += weight * done(w, node, weight, J);
          for (int d = 0; d < 3; d++) node[4 + d] += (float)(weight * force[d]);
        }
      }
    }
    return work;
  }
  // Work of an impulse on one node, of which it gets this share.
  static inline double done(const World *w, const float *node, double share, const double *J) {
    // A particle half way between nodes has no share in the outermost ones, which may bear no mass.
    if (node[0] <= 0) return 0;
    double work = 0, lighter = 1.0 / node[0];
    for (int d = 0; d < 3; d++) {
      double momentum = node[1 + d] + w->dt * node[4 + d];
      work += J[d] * (lighter * (momentum + 0.5 * share * J[d]) + w->kick[d]);
    }
    return work;
  }
  // Where a particle is [m].
  static inline void place(const World *w, const Field &field, const float *q, int lane, double *x) {
    for (int d = 0; d < 3; d++)
      x[d] = (((const int *)(q + 8 * (XI + d)))[lane] / (double)CELL_UNITS + 4.0 * field.origin[d]) * w->dx;
  }
};
