"""Results of the stages of a run, one typed field per stage."""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

from corporeal.core.types import Inventory, MaterialField, Particles, Parts, Reconstruction, Scene, Trajectory, Video
from corporeal.scene.fractured_scene import FilledScene, apply_breaks
from corporeal.scene.repose_reconstruction import repose_reconstruction
from corporeal.scene.vessel_contents import SceneWithMaterials, add_vessel_contents
from corporeal.simulation.audit_file import AUDIT_FILE
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

T = TypeVar("T")

RUN_FILES = (
    *("video.mp4", "report.html", "materials.json", AUDIT_FILE, "fields.png", "strip.png"),
    "close-up.png",
    *("ensemble.json", "ensemble.png"),
)
"""File names in a run's folder, besides the folders of its stages."""


@dataclass(frozen=True)
class StageResults:
    """Results of the stages; None: not run, or not needed.

    The fields carry the names of the stages. The properties raise LookupError if the stage has not been run.
    """

    reconstruct: Reconstruction | None = None
    assemble: Scene | None = None
    describe: Inventory | None = None
    segment: Parts | None = None
    ground: MaterialField | None = None
    fill: Particles | None = None
    simulate: Trajectory | None = None
    video: Video | None = None
    report: None = None

    def having(self, verb: str, made: Any) -> "StageResults":
        """Return the results with those of one more stage."""
        return replace(self, **{verb: made})

    @property
    def scene(self) -> Scene:
        """From assemble; later with movable contents and fragments as objects."""
        return self._filled.whole.scene if self._changes else _made(self.assemble, "assemble")

    @property
    def assembled(self) -> SceneWithMaterials:
        """Scene, parts and materials before fill: contents are still part of their vessels."""
        scene, parts = _made(self.assemble, "assemble"), _made(self.segment, "segment")
        return SceneWithMaterials(scene, parts, _made(self.ground, "ground"))

    @property
    def _changes(self) -> bool:
        pours = self.fill is not None and len(self.fill.contents) > 0
        return pours or (self.simulate is not None and len(self.simulate.breaks) > 0)

    @property
    def _filled(self) -> FilledScene:
        """With movable contents and fragments as objects."""
        particles = _made(self.fill, "fill")
        whole = add_vessel_contents(*self.assembled.all, particles.contents)
        breaks = () if self.simulate is None else self.simulate.breaks
        return apply_breaks(whole, particles, breaks)

    @property
    def inventory(self) -> Inventory:
        """From describe."""
        return _made(self.describe, "describe")

    @property
    def parts(self) -> Parts:
        """From segment."""
        return self._filled.whole.parts if self._changes else _made(self.segment, "segment")

    @property
    def field(self) -> MaterialField:
        """From ground."""
        return self._filled.whole.field if self._changes else _made(self.ground, "ground")

    @property
    def particles(self) -> Particles:
        """From fill; after the simulation with fragments."""
        return self._filled.particles if self._changes else _made(self.fill, "fill")

    @property
    def trajectory(self) -> Trajectory:
        """From simulate."""
        return _made(self.simulate, "simulate")

    @property
    def rendered_video(self) -> Video:
        """From video."""
        return _made(self.video, "video")

    @property
    def reconstruction(self) -> Reconstruction | None:
        """The reconstruction, moved to the objects' current places; None: the scene was not reconstructed."""
        return (
            None
            if self.reconstruct is None
            else repose_reconstruction(self.reconstruct, _made(self.assemble, "assemble"))
        )

    @property
    def rendered_reconstruction(self) -> Reconstruction | None:
        """The reconstruction for rendering; None if some objects have no Gaussians."""
        found = self.reconstruction
        whole = found is not None and len(found.names) == len(_made(self.assemble, "assemble").objects)
        return found if whole else None

    @property
    def prepared(self) -> PreparedScene:
        """Results up to fill."""
        return PreparedScene(self.scene, self.inventory, self.parts, self.field, self.particles)

    @property
    def played(self) -> SimulationResult:
        """Results up to simulate."""
        return SimulationResult(self.prepared, self.trajectory, self.rendered_reconstruction)


def _made(value: T | None, verb: str) -> T:
    if value is None:
        raise LookupError(f"{verb} has not been run")
    return value
