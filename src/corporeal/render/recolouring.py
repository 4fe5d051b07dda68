"""One scene in several sets of plain colours, in the same light.

What is seen does not depend on colours. Which light arrives at a surface does not depend on its
colour, nor on that of others where all are matt. Both are asked for once, and shaded in each set of
colours.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import UInt8

from corporeal.core.process_resources import usable_cores
from corporeal.render.camera_placement import CameraAim
from corporeal.render.embree import (
    MIN_BAND_ROWS,
    RAY_SAMPLING,
    PixelBlock,
    Quality,
    Rays,
    RaySampling,
    RenderJob,
)
from corporeal.render.kernels_hits import HitBuffer
from corporeal.render.ray_scene import RayScene


def render_recoloured(
    stages: Sequence[RayScene], camera: CameraAim, quality: Quality
) -> list[UInt8[np.ndarray, "H W 3"]]:
    """Take a picture of each stage: the bytes of ``render``, with one search for light.

    Args:
        stages: One scene, ``painted`` in different colours.
        camera: Where from.
        quality: How finely.

    """
    size = camera.height, camera.width
    pictures = [np.empty((*size, 3), np.uint8) for _ in stages]
    threads = usable_cores()
    band = max(MIN_BAND_ROWS, -(-camera.height // (2 * threads)))
    rows = [(k, min(k + band, camera.height)) for k in range(0, camera.height, band)]

    def take(some: tuple[int, int]) -> None:
        job = _RecolouredJob(stages[0], camera, RAY_SAMPLING[quality])
        for stage, picture in zip(stages, pictures, strict=True):
            job.stage = stage
            job.band(some, picture)

    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(take, rows):
            pass
    return pictures


class _RecolouredJob(RenderJob):
    """Some rows of pictures, the first of which asks for what is seen, and for light."""

    def __init__(self, stage: RayScene, camera: CameraAim, sampling: RaySampling) -> None:
        super().__init__(stage, camera, sampling)
        self._hit: tuple[np.ndarray, ...] | None = None
        self._arrived: np.ndarray | None = None

    def first_hit(self, rays: Rays) -> tuple[np.ndarray, ...]:
        """Return what rays from the camera meet, the same in each picture."""
        if self._hit is None:
            self._hit = super().first_hit(rays)
        return self._hit

    def gather(self, s: HitBuffer, d: np.ndarray, on: np.ndarray, block: PixelBlock) -> np.ndarray:
        """Light that arrives at the samples ``on``, which are the same in each picture."""
        if self._arrived is None:
            self._arrived = super().gather(s, d, on, block)
        return self._arrived
