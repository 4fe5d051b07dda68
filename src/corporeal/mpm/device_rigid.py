"""Rigid bodies on the device: six degrees of freedom in double precision."""

from corporeal.mpm.device_grid import block_of, claim_around
from corporeal.mpm.device_layout import (
    DT,
    FULL,
    LOST,
    D,
    Grid,
    Rigid,
    Sheet,
    wp,
)

wp.set_module_options({"enable_backward": False})

SUNK = wp.constant(D(-8.0))
"""A body that is wholly deeper than this in a wall [cells] has left the domain."""


@wp.func
def turned(R: wp.mat33d, spin: wp.vec3d, dt: wp.float64):
    """exp(ω dt) R (Rodrigues' formula)."""
    a = spin * dt
    t = wp.length(a)
    K = wp.skew(a)
    f = D(1.0) - t * t / D(6.0)
    h = D(0.5) - t * t / D(24.0)
    if t > D(1e-6):
        f = wp.sin(t) / t
        h = (D(1.0) - wp.cos(t)) / (t * t)
    return R + f * (K * R) + h * (K * (K * R))


@wp.func
def righted(R: wp.mat33d):
    """Orthonormal rows again (Gram and Schmidt)."""
    x = wp.normalize(wp.vec3d(R[0, 0], R[0, 1], R[0, 2]))
    y = wp.vec3d(R[1, 0], R[1, 1], R[1, 2])
    y = wp.normalize(y - wp.dot(x, y) * x)
    return wp.matrix_from_rows(x, y, wp.cross(x, y))


@wp.func
def inverse_inertia(R: wp.mat33d, rest: wp.mat33d):
    """R I₀⁻¹ Rᵀ [1/(kg m²)]."""
    return R * rest * wp.transpose(R)


@wp.func
def speed_at(r: Rigid, b: int, x: wp.vec3d):
    """V + ω × r [m/s]."""
    return r.speed[b] + wp.cross(r.spin[b], x - r.centre[b])


@wp.func
def softness_at(r: Rigid, b: int, x: wp.vec3d, n: wp.vec3d):
    """1/M + (r × n)ᵀ I⁻¹ (r × n) [1/kg]."""
    lever = wp.cross(x - r.centre[b], n)
    return r.light[b] + wp.dot(lever, r.inertia[b] * lever)


@wp.kernel
def force(r: Rigid, s: Sheet):
    """Give rigid bodies gravity and push."""
    b = wp.tid()
    if r.stiff[b] == 1 and s.flag[FULL] != 2:
        kick = s.kick[b]
        push = s.pushed[b]
        work = wp.dot(push, r.speed[b] + D(0.5) * kick) * s.mass[b]
        wp.atomic_add(s.loss, 2, b % 256, work)
        r.speed[b] = r.speed[b] + kick
        r.spin[b] = r.inertia[b] * r.moment[b]


@wp.kernel
def advance(r: Rigid, s: Sheet):
    """Move and turn: the angular momentum is exact, the turn follows the ω of mid-step."""
    b = wp.tid()
    if r.stiff[b] == 1 and s.flag[FULL] != 2:
        dt = s.clock[DT]
        half = turned(r.turn[b], r.spin[b], D(0.5) * dt)
        middle = inverse_inertia(half, r.rest[b]) * r.moment[b]
        R = righted(turned(r.turn[b], middle, dt))
        r.turn[b] = R
        r.inertia[b] = inverse_inertia(R, r.rest[b])
        r.spin[b] = r.inertia[b] * r.moment[b]
        x = r.centre[b] + dt * r.speed[b]
        good = wp.length(x) < D(1e5) * s.dx and wp.length_sq(r.spin[b]) < D(1e30)
        for w in range(s.planes):
            height = wp.dot(s.plane[w], x) - s.offset[w] + r.radius[b]
            good = good and height > SUNK * s.dx
        if good:
            r.centre[b] = x
        else:
            r.lost[b] = 1
            s.flag[LOST] = 1


@wp.kernel
def follow(r: Rigid, g: Grid, s: Sheet, stride: int):
    """Put the particles of rigid bodies where the bodies are."""
    if s.flag[FULL] == 2:
        return
    for i in range(wp.tid(), r.count, stride):
        b = r.body[i]
        x = (r.centre[b] + r.turn[b] * r.arm[i]) / s.dx
        low = wp.vec3d(wp.floor(x[0] - D(0.5)), wp.floor(x[1] - D(0.5)), wp.floor(x[2] - D(0.5)))
        cell = wp.vec3i(int(low[0]), int(low[1]), int(low[2]))
        r.place[i] = wp.vec3(x - low)
        if not (block_of(cell) == block_of(r.cell[i])):
            r.home[i] = -1
            claim_around(s, g, b, cell)
        r.cell[i] = cell
