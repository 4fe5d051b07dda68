"""A field's window on the grid: particles sorted into blocks of 4³ cells, and the nodes they reach.

The window follows its particles: every sort places it anew around them, so the world has no walls of its own. Blocks
that no particle reaches take no memory.
"""

from functools import cached_property

import numpy as np

from corporeal.core.errors import SimulationError
from corporeal.mpm.cpu.layout import (
    BLOCK_INTEGERS,
    CHANNELS,
    DE,
    HISTORY_CHANNELS,
    ID,
    MAXWELL_CHANNELS,
    MT,
    OWN_BLOCK,
    PLACE,
    TM,
    VE,
    XI,
)
from corporeal.mpm.cpu.native_tables import FieldMaterials
from corporeal.mpm.cpu.particle_sorter import ParticleSorter
from corporeal.mpm.cpu.program import aligned_zeros
from corporeal.mpm.problem import Problem

MAX_WINDOW_BLOCKS = (1 << (31 - PLACE)) // 4 - 4
"""Blocks that a window may span before places overflow."""
NATIVE_ARRAYS = tuple("part history branch node next table block where used home box have".split())
"""Arrays that the native pieces work in."""
SAVED_ARRAYS = ("part", "history", "branch", "origin", "dim", "table", "where", "block")
"""What the next step depends on."""


class FieldWindow:
    """Particles of one velocity field, in batches of eight, and the table of its node blocks."""

    part: np.ndarray
    """Channels of all particles, (batches, CHANNELS, 8)."""
    history: np.ndarray
    """What material that flows or is nearly incompressible remembers besides, (batches, HISTORY, 8); empty without any.
    """
    branch: np.ndarray
    """What Maxwell branches remember, (batches, MEMORY, 8); empty without any."""
    block: np.ndarray
    """Records of particle blocks, (blocks, BLOCK)."""
    table: np.ndarray
    """Number of each node block, -1: none."""
    where: np.ndarray
    """Coordinates of node blocks, (blocks, 4); the last stands for unreached ones."""
    used: np.ndarray
    """Which of the two sets of nodes hold anything in each node block: bits."""
    have: np.ndarray
    """Which nodes of each node block hold mass: bits."""
    box: np.ndarray
    """Lowest and highest places of the particles of each block, (blocks, 6)."""
    home: np.ndarray
    """Block of particles at each node block, -1: none."""
    out_of_block: float
    """Share of particles that stood outside of their blocks when it was surveyed."""
    dim: np.ndarray
    """Size of the table."""
    fits: bool
    relieves: bool
    """Whether the history, where there is any, is that of nearly incompressible material."""

    def __init__(self, place: np.ndarray, rows: np.ndarray, material: FieldMaterials, sorter: ParticleSorter) -> None:
        """Sort particles into a first window.

        Args:
            place: Positions in cells, (P, 3).
            rows: All other channels, (P, CHANNELS); places are filled in here.
            material: What they are made of.
            sorter: Who sorts.
        """
        self.count, self.sorter = len(rows), sorter
        corner = np.floor(place.min(axis=0) / 4).astype(np.int64) - 1
        self.origin = corner.astype(np.int32)
        self.node = self.next = aligned_zeros((0, 64, 8), np.float32)
        fixed = np.rint((place - 4 * corner) * (1 << PLACE)).astype(np.int64)
        self.fits = bool((np.abs(fixed) < 2**31).all())
        if not self.fits:
            return
        rows = rows.astype(np.float32)
        rows[:, XI : XI + 3] = fixed.astype(np.int32).view(np.float32)
        batches = -(-len(rows) // 8)
        self.part = aligned_zeros((batches, CHANNELS, 8), np.float32)
        self.part.transpose(0, 2, 1)[np.arange(len(rows)) // 8, np.arange(len(rows)) % 8] = rows
        self.relieves = not material.flows
        recalls = material.flows or material.uses_mean_dilatation
        self.history = aligned_zeros((batches if recalls else 0, HISTORY_CHANNELS, 8), np.float32)
        self.relax(material)
        self.block = np.zeros((1, BLOCK_INTEGERS), np.int32)
        self.block[0, 1] = len(rows)
        self.kinds = int(rows[:, MT].view(np.int32).max()) + 1
        self.sort()

    def relax(self, material: FieldMaterials) -> None:
        """Let Maxwell branches, where the material has any, remember nothing."""
        batches = len(self.part) if material.relaxes else 0
        self.branch = aligned_zeros((batches, MAXWELL_CHANNELS, 8), np.float32)

    def survey(self) -> bool:
        """Whether a particle is not finite or left the domain."""
        lost, self.out_of_block = self.sorter.survey(self)
        return lost

    def sort(self) -> bool:
        """Sort again and move the window; False when its particles no longer fit into one."""
        self.survey()
        self.fits = self.sorter.arrange(self, MAX_WINDOW_BLOCKS)
        self.__dict__.pop("slot", None)
        if self.fits:
            self._make_room()
        return self.fits

    def _make_room(self) -> None:
        """Have nodes enough, in which whatever was there before still stands."""
        self.used = np.full(len(self.where), 3, np.int32)
        self.have = np.zeros(len(self.where), np.uint64)
        self.box = np.zeros((len(self.block), 6), np.int32)
        self.home = np.full(len(self.where), -1, np.int32)
        self.home[self.block[:, OWN_BLOCK]] = np.arange(len(self.block))
        if len(self.node) >= len(self.where):
            return
        blocks = len(self.where) * 9 // 8
        self.node = aligned_zeros((blocks, 64, 8), np.float32)
        self.next = aligned_zeros((blocks, 64, 8), np.float32)

    def continue_as(self, before: "FieldWindow", material: FieldMaterials) -> None:
        """Take place, motion, strain and memory of the particles of another window, by number.

        Args:
            before: Of the first of this one's particles.
            material: What this one's are made of.
        """
        slot = np.empty(self.count, np.int64)
        slot[self.number] = self.slot
        to, at = slot[before.number], before.slot
        rows = before._rows(before.part)
        shift = 4 * (before.origin.astype(np.int64) - self.origin) << PLACE
        rows[:, XI : XI + 3] = _shifted_places(rows[:, XI : XI + 3], shift)
        kept = [k for k in range(CHANNELS) if k not in (MT, ID)]
        for k in kept:  # what they are made of is counted anew
            self.part[to // 8, k, to % 8] = rows[:, k]
        if material.flows:
            # Where nothing flowed, the motion so far is the strain.
            past = np.zeros((before.count, HISTORY_CHANNELS), np.float32)
            past[:, TM : TM + 9] = rows[:, DE : DE + 9]
            if len(before.history) and not before.relieves:
                past = before._rows(before.history)
            for k in range(HISTORY_CHANNELS):
                self.history[to // 8, k, to % 8] = past[:, k]
        if len(before.branch):
            self.branch[to // 8, :, to % 8] = before.branch[at // 8, :, at % 8]
        self.sort()

    @cached_property
    def slot(self) -> np.ndarray:
        """Slots in use, in order."""
        runs = [np.arange(low, high) for low, high in self.block[:, :2].tolist()]
        return np.concatenate(runs)

    @property
    def number(self) -> np.ndarray:
        """Which particle stands in each used slot."""
        return self.channel(ID, 1)[:, 0].view(np.int32)

    def channel(self, first: int, width: int) -> np.ndarray:
        """Copy some channels of every particle, in slot order, (P, width)."""
        return self._rows(self.part[:, first : first + width])

    def past(self, first: int, width: int) -> np.ndarray:
        """Copy some channels of what material that flows remembers; 0 where nothing flows."""
        if not len(self.history):
            return np.zeros((self.count, width), np.float32)
        return self._rows(self.history[:, first : first + width])

    def _rows(self, part: np.ndarray) -> np.ndarray:
        return part.transpose(0, 2, 1).reshape(-1, part.shape[1])[self.slot]

    def position(self) -> np.ndarray:
        """Positions in cells, (P, 3)."""
        fixed = self.channel(XI, 3).view(np.int32)
        return fixed / float(1 << PLACE) + 4.0 * self.origin

    def add_velocity(self, gained: np.ndarray) -> float:
        """Add to particles' velocities [m/s], in slot order; give the fastest of all then."""
        velocity = self.channel(VE, 3) + gained
        self._write_velocity(self.slot, velocity)
        return float(np.linalg.norm(velocity, axis=1).max())

    def set_motion(self, chosen: np.ndarray, velocity: np.ndarray) -> None:
        """Give some particles, in slot order, a velocity [m/s] and no velocity gradient."""
        slot = self.slot[chosen]
        self.part[slot // 8, VE:DE, slot % 8] = 0.0
        self._write_velocity(slot, velocity)

    def _write_velocity(self, slot: np.ndarray, velocity: np.ndarray) -> None:
        for k in range(3):
            self.part[slot // 8, VE + k, slot % 8] = velocity[:, k]

    def columns(self, height: int) -> np.ndarray:
        """List pieces of columns of blocks, (R, 6).

        Their x, y, number in the column, first and last block, and how many particles they hold.
        """
        at = self.block[:, 2:5].copy()
        at[:, 2] = (at[:, 2] - 1) // height
        first = np.flatnonzero(np.r_[True, (at[1:] != at[:-1]).any(axis=1)])
        last = np.r_[first[1:], len(at)]
        end = np.cumsum(self.block[:, 1] - self.block[:, 0])
        held = end[last - 1] - np.r_[0, end[last[:-1] - 1]]
        return np.column_stack([at[first], first, last, held])

    def saved(self) -> dict[str, np.ndarray]:
        """Everything that the next step depends on."""
        return {name: getattr(self, name).copy() for name in SAVED_ARRAYS}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Take back what ``saved`` gave."""
        for name, value in saved.items():
            copy = aligned_zeros(value.shape, value.dtype)
            copy[...] = value
            setattr(self, name, copy)
        self.fits = True
        self.__dict__.pop("slot", None)
        self._make_room()


def _shifted_places(place: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Shift fixed-point places, which float32 channels hold."""
    fixed = np.ascontiguousarray(place).view(np.int32).astype(np.int64) + shift
    if (np.abs(fixed) >= 2**31).any():
        raise SimulationError("The added body is too far from the others for one grid. Add it nearer.")
    return fixed.astype(np.int32).view(np.float32)


def window_too_wide_error(problem: Problem, bodies: list[int], time: float) -> str:
    """State that some bodies no longer fit into one window."""
    names = " and ".join(repr(problem.bodies[b].name) for b in bodies)
    return (
        f"At t = {time:.4g} s {names} no longer fits into one grid: it spans more than 500 cells. "
        "Use less detail, a shorter time, or contact='multi'."
    )
