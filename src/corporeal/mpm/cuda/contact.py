"""Contact geometry on the device: surfaces, normals, gaps.

Same formulas as ``physics.contact`` and ``reference.contact``, in float32 and relative to the node.
"""

from corporeal.mpm.constants import (
    FIELDS_AT_NODE,
    FIRST_BIAS,
    FLAT_BODY_GAP_DX,
    LIQUID_TOUCH_DX,
    LIQUID_WALL_REACH_DX,
    NODE_SIGHT_DX,
    OTHER_BIAS,
    STICKING_FRICTION,
    SURFACE_SEARCH_RADIUS_DX,
    TINY,
    VAST,
    WALL_REACH,
)
from corporeal.mpm.cuda import block_arena
from corporeal.mpm.cuda.block_arena import node_of
from corporeal.mpm.cuda.block_grid import block_of, find_block
from corporeal.mpm.cuda.channel_rows import cell_at, matrix_at, vector_at
from corporeal.mpm.cuda.contact_nodes import height_of, is_dragged, slides_along_plane, wets_rigid_body
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    FLAG_FULL,
    FLAG_MEETS,
    FLAG_NODES,
    FLAG_NORMALS_KEPT,
    FLAG_NORMALS_RENEWED,
    FLAG_TOUCHES,
    BlockGrid,
    D,
    DeviceParticles,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.cuda.rigid import speed_at
from corporeal.mpm.formulas.one_lane import spline_slopes, spline_weights
from corporeal.mpm.formulas.one_lane_contact import (
    SeenFromNode,
    facet_normal_at,
    gap_between,
    gap_of_liquid,
    gap_to_plane,
    gap_to_surface,
    gap_to_thin,
    sees_thin_place,
    support_reach,
    surface_begins,
    wall_span,
    wetted_face,
)

wp.set_module_options(block_arena.arena_options(max_unroll=0))


@wp.func
def add_field_sample(
    g: BlockGrid,
    c: DeviceContacts,
    s: StepGlobals,
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    m: wp.float32,
    volume: wp.float32,
):
    """Add a particle to how its field looks from the nodes around it."""
    w = spline_weights(f)
    d = spline_slopes(f) / s.cell
    for x in range(3):
        for y in range(3):
            for z in range(3):
                e = g.meet[node_of(g.near, home, cell, x, y, z)] - 1
                if e >= 0:
                    offset = s.cell * (f - wp.vec3(float(x), float(y), float(z)))
                    n = w[0, x] * w[1, y] * w[2, z]
                    wp.atomic_add(c.mean, e, m * n * offset)
                    slope = wp.vec3(
                        d[0, x] * w[1, y] * w[2, z], w[0, x] * d[1, y] * w[2, z], w[0, x] * w[1, y] * d[2, z]
                    )
                    wp.atomic_add(c.outward, e, volume * slope)
    return 0


@wp.func
def contact_near(g: BlockGrid, home: int):
    """Whether fields meet on nodes that particles of a block reach: 1; 2: with one another."""
    aware = int(0)
    for o in range(8):
        aware = wp.max(aware, g.seen[g.near[8 * home + o]])
    return aware


@wp.kernel
def sample_fields(
    p: DeviceParticles, r: DeviceRigidBodies, g: BlockGrid, c: DeviceContacts, s: StepGlobals, stride: int
):
    """Second look at the particles around those nodes, and only them."""
    if s.flag[FLAG_FULL] == 2 or s.flag[FLAG_MEETS] == 0:
        return
    for i in range(wp.tid(), p.count, stride):
        if contact_near(g, p.home[i]) > 0:
            J = wp.determinant(wp.identity(n=3, dtype=wp.float32) + matrix_at(p.strain, i))
            f = vector_at(p.place, i)
            add_field_sample(g, c, s, p.home[i], cell_at(p.cell, i), f, p.mass[i], J * p.volume[i])
    for i in range(wp.tid(), r.count, stride):
        if contact_near(g, r.home[i]) > 0:
            add_field_sample(g, c, s, r.home[i], r.cell[i], r.place[i], r.mass[i], r.volume[i])


@wp.func
def unit(v: wp.vec3):
    """v/|v|; zero stays zero."""
    size = wp.length(v)
    if size > TINY:
        return v / size
    return wp.vec3(0.0)


@wp.func
def cached_candidate(g: BlockGrid, c: DeviceContacts, s: StepGlobals, t: int):
    """Candidate that a touch took in the last step; -1: none is known."""
    at = c.at[c.meet[t]]
    o = g.was[c.slot[c.a[t]]] - 1
    found = int(-1)
    while found < 0 and o >= 0:
        if o >= s.flag[FLAG_NORMALS_KEPT]:
            o = -1
        elif c.kept_fa[o] != c.fa[t] or not (c.kept_at[o] == at):
            o = -1
        else:
            if c.kept_fc[o] == c.fc[t]:
                found = c.kept_pick[o]
            o += 1
    return found


@wp.kernel
def propose_normals(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Candidates n1 = g_a - g_c, n2 = g_a, n3 = -g_c, normalised; which one is kept.

    What is small against the cell has no face of its own.
    """
    if s.flag[FLAG_FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if c.c[t] >= 0:
            a = unit(c.outward[c.a[t]])
            b = unit(c.outward[c.c[t]])
            both = unit(c.outward[c.a[t]] - c.outward[c.c[t]])
            if r.thin[c.fa[t]] == 2 and r.thin[c.fc[t]] != 2:
                both = wp.vec3(0.0)
                a = wp.vec3(0.0)
            if r.thin[c.fc[t]] == 2 and r.thin[c.fa[t]] != 2:
                both = wp.vec3(0.0)
                b = wp.vec3(0.0)
            c.candidate[t] = wp.matrix_from_rows(both, a, -b)
            c.pick[t] = cached_candidate(g, c, s, t)
            if c.pick[t] < 0:
                s.flag[FLAG_NORMALS_RENEWED] = 1


@wp.func
def push_support(c: DeviceContacts, e: int, field: int, r: wp.vec3, F: wp.mat33, radius: wp.float32):
    """Let a particle at r [m] from a node push its field's support there outwards."""
    k = e // FIELDS_AT_NODE
    for t in range(c.first[k], c.last[k]):
        asked = c.c[t] >= 0 and c.pick[t] < 0
        if asked and (c.fa[t] == field or c.fc[t] == field):
            for q in range(3):
                n = wp.vec3(c.candidate[t][q, 0], c.candidate[t][q, 1], c.candidate[t][q, 2])
                along = wp.dot(r, n)
                extent = support_reach(F, n, radius)
                if c.fa[t] == field:
                    if along + extent > c.far_a[3 * t + q]:
                        wp.atomic_max(c.far_a, 3 * t + q, along + extent)
                elif along - extent < c.far_c[3 * t + q]:
                    wp.atomic_min(c.far_c, 3 * t + q, along - extent)
    return 0


@wp.func
def push_supports(
    g: BlockGrid,
    c: DeviceContacts,
    s: StepGlobals,
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    F: wp.mat33,
    volume: wp.float32,
):
    """Supports of one particle at all its nodes: R = r0 ‖Fᵀn‖ with r0 half the spacing."""
    radius = 0.5 * wp.cbrt(volume)
    for x in range(3):
        for y in range(3):
            for z in range(3):
                e = g.meet[node_of(g.near, home, cell, x, y, z)] - 1
                if e >= 0:
                    r = s.cell * (f - wp.vec3(float(x), float(y), float(z)))
                    push_support(c, e, c.field[e], r, F, radius)
    return 0


@wp.kernel
def push_all_supports(
    p: DeviceParticles, r: DeviceRigidBodies, g: BlockGrid, c: DeviceContacts, s: StepGlobals, stride: int
):
    """Supports of all particles where a choice is made anew."""
    if s.flag[FLAG_FULL] == 2 or s.flag[FLAG_NORMALS_RENEWED] == 0:
        return
    one = wp.identity(n=3, dtype=wp.float32)
    for i in range(wp.tid(), p.count, stride):
        if contact_near(g, p.home[i]) == 2:
            F = one + matrix_at(p.strain, i)
            f = vector_at(p.place, i)
            push_supports(g, c, s, p.home[i], cell_at(p.cell, i), f, F, p.volume[i])
    for i in range(wp.tid(), r.count, stride):
        if contact_near(g, r.home[i]) == 2:
            push_supports(g, c, s, r.home[i], r.cell[i], r.place[i], one, r.volume[i])


@wp.func
def candidate_of(c: DeviceContacts, t: int, q: int):
    """One of the three candidate normals of a touch."""
    return wp.vec3(c.candidate[t][q, 0], c.candidate[t][q, 1], c.candidate[t][q, 2])


@wp.func
def widest_candidate(c: DeviceContacts, s: StepGlobals, t: int):
    """Number of the candidate along which the two fields are farthest apart."""
    best = float(-2.0 * VAST)
    pick = int(0)
    for q in range(3):
        bias = OTHER_BIAS
        if q == 0:
            bias = FIRST_BIAS
        wide = c.far_c[3 * t + q] - c.far_a[3 * t + q] + bias * s.cell
        if wp.length_sq(candidate_of(c, t, q)) > 0.0 and wide > best:
            best = wide
            pick = q
    return pick


@wp.func
def chosen_candidate(c: DeviceContacts, s: StepGlobals, t: int):
    """Number of the candidate that a touch of two fields takes: the kept one, or the widest."""
    pick = c.pick[t]
    if pick < 0:
        pick = widest_candidate(c, s, t)
    return pick


@wp.func
def cache_candidate(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Note for the next step which candidate a touch takes.

    Pairs with a rigid body are looked at in every step.
    """
    k = c.meet[t]
    kept = int(-1)
    if c.c[t] >= 0:
        if r.stiff[c.fa[t]] == 0 and r.stiff[c.fc[t]] == 0:
            kept = chosen_candidate(c, s, t)
    c.kept_pick[t] = kept
    c.kept_at[t] = c.at[k]
    c.kept_fa[t] = c.fa[t]
    c.kept_fc[t] = c.fc[t]
    return 0


@wp.func
def smoothed_normal(g: BlockGrid, c: DeviceContacts, s: StepGlobals, t: int):
    """Mean normal of the same pair over 27 nodes, weighted with min(m_a, m_c)."""
    at = c.at[c.meet[t]]
    total = wp.vec3(0.0)
    for x in range(-1, 2):
        for y in range(-1, 2):
            for z in range(-1, 2):
                node = at + wp.vec3i(x, y, z)
                slot = find_block(g, c.fa[t], block_of(node))
                if slot >= 0:
                    place = 16 * (node[0] & 3) + 4 * (node[1] & 3) + (node[2] & 3)
                    e = g.meet[64 * slot + place] - 1
                    if e >= 0:
                        k = e // FIELDS_AT_NODE
                        for o in range(c.first[k], c.last[k]):
                            if c.fa[o] == c.fa[t] and c.fc[o] == c.fc[t]:
                                a = g.node[c.slot[c.a[o]]][0]
                                b = g.node[c.slot[c.c[o]]][0]
                                total += wp.min(a, b) * candidate_of(c, o, chosen_candidate(c, s, o))
    return unit(total)


@wp.func
def surface_start(r: DeviceRigidBodies, s: StepGlobals, b: int, x: wp.vec3d, n: wp.vec3):
    """Where a rigid body's surface begins along n, seen from x [cells]."""
    R = wp.transpose(r.turn[b])
    around, behind = wp.float64(SURFACE_SEARCH_RADIUS_DX) * s.dx, wp.float64(NODE_SIGHT_DX) * s.dx
    y = R * (x - r.centre[b])
    m = R * wp.vec3d(n)
    at = surface_begins(r.surface, r.first[b], r.points[b], y, m, around, behind)
    return wp.float32(at / s.dx)


@wp.func
def is_thin(r: DeviceRigidBodies, s: StepGlobals, b: int, x: wp.vec3d):
    """Whether a rigid body is thin near there, though not as a whole."""
    y = wp.transpose(r.turn[b]) * (x - r.centre[b])
    return sees_thin_place(r.slim, r.slim_first[b], r.slim_count[b], y, wp.float64(NODE_SIGHT_DX) * s.dx)


@wp.func
def face_of(r: DeviceRigidBodies, s: StepGlobals, b: int, x: wp.vec3d, mean: wp.vec3, number: int):
    """Outward normal of a rigid body's face and the height of a node over it [cells].

    Seen from the mean place of the liquid at the node.
    """
    R = wp.transpose(r.turn[b])
    y = R * (x - r.centre[b])
    place = y + R * wp.vec3d(mean)
    face = wetted_face(r.wetted_points, r.wetted_first[b], r.wetted_count[b], y, place, s.dx, number)
    n = r.turn[b] * wp.vec3d(face[0], face[1], face[2])
    height = VAST
    if face[3] < wp.float64(VAST):
        height = float(face[3] / s.dx)
    return wp.vec4(float(n[0]), float(n[1]), float(n[2]), height)


@wp.func
def gap_of(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, xa: wp.float32, xc: wp.float32):
    """Open distance of two fields along n [cells], by surface points of what is thin or flat."""
    a = c.fa[t]
    b = c.fc[t]
    gap = gap_between(c.face, xa, xc)
    asked = r.thin[a] > 0 or r.thin[b] > 0
    if not asked:
        asked = r.flat[a] == 1 and r.flat[b] == 1 and gap <= FLAT_BODY_GAP_DX
    if not asked and r.points[a] > 0 and r.points[b] > 0:
        asked = is_thin(r, s, a, c.point[t]) or is_thin(r, s, b, c.point[t])
    if not asked:
        pass
    elif r.points[a] == 0:
        gap = gap_to_thin(xa, surface_start(r, s, b, c.point[t], c.normal[t]))
    elif r.points[b] == 0:
        gap = gap_to_thin(-xc, surface_start(r, s, a, c.point[t], -c.normal[t]))
    else:
        n = c.normal[t]
        gap = surface_start(r, s, b, c.point[t], n) + surface_start(r, s, a, c.point[t], -n)
    return gap


@wp.func
def mean_of(c: DeviceContacts, g: BlockGrid, s: StepGlobals, entry: int):
    """Mean offset of a field's material from a node [cells]."""
    return wp.vec3d(c.mean[entry] / (g.node[c.slot[entry]][0] * s.cell))


@wp.func
def faces_seen(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, b: int, e: int):
    """Return the flat faces of a rigid body as a node sees them."""
    x = wp.transpose(r.turn[b]) * (c.point[t] - r.centre[b])
    m = mean_of(c, g, s, e)
    first = D(r.facet_first[b])
    return SeenFromNode(x[0], x[1], x[2], m[0], m[1], m[2], first, D(r.facet_count[b]))


@wp.func
def facet_normal(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, n: wp.vec3):
    """Normal of a node, or of faces that meet there where its lean feigns an approach."""
    a = c.fa[t]
    b = c.fc[t]
    found = n
    if r.flat[a] == 1 and r.flat[b] == 1:
        one = faces_seen(g, c, r, s, t, a, c.a[t])
        two = faces_seen(g, c, r, s, t, b, c.c[t])
        way = wp.vec3d(n)
        u = speed_at(r, a, c.point[t]) - speed_at(r, b, c.point[t])
        found = wp.vec3(facet_normal_at(r.facet, one, r.turn[a], two, r.turn[b], u, s.dx, way))
    return found


@wp.func
def drag_span(s: StepGlobals, xi: wp.float32, h: wp.float32, mass: wp.float32, full: wp.float32):
    """Over which a wall drags on a node of a liquid that sticks to it [m² s]; xi, h [cells]."""
    span = D(0.0)
    if h <= LIQUID_WALL_REACH_DX and gap_to_plane(xi, h) < LIQUID_TOUCH_DX:
        span = wall_span(D(mass), D(full), D(h), s.dx, s.clock[CLOCK_DT])
    return span


@wp.kernel
def measure_gaps(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Choose and smooth normals, and measure the open distance along them."""
    if s.flag[FLAG_FULL] == 2:
        return
    if wp.tid() == 0:
        s.flag[FLAG_NORMALS_KEPT] = s.flag[FLAG_TOUCHES]
        s.flag[FLAG_NODES] = s.flag[FLAG_TOUCHES]
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        cache_candidate(c, r, s, t)
        a = c.a[t]
        other = c.c[t]
        if other < 0:
            n = c.normal[t]
            h = height_of(s, -1 - other, c.at[c.meet[t]])
            xi = wp.dot(c.mean[a], n) / (g.node[c.slot[a]][0] * s.cell)
            mass = g.node[c.slot[a]][0]
            gap = gap_to_surface(xi, h)
            if slides_along_plane(c, r, c.fa[t], c.fc[t]):
                gap = gap_of_liquid(xi, h, mass / r.full[c.fa[t]])
                if h > WALL_REACH:
                    c.slips[t] = 1
            if is_dragged(c, r, c.fa[t], c.fc[t]):
                c.slips[t] = 1
                c.span[t] = drag_span(s, xi, h, mass, r.full[c.fa[t]])
            if gap < VAST:
                c.gap[t] = gap * s.cell
        elif wets_rigid_body(r, c.fa[t], c.fc[t]) > 0:
            # The liquid's mean place, and a face of the body that it has there.
            which = wets_rigid_body(r, c.fa[t], c.fc[t])
            liquid = a
            field = c.fa[t]
            body = c.fc[t]
            way = float(-1.0)
            if which == 1:
                liquid = other
                field = c.fc[t]
                body = c.fa[t]
                way = 1.0
            mass = g.node[c.slot[liquid]][0]
            mean = c.mean[liquid] / mass
            face = face_of(r, s, body, c.point[t], mean, c.facet[t])
            if face[3] < VAST:
                out = wp.vec3(face[0], face[1], face[2])
                c.normal[t] = way * out
                xi = -wp.dot(mean, out) / s.cell
                gap = gap_to_surface(xi, face[3])
                if c.friction[c.fa[t], c.fc[t]] < wp.float64(STICKING_FRICTION):
                    gap = gap_of_liquid(xi, face[3], mass / r.full[field])
                else:
                    c.span[t] = drag_span(s, xi, face[3], mass, r.full[field])
                if face[3] > WALL_REACH or c.span[t] > D(0.0):
                    c.slips[t] = 1
                if gap < VAST:
                    c.gap[t] = gap * s.cell
        else:
            n = smoothed_normal(g, c, s, t)
            if wp.length_sq(n) > 0.0:
                n = facet_normal(g, c, r, s, t, n)
            c.normal[t] = n
            if wp.length_sq(n) > 0.0:
                xa = wp.dot(c.mean[a], n) / (g.node[c.slot[a]][0] * s.cell)
                xc = wp.dot(c.mean[other], n) / (g.node[c.slot[other]][0] * s.cell)
                gap = gap_of(c, r, s, t, xa, xc)
                if gap < VAST:
                    c.gap[t] = gap * s.cell
