"""How the production engine is brought to rest, and begins where another one left things."""

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm import tables
from corporeal.mpm.kernels import DE, MT, VE
from corporeal.mpm.window import Window

if TYPE_CHECKING:
    from corporeal.mpm.warp import WarpEngine

MOTION = (
    *range(tables.SPEED, tables.SPEED + 3),
    *range(tables.MOMENT, tables.MOMENT + 3),
    *range(tables.SPIN, tables.SPIN + 3),
)
"""Places of a rigid state that say how it moves."""


def halt(engine: "WarpEngine", bodies: Collection[int]) -> None:
    """Take all motion out of some bodies; nodes that were laid with it are void."""
    for f, window in engine.window.items():
        own = np.isin(engine.body_of_material[f], list(bodies))
        mine = own[window.channel(MT, 1)[:, 0].view(np.int32)]
        _set_motion(window, mine, np.zeros((int(mine.sum()), 3)))
    for b in engine.rigid.keys() & set(bodies):
        engine.rigid[b][[*MOTION]] = 0.0
    engine.clock["laid"] = 0


def begin(engine: "WarpEngine", saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
    """Put some bodies of a fresh engine where they were in another's ``save``.

    In a field that all share, everything comes along.
    """
    given = np.concatenate([b.velocity for b in engine.problem.bodies])
    for f, window in engine.window.items():
        if set(bodies).isdisjoint(engine.members[f]):
            continue
        head = f"field{f}."
        window.restore({k.removeprefix(head): v for k, v in saved.items() if k.startswith(head)})
        _set_motion(window, np.ones(window.count, bool), given[window.number])
    for b in engine.rigid.keys() & set(bodies):
        state, start = engine.rigid[b], engine.rigid[b].copy()
        state[:] = saved[f"rigid{b}"]
        state[[*MOTION]] = start[[*MOTION]]
    engine.contact.past = saved["contact"]
    wave = saved["clock"][-1]
    engine.clock["wave"] = max(float(engine.clock["wave"][0]), float(wave))
    engine.connect()


def _set_motion(window: Window, mine: np.ndarray, velocity: np.ndarray) -> None:
    """Give particles, in slot order, a velocity and no velocity gradient."""
    slot = window.slot[mine]
    batch, lane = slot // 8, slot % 8
    window.part[batch, VE:DE, lane] = 0.0
    for k in range(3):
        window.part[batch, VE + k, lane] = velocity[:, k]
