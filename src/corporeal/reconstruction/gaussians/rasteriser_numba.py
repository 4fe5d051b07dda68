"""Rasteriser of Gaussians with gradients on the CPU.

Tiles of 16 × 16 pixels, front to back (Kerbl et al. 2023); ``reference`` says the same plainly.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.sparse import csr_array

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Gaussians, Vector
from corporeal.reconstruction.gaussians import kernels_blend, kernels_project
from corporeal.reconstruction.gaussians.gaussian_parameters import ParameterMatrix, parameters_of_gaussians
from corporeal.reconstruction.gaussians.kernels_blend import PICTURE_PLANES, RASTER_TILE_PX
from corporeal.reconstruction.gaussians.kernels_project import (
    COL_A,
    COL_B,
    COL_C,
    COL_DEPTH,
    COL_EXTENT,
    COL_OPACITY,
    ELLIPSE_COLUMNS,
    GRADIENT_COLUMNS,
    PinholeCamera,
)
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

MIN_DEPTH_COVERAGE = 1e-3
"""Where less than this is covered, there is no depth to speak of."""
BLACK_RGB: Vector = (0.0, 0.0, 0.0)
NEAR_DEPTH_M = 0.01
"""Nearest depth that is drawn unless another is given [m]."""


@dataclass(frozen=True)
class RenderedPicture:
    """What a camera sees."""

    rgb: Float32[np.ndarray, "H W 3"]
    """sRGB in [0, 1], a little more where harmonics overshoot, before the background."""
    alpha: Float32[np.ndarray, "H W"]
    """Share that is covered [0–1]."""
    depth: Float32[np.ndarray, "H W"]
    """Mean along the camera's z of what covers it [m]; inf where there is nothing."""


@dataclass(frozen=True)
class Drawing:
    """A picture with what it takes to go back; P planes, E entries: one Gaussian in one tile."""

    theta: ParameterMatrix
    camera: PinholeCamera
    ellipses: Float32[np.ndarray, "N 12"]
    first: Int[np.ndarray, " tiles_and_1"]
    """Where each tile's entries begin."""
    ids: Int[np.ndarray, " E"]
    """Of each entry, which Gaussian."""
    places: Int[np.ndarray, " E"]
    spans: Int[np.ndarray, "N 2"]
    """Gaussian i's entries: places[spans[i, 0] : spans[i, 1]]."""
    planes: Float32[np.ndarray, "5 H W"]
    """Red, green and blue before the background, transmittance, depth times coverage."""


def render(
    gaussians: Gaussians,
    camera: Camera,
    background: Vector = BLACK_RGB,
    near: float = NEAR_DEPTH_M,
    threads: int | None = None,
) -> RenderedPicture:
    """Picture some Gaussians before a background.

    near: what is nearer is not drawn [m]; where a training left something before the cameras, ``start.clearance``.

    Raises:
        UserError: The camera is skewed.
    """
    with ThreadPool(threads) as pool:
        eye = pinhole_of_camera(camera, near=near)
        return picture_of_drawing(draw(parameters_of_gaussians(gaussians), eye, np.array(background), pool))


def picture_of_drawing(drawing: Drawing) -> RenderedPicture:
    """Return a drawing as people take pictures: rows, columns, colours."""
    planes = drawing.planes
    alpha = 1 - planes[3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(alpha > MIN_DEPTH_COVERAGE, planes[4] / alpha, np.float32(np.inf))
    return RenderedPicture(np.ascontiguousarray(np.moveaxis(planes[:3], 0, -1)), alpha, depth)


def draw(
    theta: ParameterMatrix, camera: PinholeCamera, background: Float[np.ndarray, "3"], pool: ThreadPool
) -> Drawing:
    """Draw Gaussians from front to back."""
    ellipses, first, ids, places, spans = _sort_into_tiles(theta, camera, pool)
    planes = np.empty((PICTURE_PLANES, camera.height, camera.width), np.float32)
    background = background.astype(np.float32)
    shares = [(t, first, ids, ellipses, background, planes) for t in deal_tiles(first, pool)]
    pool.each(kernels_blend.blend, shares)
    return Drawing(theta, camera, ellipses, first, ids, places, spans, planes)


def _sort_into_tiles(theta: ParameterMatrix, camera: PinholeCamera, pool: ThreadPool) -> tuple[np.ndarray, ...]:
    """Return a drawing's ellipses and their entries, tile by tile, front to back in each."""
    ellipses = np.zeros((len(theta), ELLIPSE_COLUMNS), np.float32)
    shares = [(theta, *span, camera, ellipses) for span in pool.spans(len(theta))]
    pool.each(kernels_project.project, shares)
    seen = np.flatnonzero(ellipses[:, COL_EXTENT] > 0)
    order = seen[np.argsort(ellipses[seen, COL_DEPTH], kind="stable")]
    across, down = -(-camera.width // RASTER_TILE_PX), -(-camera.height // RASTER_TILE_PX)
    return ellipses, *kernels_blend.sort_into_tiles(order, ellipses, across, down)


def back(drawing: Drawing, slope: Float32[np.ndarray, "4 H W"], pool: ThreadPool) -> Float32[np.ndarray, "N D"]:
    """Return dL/dθ from the slope, dL/d(red, green, blue, transmittance) of every pixel."""
    d = drawing
    entries = np.empty((len(d.ids), GRADIENT_COLUMNS), np.float32)
    tiles = deal_tiles(d.first, pool)
    shares = [(t, d.first, d.ids, d.ellipses, d.planes, slope, entries) for t in tiles]
    pool.each(kernels_blend.blend_back, shares)
    gradient = np.empty_like(d.theta)
    rest = d.camera, d.ellipses, entries, d.places, d.spans, gradient
    shares = [(d.theta, *span, *rest) for span in pool.spans(len(d.theta))]
    pool.each(kernels_project.project_back, shares)
    return gradient


def gaussian_weights(gaussians: Gaussians, camera: Camera, cell: int = 1, threads: int | None = None) -> csr_array:
    """Return how much each Gaussian contributes to each cell of a picture.

    cell: pixels along a cell: 1, 2, 4, 8 or 16. Row: Gaussian; column: row of cells times cells in a row plus column of
    cells; value: sum of the weights T α over the cell's pixels.
    """
    return gaussian_contributions(gaussians, camera, cell, threads)[0]


def gaussian_contributions(
    gaussians: Gaussians, camera: Camera, cell: int = 1, threads: int | None = None
) -> tuple[csr_array, Float[np.ndarray, " N"]]:
    """Return the same, and what each would contribute to an endless picture if nothing hid it [px].

    That is the sum of α over all pixels, 2π o / √(A C - B²); 0 where it is not in the picture.
    """
    if cell not in (1, 2, 4, 8, RASTER_TILE_PX):
        raise UserError(f"A cell of {cell} pixels does not divide a tile. Take 1, 2, 4, 8 or 16.")
    colourless = replace(gaussians, sh=gaussians.sh[:, :1])
    within, size = RASTER_TILE_PX // cell, (camera.height, camera.width)
    with ThreadPool(threads) as pool:
        ellipses, first, ids, *_ = _sort_into_tiles(
            parameters_of_gaussians(colourless), pinhole_of_camera(camera), pool
        )
        sums = np.empty((len(ids), within, within), np.float32)
        rest = first, ids, ellipses, size, cell, sums
        pool.each(kernels_blend.sum_cell_weights, [(t, *rest) for t in deal_tiles(first, pool)])
    entry, y, x = np.nonzero(sums)
    tile = np.repeat(np.arange(len(first) - 1), np.diff(first))[entry]
    across = -(-camera.width // RASTER_TILE_PX)
    columns = -(-camera.width // cell)
    column = (tile // across * within + y) * columns + tile % across * within + x
    shape = gaussians.count, -(-camera.height // cell) * columns
    found = csr_array((sums[entry, y, x], (ids[entry], column)), shape=shape)
    return found, _unhidden_contribution(ellipses)


def _unhidden_contribution(ellipses: Float32[np.ndarray, "N 12"]) -> Float[np.ndarray, " N"]:
    whole, drawn = np.zeros(len(ellipses)), ellipses[:, COL_EXTENT] > 0
    a, b, c, o = ellipses[drawn][:, [COL_A, COL_B, COL_C, COL_OPACITY]].T.astype(np.float64)
    whole[drawn] = 2 * np.pi * o / np.sqrt(a * c - b * b)
    return whole


def pinhole_of_camera(camera: Camera, scale: float = 1.0, near: float = NEAR_DEPTH_M) -> PinholeCamera:
    """Return a camera as kernels read it; a scale of 0.5 halves the picture.

    near: what is nearer is not drawn [m].

    Raises:
        UserError: The camera is skewed.
    """
    K = camera.K
    if abs(K[0, 1]) > 1e-6 * K[0, 0]:
        raise UserError("A camera's K is skewed: its pixels are not rectangular. Rectify pictures.")
    turn = np.ascontiguousarray(camera.world_from_camera[:3, :3].T, dtype=np.float64)
    eye = np.ascontiguousarray(camera.world_from_camera[:3, 3], dtype=np.float64)
    fx, fy, cx, cy = (float(scale * k) for k in (K[0, 0], K[1, 1], K[0, 2], K[1, 2]))
    size = round(scale * camera.width), round(scale * camera.height)
    return PinholeCamera(turn, -turn @ eye, eye, fx, fy, cx, cy, *size, float(near))


def deal_tiles(first: Int[np.ndarray, " tiles_and_1"], pool: ThreadPool) -> list[Int[np.ndarray, " t"]]:
    """Deal tiles to threads, the fullest first, so that all have about as much to do."""
    order = np.argsort(-np.diff(first), kind="stable")
    return [np.ascontiguousarray(order[k :: pool.threads]) for k in range(pool.threads)]
