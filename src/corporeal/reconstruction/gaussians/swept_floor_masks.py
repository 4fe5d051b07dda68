"""Masks of objects on a floor from Gaussians of whole photographs.

Where objects are decides, not how they look: what lies in the floor's plane is floor, whatever its colour. So shadows
are none of the objects, and objects of the floor's own colour are.
"""

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import label
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from corporeal.core.types import Camera, Gaussians
from corporeal.geometry.connected_components import connected_components
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.foreground import (
    COVERED_PIXEL_FRACTION,
    FLOOR_LAYER_RADII,
    foreground_gaussians,
    gaussian_visibility,
)
from corporeal.reconstruction.gaussians.gaussian_initialisation import free_depths
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    ParameterMatrix,
    parameters_of_gaussians,
)
from corporeal.reconstruction.gaussians.rasteriser_numba import draw, picture_of_drawing, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

CONNECTED_GAP_RADII = 0.04
"""What is nearer together hangs together, in radii of what the cameras look at."""
GAUSSIAN_EXTENT_SIGMAS = 1.5
"""Standard deviations of a Gaussian that are its own."""
MIN_PIECE_GAUSSIANS_FRACTION = 0.002
"""Share of the objects' Gaussians: separate pieces of fewer are none of them."""
BLACK_HARMONIC, WHITE_HARMONIC = -0.5 / SH_DC_COEFFICIENT, 0.5 / SH_DC_COEFFICIENT
"""Harmonics of degree 0."""


def masks_above_floor(
    gaussians: Gaussians,
    cameras: tuple[Camera, ...],
    floor: bool,
    threads: int | None = None,
    layer_radii: float = FLOOR_LAYER_RADII,
) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels of the cameras' pictures are on objects.

    What is less than a thin layer above the floor cannot be distinguished from it. There objects are
    taken to go down to it as they begin above that layer: mirrored at its top.

    Args:
        gaussians: Of all that the pictures show, +z up, the floor at z = 0.
        cameras: In the same frame.
        floor: Whether a floor is among the Gaussians.
        threads: None: one per processor.
        layer_radii: Height of that layer, in radii of what the cameras look at [-].
    """
    radius = find_viewed_region(cameras, gaussians.mean).radius
    of_objects = foreground_gaussians(
        gaussians, cameras, gaussian_visibility(gaussians, cameras, None, threads), floor, layer_radii
    )
    if of_objects.any():
        of_objects[of_objects] = _connected_with_many(gaussians, of_objects, CONNECTED_GAP_RADII * radius)
    theta = np.full((gaussians.count, PARAM_COLOUR + 3), BLACK_HARMONIC, np.float32)
    theta[:, :PARAM_COLOUR] = parameters_of_gaussians(gaussians)[:, :PARAM_COLOUR]
    theta[of_objects, PARAM_COLOUR:] = WHITE_HARMONIC
    if floor:
        theta = _mirror_feet(theta, of_objects, layer_radii * radius)
    masks = []
    with ThreadPool(threads) as pool:
        for camera, near in zip(cameras, free_depths(cameras), strict=True):
            made = draw(theta, pinhole_of_camera(camera, near=near), np.zeros(3), pool)
            masks.append(picture_of_drawing(made).rgb[..., 0] > COVERED_PIXEL_FRACTION)
    return np.stack(masks)


def _connected_with_many(gaussians: Gaussians, which: np.ndarray, cell: float) -> Bool[np.ndarray, " M"]:
    """Return which of the chosen Gaussians hang together with many others."""
    turn = Rotation.from_quat(gaussians.rotation[which], scalar_first=True).as_matrix()
    axes = GAUSSIAN_EXTENT_SIGMAS * (turn * gaussians.scale[which, None]).transpose(0, 2, 1)
    ends = np.concatenate([axes, -axes], axis=1)
    places = gaussians.mean[which, None] + np.concatenate([ends, 0 * ends[:, :1]], axis=1)
    at = np.floor((places - places.min(axis=(0, 1))) / cell).astype(int)
    filled = np.zeros(at.max(axis=(0, 1)) + 1, bool)
    filled[tuple(at.reshape(-1, 3).T)] = True
    found = label(filled, np.ones((3, 3, 3)))
    assert isinstance(found, tuple)
    count, touched = len(at), found[0][tuple(at.reshape(-1, 3).T)]
    joined = np.repeat(np.arange(count), len(at[0]))
    own = connected_components(joined, count + touched, count + found[1] + 1)[:count]
    return np.bincount(own)[own] >= MIN_PIECE_GAUSSIANS_FRACTION * count


def _mirror_feet(theta: ParameterMatrix, of_objects: Bool[np.ndarray, " N"], top: float) -> ParameterMatrix:
    """Return Gaussians with a mirror image of objects in place of what is in a layer below them."""
    height = theta[:, PARAM_MEAN + 2]
    feet = theta[of_objects & (height < 2 * top) & (theta[:, PARAM_OPACITY] > 0)]
    if not len(feet):
        return theta
    feet[:, PARAM_MEAN + 2] = 2 * top - feet[:, PARAM_MEAN + 2]
    feet[:, PARAM_ROTATION + 1 : PARAM_ROTATION + 3] *= -1  # M R M turns by (w, -x, -y, z)
    near = KDTree(feet[:, PARAM_MEAN:PARAM_ROTATION]).query(theta[:, PARAM_MEAN:PARAM_ROTATION])[0] < top
    return np.concatenate([theta[of_objects | ~near], feet])
