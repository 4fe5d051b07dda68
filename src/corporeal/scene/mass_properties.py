"""Mass properties of bodies with known construction."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class MassProperties:
    """Mass, and the first two moments of where it is, in the body's frame."""

    mass: float
    """[kg]"""
    centre: Float[np.ndarray, "3"]
    """[m]"""
    inertia: Float[np.ndarray, "3 3"]
    """About the centre [kg m²]."""
    friction: float | None = None
    """Coulomb μ of its roughest part on the floor [-]; None: unknown."""
    grip: float | None = None
    """Coulomb μ of its smoothest part on the floor: what holds it whichever part it stands on [-];
    None: unknown."""
    materials: tuple[str, ...] = ()
    """Names of the materials of its parts."""

    def scaled(self, factor: float) -> "MassProperties":
        """Return that of a body of the same materials and another size, walls and all."""
        mass, inertia = self.mass * factor**3, self.inertia * factor**5
        return replace(self, mass=mass, centre=self.centre * factor, inertia=inertia)


def cubes_mass_properties(
    points: Float[np.ndarray, "N 3"], mass: Float[np.ndarray, " N"], size: Float[np.ndarray, " N"]
) -> MassProperties:
    """Add up cubes.

    Args:
        points: Their middles [m].
        mass: [kg]
        size: Their sides [m].

    """
    total = float(mass.sum())
    centre = mass @ points / total
    arm = points - centre
    own = float(mass @ size**2) / 6 * np.eye(3)
    square = float(mass @ (arm**2).sum(axis=1)) * np.eye(3)
    return MassProperties(total, centre, own + square - (mass * arm.T) @ arm)
