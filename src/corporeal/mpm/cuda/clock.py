"""The clock of the device engine: how long the next step is, and what it begins with."""

from corporeal.mpm import constants, formulas
from corporeal.mpm.cuda.layout import (
    ASKED,
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
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Loads, Rigid
from corporeal.mpm.formulas.one_lane import (
    ramped,
    steps_kept,
)

wp.set_module_options(formulas.options(max_unroll=0))

RIGID_COURANT = wp.constant(D(constants.RIGID_COURANT))
FALL = wp.constant(D(constants.FALL))
STEP_ROUNDING = wp.constant(D(constants.STEP_ROUNDING))
TINY = wp.constant(D(constants.TINY))
OUT_OF_BLOCK_SHARE = wp.constant(constants.OUT_OF_BLOCK_SHARE)


@wp.func
def stable(s: Sheet, r: Rigid):
    """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
    limit = wp.min(s.longest, FALL * wp.sqrt(s.dx / wp.max(s.pull, TINY)))
    quick = D(s.fast[2]) + D(s.fast[3])
    limit = wp.min(limit, s.courant * s.dx / wp.max(quick, TINY))
    for b in range(s.bodies):
        if r.stiff[b] == 1:
            quick = wp.length(r.speed[b]) + wp.length(r.spin[b]) * r.radius[b]
            limit = wp.min(limit, RIGID_COURANT * s.dx / wp.max(quick, TINY))
    return limit


@wp.func
def plan(s: Sheet, r: Rigid):
    """Choose the next step, and what every body is given in it; or stop."""
    time = s.clock[TIME]
    left = s.clock[UNTIL] - time
    s.clock[STABLE] = stable(s, r)
    s.flag[GOING] = 0
    s.flag[STEPPING] = 0
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
    pull = s.gravity * (ramped(time + dt, s.ramp) - ramped(time, s.ramp))
    for b in range(s.bodies):
        span = wp.min(time + dt, s.end[b]) - wp.max(time, s.start[b])
        s.pushed[b] = s.push[b] * wp.max(D(0.0), span)
        s.kick[b] = pull + s.pushed[b]
        if r.path_count[b] > 0:
            s.kick[b] = wp.vec3d(D(0.0))
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
def begin(s: Sheet, r: Rigid):
    """Plan the first step up to UNTIL."""
    plan(s, r)


@wp.kernel
def tick(s: Sheet, r: Rigid, l: Loads):
    """Book a step that was taken, and plan the next one."""
    if s.flag[FULL] != 2:
        dt = s.clock[DT]
        s.clock[TIME] = s.clock[TIME] + dt
        if s.clock[LAST] == D(1.0):
            s.clock[TIME] = s.clock[UNTIL]
        s.clock[COUNT] = s.clock[COUNT] + D(1.0)
        s.clock[SMALLEST] = wp.min(s.clock[SMALLEST], dt)
        s.clock[LARGEST] = wp.max(s.clock[LARGEST], dt)
        for b in range(s.bodies):
            s.external[b] = s.external[b] + s.mass[b] * s.kick[b] + l.external[b]
        for i in range(2):
            s.fast[2 + i] = s.fast[i]
            s.fast[i] = 0.0
        s.loss[VISCOUS, 0] = s.loss[VISCOUS, 0] + l.loss[0]
    plan(s, r)
