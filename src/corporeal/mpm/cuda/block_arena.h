// Nodes that the particles of one block reach, 6 along each axis, while a group of threads works on that block:
// in shared memory on a card, where each sum leaves by one atomic a node instead of one a particle. A thread sums the particles
// of a cell in its registers first: adds of float32 in shared memory are loops, which wait for each other at one address.
#pragma once
#include "lanes.h"
#include "spline.h"
namespace mpm {
namespace {
static_assert(ARENA_NODES == ARENA_SIDE * ARENA_SIDE * ARENA_SIDE, "nodes that a block's particles reach");
struct Arena {
  // A group's own memory; given: where there is one group at a time, on a processor.
  CUDA_CALLABLE static MPM_INLINE float *memory(float *given) {
#if defined(__CUDA_ARCH__)
    __shared__ float own[ARENA_SUMS * ARENA_NODES];
    return own;
#else
    return given;
#endif
  }
  // Lists of a group's particles by cell: the first of each of the block's 64 cells, then the next of each particle; -1: no more.
  CUDA_CALLABLE static MPM_INLINE int *lists(float *given) {
#if defined(__CUDA_ARCH__)
    __shared__ int own[NODES_OF_BLOCK + TASK];
    return own;
#else
    return (int *)(given + ARENA_SUMS * ARENA_NODES);
#endif
  }
  // Exchange the number at a place.
  CUDA_CALLABLE static MPM_INLINE int exchange(int *place, int number) {
#if defined(__CUDA_ARCH__)
    return atomicExch(place, number);
#else
    const int before = *place;
    *place = number;
    return before;
#endif
  }
  CUDA_CALLABLE static MPM_INLINE void add(float *sum, float value) {
#if defined(__CUDA_ARCH__)
    atomicAdd(sum, value);
#else
    *sum += value;
#endif
  }
  // Place in the arena of a node, counted along each axis from the block's first.
  CUDA_CALLABLE static MPM_INLINE int at(int x, int y, int z) { return (x * ARENA_SIDE + y) * ARENA_SIDE + z; }
  // Index of that node among all: it is in one of the eight blocks near home.
  CUDA_CALLABLE static MPM_INLINE int node(const int *near, int home, int x, int y, int z) {
    const int slot = near[8 * home + 4 * (x >> 2) + 2 * (y >> 2) + (z >> 2)];
    return NODES_OF_BLOCK * slot + 16 * (x & 3) + 4 * (y & 3) + (z & 3);
  }
  // The same of the arena's k-th.
  CUDA_CALLABLE static MPM_INLINE int node(const int *near, int home, int k) {
    return node(near, home, k / (ARENA_SIDE * ARENA_SIDE), k / ARENA_SIDE % ARENA_SIDE, k % ARENA_SIDE);
  }
  // Index of a node's sums: those of one kind side by side for a whole block.
  CUDA_CALLABLE static MPM_INLINE int sum(int node, int kind) {
    return NODES_OF_BLOCK * (ARENA_SUMS * (node / NODES_OF_BLOCK) + kind) + node % NODES_OF_BLOCK;
  }
};

// Where a particle is in its block: first of its nodes, and weights of them all.
struct Reach {
  int x, y, z;
  float n[3][3];
  CUDA_CALLABLE MPM_INLINE Reach(const int *cell, const float *f) : x(cell[0] & 3), y(cell[1] & 3), z(cell[2] & 3) {
    for (int d = 0; d < 3; d++) Spline<float>::weights(f[d], n[d]);
  }
};

// Contribution of a particle: mass, and momentum and impulse at its first node and more a node along each axis.
struct Gift {
  float mass, first[6], more[3][6];
  // B, S: gradients of momentum and impulse, a cell.
  CUDA_CALLABLE MPM_INLINE Gift(float m, const float *momentum, const float *B, const float *impulse, const float *S, const float *f)
      : mass(m) {
#pragma unroll
    for (int k = 0; k < 3; k++) {
      first[k] = momentum[k], first[3 + k] = impulse[k];
#pragma unroll
      for (int j = 0; j < 3; j++) {
        more[j][k] = B[3 * k + j], more[j][3 + k] = S[3 * k + j];
        first[k] -= B[3 * k + j] * f[j], first[3 + k] -= S[3 * k + j] * f[j];
      }
    }
  }
  // Add to all nodes. Place: index of a node's sums in the arena, or among all nodes.
  template <class Place> CUDA_CALLABLE MPM_INLINE void scatter(const Reach &to, float *sums, const Place &place) const {
#pragma unroll
    for (int i = 0; i < 3; i++)
#pragma unroll
      for (int j = 0; j < 3; j++)
#pragma unroll
        for (int k = 0; k < 3; k++) {
          const float n = to.n[0][i] * to.n[1][j] * to.n[2][k];
          const int node = place.node(to.x + i, to.y + j, to.z + k);
          Arena::add(sums + place.sum(node, 0), n * mass);
#pragma unroll
          for (int c = 0; c < 6; c++)
            Arena::add(sums + place.sum(node, 1 + c), n * (first[c] + i * more[0][c] + j * more[1][c] + k * more[2][c]));
        }
  }
};

// Contribution of the particles of one cell to a layer of nine nodes, summed in registers; layer: which along x.
struct Layer {
  static constexpr int BODY_SUMS = 9 * ARENA_SUMS;
  CUDA_CALLABLE static MPM_INLINE void add(float *sums, const Gift &gift, int layer, const float *f) {
    float n[3][3];
#pragma unroll
    for (int d = 0; d < 3; d++) Spline<float>::weights(f[d], n[d]);
    const float here = layer == 0 ? n[0][0] : layer == 1 ? n[0][1] : n[0][2];
#pragma unroll
    for (int j = 0; j < 3; j++)
#pragma unroll
      for (int k = 0; k < 3; k++) {
        const float w = here * n[1][j] * n[2][k];
        float *sum = sums + ARENA_SUMS * (3 * j + k);
        sum[0] += w * gift.mass;
#pragma unroll
        for (int c = 0; c < 6; c++)
          sum[1 + c] += w * (gift.first[c] + layer * gift.more[0][c] + j * gift.more[1][c] + k * gift.more[2][c]);
      }
  }
  // Add them to the arena.
  CUDA_CALLABLE static MPM_INLINE void leave(float *own, const float *sums, int cell, int layer) {
    const int first = Arena::at((cell >> 4) + layer, cell >> 2 & 3, cell & 3);
#pragma unroll
    for (int j = 0; j < 3; j++)
#pragma unroll
      for (int k = 0; k < 3; k++)
#pragma unroll
        for (int c = 0; c < ARENA_SUMS; c++)
          Arena::add(own + ARENA_NODES * c + first + ARENA_SIDE * j + k, sums[ARENA_SUMS * (3 * j + k) + c]);
  }
};

// Places in the arena.
struct Here {
  CUDA_CALLABLE MPM_INLINE int node(int x, int y, int z) const { return Arena::at(x, y, z); }
  CUDA_CALLABLE MPM_INLINE int sum(int node, int kind) const { return ARENA_NODES * kind + node; }
};

// Places among all nodes, for particles that strayed from their group's block.
struct There {
  const int *near;
  int home;
  CUDA_CALLABLE MPM_INLINE int node(int x, int y, int z) const { return Arena::node(near, home, x, y, z); }
  CUDA_CALLABLE MPM_INLINE int sum(int node, int kind) const { return Arena::sum(node, kind); }
};

// Result for a particle: velocity and its gradient, now and without forces; first: of which node's motion.
struct Seen {
  float v[3], L[9], u[3], K[9];
  CUDA_CALLABLE MPM_INLINE void clear() {
    for (int k = 0; k < 3; k++) v[k] = u[k] = 0.0f;
    for (int k = 0; k < 9; k++) L[k] = K[k] = 0.0f;
  }
  template <class Motion> CUDA_CALLABLE MPM_INLINE void gather(const Reach &from, const float *f, const Motion &motion, bool old) {
    clear();
#pragma unroll
    for (int i = 0; i < 3; i++)
#pragma unroll
      for (int j = 0; j < 3; j++)
#pragma unroll
        for (int k = 0; k < 3; k++) {
          const float n = from.n[0][i] * from.n[1][j] * from.n[2][k];
          const float arm[3] = {4.0f * (i - f[0]), 4.0f * (j - f[1]), 4.0f * (k - f[2])};
          const int node = motion.place.node(from.x + i, from.y + j, from.z + k);
          add(v, L, n, motion, node, 0, arm);
          if (old) add(u, K, n, motion, node, 3, arm);
        }
  }
  template <class Motion>
  CUDA_CALLABLE static MPM_INLINE void add(float *mean, float *slope, float n, const Motion &motion, int node, int first, const float *arm) {
#pragma unroll
    for (int c = 0; c < 3; c++) {
      const float part = n * motion.of(node, first + c);
      mean[c] += part;
#pragma unroll
      for (int d = 0; d < 3; d++) slope[3 * c + d] += part * arm[d];
    }
  }
};

// Motion of nodes in the arena.
struct Near {
  Here place;
  const float *motion;
  CUDA_CALLABLE MPM_INLINE float of(int node, int kind) const { return motion[place.sum(node, kind)]; }
};

// Motion of any nodes: rows of four, mass before velocity, and velocity without forces.
struct Far {
  There place;
  const float *now, *old;
  CUDA_CALLABLE MPM_INLINE float of(int node, int kind) const { return kind < 3 ? now[4 * node + 1 + kind] : old[4 * node + kind - 3]; }
};
}  // namespace
}  // namespace mpm
