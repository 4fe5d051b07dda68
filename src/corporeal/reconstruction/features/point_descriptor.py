"""Handcrafted point descriptor: colour, texture, orientation, finish, thickness.

Needs no weights, and so is what segments parts where there are none. It knows nothing of
what objects are: two parts of one colour and one thickness are one to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float16, Int
from skimage.color import rgb2lab

from corporeal.core.types import Camera
from corporeal.multiview.point_cloud_geometry import medial_ball_thickness, nearest_neighbours, point_normals

GREY_LAB = np.array([50.0, 0.0, 0.0])
"""The middle of CIELAB."""
GAMUT_RADIUS_LAB100 = 1.36
"""No sRGB colour is further from it (blue is 135 away), in hundreds."""
MAX_COLOUR_SPREAD_LAB100 = 0.5
"""Largest local spread of colours distinguished from larger ones, in hundreds of CIELAB."""
MIN_THICKNESS_FRACTION = 1e-3
"""Smallest thickness distinguished from smaller ones, as a share of the whole cloud's extent."""
MAX_SHOWING_THROUGH_FRACTION = 0.12
"""Share of a Gaussian that may show through others that hide it."""
DESCRIPTOR_CHANNELS = 11
"""Colour 3, spread 1, normal 3, roughness and metallic 2, thickness 1, and what makes it unit."""


@dataclass(frozen=True)
class DescriptorConfig:
    """How much each look counts: the distance that its full range makes."""

    neighbours: int = 16
    """Points that count as the surroundings of a point, itself included."""
    colour: float = 1.0
    """Per hundred units of CIELAB: from black to white."""
    spread: float = 1.0
    """Per hundred units of CIELAB."""
    normal: float = 0.1
    """Per radian, about."""
    finish: float = 0.5
    """From mirror to chalk; from no metal to metal."""
    thickness: float = 0.3
    """From ``MIN_THICKNESS_FRACTION`` to all of the cloud's extent, on a logarithmic scale."""


DEFAULT_DESCRIPTOR = DescriptorConfig()


def point_descriptor(
    position: Float[np.ndarray, "N 3"],
    colour: Float[np.ndarray, "N 3"],
    towards: Float[np.ndarray, "N 3"],
    finish: Float[np.ndarray, "N 2"] | None = None,
    config: DescriptorConfig = DEFAULT_DESCRIPTOR,
) -> Float16[np.ndarray, "N 11"]:
    """Describe every point by a unit vector.

    All looks, weighted, are x, |x| ≤ R; the descriptor is (x, √(R² − |x|²)) / R. So equal looks make equal vectors, and
    others are at least |x − y| / R apart.

    Args:
        position: World [m].
        colour: sRGB in [0, 1].
        towards: Where the outside is; ``mean_view_directions`` says it.
        finish: Roughness and metallic in [0, 1], where they are known.
        config: How much each look counts.
    """
    near = nearest_neighbours(position, config.neighbours)
    hue = (rgb2lab(np.clip(colour, 0, 1)[None])[0] - GREY_LAB) / 100
    normal = point_normals(position, near, towards)
    known = np.full((len(position), 2), 0.5) if finish is None else finish
    features = (
        (config.colour, GAMUT_RADIUS_LAB100, hue),
        (config.spread, MAX_COLOUR_SPREAD_LAB100, _colour_spread(hue, near)[:, None]),
        (config.normal, 1.0, normal),
        (config.finish, np.sqrt(0.5), known - 0.5),
        (config.thickness, 0.5, _thickness_share(medial_ball_thickness(position, normal), position)[:, None]),
    )
    radius = np.sqrt(sum((weight * bound) ** 2 for weight, bound, _ in features))
    x = np.concatenate([weight * feature for weight, _, feature in features], axis=1)
    rest = np.sqrt(np.maximum(radius**2 - np.sum(x**2, axis=1), 0))
    return (np.column_stack([x, rest]) / radius).astype(np.float16)


def _colour_spread(hue: np.ndarray, near: Int[np.ndarray, "N k"]) -> np.ndarray:
    """Return how much colours differ around each point: their standard deviation, bounded."""
    around = hue[near]
    squares = ((around - around.mean(axis=1, keepdims=True)) ** 2).sum(axis=2)
    return np.minimum(np.sqrt(squares.mean(axis=1)), MAX_COLOUR_SPREAD_LAB100)


def _thickness_share(thick: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return thickness between -0.5 and 0.5, from thinnest to all of the extent."""
    extent = np.linalg.norm(np.ptp(position, axis=0))
    share = np.clip(thick / extent, MIN_THICKNESS_FRACTION, 1) if extent > 0 else np.ones(len(thick))
    return 0.5 - np.log(share) / np.log(MIN_THICKNESS_FRACTION)


def mean_view_directions(
    position: Float[np.ndarray, "N 3"], cameras: Sequence[Camera], shares: Sequence[np.ndarray], least: float = 0.0
) -> Float[np.ndarray, "N 3"]:
    """Return the mean direction that points are seen from; its length says nothing.

    What no camera sees is taken to face away from them, as undersides do.

    Args:
        position: World [m].
        cameras: One per view.
        shares: Of each view, how much each point has to show in it: 0 or 1 from ``lifting.visible``, or a Gaussian's
            weight.
        least: Views with a smaller share speak for the other side. Gaussians let some light through, so that all views
            see a little of what is behind others.
    """
    seen, ahead = np.zeros(position.shape), np.zeros(position.shape)
    for camera, share in zip(cameras, shares, strict=True):
        to = camera.world_from_camera[:3, 3] - position
        to = to / np.maximum(np.linalg.norm(to, axis=1, keepdims=True), 1e-300)
        seen += (np.asarray(share, float)[:, None] - least) * to
        ahead += to
    unseen = ~seen.any(axis=1)
    seen[unseen] = -ahead[unseen]
    return seen
