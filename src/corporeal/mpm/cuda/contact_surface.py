"""Contacts of rigid bodies on their surface points: on planes, flat faces and curved ones.

Same rules as ``reference.contact.find``.
"""

from corporeal.mpm import constants, formulas
from corporeal.mpm.constants import VAST
from corporeal.mpm.cuda.contact_nodes import add_touch
from corporeal.mpm.cuda.layout import CLOCK_DT, FLAG_FULL, FLAG_NODES, FLAG_STIFF, FLAG_TOUCHES, D, StepGlobals, wp
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.cuda.rigid import speed_at
from corporeal.mpm.formulas.one_lane_contact import (
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

wp.set_module_options(formulas.formula_options(max_unroll=0))

SURFACE_POINT_REACH_DX = wp.constant(D(constants.SURFACE_POINT_REACH_DX))
CURVATURE_ROW = wp.constant(constants.CURVATURE_ROW)
FACET_ROW = wp.constant(constants.FACET_ROW)
FACET_NORMAL_COSINE = wp.constant(D(constants.FACET_NORMAL_COSINE))
CURVED_NORMAL_COSINE = wp.constant(D(constants.CURVED_NORMAL_COSINE))
VALLEY_ITERATIONS = wp.constant(constants.VALLEY_ITERATIONS)


@wp.func
def enter_point(c: DeviceContacts, s: StepGlobals, a: int, other: int, side: int, x: wp.vec3d, n: wp.vec3d, gap: D):
    """Enter a contact on a surface point; side: whose point it is, 0 or 1."""
    t = wp.atomic_add(s.flag, FLAG_TOUCHES, 1)
    wp.atomic_add(s.flag, FLAG_STIFF, 1)
    if t >= 2 * c.room:
        s.flag[FLAG_FULL] = 2
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
def radius_at(r: DeviceRigidBodies, p: int):
    """Larger radius of curvature at a surface point [m]; 0 where it is not round."""
    return r.curvature[CURVATURE_ROW * p + 6] + r.curvature[CURVATURE_ROW * p + 7]


@wp.func
def note_rolling(c: DeviceContacts, t: int, radius: wp.float64):
    """Note that something round may roll on a contact."""
    if t < 2 * c.room and radius > D(0.0):
        c.rolls[t] = 1
    return 0


@wp.func
def list_points(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, tid: int, stride: int):
    """Contacts of rigid bodies with planes, on the bodies' surface points."""
    for i in range(tid, r.surfaces * s.planes, stride):
        w = i % s.planes
        b = r.surface_body[i // s.planes]
        if r.path_count[b] > 0:
            continue
        p = i // s.planes
        towards = -(wp.transpose(r.turn[b]) * s.plane[w])
        shift = shift_to_contact(r.curvature, p, towards)
        on = r.surface[p] + wp.vec3d(shift[0], shift[1], shift[2])
        x = r.centre[b] + r.turn[b] * on
        gap = wp.dot(s.plane[w], x) - s.offset[w]
        if gap < SURFACE_POINT_REACH_DX * s.dx and shift[3] > D(0.0):
            t = enter_point(c, s, b, s.bodies + w, 0, x, -s.plane[w], gap)
            note_rolling(c, t, radius_at(r, p))
    return 0


@wp.func
def list_facets(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, tid: int, stride: int):
    """Contacts of rounded surface points with the flat faces of other rigid bodies."""
    reach = SURFACE_POINT_REACH_DX * s.dx
    for i in range(tid, r.surfaces * r.facets, stride):
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
        shift = shift_to_contact(r.curvature, p, -(wp.transpose(r.turn[b]) * n))
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
            note_rolling(c, t, radius_at(r, p))
    return 0


@wp.func
def nearest_curved(r: DeviceRigidBodies, p: int, b: int, other: int, far: D):
    """Find the curved point of another body that a round point faces, nearest to its middle."""
    row = CURVATURE_ROW * p
    n = wp.vec3d(r.curvature[row], r.curvature[row + 1], r.curvature[row + 2])
    back = wp.transpose(r.turn[other])
    apart = r.centre[b] - r.centre[other]
    x = back * (apart + r.turn[b] * (r.surface[p] - ball_radius(r.curvature, p) * n))
    centre = back * apart
    first = int(b < other)
    best = int(-1)
    least = D(VAST)
    for q in range(r.first[other], r.first[other] + r.points[other]):
        d = x - r.surface[q]
        square = wp.length_sq(d)
        if square < least and curved_may(r.curvature, r.surface, q, centre, far, first):
            out = wp.vec3d(
                r.curvature[CURVATURE_ROW * q], r.curvature[CURVATURE_ROW * q + 1], r.curvature[CURVATURE_ROW * q + 2]
            )
            if wp.dot(d, out) > D(0.0):
                least = square
                best = q
    return best


@wp.func
def square_along(r: DeviceRigidBodies, b: int, other: int, x: wp.vec3d, n: wp.vec3d):
    """How fast a place of one body moves over another, across a normal, squared [m²/s²]."""
    v = speed_at(r, b, x) - speed_at(r, other, x)
    along = wp.dot(v, n)
    return wp.max(wp.length_sq(v) - along * along, D(0.0))


@wp.func
def list_curves(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, tid: int, stride: int):
    """Contacts of round surface points with curved faces of other rigid bodies."""
    reach = SURFACE_POINT_REACH_DX * s.dx
    for i in range(tid, r.surfaces * s.bodies, stride):
        p = i // s.bodies
        other = i % s.bodies
        b = r.surface_body[p]
        if r.path_count[b] > 0 or b == other or c.apart[b, other] == 1 or r.bends[other] == 0:
            continue
        apart = r.centre[b] - r.centre[other]
        radius = ball_radius(r.curvature, p)
        if radius <= D(0.0) or wp.length(apart) >= r.radius[b] + r.radius[other] + reach:
            continue
        q = nearest_curved(r, p, b, other, r.radius[b] + reach)
        if q < 0:
            continue
        met = curved_meet(r.curvature, r.surface, p, r.turn[b], q, r.turn[other], apart, reach)
        at = wp.vec3d(met[0], met[1], met[2])
        n = wp.vec3d(met[3], met[4], met[5])
        if met[6] >= reach or not curved_owns(r.curvature, r.surface, p, r.first[b], r.points[b], at):
            continue
        x = r.centre[b] + r.turn[b] * at
        if b < other:
            t = enter_point(c, s, b, other, 0, x, -n, met[6])
        else:
            t = enter_point(c, s, other, b, 1, x, n, met[6])
        if t < 2 * c.room:
            c.rolls[t] = 1
            c.instead[t] = curved_misjudged(r.curvature, p, q, s.dx)
            square = square_along(r, b, other, x + radius * n, n)
            c.inward[t] = curved_inward(r.curvature, p, q, square, s.clock[CLOCK_DT])
    return 0


@wp.func
def replaced_radius(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, q: int):
    """How far around a contact with a face nodes are not asked [m]."""
    reach = c.instead[q]
    if reach == D(0.0):
        rolls = c.fa[q]
        if c.facet[q] == 1:
            rolls = c.fc[q]
        reach = facet_misjudged(r.radius[rolls], s.dx)
    return reach


@wp.func
def lies_in_valley(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, t: int):
    """Whether the normal on a node lies between those of several faces near it."""
    rest = wp.vec3d(c.normal[t])
    for _ in range(VALLEY_ITERATIONS):
        most = D(0.0)
        best = int(-1)
        for q in range(s.flag[FLAG_NODES], s.flag[FLAG_TOUCHES]):
            if c.fa[q] == c.fa[t] and c.fc[q] == c.fc[t]:
                cosine = wp.dot(rest, wp.vec3d(c.normal[q]))
                near = wp.length(c.point[t] - c.point[q]) < replaced_radius(r, c, s, q)
                if near and cosine > most:
                    most = cosine
                    best = q
        if best >= 0:
            rest = rest - most * wp.vec3d(c.normal[best])
    return wp.length_sq(rest) < D(1.0) - FACET_NORMAL_COSINE * FACET_NORMAL_COSINE


@wp.func
def is_replaced(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, t: int):
    """Whether a contact on a node is one of those on flat or curved faces, less well known."""
    found = int(0)
    rigid = c.meet[t] >= 0 and c.c[t] >= 0
    if rigid:
        rigid = r.stiff[c.fa[t]] == 1 and r.stiff[c.fc[t]] == 1
    if rigid:
        for q in range(s.flag[FLAG_NODES], s.flag[FLAG_TOUCHES]):
            if c.fa[q] == c.fa[t] and c.fc[q] == c.fc[t]:
                flat = c.fc[q]
                if c.facet[q] == 1:
                    flat = c.fa[q]
                cosine = D(wp.dot(c.normal[t], c.normal[q]))
                apart = c.point[t] - c.point[q]
                alike = CURVED_NORMAL_COSINE
                if c.instead[q] == D(0.0) and r.thin[flat] == 0:
                    alike = FACET_NORMAL_COSINE
                if facet_replaces(apart, cosine, replaced_radius(r, c, s, q), alike):
                    found = 1
        if found == 0 and lies_in_valley(r, c, s, t):
            found = 1
    return found == 1


@wp.kernel
def list_surface(r: DeviceRigidBodies, c: DeviceContacts, s: StepGlobals, rolls: int, stride: int):
    """Contacts of rigid bodies on their surface points: with faces of others, and with planes."""
    if s.flag[FLAG_FULL] == 2:
        return
    list_facets(r, c, s, wp.tid(), stride)
    if rolls == 1:
        list_curves(r, c, s, wp.tid(), stride)
    list_points(r, c, s, wp.tid(), stride)
