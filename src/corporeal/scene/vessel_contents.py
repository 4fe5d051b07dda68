"""Scenes with movable contents of vessels as objects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.types import MaterialField, Part, Parts, Scene, Structure, VesselContents

LOOSE_CONTENTS_REASON = "It lies loose in a vessel that it does not fill."


@dataclass(frozen=True)
class SceneWithMaterials:
    """A scene including movable contents, with materials and parts."""

    scene: Scene
    parts: Parts
    field: MaterialField

    @property
    def all(self) -> tuple[Scene, Parts, MaterialField]:
        """All three."""
        return self.scene, self.parts, self.field


def add_vessel_contents(
    scene: Scene, parts: Parts, field: MaterialField, contents: Sequence[VesselContents]
) -> SceneWithMaterials:
    """Return a scene with the contents of its vessels as last objects; their walls are empty."""
    whole = SceneWithMaterials(scene, parts, field)
    for one in contents:
        whole = SceneWithMaterials(
            _add_object(whole.scene, one), _add_part(whole, one), _add_material(whole.field, one)
        )
    return whole


def vessels_of_contents(scene: Scene, contents: Sequence[VesselContents]) -> dict[int, int]:
    """Return the vessel of each object that lies loose in one, of a scene that has both."""
    first = len(scene.objects) - len(contents)
    return {first + k: one.vessel for k, one in enumerate(contents)}


def _add_object(scene: Scene, one: VesselContents) -> Scene:
    things = list(scene.objects)
    things[one.vessel] = one.holder
    surface = replace(one.surface, object=len(things), finish=len(scene.finishes))
    return replace(
        scene, objects=(*things, one.thing), surfaces=(*scene.surfaces, surface), finishes=(*scene.finishes, one.finish)
    )


def _add_part(whole: SceneWithMaterials, one: VesselContents) -> Parts:
    parts, count = whole.parts, len(one.surface.triangles)
    number, part = len(whole.scene.objects), len(parts.catalogue)
    return replace(
        parts,
        object_of_point=np.append(parts.object_of_point, np.full(count, number)),
        part_of_point=np.append(parts.part_of_point, np.full(count, part)),
        confidence=np.append(parts.confidence, np.ones(count)),
        catalogue=(*parts.catalogue, Part(one.words.name, number, "in a vessel")),
    )


def _add_material(field: MaterialField, one: VesselContents) -> MaterialField:
    structures, words = list(field.structures), list(field.words)
    wall = structures[one.wall]
    structures[one.wall] = Structure("shell", wall.thickness, wall.reason, holds=one.material.name)
    words[one.wall] = replace(words[one.wall], contents=None, fill=None)
    return replace(
        field,
        materials=(*field.materials, one.material),
        structures=(*structures, Structure("solid", reason=LOOSE_CONTENTS_REASON)),
        words=(*words, one.words),
        friction=_add_table_row(field.friction, one.friction),
        restitution=_add_table_row(field.restitution, np.zeros(len(field.restitution))),
        pieces=(*field.pieces, ()) if field.pieces else (),
    )


def _add_table_row(table: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Put a row and a column before the last ones, which are the floor's."""
    last = len(table) - 1
    wider = np.insert(np.insert(table, last, row, axis=0), last, 0.0, axis=1)
    wider[:, last] = np.insert(row, last, 0.0)
    return wider
