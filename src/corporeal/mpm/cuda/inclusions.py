"""Rigid inclusions on the device; twin of ``reference.inclusions``.

Sums of what a frame holds are taken about the frame's centre. While contact is solved the frame stands for the whole:
its centre, mass, inertia, velocity and spin are those of both together.
"""

from corporeal.mpm import constants
from corporeal.mpm.constants import FIELDS_AT_NODE
from corporeal.mpm.cuda.layout import FLAG_BLOCKS, FLAG_FULL, BlockGrid, D, StepGlobals, wp
from corporeal.mpm.cuda.layout_bodies import DeviceBonds, DeviceRigidBodies

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

MIN_FRAME_VOLUME_FRACTION = wp.constant(D(constants.MIN_FRAME_VOLUME_FRACTION))


@wp.func
def place_of(g: BlockGrid, s: StepGlobals, node: int):
    """Where a node is [m]."""
    o = node % 64
    at = g.where[node // 64]
    x = D(4 * at[0] + (o >> 4))
    y = D(4 * at[1] + ((o >> 2) & 3))
    z = D(4 * at[2] + (o & 3))
    return wp.vec3d(x, y, z) * s.dx


@wp.func
def frame_of(g: BlockGrid, h: DeviceBonds, node: int):
    """Which frame holds a node; -1: none."""
    slot = node // 64
    own = g.node[node][0]
    if own > 0.0:
        for k in range(h.count):
            if h.soft[k] == g.field[slot]:
                for q in range(FIELDS_AT_NODE):
                    other = g.partner[FIELDS_AT_NODE * slot + q]
                    if other < 0:
                        break
                    if g.field[other] == h.frame[k]:
                        stiff = D(g.node[64 * other + node % 64][0]) / h.stiff_density[k]
                        soft = D(own) / h.soft_density[k]
                        if stiff > D(0.0) and stiff >= MIN_FRAME_VOLUME_FRACTION * (stiff + soft):
                            return h.frame[k]
    return -1


@wp.kernel
def clear_bonds(h: DeviceBonds, s: StepGlobals):
    """Begin the sums."""
    b = wp.tid()
    h.mass[b] = D(0.0)
    h.lever[b] = wp.vec3d(D(0.0))
    h.momentum[b] = wp.vec3d(D(0.0))
    h.moment[b] = wp.vec3d(D(0.0))
    h.spread[b] = wp.mat33d(D(0.0))


@wp.kernel
def hold_nodes(g: BlockGrid, r: DeviceRigidBodies, h: DeviceBonds, s: StepGlobals, stride: int):
    """Mark the nodes that frames hold, and sum their mass and motion."""
    for i in range(wp.tid(), 64 * s.flag[FLAG_BLOCKS], stride):
        f = frame_of(g, h, i)
        g.held[i] = f + 1
        if f >= 0:
            a = g.node[i]
            m = D(a[0])
            x = place_of(g, s, i) - r.centre[f]
            p = wp.vec3d(D(a[1]), D(a[2]), D(a[3])) * m
            wp.atomic_add(h.mass, f, m)
            wp.atomic_add(h.lever, f, m * x)
            wp.atomic_add(h.momentum, f, p)
            wp.atomic_add(h.moment, f, wp.cross(x, p))
            wp.atomic_add(h.spread, f, m * wp.outer(x, x))


@wp.kernel
def compose_bodies(r: DeviceRigidBodies, h: DeviceBonds, s: StepGlobals):
    """Make one rigid body of every frame and what it holds."""
    b = wp.tid()
    if h.framing[b] == 0 or s.flag[FLAG_FULL] == 2:
        return
    own = s.mass[b]
    total = own + h.mass[b]
    shift = h.lever[b] / total
    common = (own * r.speed[b] + h.momentum[b]) / total
    # About the frame's centre, then about the common one (Steiner).
    spread = h.spread[b] - total * wp.outer(shift, shift)
    one = wp.identity(n=3, dtype=wp.float64)
    inertia = wp.inverse(r.inertia[b]) + wp.trace(spread) * one - spread
    moment = r.moment[b] + h.moment[b] - total * wp.cross(shift, common)
    h.centre[b] = r.centre[b]
    h.inertia[b] = r.inertia[b]
    r.centre[b] = r.centre[b] + shift
    r.light[b] = D(1.0) / total
    r.speed[b] = common
    r.moment[b] = moment
    r.inertia[b] = wp.inverse(inertia)
    r.spin[b] = r.inertia[b] * moment


@wp.kernel
def split_nodes(g: BlockGrid, r: DeviceRigidBodies, h: DeviceBonds, s: StepGlobals, stride: int):
    """Give held nodes the motion of the whole: v = V + ω × r."""
    if s.flag[FLAG_FULL] == 2:
        return
    for i in range(wp.tid(), 64 * s.flag[FLAG_BLOCKS], stride):
        f = g.held[i] - 1
        if f >= 0:
            v = r.speed[f] + wp.cross(r.spin[f], place_of(g, s, i) - r.centre[f])
            u = wp.vec3(v)
            g.node[i] = wp.vec4(g.node[i][0], u[0], u[1], u[2])


@wp.kernel
def split_frames(r: DeviceRigidBodies, h: DeviceBonds, s: StepGlobals):
    """Give frames their own part of it."""
    b = wp.tid()
    if h.framing[b] == 0 or s.flag[FLAG_FULL] == 2:
        return
    r.speed[b] = r.speed[b] + wp.cross(r.spin[b], h.centre[b] - r.centre[b])
    r.centre[b] = h.centre[b]
    r.light[b] = D(1.0) / s.mass[b]
    r.inertia[b] = h.inertia[b]
    r.moment[b] = wp.inverse(h.inertia[b]) * r.spin[b]
