"""Connected pieces of object points, and closed surfaces of segmented ones."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.reconstruction.gaussians.foreground import assign_hidden_gaussians
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.surface.closed_surface import ClosedSurface, build_closed_surfaces
from corporeal.reconstruction.surface.free_space import pieces_by_free_space
from corporeal.reconstruction.surface.surface_config import DEFAULT_CLOSED_SURFACE, ClosedSurfaceConfig


@dataclass(frozen=True)
class ObjectSurfaces:
    """Objects by size: the one with the largest box first."""

    solids: tuple[ClosedSurface, ...]
    owner: Int[np.ndarray, " N"]
    """Whose each Gaussian is; -1: no object's."""
    object_of_point: Int[np.ndarray, " M"]
    """Of the points that were segmented."""


def build_object_surfaces(
    taken: GaussianScene,
    of_objects: Int[np.ndarray, " T"],
    position: Float[np.ndarray, "M 3"],
    object_of_point: Int[np.ndarray, " M"],
    config: ClosedSurfaceConfig = DEFAULT_CLOSED_SURFACE,
) -> ObjectSurfaces:
    """Give every object a surface, and number them by size.

    Args:
        taken: The Gaussians, upright, and the cameras that they are looked at by.
        of_objects: Which of them belong to objects.
        position: Points that were segmented, in the same frame.
        object_of_point: Whose each point is.
        config: How finely surfaces are carved.

    Raises:
        UserError: No camera sees anything of an object.
    """
    nearest = KDTree(position).query(taken.gaussians.mean[of_objects])[1]
    owner, kept = _owner_with_company(taken, of_objects, object_of_point[nearest])
    shown = gaussian_subset(taken.gaussians, kept)
    found = build_closed_surfaces(shown, owner[kept], taken.cameras, taken.masks, taken.views, config)
    order = np.argsort([-np.prod(np.ptp(s.vertices, axis=0)) for s in found], kind="stable")
    place = np.append(np.argsort(order), -1)  # the last for what is no object's
    return ObjectSurfaces(tuple(found[k] for k in order), place[owner], place[object_of_point])


def pieces_of_objects(
    taken: GaussianScene, of_objects: Int[np.ndarray, " T"], position: Float[np.ndarray, "M 3"]
) -> Int[np.ndarray, " M"]:
    """Return which connected piece points on objects are of, as far as cameras see between.

    Args:
        taken: The Gaussians, upright, and the cameras that they are looked at by.
        of_objects: Which of them belong to objects.
        position: Points in the same frame.
    """
    owner, kept = _owner_with_company(taken, of_objects, np.zeros(len(of_objects), np.int64))
    shown = gaussian_subset(taken.gaussians, kept)
    return pieces_by_free_space(position, shown, owner[kept] >= 0, taken.cameras, taken.masks)


def _owner_with_company(
    taken: GaussianScene, of_objects: Int[np.ndarray, " T"], whose: Int[np.ndarray, " T"]
) -> tuple[Int[np.ndarray, " N"], Bool[np.ndarray, " N"]]:
    """Return whose each Gaussian is, with those that go along, and which of them are looked at."""
    owner = np.full(taken.gaussians.count, -1, np.int64)
    owner[of_objects] = whose
    owner = assign_hidden_gaussians(taken.gaussians, owner, taken.floor)
    # Masks say what is an object's: what is no object's then takes no space from objects.
    return owner, np.ones(len(owner), bool) if taken.masks is None else owner >= 0
