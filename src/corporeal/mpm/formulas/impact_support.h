// Support of a rigid body during an impact: twin of physics/impact_support.py. A light body between
// what strikes it and what it lies on is squeezed at once, both contacts being springs in series.
#pragma once
#include "contact.h"
namespace mpm {
namespace {
// Of every pair of bodies, or body and plane, one row: its part in this round of impacts, its restitution in
// it, the least gap of its contacts, the approach speed of the impact, and of the near ones their number and
// the sums of place, squared place and normal.
struct ImpactSupport {
  enum { ROLE, BOUNCE, LEAST, SPEED, COUNT, PLACE, SQUARE = 8, NORMAL = 14, ROW = 17 };
  enum { RESTITUTION_LAW_NUMBERS = 5 };   // numbers of Impact::bounce
  enum { WAITS, STRUCK, HELD };
  // Whether a contact is near and does not open; least: gap of the nearest one of its pair, if that is struck.
  CUDA_CALLABLE static inline bool near(double gap, double least, double speed, double dx) {
    return speed > -MAX_RESTING_SPEED && gap < (least > 0 ? least : 0.0) + IMPACT_PATCH_DX * dx;
  }
  // What it adds to its pair, from COUNT on.
  CUDA_CALLABLE static inline void adds(const double *x, const double *n, double *sums) {
    sums[0] = 1;
    for (int i = 0; i < 3; i++) {
      sums[PLACE - COUNT + i] = x[i], sums[NORMAL - COUNT + i] = n[i];
      sums[SQUARE - COUNT + i] = x[i] * x[i];
      sums[SQUARE - COUNT + 3 + i] = x[i] * x[(i + 1) % 3];
    }
  }
  // Radius of the disc over which near contacts spread across their normal, of a cell at least: the stiffness
  // is 2 E* times it.
  CUDA_CALLABLE static inline double radius(const double *row, double dx) {
    const double *n = row + NORMAL, *x = row + PLACE, many = row[COUNT];
    double size = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], all = 0, along = 0;
    if (size < TINY_DOUBLE) size = TINY_DOUBLE;
    for (int i = 0; i < 3; i++) {
      const int j = (i + 1) % 3;
      const double own = (row[SQUARE + i] - x[i] * x[i] / many) / many;
      all += own;
      along += (n[i] * n[i] * own + 2 * n[i] * n[j] * (row[SQUARE + 3 + i] - x[i] * x[j] / many) / many) / size;
    }
    return sqrt(2 * (all > along ? all - along : 0.0) + dx * dx);
  }
  // Stiffness of a contact behind, as the radius of an equally stiff punch: what is thin and lies on its face
  // is pressed as a layer, E pi a^2/h, h being its thickness from the contact before it along u.
  CUDA_CALLABLE static inline double reach(const double *row, const double *front, const double *u, double dx) {
    const double a = radius(row, dx);
    double thick = 0;
    for (int i = 0; i < 3; i++) thick += u[i] * (row[PLACE + i] / row[COUNT] - front[PLACE + i] / front[COUNT]);
    thick = thick < 0 ? -thick : thick;
    const double layer = LAYER_STIFFNESS_FACTOR * (a * a - dx * dx) / (thick > TINY_DOUBLE ? thick : TINY_DOUBLE);
    return layer > a ? layer : a;
  }
  // Whether the vibration of the body between, of this mass, is much shorter than the impact: k is the stiffness of the
  // contact behind over that of the impact; from, to: inverse masses of what strikes and of what is behind.
  CUDA_CALLABLE static inline bool quick(double k, double mass, double from, double to) {
    return k * (1 / mass + to) + 1 / mass > SUPPORT_FREQUENCY_RATIO2 * (from + to / (1 + mass * to));
  }
  CUDA_CALLABLE static inline int at(int a, int c, int all) { return a < c ? a * all + c : c * all + a; }
  // Cosine of the normal from body b to d with a direction.
  CUDA_CALLABLE static inline double along(const double *row, bool forward, const double *u) {
    const double *n = row + NORMAL;
    const double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const double cosine = (n[0] * u[0] + n[1] * u[1] + n[2] * u[2]) / (size > TINY_DOUBLE ? size : TINY_DOUBLE);
    return forward ? cosine : -cosine;
  }
  // Mark the supports of body b, struck along u, and their supports in turn. soft, kept: compliance of what
  // is pressed, over that of the impact, and the part of the energy in it that comes back.
  CUDA_CALLABLE static inline void follow(double *rows, const double *e, const double *light, int all, int from,
                                          int b, const double *u, const double *struck, double dx, double &soft, double &kept) {
    double mass = 0;
    const double front_radius = radius(struck, dx), *front = struck;
    for (int before = from, turn = 0; turn < all && light[b] > 0; turn++) {
      int next = -1;
      double stiffest = 0;
      mass += 1 / light[b];
      for (int d = 0; d < all; d++) {
        double *row = rows + ROW * at(b, d, all);
        if (d == b || d == before || light[d] < 0 || row[COUNT] == 0 || row[ROLE] == STRUCK) continue;
        if (SUPPORT_MASS_RATIO * light[d] > light[b] || along(row, b < d, u) < SUPPORT_NORMAL_COSINE) continue;
        const double k = reach(row, front, u, dx) / front_radius;
        if (!quick(k, mass, light[from], light[d])) continue;
        row[ROLE] = HELD;
        if (k > stiffest) stiffest = k, next = d;
      }
      if (next < 0) return;
      const double back = e[at(b, next, all)];
      soft += 1 / stiffest;
      kept += back * back / stiffest;
      front = rows + ROW * at(b, next, all);
      before = b;
      b = next;
    }
  }
  // Find for all struck pairs their restitution, and which other pairs support them. light: inverse masses,
  // 0 of planes and of prescribed motion, -1 of what is no rigid body; e: restitution of all pairs; law: its
  // change with speed.
  CUDA_CALLABLE static inline void hold(double *rows, const double *e, const double *law, const double *light,
                                        int all, double dx) {
    for (int a = 0; a < all; a++)
      for (int c = a + 1; c < all; c++) {
        double *row = rows + ROW * (a * all + c), u[3], back[3];
        if (row[ROLE] != STRUCK) continue;
        const double *n = row + NORMAL;
        const double own = Impact::bounce(e[a * all + c], law + RESTITUTION_LAW_NUMBERS * (a * all + c), row[SPEED]);
        const double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        double soft = 1, kept = own * own;
        for (int i = 0; i < 3; i++) u[i] = n[i] / (size > TINY_DOUBLE ? size : TINY_DOUBLE), back[i] = -u[i];
        follow(rows, e, light, all, a, c, u, row, dx, soft, kept);
        follow(rows, e, light, all, c, a, back, row, dx, soft, kept);
        row[BOUNCE] = soft > 1 ? sqrt(kept / soft) : own;
      }
  }
  // Speed that a contact of a pair that holds may keep: none where it is near.
  CUDA_CALLABLE static inline double held(double gap, double dt, double dx) {
    return gap < IMPACT_PATCH_DX * dx ? 0.0 : gap / dt;
  }
};
}  // namespace
}  // namespace mpm
