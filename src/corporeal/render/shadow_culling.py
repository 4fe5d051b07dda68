"""Culling of shadow rays that cannot hit an object."""

import numpy as np
from jaxtyping import Bool, Float, Float32

from corporeal.render import kernels_floor, kernels_hits, kernels_sparse_light
from corporeal.render.kernels_floor import TILE_PX
from corporeal.render.kernels_light import StudioLamps
from corporeal.render.kernels_sparse_light import DIRECTION_SETS
from corporeal.render.ray_scene import RayScene

MIN_SUN_SINE = 1e-3
"""Sine of the lowest sun whose shadows are followed."""


def tiles_with_surfaces(
    stage: RayScene, eye: Float[np.ndarray, "3"], frame: Float[np.ndarray, "3 3"], tangent: float, size: tuple[int, int]
) -> Bool[np.ndarray, "rows columns"]:
    """Tiles of a picture in which surfaces could be seen.

    Args:
        stage: The surfaces.
        eye: Where from [m].
        frame: Right, up and back of the camera, as rows.
        tangent: Of half the vertical field of view.
        size: Width and height [px].
    """
    seen = np.zeros([-(-n // TILE_PX) for n in size[::-1]], np.bool_)
    if stage.shown:
        kernels_floor.mark_outlined_tiles(stage.vertices, stage.look.triangles, eye, frame, tangent, size, seen)
    return seen


def tiles_to_pixels(tiles: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Give each pixel (rows, columns) what its tile has."""
    return np.repeat(np.repeat(tiles, TILE_PX, axis=0), TILE_PX, axis=1)[: shape[0], : shape[1]]


def floor_light_directions(lamps: StudioLamps, sky: int) -> Float32[np.ndarray, "ways 3"]:
    """Where pixels of the floor look: to the sky, and last to the sun."""
    s = kernels_hits.hit_buffer(1)
    s.normal[:, 2] = s.flat[:, 2] = 1.0
    up = np.empty((DIRECTION_SETS * sky, 3), np.float32)
    kernels_sparse_light.surface_directions(s, sky, up)
    return np.concatenate([up, lamps.sun[None]])


def shadow_blur_width(lamps: StudioLamps, boxes: np.ndarray) -> float:
    """How much farther than along the middle of the sun a shadow may go on the floor [m]."""
    across, up = float(np.hypot(*lamps.sun[:2])), float(lamps.sun[2])
    lowest = max(up - lamps.softness, MIN_SUN_SINE)
    tall = float(boxes[:, 1, 2].max(initial=0.0)) - float(lamps.floor[3])
    return max(tall, 0.0) * lamps.softness * (1 + across / up) / lowest
