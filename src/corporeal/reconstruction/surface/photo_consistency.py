"""Refinement of surfaces by photo-consistency.

Depths of Gaussians have bumps of a pixel or two, which no outline sees in the middle of a face. Where a face has a
pattern, patches of all views that see it correlate best at its true depth, to a fraction of a pixel (as Vu, Labatut,
Pons and Keriven 2012 refine meshes). So vertices are asked how far along the normal that is, those about a vertex are
compared, and where most of them tell of one smooth face, the vertex is laid on it; so is one that does not know it, on
a spike before the face. Where few know it, or they contradict each other, as on what is plain, all stays as it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8
from scipy.ndimage import minimum_filter
from scipy.sparse import csr_array

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.fairing import FLOOR_TOLERANCE_M, neighbour_mean_matrix, smooth_taubin
from corporeal.reconstruction.surface.kernels_photo_consistency import (
    NO_CORRELATION,
    PATCH_SIDE_PX,
    nearest_depths,
    photo_consistency_curves,
)

MAX_OFFSETS_PX = (3.0, 1.5)
"""Offsets that are looked at in each round, to either side [px],"""
OFFSET_STEP_PX = 0.5
"""and how far apart."""
MIN_VIEW_COSINE, MAX_OCCLUDER_PX, MIN_PATCH_DEVIATION = 0.3, 1.5, 0.015
"""Least cosine between normal and view; how far before a vertex something may be that a view sees [px]; least deviation
of a patch [0–1]."""
MIN_PATCH_CORRELATION, MIN_CORRELATION_GAIN, MIN_PEAK_GAIN = 0.6, 0.1, 0.05
"""Least correlation; by how much it must exceed the one where the vertex is, to be moved farther than NEAR, and the
best of those a pixel or more beside it."""
NEAR_OFFSET_PX = 0.75
"""[px]"""
NORMAL_SMOOTHING_ITERATIONS, PLACE_SMOOTHING_ITERATIONS = 10.0, 4.0
"""Rounds of sharing normals, and places, with neighbours, of vertices that are a pixel apart."""
HALF_BELIEF_SCATTER_PX = 0.5
"""Standard deviation of the places that vertices tell at which half of their word is taken [px]."""
HALF_KNOWING_FRACTION, BELIEF_POWER = 0.3, 4
"""Share of vertices about one that must know where the face is for it to go half of the way there, and the power by
which more makes that more."""
VERTICES_PER_SAMPLE = 1.2
"""Of vertices in a square pixel, one in so many is asked."""
MAX_ROUND_MOVE_PX = 4.0
"""Nothing is moved farther in a round [px]."""
MIN_FILL_BELIEF, FILL_ITERATIONS = 0.9, 40
"""Confidence from which on vertices that know nothing are laid as flat as others allow, and in how many rounds."""
MIN_PEAK_CURVATURE, TINY_LENGTH = 1e-4, 1e-9
"""Least bend of a curve at its peak; less than any length or weight."""


@dataclass(frozen=True)
class ObjectPhotographs:
    """Photographs of an object."""

    rgb: Float32[np.ndarray, "V H W 3"]
    """sRGB in [0, 1]."""
    inside: Bool[np.ndarray, "V H W"]
    """Pixels whose patch is wholly on the object."""
    cameras: Float[np.ndarray, "V 18"]
    """As ``DepthRendering.rows``."""
    pixel: float
    """How wide one is at the object [m]."""


@dataclass(frozen=True)
class AgreedSurface:
    """A surface, and how far photographs were used."""

    mesh: Mesh
    belief: Float[np.ndarray, " N"]
    """0: a vertex is where it was; 1: where photographs say."""


def object_photographs(
    rgb: UInt8[np.ndarray, "V H W 3"], mine: Bool[np.ndarray, "V H W"], cameras: Float[np.ndarray, "V 18"], pixel: float
) -> ObjectPhotographs:
    """Return photographs of an object; mine: their pixels on it, pixel: its width there [m]."""
    # A patch that is partly beside the object moves with the outline, which is no place.
    inside = minimum_filter(mine, (1, PATCH_SIDE_PX, PATCH_SIDE_PX))
    return ObjectPhotographs(rgb.astype(np.float32) / 255, inside, cameras, pixel)


def move_to_agreement(
    mesh: Mesh,
    pictures: ObjectPhotographs,
    movable: Bool[np.ndarray, " N"],
    cell: float,
    floor: float,
    pool: ThreadPool,
) -> AgreedSurface:
    """Move a surface to where photographs agree.

    Args:
        mesh: Closed, within some pixels of the object.
        pictures: Of the object.
        movable: Vertices that some view sees and that may be moved.
        cell: Of the grid that the object was carved from [m].
        floor: Nothing is moved below it, nor off it [m].
        pool: Threads.
    """
    mean, belief = neighbour_mean_matrix(mesh), np.zeros(len(mesh.vertices))
    movable = movable & (mesh.vertices[:, 2] >= floor + FLOOR_TOLERANCE_M)
    lies = mesh.vertices[:, 2] < floor + FLOOR_TOLERANCE_M
    fine = (pictures.pixel / cell) ** 2
    along = max(1, round(PLACE_SMOOTHING_ITERATIONS * fine))
    asked = np.flatnonzero(movable)[:: max(1, int(VERTICES_PER_SAMPLE * fine))]
    for farthest in MAX_OFFSETS_PX:
        normals = smoothed_normals(mesh, mean, fine)
        found = _ask_offsets(mesh, normals, asked, pictures, farthest, pool)
        # Where places that vertices tell lie above the smoothed surface [px].
        above = ((mesh.vertices - _neighbour_means(mesh.vertices, mean, along)) * normals).sum(axis=1)
        above /= pictures.pixel
        face, belief = _face_height(above, asked, found, mean, along)
        move = np.where(movable, belief * np.clip(face - above, -MAX_ROUND_MOVE_PX, MAX_ROUND_MOVE_PX), 0)
        vertices = mesh.vertices + pictures.pixel * move[:, None] * normals
        vertices[lies, 2] = floor
        _fill_unknown_vertices(
            vertices, movable & (belief > MIN_FILL_BELIEF) & ~_knowing_vertices(asked, found, movable), mean
        )
        mesh = smooth_taubin(Mesh(vertices, mesh.triangles), floor, 2, mean)
    return AgreedSurface(mesh, np.where(movable, belief, 0))


@dataclass(frozen=True)
class _VertexOffsets:
    """What A vertices that were asked know."""

    offset: Float[np.ndarray, " A"]
    """Where the face is, along the normal [px]."""
    weight: Float[np.ndarray, " A"]
    """How clearly that is so; 0: unknown."""


def smoothed_normals(mesh: Mesh, mean: csr_array, fine: float) -> Float[np.ndarray, "N 3"]:
    """Return normals of a surface without its bumps.

    Args:
        mesh: The surface.
        mean: As ``neighbour_mean_matrix`` returns it.
        fine: Cells of the grid that it was carved from in a square pixel.
    """
    normals = _neighbour_means(mesh.vertex_normals, mean, max(1, round(NORMAL_SMOOTHING_ITERATIONS * fine)))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), TINY_LENGTH)


def _neighbour_means(values: Float[np.ndarray, "N K"], mean: csr_array, rounds: int) -> np.ndarray:
    """Return values of vertices after so many rounds of taking the mean of neighbours."""
    for _ in range(rounds):
        values = mean @ values
    return values


def _ask_offsets(
    mesh: Mesh,
    normals: Float[np.ndarray, "N 3"],
    asked: Int[np.ndarray, " A"],
    pictures: ObjectPhotographs,
    farthest: float,
    pool: ThreadPool,
) -> _VertexOffsets:
    """Ask vertices how far along the normal views agree best."""
    depths = np.empty(pictures.inside.shape)
    rest = mesh.vertices, mesh.triangles, pictures.cameras, depths
    pool.each(nearest_depths, [(*span, *rest) for span in pool.spans(len(depths))])
    offsets = np.arange(-farthest, farthest + TINY_LENGTH, OFFSET_STEP_PX)
    curves = np.empty((len(asked), len(offsets)), np.float32)
    rule = np.array([MIN_VIEW_COSINE, MAX_OCCLUDER_PX, MIN_PATCH_DEVIATION])
    places, ways = mesh.vertices[asked], normals[asked]
    rest = places, ways, pictures.cameras, depths, pictures.inside, pictures.rgb
    shares = [(*span, *rest, offsets, rule, curves) for span in pool.spans(len(asked))]
    pool.each(photo_consistency_curves, shares)
    return _curve_peaks(curves, offsets)


def _curve_peaks(curves: Float32[np.ndarray, "A K"], offsets: Float[np.ndarray, " K"]) -> _VertexOffsets:
    """Return where curves have one clear peak, between samples (parabola), and how clear it is."""
    row, count = np.arange(len(curves)), len(offsets)
    top = curves.argmax(axis=1)
    at = np.clip(top, 1, count - 2)
    before, best, after = curves[row, at - 1], curves[row, at], curves[row, at + 1]
    bend = 2 * best - before - after
    beside = np.abs(np.arange(count) - top[:, None]) * OFFSET_STEP_PX >= 1 - TINY_LENGTH
    other = np.where(beside, curves, NO_CORRELATION).max(axis=1)
    clear = (at == top) & (best > MIN_PATCH_CORRELATION) & (best - other > MIN_PEAK_GAIN) & (bend > MIN_PEAK_CURVATURE)
    clear &= np.minimum(before, after) > NO_CORRELATION
    offset = offsets[at] + OFFSET_STEP_PX * 0.5 * (after - before) / np.maximum(bend, MIN_PEAK_CURVATURE)
    clear &= (np.abs(offset) <= NEAR_OFFSET_PX) | (best > curves[row, count // 2] + MIN_CORRELATION_GAIN)
    weight = np.where(clear, np.clip((best - np.maximum(other, 0)) * best, 0, 1), 0)
    return _VertexOffsets(np.where(clear, offset, 0), weight)


def _face_height(
    above: Float[np.ndarray, " N"], asked: Int[np.ndarray, " A"], found: _VertexOffsets, mean: csr_array, along: int
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return how high over the smoothed surface vertices about each see a face [px], and confidence."""
    place, count = above[asked] + found.offset, len(above)
    sums = np.zeros((count, 5))
    columns = np.ones(len(asked)), found.weight > 0, found.weight
    sums[asked] = np.stack([*columns, found.weight * place, found.weight * place**2], axis=1)
    every, knows, weight, first, second = _neighbour_means(sums, mean, along).T
    weight = np.maximum(weight, TINY_LENGTH)
    face = first / weight
    scatter = np.maximum(second / weight - face**2, 0)
    share = knows / np.maximum(every, max(0.5 * len(asked) / count, TINY_LENGTH))  # 0: nothing is seen
    power = (share / (1 + scatter / HALF_BELIEF_SCATTER_PX**2)) ** BELIEF_POWER
    return face, power / (power + HALF_KNOWING_FRACTION**BELIEF_POWER)


def _knowing_vertices(
    asked: Int[np.ndarray, " A"], found: _VertexOffsets, movable: Bool[np.ndarray, " N"]
) -> Bool[np.ndarray, " N"]:
    """Return which vertices know where the face is, or were not asked."""
    out = np.ones(len(movable), bool)
    out[asked] = found.weight > 0
    return out


def _fill_unknown_vertices(vertices: Float[np.ndarray, "N 3"], loose: Bool[np.ndarray, " N"], mean: csr_array) -> None:
    """Lay vertices that know nothing, among many that do, as flat as these allow."""
    some = np.flatnonzero(loose)
    near = mean[some]
    for _ in range(FILL_ITERATIONS):
        vertices[some] = near @ vertices
