"""Light at ray hits: sampling, sharing among neighbours, and shading.

Neighbours share what their rays found, so that a pixel gathers dozens of directions: the samples
of each 4 × 4 tile look along different directions, then a filter over tiles shares them (after
Keller & Heidrich 2001, "Interleaved sampling"). Directions depend on the place in the picture
only: a video does not flicker.
"""

from typing import NamedTuple

import numba
import numpy as np

from corporeal.render.kernels_hits import HIT_FLOOR, HIT_OBJECT, INNER, JIT, LOOP, dot, hash01, surface_colour

SHARP_MIRROR_ROUGHNESS = 0.2
"""Roughness up to which each sample follows its own mirrored ray."""
GLOSSY_ROUGHNESS = 0.45
"""Roughness up to which objects are seen mirrored at all."""
LIGHT_CHANNELS = 7
"""Of light: sky above, its height, floor below, sun, mirrored RGB."""


class StudioLamps(NamedTuple):
    """The light of the studio, all float32."""

    sun: np.ndarray
    """(3,) unit, towards the sun"""
    side: np.ndarray
    """(3,) unit, towards the strip light that shiny objects mirror"""
    sun_colour: np.ndarray
    softness: float
    """Angular radius of the sun [rad]: a large softbox rather than a point."""
    zenith: np.ndarray
    horizon: np.ndarray
    floor: np.ndarray
    """(4,): linear colour, height [m]"""
    backdrop: np.ndarray
    """(2, 3) top and horizon of the picture's background, linear"""
    size: float
    """Diagonal of the scene [m]: all distances are relative to it."""
    centre: np.ndarray
    """(3,) of the scene [m]"""


@numba.njit(**INNER)
def _normalised(x, y, z, out):
    s = 1 / np.sqrt(max(x * x + y * y + z * z, 1e-20))
    out[0], out[1], out[2] = x * s, y * s, z * s


@numba.njit(**INNER)
def on_sphere(u, v, out):
    """Write the point of (nearly) the unit sphere for a place (u, v) in the unit square."""
    z = 1 - 2 * u
    phi = 2 * np.pi * v
    r = 0.999 * np.sqrt(1 - z * z)
    out[0], out[1], out[2] = r * np.cos(phi), r * np.sin(phi), 0.999 * z


@numba.njit(**INNER)
def sky_direction(s, g, point, w):
    """Write the cosine-weighted direction of a point of the unit sphere: it plus the normal."""
    n = s.normal[g]
    _normalised(n[0] + point[0], n[1] + point[1], n[2] + point[2], w)
    side = dot(w, s.flat[g])
    if side < 0.01:
        # Below the facet, though not below the smooth surface: lift it out.
        f = s.flat[g]
        c = 0.01 - side
        _normalised(w[0] + c * f[0], w[1] + c * f[1], w[2] + c * f[2], w)


@numba.njit(**JIT)
def sky_rays(s, index, cells, lamps, number, count, o, w):
    """One ray to the sky each: the R2 sequence (Roberts 2018) spreads 16 × count over a tile."""
    _sky_rays(s, index, cells, lamps, number, count, np.empty(3), o, w)


@numba.njit(**LOOP)
def _sky_rays(s, index, cells, lamps, number, count, point, o, w):
    gap = np.float32(2e-4 * lamps.size)
    for k in range(len(index)):
        g = index[k]
        q = cells[k] * count + number
        u, v = (q * 0.7548776662 + 0.37) % 1, (q * 0.5698402910 + 0.71) % 1
        on_sphere(u, v, point)
        sky_direction(s, g, point, w[k])
        for a in range(3):
            o[k, a] = s.point[g, a] + gap * s.flat[g, a]


@numba.njit(**INNER)
def add_open_ray(s, g, w, lamps, share, light):
    """Add what a ray sees that gets away: open sky, or the sunlit floor below the horizon."""
    if w[2] > 0:
        light[0] += share
        light[1] += share * w[2]
    else:
        # The floor is darker right under objects.
        gap = min(max((s.point[g, 2] - lamps.floor[3]) / (0.1 * lamps.size), 0), 1)
        light[2] += share * (0.35 + 0.75 * gap)


@numba.njit(**LOOP)
def gather_sky(s, index, w, free, lamps, share, light):
    """Add what one ray per sample saw."""
    for k in range(len(index)):
        if free[k]:
            add_open_ray(s, index[k], w[k], lamps, share, light[k])


@numba.njit(**JIT)
def sun_tangents(sun, e):
    """Write a unit vector across the sun's direction into ``e``; return the one across both."""
    if abs(sun[2]) < 0.999:
        _normalised(sun[1], -sun[0], np.float32(0), e)
    else:
        e[0], e[1], e[2] = 1, 0, 0
    return np.array([sun[1] * e[2] - sun[2] * e[1], sun[2] * e[0] - sun[0] * e[2], sun[0] * e[1] - sun[1] * e[0]])


@numba.njit(**LOOP)
def sun_direction(i, pixel, lamps, e, h, w):
    """Write the direction of one of 16 × 16 places on the sun's disc."""
    sun = lamps.sun
    j = int(hash01(pixel, 7) * 16)
    a = (i % 4 + (j % 4 + hash01(pixel, 5)) / 4) / 4
    b = (i // 4 + (j // 4 + hash01(pixel, 3)) / 4) / 4
    r, phi = np.sqrt(a) * lamps.softness, 2 * np.pi * b
    x, y = r * np.cos(phi), r * np.sin(phi)
    _normalised(sun[0] + x * e[0] + y * h[0], sun[1] + x * e[1] + y * h[1], sun[2] + x * e[2] + y * h[2], w)


@numba.njit(**INNER)
def begin_sun_ray(s, g, lamps, o):
    """Return whether the sun may reach a sample, and write where its ray begins.

    Leaves look through, too.
    """
    front = dot(s.normal[g], lamps.sun) > 0
    gap = np.float32(2e-4 if front else -2e-3) * lamps.size
    for c in range(3):
        o[c] = s.point[g, c] + gap * s.flat[g, c]
    return front or s.traits[g, 2] > 0


@numba.njit(**JIT)
def sun_rays(s, index, cells, pixels, lamps, o, w, ask):
    """One ray each to the sun."""
    e = np.empty(3, np.float32)
    _sun_rays(s, index, cells, pixels, lamps, e, sun_tangents(lamps.sun, e), o, w, ask)


@numba.njit(**LOOP)
def _sun_rays(s, index, cells, pixels, lamps, e, h, o, w, ask):
    for k in range(len(index)):
        sun_direction(cells[k], pixels[k], lamps, e, h, w[k])
        ask[k] = begin_sun_ray(s, index[k], lamps, o[k])


@numba.njit(**INNER)
def mirror_direction(s, g, e, q, w):
    """Write the direction in which a sample mirrors view ``e``, spread by roughness."""
    n, f = s.normal[g], s.flat[g]
    c = 2 * dot(e, n)
    spread = s.traits[g, 1] ** 2 * 0.8
    z = 1 - 2 * ((q * 0.7548776662 + 0.21) % 1)
    phi = 2 * np.pi * ((q * 0.5698402910 + 0.13) % 1)
    r = np.sqrt(1 - z * z)
    x = e[0] - c * n[0] + spread * r * np.cos(phi)
    y = e[1] - c * n[1] + spread * r * np.sin(phi)
    z = e[2] - c * n[2] + spread * z
    down = min(x * f[0] + y * f[1] + z * f[2] - 0.02, 0.0)
    _normalised(x - down * f[0], y - down * f[1], z - down * f[2], w)


@numba.njit(**LOOP)
def mirror_rays(s, index, d, cells, lamps, o, w):
    """Mirrored directions, spread within a tile."""
    gap = np.float32(2e-4 * lamps.size)
    for k in range(len(index)):
        g = index[k]
        mirror_direction(s, g, d[g], cells[k], w[k])
        for a in range(3):
            o[k, a] = s.point[g, a] + gap * s.flat[g, a]


@numba.njit(**INNER)
def _ramp(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


@numba.njit(**INNER)
def studio_radiance(w, blur, lamps, out):
    """Floor, sky, a softbox at the sun and a strip light; blurred for rough surfaces."""
    up = w[2]
    high = min(max(up, 0.0), 1.0)
    box = _ramp((dot(w, lamps.sun) - 0.885 + 0.025 + 0.25 * blur) / (0.05 + 0.5 * blur))
    across = abs(dot(w, lamps.side) - 0.15)
    strip = _ramp((0.22 - across) / (0.06 + blur)) * _ramp((0.75 - abs(up - 0.3)) / (0.1 + blur))
    low = 1 - _ramp(up / (0.12 + blur) + 0.5)
    dark = 0.95 - 0.55 * min(max(-up, 0.0), 1.0)
    for c in range(3):
        sky = lamps.horizon[c] * (1 - high) + 0.75 * lamps.zenith[c] * high
        sky = 0.72 * sky + (1.6 * box + 0.5 * strip) / (1 + 6 * blur)
        out[c] = low * lamps.floor[c] * dark + (1 - low) * sky


@numba.njit(**JIT)
def write_mirrored(look, normals, lamps, s, index, w, prim, u, v, t, light, first):
    """Write what was mirrored into light[:, first:first+3]: objects roughly lit, or the studio."""
    rgba = np.empty(8, np.float32)
    _write_mirrored(look, normals, lamps, s, index, w, prim, u, v, t, light, first, rgba)


@numba.njit(**LOOP)
def _write_mirrored(look, normals, lamps, s, index, w, prim, u, v, t, light, first, rgba):
    for k in range(len(index)):
        rough = s.traits[index[k], 1]
        studio_radiance(w[k], max(rough - 0.15, 0.0) ** 2, lamps, light[k, first : first + 3])
        # A facet must not mirror its own neighbours: the smooth surface it stands for would not.
        if prim[k] < 0 or t[k] < 0.02 * lamps.size:
            continue
        surface_colour(look, prim[k], u[k], v[k], 0.01 * lamps.size, rgba)
        n = normals[look.triangles[prim[k], 0]]
        facing = min(max(dot(n, lamps.sun), 0), 1)
        for c in range(3):
            light[k, first + c] = rgba[c] * (0.45 + 0.7 * facing)


@numba.njit(**INNER)
def _like(n, m, a, b):
    """Whether two samples see the same surface: normals and logarithm of depth."""
    return dot(n, m) > 0.92 and abs(a - b) < 0.02


@numba.njit(**LOOP)
def _pass(data, normal, depth, on, steps, stride, out):
    """Mean over like samples at the given steps; ``stride`` (rows, columns) says which way."""
    h, w, channels = data.shape
    for i in range(h):
        for j in range(w):
            if not on[i, j]:
                continue
            for c in range(channels):
                out[i, j, c] = data[i, j, c]
            weight = np.float32(1)
            for step in steps:
                y, x = i + step * stride[0], j + step * stride[1]
                if y < 0 or y >= h or x < 0 or x >= w or not on[y, x]:
                    continue
                if _like(normal[i, j], normal[y, x], depth[i, j], depth[y, x]):
                    weight += 1
                    for c in range(channels):
                        out[i, j, c] += data[y, x, c]
            for c in range(channels):
                out[i, j, c] /= weight


@numba.njit(**JIT)
def smooth_light(data, normal, depth, on):
    """Mean over 4 samples down, 4 across, then once more over thrice that, of like samples."""
    spare = np.zeros_like(data)
    near, far = (-2, -1, 1), (-4, 4)
    _pass(data, normal, depth, on, near, (1, 0), spare)
    _pass(spare, normal, depth, on, near, (0, 1), data)
    _pass(data, normal, depth, on, far, (1, 0), spare)
    _pass(spare, normal, depth, on, far, (0, 1), data)


@numba.njit(**JIT)
def spread_light(s, index, shape, lattice, normal, depth, on, every, out):
    """Give each sample the light of the nearest lattice cell that sees the same surface.

    Returns where there is none: True asks for rays of its own.
    """
    missing = np.zeros(len(s.kind), np.bool_)
    _spread_light(s, index, shape, lattice, normal, depth, on, every, out, missing)
    return missing


@numba.njit(**LOOP)
def _spread_light(s, index, shape, lattice, normal, depth, on, every, out, missing):
    h, w = lattice.shape[:2]
    for g in index:
        i, j = (g // shape[1]) // every, (g % shape[1]) // every
        log = np.float32(np.log(s.depth[g]))
        found = False
        for ring in range(2):
            for y in range(max(i - ring, 0), min(i + ring + 1, h)):
                for x in range(max(j - ring, 0), min(j + ring + 1, w)):
                    if found or not on[y, x]:
                        continue
                    if _like(s.normal[g], normal[y, x], log, depth[y, x]):
                        found = True
                        for c in range(lattice.shape[2]):
                            out[g, c] = lattice[y, x, c]
        missing[g] = not found


@numba.njit(**INNER)
def shade_one(n, e, tint, traits, light, lamps, room, out):
    """Linear light towards the eye of one sample; multiplied by opacity.

    GGX highlight (Walter 2007), Schlick's Fresnel term, interreflection after Jimenez 2016.

    Args:
        n: Normal.
        e: Unit direction from the eye.
        tint: Albedo, linear.
        traits: As of ``Samples``.
        light: That arrives (CHANNELS).
        lamps: The studio.
        room: Scratch (2, 3).
        out: The light (3,).
    """
    spot, graze = view_terms(n, e, traits[1], lamps.sun, room[0])
    shade_with_view_terms(dot(n, lamps.sun), spot, graze, tint, traits, light, lamps, room[1], out)


@numba.njit(**INNER)
def view_terms(n, e, rough, sun, h):
    """Highlight of a unit sun, and how grazing a sample is seen: what no light changes.

    Args:
        n: Normal.
        e: Unit direction from the eye.
        rough: Roughness.
        sun: Unit direction towards it.
        h: Scratch (3,).
    """
    _normalised(sun[0] - e[0], sun[1] - e[1], sun[2] - e[2], h)
    alpha = max(rough * rough, 0.02)
    nh = min(max(dot(n, h), 0.0), 1.0)
    ggx = alpha**2 / (np.pi * (nh * nh * (alpha**2 - 1) + 1) ** 2)
    return min(ggx * 0.25, 12.0), (1 - min(max(-dot(n, e), 0.0), 1.0)) ** 5


@numba.njit(**INNER)
def shade_with_view_terms(cos, spot, graze, tint, traits, light, lamps, sky, out):
    """Do as ``shade_one`` where ``view_terms`` is known.

    Args:
        cos: Of the angle between normal and sun.
        spot: Highlight of a unit sun.
        graze: Schlick's fifth power.
        tint: Albedo, linear.
        traits: As of ``Samples``.
        light: That arrives (CHANNELS).
        lamps: The studio.
        sky: Scratch (3,).
        out: The light (3,).
    """
    metal, rough, through, emission, solid = traits[0], traits[1], traits[2], traits[3], traits[4]
    for c in range(3):
        sky[c] = (
            light[0] * lamps.horizon[c] + light[1] * (lamps.zenith[c] - lamps.horizon[c]) + light[2] * lamps.floor[c]
        )
    free = min(max((sky[0] + sky[1] + sky[2]) / 3, 0.0), 1.0)
    lit = max(cos, 0.0) + through * max(-cos, 0.0)
    shine = spot * light[3] * max(cos, 0.0)
    hidden = min(max(free * 1.3, 0.1), 1.0)
    for c in range(3):
        albedo = tint[c]
        a, b = 2.0404 * albedo - 0.3324, -4.7951 * albedo + 0.6417
        bounce = ((free * a + b) * free + 2.7552 * albedo + 0.6903) * free
        bounce = max(free, bounce) / max(free, 1e-3)
        f0 = 0.04 * (1 - metal) + albedo * metal
        fresnel = f0 + (max(1 - rough, f0) - f0) * graze
        sunlight = lamps.sun_colour[c] * light[3] * lit * (1.25 / np.pi)
        body = albedo * (0.5 * sky[c] * bounce + sunlight) * (1 - metal) * (1 - fresnel)
        gleam = fresnel * light[4 + c] * hidden + f0 * shine * lamps.sun_colour[c]
        out[c] = solid * (body + albedo * emission) + min(solid * 4, 1.0) * gleam


@numba.njit(**JIT)
def shade(s, index, d, light, lamps, out):
    """Linear light towards the eye [N, 3] of the samples in ``index``; see ``shade_one``."""
    _shade(s, index, d, light, lamps, np.empty((2, 3), np.float32), out)


@numba.njit(**LOOP)
def _shade(s, index, d, light, lamps, room, out):
    for k in range(len(index)):
        g = index[k]
        shade_one(s.normal[g], d[g], s.albedo[g], s.traits[g], light[g], lamps, room, out[g])


@numba.njit(**LOOP)
def backdrop(lamps, rows, height, width, grid, out):
    """Paint the wall behind the floor: a gradient down the picture."""
    for i in range((rows[1] - rows[0]) * grid):
        t = min(1.6 * (rows[0] * grid + i) / (height * grid - 1), 1.0)
        for j in range(width * grid):
            for c in range(3):
                value = lamps.backdrop[0, c] * (1 - t) + lamps.backdrop[1, c] * t
                out[i * width * grid + j, c] = value


@numba.njit(**INNER)
def floor_fade(away, lamps):
    """Share of the floor so far away [m] from the scene that is seen before the backdrop."""
    return min(max(1.35 - away / (3 * lamps.size), 0.0), 1.0) ** 1.5


@numba.njit(**LOOP)
def blend_layers(s, index, near, lamps, behind):
    """Lay nearer light over what is behind it; the floor fades into the backdrop far away."""
    for k in range(len(index)):
        g = index[k]
        if s.kind[g] == HIT_FLOOR:
            x = s.point[g, 0] - lamps.centre[0]
            y = s.point[g, 1] - lamps.centre[1]
            fade = floor_fade(np.sqrt(x * x + y * y), lamps)
            for c in range(3):
                behind[g, c] = near[g, c] * fade + behind[g, c] * (1 - fade)
        elif s.kind[g] == HIT_OBJECT:
            rest = 1 - s.traits[g, 4]
            for c in range(3):
                tint = 1 - s.traits[g, 5] * (1 - s.albedo[g, c])
                behind[g, c] = near[g, c] + rest * tint * behind[g, c]


@numba.njit(**LOOP)
def develop_image(light, rows, size, grid, out):
    """Filmic curve per sample (Narkowicz 2016), mean over each pixel, faint vignette, sRGB.

    A fixed grain of one grey level keeps soft gradients from showing steps.
    """
    width, height = size
    for i in range(rows[0], rows[1]):
        y = 2 * i / (height - 1) - 1
        for j in range(width):
            x = 2 * j / (width - 1) - 1
            rim = min(max(x * x + y * y - 0.5, 0.0), 2.0) / 1.5
            grain = hash01(i, j) - 0.5
            for c in range(3):
                total = 0.0
                for a in range(grid):
                    for b in range(grid):
                        row = (i - rows[0]) * grid + a
                        v = max(light[row * width * grid + j * grid + b, c], 0.0) * 0.74
                        v = (v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14)
                        total += min(max(v, 0.0), 1.0)
                v = total / grid**2 * (1 - 0.10 * rim)
                v = 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
                out[i, j, c] = np.uint8(min(max(v * 255 + 0.5 + 0.9 * grain, 0.0), 255.0))
