"""The clock of the device engine: how long the next step is, and what it begins with."""

from corporeal.mpm import constants
from corporeal.mpm.cuda import arena
from corporeal.mpm.cuda.arena import meet
from corporeal.mpm.cuda.grid import link
from corporeal.mpm.cuda.layout import (
    ASKED,
    BLOCKS,
    COUNT,
    DT,
    FORCED,
    FULL,
    GOING,
    HITS,
    KEPT,
    LARGEST,
    LAST,
    LOST,
    MEETS,
    PAIRS,
    ROUND,
    SMALLEST,
    STABLE,
    STEPPING,
    STIFF,
    STRAYS,
    STRUCK,
    TIME,
    TOUCHES,
    UNTIL,
    VISCOUS,
    D,
    Grid,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Loads, Rigid
from corporeal.mpm.formulas.one_lane import ramped
from corporeal.mpm.formulas.one_lane_contact import steps_kept

wp.set_module_options(arena.options(max_unroll=0))

RIGID_COURANT = wp.constant(D(constants.RIGID_COURANT))
FALL = wp.constant(D(constants.FALL))
STEP_ROUNDING = wp.constant(D(constants.STEP_ROUNDING))
TINY = wp.constant(D(constants.TINY))
OUT_OF_BLOCK_SHARE = wp.constant(constants.OUT_OF_BLOCK_SHARE)


@wp.func
def stable(s: Sheet, r: Rigid, lane: int, lanes: int):
    """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
    if lane == 0:
        limit = wp.min(s.longest, FALL * wp.sqrt(s.dx / wp.max(s.pull, TINY)))
        quick = D(s.fast[2]) + D(s.fast[3])
        s.clock[STABLE] = wp.min(limit, s.courant * s.dx / wp.max(quick, TINY))
    meet()
    for b in range(lane, s.bodies, lanes):
        if r.stiff[b] == 1:
            fast = wp.length(r.speed[b]) + wp.length(r.spin[b]) * r.radius[b]
            wp.atomic_min(s.clock, STABLE, RIGID_COURANT * s.dx / wp.max(fast, TINY))
    meet()
    return 0


@wp.func
def plan(s: Sheet, r: Rigid, lane: int, lanes: int):
    """Choose the next step, and what every body is given in it; or stop. For one group."""
    stable(s, r, lane, lanes)
    if lane == 0:
        decide(s)
    meet()
    if s.flag[GOING] == 0:
        return 0
    time = s.clock[TIME]
    dt = s.clock[DT]
    pull = s.gravity * (ramped(time + dt, s.ramp) - ramped(time, s.ramp))
    for b in range(lane, s.bodies, lanes):
        span = wp.min(time + dt, s.end[b]) - wp.max(time, s.start[b])
        s.pushed[b] = s.push[b] * wp.max(D(0.0), span)
        s.kick[b] = pull + s.pushed[b]
        if r.path_count[b] > 0:
            s.kick[b] = wp.vec3d(D(0.0))
    return 0


@wp.func
def decide(s: Sheet):
    """Say how long the next step is, and what it begins with; or stop."""
    time = s.clock[TIME]
    left = s.clock[UNTIL] - time
    s.flag[GOING] = 0
    s.flag[STEPPING] = 0
    s.flag[PAIRS] = 0
    if left <= D(0.0) or s.flag[FULL] != 0 or s.flag[LOST] != 0:
        return 0
    count = wp.max(D(1.0), wp.ceil(left / s.clock[STABLE] - STEP_ROUNDING))
    if s.clock[FORCED] == D(1.0):
        count = D(1.0)
    dt = left / count
    s.clock[LAST] = D(0.0)
    if count == D(1.0):
        s.clock[LAST] = D(1.0)
    s.clock[DT] = dt
    s.flag[MEETS] = 0
    s.flag[TOUCHES] = 0
    s.flag[STIFF] = 0
    s.flag[HITS] = 0
    s.flag[ROUND] = 0
    s.flag[STRUCK] = 0
    s.flag[ASKED] = 0
    # Now and then all contacts are looked at anew: see physics/contact.py.
    if int(s.clock[COUNT]) % steps_kept(D(s.fast[2]) * dt / s.dx) == 0:
        s.flag[KEPT] = 0
    s.flag[GOING] = 1
    if float(s.flag[STRAYS]) <= OUT_OF_BLOCK_SHARE * float(s.particles):
        s.flag[STEPPING] = 1
    return 0


@wp.kernel
def begin(s: Sheet, r: Rigid, lanes: int):
    """Plan the first step up to UNTIL. One group."""
    plan(s, r, wp.tid(), lanes)


# ---------------------------------------------------------------- the end of a step


@wp.func
def enter_books(s: Sheet, pair: int):
    """Enter what a pair did in this step: how much, when and where."""
    everything = s.marked.shape[0]
    a = pair // everything
    b = pair % everything
    size = s.step_impulse[a, b]
    if size > D(0.0):
        if b < s.bodies:
            s.pair_impulse[a, b] = s.pair_impulse[a, b] + size
            s.pair_impulse[b, a] = s.pair_impulse[a, b]
        if not (s.first_contact[a, b] >= D(0.0)):
            place = s.step_place[a, b] / size
            s.first_contact[a, b] = s.clock[TIME]
            s.first_contact[b, a] = s.clock[TIME]
            s.contact_point[a, b] = place
            s.contact_point[b, a] = place
        s.last_contact[a, b] = s.clock[TIME]
        s.last_contact[b, a] = s.clock[TIME]
        s.step_impulse[a, b] = D(0.0)
        s.step_place[a, b] = wp.vec3d(D(0.0))
    s.marked[a, b] = 0
    return 0


@wp.func
def tick(s: Sheet, l: Loads):
    """Book a step that was taken."""
    dt = s.clock[DT]
    s.clock[TIME] = s.clock[TIME] + dt
    if s.clock[LAST] == D(1.0):
        s.clock[TIME] = s.clock[UNTIL]
    s.clock[COUNT] = s.clock[COUNT] + D(1.0)
    s.clock[SMALLEST] = wp.min(s.clock[SMALLEST], dt)
    s.clock[LARGEST] = wp.max(s.clock[LARGEST], dt)
    for i in range(2):
        s.fast[2 + i] = s.fast[i]
        s.fast[i] = 0.0
    s.loss[VISCOUS, 0] = s.loss[VISCOUS, 0] + l.loss[0]
    return 0


@wp.kernel
def finish(g: Grid, r: Rigid, l: Loads, s: Sheet, stride: int, lanes: int):
    """End a step: link new blocks, empty clusters; and the first group books, and plans on."""
    link(g, s, wp.tid(), stride)
    for i in range(wp.tid(), 8 * s.flag[BLOCKS], stride):
        for k in range(3):
            g.pool[k, i] = 0.0
    if wp.tid() >= lanes:
        return
    lane = wp.tid()
    if s.flag[FULL] != 2:
        for k in range(lane, s.flag[PAIRS], lanes):
            enter_books(s, s.met[k])
        for b in range(lane, s.bodies, lanes):
            s.external[b] = s.external[b] + s.mass[b] * s.kick[b] + l.external[b]
        meet()
        if lane == 0:
            tick(s, l)
    meet()
    plan(s, r, lane, lanes)
