"""How one scene moves in one video: a prepared scene and its material at any instant."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Frame, Trajectory
from corporeal.pipeline.viewer_data import bind_scene
from corporeal.render.recording_format import SceneBinding
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

DIGEST_PARTICLES_PER_OBJECT = 8
"""Particles of each object that stand for its motion in a digest."""


@dataclass(frozen=True)
class VideoMotion:
    """What a video shows."""

    prepared: PreparedScene
    at: Callable[[float], Frame]
    """Instant [s] → where the material is then."""
    bound_as: "VideoMotion | None" = None
    """Another video of the same prepared scene, whose surfaces need not be bound again."""

    @cached_property
    def cast(self) -> SceneBinding:
        """Surfaces bound to particles."""
        return bind_scene(self.prepared) if self.bound_as is None else self.bound_as.cast

    @cached_property
    def members(self) -> list[Int[np.ndarray, " N"]]:
        """Particles of every object."""
        p = self.prepared
        return [np.flatnonzero(p.particles.object == k) for k in range(len(p.scene.objects))]

    def centres(self, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T B 3"]:
        """Centres of mass of all objects at some instants [m]."""
        mass = self.prepared.particles.mass
        rows = []
        for time in times.tolist():
            x = self.at(time).position.astype(float)
            rows.append([np.average(x[m], axis=0, weights=mass[m]) for m in self.members])
        return np.array(rows).reshape(len(rows), len(self.members), 3)

    def sampled(self, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T S 3"]:
        """Positions of a few particles of every object at some instants [m]."""
        few = [m[np.linspace(0, len(m) - 1, DIGEST_PARTICLES_PER_OBJECT).astype(int)] for m in self.members if len(m)]
        chosen = np.concatenate(few)
        return np.array([self.at(t).position[chosen] for t in times.tolist()], dtype=float)


def motion_of_run(played: SimulationResult) -> VideoMotion:
    """Show a run as it is: the nearest of its frames at each instant."""
    return VideoMotion(played.prepared, lambda time: nearest_frame(played.trajectory, time))


def nearest_frame(trajectory: Trajectory, time: float) -> Frame:
    """Return the frame that is nearest to an instant [s]."""
    return trajectory.frames[int(np.abs(trajectory.time - time).argmin())]


def object_diagonals(prepared: PreparedScene) -> Float[np.ndarray, " B"]:
    """Diagonal of every object's box at the start [m]."""
    p = prepared.particles
    mine = [p.position[p.object == k] for k in range(len(prepared.scene.objects))]
    return np.array([float(np.linalg.norm(np.ptp(x, axis=0))) if len(x) else 0.0 for x in mine])
