"""A radiance field on a voxel grid, learned from posed pictures: density and colour in space.

Light along a ray is Σ T_i α_i c_i, α = 1 - exp(-σ δ) (Max 1995; Mildenhall et al. 2020); density and colour are
interpolated between the nodes of a grid, before they are made positive (Sun et al., "Direct Voxel Grid Optimization",
CVPR 2022). Nodes are only where the masks' visual hull is.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.ndimage import binary_dilation, distance_transform_cdt, maximum_filter

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Camera, Views
from corporeal.geometry.grid_interpolation import trilinear_weights
from corporeal.reconstruction.gaussians import kernels_radiance, training_checkpoint
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality, psnr, ssim
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.rasteriser_numba import RenderedPicture
from corporeal.reconstruction.gaussians.space_carving import VoxelGrid
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.train_gaussians import GREY_BACKGROUND
from corporeal.reconstruction.gaussians.training_schedule import Masks, check_training_views, shrink_picture
from corporeal.reconstruction.gaussians.visual_hull import carve_tight_hull

SAMPLE_STRIDE_CUBES = 1.0
"""Between samples along a ray [cubes]."""
INITIAL_DENSITY_LOG = -3.0
"""Density's number everywhere, at first: e^-3 per cube."""
LEARNING_RATE, FINAL_RATE_FRACTION = 0.3, 0.05
"""Adam's, and what is left of it at the end."""
GRADIENT_SHARES = 4
"""Into which a step's rays are dealt, whoever does them; each has a gradient of its own."""
RIM_WINDOW_PX = 9
"""Width of the window that finds pixels beside objects, which say where nothing is [px]."""
MAX_SAMPLED_PIXELS = 16_000_000
"""Of all pictures that points are sampled from, evenly: what bounds the memory."""
MIN_POINT_VIEWS = 2
"""Views that must see a point."""
MAX_LEAP_CUBES = 255
"""Cubes that are leapt over at once."""
HULL_PADDING_CUBES = 2
"""Cubes around the visual hull."""


@dataclass(frozen=True)
class FieldPreset:
    """How much work."""

    steps: int
    longest: int
    """Larger pictures are shrunk by a whole number until no side is longer [px]."""
    rays_per_step: int = 8192
    """Rays that a step learns from [1]."""


FIELD_PRESETS = {"preview": FieldPreset(100, 128), "draft": FieldPreset(400, 256), "normal": FieldPreset(1000, 512)}


@dataclass(frozen=True)
class RadianceFieldConfig:
    """How to learn a field from pictures."""

    preset: Literal["preview", "draft", "normal"] = "normal"
    steps: int | None = None
    """None: as the preset says."""
    held_out: int = 8
    """Every so-many-th view is not learned from but compared with; 0: none is."""
    seed: int = 0
    """Random seed of the training."""
    threads: int | None = None
    """None: one per processor. Changes no result."""
    rays_per_step: int | None = None
    """Rays that a step learns from [1]; None: as the preset says."""
    hull: HullConfig = DEFAULT_HULL
    """How the visual hull is carved, whose cells are the field's."""


DEFAULT_FIELD = RadianceFieldConfig()


@dataclass(frozen=True)
class RadianceField:
    """Density and colour in space; N nodes of a grid have them, everywhere else there is nothing.

    Between nodes numbers are interpolated linearly. Density σ [1/m] is softplus(s) / cell, a colour in sRGB the
    logistic function of its logit.
    """

    grid: VoxelGrid
    """Nodes."""
    row: Int[np.ndarray, "X Y Z"]
    """Where a node's numbers are; -1: it has none."""
    open: Bool[np.ndarray, "X1 Y1 Z1"]
    """Cubes that may hold something; all their corners have numbers."""
    values: Float32[np.ndarray, "N 4"]
    """s, and the logits of red, green and blue."""


@dataclass(frozen=True)
class TrainedField:
    """What came of it."""

    field: RadianceField
    quality: HeldOutQuality | None
    """On held-out views."""
    seconds: float

    @property
    def statements(self) -> tuple[str, ...]:
        """How it came about, in sentences, for the report."""
        made = f"Points were sampled from a radiance field of {len(self.field.values):,} nodes."
        if self.quality is None:
            return (made,)
        count, q = len(self.quality.views), self.quality
        return (
            made,
            f"Pictures of it agree with {count} others that it was not learned from to "
            f"{q.psnr:.1f} dB, {q.psnr_on_objects:.1f} dB on objects.",
        )


def haze_field(low: Float[np.ndarray, "3"], cell: float, filled: Bool[np.ndarray, "X1 Y1 Z1"]) -> RadianceField:
    """Return a field of grey haze.

    Args:
        low: Of the first cube [m].
        cell: Side of a cube [m].
        filled: Which cubes may hold something.
    """
    x, y, z = filled.shape
    corner = np.zeros((x + 1, y + 1, z + 1), np.bool_)
    for a, b, c in product((0, 1), repeat=3):
        corner[a : a + x, b : b + y, c : c + z] |= filled
    row = np.full((x + 1, y + 1, z + 1), -1, np.int32)
    count = int(corner.sum())
    row[corner] = np.arange(count, dtype=np.int32)
    values = np.zeros((count, 4), np.float32)
    values[:, 0] = INITIAL_DENSITY_LOG
    start = float(low[0]), float(low[1]), float(low[2])
    return RadianceField(VoxelGrid(start, cell, (x + 1, y + 1, z + 1)), row, filled, values)


def render_field(field: RadianceField, camera: Camera, threads: int | None = None) -> RenderedPicture:
    """Picture a field before black; the depth is where half of the light is lost [m]."""
    out = np.empty((camera.height * camera.width, 5), np.float32)
    rest = field_camera_rows(field.grid, (camera,))[0], camera.width, field_arrays(field), out
    with ThreadPool(threads) as pool:
        pool.each(kernels_radiance.render_pixels, [(*span, *rest) for span in pool.spans(len(out))])
    rgb, alpha, depth = out[:, :3], out[:, 3], out[:, 4]
    size = camera.height, camera.width
    return RenderedPicture(rgb.reshape(*size, 3).copy(), alpha.reshape(size), depth.reshape(size))


def field_colours(field: RadianceField, position: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Return the field's colour at places [m], sRGB in [0, 1]; what has none is grey."""
    inside = (position - np.array(field.grid.low)) / field.grid.cell
    share = trilinear_weights(inside, field.grid.shape)
    known = np.flatnonzero(field.row.ravel() >= 0)
    logits = np.asarray(share[:, known] @ field.values[field.row.ravel()[known], 1:])
    return 1 / (1 + np.exp(-logits))


@dataclass(frozen=True)
class FieldPoints:
    """Points where a field is dense; N of them."""

    position: Float[np.ndarray, "N 3"]
    """[m]"""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    depth: Float32[np.ndarray, "V H W"]
    """At which each view's rays lose half of their light, along z [m]; inf where they do not."""


def field_surface_points(
    field: RadianceField,
    cameras: Sequence[Camera],
    most: int,
    seed: int = 0,
    allowed: Callable[[np.ndarray], np.ndarray] | None = None,
    threads: int | None = None,
) -> FieldPoints:
    """Return points on what is dense: where rays of the cameras lose half of their light.

    One in each cube that rays of two views end in, their mean.

    Args:
        field: What was learned.
        cameras: That it was learned from.
        most: No more points than that, by chance.
        seed: Of chance.
        allowed: Tells places (N, 3) where objects are from others. Where few views see, nothing tells them that it is
            empty, and something may float.
        threads: None: one per processor.

    Raises:
        UserError: No view shows anything of the field.
    """
    depth = np.stack([render_field(field, camera, threads).depth for camera in cameras])
    found, view = _ray_ends(cameras, depth)
    cube = np.floor((found - np.array(field.grid.low)) / field.grid.cell).astype(np.int64)
    number = np.ravel_multi_index(tuple(cube.T), field.grid.shape, mode="clip")
    _, of = np.unique(number, return_inverse=True)
    pairs = np.unique(np.stack([of, view], axis=1), axis=0)
    kept = np.bincount(pairs[:, 0]) >= MIN_POINT_VIEWS
    ends = np.bincount(of)[kept, None]
    position = np.stack([np.bincount(of, x)[kept] for x in found.T], axis=1) / ends
    if allowed is not None:
        position = position[allowed(position)]
    if not len(position):
        raise UserError(
            "The radiance field is empty: what one picture shows, no other does. Check that "
            "cameras, pictures and masks belong together."
        )
    if len(position) > most:
        chosen = np.random.default_rng(seed).choice(len(position), most, replace=False)
        position = position[np.sort(chosen)]
    return FieldPoints(position, field_colours(field, position), depth)


def _ray_ends(
    cameras: Sequence[Camera], depth: Float32[np.ndarray, "V H W"], max_pixels: int = MAX_SAMPLED_PIXELS
) -> tuple[Float[np.ndarray, "R 3"], Int[np.ndarray, " R"]]:
    """Return where rays lose half of their light [m], and of which view each is.

    max_pixels: where pictures have more together, rays are of every so-many-th row and column.
    """
    apart = int(np.ceil(np.sqrt(depth.size / max_pixels)))
    view, v, u = np.nonzero(np.isfinite(depth[:, ::apart, ::apart]))
    v, u, found = apart * v, apart * u, np.empty((len(view), 3))
    for k, camera in enumerate(cameras):
        own, pose = view == k, camera.world_from_camera
        flat = np.stack([u[own] + 0.5, v[own] + 0.5, np.ones(own.sum())]) * depth[k, v[own], u[own]]
        found[own] = (pose[:3, :3] @ np.linalg.solve(camera.K, flat)).T + pose[:3, 3]
    return found, view


def field_arrays(field: RadianceField) -> tuple:
    """Return a field as kernels read it."""
    away = np.asarray(distance_transform_cdt(np.logical_not(field.open), "chessboard"))
    gap = np.minimum(np.abs(away), MAX_LEAP_CUBES).astype(np.uint8)  # -1: nothing is open
    most = int(np.linalg.norm(field.row.shape) / SAMPLE_STRIDE_CUBES) + 2
    return field.row, gap, field.values, np.float32(SAMPLE_STRIDE_CUBES), most


def field_camera_rows(grid: VoxelGrid, cameras: tuple[Camera, ...]) -> Float32[np.ndarray, "V 16"]:
    """Return cameras as kernels read them: world from camera (3 x 3), eye, fx, fy, cx, cy.

    In cubes, but for one unit of depth [m].

    Raises:
        UserError: A camera is skewed.
    """
    made = np.empty((len(cameras), 16), np.float32)
    for r, camera in zip(made, cameras, strict=True):
        K, pose = camera.K, camera.world_from_camera
        if abs(K[0, 1]) > 1e-6 * K[0, 0]:
            raise UserError("A camera's K is skewed: its pixels are not rectangular. Rectify.")
        r[:9] = (pose[:3, :3] / grid.cell).ravel()
        r[9:12] = (pose[:3, 3] - grid.low) / grid.cell
        r[12:] = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    return made


def train_field(
    views: Views,
    masks: Masks,
    config: RadianceFieldConfig = DEFAULT_FIELD,
    checkpoint: Path | None = None,
    progress: Progress = no_progress,
) -> TrainedField:
    """Learn a field of objects from posed pictures.

    Args:
        views: Pictures and cameras.
        masks: What belongs to the objects; only that is learned.
        config: How.
        checkpoint: Where what was learned is kept, and not learned again.
        progress: Called with the fraction done and what is being done.

    Raises:
        UserError: There are too few pictures, masks of another shape, or cameras and pictures do not belong together.
    """
    begun = time.monotonic()
    check_training_views(views, masks)
    preset = FIELD_PRESETS[config.preset]
    preset = replace(
        preset, steps=config.steps or preset.steps, rays_per_step=config.rays_per_step or preset.rays_per_step
    )
    count, every = len(views.cameras), config.held_out
    held = tuple(range(every // 2, count, every)) if every and count > every else ()
    chosen = [k for k in range(count) if k not in held]
    cameras = tuple(views.cameras[k] for k in chosen)
    work = Views(views.rgb[chosen], cameras), masks[chosen]
    poses = [(c.K.tolist(), c.world_from_camera.tolist()) for c in cameras]
    how = preset, config.seed, config.hull
    name = training_checkpoint.fingerprint(*work[0].rgb, work[1], poses, *how)
    state = training_checkpoint.load_checkpoint(checkpoint, name) if checkpoint is not None else {}
    with ThreadPool(config.threads) as pool:
        made = _field_from_state(state) if state else _haze_in_hull(*work, pool, config.hull)
        if not state:
            data = _TrainingData(made, *work, preset, config.seed)
            _optimise_field(data, pool, progress)
    if checkpoint is not None and not state:
        training_checkpoint.save_checkpoint(checkpoint, name, _checkpoint_state(made))
    out = _field_quality(made, views, masks, held) if held else None
    return TrainedField(made, out, time.monotonic() - begun)


def _checkpoint_state(made: RadianceField) -> dict[str, Any]:
    place = np.array([*made.grid.low, made.grid.cell])
    return {"place": place, "open": made.open, "values": made.values}


def _field_from_state(state: dict[str, np.ndarray]) -> RadianceField:
    begun = haze_field(state["place"][:3], float(state["place"][3]), state["open"])
    begun.values[:] = state["values"]
    return begun


def _haze_in_hull(views: Views, masks: Masks, pool: ThreadPool, config: HullConfig) -> RadianceField:
    """Return a field of haze in the visual hull of masks."""
    hull = carve_tight_hull(views, masks, pool, config)
    filled = binary_dilation(np.pad(hull.inside, HULL_PADDING_CUBES), np.ones((3, 3, 3)), iterations=HULL_PADDING_CUBES)
    low = hull.cells[0, 0, 0] - (0.5 + HULL_PADDING_CUBES) * hull.side
    return haze_field(low, hull.side, filled)


class _TrainingData:
    """What there is to learn from."""

    def __init__(self, made: RadianceField, views: Views, masks: Masks, preset: FieldPreset, seed: int) -> None:
        factor = -(-max(views.rgb.shape[1:3]) // preset.longest)
        full = masks[..., None] * np.uint8(255)
        rgb = np.stack([shrink_picture(picture, factor) for picture in views.rgb])
        cover = np.stack([shrink_picture(mask, factor)[..., 0] for mask in full])
        self.field, self.preset, self.seed = made, preset, seed
        self.width = rgb.shape[2]
        self.pictures = rgb.reshape(len(rgb), -1, 3)
        self.masks = cover.reshape(len(rgb), -1)
        self.cameras = field_camera_rows(made.grid, views.cameras)
        self.cameras[:, 12:] /= factor
        near = maximum_filter(cover, (0, RIM_WINDOW_PX, RIM_WINDOW_PX))
        self.rays = np.argwhere(near.reshape(len(rgb), -1) > 0).astype(np.int32)


def _optimise_field(data: _TrainingData, pool: ThreadPool, progress: Progress) -> None:
    """Change a field's numbers until it looks like the pictures."""
    values, grid = data.field.values, field_arrays(data.field)
    gradients = np.zeros((GRADIENT_SHARES, *values.shape), np.float32)
    moments = np.zeros((2, *values.shape), np.float32)
    shown = data.width, data.cameras, data.pictures, data.masks, grid
    steps, count = data.preset.steps, data.preset.rays_per_step
    for step in range(steps):
        rng = np.random.default_rng([data.seed, 3, step])
        rays = data.rays[rng.integers(0, len(data.rays), count)]
        # Random places along random rays, before a random background.
        jitter, background = rng.random(count, np.float32), rng.random(3, np.float32)
        sums = np.zeros((GRADIENT_SHARES, 3))
        deals = [slice(k, None, GRADIENT_SHARES) for k in range(GRADIENT_SHARES)]
        pool.each(
            kernels_radiance.ray_loss_gradient,
            [(rays[d], jitter[d], background, *shown, gradients[k], sums[k]) for k, d in enumerate(deals)],
        )
        # Adam on the sum of all shares' gradients.
        rate = np.float32(LEARNING_RATE * FINAL_RATE_FRACTION ** (step / steps))
        rest = values, gradients, moments, rate, step + 1
        pool.each(kernels_radiance.adam_nodes, [(*span, *rest) for span in pool.spans(len(values))])
        error = sums[:, 1].sum() / 3 / count
        words = f"step {step + 1} of {steps}, {-10 * np.log10(max(error, 1e-12)):.1f} dB"
        progress((step + 1) / steps, words)


def _field_quality(made: RadianceField, views: Views, masks: Masks, held: tuple[int, ...]) -> HeldOutQuality:
    """Compare a field with views that it was not learned from, before grey."""
    rows, behind = [], np.array(GREY_BACKGROUND)
    for k in held:
        shown = render_field(made, views.cameras[k])
        rgb = shown.rgb + (1 - shown.alpha[..., None]) * behind
        real = np.where(masks[k][..., None], views.rgb[k] / np.float32(255), behind)
        on = psnr(rgb[masks[k]], real[masks[k]])
        rows.append((psnr(rgb, real), on, ssim(rgb, real)))
    whole, on, alike = (float(x) for x in np.nanmean(rows, axis=0))
    return HeldOutQuality(whole, on, alike, held)
