"""State of a run with fracture."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import FractureEvent, MaterialField, Particles, Scene
from corporeal.discretization.build_model import ModelMapping
from corporeal.mpm.problem import BodySplit, Problem, Snapshot
from corporeal.scene.fractured_scene import fractured_field, fractured_particles, fractured_scene, piece_mass_fractions


@dataclass(frozen=True)
class FractureState:
    """Scene and problem including the fragments."""

    scene: Scene
    particles: Particles
    field: MaterialField
    posed: ModelMapping
    turned: Float[np.ndarray, "B 3 3"]
    """Rotation of each body when the problem's positions are those of its particles."""

    @classmethod
    def at_start(cls, scene: Scene, particles: Particles, field: MaterialField, posed: ModelMapping) -> "FractureState":
        """Return the state without fractures."""
        turned = np.broadcast_to(np.eye(3), (len(posed.problem.bodies), 3, 3))
        return cls(scene, particles, field, posed, turned)

    def rows(self, body: int) -> slice:
        """Where a body's particles are in the problem's order."""
        counts = [len(b.position) for b in self.posed.problem.bodies]
        first = sum(counts[:body])
        return slice(first, first + counts[body])

    def with_pieces(self, one: FractureEvent, split: BodySplit, problem: Problem, now: Snapshot) -> "FractureState":
        """Return the state with the fragments of a body as objects."""
        posed, body, more = self.posed, split.body, split.count - 1
        count = len(self.scene.objects)
        mine = self.rows(body)
        number = posed.order[mine]
        order = np.concatenate(
            [
                posed.order[: mine.start],
                number[one.piece == 0],
                posed.order[mine.stop :],
                *(number[one.piece == k] for k in range(1, split.count)),
            ]
        )
        turned = np.concatenate([self.turned, np.empty((more, 3, 3))])
        turned[[body, *range(len(self.turned), len(turned))]] = now.motion[mine][0] @ self.turned[body]
        after = ModelMapping(
            problem=problem,
            order=order,
            rigid=np.append(posed.rigid, np.ones(more, dtype=bool)),
            object_of_body=np.append(posed.object_of_body, count + np.arange(more)),
        )
        return FractureState(
            scene=fractured_scene(self.scene, one, piece_mass_fractions(one, self.particles)),
            particles=fractured_particles(self.particles, one, count),
            field=fractured_field(self.field, one),
            posed=after,
            turned=turned,
        )
