"""Overlap of rendered silhouettes and masks."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, UInt8

from corporeal.core.types import Camera
from corporeal.geometry.mesh import Mesh
from corporeal.multiview.silhouette_coherence import (
    SilhouetteComparison,
    mask_overlap_and_fill,
    pixels_of_points,
    shrink_mask,
)

OVERLAP_IMAGE_SIDE_PX = 256
"""Longer side at which they are compared [px]."""
SILHOUETTE_SAMPLES_COUNT = 400_000
"""Points on all surfaces that are drawn: several to a pixel of the silhouette."""
MIN_PIXEL_POINTS_DIVISOR = 4
"""A pixel that holds less than one in so many of the usual number of points is only touched."""


def compare_silhouettes(
    meshes: Sequence[Mesh],
    cameras: Sequence[Camera],
    masks: Sequence[UInt8[np.ndarray, "H W"]],
    rng: np.random.Generator,
) -> SilhouetteComparison:
    """Compare silhouettes of surfaces with a mask in each view.

    Args:
        meshes: In the frame and unit of the cameras.
        cameras: One or more.
        masks: 255: the objects. Of any size, in the proportions of the camera's picture.
        rng: Where points fall on the surfaces.
    """
    points = sample_meshes(meshes, SILHOUETTE_SAMPLES_COUNT, rng)
    found = []
    for camera, mask in zip(cameras, masks, strict=True):
        real = shrink_mask(mask, OVERLAP_IMAGE_SIDE_PX)
        cell = pixels_of_points(points, camera, real.shape)
        count = np.bincount(cell[cell >= 0], minlength=real.size)
        usual = np.median(count[count > 0]) if count.any() else 0
        drawn = (count > usual / MIN_PIXEL_POINTS_DIVISOR).reshape(real.shape)
        found.append(mask_overlap_and_fill(drawn, real))
    overlap, filled = np.array(found).T
    return SilhouetteComparison(overlap, filled)


def sample_meshes(meshes: Sequence[Mesh], count: int, rng: np.random.Generator) -> Float[np.ndarray, "N 3"]:
    """Return points on surfaces, as many on equal areas."""
    corners = np.concatenate([mesh.corners for mesh in meshes])
    areas = np.concatenate([mesh.areas for mesh in meshes])
    chosen = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    # Uniform on a triangle (Turk 1990).
    root, along = np.sqrt(rng.random(count)), rng.random(count)
    weight = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    return np.einsum("nk,nkd->nd", weight, chosen)
