"""Light at the hits of a video's pixels: sparse sampling and sharing.

One pixel asks in each row and column of 4 × 4; the others take their neighbours' light. The 36 that ask in 12 × 12
pixels look along as many different directions, and it is 12 × 12 pixels that light is smoothed over: wherever these
begin, each direction is in them once. Loops compiled by numba.
"""

import numba
import numpy as np

from corporeal.render.kernels_hits import HIT_NOTHING, HIT_OBJECT, INNER, JIT, LOOP, dot
from corporeal.render.kernels_light import (
    GLOSSY_ROUGHNESS,
    SHARP_MIRROR_ROUGHNESS,
    add_open_ray,
    begin_sun_ray,
    mirror_direction,
    on_sphere,
    sky_direction,
    studio_radiance,
    sun_tangents,
)
from corporeal.render.kernels_video import MAX_DEPTH_DIFFERENCE_RATIO, MIN_NORMAL_COSINE, bounding_box_of, meets_box

LIGHT_CHANNELS_PADDED = 8
"""Channels of light, one more than there are: loops over them fill whole registers."""
DIRECTION_SETS = 36
"""Directions of pixels that ask."""
SUN_RAYS = 2
"""Rays to the sun of each: its shadows are the sharpest of all light that is smoothed."""
GRAZING_SKY_FRACTION = 0.04
"""Of the light of the sky that comes from right above the horizon, and is taken from higher up: shadows of so little
would reach far over the floor."""
MIN_LIKE_NEIGHBOURS = 4
"""Neighbours of the same surface whose light is a pixel's, too."""


@numba.njit(**INNER)
def sampled_column(row):
    """Which of every four pixels in a row asks for light: one in each row and column of 4 × 4."""
    return (2 * row + row % 4 // 2) % 4


@numba.njit(**INNER)
def is_sampled_pixel(row, column):
    """Whether a pixel asks for light."""
    return column % 4 == sampled_column(row)


@numba.njit(**LOOP)
def mark_sampled_pixels(s, on, known, first, out):
    """Mark the pixels that ask for light: every fourth one, and what has few alike about it.

    Args:
        s: What pixels met.
        on: Pixels that met something.
        known: Which pixels were looked at (rows, columns).
        first: The picture's row and column of the first one.
        out: Marks (P,).
    """
    h, w = known.shape
    row, column = first
    for g in on:
        i, j = g // w, g % w
        if is_sampled_pixel(row + i, column + j):
            out[g] = True
            continue
        alike = 0
        for y in range(max(i - 2, 0), min(i + 2, h)):
            x = j - 2 + (sampled_column(row + y) - column - j + 2) % 4
            if x < 0 or x >= w or not known[y, x]:
                break
            q = y * w + x
            near = abs(s.depth[g] - s.depth[q]) < MAX_DEPTH_DIFFERENCE_RATIO * s.depth[g]
            if s.kind[q] == HIT_NOTHING or not near or dot(s.normal[g], s.normal[q]) <= MIN_NORMAL_COSINE:
                break
            alike += 1
        out[g] = alike < MIN_LIKE_NEIGHBOURS


@numba.njit(**INNER)
def direction_set_of(row, column):
    """Which of ``DIRECTION_SETS`` directions a pixel looks along: 4 in each tile of 4 × 4, in 3 × 3 tiles."""
    tile = (row // 4 % 3) * 3 + column // 4 % 3
    return tile * 4 + row % 4


@numba.njit(**JIT)
def sky_points(count):
    """Points of the sphere (count, 3) that make directions to the sky.

    The R2 sequence (Roberts 2018) spreads them.
    """
    out = np.empty((count, 3))
    for q in range(count):
        u, v = (q * 0.7548776662 + 0.37) % 1, (q * 0.5698402910 + 0.71) % 1
        on_sphere(u * (1 - GRAZING_SKY_FRACTION), v, out[q])
    return out


@numba.njit(**JIT)
def sun_directions(lamps, count):
    """Directions to places on the sun's disc (count, 3)."""
    e, out = np.empty(3, np.float32), np.empty((count, 3), np.float32)
    h = sun_tangents(lamps.sun, e)
    for q in range(len(out)):
        r = np.sqrt((q * 0.7548776662 + 0.29) % 1) * lamps.softness
        phi = 2 * np.pi * ((q * 0.5698402910 + 0.83) % 1)
        x, y = r * np.cos(phi), r * np.sin(phi)
        length = np.sqrt(1 + r * r)
        for a in range(3):
            out[q, a] = (lamps.sun[a] + x * e[a] + y * h[a]) / length
    return out


@numba.njit(**LOOP)
def direction_sets(row, column, out):
    """Write which of ``DIRECTION_SETS`` sets of directions each pixel looks along."""
    for k in range(len(row)):
        q = direction_set_of(row[k], column[k])
        # Tiles beside one another look at parts of sky and sun that are far apart.
        out[k] = q % 4 * 9 + q // 4


@numba.njit(**JIT)
def queue_light_rays(s, index, number, pixel, lamps, ways, counts, boxes, o, w, ray, asker, light):
    """Add the light of all rays that meet no box; write down the others, to be cast.

    Args:
        s: What samples met.
        index: Those that ask (N,).
        number: Which set of directions each looks along (N,).
        pixel: What its dice hang on (N,).
        lamps: The studio.
        ways: Points of the sphere (sets × C, 3) and directions to the sun (sets × D, 3): see ``sky_points`` and
            ``sun_directions``.
        counts: C and D.
        boxes: About all that can be met (B, 2, 3) [m].
        o: Origins of rays (R, 3), room for N × (C + D) and one more.
        w: Their directions.
        ray: Their dice.
        asker: Of each ray, whose it is among N; those to the sun are counted from N on.
        light: What arrived (N, channels).

    Returns:
        How many rays are to be cast.
    """
    hull = bounding_box_of(boxes)
    return _queue_light_rays(s, index, number, pixel, lamps, ways, counts, (hull, boxes), o, w, ray, asker, light)


@numba.njit(**LOOP)
def _queue_light_rays(s, index, number, pixel, lamps, ways, counts, boxes, o, w, ray, asker, light):
    """As ``queue_light_rays``; ``boxes``: the one about all first."""
    points, suns = ways
    skies, many_suns = counts
    gap, share = np.float32(2e-4 * lamps.size), np.float32(1 / skies)
    hull, parts = boxes
    many, n = len(index), 0
    for k in range(many):
        g, first = index[k], number[k]
        for m in range(skies):
            sky_direction(s, g, points[first * skies + m], w[n])
            for a in range(3):
                o[n, a] = s.point[g, a] + gap * s.flat[g, a]
            if meets_box(o[n], w[n], hull) and meets_box(o[n], w[n], parts):
                ray[n], asker[n] = pixel[k] + m, k
                n += 1
            else:
                add_open_ray(s, g, w[n], lamps, share, light[k])
        for m in range(many_suns):
            if not begin_sun_ray(s, g, lamps, o[n]):
                break
            for a in range(3):
                w[n, a] = suns[first * many_suns + m, a]
            if meets_box(o[n], w[n], hull) and meets_box(o[n], w[n], parts):
                ray[n], asker[n] = pixel[k] + m, many + k
                n += 1
            else:
                light[k, 3] += np.float32(1 / many_suns)
    return n


@numba.njit(**JIT)
def surface_directions(s, count, w):
    """Write all directions that pixels of one surface look along (WAYS × count, 3)."""
    points = sky_points(DIRECTION_SETS * count)
    for q in range(len(points)):
        sky_direction(s, 0, points[q], w[q])


@numba.njit(**LOOP)
def add_unblocked_light(s, index, w, asker, free, lamps, counts, light):
    """Add the light of rays that were cast and got away; see ``queue_light_rays``."""
    share, sun = np.float32(1 / counts[0]), np.float32(1 / max(counts[1], 1))
    many = len(index)
    for n in range(len(free)):
        if not free[n]:
            continue
        k = asker[n]
        if k < many:
            add_open_ray(s, index[k], w[n], lamps, share, light[k])
        else:
            light[k - many, 3] += sun


@numba.njit(**LOOP)
def queue_mirror_rays(s, index, number, d, lamps, soft, o, w, asker, light):
    """Write what samples mirror of the studio; return how many may mirror objects, too.

    Those rays are written down as in ``queue_light_rays``. Sharp mirrors follow rays of their own; what mirrors the
    studio only is left out where it is not asked for (``soft``).
    """
    gap, n = np.float32(2e-4 * lamps.size), 0
    for k in range(len(index)):
        g = index[k]
        rough, thing = s.traits[g, 1], s.kind[g] == HIT_OBJECT
        if thing and rough <= SHARP_MIRROR_ROUGHNESS:
            continue
        mirror_direction(s, g, d[g], number[k], w[n])
        if thing and rough < GLOSSY_ROUGHNESS:
            for a in range(3):
                o[n, a] = s.point[g, a] + gap * s.flat[g, a]
            asker[n] = k
            n += 1
        elif soft:
            studio_radiance(w[n], max(rough - 0.15, 0.0) ** 2, lamps, light[k, 4:7])
    return n


@numba.njit(**LOOP)
def mean_over_like(data, normal, depth, on, has, steps, stride, total, out, had):
    """Mean over like pixels that have light; ``stride`` (rows, columns) says which way."""
    h, w = on.shape
    for i in range(h):
        for j in range(w):
            if not on[i, j]:
                continue
            weight = np.float32(0)
            for c in range(LIGHT_CHANNELS_PADDED):
                total[c] = 0
            for step in steps:
                y, x = i + step * stride[0], j + step * stride[1]
                if y < 0 or y >= h or x < 0 or x >= w or not has[y, x]:
                    continue
                alike = step == 0 or (
                    abs(depth[i, j] - depth[y, x]) < 0.02 and dot(normal[i, j], normal[y, x]) > MIN_NORMAL_COSINE
                )
                if alike:
                    weight += 1
                    for c in range(LIGHT_CHANNELS_PADDED):
                        total[c] += data[y, x, c]
            had[i, j] = weight > 0
            if weight > 0:
                share = 1 / weight
                for c in range(LIGHT_CHANNELS_PADDED):
                    out[i, j, c] = share * total[c]


@numba.njit(**JIT)
def smooth_shared_light(data, normal, depth, on, has, spare):
    """Mean over 4 pixels down, 4 across, then once more over thrice that, of like surfaces.

    Args:
        data: Light of the pixels that have any; then that of all (rows, columns, ``LIGHT_CHANNELS_PADDED``).
        normal: Of what pixels met.
        depth: Its logarithm.
        on: Which of them met something.
        has: Which of them have light; then all that could be given some.
        spare: Room like ``data``; of NumPy's making, whose large arrays are on large pages.
    """
    had = np.zeros_like(has)
    total = np.empty(LIGHT_CHANNELS_PADDED, np.float32)
    near, far = (-2, -1, 0, 1), (-4, 0, 4)
    mean_over_like(data, normal, depth, on, has, near, (1, 0), total, spare, had)
    mean_over_like(spare, normal, depth, on, had, near, (0, 1), total, data, has)
    mean_over_like(data, normal, depth, on, has, far, (1, 0), total, spare, had)
    mean_over_like(spare, normal, depth, on, had, far, (0, 1), total, data, has)
