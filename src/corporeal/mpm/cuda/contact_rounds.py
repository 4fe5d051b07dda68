"""Impacts of rigid bodies on the device, in rounds: see ``physics.contact_impulses.solve_impacts``.

In every round the pairs that approach now rebound together, what is light is held by what it rests
on, and all others wait; the last round is of all contacts together.
"""

from corporeal.mpm import formulas
from corporeal.mpm.constants import FIELDS_AT_NODE, IMPACTS, VAST_DOUBLE
from corporeal.mpm.cuda.arena import meet
from corporeal.mpm.cuda.contact_impulses import slip_of
from corporeal.mpm.cuda.contact_nodes import is_stiff
from corporeal.mpm.cuda.layout import (
    DT,
    HITS,
    HOLDS,
    IMPACTING,
    LAST_ROUND,
    MEETS,
    ROUND,
    STRUCK,
    SWEEPING,
    SWEPT,
    SWEPT_NOW,
    TOUCHES,
    WAITING,
    D,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Rigid
from corporeal.mpm.cuda.layout_contact import Contacts
from corporeal.mpm.formulas.one_lane_contact import (
    BACKING_ROW,
    BACKING_SUMS,
    BOUNCE,
    FASTEST_BLOW,
    HELD_PAIR,
    LEAST,
    ROLE,
    STRUCK_PAIR,
    approach_of,
    backing_adds,
    backing_hold,
    backing_near,
    closing_speed,
    held_speed,
    impact_begins,
    impact_target,
)

wp.set_module_options(formulas.options(max_unroll=0))


@wp.func
def of_rigid(c: Contacts, t: int):
    """Whether a contact is solved with those of rigid bodies."""
    alone = c.meet[t] < 0
    if not alone:
        alone = c.stiff[c.meet[t]] == 1
    return alone


@wp.func
def both_rigid(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Whether a contact is of rigid bodies with one another or with a plane."""
    stiff = False
    if c.active[t] > 0:
        stiff = r.stiff[c.fa[t]] == 1 and is_stiff(r, s, c.fc[t])
    return stiff


@wp.func
def rebounds(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Whether a contact has a restitution."""
    stiff = both_rigid(c, r, s, t)
    if stiff:
        stiff = c.restitution[c.fa[t], c.fc[t]] > D(0.0)
    return stiff


@wp.func
def pair_of(c: Contacts, t: int):
    """Row of a contact's pair in a round."""
    return c.fa[t] * c.lightness.shape[0] + c.fc[t]


@wp.func
def kick_of(c: Contacts, s: Sheet, t: int):
    """Approach speed of two rigid sides that forces added in this step [m/s]."""
    kick = s.kick[c.fa[t]]
    if c.fc[t] < s.bodies:
        kick = kick - s.kick[c.fc[t]]
    return wp.dot(kick, wp.vec3d(c.normal[t]))


@wp.func
def feigned(c: Contacts, r: Rigid, t: int):
    """Speed at which a body that rolls on its surface points meets the next one [m/s]."""
    speed = D(0.0)
    if c.meet[t] < 0:
        b = c.fa[t]
        if c.facet[t] == 1:
            b = c.fc[t]
        speed = wp.length(r.spin[b]) * r.spacing[b]
    return speed


@wp.func
def closing_of(c: Contacts, r: Rigid, s: Sheet, t: int):
    """How fast a contact closes [m/s]."""
    return wp.dot(slip_of(c, r, s, t), wp.vec3d(c.normal[t]))


@wp.kernel
def strike(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Find the rigid pairs that are hit as things move now."""
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if rebounds(c, r, s, t):
            un = closing_of(c, r, s, t)
            approach = approach_of(un, kick_of(c, s, t), feigned(c, r, t))
            if impact_begins(approach, un, D(c.gap[t]), s.clock[DT]):
                pair = pair_of(c, t)
                c.rounds[pair, ROLE] = D(STRUCK_PAIR)
                wp.atomic_max(c.rounds, pair, FASTEST_BLOW, approach)
                s.flag[STRUCK] = 1


@wp.kernel
def find_least(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Find the nearest contact of each pair that is hit."""
    if s.flag[STRUCK] == 0:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if both_rigid(c, r, s, t):
            pair = pair_of(c, t)
            if c.rounds[pair, ROLE] == D(STRUCK_PAIR):
                wp.atomic_min(c.rounds, pair, LEAST, D(c.gap[t]))


@wp.kernel
def look_behind(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Add up where each pair's near contacts are."""
    if s.flag[STRUCK] == 0:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if both_rigid(c, r, s, t):
            pair = pair_of(c, t)
            least = D(0.0)
            if c.rounds[pair, ROLE] == D(STRUCK_PAIR):
                least = c.rounds[pair, LEAST]
            if backing_near(D(c.gap[t]), least, closing_of(c, r, s, t), s.dx):
                sums = backing_adds(c.point[t], wp.vec3d(c.normal[t]))
                for k in range(BACKING_ROW - BACKING_SUMS):
                    wp.atomic_add(c.rounds, pair, BACKING_SUMS + k, sums[k])


@wp.kernel
def begin_round(c: Contacts, r: Rigid, s: Sheet, lanes: int):
    """Begin the sweeps of a round; the last one is of all contacts together. One group."""
    lane = wp.tid()
    everything = c.lightness.shape[0]
    last = s.flag[STRUCK] == 0 or s.flag[ROUND] >= IMPACTS
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
    meet()
    if lane == 0:
        s.flag[LAST_ROUND] = int(last)
        s.flag[HOLDS] = 0
        s.flag[SWEEPING] = 1
        s.flag[SWEPT] = 0
        s.change[0] = 0.0
        s.pace[0] = D(1.0)
        s.pace[1] = D(0.0)
        s.pace[2] = D(0.0)
        if not last:
            s.flag[HITS] = 1
            backing_hold(c.rounds, c.restitution, c.blows, c.lightness, s.dx)
    meet()
    if not last:
        for pair in range(lane, everything * everything, lanes):
            if c.rounds[pair, ROLE] == D(HELD_PAIR):
                s.flag[HOLDS] = 1


@wp.kernel
def aim(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Say which contacts take part in a round, and what speed each may keep."""
    dt = s.clock[DT]
    for k in range(wp.tid(), s.flag[MEETS], stride):
        if c.stiff[k] == 1:
            for q in range(c.number[k]):
                c.last_velocity[k * FIELDS_AT_NODE + q] = c.velocity[k * FIELDS_AT_NODE + q]
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.active[t] > 0 and of_rigid(c, t):
            gap = D(c.gap[t])
            c.target[t] = closing_speed(gap, dt) - c.inward[t]
            c.active[t] = SWEPT_NOW
            if s.flag[LAST_ROUND] == 0:
                pair = pair_of(c, t)
                role = c.rounds[pair, ROLE]
                if role == D(0.0):
                    c.active[t] = WAITING
                elif role == D(HELD_PAIR):
                    c.target[t] = held_speed(gap, dt, s.dx)
                elif rebounds(c, r, s, t):
                    un = closing_of(c, r, s, t)
                    approach = approach_of(un, kick_of(c, s, t), feigned(c, r, t))
                    e = c.rounds[pair, BOUNCE]
                    c.target[t] = impact_target(e, approach, un, gap, dt, s.dx)


@wp.func
def forget_pair(c: Contacts, pair: int):
    """Forget what a pair had to do with impacts."""
    for k in range(BACKING_ROW):
        c.rounds[pair, k] = D(0.0)
    c.rounds[pair, LEAST] = D(VAST_DOUBLE)
    return 0


@wp.kernel
def end_round(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Keep a round's impulses, forget who was hit, and go on; end where all took part."""
    struck = s.flag[LAST_ROUND] == 0 or s.flag[ROUND] >= IMPACTS
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.active[t] > 0 and of_rigid(c, t):
            c.struck[t] = c.struck[t] + c.impulse[t]
            c.impulse[t] = wp.vec3d(D(0.0))
            c.last_impulse[t] = wp.vec3d(D(0.0))
            if struck and both_rigid(c, r, s, t):
                forget_pair(c, pair_of(c, t))
    if wp.tid() == 0:
        s.flag[ROUND] = s.flag[ROUND] + 1
        s.flag[STRUCK] = 0
        if s.flag[LAST_ROUND] == 1:
            s.flag[IMPACTING] = 0
