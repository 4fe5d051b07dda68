"""Adaptive sampling where shared light is inaccurate.

Light is smoothed over 12 × 12 pixels. Beside contacts, at the edges of shadows and on leaves and bars that is too wide:
there every pixel asks for itself, along one of 16 sets of directions of which 4 × 4 pixels see each once, and its light
is a mean over those. Loops compiled by numba.
"""

import numba
import numpy as np

from corporeal.render.kernels_hits import HIT_OBJECT, INNER, JIT, LOOP, dot
from corporeal.render.kernels_light import (
    GLOSSY_ROUGHNESS,
    LIGHT_CHANNELS,
    SHARP_MIRROR_ROUGHNESS,
    shade_with_view_terms,
    view_terms,
)
from corporeal.render.kernels_sparse_light import LIGHT_CHANNELS_PADDED, mean_over_like
from corporeal.render.kernels_video import MAX_DEPTH_DIFFERENCE_RATIO, MIN_NORMAL_COSINE, filmic, grey_level

COMPARED_OFFSET_PX = 6
"""Pixels to those whose light is compared: half of what light is smoothed over."""
COMPARED_STRIDE_PX = 2
"""Every so manieth pixel of every so manieth row is compared; what it says holds about it."""
MAX_BEND_GREY_LEVELS = 12.0
"""Grey levels (of 255) by which light may bend over twice ``COMPARED_OFFSET_PX`` pixels: what smoothing takes off a
slope that ends there is half of it.
"""
MAX_STEP_GREY_LEVELS = 8.0
"""Grey levels by which light may differ over ``COMPARED_OFFSET_PX`` pixels where its surface ends: smoothing looks to
one side there, and is off by more than what it still shows.
"""
IGNORED_LIGHT_DIFFERENCE = np.float32(0.04)
"""Share of light that may differ without a closer look."""
SET_SIDE_PX = 4
"""Pixels, across and down, that share all directions."""
SAMPLING_SETS = SET_SIDE_PX * SET_SIDE_PX
MAX_SETS_PER_PIXEL = 4
"""Sets of directions that a pixel looks along at most, where few of its surface are about it."""
STRATIFIED_VARIANCE_RATIO = np.float32(0.35)
"""Variance of what 4 × 4 pixels find over that of as many independent rays: their directions are spread evenly."""
NEW_LIGHT_WEIGHT = np.float32(0.8)
"""Weight of new light in what it is compared with: four times as many rays as asked before."""


@numba.njit(**JIT)
def mark_inaccurate_pixels(s, index, d, light, normal, depth, lit, first, lamps, out):
    """Mark pixels that would look otherwise in light that were smoothed less.

    Args:
        s: What pixels met.
        index: Those that are asked about (N,).
        d: Directions from the eye (P, 3).
        light: That arrives at all pixels, smoothed (rows, columns, channels).
        normal: Of what they met (rows, columns, 3).
        depth: Its logarithm (rows, columns).
        lit: Which pixels have light (rows, columns).
        first: The picture's row and column of the first one.
        lamps: The studio.
        out: Marks (rows, columns).
    """
    room = np.empty((5, 3), np.float32), np.empty(LIGHT_CHANNELS_PADDED, np.float32)
    _mark_inaccurate_pixels(s, index, d, light, normal, depth, lit, first, lamps, room, out)


@numba.njit(**LOOP)
def _mark_inaccurate_pixels(s, index, d, light, normal, depth, lit, first, lamps, room, out):
    h, w = lit.shape
    around, other = room
    shown, scratch = around[:3], around[3:]
    for g in index:
        i, j = g // w, g % w
        row, column = first[0] + i, first[1] + j
        if row % COMPARED_STRIDE_PX or (column + row // COMPARED_STRIDE_PX) % COMPARED_STRIDE_PX:
            continue
        mirrors = s.kind[g] == HIT_OBJECT and s.traits[g, 1] > SHARP_MIRROR_ROUGHNESS
        shaded = False
        cos = spot = graze = np.float32(0)
        for axis in range(2):
            count = 0
            for side in range(2):
                away = (2 * side - 1) * COMPARED_OFFSET_PX
                y, x = i + axis * away, j + (1 - axis) * away
                if y < 0 or y >= h or x < 0 or x >= w or not lit[y, x]:
                    continue
                if not _like(normal, depth, i, j, y, x):
                    continue
                count += 1
                if not _differs(light[i, j], light[y, x], mirrors):
                    for c in range(3):
                        shown[count, c] = -1
                    continue
                if not shaded:
                    shaded = True
                    cos = dot(s.normal[g], lamps.sun)
                    spot, graze = view_terms(s.normal[g], d[g], s.traits[g, 1], lamps.sun, scratch[0])
                    for c in range(LIGHT_CHANNELS):
                        other[c] = light[i, j, c]
                    _greys(s, g, cos, spot, graze, other, lamps, scratch[1], shown[0])
                for c in range(LIGHT_CHANNELS):
                    other[c] = light[y, x, c] if c < 4 or mirrors else light[i, j, c]
                _greys(s, g, cos, spot, graze, other, lamps, scratch[1], shown[count])
            if shaded and _largest_bend(shown, count) > (MAX_BEND_GREY_LEVELS if count == 2 else MAX_STEP_GREY_LEVELS):
                out[i, j] = True
                break


@numba.njit(**INNER)
def _like(normal, depth, i, j, y, x):
    """Whether two pixels see the same surface."""
    near = abs(depth[i, j] - depth[y, x]) < MAX_DEPTH_DIFFERENCE_RATIO
    return near and dot(normal[i, j], normal[y, x]) > MIN_NORMAL_COSINE


@numba.njit(**INNER)
def _differs(a, b, mirrors):
    """Whether two lights differ at all."""
    for c in range(LIGHT_CHANNELS if mirrors else 4):
        if abs(a[c] - b[c]) > IGNORED_LIGHT_DIFFERENCE:
            return True
    return False


@numba.njit(**INNER)
def _greys(s, g, cos, spot, graze, light, lamps, sky, out):
    """Write the grey levels that a pixel shows in some light."""
    shade_with_view_terms(cos, spot, graze, s.albedo[g], s.traits[g], light, lamps, sky, out)
    for c in range(3):
        out[c] = grey_level(filmic(out[c]))


@numba.njit(**INNER)
def _largest_bend(shown, count):
    """Largest sum, over red, green and blue, of the steps to neighbours; -1: there is none."""
    most = np.float32(0)
    for c in range(3):
        bend = np.float32(0)
        for k in range(1, count + 1):
            if shown[k, c] >= 0:
                bend += shown[k, c] - shown[0, c]
        most = max(most, abs(bend))
    return most


@numba.njit(**LOOP)
def sets_needed(index, lit, normal, depth, out):
    """Write how many times as many rays pixels need that have few alike about them.

    Args:
        index: Pixels that ask (N,).
        lit: Which pixels have light (rows, columns).
        normal: Of what pixels met (rows, columns, 3).
        depth: Its logarithm (rows, columns).
        out: Sets of directions of each (N,), 1 to ``MAX_SETS_PER_PIXEL``.
    """
    h, w = lit.shape
    half = SET_SIDE_PX // 2
    for k in range(len(index)):
        i, j = index[k] // w, index[k] % w
        count = 0
        for y in range(max(i - half, 0), min(i + half, h)):
            for x in range(max(j - half, 0), min(j + half, w)):
                if lit[y, x] and _like(normal, depth, i, j, y, x):
                    count += 1
        out[k] = min((SAMPLING_SETS + count // 2) // max(count, 1), MAX_SETS_PER_PIXEL)


@numba.njit(**LOOP)
def sampling_sets(who, row, column, out):
    """Write which of ``SAMPLING_SETS`` sets of directions pixels look along: all are in 4 × 4.

    Args:
        who: Pixels, each as often as it asks (N,).
        row: Where in the picture they are (N,).
        column: The same.
        out: Numbers of sets (N,).
    """
    times = 0
    for k in range(len(row)):
        times = times + 1 if k > 0 and who[k] == who[k - 1] else 0
        # Pixels beside one another look at parts of sky and sun that are far apart.
        out[k] = ((row[k] % SET_SIDE_PX * SET_SIDE_PX + column[k] % SET_SIDE_PX) * 7 + times * 5) % SAMPLING_SETS


@numba.njit(**LOOP)
def mean_of_sets(index, times, light, out):
    """Write the mean of what each pixel found.

    Args:
        index: Pixels (N,).
        times: How often each asked (N,).
        light: One answer after the other (sum of ``times``, channels).
        out: Of all pixels (P, channels).
    """
    n = 0
    for k in range(len(index)):
        share = np.float32(1 / times[k])
        for _ in range(times[k]):
            for c in range(LIGHT_CHANNELS):
                out[index[k], c] += share * light[n, c]
            n += 1


@numba.njit(**JIT)
def blend_resampled_light(s, index, light, normal, depth, asks, counts, known, room):
    """Smooth new light over 4 × 4 pixels, and over more where it only differs by its noise.

    Of a mean over few rays and one over many that may be off, the first is taken as far as they differ by more than its
    variance (James and Stein 1961).

    Args:
        s: What pixels met.
        index: Pixels that are to have new light (N,).
        light: What each of them found (rows, columns, channels).
        normal: Of what they met (rows, columns, 3).
        depth: Its logarithm (rows, columns).
        asks: Marks of those that asked (rows, columns).
        counts: Rays of each to the sky and to the sun.
        known: Light that was there before; then what is to be taken (rows, columns, channels).
        room: Thrice as much, the first third of it zeros; see ``kernels_ask.smooth``.
    """
    near, far = (-2, -1, 0, 1), (-4, 0, 4)
    off, wide, spare = room
    _smoothed(light, normal, depth, asks, near, spare)
    wide[:] = light
    _smoothed(wide, normal, depth, asks, far, spare)
    _compared(index, light, known, wide, off)
    _smoothed(off, normal, depth, asks, far, spare)
    _blend_resampled_light(s, index, light, wide, off, counts, known)


@numba.njit(**JIT)
def _smoothed(data, normal, depth, on, steps, spare):
    """Mean over like pixels that asked, so many steps down and across."""
    had, has = np.zeros_like(on), on.copy()
    total = np.empty(LIGHT_CHANNELS_PADDED, np.float32)
    mean_over_like(data, normal, depth, on, has, steps, (1, 0), total, spare, had)
    mean_over_like(spare, normal, depth, on, had, steps, (0, 1), total, data, has)


@numba.njit(**LOOP)
def _compared(index, light, known, wide, off):
    """Mix old light into the wide mean; write by how much new light is off it, squared."""
    w = light.shape[1]
    for g in index:
        i, j = g // w, g % w
        for c in range(LIGHT_CHANNELS):
            wide[i, j, c] = NEW_LIGHT_WEIGHT * wide[i, j, c] + (1 - NEW_LIGHT_WEIGHT) * known[i, j, c]
            off[i, j, c] = (light[i, j, c] - wide[i, j, c]) ** 2


@numba.njit(**LOOP)
def _blend_resampled_light(s, index, light, wide, off, counts, known):
    w = light.shape[1]
    sky, sun = (
        STRATIFIED_VARIANCE_RATIO / (SAMPLING_SETS * counts[0]),
        STRATIFIED_VARIANCE_RATIO / (SAMPLING_SETS * counts[1]),
    )
    for g in index:
        i, j = g // w, g % w
        noise = sky * (_variance(wide[i, j, 0]) + _variance(wide[i, j, 2]))
        above = _excess_over_noise(noise, off[i, j, 0] + off[i, j, 2])
        bright = _excess_over_noise(sun * _variance(wide[i, j, 3]), off[i, j, 3])
        for c in range(4):
            share = above if c < 3 else bright
            known[i, j, c] = wide[i, j, c] + share * (light[i, j, c] - wide[i, j, c])
        if s.kind[g] == HIT_OBJECT and SHARP_MIRROR_ROUGHNESS < s.traits[g, 1] < GLOSSY_ROUGHNESS:
            for c in range(4, LIGHT_CHANNELS):
                known[i, j, c] = light[i, j, c]


@numba.njit(**INNER)
def _variance(share):
    """Of what gets away or does not, where so much of it does."""
    p = min(max(share, np.float32(0)), np.float32(1))
    return p * (1 - p)


@numba.njit(**INNER)
def _excess_over_noise(noise, found):
    """Share of a squared difference that noise does not explain."""
    return max(1 - noise / max(found, np.float32(1e-9)), np.float32(0))
