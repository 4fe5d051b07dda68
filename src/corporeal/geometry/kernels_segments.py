"""Where short ways go through triangles. Loops compiled by numba."""

import numba
import numpy as np


@numba.njit(cache=True)
def collect_segment_crossings(starts, ends, vertices, triangles, met):
    """Count the triangles that ways meet (``met`` is empty), or write them down.

    Möller and Trumbore 1997. Ways are taken as short: of triangles beside all of them, none is asked.

    Args:
        starts: Of the ways (N, 3) [m].
        ends: Of the ways (N, 3) [m].
        vertices: Of the triangles (V, 3) [m].
        triangles: Their numbers (T, 3).
        met: Way, share of it gone [-], triangle, and 1 where it goes in, -1 out (H, 4).

    Returns:
        How many there are.
    """
    count = 0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for n in range(len(starts)):
        for a in range(3):
            low[a] = min(low[a], starts[n, a], ends[n, a])
            high[a] = max(high[a], starts[n, a], ends[n, a])
    corner = np.empty((3, 3))
    for t in range(len(triangles)):
        beside = False
        for a in range(3):
            x, y, z = (vertices[triangles[t, 0], a], vertices[triangles[t, 1], a], vertices[triangles[t, 2], a])
            beside = beside or max(x, y, z) < low[a] or min(x, y, z) > high[a]
            corner[0, a], corner[1, a], corner[2, a] = x, y - x, z - x
        if beside:
            continue
        for n in range(len(starts)):
            share, side = _meets_triangle(starts[n], ends[n], corner)
            if side != 0:
                if len(met):
                    met[count, 0], met[count, 1], met[count, 2] = n, share, t
                    met[count, 3] = side
                count += 1
    return count


@numba.njit(cache=True)
def _meets_triangle(start, end, corner):
    """Share of a way at which it meets a triangle, and its side; 0: it does not.

    corner: of the triangle one corner and the two edges from there.
    """
    wx, wy, wz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    ax, ay, az = corner[1]
    bx, by, bz = corner[2]
    # Along the triangle's normal, doubled in area.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    steep = wx * nx + wy * ny + wz * nz
    if steep == 0.0:
        return 0.0, 0
    sx, sy, sz = start[0] - corner[0, 0], start[1] - corner[0, 1], start[2] - corner[0, 2]
    share = -(sx * nx + sy * ny + sz * nz) / steep
    if share < 0.0 or share >= 1.0:
        return 0.0, 0
    qx, qy, qz = sy * wz - sz * wy, sz * wx - sx * wz, sx * wy - sy * wx
    u = -(bx * qx + by * qy + bz * qz) / steep
    v = (ax * qx + ay * qy + az * qz) / steep
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return 0.0, 0
    return share, 1 if steep < 0.0 else -1
