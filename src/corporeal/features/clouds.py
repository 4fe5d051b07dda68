"""Points that somebody placed, looked at by models or by none."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from corporeal.features import connect
from corporeal.features.descriptor import descriptor, seen_from
from corporeal.features.lifting import LEAST, Lifted, back_projection, fill, visible
from corporeal.types import Camera, Cloud

LEEWAY = 0.02
"""A learned point this much deeper than what its pixel shows is still seen, as a share of its
depth: learned points lie in a layer, not on a surface."""

Pictures = Callable[[], Sequence[np.ndarray]]
"""Gives one picture per view."""


@dataclass(frozen=True)
class Placed:
    """Points on what some views show, and how maps of these views come onto them."""

    position: Float[np.ndarray, "N 3"]
    """World [m]."""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    shown: Float[np.ndarray, "V N"]
    """How much of each point each view shows [px]; or 0 and 1."""
    lift: Callable[[Sequence[np.ndarray]], Lifted]
    """Maps, one per view → features on points."""
    gaussian_of_point: Int[np.ndarray, " N"] | None = None
    """Where points are Gaussians' means."""
    statements: tuple[str, ...] = ()
    """How they came about, in sentences, for the report."""


def projected(
    position: Float[np.ndarray, "N 3"],
    colour: Float[np.ndarray, "N 3"],
    cameras: Sequence[Camera],
    depth: Float[np.ndarray, "V H W"],
    gaussian_of_point: Int[np.ndarray, " N"] | None = None,
) -> Placed:
    """Return points that take what they look like from where they fall, see ``back_projection``."""
    pairs = zip(cameras, depth, strict=True)
    shown = np.stack([visible(position, camera, d, LEEWAY) for camera, d in pairs]).astype(float)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return back_projection(position, cameras, depth, maps, LEEWAY)

    return Placed(position, colour, shown, lift, gaussian_of_point)


def looked_at(
    placed: Placed,
    cameras: Sequence[Camera],
    pictures: Pictures,
    specs: tuple[str, str],
    folder: Path | None = None,
) -> tuple[Cloud, Float[np.ndarray, "N 3"]]:
    """Return points with what they look like, and where the outside is of each.

    Args:
        placed: The points.
        cameras: One per view.
        pictures: Asked for only where a model looks.
        specs: What looks, for semantic and for structural features, as for ``features.connect``.
        folder: Where maps that were made once are kept.

    Raises:
        UserError: A model cannot be had, or no view shows any point.

    """
    outside, looks = seen_from(placed.position, cameras, list(placed.shown)), {}
    for spec in dict.fromkeys(specs):
        encoder = connect(spec, folder)
        if encoder is None:
            looks[spec] = descriptor(placed.position, placed.colour, outside)
            continue
        maps = [encoder.map(picture) for picture in pictures()]
        looks[spec] = fill(placed.position, placed.lift(maps)).unit()
    seen = np.asarray((placed.shown > LEAST).sum(axis=0), dtype=np.int64)
    what, where = (looks[spec] for spec in specs)
    cloud = Cloud(placed.position, placed.colour, what, where, seen, placed.gaussian_of_point)
    return cloud, outside
