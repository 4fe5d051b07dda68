"""Which bodies are sheets that a blow presses across their layers, and which are balls to them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from corporeal.core.types import Material, MaterialField, Particles
from corporeal.discretization.extent import oriented_size
from corporeal.discretization.part import COMPACT, Landing, PartGeometry
from corporeal.materials.blow import LEAST, at_speed, stated
from corporeal.materials.contact import BlowLaw, restitution_between
from corporeal.materials.crush import Ball, Sheet, crushed, law_of_crushing, layers
from corporeal.materials.rebound import loss_of


@dataclass(frozen=True)
class Shape:
    """How large a part is, and how heavy what it belongs to."""

    size: tuple[float, float, float]
    """Extents, shortest first [m]."""
    mass: float
    """Of its object [kg]."""

    @property
    def is_sheet(self) -> bool:
        """Whether it is flat: what strikes it strikes its face."""
        return self.size[0] < COMPACT * self.size[1]

    @property
    def is_compact(self) -> bool:
        """Whether it presses on something flat as a ball does."""
        return self.size[0] >= COMPACT * self.size[2]


def shapes_of(particles: Particles, field: MaterialField) -> dict[int, Shape]:
    """Shape of every solid part where one is weak across its layers, by its number; else none.

    Args:
        particles: Of all parts.
        field: What they are made of.

    """
    known = layers()
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
        x, y, z = (side + spacing for side in oriented_size(particles.position[own]))
        found[k] = Shape((x, y, z), float(mass[particles.object[own][0]]))
    return found


def law_of_pair(
    field: MaterialField,
    shapes: Mapping[int, Shape],
    pair: tuple[int, int],
    speed: float,
    packed: float,
) -> BlowLaw | None:
    """Say how a ball rebounds from a sheet of layers that it strikes; None: they are none.

    Args:
        field: What parts are made of.
        shapes: By their numbers.
        pair: Numbers of two parts.
        speed: Of their blow [m/s].
        packed: Restitution of both without their layers [-].

    """
    for ball, sheet in (pair, pair[::-1]):
        one, other = shapes.get(ball), shapes.get(sheet)
        if one is None or other is None:
            continue
        struck = _sheet(other, field.materials[sheet])
        if struck and one.is_compact:
            return law_of_crushing(_ball(one, field.materials[ball]), struck, speed, packed)
    return None


def loss_on_layers(ball: PartGeometry, lands: Landing, sheet: PartGeometry) -> float | None:
    """Loss factor of a soft ball and a rigid sheet of layers that it falls on [-]; None: of none.

    Args:
        ball: The largest part of what falls.
        lands: How it falls.
        sheet: The largest part of what it falls on.

    """
    one, struck = Shape(ball.size, lands.mass), None
    if sheet.structure.kind == "solid":
        struck = _sheet(Shape(sheet.size, 0.0), sheet.material)
    if struck is None or not one.is_compact:
        return None
    packed = restitution_between(at_speed(ball.material, lands.speed), sheet.material)
    e = crushed(_ball(one, ball.material), struck, lands.speed, packed)
    return loss_of(max(e, LEAST))


def _ball(shape: Shape, material: Material) -> Ball:
    return Ball(material, shape.mass, 0.5 * shape.size[1])


def _sheet(shape: Shape, material: Material) -> Sheet | None:
    """Return what is weak across its layers; None: it is not, or a person says how it rebounds."""
    weak = shape.is_sheet and material.name in layers() and not stated(material, "restitution")
    return Sheet(material, shape.size[0]) if weak else None
