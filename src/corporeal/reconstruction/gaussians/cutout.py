"""Masks of objects on a floor, where none are given, from Gaussians of whole photographs.

Where objects are decides, not how they look: what lies in the floor's plane is floor, whatever its
colour. So shadows are none of the objects, and objects of the floor's own colour are.
"""

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from corporeal.core.types import Camera, Gaussians
from corporeal.geometry.harmonics import DC
from corporeal.multiview.region import region
from corporeal.reconstruction.gaussians.foreground import HALF, THICK, foreground, shown
from corporeal.reconstruction.gaussians.parameters import (
    COLOUR,
    MEAN,
    OPACITY,
    ROTATION,
    Parameters,
    parameters,
)
from corporeal.reconstruction.gaussians.raster import draw, picture_of, pinhole
from corporeal.reconstruction.gaussians.start import clearance
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

APART = 0.04
"""What is nearer together hangs together, in radii of what the cameras look at."""
FILLED = 1.5
"""Standard deviations of a Gaussian that are its own."""
CRUMB = 0.002
"""Share of the objects' Gaussians: separate pieces of fewer are none of them."""
BLACK, WHITE = -0.5 / DC, 0.5 / DC
"""Harmonics of degree 0."""


def cut_out(
    gaussians: Gaussians, cameras: tuple[Camera, ...], floor: bool, threads: int | None = None
) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels of the cameras' pictures are on objects.

    What is less than ``foreground.THICK`` above the floor cannot be told from it. There objects are
    taken to go down to it as they begin above that layer: mirrored at its top.

    Args:
        gaussians: Of all that the pictures show, +z up, the floor at z = 0.
        cameras: In the same frame.
        floor: Whether a floor is among the Gaussians.
        threads: None: one per processor.

    """
    radius = region(cameras, gaussians.mean).radius
    of_objects = foreground(gaussians, cameras, shown(gaussians, cameras, None, threads), floor)
    if of_objects.any():
        of_objects[of_objects] = _joined(gaussians, of_objects, APART * radius)
    theta = np.full((gaussians.count, COLOUR + 3), BLACK, np.float32)
    theta[:, :COLOUR] = parameters(gaussians)[:, :COLOUR]
    theta[of_objects, COLOUR:] = WHITE
    if floor:
        theta = _footed(theta, of_objects, THICK * radius)
    masks = []
    with ThreadPool(threads) as pool:
        for camera, near in zip(cameras, clearance(cameras), strict=True):
            made = draw(theta, pinhole(camera, near=near), np.zeros(3), pool)
            masks.append(picture_of(made).rgb[..., 0] > HALF)
    return np.stack(masks)


def _joined(gaussians: Gaussians, which: np.ndarray, cell: float) -> Bool[np.ndarray, " M"]:
    """Tell which of the chosen Gaussians hang together with many others."""
    turn = Rotation.from_quat(gaussians.rotation[which], scalar_first=True).as_matrix()
    axes = FILLED * (turn * gaussians.scale[which, None]).transpose(0, 2, 1)
    ends = np.concatenate([axes, -axes], axis=1)
    places = gaussians.mean[which, None] + np.concatenate([ends, 0 * ends[:, :1]], axis=1)
    at = np.floor((places - places.min(axis=(0, 1))) / cell).astype(int)
    filled = np.zeros(at.max(axis=(0, 1)) + 1, bool)
    filled[tuple(at.reshape(-1, 3).T)] = True
    found = label(filled, np.ones((3, 3, 3)))
    assert isinstance(found, tuple)
    count, touched = len(at), found[0][tuple(at.reshape(-1, 3).T)]
    link = np.repeat(np.arange(count), len(at[0])), count + touched
    size = count + found[1] + 1
    graph = coo_array((np.ones(len(touched)), link), shape=(size, size))
    own = connected_components(graph, directed=False)[1][:count]
    return np.bincount(own)[own] >= CRUMB * count


def _footed(theta: Parameters, of_objects: Bool[np.ndarray, " N"], top: float) -> Parameters:
    """Return Gaussians with a mirror image of objects in place of what is in a layer below them."""
    height = theta[:, MEAN + 2]
    feet = theta[of_objects & (height < 2 * top) & (theta[:, OPACITY] > 0)]
    if not len(feet):
        return theta
    feet[:, MEAN + 2] = 2 * top - feet[:, MEAN + 2]
    feet[:, ROTATION + 1 : ROTATION + 3] *= -1  # M R M turns by (w, -x, -y, z)
    near = KDTree(feet[:, MEAN:ROTATION]).query(theta[:, MEAN:ROTATION])[0] < top
    return np.concatenate([theta[of_objects | ~near], feet])
