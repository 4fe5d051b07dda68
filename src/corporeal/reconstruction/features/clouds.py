"""Points that somebody placed, looked at by models or by none."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Camera, Cloud
from corporeal.reconstruction.features import connect
from corporeal.reconstruction.features.descriptor import descriptor, seen_from
from corporeal.reconstruction.features.lifting import Lifted, back_projection, fill, visible

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
    outside: Float[np.ndarray, "N 3"]
    """Roughly where the outside is of each, of any length."""
    seen: Int[np.ndarray, " N"]
    """In how many views."""
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
    shown = np.stack([visible(position, camera, d, LEEWAY) for camera, d in pairs])
    outside, seen = seen_from(position, cameras, list(shown)), shown.sum(axis=0)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return back_projection(position, cameras, depth, maps, LEEWAY)

    return Placed(position, colour, outside, seen, lift, gaussian_of_point)


def with_features(
    placed: Placed, pictures: Pictures, specs: tuple[str, str], folder: Path | None = None
) -> Cloud:
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
        encoder = connect(spec, folder)
        if encoder is None:
            of_spec[spec] = descriptor(placed.position, placed.colour, placed.outside)
            continue
        maps = [encoder.map(picture) for picture in pictures()]
        of_spec[spec] = fill(placed.position, placed.lift(maps)).unit()
    what, where = (of_spec[spec] for spec in specs)
    rest = placed.seen, placed.gaussian_of_point
    return Cloud(placed.position, placed.colour, what, where, *rest)
