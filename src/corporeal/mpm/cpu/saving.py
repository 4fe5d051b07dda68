"""What a CPU engine keeps of itself by name, and takes back: fields, rigid bodies, clock, books."""

import re
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from corporeal.mpm.cpu.contact_memory import ContactMemory
from corporeal.mpm.cpu.window import Window
from corporeal.mpm.joining import Joined
from corporeal.mpm.ledger import Ledger
from corporeal.mpm.splitting import Heirs

Saved = dict[str, np.ndarray]

CLOCKED = ("count", "smallest", "largest", "speed", "wave")
"""What the clock remembers from step to step; the time stands before it."""
OWNER = re.compile(r"(?:field|rigid)(\d+)(?:\.|$)")
"""Number of the body in a name; each has a field of its own where bodies become several."""


@dataclass(frozen=True)
class Saving:
    """Where an engine's state is; arrays are read and written in place."""

    ledger: Ledger
    window: dict[int, Window]
    rigid: dict[int, np.ndarray]
    contact: ContactMemory
    clock: np.ndarray
    world: np.ndarray

    def save(self) -> Saved:
        """Copy everything needed to go on."""
        saved = {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
        for f, window in self.window.items():
            saved |= {f"field{f}.{k}": v for k, v in window.saved().items()}
        saved |= {f"rigid{b}": state.copy() for b, state in self.rigid.items()}
        saved["contact"], saved["choices"] = self.contact.past, self.contact.kept
        time = float(self.world["time"][0])
        saved["clock"] = np.array([time, *(float(self.clock[k][0]) for k in CLOCKED)])
        return saved

    def restore(self, saved: Saved) -> None:
        """Take everything back."""
        for name in self.ledger.as_arrays():
            getattr(self.ledger, name)[...] = saved[f"ledger.{name}"]
        self._restore_bodies(saved, self.window, self.rigid)
        time, *clocked = saved["clock"].tolist()
        self.world["time"] = time
        for name, value in zip(CLOCKED, clocked, strict=True):
            self.clock[name] = value

    def place_as(self, saved: Saved, fields: Collection[int], bodies: Collection[int]) -> None:
        """Take over some fields and rigid bodies, and how fast waves were there."""
        self._restore_bodies(saved, fields, self.rigid.keys() & set(bodies))
        self.contact.kept = np.zeros(0, np.uint8)  # who is here stands elsewhere there
        wave = float(saved["clock"][1 + CLOCKED.index("wave")])
        self.clock["wave"] = max(float(self.clock["wave"][0]), wave)

    def _restore_bodies(
        self, saved: Saved, fields: Collection[int], bodies: Collection[int]
    ) -> None:
        for f in fields:
            head = f"field{f}."
            own = {k.removeprefix(head): v for k, v in saved.items() if k.startswith(head)}
            self.window[f].restore(own)
        for b in bodies:
            self.rigid[b][:] = saved[f"rigid{b}"]
        self.contact.past = saved["contact"]
        # A checkpoint of before they were kept has none: then all are made anew.
        self.contact.kept = saved.get("choices", np.zeros(0, np.uint8))


def inherited(own: Saved, saved: Saved, heirs: Heirs) -> Saved:
    """Return the state of an engine with pieces: their own, of all else what was saved before.

    Args:
        own: Of the engine as it was built, with the pieces where they are.
        saved: Of the engine before, of whose bodies one is several now.
        heirs: Who comes of whom.

    """
    books = {f"ledger.{name}": v for name, v in heirs.inherited(_books(saved)).items()}
    return own | _of_bodies(saved, heirs.whole) | books | {"clock": saved["clock"]}


def joined(own: Saved, saved: Saved, who: Joined, shared: bool) -> Saved:
    """Return the state of an engine with more bodies: their own, of all else what was saved before.

    In a field that all share, ``Window.continue_as`` takes particles over by number afterwards.

    Args:
        own: Of the engine as it was built, with those that join where they are.
        saved: Of the engine before.
        who: Which bodies were there.
        shared: Whether all bodies share one field.

    """
    books = who.inherited(_books(saved))
    clock, mine = saved["clock"].copy(), own["clock"]
    for name in ("speed", "wave"):  # of whoever is fastest
        k = 1 + CLOCKED.index(name)
        clock[k] = max(clock[k], mine[k])
    kept = _of_bodies(saved, who.whole)
    if shared:
        kept = {name: value for name, value in kept.items() if not name.startswith("field0.")}
    return own | kept | {f"ledger.{k}": v for k, v in books.items()} | {"clock": clock}


def _books(saved: Saved) -> Saved:
    return {k.removeprefix("ledger."): v for k, v in saved.items() if k.startswith("ledger.")}


def _of_bodies(saved: Saved, bodies: Collection[int]) -> Saved:
    owner = {name: OWNER.match(name) for name in saved}
    return {name: saved[name] for name, found in owner.items() if found and int(found[1]) in bodies}
