"""Adding objects to a scene during the simulation, at its grid spacing."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Scene, Vector
from corporeal.discretization.build_model import ModelMapping, build_model
from corporeal.discretization.discretization_plan import QualityPreset
from corporeal.geometry.scene_transforms import move_scene, surfaces_bounding_box, underside_centre
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import GroundConfig, pair_coefficients
from corporeal.scene.fractured_scene import FilledScene
from corporeal.scene.merge_scenes import merge_filled_scenes, shift_filled_scene
from corporeal.scene.vessel_contents import SceneWithMaterials, add_vessel_contents
from corporeal.simulation.simulation_result import PreparedScene
from corporeal.viewer.wind_faces import with_wind_faces

MAX_ADDED_OBJECTS = 12
"""Objects that are added to one scene."""
PARTICLE_LIMIT_RATIO = 100
"""Times the particles that a scene may have: what could not be filled even with thin walls."""
MAX_DROP_HEIGHT_M = 2.0
"""From which something is dropped [m]."""
AssetFinder = Callable[[str], SceneWithMaterials]


@dataclass(frozen=True)
class AddedObject:
    """Something that was dropped into a scene."""

    thing: str
    """Its name: see ``Things``."""
    foot: Vector
    """Where the middle of the underside of its box begins [m]."""
    height: float
    """How far it was to fall, so how hard it may strike [m]."""


@dataclass(frozen=True)
class GrownScene:
    """A scene with all that was added so far."""

    prepared: PreparedScene

    @cached_property
    def posed(self) -> ModelMapping:
        """What engines are given: who was added comes after all others."""
        p = self.prepared
        return build_model(p.scene, p.particles, p.field)


class LiveEditor:
    """Makes scenes with more and more in them; each is made once."""

    def __init__(
        self, prepared: PreparedScene, quality: QualityPreset, find: AssetFinder, config: GroundConfig
    ) -> None:
        """Begin with what a live simulation begins with.

        Args:
            prepared: The scene as it was filled.
            quality: With which; its grid spacing is what came of it.
            find: Gives an object by its name.
            config: From which the scene's materials came, for friction.
        """
        self.quality = replace(quality, cell=prepared.particles.cell)
        self.find, self.config = find, config
        self.scenes: dict[tuple[AddedObject, ...], GrownScene] = {(): GrownScene(prepared)}
        self.filled: dict[tuple[str, float], FilledScene] = {}

    def at(self, added: tuple[AddedObject, ...]) -> GrownScene:
        """Return the scene with all of these.

        Raises:
            UserError: There is no such object, or it cannot be filled so coarsely.
        """
        if added not in self.scenes:
            before = self.at(added[:-1]).prepared
            self.scenes[added] = GrownScene(self._with(before, added[-1], len(added)))
        return self.scenes[added]

    def forget(self) -> None:
        """Keep no more than the beginning, and what was filled."""
        self.scenes = {(): self.scenes[()]}

    def reach(self, thing: str, height: float) -> tuple[np.ndarray, np.ndarray]:
        """Return from and to where an object reaches, about the middle of its underside [m]."""
        scene = self.ready(thing, height).whole.scene
        low, high = surfaces_bounding_box(scene.surfaces)
        foot = _underside_point(scene)
        return low - foot, high - foot

    def ready(self, thing: str, height: float) -> FilledScene:
        """Fill an object by itself, standing on the floor.

        Raises:
            UserError: There is no such object, or it cannot be filled so coarsely.
        """
        key = (thing, height)
        if key not in self.filled:
            self.filled[key] = self._fill(thing, height)
        return self.filled[key]

    def _fill(self, thing: str, height: float) -> FilledScene:
        cell, whole = self.quality.cell, self.find(thing)
        scene = with_wind_faces(whole.scene)
        assert cell is not None
        low, high = surfaces_bounding_box(scene.surfaces)
        across = float(np.median(high - low))
        if across < cell:
            raise UserError(
                f"{thing} is {1e3 * across:.3g} mm wide, less than a cell of this scene, "
                f"{1e3 * cell:.3g} mm. Drop something larger."
            )
        need = 8 * float(np.prod(high - low)) / cell**3
        if need > PARTICLE_LIMIT_RATIO * self.quality.particles:
            raise UserError(f"{thing} is too large for the cells of this scene. Drop something smaller.")
        # As it falls, so hard it strikes: that decides how it is treated.
        lifted = move_scene(scene, np.array([0.0, 0.0, height]) - _underside_point(scene))
        particles = fill(lifted, whole.parts, whole.field, quality=self.quality)
        if particles.count > self.quality.particles:
            raise UserError(
                f"{thing} takes {particles.count:,} particles in cells of {1e3 * cell:.3g} mm, "
                f"more than {self.quality.particles:,}. Drop something smaller."
            )
        full = add_vessel_contents(lifted, whole.parts, whole.field, particles.contents)
        return shift_filled_scene(FilledScene(full, particles), np.array([0.0, 0.0, -height]))

    def _with(self, before: PreparedScene, added: AddedObject, number: int) -> PreparedScene:
        if number > MAX_ADDED_OBJECTS:
            raise UserError(f"{MAX_ADDED_OBJECTS} objects have been dropped. Begin again.")
        here = FilledScene(SceneWithMaterials(before.scene, before.parts, before.field), before.particles)
        there = _renamed(self.ready(added.thing, added.height), here.whole.scene)
        there = shift_filled_scene(there, np.array(added.foot))
        a, b = here.whole.field, there.whole.field
        tables = pair_coefficients(
            a.words + b.words, a.materials + b.materials, a.structures + b.structures, self.config
        )
        both = merge_filled_scenes(here, there, tables.friction, tables.restitution)
        scene, parts, field = both.whole.all
        return replace(before, scene=scene, parts=parts, field=field, particles=both.particles)


def _underside_point(scene: Scene) -> np.ndarray:
    return np.array(underside_centre(scene, 0))


def _renamed(thing: FilledScene, scene: Scene) -> FilledScene:
    """Give names that are not taken."""
    taken, objects = {o.name for o in scene.objects}, []
    for one in thing.whole.scene.objects:
        tries = (f"{one.name}_{k}" if k else one.name for k in range(1000))
        name = next(n for n in tries if n not in taken)
        taken.add(name)
        objects.append(replace(one, name=name))
    named = replace(thing.whole.scene, objects=tuple(objects))
    return FilledScene(replace(thing.whole, scene=named), thing.particles)
