"""Points on objects, and what their pictures look like."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.core.types import Cloud
from corporeal.geometry.harmonics import DC
from corporeal.reconstruction.features.clouds import Placed, projected
from corporeal.reconstruction.features.descriptor import LET_THROUGH, seen_from
from corporeal.reconstruction.features.lifting import Lifted, known, uplift
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.feature_distillation import distilled
from corporeal.reconstruction.gaussians.field_points import field_points
from corporeal.reconstruction.gaussians.foreground import Shown, foreground, shown
from corporeal.reconstruction.gaussians.intake import Intake
from corporeal.reconstruction.gaussians.radiance import FieldConfig
from corporeal.reconstruction.gaussians.raster import weights
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.segment.masks import lifted

MOST_POINTS = 100_000
"""Points that are looked at; other Gaussians do as their neighbours."""
CELL = 8
"""Pixels along a cell of blending weights: maps of features are no finer."""


@dataclass(frozen=True)
class Foreground:
    """What shows of the Gaussians, and which of them are no floor and no background."""

    shown: Shown
    on_objects: Int[np.ndarray, " M"]
    """Numbers of Gaussians."""


def foreground_of(source: Path, taken: Intake) -> Foreground:
    """Tell objects from floor and background.

    Raises:
        UserError: Nothing stands out.

    """
    seen = shown(taken.gaussians, taken.cameras, taken.masks)
    found = np.flatnonzero(foreground(taken.gaussians, taken.cameras, seen, taken.floor))
    if not len(found):
        what = "shows nothing but floor and background"
        raise UserError(f"{source} {what}. Give masks of the objects.")
    return Foreground(seen, found)


def points_on_objects(
    taken: Intake,
    seen: Shown,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Return points on objects, and how what their pictures look like comes onto them."""
    if config.lifting == "radiance":
        return _of_field(taken, on_objects, config, folder, progress)
    gaussians, cameras = taken.gaussians, taken.cameras
    if len(on_objects) > MOST_POINTS:
        random = np.random.default_rng(config.training_seed)
        on_objects = np.sort(random.choice(on_objects, MOST_POINTS, replace=False))
    position = gaussians.mean[on_objects].astype(np.float64)
    colour = np.clip(0.5 + DC * gaussians.sh[on_objects, 0], 0, 1)
    if config.lifting == "back-projection":
        with ThreadPool() as pool:
            depth = render_depth(gaussians, cameras, pool).depth
        return projected(position, colour, cameras, depth, on_objects)
    outside = seen_from(position, cameras, list(seen.share[:, on_objects]), LET_THROUGH)
    shares = cache(lambda v: weights(gaussians, cameras[v], CELL)[on_objects])
    cells = -(-cameras[0].height // CELL), -(-cameras[0].width // CELL)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return uplift(shares, cells, maps, len(on_objects), seen.least)

    return Placed(position, colour, outside, seen.views[on_objects], lift, on_objects)


def _of_field(
    taken: Intake,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Learn a radiance field of the objects, and take points from where it is dense."""
    how = FieldConfig(config.training, seed=config.training_seed)
    kept = None if folder is None else folder / "radiance.npz"
    learned, found = field_points(taken, on_objects, MOST_POINTS, how, kept, progress)
    placed = projected(found.position, found.colour, taken.cameras, found.depth)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return known(distilled(learned.field, taken.cameras, maps).at(found.position))

    return replace(placed, lift=lift, statements=learned.statements)


def drawn_masks(
    taken: Intake, cloud: Cloud, on_objects: Int[np.ndarray, " M"]
) -> Int[np.ndarray, "V N"] | None:
    """Return what instance masks take each point for in each view; None: there are none."""
    if taken.views is None or taken.views.object_of_pixel is None:
        return None
    near = on_objects[KDTree(taken.gaussians.mean[on_objects]).query(cloud.position)[1]]
    pixels = list(taken.views.object_of_pixel)
    return lifted(lambda v: weights(taken.gaussians, taken.cameras[v])[near], pixels, cloud.count)
