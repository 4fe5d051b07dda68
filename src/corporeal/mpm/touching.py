"""How the production engine is touched from outside: it changes velocities in place."""

from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm import rigid, tables
from corporeal.mpm.grip import Hold, check, regripped, take_hold, take_hold_of_rigid
from corporeal.mpm.kernels import VE
from corporeal.types import Vector

if TYPE_CHECKING:
    from corporeal.mpm.warp import WarpEngine


def hold(engine: "WarpEngine", body: int, point: Vector) -> Hold:
    """Take hold of a body at a point [m]."""
    if body in engine.rigid:
        state = engine.rigid[body]
        turn = state[tables.TURN : tables.TURN + 9].reshape(3, 3)
        centre = state[tables.CENTRE : tables.CENTRE + 3]
        return take_hold_of_rigid(engine.mass[body], centre, turn, point)
    mine = slice(engine.first[body], engine.first[body + 1])
    place = engine.snapshot().position[mine]
    return take_hold(engine.problem.bodies[body], place, point, engine.problem.cell)


def poke(engine: "WarpEngine", body: int, point: Vector, impulse: Vector) -> None:
    """Give a body an impulse [N s]; nodes that were laid with the old velocities are void."""
    check(engine.problem, body, point, impulse)
    before, held = engine.measure().kinetic[body], hold(engine, body, point)
    if body in engine.rigid:
        _strike(engine.rigid[body], held, np.array(impulse, np.float64))
    else:
        _push(engine, body, held, np.array(impulse, np.float64))
    engine.clock["laid"] = 0
    engine.ledger.external_impulse[body] += impulse
    engine.ledger.push_work += engine.measure().kinetic[body] - before


def drag(engine: "WarpEngine", body: int, point: Vector | None, pull: tuple[Vector, float]) -> None:
    """Pull on a body towards a target [m] by a spring of some stiffness [N/m]."""
    check(engine.problem, body, point, pull[0])
    held = None if point is None else hold(engine, body, point)
    engine.grips = regripped(engine.grips, body, held, pull, engine.mass[body])
    engine.book()
    engine.springs.grasp(engine.grips)
    engine.springs.connect(engine.world)


def _push(engine: "WarpEngine", body: int, held: Hold, impulse: np.ndarray) -> None:
    matter = engine.problem.bodies[body]
    window = engine.window[0 if engine.problem.contact == "single" else body]
    mass = (matter.volume * matter.density)[held.particle]
    gained = np.zeros((engine.first[-1], 3))
    gained[engine.first[body] + held.particle] = held.share[:, None] * impulse / mass[:, None]
    velocity = window.channel(VE, 3) + gained[window.number]
    batch, lane = window.slot // 8, window.slot % 8
    for k in range(3):
        window.part[batch, VE + k, lane] = velocity[:, k]
    fastest = float(np.linalg.norm(velocity, axis=1).max())
    engine.clock["speed"] = max(float(engine.clock["speed"][0]), fastest)


def _strike(state: np.ndarray, held: Hold, impulse: np.ndarray) -> None:
    turn = state[tables.TURN : tables.TURN + 9].reshape(3, 3)
    state[tables.SPEED : tables.SPEED + 3] += impulse / state[0]
    state[tables.MOMENT : tables.MOMENT + 3] += np.cross(turn @ held.arm, impulse)
    rest = np.linalg.inv(state[tables.REST : tables.REST + 9].reshape(3, 3))
    inverse = rigid.world_inverse_inertia(turn, rest)
    spin = inverse @ state[tables.MOMENT : tables.MOMENT + 3]
    state[tables.SPIN : tables.SPIN + 3] = spin
