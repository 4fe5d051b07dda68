"""Runs of a showcase scene with one known fault: simulated, or made from the frames of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from video_judge.simulated_controls import SIMULATED_CONTROLS, simulate_control

from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.simulation.simulation_result import SimulationResult

HEIGHT_LEFT = 0.7
ASIDE = 0.1
FIXED = ("centre", "momentum", "gap")


@dataclass
class Changed(Sequence):
    """Frames of a trajectory, changed one by one when they are read."""

    frames: object
    change: object

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, index):
        return replace(self.frames[index], position=self.change(index, self.frames[index].position))


def sound_run(name: str, folder: Path) -> Path:
    """Simulate a scene as it should be."""
    scene = run_pipeline.write_showcase(name, folder / "input")
    run_pipeline.run([scene], folder / "ours", Settings(), until="simulate")
    return folder / "ours"


def spoiled(fault: str, ours: Path) -> SimulationResult:
    """Return a run with one fault of ``expectations.SPOILERS``."""
    if fault in SIMULATED_CONTROLS:
        made = simulate_control(fault, ours, ours.parent / fault)
        assert made is not None, f"{fault} has no place in {ours}"
        return made
    return PLANTED[fault](run_pipeline.read_run(ours).played)


def frozen(played: SimulationResult) -> SimulationResult:
    """Let nothing move and nothing touch."""
    ledger = played.trajectory.ledger
    never = np.full_like(ledger.first_contact, np.nan)
    still = {f: np.broadcast_to(getattr(ledger, f)[:1], getattr(ledger, f).shape) for f in FIXED}
    first = np.array(played.trajectory.frames[0].position)
    changed = replace(ledger, first_contact=never, last_contact=never, **still)
    return with_frames(played, lambda k, x: first, changed)


def squashed(played: SimulationResult) -> SimulationResult:
    """Press every object down to seven tenths of its height in the second half."""
    return at_the_end(played, lambda x: squash(x))


def squash(x):
    low = x[:, 2].min()
    return np.column_stack([x[:, :2], low + HEIGHT_LEFT * (x[:, 2] - low)]).astype(x.dtype)


def toppled(played: SimulationResult) -> SimulationResult:
    """Lay every object on its side in the second half."""
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    return at_the_end(played, lambda x: ((x - x.mean(0)) @ turn.T + x.mean(0)).astype(x.dtype))


def shifted(played: SimulationResult) -> SimulationResult:
    """Move every object aside in the second half; its centre in the ledger, too."""
    first = played.trajectory.frames[0].position
    of = played.prepared.particles.object
    way = np.array([ASIDE * np.ptp(first[of == b], axis=0).max() for b in range(of.max() + 1)])
    centre = played.trajectory.ledger.centre.copy()
    half = len(centre) // 2
    centre[half:, :, 0] += way
    there = np.column_stack([way[of], np.zeros((len(of), 2))]).astype(first.dtype)
    ledger = replace(played.trajectory.ledger, centre=centre)
    return with_frames(played, lambda k, x: x + there if k >= half else x, ledger)


def at_the_end(played, change):
    of, half = played.prepared.particles.object, len(played.trajectory.time) // 2

    def changed(k, x):
        if k < half:
            return x
        out = x.copy()
        for b in range(of.max() + 1):
            out[of == b] = change(x[of == b])
        return out

    return with_frames(played, changed, played.trajectory.ledger)


def with_frames(played, change, ledger) -> SimulationResult:
    frames = Changed(played.trajectory.frames, change)
    trajectory = replace(played.trajectory, frames=frames, ledger=ledger)
    return SimulationResult(played.prepared, trajectory)


PLANTED = {"frozen": frozen, "squashed": squashed, "toppled": toppled, "shifted": shifted}


def happened(played: SimulationResult):
    """Measure what happened."""
    return played.outcome
