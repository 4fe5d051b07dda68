"""Simulate a scene of the showcase and give back what happened; shared by programs and tests."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.core.audit_data import Audit, Expectation, Outcome
from corporeal.core.store import read_meta
from corporeal.core.types import MaterialField, Particles, Scene, Trajectory
from corporeal.mpm.constants import PARTICLE_RADIUS_DX
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS, Settings
from corporeal.showcase.scene_expectations import compare_with_expectations
from corporeal.simulation.audit import reject_expectations
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.outcome import measure_outcome
from corporeal.simulation.trajectory_files import read_trajectory


@dataclass(frozen=True)
class Told:
    """One run of a scene, up to and with its simulation."""

    name: str
    scene: Scene
    particles: Particles
    field: MaterialField
    video: Trajectory
    audit: Audit
    seconds: float
    """Of simulating alone."""

    @cached_property
    def outcome(self) -> Outcome:
        """Who met whom, who was dented where, who bounced how high."""
        return measure_outcome(self.scene, self.particles, self.field, self.video)

    def expectations(self) -> list[Expectation]:
        """Compare what happened with what must be seen."""
        return list(reject_expectations(compare_with_expectations(self.name, self.outcome), self.audit))

    def gap(self, first: int, second: int) -> Float[np.ndarray, " F"]:
        """Distance between two objects at every frame [cells].

        The ledger's own is a lower bound, from bounding boxes, as long as they are far apart.
        """
        one, other = (self.particles.object == k for k in (first, second))
        cell = self.particles.cell
        nearest = [
            KDTree(frame.position[one]).query(frame.position[other])[0].min() / cell for frame in self.video.frames
        ]
        return np.array(nearest) - 2 * PARTICLE_RADIUS_DX


def tell(name: str, folder: Path, settings: Settings) -> Told:
    """Simulate a scene of the showcase; what lies in ``folder`` already is used again."""
    scene = run_pipeline.write_showcase(name, folder / "input")
    run_pipeline.run([scene], folder, settings, run_pipeline.no_progress_of_stage, until="simulate")
    return told(name, folder)


def told(name: str, folder: Path) -> Told:
    """Read back a scene of the showcase that was simulated."""
    simulated = folder / STAGE_FOLDERS["simulate"]
    prepared = run_pipeline.read_run(folder).prepared  # with what lies in vessels
    return Told(
        name,
        prepared.scene,
        prepared.particles,
        prepared.field,
        read_trajectory(simulated),
        read_audit(simulated),
        read_meta(simulated).seconds,
    )
