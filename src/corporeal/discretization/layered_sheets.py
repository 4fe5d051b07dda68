"""Layered sheets under impact, and the balls that strike them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from corporeal.core.types import Material, MaterialField, Particles
from corporeal.discretization.mesh_measures import oriented_box_size
from corporeal.discretization.part_geometry import MIN_COMPACT_SIDE_RATIO, ObjectLanding, PartGeometry
from corporeal.materials.contact_pairs import RestitutionLaw, series_restitution
from corporeal.materials.flat_crush import (
    ImpactingBall,
    LayeredSheet,
    crush_restitution,
    crush_restitution_law,
    layered_materials,
)
from corporeal.materials.loss_restitution import loss_of_restitution
from corporeal.materials.restitution_speed import MIN_CARRIED_RESTITUTION, is_stated_by_person, material_at_speed


@dataclass(frozen=True)
class PartProportions:
    """How large a part is, and how heavy what it belongs to."""

    size: tuple[float, float, float]
    """Extents, shortest first [m]."""
    mass: float
    """Of its object [kg]."""

    @property
    def is_sheet(self) -> bool:
        """Whether it is flat: what strikes it strikes its face."""
        return self.size[0] < MIN_COMPACT_SIDE_RATIO * self.size[1]

    @property
    def is_compact(self) -> bool:
        """Whether it presses on something flat as a ball does."""
        return self.size[0] >= MIN_COMPACT_SIDE_RATIO * self.size[2]


def part_proportions(particles: Particles, field: MaterialField) -> dict[int, PartProportions]:
    """Shape of every solid part where one is weak across its layers, by its number; else none."""
    known = layered_materials()
    if not any(m.name in known for m in field.materials):
        return {}
    mass = np.bincount(particles.object, particles.mass)
    found = {}
    for k, structure in enumerate(field.structures):
        own = particles.part == k
        if structure.kind != "solid" or np.count_nonzero(own) < 4:
            continue
        # Particles lie half of their spacing inside.
        spacing = float(particles.volume[own].mean() ** (1 / 3))
        x, y, z = (side + spacing for side in oriented_box_size(particles.position[own]))
        found[k] = PartProportions((x, y, z), float(mass[particles.object[own][0]]))
    return found


def layered_restitution_law(
    field: MaterialField, shapes: Mapping[int, PartProportions], pair: tuple[int, int], speed: float, packed: float
) -> RestitutionLaw | None:
    """Return how a ball rebounds from a sheet of layers that it strikes; None: they are none.

    Args:
        field: What parts are made of.
        shapes: By their numbers.
        pair: Numbers of two parts.
        speed: Of their impact [m/s].
        packed: Restitution of both without their layers [-].
    """
    for ball, sheet in (pair, pair[::-1]):
        one, other = shapes.get(ball), shapes.get(sheet)
        if one is None or other is None:
            continue
        struck = _layered_sheet(other, field.materials[sheet])
        if struck and one.is_compact:
            return crush_restitution_law(_ball_of(one, field.materials[ball]), struck, speed, packed)
    return None


def layered_loss_factor(ball: PartGeometry, lands: ObjectLanding, sheet: PartGeometry) -> float | None:
    """Loss factor of a soft ball and a rigid sheet of layers that it falls on [-]; None: of none."""
    one, struck = PartProportions(ball.size, lands.mass), None
    if sheet.structure.kind == "solid":
        struck = _layered_sheet(PartProportions(sheet.size, 0.0), sheet.material)
    if struck is None or not one.is_compact:
        return None
    packed = series_restitution(material_at_speed(ball.material, lands.speed), sheet.material)
    e = crush_restitution(_ball_of(one, ball.material), struck, lands.speed, packed)
    return loss_of_restitution(max(e, MIN_CARRIED_RESTITUTION))


def _ball_of(shape: PartProportions, material: Material) -> ImpactingBall:
    return ImpactingBall(material, shape.mass, 0.5 * shape.size[1])


def _layered_sheet(shape: PartProportions, material: Material) -> LayeredSheet | None:
    """Return the weak direction's data of a layered sheet; None: none, or the restitution is annotated."""
    weak = shape.is_sheet and material.name in layered_materials() and not is_stated_by_person(material, "restitution")
    return LayeredSheet(material, shape.size[0]) if weak else None
