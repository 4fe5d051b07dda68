"""Points on objects, with their features."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from jaxtyping import Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import FeatureCloud, Views
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.features.feature_lifting import LiftedFeatures, known_features, uplift_features
from corporeal.reconstruction.features.point_descriptor import MAX_SHOWING_THROUGH_FRACTION, mean_view_directions
from corporeal.reconstruction.features.point_features import PlacedPoints, points_by_projection
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.feature_distillation import distil_features
from corporeal.reconstruction.gaussians.foreground import (
    GaussianVisibility,
    foreground_gaussians,
    gaussian_visibility,
    pixels_covered,
    places_near_objects,
)
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.gaussians.radiance_field import (
    FieldPoints,
    RadianceFieldConfig,
    TrainedField,
    field_surface_points,
    train_field,
)
from corporeal.reconstruction.gaussians.rasteriser_numba import gaussian_weights
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.segment.instance_masks import lift_labels


def radiance_field_points(
    taken: GaussianScene,
    of_objects: Int[np.ndarray, " M"],
    most: int,
    config: RadianceFieldConfig,
    checkpoint: Path | None = None,
    progress: Callable[[float, str], None] = no_progress,
) -> tuple[TrainedField, FieldPoints]:
    """Learn a field of the objects, and take points from where it is dense and Gaussians agree.

    Args:
        taken: Pictures, or a splat that is pictured; masks where there are any.
        of_objects: Its Gaussians that belong to objects.
        most: No more points than that.
        config: How to learn.
        checkpoint: Where what was learned is kept.
        progress: Called with the fraction done and what is being done.

    Raises:
        UserError: Cameras, pictures and masks do not belong together.
    """
    gaussians, cameras, masks = taken.gaussians, taken.cameras, taken.masks
    masks = pixels_covered(gaussians, cameras, of_objects) if masks is None else masks
    views = Views(np.stack(taken.pictures()), cameras)
    learned = train_field(views, masks, config, checkpoint, progress)
    at = partial(places_near_objects, gaussians, of_objects)
    return learned, field_surface_points(learned.field, cameras, most, config.seed, at)


MAX_OBJECT_POINTS = 100_000
"""Points that are looked at; other Gaussians do as their neighbours."""
WEIGHT_CELL_PX = 8
"""Pixels along a cell of blending weights: maps of features are no finer."""


@dataclass(frozen=True)
class Foreground:
    """What shows of the Gaussians, and which of them are no floor and no background."""

    shown: GaussianVisibility
    on_objects: Int[np.ndarray, " M"]
    """Numbers of Gaussians."""


def foreground_of(source: Path, taken: GaussianScene) -> Foreground:
    """Tell objects from floor and background.

    Raises:
        UserError: Nothing stands out.
    """
    seen = gaussian_visibility(taken.gaussians, taken.cameras, taken.masks)
    found = np.flatnonzero(foreground_gaussians(taken.gaussians, taken.cameras, seen, taken.floor))
    if not len(found):
        what = "shows nothing but floor and background"
        raise UserError(f"{source} {what}. Give masks of the objects.")
    return Foreground(seen, found)


def points_on_objects(
    taken: GaussianScene,
    seen: GaussianVisibility,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> PlacedPoints:
    """Return points on objects, and how what their pictures look like comes onto them."""
    if config.lifting == "radiance":
        return _points_of_field(taken, on_objects, config, folder, progress)
    gaussians, cameras = taken.gaussians, taken.cameras
    if len(on_objects) > MAX_OBJECT_POINTS:
        random = np.random.default_rng(config.training_seed)
        on_objects = np.sort(random.choice(on_objects, MAX_OBJECT_POINTS, replace=False))
    position = gaussians.mean[on_objects].astype(np.float64)
    colour = np.clip(0.5 + SH_DC_COEFFICIENT * gaussians.sh[on_objects, 0], 0, 1)
    if config.lifting == "back-projection":
        with ThreadPool() as pool:
            depth = render_depth(gaussians, cameras, pool).depth
        return points_by_projection(position, colour, cameras, depth, on_objects)
    outside = mean_view_directions(position, cameras, list(seen.share[:, on_objects]), MAX_SHOWING_THROUGH_FRACTION)
    shares = cache(lambda v: gaussian_weights(gaussians, cameras[v], WEIGHT_CELL_PX)[on_objects])
    cells = -(-cameras[0].height // WEIGHT_CELL_PX), -(-cameras[0].width // WEIGHT_CELL_PX)

    def lift(maps: Sequence[np.ndarray]) -> LiftedFeatures:
        return uplift_features(shares, cells, maps, len(on_objects), seen.least)

    return PlacedPoints(position, colour, outside, seen.views[on_objects], lift, on_objects)


def _points_of_field(
    taken: GaussianScene,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> PlacedPoints:
    """Learn a radiance field of the objects, and take points from where it is dense."""
    how = RadianceFieldConfig(config.training, seed=config.training_seed, hull=config.resolution.hull)
    kept = None if folder is None else folder / "radiance.npz"
    learned, found = radiance_field_points(taken, on_objects, MAX_OBJECT_POINTS, how, kept, progress)
    placed = points_by_projection(found.position, found.colour, taken.cameras, found.depth)

    def lift(maps: Sequence[np.ndarray]) -> LiftedFeatures:
        return known_features(distil_features(learned.field, taken.cameras, maps).at(found.position))

    return replace(placed, lift=lift, statements=learned.statements)


def labels_from_masks(
    taken: GaussianScene, cloud: FeatureCloud, on_objects: Int[np.ndarray, " M"]
) -> Int[np.ndarray, "V N"] | None:
    """Return what instance masks take each point for in each view; None: there are none."""
    if taken.views is None or taken.views.object_of_pixel is None:
        return None
    near = on_objects[KDTree(taken.gaussians.mean[on_objects]).query(cloud.position)[1]]
    pixels = list(taken.views.object_of_pixel)
    return lift_labels(lambda v: gaussian_weights(taken.gaussians, taken.cameras[v])[near], pixels, cloud.count)
