"""Segment: say of every point which object and which part it belongs to."""

from dataclasses import dataclass

import numpy as np

from corporeal.errors import UserError
from corporeal.geometry.identity import identify
from corporeal.types import Inventory, Parts, Scene
from corporeal.vlm.metadata import matter_hint


@dataclass(frozen=True)
class SegmentConfig:
    """Nothing to choose on the mesh path: the file's own identity decides."""


DEFAULT = SegmentConfig()


def segment(scene: Scene, inventory: Inventory, config: SegmentConfig = DEFAULT) -> Parts:
    """Give every triangle its object and part, by the identity that the file itself holds.

    Points are the scene's triangles in order. Identity is exact by construction, so the
    confidence is 1.

    Raises:
        UserError: The inventory describes another scene.

    """
    identity = identify(scene, matter_hint)
    _agree(scene, inventory, [p.name for p in identity.catalogue])
    triangles = [len(s.triangles) for s in scene.surfaces]
    part_of_point = np.repeat(identity.part_of_surface, triangles)
    return Parts(
        object_of_point=scene.object_of_triangle,
        part_of_point=part_of_point,
        confidence=np.ones(len(part_of_point)),
        catalogue=identity.catalogue,
    )


def _agree(scene: Scene, inventory: Inventory, names: list[str]) -> None:
    described = [part.name for thing in inventory.objects for part in thing.parts]
    if described != names:
        raise UserError(
            f"The description speaks of the parts {', '.join(described) or 'none'}, but "
            f"{scene.name!r} has {', '.join(names)}. Describe the scene again."
        )
