"""A prepared scene, and its simulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from corporeal.core.audit_data import Outcome
from corporeal.core.types import (
    FractureEvent,
    Inventory,
    MaterialField,
    Particles,
    Parts,
    Reconstruction,
    Scene,
    Trajectory,
)
from corporeal.scene.fractured_scene import apply_breaks
from corporeal.scene.vessel_contents import SceneWithMaterials
from corporeal.simulation.outcome import measure_outcome


@dataclass(frozen=True)
class PreparedScene:
    """A scene with its materials and material points, ready to be simulated."""

    scene: Scene
    inventory: Inventory
    """Description of its parts."""
    parts: Parts
    field: MaterialField
    """Materials of all parts, with ranges and sources."""
    particles: Particles

    def broken(self, breaks: Sequence[FractureEvent]) -> "PreparedScene":
        """Return it with fragments as objects."""
        filled = apply_breaks(SceneWithMaterials(self.scene, self.parts, self.field), self.particles, breaks)
        scene, parts, field = filled.whole.all
        return PreparedScene(scene, self.inventory, parts, field, filled.particles)


@dataclass(frozen=True)
class SimulationResult:
    """A prepared scene, and its motion."""

    prepared: PreparedScene
    trajectory: Trajectory
    """Frames are read from disk when asked for."""
    reconstruction: Reconstruction | None = None
    """The reconstruction, moved to the objects' places; None: the scene was not reconstructed."""

    @cached_property
    def outcome(self) -> Outcome:
        """Outcome of every object and pair: falls, rebounds, dents, distances."""
        made = self.prepared
        return measure_outcome(made.scene, made.particles, made.field, self.trajectory)
