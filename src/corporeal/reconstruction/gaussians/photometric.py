"""Surfaces moved to where photographs of them agree.

Depths of Gaussians have bumps of a pixel or two, which no outline sees in the middle of a face.
Where a face has a pattern, patches of all views that see it correlate best at its true depth, to a
fraction of a pixel (as Vu, Labatut, Pons and Keriven 2012 refine meshes). So vertices are asked how
far along the normal that is, those about a vertex are compared, and where most of them tell of one
smooth face, the vertex is laid on it; so is one that does not know it, on a spike before the face.
Where few know it, or they contradict each other, as on what is plain, all stays as it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8
from scipy.ndimage import minimum_filter
from scipy.sparse import csr_array

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.fairing import ON, means, smoothed
from corporeal.reconstruction.gaussians.kernels_photometric import (
    SIDE,
    UNKNOWN,
    agreement,
    nearest_depths,
)
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

FARTHEST = (3.0, 1.5)
"""Offsets that are looked at in each round, to either side [px],"""
STEP = 0.5
"""and how far apart."""
STEEP, BEFORE, PLAIN = 0.3, 1.5, 0.015
"""Least cosine between normal and view; how far before a vertex something may be that a view sees
[px]; least deviation of a patch [0–1]."""
ALIKE, BETTER, CLEAR = 0.6, 0.1, 0.05
"""Least correlation; by how much it must exceed the one where the vertex is, to be moved farther
than NEAR, and the best of those a pixel or more beside it."""
NEAR = 0.75
"""[px]"""
TURN, ALONG = 10.0, 4.0
"""Rounds of sharing normals, and places, with neighbours, of vertices that are a pixel apart."""
SCATTER = 0.5
"""Standard deviation of the places that vertices tell at which half of their word is taken [px]."""
HALF, SHARPLY = 0.3, 4
"""Share of vertices about one that must know where the face is for it to go half of the way there,
and the power by which more makes that more."""
EVERY = 1.2
"""Of vertices in a square pixel, one in so many is asked."""
MOST = 4.0
"""Nothing is moved farther in a round [px]."""
FILLED, ROUNDS = 0.9, 40
"""Belief from which on vertices that know nothing are laid as flat as others allow, and in how many
rounds."""
BENT, TINY = 1e-4, 1e-9
"""Least bend of a curve at its peak; less than any length or weight."""


@dataclass(frozen=True)
class Pictures:
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
class Agreed:
    """A surface, and how far photographs were believed."""

    mesh: Mesh
    belief: Float[np.ndarray, " N"]
    """0: a vertex is where it was; 1: where photographs say."""


def pictured(
    rgb: UInt8[np.ndarray, "V H W 3"],
    mine: Bool[np.ndarray, "V H W"],
    cameras: Float[np.ndarray, "V 18"],
    pixel: float,
) -> Pictures:
    """Return photographs of an object; mine: their pixels on it, pixel: its width there [m]."""
    # A patch that is partly beside the object moves with the outline, which is no place.
    inside = minimum_filter(mine, (1, SIDE, SIDE))
    return Pictures(rgb.astype(np.float32) / 255, inside, cameras, pixel)


def agreed(
    mesh: Mesh,
    pictures: Pictures,
    movable: Bool[np.ndarray, " N"],
    cell: float,
    floor: float,
    pool: ThreadPool,
) -> Agreed:
    """Move a surface to where photographs agree.

    Args:
        mesh: Closed, within some pixels of the object.
        pictures: Of the object.
        movable: Vertices that some view sees and that may be moved.
        cell: Of the grid that the object was carved from [m].
        floor: Nothing is moved below it, nor off it [m].
        pool: Threads.

    """
    mean, belief = means(mesh), np.zeros(len(mesh.vertices))
    movable = movable & (mesh.vertices[:, 2] >= floor + ON)
    lies = mesh.vertices[:, 2] < floor + ON
    fine = (pictures.pixel / cell) ** 2
    along = max(1, round(ALONG * fine))
    asked = np.flatnonzero(movable)[:: max(1, int(EVERY * fine))]
    for farthest in FARTHEST:
        normals = shared_normals(mesh, mean, fine)
        told = _told(mesh, normals, asked, pictures, farthest, pool)
        # Where places that vertices tell lie above the smoothed surface [px].
        above = ((mesh.vertices - _shared(mesh.vertices, mean, along)) * normals).sum(axis=1)
        above /= pictures.pixel
        face, belief = _face(above, asked, told, mean, along)
        move = np.where(movable, belief * np.clip(face - above, -MOST, MOST), 0)
        vertices = mesh.vertices + pictures.pixel * move[:, None] * normals
        vertices[lies, 2] = floor
        _filled(vertices, movable & (belief > FILLED) & ~_knows(asked, told, movable), mean)
        mesh = smoothed(Mesh(vertices, mesh.triangles), floor, 2, mean)
    return Agreed(mesh, np.where(movable, belief, 0))


@dataclass(frozen=True)
class _Told:
    """What A vertices that were asked know."""

    offset: Float[np.ndarray, " A"]
    """Where the face is, along the normal [px]."""
    weight: Float[np.ndarray, " A"]
    """How clearly that is so; 0: unknown."""


def shared_normals(mesh: Mesh, mean: csr_array, fine: float) -> Float[np.ndarray, "N 3"]:
    """Return normals of a surface without its bumps.

    Args:
        mesh: The surface.
        mean: As ``means`` returns it.
        fine: Cells of the grid that it was carved from in a square pixel.

    """
    normals = _shared(mesh.vertex_normals, mean, max(1, round(TURN * fine)))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), TINY)


def _shared(values: Float[np.ndarray, "N K"], mean: csr_array, rounds: int) -> np.ndarray:
    """Return values of vertices after so many rounds of taking the mean of neighbours."""
    for _ in range(rounds):
        values = mean @ values
    return values


def _told(
    mesh: Mesh,
    normals: Float[np.ndarray, "N 3"],
    asked: Int[np.ndarray, " A"],
    pictures: Pictures,
    farthest: float,
    pool: ThreadPool,
) -> _Told:
    """Ask vertices how far along the normal views agree best."""
    depths = np.empty(pictures.inside.shape)
    rest = mesh.vertices, mesh.triangles, pictures.cameras, depths
    pool.each(nearest_depths, [(*span, *rest) for span in pool.spans(len(depths))])
    offsets = np.arange(-farthest, farthest + TINY, STEP)
    curves = np.empty((len(asked), len(offsets)), np.float32)
    rule = np.array([STEEP, BEFORE, PLAIN])
    places, ways = mesh.vertices[asked], normals[asked]
    rest = places, ways, pictures.cameras, depths, pictures.inside, pictures.rgb
    shares = [(*span, *rest, offsets, rule, curves) for span in pool.spans(len(asked))]
    pool.each(agreement, shares)
    return _peaks(curves, offsets)


def _peaks(curves: Float32[np.ndarray, "A K"], offsets: Float[np.ndarray, " K"]) -> _Told:
    """Return where curves have one clear peak, between samples (parabola), and how clear it is."""
    row, count = np.arange(len(curves)), len(offsets)
    top = curves.argmax(axis=1)
    at = np.clip(top, 1, count - 2)
    before, best, after = curves[row, at - 1], curves[row, at], curves[row, at + 1]
    bend = 2 * best - before - after
    beside = np.abs(np.arange(count) - top[:, None]) * STEP >= 1 - TINY
    other = np.where(beside, curves, UNKNOWN).max(axis=1)
    clear = (at == top) & (best > ALIKE) & (best - other > CLEAR) & (bend > BENT)
    clear &= np.minimum(before, after) > UNKNOWN
    offset = offsets[at] + STEP * 0.5 * (after - before) / np.maximum(bend, BENT)
    clear &= (np.abs(offset) <= NEAR) | (best > curves[row, count // 2] + BETTER)
    weight = np.where(clear, np.clip((best - np.maximum(other, 0)) * best, 0, 1), 0)
    return _Told(np.where(clear, offset, 0), weight)


def _face(
    above: Float[np.ndarray, " N"],
    asked: Int[np.ndarray, " A"],
    told: _Told,
    mean: csr_array,
    along: int,
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return how high over the smoothed surface vertices about each see a face [px], and belief."""
    place, count = above[asked] + told.offset, len(above)
    sums = np.zeros((count, 5))
    columns = np.ones(len(asked)), told.weight > 0, told.weight
    sums[asked] = np.stack([*columns, told.weight * place, told.weight * place**2], axis=1)
    every, knows, weight, first, second = _shared(sums, mean, along).T
    weight = np.maximum(weight, TINY)
    face = first / weight
    scatter = np.maximum(second / weight - face**2, 0)
    share = knows / np.maximum(every, max(0.5 * len(asked) / count, TINY))  # 0: nothing is seen
    power = (share / (1 + scatter / SCATTER**2)) ** SHARPLY
    return face, power / (power + HALF**SHARPLY)


def _knows(
    asked: Int[np.ndarray, " A"], told: _Told, movable: Bool[np.ndarray, " N"]
) -> Bool[np.ndarray, " N"]:
    """Tell which vertices know where the face is, or were not asked."""
    out = np.ones(len(movable), bool)
    out[asked] = told.weight > 0
    return out


def _filled(
    vertices: Float[np.ndarray, "N 3"], loose: Bool[np.ndarray, " N"], mean: csr_array
) -> None:
    """Lay vertices that know nothing, among many that do, as flat as these allow."""
    some = np.flatnonzero(loose)
    near = mean[some]
    for _ in range(ROUNDS):
        vertices[some] = near @ vertices
