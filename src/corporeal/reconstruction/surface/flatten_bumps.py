"""Flattening of bumps at the rim of observed faces.

A patch that is partly beside the object tells nothing, so that photographs know a face (see ``photometric.py``) only
from some pixels on from its edges and from the floor. In that strip it is as carving left it, with bumps of a pixel,
and no outline sees these. What is known to be flat for some pixels goes on as a plane that far: what stands a little
before that plane, and faces as it does, is laid on it. What lies behind it stays, since edges are round.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.surface.fairing import neighbour_mean_matrix, smooth_taubin
from corporeal.reconstruction.surface.photo_consistency import MIN_FILL_BELIEF, AgreedSurface, smoothed_normals

MAX_BUMP_DISTANCE_PX = 4.0
"""Bumps are no farther from what is known [px]: half a patch, and as much again for its confidence."""
MAX_BUMP_HEIGHT_PX = 1.5
"""Bumps are lower [px]: more is an object before the face."""
PLANE_FIT_NEIGHBOURS = 48
"""Known places next to a bump that a plane is laid through, about one for each square pixel."""
MAX_PLANE_DEVIATION_PX, MIN_PLANE_EXTENT_PX = 0.25, 0.8
"""Standard deviations of these across a plane, at most, and along it, at least [px]."""
MIN_BUMP_COSINE = 0.5
"""Least cosine between a bump's normal and the plane's: 60°."""
MIN_MEAN_NORMAL_LENGTH = 0.9
"""Length of the mean of the known places' normals, at least: of one face, not of an edge."""


def flatten_bumps(
    agreed: AgreedSurface, movable: Bool[np.ndarray, " N"], pixel: float, cell: float, floor: float
) -> AgreedSurface:
    """Return a surface with low bumps beside known faces laid on these.

    Args:
        agreed: Closed, and where photographs know it.
        movable: Vertices that may be moved, if photographs do not know them.
        pixel: How wide one is at the surface [m].
        cell: Of the grid that the surface was carved from [m].
        floor: Nothing is moved below it [m].
    """
    mesh = agreed.mesh
    known = np.flatnonzero(agreed.belief > MIN_FILL_BELIEF)
    loose = np.flatnonzero(movable & (agreed.belief <= MIN_FILL_BELIEF))
    each = max(1, round(pixel**2 * len(mesh.vertices) / float(mesh.areas.sum())))
    some = known[::each]
    if len(some) < PLANE_FIT_NEIGHBOURS or not len(loose):
        return agreed
    tree = KDTree(mesh.vertices[known])
    near, which = tree.query(mesh.vertices[loose], distance_upper_bound=MAX_BUMP_DISTANCE_PX * pixel)
    found = np.isfinite(near)
    loose, beside = loose[found], known[np.asarray(which)[found]]
    places, mean = mesh.vertices[loose], neighbour_mean_matrix(mesh)
    normals = smoothed_normals(mesh, mean, (pixel / cell) ** 2)
    about = some[np.asarray(KDTree(mesh.vertices[some]).query(mesh.vertices[beside], PLANE_FIT_NEIGHBOURS)[1])]
    middle, across, flat = _fit_planes(mesh.vertices[about], normals[about].mean(axis=1), pixel)
    high = ((places - middle) * across).sum(axis=1)
    bump = flat & (high > 0) & (high < MAX_BUMP_HEIGHT_PX * pixel)
    bump &= (normals[loose] * across).sum(axis=1) > MIN_BUMP_COSINE
    vertices = mesh.vertices.copy()
    vertices[loose[bump]] -= high[bump, None] * across[bump]
    vertices[:, 2] = np.maximum(vertices[:, 2], floor)
    return AgreedSurface(smooth_taubin(Mesh(vertices, mesh.triangles), floor, 2, mean), agreed.belief)


def _fit_planes(
    places: Float[np.ndarray, "N K 3"], ways: Float[np.ndarray, "N 3"], pixel: float
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"], Bool[np.ndarray, " N"]]:
    """Return planes that places lie on or behind, and which of the places are flat and wide.

    Args:
        places: K about each of N.
        ways: Where they face, in the mean.
        pixel: How wide one is [m].

    Returns:
        A point and the normal of each plane.
    """
    middle = places.mean(axis=1)
    off = places - middle[:, None]
    spread, axes = np.linalg.eigh(np.swapaxes(off, 1, 2) @ off / places.shape[1])
    across = axes[:, :, 0]
    towards = (across * ways).sum(axis=1)
    across *= np.sign(towards)[:, None]
    flat = (spread[:, 0] < (MAX_PLANE_DEVIATION_PX * pixel) ** 2) & (spread[:, 1] > (MIN_PLANE_EXTENT_PX * pixel) ** 2)
    # Of what is round, the middle lies below the face.
    top = np.einsum("nki,ni->nk", off, across).max(axis=1)
    return middle + top[:, None] * across, across, flat & (np.abs(towards) > MIN_MEAN_NORMAL_LENGTH)
