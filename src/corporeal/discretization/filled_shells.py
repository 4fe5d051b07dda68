"""Treatment of filled shells under impact.

Liquids and grains in a full, closed container move with the wall as one rigid mass. What keeps its own shape (stuffing,
foam, jelly) is simulated by its own law, with the wall's mass around it.
"""

from collections.abc import Callable
from dataclasses import replace
from math import pi

from corporeal.core.types import Discretization, Material, Structure
from corporeal.discretization.part_geometry import ExpectedMotion, PartGeometry, RigidityVerdict
from corporeal.materials.pressurised_ball import InflatedBall, equivalent_solid
from corporeal.materials.restitution_speed import material_at_speed

NEARLY_FULL_FRACTION = 0.9
"""A share of the room that leaves no dents to be seen."""


def part_as_wall(part: PartGeometry) -> PartGeometry:
    """Take the wall alone, as heavy as with what is behind it."""
    wall, load = wall_and_contents_masses(part)
    loaded = replace(part.material, density=part.material.density * (wall + load) / wall)
    structure = Structure("shell", part.structure.thickness)
    return replace(part, material=loaded, structure=structure)


def part_as_contents(part: PartGeometry, speed: float = 0.0) -> PartGeometry:
    """Take what is behind the wall alone, spread through the whole; other parts as they are.

    Args:
        part: Which.
        speed: At which it is struck [m/s]: a sealed ball is the stiffer the harder.
    """
    inner = part.structure.contents
    if inner is None:
        return part
    inflated = part.structure.inflated
    density = mean_density(part) if inflated else inner.density * part.structure.fill
    spread = replace(inner, density=density)
    if part.structure.gauge_pressure is not None:
        solid = equivalent_solid(part_as_sealed_ball(part, speed), 0.5 * density * part.volume * speed**2)
        loss = inner.loss if part.structure.rebound is not None else solid.loss
        spread = replace(spread, young_pa=solid.young_pa, loss=loss)
    return replace(part, material=spread, structure=Structure("solid"), diameter=0.0)


def part_as_sealed_ball(part: PartGeometry, speed: float) -> InflatedBall:
    """Return the ball of its volume that a part with air sealed behind an elastic wall is.

    Args:
        part: Which.
        speed: At which it is struck [m/s]: of some walls the loss depends on it.
    """
    structure = part.structure
    radius = (0.75 * part.volume / pi) ** (1.0 / 3.0)
    skin = material_at_speed(part.material, speed)
    return InflatedBall(structure.gauge_pressure or 0.0, skin, structure.thickness or 0.0, radius)


def wall_and_contents_masses(part: PartGeometry) -> tuple[float, float]:
    """Mass of the wall and of what is behind it [kg]: ρ V_w and ρ f (V - V_w), V_w = n A t."""
    structure, inner = part.structure, part.structure.contents
    wall = part.narrowing * part.area * (structure.thickness or 0.0)
    matter = min(wall, part.volume)
    load = inner.density * structure.fill * (part.volume - matter) if inner else 0.0
    return part.material.density * matter, load


def mean_density(part: PartGeometry) -> float:
    """Density of a part with what is behind its wall [kg/m³]; of others their material's."""
    filled = part.structure.contents is not None and part.volume > 0
    return sum(wall_and_contents_masses(part)) / part.volume if filled else part.material.density


def bulk_mass(part: PartGeometry) -> float:
    """Mean density times volume [kg], by which parts are ranked; of an empty shell as if solid."""
    return mean_density(part) * part.volume


def judge_filled_shell(
    part: PartGeometry, motion: ExpectedMotion, judge: Callable[[PartGeometry, ExpectedMotion], RigidityVerdict]
) -> RigidityVerdict:
    """Return whether wall and contents move as one rigid body, and why."""
    structure, inner = part.structure, part.structure.contents
    assert inner is not None
    if structure.inflated:
        inside = judge(part_as_contents(part, motion.impact_speed), motion)
        if structure.gauge_pressure is not None:
            return replace(inside, reason=f"{inside.reason}; its wall and the air in it bounce")
        return replace(inside, reason=f"{inside.reason}; its wall is as limp as its {inner.name}")
    wall = judge(part_as_wall(part), motion)
    carried = f"its {inner.name} moves with the wall as one rigid mass"
    if wall.rigid:
        return replace(wall, reason=f"{wall.reason}; {carried}")
    if part.material.strength_local is not None:
        brittle = f"its wall of {part.material.name} breaks before it visibly flexes"
        return replace(wall, rigid=True, reason=f"{brittle}; {carried}")
    if not structure.loose:
        inside = judge(part_as_contents(part), motion)
        reason = f"{inside.reason}; it is simulated as its {inner.name}, the wall's mass around it"
        return replace(inside, reason=reason)
    reason = (
        f"it is filled with {inner.name}, which does not flow in this model: wall and contents move as one rigid mass"
    )
    if structure.fill < NEARLY_FULL_FRACTION:
        reason += f", and dents into its empty {1 - structure.fill:.0%} are not modelled"
    return replace(wall, rigid=True, reason=reason)


def acting_material(material: Material, structure: Structure, treatment: Discretization) -> Material:
    """Return the material whose law a part follows: a soft filled part follows its contents'."""
    soft = structure.contents is not None and treatment.kind == "deformable"
    return structure.contents if soft and structure.contents else material
