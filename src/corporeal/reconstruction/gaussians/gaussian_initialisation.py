"""Initialisation of Gaussians on the visual hull or on given points."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import binary_erosion
from scipy.spatial import KDTree

from corporeal.core.types import Camera
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
    ParameterMatrix,
)
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import CarvedVolume, mask_votes_at_points

INITIAL_HULL_OPACITY, INITIAL_INSIDE_OPACITY = 0.5, 0.3
"""Opacity of Gaussians where they begin, on the hull and inside."""

INITIAL_FLATNESS_RATIO = 0.1
"""Scale along known normals over that across, at first."""
FREE_DEPTH_FRACTION = 0.3
"""Depth of the free space before a camera, in its distances from what all look at."""


@dataclass(frozen=True)
class StartPoints:
    """Coloured points to start from."""

    position: Float[np.ndarray, "N 3"]
    """[m]"""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    opacity: float | Float[np.ndarray, " N"] = INITIAL_HULL_OPACITY
    """Of the Gaussians that begin there."""
    normal: Float[np.ndarray, "N 3"] | None = None
    """Unit, of surfaces, along which Gaussians begin flat; 0: unknown."""
    width: Float[np.ndarray, " N"] | None = None
    """Scale of the Gaussians that begin there [m]; nan: they are as wide as they are apart."""


def join_points(*groups: StartPoints) -> StartPoints:
    """Return points of several kinds together."""
    return StartPoints(
        np.concatenate([p.position for p in groups]),
        np.concatenate([p.colour for p in groups]),
        np.concatenate([np.broadcast_to(p.opacity, len(p.position)) for p in groups]),
        np.concatenate([_or_unknown(p.normal, np.zeros((len(p.position), 3))) for p in groups]),
        np.concatenate([_or_unknown(p.width, np.full(len(p.position), np.nan)) for p in groups]),
    )


def _or_unknown(value: np.ndarray | None, unknown: np.ndarray) -> np.ndarray:
    return unknown if value is None else value


def choose_points(points: StartPoints, which: Int[np.ndarray, " n"]) -> StartPoints:
    """Return some of the points."""
    o, normal, width = points.opacity, points.normal, points.width
    return StartPoints(
        points.position[which],
        points.colour[which],
        o[which] if isinstance(o, np.ndarray) else o,
        None if normal is None else normal[which],
        None if width is None else width[which],
    )


def free_depths(cameras: tuple[Camera, ...]) -> Float[np.ndarray, " V"]:
    """Return the depth before each camera where nothing is drawn [m].

    Photographers keep a distance. What a training puts there helps one picture and spoils others.
    """
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    return FREE_DEPTH_FRACTION * np.linalg.norm(eyes - find_viewed_region(cameras).centre, axis=1)


def points_on_hull(
    outlines: CarvedVolume, count: int, rng: np.random.Generator, pool: ThreadPool, within: float = 0.0
) -> StartPoints:
    """Return points on the visual hull, the surface of what masks and lines of sight allow.

    within: share of them that is inside, as small as those on the hull: wide ones would show through plain faces.
    """
    views, masks, fine = outlines.views, outlines.masks, outlines.hull
    shell = fine.cells[fine.inside & np.logical_not(binary_erosion(fine.inside))]
    deep = round(within * count)
    on = count - deep
    position = np.concatenate([_sample_cells(fine.cells[fine.inside], deep, rng), _sample_cells(shell, on, rng)])
    position += fine.side * rng.uniform(-0.5, 0.5, position.shape)
    seen = mask_votes_at_points(position, views, masks, pool)
    apart = fine.side * np.sqrt(len(shell) / on)
    return StartPoints(
        position,
        seen[:, 2:5] / np.maximum(seen[:, :1], 1),
        np.repeat([INITIAL_INSIDE_OPACITY, INITIAL_HULL_OPACITY], [deep, on]),
        width=np.repeat([apart, np.nan], [deep, on]),
    )


def _sample_cells(cells: Float[np.ndarray, "N 3"], count: int, rng: np.random.Generator) -> np.ndarray:
    return cells[rng.choice(len(cells), count, replace=len(cells) < count)]


def initial_gaussians(points: StartPoints, count: int, degree: int, rng: np.random.Generator) -> ParameterMatrix:
    """Return Gaussians on some of the points, as wide as these are apart; flat on surfaces."""
    if len(points.position) > count:
        points = choose_points(points, rng.choice(len(points.position), count, replace=False))
    n = len(points.position)
    theta = np.zeros((n, PARAM_COLOUR + 3 * (degree + 1) ** 2), np.float32)
    theta[:, PARAM_MEAN:PARAM_ROTATION] = points.position
    theta[:, PARAM_ROTATION:PARAM_SCALE] = rng.normal(size=(n, 4))
    theta[:, PARAM_ROTATION:PARAM_SCALE] /= np.linalg.norm(theta[:, PARAM_ROTATION:PARAM_SCALE], axis=1, keepdims=True)
    near, _ = KDTree(points.position).query(points.position, k=min(4, n))
    apart = np.atleast_2d(near.T).T[:, 1:].mean(axis=1) if n > 1 else np.ones(1)
    middle = float(np.median(apart)) or 1.0
    # What is far away is wide.
    away = np.linalg.norm(points.position - np.median(points.position, axis=0), axis=1)
    widest = np.maximum(10 * middle, 0.1 * away)
    width = np.clip(apart, 0.1 * middle, widest)
    if points.width is not None:
        width = np.where(np.isfinite(points.width), points.width, width)
    theta[:, PARAM_SCALE:PARAM_OPACITY] = np.log(width)[:, None]
    if points.normal is not None:
        flat = points.normal.any(axis=1)
        theta[flat, PARAM_ROTATION:PARAM_SCALE] = _quaternions_facing(points.normal[flat])
        theta[flat, PARAM_OPACITY - 1] += np.log(INITIAL_FLATNESS_RATIO)
    theta[:, PARAM_OPACITY] = np.log(points.opacity / (1 - points.opacity))
    theta[:, PARAM_COLOUR : PARAM_COLOUR + 3] = (points.colour - 0.5) / SH_DC_COEFFICIENT
    return theta


def _quaternions_facing(normal: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 4"]:
    """Return quaternions of rotations that take +z to unit normals."""
    x, y, z = normal.T
    q = np.stack([1 + z, -y, x, np.zeros(len(normal))], axis=1)
    q[z < -1 + 1e-9] = 0, 1, 0, 0
    return q / np.linalg.norm(q, axis=1, keepdims=True)
