"""A filled scene to which things are added while it is simulated, at its own grid spacing."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Scene, Vector
from corporeal.discretization.broken import Filled
from corporeal.discretization.contents import Whole, with_contents
from corporeal.discretization.joined import joined, shifted
from corporeal.discretization.plan import Quality
from corporeal.discretization.problem_from_scene import Posed, pose
from corporeal.geometry.arrangement import box_of, moved, underside
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import GroundConfig, pairs
from corporeal.simulation.played import Prepared
from corporeal.viewer.still_air import in_air

MOST = 12
"""Things that are added to one scene."""
ROOMY = 100
"""Times the particles that a scene may have: what could not be filled even with thin walls."""
HIGHEST = 2.0
"""From which something is dropped [m]."""
Find = Callable[[str], Whole]


@dataclass(frozen=True)
class Added:
    """Something that was dropped into a scene."""

    thing: str
    """Its name: see ``Things``."""
    foot: Vector
    """Where the middle of the underside of its box begins [m]."""
    height: float
    """How far it was to fall, so how hard it may strike [m]."""


@dataclass(frozen=True)
class Grown:
    """A scene with all that was added so far."""

    prepared: Prepared

    @cached_property
    def posed(self) -> Posed:
        """What engines are given: who was added comes after all others."""
        p = self.prepared
        return pose(p.scene, p.particles, p.field)


class Growth:
    """Makes scenes with more and more in them; each is made once."""

    def __init__(
        self, prepared: Prepared, quality: Quality, find: Find, config: GroundConfig
    ) -> None:
        """Begin with what a live simulation begins with.

        Args:
            prepared: The scene as it was filled.
            quality: With which; its grid spacing is what came of it.
            find: Gives a thing by its name.
            config: From which the scene's materials came, for friction.

        """
        self.quality = replace(quality, cell=prepared.particles.cell)
        self.find, self.config = find, config
        self.scenes: dict[tuple[Added, ...], Grown] = {(): Grown(prepared)}
        self.filled: dict[tuple[str, float], Filled] = {}

    def at(self, added: tuple[Added, ...]) -> Grown:
        """Return the scene with all of these.

        Raises:
            UserError: There is no such thing, or it cannot be filled so coarsely.

        """
        if added not in self.scenes:
            before = self.at(added[:-1]).prepared
            self.scenes[added] = Grown(self._with(before, added[-1], len(added)))
        return self.scenes[added]

    def forget(self) -> None:
        """Keep no more than the beginning, and what was filled."""
        self.scenes = {(): self.scenes[()]}

    def reach(self, thing: str, height: float) -> tuple[np.ndarray, np.ndarray]:
        """Return from and to where a thing reaches, about the middle of its underside [m]."""
        scene = self.ready(thing, height).whole.scene
        low, high = box_of(scene.surfaces)
        foot = _foot(scene)
        return low - foot, high - foot

    def ready(self, thing: str, height: float) -> Filled:
        """Fill a thing by itself, standing on the floor.

        Raises:
            UserError: There is no such thing, or it cannot be filled so coarsely.

        """
        key = (thing, height)
        if key not in self.filled:
            self.filled[key] = self._fill(thing, height)
        return self.filled[key]

    def _fill(self, thing: str, height: float) -> Filled:
        cell, whole = self.quality.cell, self.find(thing)
        scene = in_air(whole.scene)
        assert cell is not None
        low, high = box_of(scene.surfaces)
        across = float(np.median(high - low))
        if across < cell:
            raise UserError(
                f"{thing} is {1e3 * across:.3g} mm wide, less than a cell of this scene, "
                f"{1e3 * cell:.3g} mm. Drop something larger."
            )
        need = 8 * float(np.prod(high - low)) / cell**3
        if need > ROOMY * self.quality.particles:
            raise UserError(
                f"{thing} is too large for the cells of this scene. Drop something smaller."
            )
        # As it falls, so hard it strikes: that decides how it is treated.
        lifted = moved(scene, np.array([0.0, 0.0, height]) - _foot(scene))
        particles = fill(lifted, whole.parts, whole.field, quality=self.quality)
        if particles.count > self.quality.particles:
            raise UserError(
                f"{thing} takes {particles.count:,} particles in cells of {1e3 * cell:.3g} mm, "
                f"more than {self.quality.particles:,}. Drop something smaller."
            )
        full = with_contents(lifted, whole.parts, whole.field, particles.contents)
        return shifted(Filled(full, particles), np.array([0.0, 0.0, -height]))

    def _with(self, before: Prepared, added: Added, number: int) -> Prepared:
        if number > MOST:
            raise UserError(f"{MOST} things have been dropped. Begin again.")
        here = Filled(Whole(before.scene, before.parts, before.field), before.particles)
        there = _renamed(self.ready(added.thing, added.height), here.whole.scene)
        there = shifted(there, np.array(added.foot))
        a, b = here.whole.field, there.whole.field
        tables = pairs(
            a.words + b.words, a.materials + b.materials, a.structures + b.structures, self.config
        )
        both = joined(here, there, tables.friction, tables.restitution)
        scene, parts, field = both.whole.all
        return replace(before, scene=scene, parts=parts, field=field, particles=both.particles)


def _foot(scene: Scene) -> np.ndarray:
    return np.array(underside(scene, 0))


def _renamed(thing: Filled, scene: Scene) -> Filled:
    """Give names that are not taken."""
    taken, objects = {o.name for o in scene.objects}, []
    for one in thing.whole.scene.objects:
        tries = (f"{one.name}_{k}" if k else one.name for k in range(1000))
        name = next(n for n in tries if n not in taken)
        taken.add(name)
        objects.append(replace(one, name=name))
    named = replace(thing.whole.scene, objects=tuple(objects))
    return Filled(replace(thing.whole, scene=named), thing.particles)
