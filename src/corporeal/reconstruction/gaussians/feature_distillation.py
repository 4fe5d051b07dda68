"""Feature distillation: features in space, from a model's maps on pictures, as a radiance field.

A map's feature f on a ray is to be Σ w F, the field's features weighted as its colours are (F3RM, Shen et al., CoRL
2023). Density stays as it is, so that w is known and F solves a sparse linear system. It is approached from 0 by
simultaneous iterative reconstruction (Gilbert 1972): every node's F moves by the mean of what is missing on the rays
that it is seen on, each by its weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float16, Float32, Int
from scipy.sparse import csr_array, vstack

from corporeal.core.errors import UserError
from corporeal.core.types import Camera
from corporeal.geometry.grid_interpolation import bilinear_weights, trilinear_weights
from corporeal.reconstruction.gaussians import kernels_radiance
from corporeal.reconstruction.gaussians.radiance_field import RadianceField, field_arrays, field_camera_rows
from corporeal.reconstruction.gaussians.space_carving import VoxelGrid
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

NODE_SPACING_RATIO = 2
"""Distance between nodes, in those of the field: maps of features are no finer."""
DISTILLATION_ITERATIONS = 2
"""Of moving features towards the maps; the first is the mean over all rays. With more, features are sharper, and so is
noise: of maps that disagree."""
RAYS_ACROSS_PICTURE = 96
"""Rays along a picture's shorter side."""
MIN_LIGHT_FRACTION = 0.02
"""Share of a ray's light from which on a place counts."""
MAX_PLACES_PER_RAY = 48
"""Places along a ray that do."""
MIN_ABSORBED_FRACTION = 0.8
"""Rays that lose less light look past the objects."""
CHANNELS_PER_BATCH = 64
"""That are worked on at a time: what bounds the memory beside maps and result."""


@dataclass(frozen=True)
class FeatureField:
    """Features in space; M nodes of a grid have them."""

    grid: VoxelGrid
    row: Int[np.ndarray, " X_Y_Z"]
    """Where a node's features are; -1: it has none."""
    values: Float16[np.ndarray, "M D"]

    def at(self, position: Float[np.ndarray, "N 3"]) -> Float32[np.ndarray, "N D"]:
        """Return features at places [m], between nodes that have some; 0 where none around has."""
        share = trilinear_weights((position - np.array(self.grid.low)) / self.grid.cell, self.grid.shape)
        known = np.flatnonzero(self.row >= 0)
        own = csr_array(share[:, known], dtype=np.float32)
        total = np.asarray(own.sum(axis=1))[:, None]
        made = np.empty((len(position), self.values.shape[1]), np.float32)
        for some in _batches(made.shape[1]):
            made[:, some] = own @ self.values[self.row[known], some].astype(np.float32)
        return made / np.where(total > 0, total, 1)


@dataclass(frozen=True)
class _ViewRays:
    """Some rays of one view; R of them."""

    share: csr_array
    """Of each ray's light (row), what comes from each node (column); rows add up to 1."""
    place: csr_array
    """Of each ray (row), how much of each place of the map (column) it sees."""


def distil_features(
    field: RadianceField,
    cameras: Sequence[Camera],
    maps: Sequence[np.ndarray],
    rounds: int = DISTILLATION_ITERATIONS,
    threads: int | None = None,
) -> FeatureField:
    """Distil maps of features into a field.

    Args:
        field: Density, which stays as it is.
        cameras: One per view.
        maps: Of each view, h x w x D, over the same picture, in any resolution.
        rounds: At least 1.
        threads: None: one per processor.

    Raises:
        UserError: Maps and cameras do not go together, or the field is empty.
    """
    _check(cameras, maps)
    x, y, z = (-(-(n - 1) // NODE_SPACING_RATIO) + 1 for n in field.row.shape)
    grid = VoxelGrid(field.grid.low, NODE_SPACING_RATIO * field.grid.cell, (max(x, 2), max(y, 2), max(z, 2)))
    # What each ray sees of the nodes, weighted as its colours are, and of the map.
    with ThreadPool(threads) as pool:
        seen = _view_rays(field, grid, cameras, [m.shape[:2] for m in maps], pool)
    share = csr_array(vstack([one.share for one in seen]))
    total = np.asarray(share.sum(axis=0)).ravel()
    known = np.flatnonzero(total > 0)
    if not len(known):
        raise UserError("The radiance field is empty: no view shows anything of it.")
    # Only nodes that some ray sees have features.
    row = np.full(np.prod(grid.shape), -1, np.int64)
    row[known] = np.arange(len(known))
    share = csr_array(share[:, known], dtype=np.float32)
    back = csr_array(share.T)
    each = (1 / total[known]).astype(np.float32)[:, None]
    values = np.empty((len(known), maps[0].shape[2]), np.float16)
    # Iterative reconstruction, some channels at a time: what is missing on rays, back to nodes.
    for some in _batches(values.shape[1]):
        aim = np.concatenate([one.place @ _flat(m[..., some]) for one, m in zip(seen, maps, strict=True)])
        made = np.zeros((len(known), aim.shape[1]), np.float32)
        for _ in range(rounds):
            made += each * (back @ (aim - share @ made))
        values[:, some] = made
    return FeatureField(grid, row, values)


def _check(cameras: Sequence[Camera], maps: Sequence[np.ndarray]) -> None:
    if not len(maps) or len(maps) != len(cameras):
        raise UserError(f"There are {len(maps)} maps for {len(cameras)} cameras. Give one each.")
    depths = sorted({m.shape[2] for m in maps})
    if len(depths) > 1:
        raise UserError(f"Maps have {depths[0]} and {depths[-1]} channels. Make all with one model.")


def _view_rays(
    field: RadianceField, grid: VoxelGrid, cameras: Sequence[Camera], sizes: Sequence[tuple[int, int]], pool: ThreadPool
) -> list[_ViewRays]:
    rows, walk = field_camera_rows(field.grid, tuple(cameras)), field_arrays(field)
    made = []
    for camera, row, size in zip(cameras, rows, sizes, strict=True):
        pixels = _spread_pixels(camera)
        count = np.zeros(len(pixels), np.int32)
        place = np.zeros((len(pixels), MAX_PLACES_PER_RAY, 3), np.float32)
        weight = np.zeros((len(pixels), MAX_PLACES_PER_RAY), np.float32)
        rest = row, camera.width, walk, np.float32(MIN_LIGHT_FRACTION)
        spans = [slice(*span) for span in pool.spans(len(pixels))]
        deals = [(pixels[d], *rest, count[d], place[d], weight[d]) for d in spans]
        pool.each(kernels_radiance.light_sources, deals)
        made.append(_ray_by_ray(camera, pixels, place / NODE_SPACING_RATIO, weight, grid.shape, size))
    return made


def _ray_by_ray(
    camera: Camera,
    pixels: Int[np.ndarray, " R"],
    place: Float[np.ndarray, "R M 3"],
    weight: Float[np.ndarray, "R M"],
    nodes: tuple[int, int, int],
    size: tuple[int, int],
) -> _ViewRays:
    """Return what rays see: of the grid's nodes (their number each way), and of the map."""
    on = np.flatnonzero(weight.sum(axis=1) >= MIN_ABSORBED_FRACTION)
    ray, entry = np.nonzero(weight[on])
    own = weight[on] / weight[on].sum(axis=1, keepdims=True)
    per = csr_array((own[ray, entry], (ray, np.arange(len(ray)))), shape=(len(on), len(ray)))
    v, u = np.divmod(pixels[on], camera.width)
    flat = np.stack([(u + 0.5) / camera.width, (v + 0.5) / camera.height], axis=1)
    shown = bilinear_weights(flat, np.ones(len(on), np.bool_), size)
    return _ViewRays(csr_array(per @ trilinear_weights(place[on][ray, entry], nodes)), shown)


def _spread_pixels(camera: Camera) -> Int[np.ndarray, " R"]:
    """Return pixels all over a picture."""
    apart = max(1, min(camera.height, camera.width) // RAYS_ACROSS_PICTURE)
    v, u = np.arange(apart // 2, camera.height, apart), np.arange(apart // 2, camera.width, apart)
    return (v[:, None] * camera.width + u).ravel().astype(np.int32)


def _flat(pixels: np.ndarray) -> Float32[np.ndarray, "P C"]:
    return pixels.reshape(-1, pixels.shape[-1]).astype(np.float32)


def _batches(count: int) -> list[slice]:
    return [slice(k, min(k + CHANNELS_PER_BATCH, count)) for k in range(0, count, CHANNELS_PER_BATCH)]
