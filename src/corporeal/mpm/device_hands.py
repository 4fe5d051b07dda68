"""Touching what the device engine simulates: blows, springs that drag, and where it begins."""

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm.device_layout import PUSHING, wp
from corporeal.mpm.grip import Hold, check, regripped, take_hold, take_hold_of_rigid
from corporeal.types import Vector

if TYPE_CHECKING:
    from corporeal.mpm.device import DeviceEngine


def poke(engine: "DeviceEngine", body: int, point: Vector, impulse: Vector) -> None:
    """Give a body an impulse [N s] at a point [m]; enter it."""
    check(engine.problem, body, point, impulse)
    hold, given = _hold(engine, body, point), np.array(impulse, float)
    before = engine.measure().kinetic[body]
    if engine.problem.bodies[body].rigid:
        _strike(engine, body, hold, given)
    else:
        _push(engine, body, hold, given)
    sheet = engine.arrays.sheet
    _add(sheet.external, body, given)
    loss = sheet.loss.numpy()
    loss[PUSHING, 0] += engine.measure().kinetic[body] - before
    sheet.loss.assign(loss)


def _strike(engine: "DeviceEngine", body: int, hold: Hold, given: np.ndarray) -> None:
    r = engine.arrays.rigid
    arm = r.turn.numpy()[body] @ hold.arm
    moment = np.cross(arm, given)
    _add(r.speed, body, given / engine.matter.total[body])
    _add(r.moment, body, moment)
    _add(r.spin, body, r.inertia.numpy()[body] @ moment)


def _push(engine: "DeviceEngine", body: int, hold: Hold, given: np.ndarray) -> None:
    p, s, m = engine.arrays.particles, engine.arrays.sheet, engine.matter
    own = np.flatnonzero(m.body == body)[hold.particle]
    gained = np.zeros((len(m.mass), 3))
    gained[own] = hold.share[:, None] * given / m.mass[own][:, None]
    velocity = p.velocity.numpy()
    velocity[: p.count] += gained[p.number.numpy()[: p.count]]
    p.velocity.assign(velocity)
    fast = s.fast.numpy()
    fast[2] = max(fast[2], np.linalg.norm(velocity[: p.count], axis=1).max())
    s.fast.assign(fast)


def drag(
    engine: "DeviceEngine", body: int, point: Vector | None, target: Vector, stiffness: float
) -> None:
    """Pull on a body by a spring until told otherwise."""
    check(engine.problem, body, point, target)
    hold = None if point is None else _hold(engine, body, point)
    total = float(engine.matter.total[body])
    engine.grips = regripped(engine.grips, body, hold, (target, stiffness), total)
    _tell(engine)


def halt(engine: "DeviceEngine", bodies: Collection[int]) -> None:
    """Take all motion out of some bodies."""
    p, r = engine.arrays.particles, engine.arrays.rigid
    mine = np.isin(engine.matter.body[p.number.numpy()], list(bodies))
    for array in (p.velocity, p.affine):
        _change(array, mine, 0.0)
    for array in (r.speed, r.moment, r.spin):
        _change(array, np.array(list(bodies), int), 0.0)


def begin(engine: "DeviceEngine", saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
    """Put some bodies where they were in another engine's ``save``."""
    p, r, owner = engine.arrays.particles, engine.arrays.rigid, engine.matter.body
    there = np.empty(len(owner), int)
    there[saved["particle.number"][: p.count]] = np.arange(p.count)
    number = p.number.numpy()[: p.count]
    mine = np.flatnonzero(np.isin(owner[number], list(bodies)))
    for name in "cell place strain motion stress plastic opened".split():
        _change(getattr(p, name), mine, saved[f"particle.{name}"][there[number[mine]]])
    which = np.array(list(bodies), int)
    for name in "centre turn inertia".split():
        _change(getattr(r, name), which, saved[f"rigid.{name}"][which])
    riding = np.flatnonzero(np.isin(r.body.numpy(), which))
    for name in ("cell", "place"):
        _change(getattr(r, name), riding, saved[f"rigid.{name}"][riding])
    fast = engine.arrays.sheet.fast.numpy()
    fast[3] = max(fast[3], saved["sheet.fast"][3])
    engine.arrays.sheet.fast.assign(fast)


def _tell(engine: "DeviceEngine") -> None:
    """Put all grips on the device."""
    acting, m, bodies = engine.arrays.loads, engine.matter, len(engine.problem.bodies)
    columns = {name: np.zeros(bodies) for name in ("gripped", "spring", "brake", "grip_mass")}
    target, arm, share = np.zeros((bodies, 3)), np.zeros((bodies, 3)), np.zeros(len(m.mass))
    for b, grip in engine.grips.items():
        columns["gripped"][b], columns["grip_mass"][b] = 1, grip.hold.mass
        columns["spring"][b], columns["brake"][b] = grip.stiffness, grip.damping
        target[b], arm[b] = grip.target, grip.hold.arm
        if not engine.problem.bodies[b].rigid:
            share[np.flatnonzero(m.body == b)[grip.hold.particle]] = grip.hold.share
    for name, values in columns.items():
        getattr(acting, name).assign(values.astype(np.int32 if name == "gripped" else np.float64))
    acting.target.assign(target)
    acting.grip_arm.assign(arm)
    acting.share.assign(share.astype(np.float32))
    acting.blown.zero_()
    acting.external.zero_()
    engine.program.hold(bool(engine.grips))


def _hold(engine: "DeviceEngine", body: int, point: Vector) -> Hold:
    m, thing = engine.matter, engine.problem.bodies[body]
    if thing.rigid:
        r = engine.arrays.rigid
        centre, turn = r.centre.numpy()[body], r.turn.numpy()[body]
        return take_hold_of_rigid(float(m.total[body]), centre, turn, point)
    place = engine.snapshot().position[m.body == body]
    return take_hold(thing, place, point, engine.problem.cell)


def _add(array: wp.array, row: int, values: np.ndarray) -> None:
    """Add to one row on the device."""
    there = array.numpy()
    there[row] += values
    array.assign(there)


def _change(array: wp.array, rows: np.ndarray, values: np.ndarray | float) -> None:
    """Overwrite some rows on the device."""
    there = array.numpy()
    there[rows] = values
    array.assign(there)
