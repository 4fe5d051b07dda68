"""Fairing of closed surfaces: denoising, and completion of unobserved areas."""

import igl
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from corporeal.geometry.mesh import Mesh

TAUBIN_WEIGHTS = (0.5, -0.53)
"""How far vertices go to their neighbours' mean, and back."""
MIN_CONTINUATION_COSINE = 0.7
"""Cosine between a patch and the surface about it from which on it goes on as that does: 45°."""
MAX_NOISE_PATCH_FRACTION, MAX_NOISE_CELLS = 0.1, 2.0
"""What is finer than this share of a patch's radius, and than so many cells, is noise beside it."""
SLIVER_EXCESS_RATIO = 1e-4
"""Shortest excess of two sides over the third, in mean sides."""
BEND_ITERATIONS = 2
"""How often a patch is bent, each time on the shape that it got before."""
FLOOR_TOLERANCE_M = 1e-9
"""What is no higher lies on the floor [m]."""


def neighbour_mean_matrix(mesh: Mesh) -> csr_array:
    """Return the matrix (N, N) that makes of a value per vertex the mean of its neighbours'."""
    count, f = len(mesh.vertices), mesh.triangles
    ends = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]).T
    edges = csr_array((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(count, count))
    return csr_array(edges.multiply(1 / edges.sum(axis=1)[:, None]))


def smooth_taubin(mesh: Mesh, floor: float, passes: int, mean: csr_array) -> Mesh:
    """Take noise off a surface without shrinking it (Taubin 1995).

    What lies on the floor stays on it.

    Args:
        mesh: Closed.
        floor: Nothing is below it [m].
        passes: How often.
        mean: As ``neighbour_mean_matrix`` returns it.
    """
    v = mesh.vertices.copy()
    low = v[:, 2] < floor + FLOOR_TOLERANCE_M
    for _ in range(passes):
        for step in TAUBIN_WEIGHTS:
            v += step * (mean @ v - v)
            v[low, 2] = floor
    v[:, 2] = np.maximum(v[:, 2], floor)
    return Mesh(v, mesh.triangles)


def fair_unobserved_patches(
    mesh: Mesh,
    unknown: Bool[np.ndarray, " N"],
    still: Bool[np.ndarray, " N"],
    cell: float,
    floor: float,
    mean: csr_array,
) -> Mesh:
    """Round off the patches of a surface that no view observes, where that is likely.

    Where the surface about a patch nearly faces as the patch does, as about the underside of a ball, it goes on with
    the least bending. What is about it is known but for noise, which would tilt the patch: within a band of ten times
    that the noise goes. Elsewhere, as below a table, all stays.

    Args:
        mesh: Closed.
        unknown: Vertices that may be moved.
        still: Vertices that may not, though they are near.
        cell: Of the grid that the surface was carved from [m].
        floor: Nothing is moved below it [m].
        mean: As ``neighbour_mean_matrix`` returns it.
    """
    v, normals = mesh.vertices.copy(), mesh.vertex_normals
    some = np.flatnonzero(unknown)
    count, found = connected_components(csr_array(mean[some][:, some]), directed=False)
    patch = np.full(len(v), -1)
    patch[some] = found
    touched = patch[mesh.triangles].max(axis=1)  # what a triangle connects is one patch
    facing = np.zeros((count, 3))
    np.add.at(facing, touched[touched >= 0], mesh.area_vectors[touched >= 0])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    areas = np.bincount(touched[touched >= 0], mesh.areas[touched >= 0], count)
    order = np.argsort(found, kind="stable")
    for k, own in enumerate(np.split(some[order], np.cumsum(np.bincount(found))[:-1])):
        near = np.setdiff1d(mean[own].indices, own)
        if len(near) and np.mean(normals[near] @ facing[k]) > MIN_CONTINUATION_COSINE:
            radius = float(np.sqrt(areas[k] / np.pi))
            noise = min(MAX_NOISE_PATCH_FRACTION * radius, MAX_NOISE_CELLS * cell)
            rings = np.sqrt(len(own) / np.pi) * noise / (MAX_NOISE_PATCH_FRACTION * radius)
            band = _vertices_within_rings(own, round(rings), mean)
            band = band[~(still | unknown)[band]]
            v = _bend_least(Mesh(v, mesh.triangles), own, band, noise)
    v[:, 2] = np.maximum(v[:, 2], floor)
    return Mesh(v, mesh.triangles)


def _vertices_within_rings(own: Int[np.ndarray, " n"], rings: int, mean: csr_array) -> Int[np.ndarray, " m"]:
    """Return the vertices that are so many edges from some, or fewer."""
    found = own
    for _ in range(rings):
        found = np.union1d(found, mean[found].indices)
    return np.setdiff1d(found, own)


def _bend_least(
    mesh: Mesh, own: Int[np.ndarray, " n"], band: Int[np.ndarray, " m"], fine: float
) -> Float[np.ndarray, "N 3"]:
    """Return a mesh's vertices after some were moved so that it bends least.

    That is where ∫ |Δx|² + |x - x₀|² / fine⁴ is least, the second over the band only (Botsch and Kobbelt 2004; the
    Laplacian of Bobenko and Springborn 2007, which slivers do not spoil). The patch's own shape is what areas and
    angles are measured on, so it is done again on the result.
    """
    free = np.concatenate([own, band])
    bent = _with_neighbours(mesh, free)  # their Laplacian changes
    local = mesh.triangles[np.isin(mesh.triangles, bent).any(axis=1)]
    used, corners = np.unique(local, return_inverse=True)
    triangles = np.ascontiguousarray(corners.reshape(-1, 3))
    rows, moving, soft = (np.searchsorted(used, which) for which in (bent, free, band))
    given = x = mesh.vertices[used]
    for _ in range(BEND_ITERATIONS):
        laplacian, area = _cotangent_laplacian(x, triangles)
        pull = laplacian[rows]
        bending = pull.T @ (diags_array(1 / area[rows]) @ pull)
        hold = np.zeros(len(x))
        hold[soft] = area[soft] / fine**4
        whole = csc_array(bending + diags_array(hold))
        rest = given.copy()
        rest[moving] = 0
        goal = hold[moving, None] * given[moving] - (whole @ rest)[moving]
        x = given.copy()
        x[moving] = splu(csc_array(whole[moving][:, moving])).solve(goal)
    vertices = mesh.vertices.copy()
    vertices[used] = x
    return vertices


def _cotangent_laplacian(
    x: Float[np.ndarray, "N 3"], triangles: Int[np.ndarray, "T 3"]
) -> tuple[csc_array, Float[np.ndarray, " N"]]:
    """Return the integrated Laplacian by cotangents, and the area about each vertex [m²].

    All edges are made longer by as little as it takes for no triangle to be degenerate (Sharp and Crane 2020), and
    flipped until no angle's cotangent spoils the sum.
    """
    a, b, c = np.swapaxes(x[triangles], 0, 1)
    sides = np.stack([np.linalg.norm(p - q, axis=1) for p, q in ((b, c), (c, a), (a, b))], axis=1)
    lack = 2 * sides.max(axis=1) - sides.sum(axis=1) + SLIVER_EXCESS_RATIO * sides.mean()
    sides, flipped = igl.intrinsic_delaunay_triangulation(sides + max(lack.max(), 0), triangles)[:2]
    area = igl.massmatrix_intrinsic(sides, flipped, igl.MASSMATRIX_TYPE_BARYCENTRIC).diagonal()
    return csc_array(igl.cotmatrix_intrinsic(sides, flipped)), area


def _with_neighbours(mesh: Mesh, some: Int[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """Return some vertices and their neighbours."""
    return np.unique(mesh.triangles[np.isin(mesh.triangles, some).any(axis=1)])
