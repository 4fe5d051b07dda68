"""Plane-sweep depths, and their consistency. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import from_camera, project_to_pixel

f4 = np.float32
PATCH_RADIUS_PX = 2
"""Patches are that many pixels wide to each side of their middle."""
NEARER_DIFFERENCE_RATIO, NEARER_DIFFERENCE_MARGIN = f4(0.9), f4(0.004)
"""A nearer depth must differ less than such a share of the best so far, less that [0–1]."""
MIN_PATCH_TEXTURE, PLAIN_PATCH_MISMATCH = f4(0.01), f4(0.04)
"""A patch that varies less says nothing of its depth, unless it differs by more."""
REFINED_DEPTHS = 8
"""Depths looked at between two planes."""
CLEAR_DEPTH_DIFFERENCE_RATIO = 0.1
"""Relative difference of depths that is clearly one."""
OUTSIDE_DIFFERENCE = f4(9)
"""Difference of a patch that is not in a picture."""


@numba.njit(**JIT_OPTIONS)
def _patch_difference(patch, ray, z, turn, shift, lens, picture, step):
    """Mean difference between a patch and what a neighbour shows at depth z.

    turn, shift: neighbour from the patch's camera; step (2,): a pixel of that camera along x and y at depth 1. The
    patch is taken to face its camera; its projection is linearised.
    """
    height, width, _ = picture.shape
    p0 = z * (turn[0, 0] * ray[0] + turn[0, 1] * ray[1] + turn[0, 2]) + shift[0]
    p1 = z * (turn[1, 0] * ray[0] + turn[1, 1] * ray[1] + turn[1, 2]) + shift[1]
    p2 = z * (turn[2, 0] * ray[0] + turn[2, 1] * ray[1] + turn[2, 2]) + shift[2]
    if not p2 > 1e-6:
        return OUTSIDE_DIFFERENCE
    fx, fy = lens[0] / p2, lens[1] / p2
    u, v = fx * p0 + lens[2], fy * p1 + lens[3]
    if not (PATCH_RADIUS_PX < u < width - PATCH_RADIUS_PX - 1 and PATCH_RADIUS_PX < v < height - PATCH_RADIUS_PX - 1):
        return OUTSIDE_DIFFERENCE
    x, y = p0 / p2, p1 / p2
    sx, sy = z * step[0], z * step[1]
    ux, vx = fx * sx * (turn[0, 0] - x * turn[2, 0]), fy * sx * (turn[1, 0] - y * turn[2, 0])
    uy, vy = fx * sy * (turn[0, 1] - x * turn[2, 1]), fy * sy * (turn[1, 1] - y * turn[2, 1])
    total = f4(0)
    for j in range(-PATCH_RADIUS_PX, PATCH_RADIUS_PX + 1):
        for i in range(-PATCH_RADIUS_PX, PATCH_RADIUS_PX + 1):
            c = min(max(int(u + i * ux + j * uy), 0), width - 1)
            r = min(max(int(v + i * vx + j * vy), 0), height - 1)
            for q in range(3):
                total += abs(patch[j + PATCH_RADIUS_PX, i + PATCH_RADIUS_PX, q] - picture[r, c, q])
    return total / f4(3 * (2 * PATCH_RADIUS_PX + 1) ** 2)


@numba.njit(**JIT_OPTIONS)
def _mates_mismatch(patch, ray, z, k, mates, turns, shifts, lenses, pictures, step):
    """Mean of the two least differences from the neighbours: others may look past something."""
    least, second = OUTSIDE_DIFFERENCE, OUTSIDE_DIFFERENCE
    for m in range(len(mates)):
        n = mates[m]
        d = _patch_difference(patch, ray, z, turns[m], shifts[m], lenses[n], pictures[n], step)
        if d < least:
            least, second = d, least
        elif d < second:
            second = d
    return least if second >= OUTSIDE_DIFFERENCE else f4(0.5) * (least + second)


@numba.njit(**JIT_OPTIONS)
def sweep_rows(k, first, last, pace, pictures, lenses, mates, turns, shifts, planes, depth):
    """Fill in rows first to last of view k's depths; inf where no neighbour looks.

    pace: pixels from one depth to the next; planes: inverse depths, rising, evenly spaced. Of depths that look alike
    the farthest is taken: what is smooth hides nothing then.
    """
    picture = pictures[k]
    height, width, _ = picture.shape
    ray, step = np.ones(3), np.array([1 / lenses[k, 0], 1 / lenses[k, 1]])
    apart = planes[1] - planes[0]
    for gy in range(first, last):
        y = gy * pace + pace // 2
        for gx in range(depth.shape[1]):
            x = gx * pace + pace // 2
            depth[gy, gx] = np.inf
            if not (PATCH_RADIUS_PX <= x < width - PATCH_RADIUS_PX and PATCH_RADIUS_PX <= y < height - PATCH_RADIUS_PX):
                continue
            ray[0] = (x + 0.5 - lenses[k, 2]) / lenses[k, 0]
            ray[1] = (y + 0.5 - lenses[k, 3]) / lenses[k, 1]
            patch = picture[
                y - PATCH_RADIUS_PX : y + PATCH_RADIUS_PX + 1, x - PATCH_RADIUS_PX : x + PATCH_RADIUS_PX + 1
            ]
            best, at = OUTSIDE_DIFFERENCE, -1.0
            for w in planes:
                d = _mates_mismatch(patch, ray, 1 / w, k, mates, turns, shifts, lenses, pictures, step)
                if d < NEARER_DIFFERENCE_RATIO * best - NEARER_DIFFERENCE_MARGIN:
                    best, at = d, w
            if at < 0:
                continue
            middle = at
            for s in range(-REFINED_DEPTHS, REFINED_DEPTHS + 1):
                w = middle + apart * s / REFINED_DEPTHS
                if w <= 0:
                    continue
                d = _mates_mismatch(patch, ray, 1 / w, k, mates, turns, shifts, lenses, pictures, step)
                if d < best:
                    best, at = d, w
            depth[gy, gx] = 1 / at


@numba.njit(**JIT_OPTIONS)
def _patch_texture(patch):
    """Mean difference of a patch from its mean."""
    total = f4(0)
    for q in range(3):
        middle = f4(0)
        for j in range(patch.shape[0]):
            for i in range(patch.shape[1]):
                middle += patch[j, i, q]
        middle /= f4(patch.shape[0] * patch.shape[1])
        for j in range(patch.shape[0]):
            for i in range(patch.shape[1]):
                total += abs(patch[j, i, q] - middle)
    return total / f4(3 * patch.shape[0] * patch.shape[1])


@numba.njit(**JIT_OPTIONS)
def prefer_depths(k, first, last, pace, pictures, lenses, mates, turns, shifts, wanted, depth):
    """Take the wanted depths (h, w) of view k, rows first to last, where they look as good."""
    picture = pictures[k]
    ray, step = np.ones(3), np.array([1 / lenses[k, 0], 1 / lenses[k, 1]])
    for gy in range(first, last):
        y = gy * pace + pace // 2
        for gx in range(depth.shape[1]):
            x = gx * pace + pace // 2
            if not depth[gy, gx] < np.inf:
                continue
            ray[0] = (x + 0.5 - lenses[k, 2]) / lenses[k, 0]
            ray[1] = (y + 0.5 - lenses[k, 3]) / lenses[k, 1]
            patch = picture[
                y - PATCH_RADIUS_PX : y + PATCH_RADIUS_PX + 1, x - PATCH_RADIUS_PX : x + PATCH_RADIUS_PX + 1
            ]
            z, w = depth[gy, gx], wanted[gy, gx]
            found = _mates_mismatch(patch, ray, z, k, mates, turns, shifts, lenses, pictures, step)
            other = _mates_mismatch(patch, ray, w, k, mates, turns, shifts, lenses, pictures, step)
            slack = PLAIN_PATCH_MISMATCH if _patch_texture(patch) < MIN_PATCH_TEXTURE else NEARER_DIFFERENCE_MARGIN
            if NEARER_DIFFERENCE_RATIO * other - slack < found:
                depth[gy, gx] = w


@numba.njit(**JIT_OPTIONS)
def depth_at_point(c, point, depth, pace):
    """Return whether a view shows where a point is, how far ahead that is, and its depth there [m].

    c (16,): camera from world (3 × 4), fx, fy, cx, cy; depth (h, w) [m], one of pace pixels.
    """
    rows, columns = depth.shape
    right, down, ahead = from_camera(c, point[0], point[1], point[2])
    if not ahead > 0:
        return False, ahead, np.inf
    u, v = project_to_pixel(c, right, down, ahead)
    if not (0 <= u / pace < columns and 0 <= v / pace < rows):
        return False, ahead, np.inf
    return True, ahead, depth[int(v / pace), int(u / pace)]


@numba.njit(**JIT_OPTIONS)
def count_support(points, owners, first, last, cameras, depths, pace, near, votes):
    """Count for points first to last the views that see them where they are, and that see past.

    cameras (V, 16): camera from world (3 × 4), fx, fy, cx, cy; owners: the view that each comes from, which is not
    asked; depths (V, h, w) [m], inf: unknown, which is neither; near: relative difference of depths that agree; votes
    (N, 2).
    """
    views = len(depths)
    for i in range(first, last):
        votes[i] = 0
        for k in range(views):
            if k == owners[i]:
                continue
            shown, ahead, z = depth_at_point(cameras[k], points[i], depths[k], pace)
            if not (shown and z < np.inf):
                continue
            if abs(ahead - z) <= near * z:
                votes[i, 0] += 1
            elif ahead < z:
                votes[i, 1] += 1


@numba.njit(**JIT_OPTIONS)
def count_floater_votes(points, widths, first, last, cameras, depths, behind, clear, pace, votes):
    """Ask every view about balls first to last.

    widths: standard deviations [m]; depths, behind (V, h, w): of what is confirmed (else inf), and
    of what encloses everything; clear (V,): what is nearer is not in a picture; pace: pixels of
    the cameras from one depth to the next; votes (N, 5): views that see something there, that see
    past, that may see past, in which it is wider than a pace, and the least depth.
    """
    views, rows, columns = depths.shape
    for i in range(first, last):
        votes[i] = 0
        votes[i, 4] = np.inf
        for k in range(views):
            c = cameras[k]
            right, down, ahead = from_camera(c, points[i, 0], points[i, 1], points[i, 2])
            if not ahead > clear[k]:
                continue
            u, v = project_to_pixel(c, right, down, ahead)
            if not (0 <= u / pace < columns and 0 <= v / pace < rows):
                continue
            z = depths[k, int(v / pace), int(u / pace)]
            if z < np.inf:
                votes[i, 0] += abs(ahead - z) <= CLEAR_DEPTH_DIFFERENCE_RATIO * z
                votes[i, 1] += ahead < (1 - CLEAR_DEPTH_DIFFERENCE_RATIO) * z
            else:
                votes[i, 2] += ahead < (1 - CLEAR_DEPTH_DIFFERENCE_RATIO) * behind[k, int(v / pace), int(u / pace)]
            votes[i, 3] += widths[i] * c[12] > pace * ahead
            votes[i, 4] = min(votes[i, 4], ahead)
