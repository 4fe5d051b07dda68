"""Photo-consistency of a surface, vertex by vertex. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import from_camera, project_to_pixel, sample_colour

f4 = np.float32
PATCH_RADIUS_PX = 2
"""Patches are that many pixels wide to each side of their middle."""
PATCH_SIDE_PX = 2 * PATCH_RADIUS_PX + 1
PATCH_SAMPLES = PATCH_SIDE_PX * PATCH_SIDE_PX
MAX_WITNESS_VIEWS, MIN_WITNESS_VIEWS = 8, 3
"""Views that a vertex is looked at from: those that see it most from ahead, and how few will do."""
NO_CORRELATION = f4(-2)
"""Below any correlation."""


@numba.njit(**JIT_OPTIONS)
def nearest_depths(first, last, vertices, triangles, cameras, out):
    """Fill out (V, H, W), views first to last, with the depth of a surface [m]; inf: beside it."""
    _, height, width = out.shape
    seen = np.empty((len(vertices), 3))
    for view in range(first, last):
        out[view] = np.inf
        for n in range(len(vertices)):
            x, y, z = vertices[n]
            right, down, ahead = from_camera(cameras[view], x, y, z)
            seen[n, 2] = ahead
            seen[n, 0], seen[n, 1] = project_to_pixel(cameras[view], right, down, ahead)
        for t in range(len(triangles)):
            a, b, c = seen[triangles[t, 0]], seen[triangles[t, 1]], seen[triangles[t, 2]]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if a[2] <= 0 or b[2] <= 0 or c[2] <= 0 or area == 0:
                continue
            left = max(0, int(np.ceil(min(a[0], b[0], c[0]) - 0.5)))
            right = min(width - 1, int(np.floor(max(a[0], b[0], c[0]) - 0.5)))
            low = max(0, int(np.ceil(min(a[1], b[1], c[1]) - 0.5)))
            high = min(height - 1, int(np.floor(max(a[1], b[1], c[1]) - 0.5)))
            for y in range(low, high + 1):
                for x in range(left, right + 1):
                    u, v = x + 0.5, y + 0.5
                    one = ((b[0] - u) * (c[1] - v) - (b[1] - v) * (c[0] - u)) / area
                    two = ((c[0] - u) * (a[1] - v) - (c[1] - v) * (a[0] - u)) / area
                    three = 1 - one - two
                    if one < 0 or two < 0 or three < 0:
                        continue
                    z = 1 / (one / a[2] + two / b[2] + three / c[2])
                    out[view, y, x] = min(out[view, y, x], z)


@numba.njit(**JIT_OPTIONS)
def _witness_views(x, y, z, normal, cameras, depths, inside, rule, view, cosine):
    """Fill in the views that see a place, most from ahead first; return how many, and a pixel [m].

    rule: least cosine between normal and view; how far before a place something may be [px].
    """
    _, height, width = depths.shape
    count, wide = 0, 0.0
    for k in range(len(cameras)):
        c = cameras[k]
        right, down, ahead = from_camera(c, x, y, z)
        if not ahead > 0:
            continue
        u, v = project_to_pixel(c, right, down, ahead)
        if not (0 <= u < width and 0 <= v < height) or not inside[k, int(v), int(u)]:
            continue
        facing = 0.0
        for a in range(3):
            facing -= normal[a] * (c[a] * right + c[4 + a] * down + c[8 + a] * ahead)
        facing /= np.sqrt(right * right + down * down + ahead * ahead)
        size = ahead / c[12]
        if facing < rule[0] or depths[k, int(v), int(u)] < ahead - rule[1] * size / facing:
            continue
        view[count], cosine[count] = k, facing
        count, wide = count + 1, wide + size
    if count < MIN_WITNESS_VIEWS:
        return 0, 0.0
    order = np.argsort(-cosine[:count])
    view[:count], cosine[:count] = view[:count][order], cosine[:count][order]
    return min(count, MAX_WITNESS_VIEWS), wide / count


@numba.njit(**JIT_OPTIONS)
def _sample_patch(x, y, z, across, along, step, c, picture, patch):
    """Fill in what a view shows of a square patch (SAMPLES, 3); whether all of it is in view."""
    height, width, _ = picture.shape
    r, d, h = from_camera(c, x, y, z)
    # How right, down and ahead grow from one sample to the next.
    rj = step * (c[0] * across[0] + c[1] * across[1] + c[2] * across[2])
    dj = step * (c[4] * across[0] + c[5] * across[1] + c[6] * across[2])
    hj = step * (c[8] * across[0] + c[9] * across[1] + c[10] * across[2])
    ri = step * (c[0] * along[0] + c[1] * along[1] + c[2] * along[2])
    di = step * (c[4] * along[0] + c[5] * along[1] + c[6] * along[2])
    hi = step * (c[8] * along[0] + c[9] * along[1] + c[10] * along[2])
    s = 0
    for j in range(-PATCH_RADIUS_PX, PATCH_RADIUS_PX + 1):
        for i in range(-PATCH_RADIUS_PX, PATCH_RADIUS_PX + 1):
            right, down, ahead = r + j * rj + i * ri, d + j * dj + i * di, h + j * hj + i * hi
            if not ahead > 0:
                return False
            u, v = project_to_pixel(c, right, down, ahead)
            u, v = u - 0.5, v - 0.5
            if not (0 <= u < width - 1 and 0 <= v < height - 1):
                return False
            sample_colour(picture, u, v, patch[s])
            s += 1
    return True


@numba.njit(**JIT_OPTIONS)
def _centre_patch(patch):
    """Take the mean of each channel off a patch; return what is left, squared and summed."""
    total = f4(0)
    for q in range(3):
        middle = f4(0)
        for s in range(PATCH_SAMPLES):
            middle += patch[s, q]
        middle /= f4(PATCH_SAMPLES)
        for s in range(PATCH_SAMPLES):
            patch[s, q] -= middle
            total += patch[s, q] * patch[s, q]
    return total


@numba.njit(**JIT_OPTIONS)
def photo_consistency_curves(first, last, places, normals, cameras, depths, inside, pictures, offsets, rule, curves):
    """Fill curves (N, K), places first to last, with how well views agree that a surface is there.

    That is the mean correlation of all pairs of views of a square patch across the normal, moved along it by each of
    the offsets (K,) [px]; a view weighs by the cosine at which it looks. Colours may differ between views by a factor
    and a shift per channel. UNKNOWN: too few views. depths (V, H, W): of the surface as it is, which says who sees
    what; inside (V, H, W): pixels whose patch is wholly on the object; rule: least cosine, how far before a place
    something may be [px], and least deviation of a patch [0–1].
    """
    view, cosine = np.empty(len(cameras), np.int64), np.empty(len(cameras))
    patch, total = (np.empty((PATCH_SAMPLES, 3), np.float32), np.empty((PATCH_SAMPLES, 3), np.float32))
    across, along = np.empty(3), np.empty(3)
    plain = f4(rule[2] * rule[2] * 3 * PATCH_SAMPLES)
    for n in range(first, last):
        curves[n] = NO_CORRELATION
        x, y, z = places[n]
        normal = normals[n]
        count, step = _witness_views(
            x, y, z, normal, cameras, depths, inside, rule, view, cosine
        )  # fmt: skip
        if count == 0:
            continue
        if abs(normal[0]) < 0.7:
            across[0], across[1], across[2] = 0.0, -normal[2], normal[1]
        else:
            across[0], across[1], across[2] = -normal[2], 0.0, normal[0]
        across /= np.sqrt((across * across).sum())
        along[0] = normal[1] * across[2] - normal[2] * across[1]
        along[1] = normal[2] * across[0] - normal[0] * across[2]
        along[2] = normal[0] * across[1] - normal[1] * across[0]
        for k in range(len(offsets)):
            off = offsets[k] * step
            total[:] = 0
            whole, squares, found = f4(0), f4(0), 0
            for m in range(count):
                picture = pictures[view[m]]
                px, py, pz = x + off * normal[0], y + off * normal[1], z + off * normal[2]
                if not _sample_patch(
                    px, py, pz, across, along, step, cameras[view[m]], picture, patch
                ):  # fmt: skip
                    continue
                power = _centre_patch(patch)
                if power < plain:
                    continue
                weight = f4(cosine[m])
                share = weight / np.sqrt(power)
                found, whole, squares = found + 1, whole + weight, squares + weight * weight
                for s in range(PATCH_SAMPLES):
                    for q in range(3):
                        total[s, q] += share * patch[s, q]
            if found < MIN_WITNESS_VIEWS:
                continue
            both = f4(0)
            for s in range(PATCH_SAMPLES):
                for q in range(3):
                    both += total[s, q] * total[s, q]
            curves[n, k] = (both - squares) / (whole * whole - squares)
