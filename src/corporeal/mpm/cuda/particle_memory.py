"""Memory of particles: one array of 32-bit words, (channels, lanes).

Channels lie one after the other, each over all particles, so that neighbouring threads read neighbouring words, and
sorting is one kernel that knows no names. The host works with rows.
"""

from typing import Any

import numpy as np

from corporeal.mpm import constants
from corporeal.mpm.cuda import layout
from corporeal.mpm.cuda.device_memory import DeviceMemory, split_position
from corporeal.mpm.cuda.layout import DeviceParticles, wp
from corporeal.mpm.problem import Problem
from corporeal.mpm.state import ParticleConstants

WARP_LANES = 32
"""Channels begin where a warp's reads are one transaction a word."""
PARTICLE_STATE: dict[str, tuple[tuple[int, ...], Any]] = {
    "cell": ((3,), wp.int32),
    "place": ((3,), wp.float32),
    "velocity": ((3,), wp.float32),
    "affine": ((3, 3), wp.float32),
    "strain": ((3, 3), wp.float32),
    "motion": ((3, 3), wp.float32),
    "stress": ((6,), wp.float32),
    "mass": ((), wp.float32),
    "volume": ((), wp.float32),
    "plastic": ((), wp.float32),
    "opened": ((), wp.float32),
    "log_volume_ratio": ((), wp.float32),
    "pressure": ((), wp.float32),
    "branch": ((constants.BRANCHES * int(layout.BRANCH_CHANNELS),), wp.float32),
    "kind": ((), wp.int32),
    "field": ((), wp.int32),
    "number": ((), wp.int32),
}
"""What is kept of each particle: shape of a row, and type; their block follows."""
CHANNELS_SORTED_AT_ONCE = 16
"""Channels that are moved together when particles are sorted: so many are there twice."""
PARTICLE_CHANNELS = 1 + sum(int(np.prod(shape)) for shape, _ in PARTICLE_STATE.values())


def lay_out_particles(memory: DeviceMemory, problem: Problem, matter: ParticleConstants, chosen: np.ndarray) -> Any:
    """Lay out the particles that move with a grid of their own."""
    p = DeviceParticles()
    p.count = len(chosen)
    lanes = max(1, -(-p.count // WARP_LANES)) * WARP_LANES
    p.words = memory.zeros((PARTICLE_CHANNELS, lanes), wp.int32)
    first = 0
    for name, (shape, kind) in PARTICLE_STATE.items():
        width = int(np.prod(shape))
        typed = p.words if kind is wp.int32 else p.words.view(kind)
        setattr(p, name, typed[first : first + width] if shape else typed[first])
        first += width
    p.home = p.words[first]
    p.spare = memory.zeros((CHANNELS_SORTED_AT_ONCE, lanes), wp.int32)
    cell, place = split_position(_join_bodies(problem, "position")[chosen] / problem.cell)
    given = {
        "cell": cell,
        "place": place,
        "velocity": _join_bodies(problem, "velocity")[chosen],
        "mass": matter.mass[chosen],
        "volume": matter.volume[chosen],
        "kind": matter.kind[chosen],
        "field": matter.body[chosen] * (problem.contact != "single"),
        "number": chosen,
    }
    for name, rows in given.items():
        write_rows(p, name, rows)
    for name in ("grown", "bound"):
        setattr(p, name, memory.zeros(lanes, wp.float32))
    for name in ("cluster", "rank", "lost"):
        setattr(p, name, memory.zeros(lanes, wp.int32))
    p.table = memory.put(_materials(matter), wp.float32)
    return p


def read_rows(p: Any, name: str) -> np.ndarray:
    """Copy what is kept of all particles by a name to the host, (P, *shape)."""
    shape, _ = PARTICLE_STATE[name]
    values = getattr(p, name).numpy().reshape(-1, p.words.shape[1])[:, : p.count]
    return np.array(values.T, order="C").reshape(p.count, *shape)  # never a view


def write_rows(p: Any, name: str, values: np.ndarray) -> None:
    """Write rows of all particles, (P, *shape)."""
    array = getattr(p, name)
    there = array.numpy().reshape(-1, p.words.shape[1])
    there[:, : p.count] = np.asarray(values)[: p.count].reshape(p.count, len(there)).T
    array.assign(there.reshape(array.shape))


def overwrite_particles(p: Any, name: str, which: np.ndarray, values: np.ndarray | float) -> None:
    """Overwrite rows of some particles."""
    there = read_rows(p, name)
    there[which] = values
    write_rows(p, name, there)


def _join_bodies(problem: Problem, name: str) -> np.ndarray:
    return np.concatenate([getattr(body, name) for body in problem.bodies])


def _materials(matter: ParticleConstants) -> np.ndarray:
    """Write the rows that kernels read: see ``layout`` for the columns."""
    s = matter.substances
    table = np.zeros((len(s.body), layout.MATERIAL_COLUMNS))
    table[:, layout.LAW], table[:, layout.MU], table[:, layout.LAMBDA] = s.law, s.mu, s.lam
    table[:, layout.YIELD], table[:, layout.HARD] = s.yield_stress, s.hardening
    table[:, layout.CONE], table[:, layout.APEX] = s.cone, s.apex
    table[:, layout.DENSITY], table[:, layout.FORGET] = s.density, s.flip_damping_rate
    table[:, layout.STIFFENING] = s.stiffening
    table[:, layout.CONSISTENCY], table[:, layout.INDEX] = s.consistency, s.flow_index
    named = {layout.SHEAR: "shear", layout.BULK: "bulk", layout.RELAXATION: "time"}
    for first, name in named.items():
        column = getattr(s.branches, name)
        table[:, int(first) : int(first) + column.shape[1]] = column
    table[:, layout.MATERIAL_BODY], table[:, layout.RIGID] = s.body, s.rigid
    table[:, layout.USES_MEAN_DILATATION] = s.uses_mean_dilatation
    return table
