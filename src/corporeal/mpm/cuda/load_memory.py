"""Memory of loads on particles and of rigid inclusions."""

from typing import Any

import numpy as np

from corporeal.mpm.cuda.device_memory import DeviceMemory
from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.cuda.layout_bodies import DeviceBonds, DeviceLoads
from corporeal.mpm.physics import inclusions, wind_pressure
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.problem import Problem
from corporeal.mpm.state import ParticleConstants

NO_TIME_WINDOW = (0.0, -1.0)


def lay_out_loads(memory: DeviceMemory, problem: Problem, matter: ParticleConstants) -> Any:
    """Lay out wind, tethers and joints."""
    bodies, count, out = len(problem.bodies), len(matter.mass), DeviceLoads()
    out.load_impulse = memory.zeros((3, count), wp.float32)
    out.tether_impulse = memory.zeros((3, count), wp.float32)
    out.at = memory.zeros(count, wp.int32)
    for name in ("wind_force", "wind_moment", "force", "moment", "external"):
        setattr(out, name, memory.zeros(bodies, wp.vec3d))
    out.loss = memory.zeros(1, wp.float64)
    _wind(out, memory, problem)
    _faces(out, memory, problem, matter)
    _tethers(out, memory, problem, matter)
    _joints(out, memory, problem, matter)
    out.gripped, out.share = memory.zeros(bodies, wp.int32), memory.zeros(count, wp.float32)
    for name in ("spring", "brake", "grip_mass"):
        setattr(out, name, memory.zeros(bodies, wp.float64))
    for name in ("target", "grip_arm", "hand", "hand_speed"):
        setattr(out, name, memory.zeros(bodies, wp.vec3d))
    return out


def _wind(out: Any, memory: DeviceMemory, problem: Problem) -> None:
    winds = [body.wind for body in problem.bodies]
    air = np.array([w.velocity if w else (0.0, 0.0, 0.0) for w in winds], float)
    window = np.array([(w.start, w.end) if w else NO_TIME_WINDOW for w in winds], float)
    out.air = memory.put(air, wp.vec3d)
    out.gust = memory.put(np.array([w.gust if w else 0.0 for w in winds]), wp.float64)
    out.start, out.end = memory.put(window[:, 0], wp.float64), memory.put(window[:, 1], wp.float64)
    parts = np.stack([wind_pressure.GUST_SHARE, wind_pressure.GUST_FREQUENCY, wind_pressure.GUST_PHASE], axis=1)
    out.octave = memory.put(parts, wp.vec3d)


def _faces(out: Any, memory: DeviceMemory, problem: Problem, matter: ParticleConstants) -> None:
    number, owner, area = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros((0, 3))]
    first = 0
    for b, body in enumerate(problem.bodies):
        if body.wind is not None:
            number.append(first + body.faces.particle)
            owner.append(np.full(len(body.faces.particle), b))
            area.append(body.faces.area)
        first += len(body.position)
    face = np.concatenate(number)
    out.faces = len(face)
    out.face = memory.put(face, wp.int32)
    out.face_body = memory.put(np.concatenate(owner), wp.int32)
    out.area = memory.put(np.concatenate(area), wp.vec3)
    out.arm = memory.put(matter.arm[face], wp.vec3d)
    out.weight = memory.put(matter.mass[face], wp.float32)


def _tethers(out: Any, memory: DeviceMemory, problem: Problem, matter: ParticleConstants) -> None:
    number, holder = [np.zeros(0, int)], [np.zeros(0, int)]
    rate, damping = [np.zeros(0)], [np.zeros(0)]
    first = 0
    for body in problem.bodies:
        tether = body.tether
        if tether is not None and problem.contact == "multi":
            own = np.flatnonzero(tether.rate)
            number.append(first + own)
            holder.append(np.full(len(own), tether.holder))
            rate.append(tether.rate[own])
            damping.append(2.0 * tether.damping * tether.rate[own])
        first += len(body.position)
    tied, held = np.concatenate(number), np.concatenate(holder)
    start = matter.arm[tied] + matter.centre[matter.body[tied]] - matter.centre[held]
    out.tethers = len(tied)
    out.tied, out.holder = memory.put(tied, wp.int32), memory.put(held, wp.int32)
    out.anchor = memory.put(start, wp.vec3d)
    out.rate = memory.put(np.concatenate(rate), wp.float64)
    out.damping = memory.put(np.concatenate(damping), wp.float64)


def _joints(out: Any, memory: DeviceMemory, problem: Problem, matter: ParticleConstants) -> None:
    joints = problem.joints if problem.contact == "multi" else ()
    first = np.array([j.first for j in joints], int)
    second = np.array([j.second for j in joints], int)
    point = np.array([j.point for j in joints], float).reshape(-1, 3)
    out.joints = len(joints)
    out.first, out.second = memory.put(first, wp.int32), memory.put(second, wp.int32)
    out.first_arm = memory.put(point - matter.centre[first], wp.vec3d)
    out.second_arm = memory.put(point - matter.centre[second], wp.vec3d)
    out.stiffness = memory.put(np.array([j.stiffness for j in joints], float), wp.float64)
    out.friction = memory.put(np.array([j.damping for j in joints], float), wp.float64)


def write_grips(out: Any, problem: Problem, matter: ParticleConstants, grips: dict[int, Grip]) -> None:
    """Write what is held from outside, by body, in place of all earlier grips."""
    bodies = len(problem.bodies)
    gripped, share = np.zeros(bodies, np.int32), np.zeros(len(matter.mass), np.float32)
    columns = {name: np.zeros(bodies) for name in ("spring", "brake", "grip_mass")}
    target, arm = np.zeros((bodies, 3)), np.zeros((bodies, 3))
    for b, grip in grips.items():
        gripped[b], columns["grip_mass"][b] = 1, grip.hold.mass
        columns["spring"][b], columns["brake"][b] = grip.stiffness, grip.damping
        target[b], arm[b] = grip.target, grip.hold.arm
        if not problem.bodies[b].rigid:
            share[np.flatnonzero(matter.body == b)[grip.hold.particle]] = grip.hold.share
    columns |= {"gripped": gripped, "target": target, "grip_arm": arm, "share": share}
    for name, values in columns.items():
        getattr(out, name).assign(values)
    out.load_impulse.zero_()
    out.external.zero_()


def lay_out_bonds(memory: DeviceMemory, problem: Problem) -> Any:
    """Lay out rigid inclusions; where two frames could hold a node, the first does."""
    pairs = sorted(problem.bonds) if problem.contact == "multi" else []
    bodies, h = len(problem.bodies), DeviceBonds()
    dense = [
        inclusions.inclusion_and_soft_density(problem.bodies[f], problem.bodies[s], problem.cell) for f, s in pairs
    ]
    density = np.array(dense, float).reshape(-1, 2)
    frame, soft = np.array(pairs, int).reshape(-1, 2).T
    framing = np.zeros(bodies, int)
    framing[frame] = 1
    h.count = len(pairs)
    h.frame, h.soft = memory.put(frame, wp.int32), memory.put(soft, wp.int32)
    h.stiff_density = memory.put(density[:, 0], wp.float64)
    h.soft_density = memory.put(density[:, 1], wp.float64)
    h.framing, h.mass = memory.put(framing, wp.int32), memory.zeros(bodies, wp.float64)
    for name in ("lever", "momentum", "moment", "centre"):
        setattr(h, name, memory.zeros(bodies, wp.vec3d))
    h.spread, h.inertia = memory.zeros(bodies, wp.mat33d), memory.zeros(bodies, wp.mat33d)
    return h
