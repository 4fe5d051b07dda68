"""Wind, springs and grips on the device: ``loads``, ``wind``, ``springs`` and ``driving``."""

import math

from corporeal.mpm import constants, formulas
from corporeal.mpm.cuda.channel_rows import cell_at, matrix_at, put_vector, vector_at
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    CLOCK_TIME,
    FLAG_FULL,
    LOSS_PUSH_WORK,
    MATERIAL_BODY,
    D,
    DeviceParticles,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceLoads, DeviceRigidBodies
from corporeal.mpm.cuda.rigid import force_body, speed_at
from corporeal.mpm.formulas.one_lane import grip_spring_impulse, rotation_vector, turned_area, wind_impulse
from corporeal.mpm.physics.wind_pressure import HALF_RHO_C

wp.set_module_options(formulas.formula_options(max_unroll=0))

JOINT_GAP_FRACTION_PER_STEP = wp.constant(D(constants.JOINT_GAP_FRACTION_PER_STEP))
FULL_TURN_RAD = wp.constant(D(2.0 * math.pi))


@wp.kernel
def clear_loads(p: DeviceParticles, l: DeviceLoads, s: StepGlobals, stride: int):
    """Take all loads away, and say where particles are."""
    for i in range(wp.tid(), p.count, stride):
        put_vector(l.load_impulse, i, wp.vec3(0.0))
        put_vector(l.tether_impulse, i, wp.vec3(0.0))
        l.at[p.number[i]] = i
    for b in range(wp.tid(), s.bodies, stride):
        l.wind_force[b] = wp.vec3d(D(0.0))
        l.wind_moment[b] = wp.vec3d(D(0.0))
        l.force[b] = wp.vec3d(D(0.0))
        l.moment[b] = wp.vec3d(D(0.0))
        l.external[b] = wp.vec3d(D(0.0))
        l.hand[b] = wp.vec3d(D(0.0))
        l.hand_speed[b] = wp.vec3d(D(0.0))
    if wp.tid() == 0:
        l.loss[0] = D(0.0)


@wp.func
def gust_signal(l: DeviceLoads, time: wp.float64):
    """Σ a_k sin(2π f_k t + φ_k)."""
    total = D(0.0)
    for k in range(l.octave.shape[0]):
        part = l.octave[k]
        total += part[0] * wp.sin(FULL_TURN_RAD * part[1] * time + part[2])
    return total


@wp.kernel
def apply_wind(p: DeviceParticles, r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals, stride: int):
    """Let the wind press on faces."""
    dt = wp.float32(s.clock[CLOCK_DT])
    time = s.clock[CLOCK_TIME] + D(0.5) * s.clock[CLOCK_DT]
    for k in range(wp.tid(), l.faces, stride):
        b = l.face_body[k]
        if time < l.start[b] or time >= l.end[b]:
            continue
        air = l.air[b] * (D(1.0) + l.gust[b] * gust_signal(l, time))
        if r.stiff[b] == 1:
            arm = r.turn[b] * l.arm[k]
            seen = air - speed_at(r, b, r.centre[b] + arm)
            area = r.turn[b] * wp.vec3d(l.area[k])
            J = wp.vec3d(wind_impulse(HALF_RHO_C, wp.vec3(area), wp.vec3(seen), l.weight[k], dt))
            wp.atomic_add(l.wind_force, b, J)
            wp.atomic_add(l.wind_moment, b, wp.cross(arm, J))
            wp.atomic_add(l.external, b, J)
        else:
            i = l.at[l.face[k]]
            F = wp.identity(n=3, dtype=wp.float32) + matrix_at(p.strain, i)
            if p.table[p.kind[i], 0] > 2.5:
                F = wp.identity(n=3, dtype=wp.float32) + matrix_at(p.motion, i)
            seen_here = wp.vec3(air) - vector_at(p.velocity, i)
            given = wind_impulse(HALF_RHO_C, turned_area(F, l.area[k]), seen_here, l.weight[k], dt)
            for d in range(3):
                wp.atomic_add(l.load_impulse, d, i, given[d])
            wp.atomic_add(l.external, b, wp.vec3d(given))


@wp.func
def position_of(p: DeviceParticles, s: StepGlobals, i: int):
    """Where a particle is [m]."""
    cell = cell_at(p.cell, i)
    return (wp.vec3d(D(cell[0]), D(cell[1]), D(cell[2])) + wp.vec3d(vector_at(p.place, i))) * s.dx


@wp.kernel
def pull_tethered(p: DeviceParticles, r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals, stride: int):
    """Pull tethered particles back; the holder gets the reaction where the particle is."""
    dt = s.clock[CLOCK_DT]
    for k in range(wp.tid(), l.tethers, stride):
        i = l.at[l.tied[k]]
        h = l.holder[k]
        place = position_of(p, s, i) - r.centre[h]
        arm = r.turn[h] * l.anchor[k]
        v = wp.vec3d(vector_at(p.velocity, i)) - r.speed[h] - wp.cross(r.spin[h], arm)
        rate = l.rate[k]
        mass = D(p.mass[i])
        pull = (rate * rate * (place - arm) + l.damping[k] * v) * (-dt)
        wp.atomic_add(l.loss, 0, mass * dt * l.damping[k] * wp.dot(v, v + D(0.5) * pull))
        # Springs bear the weight from the start, so that nothing sags.
        J = mass * (pull - (s.kick[h] - s.pushed[h]))
        put_vector(l.tether_impulse, i, wp.vec3(J))
        wp.atomic_sub(l.force, h, J)
        wp.atomic_sub(l.moment, h, wp.cross(place, J))


@wp.func
def load_rigid(r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals, b: int):
    """Give a rigid body its loads, and book the wind's work at its mean velocity."""
    if r.stiff[b] == 1:
        speed = r.speed[b] + D(0.5) * l.wind_force[b] * r.light[b]
        spin = r.inertia[b] * (r.moment[b] + D(0.5) * l.wind_moment[b])
        work = wp.dot(l.wind_force[b], speed + s.kick[b]) + wp.dot(l.wind_moment[b], spin)
        wp.atomic_add(s.loss, LOSS_PUSH_WORK, b % 256, work)
        r.speed[b] = r.speed[b] + (l.wind_force[b] + l.force[b]) * r.light[b]
        r.moment[b] = r.moment[b] + l.wind_moment[b] + l.moment[b]
        r.spin[b] = r.inertia[b] * r.moment[b]
    return 0


@wp.kernel
def force_rigid(r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals):
    """Let loads and forces act on rigid bodies."""
    b = wp.tid()
    if s.flag[FLAG_FULL] == 2:
        return
    if l.faces > 0 or l.tethers > 0:
        load_rigid(r, l, s, b)
    force_body(r, s, b)


@wp.func
def add_impulse(r: DeviceRigidBodies, b: int, impulse: wp.vec3d, moment: wp.vec3d):
    """Give a rigid body an impulse, and an angular one about its centre."""
    r.speed[b] = r.speed[b] + impulse * r.light[b]
    r.moment[b] = r.moment[b] + moment
    r.spin[b] = r.inertia[b] * r.moment[b]
    return 0


@wp.kernel
def hold_joints(r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals):
    """Keep joints together and spring their turns, one joint after the other."""
    if s.flag[FLAG_FULL] == 2:
        return
    dt = s.clock[CLOCK_DT]
    one = wp.identity(n=3, dtype=wp.float64)
    for k in range(l.joints):
        a = l.first[k]
        c = l.second[k]
        arm_a = r.turn[a] * l.first_arm[k]
        arm_c = r.turn[c] * l.second_arm[k]
        gap = r.centre[c] + arm_c - r.centre[a] - arm_a
        v = r.speed[c] + wp.cross(r.spin[c], arm_c) - r.speed[a] - wp.cross(r.spin[a], arm_a)
        turn = rotation_vector(r.turn[c] * wp.transpose(r.turn[a]))
        X = wp.skew(arm_a)
        Y = wp.skew(arm_c)
        stiff = l.friction[k] + D(0.5) * l.stiffness[k] * dt
        A = (r.light[a] + r.light[c]) * one - X * r.inertia[a] * X - Y * r.inertia[c] * Y
        B = -(X * r.inertia[a]) - Y * r.inertia[c]
        G = r.inertia[a] + r.inertia[c] + one * (D(1.0) / (dt * stiff))
        pulled = -v - gap * (JOINT_GAP_FRACTION_PER_STEP / dt)
        twisted = r.spin[a] - r.spin[c] - turn * (l.stiffness[k] / stiff)
        # Two blocks at once: T from the second row, J from what is left of the first.
        inverse = wp.inverse(G)
        J = wp.inverse(A - B * inverse * wp.transpose(B)) * (pulled - B * inverse * twisted)
        T = inverse * (twisted - wp.transpose(B) * J)
        add_impulse(r, a, -J, -wp.cross(arm_a, J) - T)
        add_impulse(r, c, J, wp.cross(arm_c, J) + T)
        relative = r.spin[c] - r.spin[a]
        l.loss[0] = l.loss[0] + l.friction[k] * dt * wp.length_sq(relative)


@wp.func
def grip_impulse(l: DeviceLoads, b: int, place: wp.vec3d, velocity: wp.vec3d, dt: wp.float64):
    """Impulse of a grip's spring in a step [N s]."""
    away = l.target[b] - place
    return grip_spring_impulse(l.spring[b], l.brake[b], l.grip_mass[b], away, velocity, dt)


@wp.kernel
def measure_grips(p: DeviceParticles, l: DeviceLoads, s: StepGlobals, stride: int):
    """Work out where bodies that bend are held, and how fast that moves."""
    for i in range(wp.tid(), p.count, stride):
        share = D(l.share[p.number[i]])
        if share > D(0.0):
            b = int(p.table[p.kind[i], MATERIAL_BODY])
            wp.atomic_add(l.hand, b, share * position_of(p, s, i))
            wp.atomic_add(l.hand_speed, b, share * wp.vec3d(vector_at(p.velocity, i)))


@wp.kernel
def apply_grips(p: DeviceParticles, l: DeviceLoads, s: StepGlobals, stride: int):
    """Let grips pull on bodies that bend."""
    for i in range(wp.tid(), p.count, stride):
        share = D(l.share[p.number[i]])
        if share > D(0.0):
            b = int(p.table[p.kind[i], MATERIAL_BODY])
            J = share * grip_impulse(l, b, l.hand[b], l.hand_speed[b], s.clock[CLOCK_DT])
            put_vector(l.load_impulse, i, vector_at(l.load_impulse, i) + wp.vec3(J))
            wp.atomic_add(l.external, b, J)


@wp.kernel
def apply_rigid_grips(r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals):
    """Let grips pull on rigid bodies, and book their work at the mean velocity."""
    b = wp.tid()
    if l.gripped[b] == 1 and r.stiff[b] == 1 and s.flag[FLAG_FULL] != 2:
        arm = r.turn[b] * l.grip_arm[b]
        before = speed_at(r, b, r.centre[b] + arm) - s.kick[b]
        J = grip_impulse(l, b, r.centre[b] + arm, before, s.clock[CLOCK_DT])
        add_impulse(r, b, J, wp.cross(arm, J))
        moving = speed_at(r, b, r.centre[b] + arm) - s.kick[b]
        wp.atomic_add(s.loss, LOSS_PUSH_WORK, b % 256, wp.dot(J, D(0.5) * (before + moving) + s.kick[b]))
        l.external[b] = l.external[b] + J
