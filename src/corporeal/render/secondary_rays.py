"""Secondary rays: shadow, occlusion and reflection."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int

from corporeal.render import kernels_adaptive_sampling, kernels_light, kernels_sparse_light, kernels_video
from corporeal.render.embree import PixelBlock, PixelPlaces
from corporeal.render.kernels_adaptive_sampling import COMPARED_OFFSET_PX, SAMPLING_SETS, SET_SIDE_PX
from corporeal.render.kernels_hits import HitBuffer
from corporeal.render.kernels_light import LIGHT_CHANNELS, StudioLamps
from corporeal.render.kernels_sparse_light import DIRECTION_SETS, LIGHT_CHANNELS_PADDED, SUN_RAYS
from corporeal.render.ray_scene import RayScene

RESAMPLE_SKY_SUN_RAYS = 3, 4
"""Rays to the sky and to the sun of a pixel whose neighbours' light is not its own."""
RESAMPLE_REACH_PX = COMPARED_OFFSET_PX
"""Pixels about a doubtful one that ask, too."""
RESAMPLE_RIM_PX = SET_SIDE_PX // 2
"""Of those, how many at the rim only help others."""
SUN_SHARE_TOLERANCE = 1e-3
"""Share of the sun that is as good as none of it."""
SHARED_LIGHT_REACH_PX = 15
"""Pixels as far away may change the light that is shared: 8 by its means, 7 by who shares it."""
LIGHT_DEPENDENCE_REACH_PX = 22 + SHARED_LIGHT_REACH_PX
"""Pixels as far away may change a pixel's light: 10 by means over those that asked again, 6 by ``RESAMPLE_REACH_PX``, 6
by ``COMPARED_OFFSET_PX``, and what is shared hangs on more."""


@dataclass(frozen=True)
class RayDirections:
    """Where some samples look: one of several sets of directions each."""

    index: Int[np.ndarray, " N"]
    """Samples that ask."""
    number: Int[np.ndarray, " N"]
    """Set of each."""
    places: PixelPlaces
    """Where in the picture they are: their dice hang on it."""
    counts: tuple[int, int, int]
    """Sets, and directions of each to the sky and to the sun."""
    mirrored: bool = True
    """Whether what only mirrors the studio asks for that, too."""


@dataclass(frozen=True)
class IncomingLight:
    """Light that arrived at the pixels of a part of a picture."""

    light: Float32[np.ndarray, "h w channels"]
    normal: Float32[np.ndarray, "h w 3"]
    depth: Float32[np.ndarray, "h w"]
    """[m]"""
    log: Float32[np.ndarray, "h w"]
    """Logarithm of the depth."""
    known: Bool[np.ndarray, "h w"]


@dataclass(frozen=True)
class LightSampler:
    """Asks for the light of one picture."""

    stage: RayScene
    lamps: StudioLamps
    boxes: Float32[np.ndarray, "B 2 3"]
    """About all that can be met [m]."""

    def sparsely(
        self, s: HitBuffer, d: np.ndarray, index: np.ndarray, places: PixelPlaces, sky: int
    ) -> Float32[np.ndarray, "N channels"]:
        """Light that arrives at samples that share it with those within 12 × 12 pixels."""
        number = np.empty(len(index), np.int64)
        kernels_sparse_light.direction_sets(places.row, places.column, number)
        return self.along(s, d, RayDirections(index, number, places, (DIRECTION_SETS, sky, SUN_RAYS)))

    def along(self, s: HitBuffer, d: np.ndarray, ways: RayDirections) -> Float32[np.ndarray, "N channels"]:
        """Light that arrives at samples along the directions that they look."""
        stage, index, many = self.stage, ways.index, len(ways.index)
        sets, sky, suns = ways.counts
        light = np.zeros((many, LIGHT_CHANNELS_PADDED), np.float32)
        o, w = (np.empty((many * (sky + suns) + 1, 3), np.float32) for _ in range(2))
        ray, asker = (np.empty(len(o), np.int64) for _ in range(2))
        pixel = ways.places.row * 65536 + ways.places.column
        to = (kernels_sparse_light.sky_points(sets * sky), kernels_sparse_light.sun_directions(self.lamps, sets * suns))
        who = index, ways.number, pixel
        n = kernels_sparse_light.queue_light_rays(
            s, *who, self.lamps, to, (sky, suns), self.boxes, o, w, ray, asker, light
        )
        free = stage.free(o[:n], w[:n], ray[:n])
        kernels_sparse_light.add_unblocked_light(s, index, w, asker, free, self.lamps, (sky, suns), light)
        n = kernels_sparse_light.queue_mirror_rays(
            s, index, ways.number, d, self.lamps, ways.mirrored, o, w, asker, light
        )
        if n:
            seen, who = np.empty((n, 3), np.float32), asker[:n]
            prim, u, v, t = stage.hit(o[:n], w[:n])
            kernels_light.write_mirrored(
                stage.look, stage.normals, self.lamps, s, index[who], w, prim, u, v, t, seen, 0
            )
            light[who, 4:LIGHT_CHANNELS] = seen
        return light

    def again(self, s: HitBuffer, d: np.ndarray, on: np.ndarray, block: PixelBlock, arrived: IncomingLight) -> None:
        """Let pixels ask for themselves whose neighbours' light is not theirs.

        Args:
            s: What pixels met.
            d: Unit directions from the eye.
            on: Pixels that met something.
            block: The part of the picture that they are in.
            arrived: Light that they share; then what arrives.
        """
        surface = arrived.normal, arrived.log
        doubt = np.zeros(arrived.known.shape, np.bool_)
        first = block.first, block.left
        kernels_adaptive_sampling.mark_inaccurate_pixels(
            s, on, d, arrived.light, *surface, arrived.known, first, self.lamps, doubt
        )
        if not doubt.any():
            return
        asks = kernels_video.dilate_mask(doubt, RESAMPLE_REACH_PX) & arrived.known
        index = np.flatnonzero(asks)
        times = np.empty(len(index), np.int64)
        kernels_adaptive_sampling.sets_needed(index, arrived.known, *surface, times)
        who = np.repeat(index, times)
        places, number = block.places(who), np.empty(len(who), np.int64)
        kernels_adaptive_sampling.sampling_sets(who, places.row, places.column, number)
        found = np.empty((len(who), LIGHT_CHANNELS_PADDED), np.float32)
        # Where all rays to the sun that were smoothed over agree, no edge of a shadow is near.
        bright = arrived.light.reshape(-1, LIGHT_CHANNELS_PADDED)[who, 3]
        calm = (bright < SUN_SHARE_TOLERANCE) | (bright > 1 - SUN_SHARE_TOLERANCE)
        for some, suns in ((calm, 0), (~calm, RESAMPLE_SKY_SUN_RAYS[1])):
            ways = (who[some], number[some], block.places(who[some]), (SAMPLING_SETS, RESAMPLE_SKY_SUN_RAYS[0], suns))
            found[some] = self.along(s, d, RayDirections(*ways, False))
        found[calm, 3] = bright[calm]
        light = np.zeros_like(arrived.light)
        kernels_adaptive_sampling.mean_of_sets(index, times, found, light.reshape(-1, LIGHT_CHANNELS_PADDED))
        # Those at the rim only help others: not all that they would be smoothed over asked.
        inner = np.flatnonzero(kernels_video.dilate_mask(doubt, RESAMPLE_REACH_PX - RESAMPLE_RIM_PX) & arrived.known)
        room = np.zeros_like(light), np.empty_like(light), np.empty_like(light)
        kernels_adaptive_sampling.blend_resampled_light(
            s, inner, light, *surface, asks, RESAMPLE_SKY_SUN_RAYS, arrived.light, room
        )
