"""Deformation, compression by weight, contact time and rebound of a part by its measured material values.

Estimates are generous: what is beyond three times such a value does not follow from the material.
"""

from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from corporeal.core.types import GRAVITY_M_S2, Discretization, Ledger, Material, MaterialField, Particles
from corporeal.discretization.hertz_indentation import HARDNESS_YIELD_RATIO
from corporeal.materials import find_material
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.time_step_limits import bounded_poisson
from corporeal.simulation.part_motion import PartMotion

LEAF_SHIFT_COEFFICIENT = 0.6
"""ω² = E t²/(0.6 ρ L⁴) of a leaf on its stalk (``discretization.foliage``)."""
LIMP_SHAPE_RATIO = 100.0
"""How many times limper than a flat wall one has to be that takes any shape although it is not flat [-]."""
SLOWEST_LEAVES_FRACTION = 0.05
"""Share of a crown's leaves that may be longer than what is taken for its longest."""
RESTITUTION_TOLERANCE = 0.1
"""A coefficient of restitution may exceed its measured range by so much [-]."""


@dataclass(frozen=True)
class MeasuredPart:
    """One part with its measured and simulated values, its size and what it bears."""

    material: Material
    """What acts: of what is filled, its contents."""
    treatment: Discretization
    thickness: float
    """Measured, of its wall [m]; 0: it has none."""
    motion: PartMotion
    mass: float
    """[kg]"""
    load: float
    """Weight that it bears [N]."""
    energy: float
    """The most energy of its object's impacts [J]."""
    leaf_length: float = 0.0
    """Of leaves on the springs of their stalks [m]; 0: it has none."""

    @property
    def wall(self) -> float | None:
        """Measured thickness of what is simulated as a wall [m]; None: it is no wall."""
        return self.thickness or None if self.treatment.kind == "shell" else None

    @property
    def stiffness_ratio(self) -> float:
        """Simulated over measured E [-]."""
        young = self.treatment.young_pa
        return self.treatment.simulated_young_pa / young if young > 0.0 else 1.0

    @property
    def in_plane_ratio(self) -> float | None:
        """Simulated over measured E t of a wall [-]."""
        if self.wall is None or not self.treatment.thickness:
            return None
        return self.stiffness_ratio * self.treatment.thickness / self.wall


def expected_deformation(part: MeasuredPart) -> float:
    """Return the largest deformation that measured values give [m].

    The largest of: the strain v/c, ρ a L/E that the discretization expects, over the part's length, and of a slender
    solid bar, ε L²/h; Hertz's dent of a solid by all of the energy; of what yields, the volume that the energy pushes
    aside against 2.8 σ_y, and for a wall a cone that is stretched, W = π σ_y t w². A wall that hangs down by more than
    its length as a cantilever takes any shape.
    """
    short, _, long = part.motion.size
    if part.leaf_length > 0.0:
        return part.leaf_length
    if part.treatment.kind == "rigid":
        return 0.0
    strain = min(1.0, part.treatment.strain)
    if part.wall is None:
        elastic = max(strain * long * long / max(short, 1e-9), _hertz_dent(part))
    else:
        elastic = inf if is_limp(part) else strain * long
    return min(long, max(elastic, _plastic_dent(part)))


def _hertz_dent(part: MeasuredPart) -> float:
    """δ = (15 W/(8 E* √R))^(2/5) (Johnson, Contact Mechanics, 1985, §11.4)."""
    young, poisson = bounded_poisson(part.material.young_pa, part.material.poisson)
    radius = 0.5 * part.motion.size[0]
    if young <= 0.0 or radius <= 0.0:
        return 0.0
    return (1.875 * part.energy * (1.0 - poisson**2) / (young * sqrt(radius))) ** 0.4


def _plastic_dent(part: MeasuredPart) -> float:
    strength = part.material.yield_stress
    if not CONSTITUTIVE_LAWS[part.material.law].flows or not strength:
        return 0.0
    if part.wall is not None:
        return sqrt(part.energy / (pi * strength * part.wall))
    radius = max(0.5 * part.motion.size[0], 1e-9)
    return sqrt(part.energy / (HARDNESS_YIELD_RATIO * strength * pi * radius))


def is_limp(part: MeasuredPart) -> bool:
    """Whether a flat wall hangs down as a cantilever by more than its length: 1.5 ρ g L³/(E t²) > 1.

    What is not flat is stiffer by its shape, unless it is as limp as cloth.
    """
    if part.wall is None:
        return False
    weight = 1.5 * part.material.density * GRAVITY_M_S2 * part.motion.size[2] ** 3
    flat = part.motion.size[0] < 2.0 * (part.treatment.thickness or 0.0)
    return weight > part.material.young_pa * part.wall**2 * (1.0 if flat else LIMP_SHAPE_RATIO)


# ------------------------------------------------------------------ weight


def expected_sag(part: MeasuredPart) -> float:
    """Compression of a part by what it bears, with measured values [m]."""
    return _sag(part, part.material.young_pa, part.material.density)


def simulated_sag(part: MeasuredPart) -> float:
    """Compression of a part by what it bears, with simulated values [m]."""
    made = part.treatment
    return max(_sag(part, made.simulated_young_pa, made.density), expected_sag(part))


def _sag(part: MeasuredPart, young: float, density: float) -> float:
    """F H²/(V E) of a column of height H and volume V; at most H."""
    height = part.motion.height
    if part.mass <= 0.0 or young <= 0.0:
        return 0.0
    return height * min(1.0, part.load * height * density / (part.mass * young))


# ------------------------------------------------------------------ impacts


def contact_times(part: MeasuredPart) -> tuple[float, float]:
    """Time in which a wave runs up and down the part, 2 H √(ρ/E): simulated and measured [s]."""
    way, made = 2.0 * part.motion.height, part.treatment
    if made.simulated_young_pa <= 0.0 or part.material.young_pa <= 0.0:
        return 0.0, 0.0
    return (
        way * sqrt(made.density / made.simulated_young_pa),
        way * sqrt(part.material.density / part.material.young_pa),
    )


def largest_restitution(numbers: list[int], field: MaterialField) -> float:
    """Upper end of the range of restitution of an object's parts, on the floor [-]."""
    most = 0.0
    for k in numbers:
        material, made = field.materials[k], field.structures[k]
        ground = material.grounds.get("restitution")
        high = ground.range.high if ground is not None else material.restitution
        inner = made.contents.restitution if made.contents is not None else 0.0
        most = max(most, high, inner, made.rebound or 0.0, float(field.restitution[k, -1]))
    return min(1.0, most + RESTITUTION_TOLERANCE)


def impact_energy(ledger: Ledger, body: int) -> float:
    """Largest kinetic energy of an object, and of all objects that touched it [J]."""
    most = ledger.kinetic.max(axis=0)
    met = np.isfinite(ledger.first_contact[-1, body, : len(most)])
    return float(most[body] + most[met].sum())


def leaf_length(particles: Particles, k: int, scale: float) -> float:
    """Length of the leaves of a part on springs, the longest but for a twentieth [m]; 0: it is on none.

    Args:
        particles: The material points.
        k: Which part.
        scale: Size of its object over that of the real one [-].
    """
    mine = (particles.part == k) & (particles.rate > 0.0) if len(particles.rate) else np.zeros(0, dtype=bool)
    if not mine.any():
        return 0.0
    leaf = find_material("leaf_tissue")
    tissue = leaf.pick(leaf.typical())
    thickness = (tissue.shell_thickness or 0.0) * scale
    rate = float(np.quantile(particles.rate[mine], SLOWEST_LEAVES_FRACTION))
    return (tissue.young_pa * thickness**2 / (LEAF_SHIFT_COEFFICIENT * tissue.density * rate**2)) ** 0.25
