"""Time step control of the device engine."""

from corporeal.mpm import constants
from corporeal.mpm.cuda import block_arena
from corporeal.mpm.cuda.block_arena import wait_for_group
from corporeal.mpm.cuda.block_grid import link_blocks
from corporeal.mpm.cuda.layout import (
    CLOCK_COUNT,
    CLOCK_DT,
    CLOCK_FORCED,
    CLOCK_LARGEST,
    CLOCK_LAST_STEP,
    CLOCK_SMALLEST,
    CLOCK_STABLE,
    CLOCK_TIME,
    CLOCK_UNTIL,
    FLAG_BLOCKS,
    FLAG_FULL,
    FLAG_GOING,
    FLAG_HITS,
    FLAG_LOST,
    FLAG_MEETS,
    FLAG_NORMALS_KEPT,
    FLAG_NORMALS_RENEWED,
    FLAG_PAIRS,
    FLAG_ROUND,
    FLAG_STEPPING,
    FLAG_STIFF,
    FLAG_STRAYS,
    FLAG_STRUCK,
    FLAG_TOUCHES,
    LOSS_VISCOUS,
    BlockGrid,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceLoads, DeviceRigidBodies
from corporeal.mpm.formulas.one_lane import ramped_time
from corporeal.mpm.formulas.one_lane_contact import normal_cache_steps

wp.set_module_options(block_arena.arena_options(max_unroll=0))

RIGID_COURANT = wp.constant(D(constants.RIGID_COURANT))
FREE_FALL_STEP_FRACTION = wp.constant(D(constants.FREE_FALL_STEP_FRACTION))
STEP_ROUNDING = wp.constant(D(constants.STEP_ROUNDING))
TINY = wp.constant(D(constants.TINY))
OUT_OF_BLOCK_FRACTION = wp.constant(constants.OUT_OF_BLOCK_FRACTION)


@wp.func
def stable_step(s: StepGlobals, r: DeviceRigidBodies, lane: int, lanes: int):
    """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
    if lane == 0:
        limit = wp.min(s.longest, FREE_FALL_STEP_FRACTION * wp.sqrt(s.dx / wp.max(s.pull, TINY)))
        quick = D(s.fast[2]) + D(s.fast[3])
        s.clock[CLOCK_STABLE] = wp.min(limit, s.courant * s.dx / wp.max(quick, TINY))
    wait_for_group()
    for b in range(lane, s.bodies, lanes):
        if r.stiff[b] == 1:
            fast = wp.length(r.speed[b]) + wp.length(r.spin[b]) * r.radius[b]
            wp.atomic_min(s.clock, CLOCK_STABLE, RIGID_COURANT * s.dx / wp.max(fast, TINY))
    wait_for_group()
    return 0


@wp.func
def plan_group(s: StepGlobals, r: DeviceRigidBodies, lane: int, lanes: int):
    """Choose the next step, and what every body is given in it; or stop. For one group."""
    stable_step(s, r, lane, lanes)
    if lane == 0:
        choose_step(s)
    wait_for_group()
    if s.flag[FLAG_GOING] == 0:
        return 0
    time = s.clock[CLOCK_TIME]
    dt = s.clock[CLOCK_DT]
    pull = s.gravity * (ramped_time(time + dt, s.ramp) - ramped_time(time, s.ramp))
    for b in range(lane, s.bodies, lanes):
        span = wp.min(time + dt, s.end[b]) - wp.max(time, s.start[b])
        s.pushed[b] = s.push[b] * wp.max(D(0.0), span)
        s.kick[b] = pull + s.pushed[b]
        if r.path_count[b] > 0:
            s.kick[b] = wp.vec3d(D(0.0))
    return 0


@wp.func
def choose_step(s: StepGlobals):
    """Return how long the next step is, and what it begins with; or stop."""
    time = s.clock[CLOCK_TIME]
    left = s.clock[CLOCK_UNTIL] - time
    s.flag[FLAG_GOING] = 0
    s.flag[FLAG_STEPPING] = 0
    s.flag[FLAG_PAIRS] = 0
    if left <= D(0.0) or s.flag[FLAG_FULL] != 0 or s.flag[FLAG_LOST] != 0:
        return 0
    count = wp.max(D(1.0), wp.ceil(left / s.clock[CLOCK_STABLE] - STEP_ROUNDING))
    if s.clock[CLOCK_FORCED] == D(1.0):
        count = D(1.0)
    dt = left / count
    s.clock[CLOCK_LAST_STEP] = D(0.0)
    if count == D(1.0):
        s.clock[CLOCK_LAST_STEP] = D(1.0)
    s.clock[CLOCK_DT] = dt
    s.flag[FLAG_MEETS] = 0
    s.flag[FLAG_TOUCHES] = 0
    s.flag[FLAG_STIFF] = 0
    s.flag[FLAG_HITS] = 0
    s.flag[FLAG_ROUND] = 0
    s.flag[FLAG_STRUCK] = 0
    s.flag[FLAG_NORMALS_RENEWED] = 0
    # Now and then all contacts are looked at anew: see physics/contact.py.
    if int(s.clock[CLOCK_COUNT]) % normal_cache_steps(D(s.fast[2]) * dt / s.dx) == 0:
        s.flag[FLAG_NORMALS_KEPT] = 0
    s.flag[FLAG_GOING] = 1
    if float(s.flag[FLAG_STRAYS]) <= OUT_OF_BLOCK_FRACTION * float(s.particles):
        s.flag[FLAG_STEPPING] = 1
    return 0


@wp.kernel
def begin_frame(s: StepGlobals, r: DeviceRigidBodies, lanes: int):
    """Plan the first step up to UNTIL. One group."""
    plan_group(s, r, wp.tid(), lanes)


@wp.func
def enter_books(s: StepGlobals, pair: int):
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
            s.first_contact[a, b] = s.clock[CLOCK_TIME]
            s.first_contact[b, a] = s.clock[CLOCK_TIME]
            s.contact_point[a, b] = place
            s.contact_point[b, a] = place
        s.last_contact[a, b] = s.clock[CLOCK_TIME]
        s.last_contact[b, a] = s.clock[CLOCK_TIME]
        s.step_impulse[a, b] = D(0.0)
        s.step_place[a, b] = wp.vec3d(D(0.0))
    s.marked[a, b] = 0
    return 0


@wp.func
def book_step(s: StepGlobals, l: DeviceLoads):
    """Book a step that was taken."""
    dt = s.clock[CLOCK_DT]
    s.clock[CLOCK_TIME] = s.clock[CLOCK_TIME] + dt
    if s.clock[CLOCK_LAST_STEP] == D(1.0):
        s.clock[CLOCK_TIME] = s.clock[CLOCK_UNTIL]
    s.clock[CLOCK_COUNT] = s.clock[CLOCK_COUNT] + D(1.0)
    s.clock[CLOCK_SMALLEST] = wp.min(s.clock[CLOCK_SMALLEST], dt)
    s.clock[CLOCK_LARGEST] = wp.max(s.clock[CLOCK_LARGEST], dt)
    for i in range(2):
        s.fast[2 + i] = s.fast[i]
        s.fast[i] = 0.0
    s.loss[LOSS_VISCOUS, 0] = s.loss[LOSS_VISCOUS, 0] + l.loss[0]
    return 0


@wp.kernel
def finish_step(g: BlockGrid, r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals, stride: int, lanes: int):
    """End a step: link new blocks, empty clusters; and the first group books, and plans on."""
    link_blocks(g, s, wp.tid(), stride)
    for i in range(wp.tid(), 8 * s.flag[FLAG_BLOCKS], stride):
        for k in range(3):
            g.pool[k, i] = 0.0
    if wp.tid() >= lanes:
        return
    lane = wp.tid()
    if s.flag[FLAG_FULL] != 2:
        for k in range(lane, s.flag[FLAG_PAIRS], lanes):
            enter_books(s, s.met[k])
        for b in range(lane, s.bodies, lanes):
            s.external[b] = s.external[b] + s.mass[b] * s.kick[b] + l.external[b]
        wait_for_group()
        if lane == 0:
            book_step(s, l)
    wait_for_group()
    plan_group(s, r, lane, lanes)
