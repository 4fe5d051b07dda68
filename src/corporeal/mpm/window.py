"""A field's window on the grid: particles sorted into blocks of 4³ cells, and the nodes they reach.

The window follows its particles: every sort places it anew around them, so the world has no walls
of its own. Blocks that no particle reaches take no memory.
"""

import numpy as np

from corporeal.mpm.kernels import AF, BLOCK, ID, MA, MT, NC, NH, PLACE, VE, XI, aligned

HALF = 1 << (PLACE - 1)
LONGEST = (1 << (31 - PLACE)) // 4 - 4
"""Blocks that a window may span before places overflow."""
KEPT = ("part", "history", "slot", "start", "end", "origin", "dim", "table", "where", "block")
"""What the next step depends on."""
NEIGHBOURS = np.array(list(np.ndindex(3, 3, 3))) - 1


class Window:
    """Particles of one velocity field, in batches of eight, and the table of its node blocks."""

    def __init__(self, place: np.ndarray, rows: np.ndarray, flows: bool) -> None:
        """Sort particles into a first window.

        Args:
            place: Positions in cells, (P, 3).
            rows: All other channels, (P, NC); places are filled in here.
            flows: Whether any of them remembers what matter that flows does.

        """
        self.count = len(rows)
        corner = np.floor(place.min(axis=0) / 4).astype(np.int64) - 1
        self.origin = corner.astype(np.int32)
        self.node = self.next = aligned((0, 64, 8), np.float32)
        self.near = np.zeros(0, np.uint64)
        rows = rows.astype(np.float32)
        past = np.zeros((len(rows) if flows else 0, NH), np.float32)
        fixed = np.rint((place - 4 * corner) * (1 << PLACE)).astype(np.int64)
        self.fits = bool((np.abs(fixed) < 2**31).all())
        if self.fits:
            rows[:, XI : XI + 3] = fixed.astype(np.int32).view(np.float32)
            self._arrange(rows, past)

    def sort(self) -> bool:
        """Sort again and move the window; False when its particles no longer fit into one."""
        rows = self.part.transpose(0, 2, 1).reshape(-1, NC)
        past = self.history.transpose(0, 2, 1).reshape(-1, NH)
        self._arrange(rows[self.slot], past[self.slot] if len(past) else past)
        return self.fits

    def _arrange(self, rows: np.ndarray, past: np.ndarray) -> None:
        x = np.ascontiguousarray(rows[:, XI : XI + 3]).view(np.int32)
        base = (x - HALF) >> PLACE
        block = base >> 2
        shift = block.min(axis=0) - 1
        dim = block.max(axis=0) - shift + 2
        self.fits = bool((dim < LONGEST).all())
        if not self.fits:
            return
        x = x - ((4 * shift) << PLACE).astype(np.int32)
        rows[:, XI : XI + 3] = x.view(np.float32)
        self.origin = (self.origin + shift).astype(np.int32)
        self.dim = dim.astype(np.int32)
        block = block - shift
        line = (block[:, 0] * dim[1] + block[:, 1]) * dim[2] + block[:, 2]
        cell = base & 3
        inner = (cell[:, 0] * 4 + cell[:, 1]) * 4 + cell[:, 2]
        kind = np.ascontiguousarray(rows[:, MT]).view(np.int32)
        order = np.argsort((line.astype(np.int64) * (1 << 20) + kind) * 64 + inner, kind="stable")
        _, first, counts = np.unique(line[order], return_index=True, return_counts=True)
        self._fill(rows, past, order, first, counts)
        self._tabulate(block[order[first]], counts)

    def _fill(
        self,
        rows: np.ndarray,
        past: np.ndarray,
        order: np.ndarray,
        first: np.ndarray,
        counts: np.ndarray,
    ) -> None:
        """Copy rows into batches; what pads a batch stands where its block's first one does."""
        padded = (counts + 7) // 8 * 8
        start = np.cumsum(padded) - padded
        source = np.repeat(order[first], padded)
        self.slot = np.arange(self.count) + np.repeat(start - first, counts)
        source[self.slot] = order
        spread = rows[source]
        idle = np.ones(len(source), bool)
        idle[self.slot] = False
        spread[idle, MA] = 0.0
        spread[idle, ID] = np.array(-1, np.int32).view(np.float32)
        spread[idle, VE : AF + 9] = 0.0
        self.start, self.end = start, start + counts
        self.part = _batches(spread)
        self.history = _batches(past[source] if len(past) else past)

    def _tabulate(self, block: np.ndarray, counts: np.ndarray) -> None:
        """Give the node blocks that particle blocks reach numbers, and point to them."""
        around = block[:, None, :] + NEIGHBOURS
        table = np.full(tuple(self.dim), -1, np.int32)
        table[tuple(around.reshape(-1, 3).T)] = 0
        reached = np.argwhere(table == 0)
        table[tuple(reached.T)] = np.arange(len(reached))
        self.table = table
        self.where = np.zeros((len(reached), 4), np.int32)
        self.where[:, :3] = reached
        record = np.zeros((len(block), BLOCK), np.int32)
        record[:, 0], record[:, 1], record[:, 2:5] = self.start, self.end, block
        record[:, 5:] = table[tuple(around.reshape(-1, 3).T)].reshape(-1, 27)
        self.block = record
        if len(self.node) < len(reached):
            self._make_room(len(reached) * 3 // 2)

    def _make_room(self, blocks: int) -> None:
        self.node = aligned((blocks, 64, 8), np.float32)
        self.next = aligned((blocks, 64, 8), np.float32)
        self.near = np.zeros(2 * blocks, np.uint64)

    # ------------------------------------------------------------ reading

    @property
    def number(self) -> np.ndarray:
        """Which particle stands in each used slot."""
        return self.channel(ID, 1)[:, 0].view(np.int32)

    def channel(self, first: int, width: int) -> np.ndarray:
        """Copy some channels of every particle, in slot order, (P, width)."""
        return self._rows(self.part[:, first : first + width])

    def past(self, first: int, width: int) -> np.ndarray:
        """Copy some channels of what matter that flows remembers; 0 where nothing flows."""
        if not len(self.history):
            return np.zeros((self.count, width), np.float32)
        return self._rows(self.history[:, first : first + width])

    def _rows(self, part: np.ndarray) -> np.ndarray:
        return part.transpose(0, 2, 1).reshape(-1, part.shape[1])[self.slot]

    def write(self, first: int, values: np.ndarray) -> None:
        """Put values, in slot order, into some channels."""
        batch, lane = self.slot // 8, self.slot % 8
        for k in range(values.shape[1]):
            self.part[batch, first + k, lane] = values[:, k]

    def position(self) -> np.ndarray:
        """Positions in cells, (P, 3)."""
        fixed = self.channel(XI, 3).view(np.int32)
        return fixed / float(1 << PLACE) + 4.0 * self.origin

    def columns(self) -> np.ndarray:
        """List runs of blocks with the same first two coordinates: (R, 4) x, y, first, last."""
        at = self.block[:, 2:4]
        first = np.flatnonzero(np.r_[True, (at[1:] != at[:-1]).any(axis=1)])
        return np.column_stack([at[first], first, np.r_[first[1:], len(at)]])

    def saved(self) -> dict[str, np.ndarray]:
        """Everything that the next step depends on."""
        names = (
            "part",
            "history",
            "slot",
            "start",
            "end",
            "origin",
            "dim",
            "table",
            "where",
            "block",
        )
        return {name: getattr(self, name).copy() for name in names}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Take back what ``saved`` gave."""
        for name, value in saved.items():
            copy = aligned(value.shape, value.dtype)
            copy[...] = value
            setattr(self, name, copy)
        self.fits = True
        if len(self.node) < len(self.where):
            self._make_room(len(self.where) * 3 // 2)


def _batches(rows: np.ndarray) -> np.ndarray:
    """Rows (8 B, C) as batches of eight lanes, (B, C, 8)."""
    out = aligned((len(rows) // 8, rows.shape[1], 8), np.float32)
    out[...] = rows.reshape(-1, 8, rows.shape[1]).transpose(0, 2, 1)
    return out
