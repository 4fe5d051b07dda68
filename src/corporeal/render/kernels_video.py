"""Kernels of videos: unshadowed pixels, edges, shared light.

Loops compiled by numba, over the P pixels of a band.
"""

import numba
import numpy as np

from corporeal.geometry.srgb import linear_to_srgb
from corporeal.render.kernels_hits import INNER, JIT, LOOP, dot, hash01

MAX_DEPTH_DIFFERENCE_RATIO = 0.02
"""Of the depth: what differs by more is another surface."""
MIN_NORMAL_COSINE = 0.92
"""Cosine between normals of what still counts as one surface."""
MIN_SLOPE = np.float32(1e-12)
HORIZON_SINE = np.float32(1e-4)
"""Sine below the horizon from which on the floor is seen, as ``kernels`` has it."""
EDGE_GREY_LEVELS = 6
"""Grey levels (of 255) between neighbours that are worth more samples."""
EDGE_SUPERSAMPLING = 3
"""How much finer in each direction pixels are looked at where there is an edge."""
EDGE_SAMPLE_OFFSETS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]) / EDGE_SUPERSAMPLING
"""Samples about the middle of such a pixel, which is known: rows and columns."""
TONE_CURVE_STEPS = 1 << 14
"""Parts of the display's curve."""
TONE_CURVE = (255 * linear_to_srgb(np.arange(TONE_CURVE_STEPS + 1) / TONE_CURVE_STEPS)).astype(np.float32)
"""Grey level of every so manieth part of the brightest light, and of none."""
ALBEDO_STEP = 0.1
"""Steps of albedo from which on two triangles are painted apart."""


@numba.njit(**INNER)
def meets_box(o, w, boxes):
    """Whether a ray from ``o`` along ``w`` meets any of the boxes (B, 2, 3): slabs, Kay 1986."""
    for b in range(len(boxes)):
        near, far = np.float32(0), np.float32(np.inf)
        for a in range(3):
            slope = 1 / w[a] if abs(w[a]) > MIN_SLOPE else np.float32(1e12)
            first = (boxes[b, 0, a] - o[a]) * slope
            second = (boxes[b, 1, a] - o[a]) * slope
            near = max(near, min(first, second))
            far = min(far, max(first, second))
        if near <= far:
            return True
    return False


@numba.njit(**JIT)
def bounding_box_of(boxes):
    """Find the one box (1, 2, 3) about boxes (B, 2, 3), to be asked first: most rays miss it."""
    out = boxes[: min(len(boxes), 1)].copy()
    for b in range(1, len(boxes)):
        for a in range(3):
            out[0, 0, a] = min(out[0, 0, a], boxes[b, 0, a])
            out[0, 1, a] = max(out[0, 1, a], boxes[b, 1, a])
    return out


@numba.njit(**LOOP)
def could_meet(o, w, boxes, out):
    """For each ray, whether it could meet what is in the boxes."""
    for k in range(len(o)):
        out[k] = meets_box(o[k], w[k], boxes)


@numba.njit(**JIT)
def dilate_mask(mask, reach):
    """Mark all within ``reach`` rows and columns of what is marked."""
    h, w = mask.shape
    across = np.zeros((h, w), np.bool_)
    for i in range(h):
        last = -reach - 1
        for j in range(w + reach):
            if j < w and mask[i, j]:
                last = j
            if j >= reach and j - last <= 2 * reach:
                across[i, j - reach] = True
    out = np.zeros((h, w), np.bool_)
    for j in range(w):
        last = -reach - 1
        for i in range(h + reach):
            if i < h and across[i, j]:
                last = i
            if i >= reach and i - last <= 2 * reach:
                out[i - reach, j] = True
    return out


@numba.njit(**JIT)
def share_neighbour_light(s, row, column, light, normal, depth, known, out):
    """Give each sample the light of the pixels about it that see the same surface.

    The four around are weighed by nearness. Returns where there is none: True asks for rays of
    its own.

    Args:
        s: What samples met.
        row: Where each of them is among the pixels; may be between them.
        column: The same.
        light: Of the pixels (rows, columns, channels).
        normal: Of the pixels.
        depth: Of the pixels.
        known: Which pixels know their light.
        out: Light of every sample.
    """
    missing = np.zeros(len(s.kind), np.bool_)
    _share_neighbour_light(s, row, column, light, normal, depth, known, out, missing)
    return missing


@numba.njit(**LOOP)
def _share_neighbour_light(s, row, column, light, normal, depth, known, out, missing):
    h, w, channels = light.shape
    for g in range(len(s.kind)):
        i, j = int(np.floor(row[g])), int(np.floor(column[g]))
        a, b = np.float32(row[g] - i), np.float32(column[g] - j)
        total = np.float32(0)
        for di in range(2):
            for dj in range(2):
                y, x = i + di, j + dj
                if y < 0 or y >= h or x < 0 or x >= w or not known[y, x]:
                    continue
                if abs(s.depth[g] - depth[y, x]) >= MAX_DEPTH_DIFFERENCE_RATIO * s.depth[g]:
                    continue
                if dot(s.normal[g], normal[y, x]) <= MIN_NORMAL_COSINE:
                    continue
                weight = (a if di else 1 - a) * (b if dj else 1 - b)
                total += weight
                for c in range(channels):
                    out[g, c] += weight * light[y, x, c]
        missing[g] = total == 0
        if total > 0:
            for c in range(channels):
                out[g, c] /= total


@numba.njit(**INNER)
def filmic(v):
    """Filmic curve (Narkowicz 2016) of one linear value, 0 to 1."""
    v = max(v, np.float32(0)) * np.float32(0.74)
    v = (v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14)
    return min(max(v, 0.0), 1.0)


@numba.njit(**INNER)
def grey_level(v):
    """Grey level of filmic light from a table: off by less than .001 levels."""
    place = min(max(v, np.float32(0)), np.float32(1)) * np.float32(TONE_CURVE_STEPS)
    n = min(int(place), TONE_CURVE_STEPS - 1)
    return TONE_CURVE[n] + (place - np.float32(n)) * (TONE_CURVE[n + 1] - TONE_CURVE[n])


@numba.njit(**LOOP)
def mark_edges(s, picture, active, shape, inner, out):
    """Mark pixels beside which another surface is seen in another colour.

    Args:
        s: What pixels met.
        picture: Filmic light of the pixels (P, 3), 0 to 1.
        active: Which pixels differ from the empty studio (P,).
        shape: Rows and columns.
        inner: The first row to answer for and the one after the last.
        out: The answer (P,).
    """
    w = shape[1]
    for i in range(inner[0], inner[1]):
        for j in range(w):
            g = i * w + j
            for k in range(2):
                y, x = i + k, j + 1 - k
                if y >= shape[0] or x >= w:
                    continue
                q = y * w + x
                if not (active[g] and active[q]):
                    continue
                # Behind what both look through there may be anything.
                clear = s.traits[g, 4] < 1 and s.traits[q, 4] < 1
                if not clear and (s.triangle[g] == s.triangle[q] or _one_surface(s, g, q)):
                    continue
                step = np.float32(0)
                for c in range(3):
                    step = max(step, abs(picture[g, c] - picture[q, c]))
                # The display's curve is steeper where it is dark.
                if step * 255 > EDGE_GREY_LEVELS * (0.2 + min(picture[g, 1], picture[q, 1])):
                    out[g] = True
                    out[q] = True


@numba.njit(**INNER)
def _one_surface(s, g, q):
    """Whether two pixels see one smooth surface of one colour."""
    if s.kind[g] != s.kind[q] or abs(s.depth[g] - s.depth[q]) >= MAX_DEPTH_DIFFERENCE_RATIO * s.depth[g]:
        return False
    far = np.float32(0)
    for c in range(3):
        far = max(far, abs(s.albedo[g, c] - s.albedo[q, c]))
    return dot(s.normal[g], s.normal[q]) > MIN_NORMAL_COSINE and far < ALBEDO_STEP


@numba.njit(**LOOP)
def tone_map(light, index, out):
    """Filmic light of some pixels."""
    for g in index:
        for c in range(3):
            out[g, c] = filmic(light[g, c])


@numba.njit(**LOOP)
def tone_map_means(light, index, out):
    """Replace the filmic light of some pixels by its mean with the samples about them."""
    count = len(EDGE_SAMPLE_OFFSETS)
    for k in range(len(index)):
        for c in range(3):
            total = out[index[k], c]
            for n in range(count):
                total += filmic(light[k * count + n, c])
            out[index[k], c] = total / (count + 1)


@numba.njit(**LOOP)
def write_srgb(picture, wanted, row, size, first, out):
    """Write pixels in sRGB, 0 to 255, with a faint vignette and a fixed grain.

    Args:
        picture: Filmic light of a band (P, 3).
        wanted: Not 0 where a pixel is to be written (P,).
        row: The picture's row that the band begins with.
        size: Of the picture: width, height.
        first: The picture's first row to be written and the one after the last.
        out: The picture (height, width, 3).
    """
    width, height = size
    for i in range(first[0], first[1]):
        y = 2 * i / (height - 1) - 1
        for j in range(width):
            g = (i - row) * width + j
            if not wanted[g]:
                continue
            x = 2 * j / (width - 1) - 1
            rim = min(max(x * x + y * y - 0.5, 0.0), 2.0) / 1.5
            grain = hash01(i, j) - np.float32(0.5)
            for c in range(3):
                v = picture[g, c] * np.float32(1 - 0.10 * rim)
                out[i, j, c] = np.uint8(min(max(grey_level(v) + 0.5 + 0.9 * grain, 0.0), 255.0))


@numba.njit(**INNER)
def pixel_direction(eye, frame, tangent, size, row, column, e):
    """Write the unit direction of a place in the picture."""
    width, height = size
    up = (1 - (row + 0.5) / height * 2) * tangent
    right = ((column + 0.5) / width * 2 - 1) * tangent * width / height
    length = np.sqrt(right * right + up * up + 1)
    for a in range(3):
        e[a] = (right * frame[0, a] + up * frame[1, a] - frame[2, a]) / length


@numba.njit(**LOOP)
def finer_rays(eye, frame, tangent, size, block, pixels, o, d, row, column):
    """Origins, directions and places of the samples about the middle of some pixels.

    Args:
        eye: Where the camera is [m].
        frame: Its axes.
        tangent: Of half its field of view.
        size: Of the picture: width, height.
        block: What part of it pixels are numbered in: first row, first column, columns.
        pixels: Their numbers (N,).
        o: Origins (N × ``len(ABOUT)``, 3).
        d: Unit directions.
        row: Of each sample, from the first row on.
        column: From the first column on.
    """
    first, left, columns = block
    count = len(EDGE_SAMPLE_OFFSETS)
    for k in range(len(pixels)):
        i, j = pixels[k] // columns, pixels[k] % columns
        for n in range(count):
            m = k * count + n
            row[m], column[m] = i + EDGE_SAMPLE_OFFSETS[n, 0], j + EDGE_SAMPLE_OFFSETS[n, 1]
            y, x = first + i + EDGE_SAMPLE_OFFSETS[n, 0], left + j + EDGE_SAMPLE_OFFSETS[n, 1]
            pixel_direction(eye, frame, tangent, size, y, x, d[m])
            for a in range(3):
                o[m, a] = eye[a]
