"""Gaussians of a scene that follow its particles; those of no object stand still."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Frame, Gaussians, Law, MaterialField, Reconstruction
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.reconstruction.gaussians.gaussian_deformation import deform_gaussians
from corporeal.render.skin_binding import SkinBinding, bind_points
from corporeal.simulation.simulation_result import PreparedScene

GAUSSIAN_ARRAYS = ("mean", "rotation", "scale", "opacity", "sh")


@dataclass(frozen=True)
class MovingGaussians:
    """Gaussians bound to material points at the start; N of them, M move."""

    gaussians: Gaussians
    moving: Int[np.ndarray, " M"]
    skin: SkinBinding
    """Of those that move."""

    def at(self, frame: Frame, colour: Float[np.ndarray, "P 3"] | None = None) -> Gaussians:
        """Return all Gaussians at one instant; colour: of every particle, in sRGB."""
        g = self.gaussians
        place, F = self.skin.carried(frame)
        moved = deform_gaussians(replace(g, **{n: getattr(g, n)[self.moving] for n in GAUSSIAN_ARRAYS}), F, place)
        if colour is not None:
            moved = replace(moved, sh=_same_from_all_sides(moved.sh, colour[self.skin.near[:, 0]]))
        arrays = {n: getattr(g, n).copy() for n in GAUSSIAN_ARRAYS}
        for name, values in arrays.items():
            values[self.moving] = getattr(moved, name)
        return replace(g, **arrays)


def _same_from_all_sides(sh: np.ndarray, colour: np.ndarray) -> np.ndarray:
    out = np.zeros_like(sh)
    out[:, 0] = (colour - 0.5) / SH_DC_COEFFICIENT
    return out


def moving_gaussians(found: Reconstruction, prepared: PreparedScene) -> MovingGaussians:
    """Bind the Gaussians that a scene was made of to its material points."""
    gaussians, owner = found.gaussians, found.object_of_gaussian
    moving = np.flatnonzero(owner >= 0)
    loose = granular_parts(prepared.field)
    skin = bind_points(gaussians.mean[moving], owner[moving], prepared.particles, loose)
    return MovingGaussians(gaussians, moving, skin)


def granular_parts(field: MaterialField) -> np.ndarray:
    """Which parts are made of grains or liquid: their neighbours part."""
    return np.array([CONSTITUTIVE_LAWS[m.law].loose for m in field.materials], dtype=bool)


def fluid_parts(field: MaterialField) -> np.ndarray:
    """Which parts are fluids: their deformation gradient knows nothing but the change of volume."""
    return np.array([m.law is Law.FLUID for m in field.materials], dtype=bool)
