"""A scene made ready to simulate, and the same scene with how it moved."""

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
    """What is in it, in words."""
    parts: Parts
    field: MaterialField
    """What every part is made of, with ranges and sources."""
    particles: Particles

    def broken(self, breaks: Sequence[FractureEvent]) -> "PreparedScene":
        """Return it with the pieces of what broke as objects."""
        filled = apply_breaks(
            SceneWithMaterials(self.scene, self.parts, self.field), self.particles, breaks
        )
        scene, parts, field = filled.whole.all
        return PreparedScene(scene, self.inventory, parts, field, filled.particles)


@dataclass(frozen=True)
class SimulationResult:
    """A prepared scene, and how it moved."""

    prepared: PreparedScene
    trajectory: Trajectory
    """Frames are read from disk when asked for."""
    reconstruction: Reconstruction | None = None
    """What the scene was made of, where its objects stand now; None: it was made of surfaces."""

    @cached_property
    def outcome(self) -> Outcome:
        """What happened to every object and pair: falls, rebounds, dents, distances."""
        made = self.prepared
        return measure_outcome(made.scene, made.particles, made.field, self.trajectory)
