"""Impacts of rigid bodies on the device, in rounds: see ``physics.contact_impulses.solve_impacts``.

In every round the pairs that approach now rebound together, what is light is held by what it rests on, and all others
wait; the last round is of all contacts together.
"""

from corporeal.mpm import formulas
from corporeal.mpm.constants import FIELDS_AT_NODE, MAX_IMPACTS_PER_STEP, VAST_DOUBLE
from corporeal.mpm.cuda.block_arena import wait_for_group
from corporeal.mpm.cuda.contact_impulses import contact_slip
from corporeal.mpm.cuda.contact_nodes import is_stiff
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    CONTACT_SWEPT,
    CONTACT_WAITING,
    FLAG_HITS,
    FLAG_HOLDS,
    FLAG_IMPACTING,
    FLAG_LAST_ROUND,
    FLAG_MEETS,
    FLAG_ROUND,
    FLAG_STRUCK,
    FLAG_SWEEPING,
    FLAG_SWEPT,
    FLAG_TOUCHES,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.formulas.one_lane_contact import (
    HELD_PAIR,
    STRUCK_PAIR,
    SUPPORT_IMPACT_SPEED,
    SUPPORT_LEAST_GAP,
    SUPPORT_RESTITUTION,
    SUPPORT_ROLE,
    SUPPORT_ROW,
    SUPPORT_SUMS,
    approach_of,
    closing_speed,
    impact_begins,
    impact_target,
    support_adds,
    support_hold,
    support_near,
    supported_speed,
)

wp.set_module_options(formulas.formula_options(max_unroll=0))


@wp.func
def of_rigid(c: DeviceContacts, t: int):
    """Whether a contact is solved with those of rigid bodies."""
    alone = c.meet[t] < 0
    if not alone:
        alone = c.stiff[c.meet[t]] == 1
    return alone


@wp.func
def both_rigid(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Whether a contact is of rigid bodies with one another or with a plane."""
    stiff = False
    if c.active[t] > 0:
        stiff = r.stiff[c.fa[t]] == 1 and is_stiff(r, s, c.fc[t])
    return stiff


@wp.func
def has_restitution(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Whether a contact has a restitution."""
    stiff = both_rigid(c, r, s, t)
    if stiff:
        stiff = c.restitution[c.fa[t], c.fc[t]] > D(0.0)
    return stiff


@wp.func
def pair_of(c: DeviceContacts, t: int):
    """Row of a contact's pair in a round."""
    return c.fa[t] * c.lightness.shape[0] + c.fc[t]


@wp.func
def kick_speed(c: DeviceContacts, s: StepGlobals, t: int):
    """Approach speed of two rigid sides that forces added in this step [m/s]."""
    kick = s.kick[c.fa[t]]
    if c.fc[t] < s.bodies:
        kick = kick - s.kick[c.fc[t]]
    return wp.dot(kick, wp.vec3d(c.normal[t]))


@wp.func
def rolling_speed(c: DeviceContacts, r: DeviceRigidBodies, t: int):
    """Speed at which a body that rolls on its surface points meets the next one [m/s]."""
    speed = D(0.0)
    if c.meet[t] < 0:
        b = c.fa[t]
        if c.facet[t] == 1:
            b = c.fc[t]
        speed = wp.length(r.spin[b]) * r.spacing[b]
    return speed


@wp.func
def closing_of(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """How fast a contact closes [m/s]."""
    return wp.dot(contact_slip(c, r, s, t), wp.vec3d(c.normal[t]))


@wp.kernel
def find_struck_pairs(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Find the rigid pairs that are hit as objects move now."""
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if has_restitution(c, r, s, t):
            un = closing_of(c, r, s, t)
            approach = approach_of(un, kick_speed(c, s, t), rolling_speed(c, r, t))
            if impact_begins(approach, un, D(c.gap[t]), s.clock[CLOCK_DT]):
                pair = pair_of(c, t)
                c.rounds[pair, SUPPORT_ROLE] = D(STRUCK_PAIR)
                wp.atomic_max(c.rounds, pair, SUPPORT_IMPACT_SPEED, approach)
                s.flag[FLAG_STRUCK] = 1


@wp.kernel
def find_least_gaps(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Find the nearest contact of each pair that is hit."""
    if s.flag[FLAG_STRUCK] == 0:
        return
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if both_rigid(c, r, s, t):
            pair = pair_of(c, t)
            if c.rounds[pair, SUPPORT_ROLE] == D(STRUCK_PAIR):
                wp.atomic_min(c.rounds, pair, SUPPORT_LEAST_GAP, D(c.gap[t]))


@wp.kernel
def sum_near_contacts(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Add up where each pair's near contacts are."""
    if s.flag[FLAG_STRUCK] == 0:
        return
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if both_rigid(c, r, s, t):
            pair = pair_of(c, t)
            least = D(0.0)
            if c.rounds[pair, SUPPORT_ROLE] == D(STRUCK_PAIR):
                least = c.rounds[pair, SUPPORT_LEAST_GAP]
            if support_near(D(c.gap[t]), least, closing_of(c, r, s, t), s.dx):
                sums = support_adds(c.point[t], wp.vec3d(c.normal[t]))
                for k in range(SUPPORT_ROW - SUPPORT_SUMS):
                    wp.atomic_add(c.rounds, pair, SUPPORT_SUMS + k, sums[k])


@wp.kernel
def begin_round(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, lanes: int):
    """Begin the sweeps of a round; the last one is of all contacts together. One group."""
    lane = wp.tid()
    everything = c.lightness.shape[0]
    last = s.flag[FLAG_STRUCK] == 0 or s.flag[FLAG_ROUND] >= MAX_IMPACTS_PER_STEP
    for b in range(lane, s.bodies, lanes):
        r.last_speed[b] = r.speed[b]
        r.last_moment[b] = r.moment[b]
    if not last:
        for b in range(lane, everything, lanes):
            c.lightness[b] = D(0.0)
            if b < s.bodies:
                c.lightness[b] = D(-1.0)
                if r.stiff[b] == 1:
                    c.lightness[b] = r.light[b]
    wait_for_group()
    if lane == 0:
        s.flag[FLAG_LAST_ROUND] = int(last)
        s.flag[FLAG_HOLDS] = 0
        s.flag[FLAG_SWEEPING] = 1
        s.flag[FLAG_SWEPT] = 0
        s.change[0] = 0.0
        s.pace[0] = D(1.0)
        s.pace[1] = D(0.0)
        s.pace[2] = D(0.0)
        if not last:
            s.flag[FLAG_HITS] = 1
            support_hold(c.rounds, c.restitution, c.restitution_law, c.lightness, s.dx)
    wait_for_group()
    if not last:
        for pair in range(lane, everything * everything, lanes):
            if c.rounds[pair, SUPPORT_ROLE] == D(HELD_PAIR):
                s.flag[FLAG_HOLDS] = 1


@wp.kernel
def set_targets(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Return which contacts take part in a round, and what speed each may keep."""
    dt = s.clock[CLOCK_DT]
    for k in range(wp.tid(), s.flag[FLAG_MEETS], stride):
        if c.stiff[k] == 1:
            for q in range(c.number[k]):
                c.last_velocity[k * FIELDS_AT_NODE + q] = c.velocity[k * FIELDS_AT_NODE + q]
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if c.active[t] > 0 and of_rigid(c, t):
            gap = D(c.gap[t])
            c.target[t] = closing_speed(gap, dt) - c.inward[t]
            c.active[t] = CONTACT_SWEPT
            if s.flag[FLAG_LAST_ROUND] == 0:
                pair = pair_of(c, t)
                role = c.rounds[pair, SUPPORT_ROLE]
                if role == D(0.0):
                    c.active[t] = CONTACT_WAITING
                elif role == D(HELD_PAIR):
                    c.target[t] = supported_speed(gap, dt, s.dx)
                elif has_restitution(c, r, s, t):
                    un = closing_of(c, r, s, t)
                    approach = approach_of(un, kick_speed(c, s, t), rolling_speed(c, r, t))
                    e = c.rounds[pair, SUPPORT_RESTITUTION]
                    c.target[t] = impact_target(e, approach, un, gap, dt, s.dx)


@wp.func
def forget_pair(c: DeviceContacts, pair: int):
    """Forget what a pair had to do with impacts."""
    for k in range(SUPPORT_ROW):
        c.rounds[pair, k] = D(0.0)
    c.rounds[pair, SUPPORT_LEAST_GAP] = D(VAST_DOUBLE)
    return 0


@wp.kernel
def end_round(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Keep a round's impulses, forget who was hit, and go on; end where all took part."""
    struck = s.flag[FLAG_LAST_ROUND] == 0 or s.flag[FLAG_ROUND] >= MAX_IMPACTS_PER_STEP
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if c.active[t] > 0 and of_rigid(c, t):
            c.struck[t] = c.struck[t] + c.impulse[t]
            c.impulse[t] = wp.vec3d(D(0.0))
            c.last_impulse[t] = wp.vec3d(D(0.0))
            if struck and both_rigid(c, r, s, t):
                forget_pair(c, pair_of(c, t))
    if wp.tid() == 0:
        s.flag[FLAG_ROUND] = s.flag[FLAG_ROUND] + 1
        s.flag[FLAG_STRUCK] = 0
        if s.flag[FLAG_LAST_ROUND] == 1:
            s.flag[FLAG_IMPACTING] = 0
