"""Where Gaussians start: on the visual hull of masks, or on given points."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import binary_erosion
from scipy.spatial import KDTree

from corporeal.core.types import Camera
from corporeal.geometry.harmonics import DC
from corporeal.multiview.region import region
from corporeal.reconstruction.gaussians.hull import Outlines, witnessed
from corporeal.reconstruction.gaussians.parameters import (
    COLOUR,
    MEAN,
    OPACITY,
    ROTATION,
    SCALE,
    Parameters,
)
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

OPAQUE, FAINT = 0.5, 0.3
"""Opacity of Gaussians where they begin, on the hull and inside."""

FLAT = 0.1
"""Scale along known normals over that across, at first."""
ROOM = 0.3
"""Depth of the free space before a camera, in its distances from what all look at."""


@dataclass(frozen=True)
class Points:
    """Coloured points to start from."""

    position: Float[np.ndarray, "N 3"]
    """[m]"""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    opacity: float | Float[np.ndarray, " N"] = OPAQUE
    """Of the Gaussians that begin there."""
    normal: Float[np.ndarray, "N 3"] | None = None
    """Unit, of surfaces, along which Gaussians begin flat; 0: unknown."""
    width: Float[np.ndarray, " N"] | None = None
    """Scale of the Gaussians that begin there [m]; nan: they are as wide as they are apart."""


def joined(*groups: Points) -> Points:
    """Return points of several kinds together."""
    return Points(
        np.concatenate([p.position for p in groups]),
        np.concatenate([p.colour for p in groups]),
        np.concatenate([np.broadcast_to(p.opacity, len(p.position)) for p in groups]),
        np.concatenate([_or(p.normal, np.zeros((len(p.position), 3))) for p in groups]),
        np.concatenate([_or(p.width, np.full(len(p.position), np.nan)) for p in groups]),
    )


def _or(value: np.ndarray | None, unknown: np.ndarray) -> np.ndarray:
    return unknown if value is None else value


def chosen(points: Points, which: Int[np.ndarray, " n"]) -> Points:
    """Return some of the points."""
    o, normal, width = points.opacity, points.normal, points.width
    return Points(
        points.position[which],
        points.colour[which],
        o[which] if isinstance(o, np.ndarray) else o,
        None if normal is None else normal[which],
        None if width is None else width[which],
    )


def clearance(cameras: tuple[Camera, ...]) -> Float[np.ndarray, " V"]:
    """Return the depth before each camera where nothing is drawn [m].

    Photographers keep a distance. What a training puts there helps one picture and spoils others.
    """
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    return ROOM * np.linalg.norm(eyes - region(cameras).centre, axis=1)


def on_hull(
    outlines: Outlines,
    count: int,
    rng: np.random.Generator,
    pool: ThreadPool,
    within: float = 0.0,
) -> Points:
    """Return points on the visual hull, the surface of what masks and lines of sight allow.

    within: share of them that is inside, as small as those on the hull: wide ones would show
    through plain faces.

    """
    views, masks, fine = outlines.views, outlines.masks, outlines.hull
    shell = fine.cells[fine.inside & np.logical_not(binary_erosion(fine.inside))]
    deep = round(within * count)
    on = count - deep
    position = np.concatenate([_some(fine.cells[fine.inside], deep, rng), _some(shell, on, rng)])
    position += fine.side * rng.uniform(-0.5, 0.5, position.shape)
    seen = witnessed(position, views, masks, pool)
    apart = fine.side * np.sqrt(len(shell) / on)
    return Points(
        position,
        seen[:, 2:5] / np.maximum(seen[:, :1], 1),
        np.repeat([FAINT, OPAQUE], [deep, on]),
        width=np.repeat([apart, np.nan], [deep, on]),
    )


def _some(cells: Float[np.ndarray, "N 3"], count: int, rng: np.random.Generator) -> np.ndarray:
    return cells[rng.choice(len(cells), count, replace=len(cells) < count)]


def seeded(points: Points, count: int, degree: int, rng: np.random.Generator) -> Parameters:
    """Return Gaussians on some of the points, as wide as these are apart; flat on surfaces."""
    if len(points.position) > count:
        points = chosen(points, rng.choice(len(points.position), count, replace=False))
    n = len(points.position)
    theta = np.zeros((n, COLOUR + 3 * (degree + 1) ** 2), np.float32)
    theta[:, MEAN:ROTATION] = points.position
    theta[:, ROTATION:SCALE] = rng.normal(size=(n, 4))
    theta[:, ROTATION:SCALE] /= np.linalg.norm(theta[:, ROTATION:SCALE], axis=1, keepdims=True)
    near, _ = KDTree(points.position).query(points.position, k=min(4, n))
    apart = np.atleast_2d(near.T).T[:, 1:].mean(axis=1) if n > 1 else np.ones(1)
    middle = float(np.median(apart)) or 1.0
    # What is far away is wide.
    away = np.linalg.norm(points.position - np.median(points.position, axis=0), axis=1)
    widest = np.maximum(10 * middle, 0.1 * away)
    width = np.clip(apart, 0.1 * middle, widest)
    if points.width is not None:
        width = np.where(np.isfinite(points.width), points.width, width)
    theta[:, SCALE:OPACITY] = np.log(width)[:, None]
    if points.normal is not None:
        flat = points.normal.any(axis=1)
        theta[flat, ROTATION:SCALE] = _facing(points.normal[flat])
        theta[flat, OPACITY - 1] += np.log(FLAT)
    theta[:, OPACITY] = np.log(points.opacity / (1 - points.opacity))
    theta[:, COLOUR : COLOUR + 3] = (points.colour - 0.5) / DC
    return theta


def _facing(normal: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 4"]:
    """Return quaternions of rotations that take +z to unit normals."""
    x, y, z = normal.T
    q = np.stack([1 + z, -y, x, np.zeros(len(normal))], axis=1)
    q[z < -1 + 1e-9] = 0, 1, 0, 0
    return q / np.linalg.norm(q, axis=1, keepdims=True)
