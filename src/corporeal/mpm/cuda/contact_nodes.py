"""Contact detection on the device: nodes with several fields, or near a plane.

Same rules as ``reference.contact.find``.
"""

from corporeal.mpm import formulas
from corporeal.mpm.constants import (
    FIELDS_AT_NODE,
    LIQUID_WALL_REACH_DX,
    MAX_WETTED_FACES,
    STICKING_FRICTION,
    VAST,
    WALL_REACH,
)
from corporeal.mpm.cuda.block_grid import block_of, find_block
from corporeal.mpm.cuda.layout import (
    FLAG_BLOCKS,
    FLAG_FULL,
    FLAG_MEETS,
    FLAG_NORMALS_KEPT,
    FLAG_STIFF,
    FLAG_TOUCHES,
    BlockGrid,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts

wp.set_module_options(formulas.formula_options(max_unroll=0))


@wp.func
def height_of(s: StepGlobals, w: int, at: wp.vec3i):
    """Height of a node above a plane [cells]."""
    n = wp.vec3(s.plane[w])
    x = wp.vec3(float(at[0]), float(at[1]), float(at[2]))
    return wp.dot(n, x) - wp.float32(s.offset[w] / s.dx)


@wp.func
def enter_field(c: DeviceContacts, g: BlockGrid, r: DeviceRigidBodies, k: int, node: int):
    """Enter one field's node into a meeting."""
    n = c.number[k]
    e = k * FIELDS_AT_NODE + n
    f = g.field[node // 64]
    a = g.node[node]
    c.field[e] = f
    c.slot[e] = node
    c.mean[e] = wp.vec3(0.0)
    c.outward[e] = wp.vec3(0.0)
    c.velocity[e] = wp.vec3d(D(a[1]), D(a[2]), D(a[3]))
    c.light[e] = D(1.0) / D(a[0])
    c.number[k] = n + 1
    g.meet[node] = e + 1
    if r.stiff[f] == 1:
        c.stiff[k] = 1
    return 0


@wp.func
def is_felt(g: BlockGrid, node: int):
    """Whether a field is felt at a node: a held one is its frame's."""
    return g.node[node][0] > 0.0 and g.held[node] == 0


@wp.func
def slides_along_plane(c: DeviceContacts, r: DeviceRigidBodies, field: int, other: int):
    """Whether a field is a liquid that slides along a plane."""
    return r.pours[field] == 1 and c.friction[field, other] < D(STICKING_FRICTION)


@wp.func
def is_dragged(c: DeviceContacts, r: DeviceRigidBodies, field: int, other: int):
    """Whether a field is a liquid on which a body or a plane drags by a viscous stress."""
    return r.pours[field] == 1 and c.friction[field, other] >= D(STICKING_FRICTION)


@wp.func
def curve_of(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Flow curve of the liquid of a contact, at its wall."""
    liquid = c.fa[t]
    if c.fc[t] < s.bodies:
        if r.pours[c.fc[t]] == 1:
            liquid = c.fc[t]
    return r.flows_by[liquid]


@wp.func
def is_stiff(r: DeviceRigidBodies, s: StepGlobals, field: int):
    """Whether a side is a rigid body or a plane."""
    if field >= s.bodies:
        return True
    return r.stiff[field] == 1


@wp.func
def near_wall(c: DeviceContacts, s: StepGlobals, r: DeviceRigidBodies, field: int, w: int, at: wp.vec3i, alone: bool):
    """Whether a node of a field may touch a plane; with others there a body may lie between."""
    if r.pointed[field] == 1:
        return False
    reach = WALL_REACH
    if alone and r.pours[field] == 1:
        reach = LIQUID_WALL_REACH_DX
    return height_of(s, w, at) <= reach


@wp.func
def walls_near(c: DeviceContacts, s: StepGlobals, r: DeviceRigidBodies, field: int, at: wp.vec3i, alone: bool):
    """How many planes a field meets at a node."""
    n = int(0)
    for w in range(s.planes):
        if near_wall(c, s, r, field, w, at, alone):
            n += 1
    return n


@wp.func
def add_touch(c: DeviceContacts, t: int, k: int, a: int, other: int):
    """Enter a possible contact."""
    c.meet[t] = k
    c.a[t] = a
    c.c[t] = other
    c.active[t] = 0
    c.gap[t] = VAST
    c.facet[t] = 0
    c.slips[t] = 0
    c.span[t] = D(0.0)
    c.instead[t] = D(0.0)
    c.inward[t] = D(0.0)
    c.impulse[t] = wp.vec3d(D(0.0))
    c.last_impulse[t] = wp.vec3d(D(0.0))
    for q in range(3):
        c.far_a[3 * t + q] = -VAST
        c.far_c[3 * t + q] = VAST
    return 0


@wp.func
def wets_rigid_body(r: DeviceRigidBodies, a: int, b: int):
    """Whether a liquid meets a rigid body that says where liquids touch it: 1 or 2, which is it."""
    if r.wetted_count[a] > 0 and r.pours[b] == 1:
        return 1
    if r.wetted_count[b] > 0 and r.pours[a] == 1:
        return 2
    return 0


@wp.func
def faces_of(r: DeviceRigidBodies, a: int, b: int):
    """How many faces two fields may meet in."""
    if wets_rigid_body(r, a, b) > 0:
        return MAX_WETTED_FACES
    return 1


@wp.func
def add_touches(c: DeviceContacts, s: StepGlobals, r: DeviceRigidBodies, k: int, room: int):
    """Enter all pairs of a meeting, and its planes."""
    n = c.number[k]
    total = int(0)
    for a in range(n):
        f = c.field[k * FIELDS_AT_NODE + a]
        for b in range(a + 1, n):
            other = c.field[k * FIELDS_AT_NODE + b]
            if c.apart[f, other] == 0:
                total += faces_of(r, f, other)
        total += walls_near(c, s, r, c.field[k * FIELDS_AT_NODE + a], c.at[k], n == 1)
    t = wp.atomic_add(s.flag, FLAG_TOUCHES, total)
    c.first[k] = t
    c.last[k] = t
    if t + total > room:
        s.flag[FLAG_FULL] = 2
        return 0
    dx = s.dx
    x = wp.vec3d(D(c.at[k][0]) * dx, D(c.at[k][1]) * dx, D(c.at[k][2]) * dx)
    for a in range(n):
        f = c.field[k * FIELDS_AT_NODE + a]
        for b in range(a + 1, n):
            if c.apart[f, c.field[k * FIELDS_AT_NODE + b]] == 1:
                continue
            for facet in range(faces_of(r, f, c.field[k * FIELDS_AT_NODE + b])):
                add_touch(c, t, k, k * FIELDS_AT_NODE + a, k * FIELDS_AT_NODE + b)
                c.point[t] = x
                c.fa[t] = f
                c.fc[t] = c.field[k * FIELDS_AT_NODE + b]
                c.facet[t] = facet
                t += 1
        for w in range(s.planes):
            if near_wall(c, s, r, f, w, c.at[k], n == 1):
                add_touch(c, t, k, k * FIELDS_AT_NODE + a, -1 - w)
                c.point[t] = x
                c.fa[t] = f
                c.fc[t] = s.bodies + w
                c.normal[t] = -wp.vec3(s.plane[w])
                t += 1
    c.last[k] = t
    if c.stiff[k] == 1:
        wp.atomic_add(s.flag, FLAG_STIFF, total)
    return 0


@wp.func
def point_to_cached_choices(g: BlockGrid, c: DeviceContacts, s: StepGlobals, tid: int, stride: int):
    """Tell nodes where the choices of the last step are."""
    for t in range(tid, s.flag[FLAG_NORMALS_KEPT], stride):
        at = c.kept_at[t]
        f = c.kept_fa[t]
        first = int(1)
        if t > 0:
            if c.kept_fa[t - 1] == f and c.kept_at[t - 1] == at:
                first = 0
        if first == 1 and f >= 0:
            slot = find_block(g, f, block_of(at))
            if slot >= 0:
                g.was[64 * slot + 16 * (at[0] & 3) + 4 * (at[1] & 3) + (at[2] & 3)] = t + 1
    return 0


@wp.kernel
def list_meets(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """List nodes where fields meet each other or a plane; the lowest field enters them."""
    point_to_cached_choices(g, c, s, wp.tid(), stride)
    for i in range(wp.tid(), 64 * s.flag[FLAG_BLOCKS], stride):
        if not is_felt(g, i):
            continue
        b = i // 64
        o = i % 64
        at = 4 * g.where[b] + wp.vec3i(o >> 4, (o >> 2) & 3, o & 3)
        several = int(0)
        for q in range(FIELDS_AT_NODE):
            other = g.partner[FIELDS_AT_NODE * b + q]
            if other < 0:
                break
            if is_felt(g, 64 * other + o):
                several = 1
                if g.field[other] < g.field[b]:
                    several = -1
                    break
        if several < 0 or (several == 0 and walls_near(c, s, r, g.field[b], at, True) == 0):
            continue
        k = wp.atomic_add(s.flag, FLAG_MEETS, 1)
        if k >= c.room:
            s.flag[FLAG_FULL] = 2
            continue
        c.at[k] = at
        c.number[k] = 0
        c.stiff[k] = 0
        enter_field(c, g, r, k, i)
        wp.atomic_max(g.seen, b, 1 + several)
        for q in range(FIELDS_AT_NODE):
            other = g.partner[FIELDS_AT_NODE * b + q]
            if other < 0 or c.number[k] == FIELDS_AT_NODE:
                break
            if is_felt(g, 64 * other + o):
                enter_field(c, g, r, k, 64 * other + o)
                wp.atomic_max(g.seen, other, 2)
        add_touches(c, s, r, k, 2 * c.room)
