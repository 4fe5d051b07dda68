"""Features of given points, learned or handcrafted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Camera, FeatureCloud
from corporeal.reconstruction.features import connect_encoder
from corporeal.reconstruction.features.feature_lifting import (
    LiftedFeatures,
    back_projection,
    fill_unseen_points,
    visible_points,
)
from corporeal.reconstruction.features.point_descriptor import mean_view_directions, point_descriptor

LEARNED_DEPTH_TOLERANCE = 0.02
"""A learned point this much deeper than what its pixel shows is still seen, as a share of its depth: learned points lie
in a layer, not on a surface."""

PictureSource = Callable[[], Sequence[np.ndarray]]
"""Gives one picture per view."""


@dataclass(frozen=True)
class PlacedPoints:
    """Points on what some views show, and how maps of these views come onto them."""

    position: Float[np.ndarray, "N 3"]
    """World [m]."""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    outside: Float[np.ndarray, "N 3"]
    """Roughly where the outside is of each, of any length."""
    seen: Int[np.ndarray, " N"]
    """In how many views."""
    lift: Callable[[Sequence[np.ndarray]], LiftedFeatures]
    """Maps, one per view → features on points."""
    gaussian_of_point: Int[np.ndarray, " N"] | None = None
    """Where points are Gaussians' means."""
    statements: tuple[str, ...] = ()
    """How they came about, in sentences, for the report."""


def points_by_projection(
    position: Float[np.ndarray, "N 3"],
    colour: Float[np.ndarray, "N 3"],
    cameras: Sequence[Camera],
    depth: Float[np.ndarray, "V H W"],
    gaussian_of_point: Int[np.ndarray, " N"] | None = None,
) -> PlacedPoints:
    """Return points that take what they look like from where they fall, see ``back_projection``."""
    pairs = zip(cameras, depth, strict=True)
    shown = np.stack([visible_points(position, camera, d, LEARNED_DEPTH_TOLERANCE) for camera, d in pairs])
    outside, seen = mean_view_directions(position, cameras, list(shown)), shown.sum(axis=0)

    def lift(maps: Sequence[np.ndarray]) -> LiftedFeatures:
        return back_projection(position, cameras, depth, maps, LEARNED_DEPTH_TOLERANCE)

    return PlacedPoints(position, colour, outside, seen, lift, gaussian_of_point)


def add_point_features(
    placed: PlacedPoints, pictures: PictureSource, specs: tuple[str, str], folder: Path | None = None
) -> FeatureCloud:
    """Return points with what they look like.

    Args:
        placed: The points.
        pictures: Asked for only where a model looks.
        specs: What looks, for semantic and for structural features, as for ``features.connect``.
        folder: Where maps that were made once are kept.

    Raises:
        UserError: A model cannot be had, or no view shows any point.
    """
    of_spec = {}
    for spec in dict.fromkeys(specs):
        encoder = connect_encoder(spec, folder)
        if encoder is None:
            of_spec[spec] = point_descriptor(placed.position, placed.colour, placed.outside)
            continue
        maps = [encoder.map(picture) for picture in pictures()]
        of_spec[spec] = fill_unseen_points(placed.position, placed.lift(maps)).unit()
    what, where = (of_spec[spec] for spec in specs)
    rest = placed.seen, placed.gaussian_of_point
    return FeatureCloud(placed.position, placed.colour, what, where, *rest)
