"""Checkpoints of the CPU engine: fields, rigid bodies, clock, ledgers."""

import re
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from corporeal.mpm.add_bodies import AddedBodies
from corporeal.mpm.body_changes import BodyChange
from corporeal.mpm.cpu.contact_memory import ContactMemory
from corporeal.mpm.cpu.field_window import FieldWindow
from corporeal.mpm.cpu.shell_records import ShellRecords
from corporeal.mpm.ledger import EngineLedger

SavedArrays = dict[str, np.ndarray]

CLOCK_FIELDS = ("count", "smallest", "largest", "speed", "wave")
"""What the clock remembers from step to step; the time stands before it."""
BODY_NUMBER_PATTERN = re.compile(r"(?:field|rigid|shell)(\d+)(?:\.|$)")
"""Number of the body in a name; each has a field of its own where bodies become several."""


@dataclass(frozen=True)
class EngineCheckpoint:
    """Where an engine's state is; arrays are read and written in place."""

    ledger: EngineLedger
    window: dict[int, FieldWindow]
    rigid: dict[int, np.ndarray]
    contact: ContactMemory
    shells: ShellRecords
    clock: np.ndarray
    world: np.ndarray

    def save(self) -> SavedArrays:
        """Copy everything needed to go on."""
        saved = {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
        for f, window in self.window.items():
            saved |= {f"field{f}.{k}": v for k, v in window.saved().items()}
        saved |= {f"rigid{b}": state.copy() for b, state in self.rigid.items()}
        saved |= self.shells.saved()
        saved["contact"], saved["choices"] = self.contact.past, self.contact.kept
        time = float(self.world["time"][0])
        saved["clock"] = np.array([time, *(float(self.clock[k][0]) for k in CLOCK_FIELDS)])
        return saved

    def restore(self, saved: SavedArrays) -> None:
        """Take everything back."""
        for name in self.ledger.as_arrays():
            getattr(self.ledger, name)[...] = saved[f"ledger.{name}"]
        self._restore_bodies(saved, self.window, self.rigid)
        self.shells.restore(saved, self.shells.bodies)
        time, *clocked = saved["clock"].tolist()
        self.world["time"] = time
        for name, value in zip(CLOCK_FIELDS, clocked, strict=True):
            self.clock[name] = value

    def place_as(self, saved: SavedArrays, fields: Collection[int], bodies: Collection[int]) -> None:
        """Take over some fields and rigid bodies, and how fast waves were there."""
        self._restore_bodies(saved, fields, self.rigid.keys() & set(bodies))
        self.contact.kept = np.zeros(0, np.uint8)  # the order of particles differs there
        wave = float(saved["clock"][1 + CLOCK_FIELDS.index("wave")])
        self.clock["wave"] = max(float(self.clock["wave"][0]), wave)

    def _restore_bodies(self, saved: SavedArrays, fields: Collection[int], bodies: Collection[int]) -> None:
        for f in fields:
            head = f"field{f}."
            own = {k.removeprefix(head): v for k, v in saved.items() if k.startswith(head)}
            self.window[f].restore(own)
        for b in bodies:
            self.rigid[b][:] = saved[f"rigid{b}"]
        self.contact.past = saved["contact"]
        # A checkpoint of before they were kept has none: then all are made anew.
        self.contact.kept = saved["choices"]


def continued(own: SavedArrays, saved: SavedArrays, change: BodyChange, shared: bool) -> SavedArrays:
    """Return the state of an engine with other bodies: their own, of all else what was saved.

    In a field that all share, ``Window.continue_as`` takes particles over by number afterwards.

    Args:
        own: Of the engine as it was built, with new bodies or pieces where they are.
        saved: Of the engine before.
        change: Who comes of whom.
        shared: Whether all bodies share one field.
    """
    books = {f"ledger.{k}": v for k, v in change.inherited(_ledger_arrays(saved)).items()}
    kept = _select_bodies(saved, change.whole)
    if shared:
        kept = {name: value for name, value in kept.items() if not name.startswith("field0.")}
    clock = saved["clock"].copy()
    if isinstance(change, AddedBodies):  # pieces are as fast as what they come of
        for name in ("speed", "wave"):
            k = 1 + CLOCK_FIELDS.index(name)
            clock[k] = max(clock[k], own["clock"][k])
    return own | kept | books | {"clock": clock}


def _ledger_arrays(saved: SavedArrays) -> SavedArrays:
    return {k.removeprefix("ledger."): v for k, v in saved.items() if k.startswith("ledger.")}


def _select_bodies(saved: SavedArrays, bodies: Collection[int]) -> SavedArrays:
    owner = {name: BODY_NUMBER_PATTERN.match(name) for name in saved}
    return {name: saved[name] for name, found in owner.items() if found and int(found[1]) in bodies}
