"""How each part enters the simulation: rigid, deformable or shell, and with which numbers.

One policy for all scenes (no scene can tune it): a part that would neither yield nor visibly flex
is rigid; everything else keeps its true stiffness; thin walls are thickened with their bending
stiffness and areal mass kept; only a step budget may compress wave speeds, and keeps their order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from corporeal.types import Material, Structure, Treatment

Detail = Literal["draft", "normal", "fine"]


@dataclass(frozen=True)
class PartGeometry:
    """What the policy needs to know of one part."""

    object: int
    """Which object it belongs to."""
    material: Material
    structure: Structure
    size: tuple[float, float, float]
    """Extents of its bounding box, shortest first [m]."""
    volume: float
    """Enclosed volume [m³]."""
    area: float
    """Surface area, one side [m²]."""


@dataclass(frozen=True)
class Motion:
    """What is about to happen to one object."""

    impact_speed: float
    """Estimated speed at impact: fall, own velocity, push, and others' speed [m/s]."""
    acceleration: float
    """Largest acceleration: gravity and push [m/s²]."""


@dataclass(frozen=True)
class Plan:
    """Resolution and treatments for a whole scene."""

    cell: float
    """Grid spacing dx [m]."""
    treatments: tuple[Treatment, ...]
    """One per part."""
    warnings: tuple[str, ...] = ()


def plan(
    parts: Sequence[PartGeometry],
    motions: Sequence[Motion],
    detail: Detail,
    stiffness: Literal["true", "capped"] = "true",
) -> Plan:
    """Choose the grid spacing and every part's treatment.

    Args:
        parts: All parts of the scene.
        motions: One per object.
        detail: The one knob of quality.
        stiffness: "capped" is the published rule, a control only.

    """
    raise NotImplementedError
