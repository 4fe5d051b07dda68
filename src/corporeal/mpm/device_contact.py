"""How fields look where they meet, on the device: surfaces, normals, gaps.

Same formulas as ``contact`` and ``encounter``, in float32 and relative to the node.
"""

from corporeal.mpm.device_grid import block_of, find, node_of, slopes, splines
from corporeal.mpm.device_layout import (
    FULL,
    MEETS,
    MOST,
    TOUCHES,
    Contacts,
    Grid,
    Particles,
    Rigid,
    Sheet,
    wp,
)
from corporeal.mpm.device_meets import FAR, height_of

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

LATTICE_GAP = wp.constant(0.05)
LATTICE_SLOPE = wp.constant(0.25)
LATTICE_START = wp.constant(0.7)
DEEPEST = wp.constant(1.25)


# ---------------------------------------------------------------- surfaces


@wp.func
def show(
    g: Grid,
    c: Contacts,
    s: Sheet,
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    m: wp.float32,
    volume: wp.float32,
):
    """Add a particle to how its field looks from the nodes around it."""
    w = splines(f)
    d = slopes(f) / s.cell
    for x in range(3):
        for y in range(3):
            for z in range(3):
                e = g.meet[node_of(g, home, cell, x, y, z)] - 1
                if e >= 0:
                    offset = s.cell * (f - wp.vec3(float(x), float(y), float(z)))
                    n = w[0, x] * w[1, y] * w[2, z]
                    wp.atomic_add(c.mean, e, m * n * offset)
                    slope = wp.vec3(
                        d[0, x] * w[1, y] * w[2, z],
                        w[0, x] * d[1, y] * w[2, z],
                        w[0, x] * w[1, y] * d[2, z],
                    )
                    wp.atomic_add(c.outward, e, volume * slope)
    return 0


@wp.kernel
def show_particles(p: Particles, g: Grid, c: Contacts, s: Sheet, stride: int):
    """Second look at the particles around those nodes, and only them."""
    if s.flag[FULL] == 2 or s.flag[MEETS] == 0:
        return
    for i in range(wp.tid(), p.count, stride):
        if g.aware[p.home[i]] > 0:
            J = wp.determinant(wp.identity(n=3, dtype=wp.float32) + p.strain[i])
            show(g, c, s, p.home[i], p.cell[i], p.place[i], p.mass[i], J * p.volume[i])


@wp.kernel
def show_rigid(r: Rigid, g: Grid, c: Contacts, s: Sheet, stride: int):
    """Likewise at the particles of rigid bodies."""
    if s.flag[FULL] == 2 or s.flag[MEETS] == 0:
        return
    for i in range(wp.tid(), r.count, stride):
        if g.aware[r.home[i]] > 0:
            show(g, c, s, r.home[i], r.cell[i], r.place[i], r.mass[i], r.volume[i])


@wp.func
def unit(v: wp.vec3):
    """v/|v|; zero stays zero."""
    size = wp.length(v)
    if size > 1.0e-30:
        return v / size
    return wp.vec3(0.0)


@wp.kernel
def propose(c: Contacts, s: Sheet, stride: int):
    """Candidates n1 = g_a - g_c, n2 = g_a, n3 = -g_c, normalised."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.c[t] >= 0:
            a = unit(c.outward[c.a[t]])
            b = unit(c.outward[c.c[t]])
            both = unit(c.outward[c.a[t]] - c.outward[c.c[t]])
            c.candidate[t] = wp.matrix_from_rows(both, a, -b)


@wp.func
def reach_from(c: Contacts, e: int, field: int, r: wp.vec3, F: wp.mat33, radius: wp.float32):
    """Let a particle at r [m] from a node push its field's support there outwards."""
    k = e // MOST
    for t in range(c.first[k], c.last[k]):
        if c.c[t] >= 0 and (c.fa[t] == field or c.fc[t] == field):
            for q in range(3):
                n = wp.vec3(c.candidate[t][q, 0], c.candidate[t][q, 1], c.candidate[t][q, 2])
                along = wp.dot(r, n)
                extent = radius * wp.length(wp.transpose(F) * n)
                if c.fa[t] == field:
                    if along + extent > c.far_a[3 * t + q]:
                        wp.atomic_max(c.far_a, 3 * t + q, along + extent)
                elif along - extent < c.far_c[3 * t + q]:
                    wp.atomic_min(c.far_c, 3 * t + q, along - extent)
    return 0


@wp.func
def reach(
    g: Grid,
    c: Contacts,
    s: Sheet,
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
                e = g.meet[node_of(g, home, cell, x, y, z)] - 1
                if e >= 0:
                    r = s.cell * (f - wp.vec3(float(x), float(y), float(z)))
                    reach_from(c, e, c.field[e], r, F, radius)
    return 0


@wp.kernel
def reach_particles(p: Particles, g: Grid, c: Contacts, s: Sheet, stride: int):
    """Supports of what can deform."""
    if s.flag[FULL] == 2 or s.flag[MEETS] == 0:
        return
    for i in range(wp.tid(), p.count, stride):
        if g.aware[p.home[i]] == 2:
            F = wp.identity(n=3, dtype=wp.float32) + p.strain[i]
            reach(g, c, s, p.home[i], p.cell[i], p.place[i], F, p.volume[i])


@wp.kernel
def reach_rigid(r: Rigid, g: Grid, c: Contacts, s: Sheet, stride: int):
    """Supports of rigid bodies."""
    if s.flag[FULL] == 2 or s.flag[MEETS] == 0:
        return
    for i in range(wp.tid(), r.count, stride):
        if g.aware[r.home[i]] == 2:
            F = wp.identity(n=3, dtype=wp.float32)
            reach(g, c, s, r.home[i], r.cell[i], r.place[i], F, r.volume[i])


# ---------------------------------------------------------------- normals and gaps


@wp.kernel
def choose(c: Contacts, s: Sheet, stride: int):
    """Take the candidate along which the two fields are farthest apart."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.c[t] >= 0:
            best = float(-FAR * 1.0e6)
            for q in range(3):
                n = wp.vec3(c.candidate[t][q, 0], c.candidate[t][q, 1], c.candidate[t][q, 2])
                bias = 0.05
                if q == 0:
                    bias = 0.10
                wide = c.far_c[3 * t + q] - c.far_a[3 * t + q] + bias * s.cell
                if wp.length_sq(n) > 0.0 and wide > best:
                    best = wide
                    c.chosen[t] = n
            if best < -FAR:
                c.chosen[t] = wp.vec3(0.0)


@wp.func
def smoothed(g: Grid, c: Contacts, t: int):
    """Mean normal of the same pair over 27 nodes, weighted with min(m_a, m_c)."""
    at = c.at[c.meet[t]]
    total = wp.vec3(0.0)
    for x in range(-1, 2):
        for y in range(-1, 2):
            for z in range(-1, 2):
                node = at + wp.vec3i(x, y, z)
                slot = find(g, c.fa[t], block_of(node))
                if slot >= 0:
                    place = 16 * (node[0] & 3) + 4 * (node[1] & 3) + (node[2] & 3)
                    e = g.meet[64 * slot + place] - 1
                    if e >= 0:
                        k = e // MOST
                        for o in range(c.first[k], c.last[k]):
                            if c.fa[o] == c.fa[t] and c.fc[o] == c.fc[t]:
                                a = g.node[c.slot[c.a[o]]][0]
                                b = g.node[c.slot[c.c[o]]][0]
                                total += wp.min(a, b) * c.chosen[o]
    return unit(total)


@wp.func
def face_mean(face: wp.float32):
    """Mean offset e(s) [dx] of a half space through the quadratic spline."""
    s = wp.clamp(face, -1.5, 1.5)
    n = -wp.abs(s)
    w = n + 1.5
    weight = 0.5 + 0.75 * n - n * n * n / 3.0
    moment = -13.0 / 64.0 + 0.375 * n * n - 0.25 * n * n * n * n
    if n < -0.5:
        weight = w * w * w / 6.0
        moment = w * w * w * w / 8.0 - w * w * w / 4.0
    if s > 0.0:
        weight = 1.0 - weight
    if weight > 1.0e-12:
        return moment / weight
    return n


@wp.func
def face_of(c: Contacts, mean: wp.float32):
    """Where the face lies, by the table of the inverse of ``face_mean``."""
    f = (wp.clamp(mean, -1.5, 0.0) + 1.5) * (4096.0 / 1.5)
    i = wp.min(int(f), 4095)
    return c.face[i] + (c.face[i + 1] - c.face[i]) * (f - float(i))


@wp.func
def touching(face: wp.float32):
    """Distance t(s) of the mean offsets [dx] of two half spaces that touch."""
    s = wp.min(wp.abs(face), DEEPEST)
    lattice = LATTICE_GAP + LATTICE_SLOPE * wp.max(0.0, s - LATTICE_START)
    return -face_mean(s) - face_mean(-s) + lattice


@wp.kernel
def measure_gaps(g: Grid, c: Contacts, s: Sheet, stride: int):
    """Smooth normals, and measure the open distance along them."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        a = c.a[t]
        other = c.c[t]
        if other < 0:
            n = c.normal[t]
            h = height_of(s, -1 - other, c.at[c.meet[t]])
            xi = wp.dot(c.mean[a], n) / (g.node[c.slot[a]][0] * s.cell)
            c.gap[t] = (-face_mean(-h) - xi - touching(h)) * s.cell
        else:
            n = smoothed(g, c, t)
            c.normal[t] = n
            if wp.length_sq(n) > 0.0:
                xa = wp.dot(c.mean[a], n) / (g.node[c.slot[a]][0] * s.cell)
                xc = wp.dot(c.mean[other], n) / (g.node[c.slot[other]][0] * s.cell)
                face = 0.5 * (face_of(c, xa) - face_of(c, -xc))
                c.gap[t] = (xc - xa - touching(face)) * s.cell
