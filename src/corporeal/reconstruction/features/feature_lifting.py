"""Lifting of feature maps to points: mean over the views that see a point.

Two ways to say how much of which pixel belongs to a point, and one sum over the views: ``back_projection`` asks where
the point falls and whether it is seen there; ``uplift_features`` takes the weights a rasteriser blended Gaussians with.
With the density frozen, training features by rendering them is a sparse linear problem of which that sum is the
normalised first step (Marrie et al., "LUDVIG", ICCV 2025; "Splat Feature Solver", arXiv 2508.12216).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from jaxtyping import Bool, Float, Float16, Float32, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import Camera
from corporeal.geometry.grid_interpolation import bilinear_weights
from corporeal.reconstruction.features.vit_pictures import row_batches, unit_rows

MIN_VIEW_WEIGHT_PX = 0.1
"""A Gaussian that has less weight in a view is not seen in it [px]: what little shows of those behind shows through
others' soft edges, at outlines, where the map is another object's."""
DEPTH_TOLERANCE = 0.005
"""A point this much deeper than what its pixel shows is still seen, as a share of its depth."""
DEPTH_CONTINUATION_PX = 0.75
"""How far from a pixel's middle depth is continued along the surface [px]."""
MAX_DEPTH_SLOPE = 4.0
"""Steeper surfaces, depth over width, are seen too slantwise to be continued [-]."""

PointWeights = Callable[[int], csr_array]
"""View → how much each place of its map (columns, row by row) belongs to each point (rows)."""


@dataclass(frozen=True)
class LiftedFeatures:
    """Features on N points."""

    mean: Float32[np.ndarray, "N D"]
    """Weighted mean of the maps; 0 where the point is seen nowhere."""
    seen: Int[np.ndarray, " N"]
    """In how many views."""

    def unit(self) -> Float16[np.ndarray, "N D"]:
        """Return the features at unit length; 0 stays 0."""
        made = np.empty(self.mean.shape, np.float16)
        for rows in row_batches(len(made)):
            made[rows] = unit_rows(self.mean[rows])
        return made


def lift_features(weights: PointWeights, maps: Sequence[np.ndarray], count: int, least: float = 0.0) -> LiftedFeatures:
    """Average maps onto points, each place by its weight.

    f_n = Σ_v Σ_c W_v[n, c] F_v[c] / Σ_v Σ_c W_v[n, c]

    Maps are taken one after the other, so that they may be read when they are asked for. Memory: one float32 per point
    and channel, and a little.

    Args:
        weights: Of each view.
        maps: Of each view, h x w x D.
        count: Number of points N.
        least: Weight in a view from which a point counts as seen in it, and below which that view has no say.

    Raises:
        UserError: A map's size does not agree with its weights', or with the other maps' depth.
    """
    if not len(maps):
        raise UserError("There are no views to take features from. Give at least one picture.")
    total, seen = np.zeros(count), np.zeros(count, np.int64)
    mean = np.zeros((count, np.shape(maps[0])[-1]), np.float32)
    for view in range(len(maps)):
        share = _agreeing_maps(weights(view), maps[view], mean, view)
        here = np.asarray(share.sum(axis=1))
        _add_view(mean, share, np.flatnonzero(here > least), maps[view])
        total += np.where(here > least, here, 0.0)
        seen += here > least
    mean /= np.where(total > 0, total, 1.0).astype(np.float32)[:, None]
    return LiftedFeatures(mean, seen)


def known_features(mean: Float32[np.ndarray, "N D"]) -> LiftedFeatures:
    """Return features that came onto points otherwise; where they are 0 they are unknown."""
    return LiftedFeatures(mean, np.any(mean, axis=1).astype(np.int64))


def _agreeing_maps(share: csr_array, pixels: np.ndarray, mean: np.ndarray, view: int) -> csr_array:
    wanted = len(mean), pixels.shape[0] * pixels.shape[1]
    given = _map_size(share)
    if given != wanted or pixels.shape[2] != mean.shape[1]:
        raise UserError(
            f"View {view}'s map is {' x '.join(map(str, pixels.shape))}; its weights are for "
            f"{given[0]} points and {given[1]} places, the first map has "
            f"{mean.shape[1]} channels. Make all maps with one model and one picture size."
        )
    return share


def _add_view(mean: np.ndarray, share: csr_array, rows: np.ndarray, pixels: np.ndarray) -> None:
    flat = np.ascontiguousarray(pixels.reshape(-1, pixels.shape[-1]), np.float32)
    single = csr_array(share, dtype=np.float32)
    for batch in row_batches(len(rows)):
        mean[rows[batch]] += single[rows[batch]] @ flat


def _map_size(share: csr_array) -> tuple[int, int]:
    return cast("tuple[int, int]", share.shape)


def uplift_features(
    weights: PointWeights,
    cells: tuple[int, int],
    maps: Sequence[np.ndarray],
    count: int,
    least: float = MIN_VIEW_WEIGHT_PX,
) -> LiftedFeatures:
    """Average maps onto Gaussians, each place by the weight that the Gaussian was blended with.

    Args:
        weights: View → blending weights T α [px] of each Gaussian (row) in each cell (column, row by row of cells),
            summed over the cell's pixels.
        cells: Rows and columns of cells that cover a picture.
        maps: Of each view, h x w x D, over the same picture, in any resolution.
        count: Number of Gaussians.
        least: Weight in a view from which a Gaussian counts as seen in it [px]; less where there are more Gaussians
            than pixels.
    """
    return lift_features(_resample_maps(weights, cells, maps), maps, count, least)


def _resample_maps(weights: PointWeights, cells: tuple[int, int], maps: Sequence[np.ndarray]) -> PointWeights:
    def of(view: int) -> csr_array:
        size = maps[view].shape[:2]
        share = weights(view)
        given = _map_size(share)[1]
        if given != cells[0] * cells[1]:
            raise UserError(f"View {view} has weights for {given} cells, not {cells[0]} x {cells[1]}.")
        if tuple(size) == tuple(cells):
            return share
        y, x = np.divmod(np.arange(cells[0] * cells[1]), cells[1])
        place = np.stack([(x + 0.5) / cells[1], (y + 0.5) / cells[0]], axis=1)
        return csr_array(share @ bilinear_weights(place, np.ones(len(place), bool), size))

    return of


def back_projection(
    position: Float[np.ndarray, "N 3"],
    cameras: Sequence[Camera],
    depth: Float[np.ndarray, "V H W"],
    maps: Sequence[np.ndarray],
    leeway: float = DEPTH_TOLERANCE,
) -> LiftedFeatures:
    """Average maps onto points, from the views that see them, where they fall in each.

    Args:
        position: World [m].
        cameras: One per view.
        depth: What the middle of each pixel shows, along the camera's z [m]; inf: nothing.
        maps: Of each view, h x w x D, over the same picture, in any resolution.
        leeway: Of the depth test, as a share of the depth.
    """

    def weights(view: int) -> csr_array:
        camera = cameras[view]
        place, z = _project_points(position, camera)
        seen = _visible_at(place, z, depth[view], camera.K[0, 0], leeway)
        return bilinear_weights(place / [camera.width, camera.height], seen, maps[view].shape[:2])

    return lift_features(weights, maps, len(position))


def visible_points(
    position: Float[np.ndarray, "N 3"], camera: Camera, depth: Float[np.ndarray, "H W"], leeway: float = DEPTH_TOLERANCE
) -> Bool[np.ndarray, " N"]:
    """Return which points nothing hides from a camera.

    A pixel's depth is that of its middle, and a point falls beside it: depth is continued along the surface by the
    smaller of the two differences to the neighbours on either side, in each direction, which at an outline is the one
    that stays on the surface.
    """
    place, z = _project_points(position, camera)
    return _visible_at(place, z, depth, camera.K[0, 0], leeway)


def _project_points(position: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return where points fall [px], and their depth [m]."""
    pose = camera.world_from_camera
    local = (np.asarray(position, np.float64) - pose[:3, 3]) @ pose[:3, :3]
    z = local[:, 2]
    ahead = np.where(z > 0, z, np.inf)
    flat = local @ camera.K.T
    return flat[:, :2] / ahead[:, None], z


def _visible_at(place: np.ndarray, z: np.ndarray, depth: np.ndarray, focal: float, leeway: float) -> np.ndarray:
    high, wide = depth.shape
    column, row = np.floor(place).astype(np.int64).T
    inside = (z > 0) & (column >= 0) & (column < wide) & (row >= 0) & (row < high)
    row, column = row[inside], column[inside]
    slope = (_depth_slope(depth, 0) + _depth_slope(depth, 1))[row, column]
    slope = np.minimum(slope, MAX_DEPTH_SLOPE * z[inside] / focal)
    allowed = depth[row, column] + DEPTH_CONTINUATION_PX * slope + leeway * z[inside]
    shown = np.zeros(len(z), bool)
    shown[inside] = np.isfinite(depth[row, column]) & (z[inside] <= allowed)
    return shown


def _depth_slope(depth: np.ndarray, axis: int) -> np.ndarray:
    """Return the smaller difference to the two neighbours along an axis; 0 where there is none."""
    with np.errstate(invalid="ignore"):
        step = np.abs(np.diff(depth, axis=axis))
    step = np.where(np.isfinite(step), step, np.inf)
    first, last = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
    first[axis], last[axis] = (1, 0), (0, 1)
    smaller = np.minimum(np.pad(step, first, constant_values=np.inf), np.pad(step, last, constant_values=np.inf))
    return np.where(np.isfinite(smaller), smaller, 0.0)


def fill_unseen_points(
    position: Float[np.ndarray, "N 3"], lifted: LiftedFeatures, neighbours: int = 8
) -> LiftedFeatures:
    """Return points that no view shows the mean of the nearest points that one does.

    Each of the ``neighbours`` counts by 1 / distance². ``seen`` stays 0 where it was.

    Raises:
        UserError: No view shows any point.
    """
    known, missing = np.flatnonzero(lifted.seen > 0), np.flatnonzero(lifted.seen == 0)
    if not len(missing):
        return lifted
    if not len(known):
        raise UserError("No view shows any of the points. Check that cameras and points share one frame and one unit.")
    near = min(neighbours, len(known))
    distance, who = KDTree(position[known]).query(position[missing], k=near)
    distance, who = distance.reshape(-1, near), who.reshape(-1, near)
    weight = 1 / np.maximum(distance, 1e-9 * max(float(np.max(distance)), 1e-9)) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    mean = lifted.mean.copy()
    for rows in row_batches(len(missing)):
        found = mean[known[who[rows]]]
        mean[missing[rows]] = np.einsum("nk,nkd->nd", weight[rows].astype(np.float32), found)
    return replace(lifted, mean=mean)
