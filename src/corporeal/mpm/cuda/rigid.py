"""Rigid bodies on the device: six degrees of freedom in double precision."""

from corporeal.mpm import constants, formulas
from corporeal.mpm.cuda.block_grid import block_of, claim_blocks_around
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    CLOCK_TIME,
    FLAG_FULL,
    FLAG_LOST,
    LOSS_LANES,
    LOSS_PUSH_WORK,
    BlockGrid,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.formulas.one_lane import follow_path, integrate_rotation, inverse_inertia

wp.set_module_options(formulas.formula_options())

MAX_WALL_DEPTH_DX = wp.constant(D(constants.MAX_WALL_DEPTH_DX))
MAX_DISTANCE_FROM_ORIGIN_DX = wp.constant(D(constants.MAX_DISTANCE_FROM_ORIGIN_DX))
VAST = wp.constant(D(constants.VAST))


@wp.func
def speed_at(r: DeviceRigidBodies, b: int, x: wp.vec3d):
    """V + ω × r [m/s]."""
    return r.speed[b] + wp.cross(r.spin[b], x - r.centre[b])


@wp.func
def softness_at(r: DeviceRigidBodies, b: int, x: wp.vec3d, n: wp.vec3d):
    """1/M + (r × n)ᵀ I⁻¹ (r × n) [1/kg]."""
    lever = wp.cross(x - r.centre[b], n)
    return r.light[b] + wp.dot(lever, r.inertia[b] * lever)


@wp.func
def follow_prescribed_path(r: DeviceRigidBodies, s: StepGlobals, b: int):
    """Let a body go where its path says, and book what that takes, but for contacts."""
    dt, R = s.clock[CLOCK_DT], r.turn[b]
    a = follow_path(
        r.path, r.path_first[b], r.path_count[b], r.path_arm[b], s.clock[CLOCK_TIME] + dt, dt, r.centre[b], R
    )
    speed = wp.vec3d(a[0], a[1], a[2])
    spin = wp.vec3d(a[3], a[4], a[5])
    moment = inverse_inertia(R, r.heavy[b]) * spin
    work = s.mass[b] * (wp.length_sq(speed) - wp.length_sq(r.speed[b]))
    work += wp.dot(spin, moment) - wp.dot(r.spin[b], r.moment[b])
    work = D(0.5) * work - s.mass[b] * dt * wp.dot(s.gravity, speed)
    wp.atomic_add(s.loss, LOSS_PUSH_WORK, b % LOSS_LANES, work)
    s.external[b] = s.external[b] + s.mass[b] * (speed - r.speed[b])
    r.speed[b] = speed
    r.spin[b] = spin
    r.moment[b] = moment
    r.heading[b] = wp.mat33d(a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13], a[14])
    return 0


@wp.func
def force_body(r: DeviceRigidBodies, s: StepGlobals, b: int):
    """Give a rigid body gravity and push; steer what has prescribed motion."""
    if r.path_count[b] > 0:
        follow_prescribed_path(r, s, b)
    elif r.stiff[b] == 1:
        kick = s.kick[b]
        push = s.pushed[b]
        work = wp.dot(push, r.speed[b] + D(0.5) * kick) * s.mass[b]
        wp.atomic_add(s.loss, 2, b % 256, work)
        r.speed[b] = r.speed[b] + kick
        r.spin[b] = r.inertia[b] * r.moment[b]
    return 0


@wp.kernel
def advance_rigid(r: DeviceRigidBodies, s: StepGlobals):
    """Move and turn: the angular momentum is exact, the turn follows the ω of mid-step."""
    b = wp.tid()
    if r.stiff[b] == 1 and s.flag[FLAG_FULL] != 2:
        dt = s.clock[CLOCK_DT]
        if r.path_count[b] > 0:
            R = r.heading[b]
            moment = inverse_inertia(R, r.heavy[b]) * r.spin[b]
            work = D(0.5) * wp.dot(r.spin[b], moment - r.moment[b])
            wp.atomic_add(s.loss, LOSS_PUSH_WORK, b % LOSS_LANES, work)
            r.turn[b] = R
            r.moment[b] = moment
        else:
            R = integrate_rotation(r.turn[b], r.rest[b], r.moment[b], r.spin[b], dt)
            r.turn[b] = R
            r.inertia[b] = inverse_inertia(R, r.rest[b])
            r.spin[b] = r.inertia[b] * r.moment[b]
        x = r.centre[b] + dt * r.speed[b]
        good = wp.length(x) < MAX_DISTANCE_FROM_ORIGIN_DX * s.dx and wp.length_sq(r.spin[b]) < VAST
        for w in range(s.planes):
            height = wp.dot(s.plane[w], x) - s.offset[w] + r.radius[b]
            good = good and (height > -MAX_WALL_DEPTH_DX * s.dx or r.path_count[b] > 0)
        if good:
            r.centre[b] = x
        else:
            r.lost[b] = 1
            s.flag[FLAG_LOST] = 1


@wp.kernel
def place_rigid_particles(r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, stride: int):
    """Put the particles of rigid bodies where the bodies are."""
    if s.flag[FLAG_FULL] == 2:
        return
    for i in range(wp.tid(), r.count, stride):
        b = r.body[i]
        x = (r.centre[b] + r.turn[b] * r.arm[i]) / s.dx
        low = wp.vec3d(wp.floor(x[0] - D(0.5)), wp.floor(x[1] - D(0.5)), wp.floor(x[2] - D(0.5)))
        cell = wp.vec3i(int(low[0]), int(low[1]), int(low[2]))
        r.place[i] = wp.vec3(x - low)
        if not (block_of(cell) == block_of(r.cell[i])):
            r.home[i] = -1
            claim_blocks_around(s, g, b, cell)
        r.cell[i] = cell
