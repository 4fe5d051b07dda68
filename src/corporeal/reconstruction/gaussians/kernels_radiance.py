"""Volume rendering of a grid of density and colour, with gradients. Compiled by numba.

A grid has nodes; between eight of them is a cube. ``row`` (X, Y, Z) says where a node's four numbers are among
``values`` (N, 4): the density's, then the logits of red, green and blue. ``gap`` (X-1, Y-1, Z-1) is 0 in cubes that may
hold something, else how many cubes away the nearest of these is. Lengths are in cubes, but depths along a camera's z. A
camera is a row: world from camera (3 x 3), the eye's place in the grid, fx, fy, cx, cy.
"""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS

f4 = np.float32
SAMPLE_WEIGHT, SAMPLE_BEHIND, SAMPLE_RED, SAMPLE_SLOPE, SAMPLE_DEPTH, SAMPLE_COLUMNS = (0, 1, 2, 5, 6, 7)
"""Columns of a sample: w, the transmittance behind it, three colours, dτ/ds, depth."""
RAY_END_TRANSMITTANCE = f4(1e-4)
"""Transmittance at which a ray ends."""
MAX_EXP_ARGUMENT = f4(20)
"""Numbers beyond which exp is not asked."""
COVERAGE_LOSS_WEIGHT = f4(0.1)
"""How much an error of coverage counts beside one of a colour."""
HALF_F4 = f4(0.5)
FIELD_ADAM_BETA1, FIELD_ADAM_BETA2, FIELD_ADAM_EPSILON = f4(0.9), f4(0.99), f4(1e-12)


@numba.njit(**JIT_OPTIONS)
def _softplus(s):
    """Softplus."""
    return s if s > MAX_EXP_ARGUMENT else np.log(f4(1) + np.exp(s))


@numba.njit(**JIT_OPTIONS)
def _logistic(s):
    """The logistic function."""
    return f4(1) / (f4(1) + np.exp(-min(max(s, -MAX_EXP_ARGUMENT), MAX_EXP_ARGUMENT)))


@numba.njit(**JIT_OPTIONS)
def _aim_ray(c, pixel, width, ray):
    """Set ray to the eye (3) and the way for one unit of depth (3); return that way's length."""
    u = (pixel % width + f4(0.5) - c[14]) / c[12]
    v = (pixel // width + f4(0.5) - c[15]) / c[13]
    length = f4(0)
    for k in range(3):
        ray[k] = c[9 + k]
        ray[3 + k] = c[3 * k] * u + c[3 * k + 1] * v + c[3 * k + 2]
        length += ray[3 + k] * ray[3 + k]
    return np.sqrt(length)


@numba.njit(**JIT_OPTIONS)
def _cube_corners(row, i, j, k, x, y, z, n, rows, shares):
    """Set the rows of a cube's corners and what each has to say at a place inside."""
    for c in range(8):
        a, b, d = c & 1, (c >> 1) & 1, c >> 2
        rows[n, c] = row[i + a, j + b, k + d]
        shares[n, c] = (x if a else f4(1) - x) * (y if b else f4(1) - y) * (z if d else f4(1) - z)


@numba.njit(**JIT_OPTIONS)
def _walk_ray(ray, length, jitter, stride, row, gap, values, samples, rows, shares):
    """Walk along a ray; return how many samples it has and how much light is left."""
    enter, leave = f4(0), f4(1e30)
    for k in range(3):
        if abs(ray[3 + k]) > f4(1e-9):
            a = -ray[k] / ray[3 + k]
            b = (row.shape[k] - 1 - ray[k]) / ray[3 + k]
            enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
        elif not 0 <= ray[k] <= row.shape[k] - 1:
            return 0, f4(1)
    step = stride / length
    t, n, light = enter + jitter * step, 0, f4(1)
    while t < leave and n < len(samples) and light > RAY_END_TRANSMITTANCE:
        x, y, z = ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]
        i = min(max(int(x), 0), row.shape[0] - 2)
        j = min(max(int(y), 0), row.shape[1] - 2)
        k = min(max(int(z), 0), row.shape[2] - 2)
        away = gap[i, j, k]
        if away > 0:
            t += step * f4(1 + int((away - 1) / stride))
            continue
        _cube_corners(row, i, j, k, f4(x - i), f4(y - j), f4(z - k), n, rows, shares)
        s, r, g, b = f4(0), f4(0), f4(0), f4(0)
        for c in range(8):
            e, q = rows[n, c], shares[n, c]
            s += q * values[e, 0]
            r += q * values[e, 1]
            g += q * values[e, 2]
            b += q * values[e, 3]
        behind = light * np.exp(-_softplus(s) * stride)
        samples[n, SAMPLE_WEIGHT], samples[n, SAMPLE_BEHIND] = light - behind, behind
        samples[n, SAMPLE_RED], samples[n, SAMPLE_RED + 1], samples[n, SAMPLE_RED + 2] = (
            _logistic(r),
            _logistic(g),
            _logistic(b),
        )
        samples[n, SAMPLE_SLOPE], samples[n, SAMPLE_DEPTH] = _logistic(s) * stride, t
        light = behind
        n += 1
        t += step
    return n, light


@numba.njit(**JIT_OPTIONS)
def ray_loss_gradient(rays, jitter, background, width, cameras, pictures, masks, grid, gradient, sums):
    """Add the loss's gradient (N, 4) for some rays; sums: Σ of the loss, of Δ², and of samples.

    L = Σ_rays |C - Y|² + COVER (α - M)², Y the pixel before the background.

    rays (R, 2): view and pixel; jitter (R,) in [0, 1); pictures (V, H W, 3) and masks (V, H W) in
    0 … 255; grid: row, gap, values, stride, and the most samples along a ray.
    """
    row, gap, values, stride, most = grid
    samples = np.empty((most, SAMPLE_COLUMNS), np.float32)
    rows, shares = np.empty((most, 8), np.int32), np.empty((most, 8), np.float32)
    ray, slope = np.empty(6, np.float32), np.empty(4, np.float32)
    made, off = np.empty(3, np.float32), np.empty(3, np.float32)
    for r in range(len(rays)):
        view, pixel = rays[r, 0], rays[r, 1]
        length = _aim_ray(cameras[view], pixel, width, ray)
        n, light = _walk_ray(ray, length, jitter[r], stride, row, gap, values, samples, rows, shares)
        cover = masks[view, pixel] / f4(255)
        total = f4(0)
        for q in range(3):
            made[q] = light * background[q]
            for m in range(n):
                made[q] += samples[m, SAMPLE_WEIGHT] * samples[m, SAMPLE_RED + q]
            real = cover * (pictures[view, pixel, q] / f4(255)) + (f4(1) - cover) * background[q]
            d = made[q] - real
            off[q] = f4(2) * d
            total += off[q] * made[q]
            sums[0] += d * d
            sums[1] += d * d
        d = f4(1) - light - cover
        sums[0] += COVERAGE_LOSS_WEIGHT * d * d
        sums[2] += n
        uncover = f4(2) * COVERAGE_LOSS_WEIGHT * d * light
        for m in range(n):
            w = samples[m, SAMPLE_WEIGHT]
            own = f4(0)
            for q in range(3):
                c = samples[m, SAMPLE_RED + q]
                own += c * off[q]
                slope[1 + q] = w * off[q] * c * (f4(1) - c)
            total -= w * own  # what is left is of all that is behind
            slope[0] = (samples[m, SAMPLE_BEHIND] * own - total + uncover) * samples[m, SAMPLE_SLOPE]
            for corner in range(8):
                for q in range(4):
                    gradient[rows[m, corner], q] += shares[m, corner] * slope[q]


@numba.njit(**JIT_OPTIONS)
def adam_nodes(first, last, values, gradients, moments, rate, step):
    """One step of Adam (Kingma and Ba 2015) for nodes that rays have met; gradients become 0.

    gradients (S, N, 4): to be added up; moments (2, N, 4).
    """
    one, two = f4(1) - FIELD_ADAM_BETA1**step, f4(1) - FIELD_ADAM_BETA2**step
    for i in range(first, last):
        for q in range(values.shape[1]):
            g = f4(0)
            for s in range(len(gradients)):
                g += gradients[s, i, q]
                gradients[s, i, q] = 0
            if g == 0:
                continue
            m = FIELD_ADAM_BETA1 * moments[0, i, q] + (f4(1) - FIELD_ADAM_BETA1) * g
            v = FIELD_ADAM_BETA2 * moments[1, i, q] + (f4(1) - FIELD_ADAM_BETA2) * g * g
            moments[0, i, q], moments[1, i, q] = m, v
            values[i, q] -= rate * f4(m / one) / (np.sqrt(f4(v / two)) + FIELD_ADAM_EPSILON)


@numba.njit(**JIT_OPTIONS)
def render_pixels(first, last, camera, width, grid, out):
    """Picture pixels first to last: out (H W, 5): red, green, blue before black, α, depth.

    The depth is where half of the light is lost; inf where less ever is.
    """
    row, gap, values, stride, most = grid
    samples = np.empty((most, SAMPLE_COLUMNS), np.float32)
    rows, shares = np.empty((most, 8), np.int32), np.empty((most, 8), np.float32)
    ray = np.empty(6, np.float32)
    for pixel in range(first, last):
        length = _aim_ray(camera, pixel, width, ray)
        n, light = _walk_ray(ray, length, HALF_F4, stride, row, gap, values, samples, rows, shares)
        out[pixel, :3], out[pixel, 3], out[pixel, 4] = 0, f4(1) - light, np.inf
        for m in range(n):
            behind = samples[m, SAMPLE_BEHIND]
            before = behind + samples[m, SAMPLE_WEIGHT]
            for q in range(3):
                out[pixel, q] += samples[m, SAMPLE_WEIGHT] * samples[m, SAMPLE_RED + q]
            if behind <= HALF_F4 < before:
                # Light falls exponentially within a sample, which begins half a step before it.
                share = np.log(before / HALF_F4) / np.log(before / behind)
                out[pixel, 4] = samples[m, SAMPLE_DEPTH] + (share - HALF_F4) * stride / length


@numba.njit(**JIT_OPTIONS)
def light_sources(pixels, camera, width, grid, least, count, place, weight):
    """Return where the light of some pixels comes from, and how much, where it is not less than least.

    count (R,): entries per pixel; place (R, M, 3), in cubes, and weight (R, M): the first M.
    """
    row, gap, values, stride, most = grid
    samples = np.empty((most, SAMPLE_COLUMNS), np.float32)
    rows, shares = np.empty((most, 8), np.int32), np.empty((most, 8), np.float32)
    ray = np.empty(6, np.float32)
    for r in range(len(pixels)):
        length = _aim_ray(camera, pixels[r], width, ray)
        n, _ = _walk_ray(ray, length, HALF_F4, stride, row, gap, values, samples, rows, shares)
        found = 0
        for m in range(n):
            if samples[m, SAMPLE_WEIGHT] >= least and found < weight.shape[1]:
                weight[r, found] = samples[m, SAMPLE_WEIGHT]
                for k in range(3):
                    place[r, found, k] = ray[k] + samples[m, SAMPLE_DEPTH] * ray[3 + k]
                found += 1
        count[r] = found
