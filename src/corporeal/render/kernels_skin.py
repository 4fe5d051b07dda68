"""Points carried by particles. Loops compiled by numba."""

import numba
import numpy as np

from corporeal.render.kernels_hits import JIT, LOOP


@numba.njit(**LOOP)
def shepard_weights(distance, out):
    """Shepard's weights with local support: (1 - d/R)² / (d/R)² (Franke & Nielson 1980).

    R is the distance of one neighbour more, so that a weight is 0 when its neighbour is exchanged.
    """
    count = distance.shape[1] - 1
    for v in range(len(distance)):
        reach = distance[v, count]
        total = 0.0
        for k in range(count):
            w = 1.0
            if reach > 0 and np.isfinite(reach):
                r = min(distance[v, k] / reach, 1.0)
                # The floor under r keeps a vertex that touches a particle smooth.
                w = (1 - r) ** 2 / (r * r + 0.05)
            elif not np.isfinite(distance[v, k]):
                w = 0.0
            out[v, k] = w
            total += w
        if total < 1e-12:
            for k in range(count):
                out[v, k] = 1.0 if np.isfinite(distance[v, k]) else 0.0
            total = max(out[v].sum(), 1.0)
        for k in range(count):
            out[v, k] /= total


@numba.njit(**LOOP)
def deform_points(rest, near, weight, start, now, F, place, gradient):
    """X' = Σ w (x_p + F_p (X - X_p)) and Σ w F_p; what has no particles stays as it is."""
    for v in range(len(rest)):
        bare = weight[v].sum() == 0
        for a in range(3):
            place[v, a] = rest[v, a] if bare else 0.0
            for b in range(3):
                gradient[v, a, b] = 1.0 if bare and a == b else 0.0
        for k in range(near.shape[1]):
            w = weight[v, k]
            if w == 0:
                continue
            p = near[v, k]
            for a in range(3):
                moved = now[p, a]
                for b in range(3):
                    moved += F[p, a, b] * (rest[v, b] - start[p, b])
                    gradient[v, a, b] += w * F[p, a, b]
                place[v, a] += w * moved


@numba.njit(**JIT)
def deform_points_and_normals(rest, normals, near, weight, start, now, F, place, turned):
    """Do as ``deform_points``; normals turn by the cofactor of Σ w F_p (Nanson's formula)."""
    gradient = np.empty((len(rest), 3, 3))
    deform_points(rest, near, weight, start, now, F, place, gradient)
    C = np.empty((3, 3))
    for v in range(len(rest)):
        G = gradient[v]
        for a in range(3):
            a1, a2 = (a + 1) % 3, (a + 2) % 3
            for b in range(3):
                b1, b2 = (b + 1) % 3, (b + 2) % 3
                C[a, b] = G[a1, b1] * G[a2, b2] - G[a1, b2] * G[a2, b1]
        length = 0.0
        for a in range(3):
            n = 0.0
            for b in range(3):
                n += C[a, b] * normals[v, b]
            turned[v, a] = n
            length += n * n
        length = np.sqrt(length)
        for a in range(3):
            turned[v, a] = turned[v, a] / length if length > 1e-12 else normals[v, a]


@numba.njit(**LOOP)
def mark_strained(F, limit, out):
    """Mark gradients with ‖FᵀF - 1‖² > their ``limit`` (P,), and those that mirror."""
    for p in range(len(F)):
        norm = 0.0
        for a in range(3):
            for b in range(3):
                c = F[p, 0, a] * F[p, 0, b] + F[p, 1, a] * F[p, 1, b] + F[p, 2, a] * F[p, 2, b]
                c -= 1.0 if a == b else 0.0
                norm += c * c
        volume = 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            volume += F[p, 2, a] * (F[p, 0, b] * F[p, 1, c] - F[p, 0, c] * F[p, 1, b])
        out[p] = norm > limit[p] or volume <= 0
