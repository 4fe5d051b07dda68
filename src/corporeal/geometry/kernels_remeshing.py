"""Edge collapses and edge flips on a triangle mesh with feature edges. Loops compiled by numba.

Corner k of triangle t is number 3 t + k; the corners at a vertex form a linked list (``head``, ``following``). A
feature edge is one that does not have two triangles, or whose triangles belong to two patches. ``kind`` of a vertex:
0 on no feature edge, 1 on a line of them, 2 fixed.
"""

import numba
import numpy as np

MIN_NORMAL_COS = 0.5
"""Least cosine between the normals of a triangle before and after a change."""
MIN_TRIANGLE_QUALITY = 0.1
"""4 √3 A / Σ l² below which a triangle is made no worse [-]; 1: equilateral."""
SMALL_TRIANGLE_RATIO = 0.05
"""2 A / l² below which a triangle may turn, with the longest edge l that a collapse may make: its normal is noise."""
MAX_COLLAPSED_RATIO = 1.4
"""Longest edge that a collapse makes, over the wanted length."""


@numba.njit(cache=True)
def link_corners(triangles, head, following):
    """Make the lists of corners at each vertex."""
    head[:] = -1
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            following[3 * t + k] = head[v]
            head[v] = 3 * t + k


@numba.njit(cache=True)
def _cross(a, b, c, out):
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0], out[1], out[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    wx, wy, wz = c[0] - b[0], c[1] - b[1], c[2] - b[2]
    squares = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
    return area, 2.0 * np.sqrt(3.0) * area / max(squares, 1e-300)


@numba.njit(cache=True)
def _edge_is_feature(a, b, triangles, patch, alive, head, following):
    """Return the number of the edge's triangles, and whether it is a feature edge."""
    count, first, same = 0, -1, True
    c = head[a]
    while c >= 0:
        t = c // 3
        if alive[t] and (triangles[t, 0] == b or triangles[t, 1] == b or triangles[t, 2] == b):
            if first < 0:
                first = patch[t]
            same = same and patch[t] == first
            count += 1
        c = following[c]
    return count, count != 2 or not same


@numba.njit(cache=True)
def _has_triangle(v, p, q, mesh):
    triangles, alive, head, following = mesh
    c = head[v]
    while c >= 0:
        t, k = c // 3, c % 3
        o, r = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        if alive[t] and ((o == p and r == q) or (o == q and r == p)):
            return True
        c = following[c]
    return False


@numba.njit(cache=True)
def _breaks_triangle(u, v, place, x, mesh, mark, stamp, limit):
    """Return whether moving ``u``, of the edge u v, to a place would turn, flatten or double a triangle."""
    triangles, alive, head, following = mesh
    old, new = np.empty(3), np.empty(3)
    c = head[u]
    while c >= 0:
        t, k = c // 3, c % 3
        p, q = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        if alive[t] and p != v and q != v:
            for o in (p, q):
                away = (x[o, 0] - place[0]) ** 2 + (x[o, 1] - place[1]) ** 2 + (x[o, 2] - place[2]) ** 2
                if away > limit**2:
                    return True
            if mark[p] == stamp and mark[q] == stamp and _has_triangle(v, p, q, mesh):
                return True
            before, good = _cross(x[u], x[p], x[q], old)
            after, better = _cross(place, x[p], x[q], new)
            if better < MIN_TRIANGLE_QUALITY and better < good:
                return True
            turned = old[0] * new[0] + old[1] * new[1] + old[2] * new[2] < MIN_NORMAL_COS * before * after
            if turned and before > SMALL_TRIANGLE_RATIO * limit**2:
                return True
        c = following[c]
    return False


@numba.njit(cache=True)
def _triangles_at(v, mesh):
    _, alive, head, following = mesh
    count, c = 0, head[v]
    while c >= 0:
        count += alive[c // 3]
        c = following[c]
    return count


@numba.njit(cache=True)
def _shared_neighbours(u, v, mesh, mark, stamp):
    """Mark the neighbours of both with ``stamp``, and count them."""
    triangles, alive, head, following = mesh
    c = head[v]
    while c >= 0:
        t, k = c // 3, c % 3
        if alive[t]:
            mark[triangles[t, (k + 1) % 3]] = stamp - 1
            mark[triangles[t, (k + 2) % 3]] = stamp - 1
        c = following[c]
    shared = 0
    c = head[u]
    while c >= 0:
        t, k = c // 3, c % 3
        if alive[t]:
            for j in (1, 2):
                o = triangles[t, (k + j) % 3]
                if mark[o] == stamp - 1:
                    mark[o] = stamp
                    shared += 1
        c = following[c]
    return shared


@numba.njit(cache=True)
def collapse_edges(edges, length, x, triangles, patch, kind, alive):
    """Collapse edges shorter than 4/5 of ``length`` in the given order; ``x``, ``triangles``, ``alive`` change.

    An edge stays where its collapse would change the topology, move a feature, turn a triangle or make a long edge.
    Returns the number of collapses.
    """
    head = np.full(len(x), -1)
    following = np.full(3 * len(triangles), -1)
    link_corners(triangles, head, following)
    mesh = (triangles, alive, head, following)
    mark = np.zeros(len(x), np.int64)
    gone = np.zeros(len(x), np.bool_)
    place = np.empty(3)
    stamp, done = 1, 0
    for e in range(len(edges)):
        u, v = edges[e]
        if gone[u] or gone[v]:
            continue
        if kind[u] > kind[v]:
            u, v = v, u
        squared = (x[u, 0] - x[v, 0]) ** 2 + (x[u, 1] - x[v, 1]) ** 2 + (x[u, 2] - x[v, 2]) ** 2
        if kind[u] == 2 or squared > (0.8 * length) ** 2:
            continue
        count, feature = _edge_is_feature(u, v, triangles, patch, alive, head, following)
        if count == 0 or (kind[u] > 0 and not feature):
            continue
        stamp += 2
        shared = _shared_neighbours(u, v, mesh, mark, stamp)
        if shared != count or _triangles_at(u, mesh) + _triangles_at(v, mesh) == 2 * count:
            continue
        for d in range(3):
            place[d] = x[v, d] if kind[v] > kind[u] else 0.5 * (x[u, d] + x[v, d])
        limit = MAX_COLLAPSED_RATIO * length
        if _breaks_triangle(u, v, place, x, mesh, mark, stamp, limit):
            continue
        if _breaks_triangle(v, u, place, x, mesh, mark, stamp, limit):
            continue
        c = head[u]
        while c >= 0:
            after, t = following[c], c // 3
            if alive[t]:
                if triangles[t, 0] == v or triangles[t, 1] == v or triangles[t, 2] == v:
                    alive[t] = False
                else:
                    triangles[t, c % 3] = v
                    following[c] = head[v]
                    head[v] = c
            c = after
        x[v] = place
        gone[u] = True
        done += 1
    return done


@numba.njit(cache=True)
def _unlink_corner(c, v, head, following):
    if head[v] == c:
        head[v] = following[c]
        return
    p = head[v]
    while following[p] != c:
        p = following[p]
    following[p] = following[c]


@numba.njit(cache=True)
def _has_edge(a, b, triangles, head, following):
    c = head[a]
    while c >= 0:
        t = c // 3
        if triangles[t, 0] == b or triangles[t, 1] == b or triangles[t, 2] == b:
            return True
        c = following[c]
    return False


@numba.njit(cache=True)
def _angle_cos(at, p, q):
    dot = one = two = 0.0
    for d in range(3):
        a, b = p[d] - at[d], q[d] - at[d]
        dot += a * b
        one += a * a
        two += b * b
    return dot / max(np.sqrt(one * two), 1e-300)


@numba.njit(cache=True)
def flip_edges(edges, x, triangles, patch, wanted, delaunay):
    """Flip edges within patches; ``triangles`` change. Returns the number of flips.

    With ``delaunay`` an edge is flipped if the angles opposite to it exceed 180° together, else if that brings the
    number of triangles at its four vertices nearer to ``wanted``.
    """
    head = np.full(len(x), -1)
    following = np.full(3 * len(triangles), -1)
    link_corners(triangles, head, following)
    degree = np.zeros(len(x), np.int64)
    for t in range(len(triangles)):
        for k in range(3):
            degree[triangles[t, k]] += 1
    n1, n2, m1, m2 = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    done = 0
    for e in range(len(edges)):
        a, b = edges[e]
        # The corner of each triangle at a, and at b.
        count, s, t, bs, at = 0, -1, -1, -1, -1
        c = head[a]
        while c >= 0:
            f, k = c // 3, c % 3
            if triangles[f, (k + 1) % 3] == b:
                count += 1
                s, bs = f, 3 * f + (k + 1) % 3
            elif triangles[f, (k + 2) % 3] == b:
                count += 1
                t, at = f, c
            c = following[c]
        if count != 2 or s < 0 or t < 0 or patch[s] != patch[t]:
            continue
        o = triangles[s, (bs + 1 - 3 * s) % 3]
        p = triangles[t, (at + 1 - 3 * t) % 3]
        if o == p or _has_edge(o, p, triangles, head, following):
            continue
        if delaunay:
            # cos α + cos β < 0 is α + β > π
            if _angle_cos(x[o], x[a], x[b]) + _angle_cos(x[p], x[a], x[b]) > -1e-6:
                continue
        else:
            before = after = 0
            for v, change in ((a, -1), (b, -1), (o, 1), (p, 1)):
                before += (degree[v] - wanted[v]) ** 2
                after += (degree[v] + change - wanted[v]) ** 2
            if after >= before:
                continue
        _, q1 = _cross(x[a], x[b], x[o], n1)
        _, q2 = _cross(x[b], x[a], x[p], n2)
        b1, r1 = _cross(x[a], x[p], x[o], m1)
        b2, r2 = _cross(x[p], x[b], x[o], m2)
        worst = min(q1, q2)
        if min(r1, r2) < 0.3 and min(r1, r2) < worst:
            continue
        mean = n1 + n2
        size = np.sqrt((mean**2).sum())
        flat = min((m1 * mean).sum() / max(b1 * size, 1e-300), (m2 * mean).sum() / max(b2 * size, 1e-300))
        if worst > 1e-3 and flat < 0.8:
            continue
        _unlink_corner(bs, b, head, following)
        _unlink_corner(at, a, head, following)
        triangles[s, bs - 3 * s] = p
        following[bs] = head[p]
        head[p] = bs
        triangles[t, at - 3 * t] = o
        following[at] = head[o]
        head[o] = at
        degree[a] -= 1
        degree[b] -= 1
        degree[o] += 1
        degree[p] += 1
        done += 1
    return done


@numba.njit(cache=True)
def line_turning(x, beside, reach, turning):
    """Angle by which lines turn at their vertices [rad], between chords ``reach`` long.

    ``beside`` holds the two neighbours along the line; -1: the vertex is on none, or where lines end or meet. Where
    another vertex within reach turns more the angle is 0.
    """
    ends = np.empty((2, 3))
    for v in range(len(x)):
        turning[v] = 0.0
        if beside[v, 0] < 0:
            continue
        for side in range(2):
            before, now, far = v, beside[v, side], 0.0
            for _ in range(1000):
                far = np.sqrt(((x[now] - x[v]) ** 2).sum())
                if far >= reach or beside[now, 0] < 0 or now == v:
                    break
                onward = beside[now, 0] if beside[now, 1] == before else beside[now, 1]
                before, now = now, onward
            ends[side] = x[now]
        turning[v] = np.arccos(max(-1.0, min(1.0, -_angle_cos(x[v], ends[0], ends[1]))))


@numba.njit(cache=True)
def sharpest_within(x, beside, reach, turning, sharpest):
    """Whether no other vertex of the line within reach turns more."""
    for v in range(len(x)):
        sharpest[v] = beside[v, 0] >= 0
        if not sharpest[v]:
            continue
        for side in range(2):
            before, now = v, beside[v, side]
            for _ in range(1000):
                if beside[now, 0] < 0 or now == v or ((x[now] - x[v]) ** 2).sum() >= reach**2:
                    break
                if turning[now] > turning[v] + 1e-9 or (abs(turning[now] - turning[v]) <= 1e-9 and now < v):
                    sharpest[v] = False
                    break
                onward = beside[now, 0] if beside[now, 1] == before else beside[now, 1]
                before, now = now, onward
