"""Where fields meet on the device: nodes with several fields or near a plane, and surface points.

Same rules as ``reference.contact.find``.
"""

from corporeal.mpm import constants, formulas
from corporeal.mpm.constants import (
    FIELDS_AT_NODE,
    HELD_BY_WALL,
    STICKS,
    VAST,
    WALL_REACH,
    WETTED_FACES,
)
from corporeal.mpm.cuda.layout import (
    BLOCKS,
    DT,
    FULL,
    MEETS,
    NODES,
    STIFF,
    TOUCHES,
    D,
    Grid,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Rigid
from corporeal.mpm.cuda.layout_contact import Contacts
from corporeal.mpm.cuda.rigid import speed_at
from corporeal.mpm.formulas.one_lane import (
    ball_radius,
    curved_inward,
    curved_may,
    curved_meet,
    curved_misjudged,
    curved_owns,
    facet_holds,
    facet_misjudged,
    facet_near,
    facet_replaces,
    shift_to_contact,
)

wp.set_module_options(formulas.options(max_unroll=0))

POINT_REACH = wp.constant(D(constants.POINT_REACH))
ROUNDING = wp.constant(constants.ROUNDING)
FACET_ROW = wp.constant(constants.FACET_ROW)
FACET_ALIKE, ROUND_ALIKE = (
    wp.constant(D(constants.FACET_ALIKE)),
    wp.constant(D(constants.ROUND_ALIKE)),
)


@wp.func
def height_of(s: Sheet, w: int, at: wp.vec3i):
    """Height of a node above a plane [cells]."""
    n = wp.vec3(s.plane[w])
    x = wp.vec3(float(at[0]), float(at[1]), float(at[2]))
    return wp.dot(n, x) - wp.float32(s.offset[w] / s.dx)


@wp.func
def enter(c: Contacts, g: Grid, r: Rigid, k: int, node: int):
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
def there(g: Grid, node: int):
    """Whether a field is felt at a node: a held one is its frame's."""
    return g.node[node][0] > 0.0 and g.held[node] == 0


@wp.func
def slides(c: Contacts, r: Rigid, field: int, other: int):
    """Whether a field is a liquid that slides along a plane."""
    return r.pours[field] == 1 and c.friction[field, other] < D(STICKS)


@wp.func
def sticks(c: Contacts, r: Rigid, field: int, other: int):
    """Whether a field is a liquid on which a body or a plane drags by a viscous stress."""
    return r.pours[field] == 1 and c.friction[field, other] >= D(STICKS)


@wp.func
def curve_of(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Flow curve of the liquid of a contact, at its wall."""
    liquid = c.fa[t]
    if c.fc[t] < s.bodies:
        if r.pours[c.fc[t]] == 1:
            liquid = c.fc[t]
    return r.flows_by[liquid]


@wp.func
def is_stiff(r: Rigid, s: Sheet, field: int):
    """Whether a side is a rigid body or a plane."""
    if field >= s.bodies:
        return True
    return r.stiff[field] == 1


@wp.func
def near_wall(c: Contacts, s: Sheet, r: Rigid, field: int, w: int, at: wp.vec3i, alone: bool):
    """Whether a node of a field may touch a plane; with others there a body may lie between."""
    if r.pointed[field] == 1:
        return False
    reach = WALL_REACH
    if alone and r.pours[field] == 1:
        reach = HELD_BY_WALL
    return height_of(s, w, at) <= reach


@wp.func
def walls_near(c: Contacts, s: Sheet, r: Rigid, field: int, at: wp.vec3i, alone: bool):
    """How many planes a field meets at a node."""
    n = int(0)
    for w in range(s.planes):
        if near_wall(c, s, r, field, w, at, alone):
            n += 1
    return n


@wp.func
def add_touch(c: Contacts, t: int, k: int, a: int, other: int):
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
def wets(r: Rigid, a: int, b: int):
    """Whether a liquid meets a rigid body that says where liquids touch it: 1 or 2, which is it."""
    if r.wetted_count[a] > 0 and r.pours[b] == 1:
        return 1
    if r.wetted_count[b] > 0 and r.pours[a] == 1:
        return 2
    return 0


@wp.func
def faces_of(r: Rigid, a: int, b: int):
    """How many faces two fields may meet in."""
    if wets(r, a, b) > 0:
        return WETTED_FACES
    return 1


@wp.func
def add_touches(c: Contacts, s: Sheet, r: Rigid, k: int, room: int):
    """Enter all pairs of a meeting, and its planes."""
    n = c.number[k]
    total = n * (n - 1) // 2
    for a in range(n):
        f = c.field[k * FIELDS_AT_NODE + a]
        for b in range(a + 1, n):
            total += faces_of(r, f, c.field[k * FIELDS_AT_NODE + b]) - 1
        total += walls_near(c, s, r, c.field[k * FIELDS_AT_NODE + a], c.at[k], n == 1)
    t = wp.atomic_add(s.flag, TOUCHES, total)
    c.first[k] = t
    c.last[k] = t
    if t + total > room:
        s.flag[FULL] = 2
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
        wp.atomic_add(s.flag, STIFF, total)
    return 0


@wp.kernel
def list_meets(g: Grid, c: Contacts, r: Rigid, s: Sheet, stride: int):
    """List nodes where fields meet each other or a plane; the lowest field enters them."""
    for i in range(wp.tid(), 64 * s.flag[BLOCKS], stride):
        if not there(g, i):
            continue
        b = i // 64
        o = i % 64
        at = 4 * g.where[b] + wp.vec3i(o >> 4, (o >> 2) & 3, o & 3)
        several = int(0)
        for q in range(FIELDS_AT_NODE):
            other = g.partner[FIELDS_AT_NODE * b + q]
            if other < 0:
                break
            if there(g, 64 * other + o):
                several = 1
                if g.field[other] < g.field[b]:
                    several = -1
                    break
        if several < 0 or (several == 0 and walls_near(c, s, r, g.field[b], at, True) == 0):
            continue
        k = wp.atomic_add(s.flag, MEETS, 1)
        if k >= c.room:
            s.flag[FULL] = 2
            continue
        c.at[k] = at
        c.number[k] = 0
        c.stiff[k] = 0
        enter(c, g, r, k, i)
        wp.atomic_max(g.seen, b, 1 + several)
        for q in range(FIELDS_AT_NODE):
            other = g.partner[FIELDS_AT_NODE * b + q]
            if other < 0 or c.number[k] == FIELDS_AT_NODE:
                break
            if there(g, 64 * other + o):
                enter(c, g, r, k, 64 * other + o)
                wp.atomic_max(g.seen, other, 2)
        add_touches(c, s, r, k, 2 * c.room)


@wp.kernel
def look_around(g: Grid, s: Sheet, stride: int):
    """Tell blocks whether particles in them reach nodes where fields meet."""
    for b in range(wp.tid(), s.flag[BLOCKS], stride):
        aware = int(0)
        for o in range(8):
            other = g.near[8 * b + o]
            if other >= 0:
                aware = wp.max(aware, g.seen[other])
        g.aware[b] = aware


@wp.func
def enter_point(
    c: Contacts, s: Sheet, a: int, other: int, side: int, x: wp.vec3d, n: wp.vec3d, gap: D
):
    """Enter a contact on a surface point; side: whose point it is, 0 or 1."""
    t = wp.atomic_add(s.flag, TOUCHES, 1)
    wp.atomic_add(s.flag, STIFF, 1)
    if t >= 2 * c.room:
        s.flag[FULL] = 2
    else:
        add_touch(c, t, -1, -1, -1 - other)
        c.fa[t] = a
        c.fc[t] = other
        c.facet[t] = side
        c.rolls[t] = 0
        c.point[t] = x
        c.normal[t] = wp.vec3(n)
        c.gap[t] = wp.float32(gap)
    return t


@wp.func
def radius_at(r: Rigid, p: int):
    """Larger radius of curvature at a surface point [m]; 0 where it is not round."""
    return r.rounding[ROUNDING * p + 6] + r.rounding[ROUNDING * p + 7]


@wp.func
def roll(c: Contacts, t: int, radius: wp.float64):
    """Note that something round may roll on a contact."""
    if t < 2 * c.room and radius > D(0.0):
        c.rolls[t] = 1
    return 0


@wp.kernel
def list_points(r: Rigid, c: Contacts, s: Sheet, stride: int):
    """Contacts of rigid bodies with planes, on the bodies' surface points."""
    if s.flag[FULL] == 2:
        return
    for i in range(wp.tid(), r.surfaces * s.planes, stride):
        w = i % s.planes
        b = r.surface_body[i // s.planes]
        if r.path_count[b] > 0:
            continue
        p = i // s.planes
        towards = -(wp.transpose(r.turn[b]) * s.plane[w])
        shift = shift_to_contact(r.rounding, p, towards)
        on = r.surface[p] + wp.vec3d(shift[0], shift[1], shift[2])
        x = r.centre[b] + r.turn[b] * on
        gap = wp.dot(s.plane[w], x) - s.offset[w]
        if gap < POINT_REACH * s.dx and shift[3] > D(0.0):
            t = enter_point(c, s, b, s.bodies + w, 0, x, -s.plane[w], gap)
            roll(c, t, radius_at(r, p))


@wp.kernel
def list_facets(r: Rigid, c: Contacts, s: Sheet, stride: int):
    """Contacts of rounded surface points with the flat faces of other rigid bodies."""
    if s.flag[FULL] == 2:
        return
    reach = POINT_REACH * s.dx
    for i in range(wp.tid(), r.surfaces * r.facets, stride):
        p = i // r.facets
        k = i % r.facets
        b = r.surface_body[p]
        other = r.facet_body[k]
        if r.path_count[b] > 0 or b == other or c.apart[b, other] == 1 or radius_at(r, p) <= D(0.0):
            continue
        back = wp.transpose(r.turn[other])
        centre = back * (r.centre[b] - r.centre[other])
        if not facet_near(r.facet, k, centre, r.radius[b] + reach):
            continue
        row = FACET_ROW * k
        n = r.turn[other] * wp.vec3d(r.facet[row], r.facet[row + 1], r.facet[row + 2])
        shift = shift_to_contact(r.rounding, p, -(wp.transpose(r.turn[b]) * n))
        on = r.surface[p] + wp.vec3d(shift[0], shift[1], shift[2])
        x = r.centre[b] + r.turn[b] * on
        gap = wp.dot(n, x - r.centre[other]) - r.facet[row + 3]
        if shift[3] == D(0.0) or wp.abs(gap) >= reach or gap <= -radius_at(r, p):
            continue
        if facet_holds(r.facet, k, r.facet_point, back * (x - r.centre[other])):
            if b < other:
                t = enter_point(c, s, b, other, 0, x, -n, gap)
            else:
                t = enter_point(c, s, other, b, 1, x, n, gap)
            roll(c, t, radius_at(r, p))


@wp.func
def nearest_curved(r: Rigid, p: int, b: int, other: int, far: D):
    """Find the curved point of another body that a round point faces, nearest to its middle."""
    row = ROUNDING * p
    n = wp.vec3d(r.rounding[row], r.rounding[row + 1], r.rounding[row + 2])
    back = wp.transpose(r.turn[other])
    apart = r.centre[b] - r.centre[other]
    x = back * (apart + r.turn[b] * (r.surface[p] - ball_radius(r.rounding, p) * n))
    centre = back * apart
    first = int(b < other)
    best = int(-1)
    least = D(VAST)
    for q in range(r.first[other], r.first[other] + r.points[other]):
        d = x - r.surface[q]
        square = wp.length_sq(d)
        if square < least and curved_may(r.rounding, r.surface, q, centre, far, first):
            out = wp.vec3d(
                r.rounding[ROUNDING * q], r.rounding[ROUNDING * q + 1], r.rounding[ROUNDING * q + 2]
            )
            if wp.dot(d, out) > D(0.0):
                least = square
                best = q
    return best


@wp.func
def square_along(r: Rigid, b: int, other: int, x: wp.vec3d, n: wp.vec3d):
    """How fast a place of one body moves over another, across a normal, squared [m²/s²]."""
    v = speed_at(r, b, x) - speed_at(r, other, x)
    along = wp.dot(v, n)
    return wp.max(wp.length_sq(v) - along * along, D(0.0))


@wp.kernel
def list_curves(r: Rigid, c: Contacts, s: Sheet, stride: int):
    """Contacts of round surface points with curved faces of other rigid bodies."""
    if s.flag[FULL] == 2:
        return
    reach = POINT_REACH * s.dx
    for i in range(wp.tid(), r.surfaces * s.bodies, stride):
        p = i // s.bodies
        other = i % s.bodies
        b = r.surface_body[p]
        if r.path_count[b] > 0 or b == other or c.apart[b, other] == 1 or r.bends[other] == 0:
            continue
        apart = r.centre[b] - r.centre[other]
        radius = ball_radius(r.rounding, p)
        if radius <= D(0.0) or wp.length(apart) >= r.radius[b] + r.radius[other] + reach:
            continue
        q = nearest_curved(r, p, b, other, r.radius[b] + reach)
        if q < 0:
            continue
        met = curved_meet(r.rounding, r.surface, p, r.turn[b], q, r.turn[other], apart, reach)
        at = wp.vec3d(met[0], met[1], met[2])
        n = wp.vec3d(met[3], met[4], met[5])
        if met[6] >= reach or not curved_owns(
            r.rounding, r.surface, p, r.first[b], r.points[b], at
        ):
            continue
        x = r.centre[b] + r.turn[b] * at
        if b < other:
            t = enter_point(c, s, b, other, 0, x, -n, met[6])
        else:
            t = enter_point(c, s, other, b, 1, x, n, met[6])
        if t < 2 * c.room:
            c.rolls[t] = 1
            c.instead[t] = curved_misjudged(r.rounding, p, q, s.dx)
            square = square_along(r, b, other, x + radius * n, n)
            c.inward[t] = curved_inward(r.rounding, p, q, square, s.clock[DT])


@wp.kernel
def instead_of_nodes(r: Rigid, c: Contacts, s: Sheet, stride: int):
    """Contacts on nodes that are those on flat faces, less well known, transmit nothing."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.meet[t] < 0 or c.c[t] < 0:
            continue
        if r.stiff[c.fa[t]] == 0 or r.stiff[c.fc[t]] == 0:
            continue
        for q in range(s.flag[NODES], s.flag[TOUCHES]):
            if c.fa[q] == c.fa[t] and c.fc[q] == c.fc[t]:
                rolls = c.fa[q]
                flat = c.fc[q]
                if c.facet[q] == 1:
                    rolls = c.fc[q]
                    flat = c.fa[q]
                cosine = D(wp.dot(c.normal[t], c.normal[q]))
                apart = c.point[t] - c.point[q]
                reach = c.instead[q]
                alike = ROUND_ALIKE
                if reach == D(0.0):
                    reach = facet_misjudged(r.radius[rolls], s.dx)
                    if r.thin[flat] == 0:
                        alike = FACET_ALIKE
                if facet_replaces(apart, cosine, reach, alike):
                    c.gap[t] = VAST


@wp.kernel
def count_nodes(s: Sheet):
    """Remember how many contacts there are on nodes, before those on surface points."""
    s.flag[NODES] = s.flag[TOUCHES]
