"""Inputs of the discretization policy for one part: shape, material, expected loads.

Includes the effective parameters of thickened walls.
"""

from dataclasses import dataclass, replace
from math import inf, pi

from corporeal.core.types import GRAVITY_M_S2, Material, Structure
from corporeal.discretization.hertz_indentation import dent_of_hollow_ball
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.time_step_limits import closed_wall_factors, limp_wall_factors, thin_wall_factors

MAX_SUBGRID_CELLS_COUNT, MAX_SUBGRID_LENGTH_CELLS = 8.0, 5.0
"""A part of fewer cells than the first, and nowhere longer than the second [cells], is a subgrid part: its own
stiffness cannot be seen."""

MIN_COMPACT_SIDE_RATIO = 0.5
"""Least shortest over longest side of what bounces as a ball does [-]; what is thinner than so much of its width is a
sheet."""
MIN_TUBE_SLENDERNESS = 8.0
"""Least length over diameter of a tube."""


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
    narrowing: float = 1.0
    """Volume of its wall over area times thickness [-]: its inside is smaller than its outside."""
    closed: bool = False
    """Whether its wall goes all around something, as a duck's does and a vase's does not."""
    leaves: int = 0
    """Separate leaves; 0: it is not foliage."""
    diameter: float = 0.0
    """Of a solid rod with a known centreline [m]; 0: it is none."""
    burden: float = 0.0
    """What it carries at its far end, over its own mass [-]."""
    scale: float = 1.0
    """Size here over the real object's [-]."""
    prescribed: bool = False
    """Whether the motion of its object is prescribed: it is rigid then, whatever it is made of."""
    thin_shell: bool = False
    """Whether it is a triangle shell with its true thickness where it deforms."""
    pressed: float = 0.0
    """Strain that other objects' prescribed motion forces on it [-]: ``pressed``."""


@dataclass(frozen=True)
class ObjectLanding:
    """What an object falls onto."""

    onto: int
    """Number of the object, or ``geometry.falls.FLOOR``."""
    speed: float
    """Of its fall, as it lands [m/s]; 0: it lies there."""
    mass: float
    """Of the object [kg]."""

    @property
    def energy(self) -> float:
        """Of its fall [J]."""
        return 0.5 * self.mass * self.speed**2


@dataclass(frozen=True)
class ImpactPartner:
    """What is rigid, or a plane, and meets something soft in an impact."""

    material: Material
    energy: float
    """Of the impact [J]."""
    loss: float | None = None
    """Loss factor of the whole contact, where layers are crushed in it [-]; None: none are."""


@dataclass(frozen=True)
class ExpectedMotion:
    """What is about to happen to one object."""

    impact_speed: float
    """Estimated speed at impact: fall, own velocity, push, and others' speed [m/s]."""
    acceleration: float
    """Largest acceleration: gravity, push and wind [m/s²]."""
    driven: float = 0.0
    """Without gravity [m/s²]."""
    landing: ObjectLanding | None = None
    """None: it is not known."""
    partners: tuple[ImpactPartner, ...] = ()
    """What cannot be dented in its impacts, and loses its share of them in reality."""


@dataclass(frozen=True)
class RigidityVerdict:
    """Whether one part, by itself, would be seen to change its shape."""

    strain: float
    """Largest strain expected [-]."""
    yield_speed: float
    """[m/s]"""
    rigid: bool
    reason: str
    weight: float = 0.0
    """Strain that its own weight causes as long as it rests [-]."""
    impact: float = 0.0
    """Strain that the impact causes [-]."""
    pressed: float = 0.0
    """Strain that prescribed motion of other objects forces on it [-]."""


def part_at_life_size(part: PartGeometry) -> PartGeometry:
    """Return the part of the real object: all lengths over its scale."""
    k, made = part.scale, part.structure
    thickness = None if made.thickness is None else made.thickness / k
    return replace(
        part,
        structure=replace(made, thickness=thickness),
        size=(part.size[0] / k, part.size[1] / k, part.size[2] / k),
        volume=part.volume / k**3,
        area=part.area / k**2,
        diameter=part.diameter / k,
        scale=1.0,
    )


def is_grain_on_grid(part: PartGeometry, cell: float) -> bool:
    """Whether the part has too little material on the grid to hold what is around it."""
    return part.volume < cell**3 and part.size[2] < MAX_SUBGRID_LENGTH_CELLS * cell


def is_subgrid_part(part: PartGeometry, cell: float) -> bool:
    """Whether the grid cannot show the part's own stiffness."""
    return part.volume < MAX_SUBGRID_CELLS_COUNT * cell**3 and part.size[2] < MAX_SUBGRID_LENGTH_CELLS * cell


def part_width(part: PartGeometry) -> float:
    """Width of the part [m]: its shortest side, or less where it is bent or branched.

    6 V/A is the side of the cube (the diameter of the sphere) with the part's volume per area; it says nothing when the
    mesh models the wall itself, inside and outside.
    """
    spread = 6 * part.volume / part.area if part.area > 0 else 0.0
    thickness = part.structure.thickness or 0.0
    wall_only = part.structure.kind == "shell" and spread < 4 * thickness
    return part.size[0] if wall_only or spread <= 0 else min(part.size[0], spread)


def rod_thickening_ratio(part: PartGeometry, simulated: float) -> float:
    """Real over simulated diameter of a rod; 1 where nothing is thickened."""
    return min(1.0, part.diameter / simulated) if part.diameter > 0 else 1.0


def wall_thickening_ratio(part: PartGeometry, simulated: float) -> float:
    """Give r = t / t_num of a wall that is simulated at least ``simulated`` thick [m]; else 1."""
    thickness = part.structure.thickness
    if part.structure.kind != "shell" or thickness is None:
        return 1.0
    # Never by division alone: a part that rounds to no width is simulated nought thick.
    return thickness / simulated if simulated > thickness else 1.0


def tube_diameter(part: PartGeometry) -> float:
    """Diameter of a wall rolled into a long tube [m], which bends as a bar does; 0: it is none.

    d = 4 V/A, and the tube is A/(π d) long: of a plate, rolled up in thought, that is many times its own length, and of
    a tube with a few branches or bends little more.
    """
    thickness = part.structure.thickness or 0.0
    if part.structure.kind != "shell" or part.area <= 0:
        return 0.0
    diameter = 4 * part.volume / part.area
    long, rolled = part.size[2], part.area / (pi * diameter) if diameter > 0 else inf
    hollow = diameter > 4 * thickness
    return diameter if hollow and MIN_TUBE_SLENDERNESS * diameter < long and rolled < 3 * long else 0.0


def is_flat_wall(part: PartGeometry) -> bool:
    """Return whether a wall is one flat sheet, as of a carpet: struck, it is dented across itself."""
    thickness = part.structure.thickness or 0.0
    return part.structure.kind == "shell" and part.size[0] < 2 * thickness


MIN_FOLDED_DENT_RATIO = 5.0
"""Depth over thickness from which the dent of a closed wall is facets and folds [-]: to about that depth it is round
(Fitch 1968; Vaziri and Mahadevan, PNAS 105 (2008) 7913; recalled)."""


def wall_factors(part: PartGeometry, ratio: float, speed: float) -> tuple[float, float, float]:
    """Factors on (E, σ_y, ρ) of a part's wall, by how it gives way.

    A closed wall answers by its indentation stiffness; an open one bends, but what is limp only resists in its plane;
    and what flows (a can) folds along plastic hinges.

    Args:
        part: Which.
        ratio: Its thickness over the simulated one [-].
        speed: At which it is struck [m/s].
    """
    if part.closed and not is_folding_wall(part, speed):
        return closed_wall_factors(ratio)
    if CONSTITUTIVE_LAWS[part.material.law].flows:
        return thin_wall_factors(ratio)
    return limp_wall_factors(ratio) if is_limp_wall(part, ratio) else thin_wall_factors(ratio)


def is_folding_wall(part: PartGeometry, speed: float) -> bool:
    """Return whether a closed wall that yields crumples: dented deeply, or pressed at rest."""
    material, thickness = part.material, part.structure.thickness
    if not CONSTITUTIVE_LAWS[material.law].flows or not thickness or part.size[0] <= 0.0:
        return CONSTITUTIVE_LAWS[material.law].flows
    radius = 0.5 * part.size[0]
    made = (material.young_pa, min(material.poisson, 0.49), material.density)
    depth = dent_of_hollow_ball(*made, thickness, radius, speed) * radius / thickness
    return not 0.0 < depth < MIN_FOLDED_DENT_RATIO


def is_limp_wall(part: PartGeometry, ratio: float) -> bool:
    """Return whether a wall hangs down as cloth does, even as stiff in bending as it becomes.

    With its stiffness in the plane kept, a wall t/r thick bends r² times less than the real one: the end of a strip
    would sink by 3 ρ g L⁴/(2 E t²) r², which must be more than its length.
    """
    thickness, material = part.structure.thickness, part.material
    if part.structure.kind != "shell" or not thickness:
        return False
    load = 1.5 * material.density * GRAVITY_M_S2 * part.size[2] ** 3
    return load * ratio**2 > material.young_pa * thickness**2
