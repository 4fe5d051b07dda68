"""Position, normals and colour at ray hits. Loops compiled by numba.

Arrays of G samples; ``index`` names the samples that a call is about, ray for ray.
"""

from typing import NamedTuple

import numba
import numpy as np

from corporeal.geometry.crease_normals import CREASE_ANGLE_DEG
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.render.packed_scene import ALPHA, CUT, GLOW, METAL, MODE, ROUGH, TEXTURE, TRANSLUCENT, TRANSMIT

JIT = {"nogil": True, "cache": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"}}
LOOP = {**JIT, "_nrt": False}
"""As ``JIT``, of what makes no array. Else every view of an array is counted when it begins and ends, by atomic
operations on a place that all threads share."""
INNER = {**LOOP, "forceinline": True}
"""As ``LOOP``, of what is called in loops: handing over a structure of arrays takes longer than what most of them
do."""
LINEAR_OF_SRGB_BYTE = srgb_to_linear(np.arange(256) / 255).astype(np.float32)
CREASE_COSINE = float(np.cos(np.radians(CREASE_ANGLE_DEG)))
"""Cosine of the largest angle over which made normals are smoothed."""
HIT_NOTHING, HIT_FLOOR, HIT_OBJECT = 0, 1, 2
FLOOR_ROUGHNESS = 0.9


class HitBuffer(NamedTuple):
    """What G rays met (a G-buffer)."""

    kind: np.ndarray
    """(G,) uint8: NOTHING, FLOOR or THING"""
    depth: np.ndarray
    """(G,) float32 [m]"""
    point: np.ndarray
    """(G, 3) float32 [m]"""
    normal: np.ndarray
    """(G, 3) shading normal, towards the eye"""
    flat: np.ndarray
    """(G, 3) the facet's normal, towards the eye"""
    albedo: np.ndarray
    """(G, 3) linear"""
    traits: np.ndarray
    """(G, 6): metallic, roughness, translucency, emission, opacity, transmission"""
    triangle: np.ndarray
    """(G,) int32; -1: none"""


def hit_buffer(count: int) -> HitBuffer:
    """Room for so many."""
    return HitBuffer(
        np.zeros(count, np.uint8),
        np.zeros(count, np.float32),
        *(np.zeros((count, 3), np.float32) for _ in range(4)),
        np.zeros((count, 6), np.float32),
        np.full(count, -1, np.int32),
    )


@numba.njit(**JIT)
def camera_rays(eye, frame, tangent, size, rows, grid):
    """Origins and unit directions of the samples in picture rows [rows[0], rows[1])."""
    width, height = size[0] * grid, size[1] * grid
    first, count = rows[0] * grid, (rows[1] - rows[0]) * grid
    o = np.empty((count * width, 3), np.float32)
    d = np.empty((count * width, 3), np.float32)
    for i in range(count):
        y = (1 - (first + i + 0.5) / height * 2) * tangent
        for j in range(width):
            x = ((j + 0.5) / width * 2 - 1) * tangent * width / height
            k = i * width + j
            length = np.sqrt(x * x + y * y + 1)
            for a in range(3):
                d[k, a] = (x * frame[0, a] + y * frame[1, a] - frame[2, a]) / length
                o[k, a] = eye[a]
    return o, d


@numba.njit(**INNER)
def _bilinear(texels, offset, h, w, x, y, out):
    """Linear RGBA at texel coordinates, repeated beyond the edges."""
    x = x * w - 0.5
    y = y * h - 0.5
    j, i = int(np.floor(x)), int(np.floor(y))
    a, b = np.float32(x - j), np.float32(y - i)
    for c in range(4):
        out[c] = 0
    for di in range(2):
        for dj in range(2):
            weight = (b if di else 1 - b) * (a if dj else 1 - a)
            # Sides are powers of two.
            t = texels[offset + ((i + di) & (h - 1)) * w + ((j + dj) & (w - 1))]
            for c in range(3):
                out[c] += weight * LINEAR_OF_SRGB_BYTE[t[c]]
            out[3] += weight * t[3] * np.float32(1 / 255)


@numba.njit(**INNER)
def sample_texture(look, k, u, v, level, out):
    """Linear RGBA of texture ``k``; level 0 is the finest (pyramid: Williams 1983).

    out: 8 numbers, of which the last four are spare.
    """
    last = 0
    while look.levels[k, last + 1, 1] > 0:
        last += 1
    level = min(max(level, 0.0), last)
    n = int(level)
    share = np.float32(level - n)
    offset, h, w = look.levels[k, n]
    _bilinear(look.texels, offset, h, w, u, v, out)
    if share > 0.02 and n < last:
        more = out[4:]
        offset, h, w = look.levels[k, n + 1]
        _bilinear(look.texels, offset, h, w, u, v, more)
        for c in range(4):
            out[c] += share * (more[c] - out[c])


@numba.njit(**INNER)
def surface_colour(look, tri, u, v, footprint, out):
    """Linear RGBA of triangle ``tri`` at barycentric (u, v); ``footprint`` [m] is a sample's.

    out: as of ``sample_texture``.
    """
    f = look.finish[look.finish_of_triangle[tri]]
    a, b, c = look.triangles[tri]
    w = 1 - u - v
    k = int(f[TEXTURE])
    if k >= 0:
        x = look.uv[a, 0] * w + look.uv[b, 0] * u + look.uv[c, 0] * v
        y = look.uv[a, 1] * w + look.uv[b, 1] * u + look.uv[c, 1] * v
        level = np.log2(max(footprint * look.density[tri], 1e-6))
        sample_texture(look, k, x, y, level, out)
    else:
        for q in range(4):
            out[q] = 1
    for q in range(4):
        tint = look.colours[a, q] * w + look.colours[b, q] * u + look.colours[c, q] * v
        out[q] *= tint * f[q]


@numba.njit(**INNER)
def opacity(f, alpha):
    """Share of the light that a finish keeps for itself; cut-outs are all or nothing."""
    if f[MODE] == 1:
        alpha = 1.0 if alpha >= f[CUT] else 0.0
    elif f[MODE] == 0:
        alpha = 1.0
    elif alpha < 0.02:
        alpha = 0.0
    return alpha * (1 - 0.88 * f[TRANSMIT])


@numba.njit(**INNER)
def _unit(x):
    length = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    if length > 1e-20:
        for a in range(3):
            x[a] /= length
    return length


@numba.njit(**INNER)
def dot(x, y):
    """Scalar product of two 3-vectors."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@numba.njit(**INNER)
def _facet(vertices, tri, d, out):
    """Write a triangle's unit normal, towards the eye; the view itself where it is degenerate."""
    p, q, r = vertices[tri[0]], vertices[tri[1]], vertices[tri[2]]
    e0, e1, e2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    g0, g1, g2 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    out[0] = e1 * g2 - e2 * g1
    out[1] = e2 * g0 - e0 * g2
    out[2] = e0 * g1 - e1 * g0
    length = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    if length == 0 or not np.isfinite(length):
        for a in range(3):
            out[a] = -d[a]
        return
    side = -1.0 if dot(out, d) > 0 else 1.0
    for a in range(3):
        out[a] *= side / length


@numba.njit(**INNER)
def _shading_normal(normals, tri, bary, flat, d, keep, out):
    """Interpolated normal on the facet's side, bent so that the eye sees its front."""
    for a in range(3):
        out[a] = 0
    for c in range(3):
        n = normals[tri[c]]
        side = -1.0 if dot(n, flat) < 0 else 1.0
        for a in range(3):
            out[a] += bary[c] * side * n[a]
    length = _unit(out)
    near = dot(out, flat)
    if not length > 1e-6 or not np.isfinite(length) or near <= 0 or (not keep and near < CREASE_COSINE):
        for a in range(3):
            out[a] = flat[a]
    # Interpolated normals may point away from the eye at silhouettes: bend them back.
    away = min(-dot(out, d) - 0.02, 0.0)
    for a in range(3):
        out[a] += away * d[a]
    _unit(out)


@numba.njit(**INNER)
def _lift(vertices, normals, tri, bary, flat, p):
    """Move a hit from its facet to the smooth surface that the facet stands for.

    Without this, coarse meshes show their facets where light grazes (Hanika 2021, "Hacking the Shadow Terminator", Ray
    Tracing Gems II, chapter 4).
    """
    x, y, z = p[0], p[1], p[2]
    for c in range(3):
        if abs(dot(normals[tri[c]], flat)) < CREASE_COSINE:
            return
    for c in range(3):
        n, q = normals[tri[c]], vertices[tri[c]]
        side = -1.0 if dot(n, flat) < 0 else 1.0
        away = ((x - q[0]) * n[0] + (y - q[1]) * n[1] + (z - q[2]) * n[2]) * side
        if away < 0:
            for a in range(3):
                p[a] -= bary[c] * away * n[a] * side


@numba.njit(**JIT)
def fill_hits(look, vertices, normals, floor, pixel, o, d, prim, u, v, t, index, out):
    """Fill ``out`` at ``index`` from Embree's answers; ``pixel`` is a sample's angle [rad]."""
    room = np.empty(8, np.float32), np.empty(3, np.float32)
    _fill_hit(look, vertices, normals, floor, pixel, o, d, prim, u, v, t, index, room, out)


@numba.njit(**LOOP)
def _fill_hit(look, vertices, normals, floor, pixel, o, d, prim, u, v, t, index, room, out):
    rgba, bary = room
    for k in range(len(index)):
        g = index[k]
        tri = prim[k]
        out.triangle[g] = tri
        if tri < 0:
            _fill_floor_hit(floor, o[k], d[k], g, out)
            continue
        f = look.finish[look.finish_of_triangle[tri]]
        out.kind[g] = HIT_OBJECT
        out.depth[g] = t[k]
        for a in range(3):
            out.point[g, a] = o[k, a] + t[k] * d[k, a]
        corners = look.triangles[tri]
        bary[0], bary[1], bary[2] = 1 - u[k] - v[k], u[k], v[k]
        _facet(vertices, corners, d[k], out.flat[g])
        keep = look.smooth[tri]
        _shading_normal(normals, corners, bary, out.flat[g], d[k], keep, out.normal[g])
        _lift(vertices, normals, corners, bary, out.flat[g], out.point[g])
        grazing = max(-dot(out.flat[g], d[k]), 0.2)
        surface_colour(look, tri, u[k], v[k], t[k] * pixel / np.sqrt(grazing), rgba)
        for a in range(3):
            out.albedo[g, a] = rgba[a]
        out.traits[g, 0] = f[METAL]
        out.traits[g, 1] = min(max(f[ROUGH], 0.02), 1.0)
        out.traits[g, 2] = f[TRANSLUCENT]
        out.traits[g, 3] = f[GLOW]
        out.traits[g, 4] = opacity(f, rgba[ALPHA])
        out.traits[g, 5] = f[TRANSMIT]


@numba.njit(**INNER)
def _fill_floor_hit(floor, o, d, g, out):
    """Meet the endless floor z = floor[3] in the colour floor[:3], or nothing."""
    gap = o[2] - floor[3]
    if d[2] > -1e-4 or gap <= 0:
        out.kind[g] = HIT_NOTHING
        out.traits[g, 4] = 1
        return
    t = -gap / d[2]
    out.kind[g] = HIT_FLOOR
    out.depth[g] = t
    for a in range(3):
        out.point[g, a] = o[a] + t * d[a]
        out.normal[g, a] = 1.0 if a == 2 else 0.0
        out.flat[g, a] = out.normal[g, a]
        out.albedo[g, a] = floor[a]
    out.point[g, 2] = floor[3]
    out.traits[g] = 0
    out.traits[g, 1] = FLOOR_ROUGHNESS
    out.traits[g, 4] = 1


@numba.njit(**JIT)
def needs_own_sample(prim, shape, every):
    """Which samples need a look of their own: one of each block (every × every) of no objects."""
    out = np.ones(len(prim), np.bool_)
    for i in range(0, shape[0], every):
        for j in range(0, shape[1], every):
            plain = True
            for a in range(every):
                for b in range(every):
                    plain = plain and prim[(i + a) * shape[1] + j + b] < 0
            if plain:
                for a in range(every):
                    for b in range(every):
                        out[(i + a) * shape[1] + j + b] = a + b == 0
    return out


@numba.njit(**LOOP)
def copy_block_samples(light, looked, shape, every):
    """Copy each block's one sample to those that had no look of their own."""
    for i in range(shape[0]):
        for j in range(shape[1]):
            if not looked[i * shape[1] + j]:
                k = (i - i % every) * shape[1] + j - j % every
                for c in range(3):
                    light[i * shape[1] + j, c] = light[k, c]


@numba.njit(**INNER)
def hash01(a, b):
    """Draw a fixed number in [0, 1) for two integers (after Jarzynski & Olano 2020, pcg3d)."""
    x = np.uint32(a) * np.uint32(1664525) + np.uint32(1013904223)
    y = np.uint32(b) * np.uint32(22695477) + np.uint32(1)
    x = np.uint32(x + y * np.uint32(747796405))
    x = np.uint32((x ^ (x >> np.uint32(16))) * np.uint32(2246822519))
    x = np.uint32((x ^ (x >> np.uint32(13))) * np.uint32(3266489917))
    x = np.uint32(x ^ (x >> np.uint32(16)))
    return np.float32(x >> np.uint32(8)) * np.float32(1 / 16777216)


@numba.njit(**JIT)
def passes_through(look, prim, u, v, ray, depth):
    """For each ray that met something, whether it goes on: holes always, glass by its share.

    Glass still holds back a third of the light, so that it has a shadow.
    """
    out = np.zeros(len(prim), np.bool_)
    _passes_one(look, prim, u, v, ray, depth, np.empty(8, np.float32), out)
    return out


@numba.njit(**LOOP)
def _passes_one(look, prim, u, v, ray, depth, rgba, out):
    for k in range(len(prim)):
        if prim[k] < 0:
            continue
        f = look.finish[look.finish_of_triangle[prim[k]]]
        if f[MODE] == 0 and f[TRANSMIT] == 0:
            continue
        surface_colour(look, prim[k], u[k], v[k], 0.0, rgba)
        solid = opacity(f, rgba[ALPHA])
        if solid > 0 and f[TRANSMIT] > 0:
            solid = max(solid, np.float32(0.2))
        out[k] = hash01(ray[k], depth + 11) >= solid
