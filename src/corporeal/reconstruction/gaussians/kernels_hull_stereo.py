"""Stereo depths between the front and the back of a hull. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_plane_sweep import depth_at_point
from corporeal.reconstruction.gaussians.kernels_project import sample_colour

f4 = np.float32
PATCH_RADIUS_PX = 2
"""Patches are that many pixels wide to each side of their middle."""
PATCH_SIDE_PX = 2 * PATCH_RADIUS_PX + 1
RAY_STEP_CELLS = 0.5
"""Between places on a ray that are looked at [cells]."""
DEPTH_STEP_PX, MAX_DEPTHS_PER_RAY = 0.7, 64
"""Pixels of the widest mate from one depth to the next, and most depths of a ray."""
NO_CORRELATION = f4(-2)
"""Below any correlation."""


@numba.njit(**JIT_OPTIONS)
def hull_chords(first, last, eye, rays, low, side, inside, out):
    """Fill out (N, 2), first to last, with the depths at which rays enter and leave a hull [m].

    rays (N, 3): of one view, with depth 1; low: middle of the hull's first cell; inside (X, Y, Z).
    inf: a ray passes it by.
    """
    shape = np.array(inside.shape)
    for n in range(first, last):
        out[n] = np.inf
        ray = rays[n]
        begin, end = 0.0, np.inf
        for a in range(3):
            if abs(ray[a]) < 1e-12:
                continue
            one = (low[a] - 0.5 * side - eye[a]) / ray[a]
            two = (low[a] + (shape[a] - 0.5) * side - eye[a]) / ray[a]
            begin, end = max(begin, min(one, two)), min(end, max(one, two))
        step = RAY_STEP_CELLS * side / np.sqrt((ray * ray).sum())
        z = begin
        while z < end:
            x = int(np.floor((eye[0] + z * ray[0] - low[0]) / side + 0.5))
            y = int(np.floor((eye[1] + z * ray[1] - low[1]) / side + 0.5))
            w = int(np.floor((eye[2] + z * ray[2] - low[2]) / side + 0.5))
            if 0 <= x < shape[0] and 0 <= y < shape[1] and 0 <= w < shape[2] and inside[x, y, w]:
                out[n, 0], out[n, 1] = min(out[n, 0], z), z
            z += step


@numba.njit(**JIT_OPTIONS)
def _normalise_patch(patch):
    """Take the mean of each channel off a patch (SIDE, SIDE, 3) and return its deviation."""
    total = f4(0)
    for q in range(3):
        middle = f4(0)
        for j in range(PATCH_SIDE_PX):
            for i in range(PATCH_SIDE_PX):
                middle += patch[j, i, q]
        middle /= f4(PATCH_SIDE_PX * PATCH_SIDE_PX)
        for j in range(PATCH_SIDE_PX):
            for i in range(PATCH_SIDE_PX):
                patch[j, i, q] -= middle
                total += patch[j, i, q] * patch[j, i, q]
    return np.sqrt(total / f4(3 * PATCH_SIDE_PX * PATCH_SIDE_PX))


@numba.njit(**JIT_OPTIONS)
def _sample_mate_patch(ray, z, turn, shift, lens, picture, step, patch):
    """Fill in what a mate shows of a patch at depth z that faces its own camera; whether it does.

    turn, shift: mate from the patch's camera; step (2,): a pixel of that camera at depth 1.
    """
    height, width, _ = picture.shape
    for j in range(PATCH_SIDE_PX):
        for i in range(PATCH_SIDE_PX):
            x = z * (ray[0] + (i - PATCH_RADIUS_PX) * step[0])
            y = z * (ray[1] + (j - PATCH_RADIUS_PX) * step[1])
            ahead = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2]
            if not ahead > 1e-6:
                return False
            right = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]
            down = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]
            u = lens[0] * right / ahead + lens[2] - 0.5
            v = lens[1] * down / ahead + lens[3] - 0.5
            if not (0 <= u < width - 1 and 0 <= v < height - 1):
                return False
            sample_colour(picture, u, v, patch[j, i])
    return True


@numba.njit(**JIT_OPTIONS)
def _mate_correlation(own, deviation, ray, z, mates, turns, shifts, lenses, pictures, step, patch):
    """Return the mean of the two best correlations with mates: others may look past something."""
    best, second = NO_CORRELATION, NO_CORRELATION
    for m in range(len(mates)):
        n = mates[m]
        if not _sample_mate_patch(ray, z, turns[m], shifts[m], lenses[n], pictures[n], step, patch):
            continue
        other = _normalise_patch(patch)
        total = f4(0)
        for j in range(PATCH_SIDE_PX):
            for i in range(PATCH_SIDE_PX):
                for q in range(3):
                    total += own[j, i, q] * patch[j, i, q]
        found = total / (f4(3 * PATCH_SIDE_PX * PATCH_SIDE_PX) * deviation * max(other, f4(1e-4)))
        if found > best:
            best, second = found, best
        elif found > second:
            second = found
    return f4(0.5) * (best + second) if second > NO_CORRELATION else NO_CORRELATION


@numba.njit(**JIT_OPTIONS)
def search_depths(k, first, last, places, pictures, lenses, mates, turns, shifts, chord, rule, depth):
    """Fill depth[first:last] of view k's places (N, 2), column and row, with what mates agree on.

    chord (N, 2): depths between which is looked; rule: least deviation of a patch [0–1], least correlation, and by how
    much it must exceed that at the front for something deeper to be accepted. Of what is rejected the front is the
    depth; inf: nothing is known.
    """
    picture = pictures[k]
    height, width, _ = picture.shape
    ray, step = np.ones(3), np.array([1 / lenses[k, 0], 1 / lenses[k, 1]])
    own, patch = (
        np.empty((PATCH_SIDE_PX, PATCH_SIDE_PX, 3), np.float32),
        np.empty((PATCH_SIDE_PX, PATCH_SIDE_PX, 3), np.float32),
    )
    curve, widest = np.empty(MAX_DEPTHS_PER_RAY + 1, np.float32), 0.0
    for m in range(len(mates)):
        widest = max(widest, np.sqrt((shifts[m] * shifts[m]).sum()))
    for n in range(first, last):
        depth[n] = np.inf
        x, y = places[n]
        near, far = chord[n]
        if not far < np.inf:
            continue
        if not (PATCH_RADIUS_PX <= x < width - PATCH_RADIUS_PX and PATCH_RADIUS_PX <= y < height - PATCH_RADIUS_PX):
            continue
        ray[0] = (x + 0.5 - lenses[k, 2]) / lenses[k, 0]
        ray[1] = (y + 0.5 - lenses[k, 3]) / lenses[k, 1]
        own[:] = picture[y - PATCH_RADIUS_PX : y + PATCH_RADIUS_PX + 1, x - PATCH_RADIUS_PX : x + PATCH_RADIUS_PX + 1]
        deviation = _normalise_patch(own)
        if deviation < rule[0]:
            continue
        most = int(np.ceil(lenses[k, 0] * widest * (1 / near - 1 / far) / DEPTH_STEP_PX))
        count = max(1, min(MAX_DEPTHS_PER_RAY, most))
        apart = (1 / far - 1 / near) / count
        for s in range(count + 1):
            curve[s] = _mate_correlation(
                own, deviation, ray, 1 / (1 / near + s * apart),
                mates, turns, shifts, lenses, pictures, step, patch,
            )  # fmt: skip
        at = int(np.argmax(curve[: count + 1]))
        best, between = curve[at], 0.0
        if 0 < at < count and min(curve[at - 1], curve[at + 1]) > NO_CORRELATION:
            bend = 2 * best - curve[at - 1] - curve[at + 1]
            if bend > 1e-6:
                between = 0.5 * (curve[at + 1] - curve[at - 1]) / bend
        if best < rule[1]:
            continue
        deeper = best > curve[0] + rule[2]
        depth[n] = 1 / (1 / near + (at + between) * apart) if deeper else near


@numba.njit(**JIT_OPTIONS)
def count_past_votes(points, first, last, cameras, depths, pace, margin, votes):
    """Count for points first to last the views that see something there, and that see past it.

    cameras (V, 16): ``hull.camera_rows``; depths (V, h, w) [m], inf: unknown; pace: pixels from one depth to the next;
    margin: error of depths [m]; votes (N, 2).
    """
    views = len(depths)
    for n in range(first, last):
        votes[n] = 0
        for k in range(views):
            shown, ahead, z = depth_at_point(cameras[k], points[n], depths[k], pace)
            if not (shown and z < np.inf):
                continue
            votes[n, 0] += abs(ahead - z) <= margin
            votes[n, 1] += ahead < z - margin
