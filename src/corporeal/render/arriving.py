"""Rays from what a film's pixels met to sky and sun, and along what it mirrors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int

from corporeal.render import kernels_ask, kernels_doubt, kernels_film, kernels_light
from corporeal.render.embree import Block, Places
from corporeal.render.kernels import Samples
from corporeal.render.kernels_ask import SUNS, WAYS, WIDE
from corporeal.render.kernels_doubt import APART, SETS, SIDE
from corporeal.render.kernels_light import CHANNELS, Lamps
from corporeal.render.stage import Stage

AGAIN = 3, 4
"""Rays to the sky and to the sun of a pixel whose neighbours' light is not its own."""
AROUND = APART
"""Pixels about a doubtful one that ask, too."""
RIM = SIDE // 2
"""Of those, how many at the rim only help others."""
SAME = 1e-3
"""Share of the sun that is as good as none of it."""
SHARED = 15
"""Pixels as far away may change the light that is shared: 8 by its means, 7 by who shares it."""
HANGS_ON = 22 + SHARED
"""Pixels as far away may change a pixel's light: 10 by means over those that asked again, 6 by
``AROUND``, 6 by ``APART``, and what is shared hangs on more."""


@dataclass(frozen=True)
class Directions:
    """Where some samples look: one of several sets of directions each."""

    index: Int[np.ndarray, " N"]
    """Samples that ask."""
    number: Int[np.ndarray, " N"]
    """Set of each."""
    places: Places
    """Where in the picture they are: their dice hang on it."""
    counts: tuple[int, int, int]
    """Sets, and directions of each to the sky and to the sun."""
    mirrored: bool = True
    """Whether what only mirrors the studio asks for that, too."""


@dataclass(frozen=True)
class Arrived:
    """Light that arrived at the pixels of a part of a picture."""

    light: Float32[np.ndarray, "h w channels"]
    normal: Float32[np.ndarray, "h w 3"]
    depth: Float32[np.ndarray, "h w"]
    """[m]"""
    log: Float32[np.ndarray, "h w"]
    """Logarithm of the depth."""
    known: Bool[np.ndarray, "h w"]


@dataclass(frozen=True)
class Asker:
    """Asks for the light of one picture."""

    stage: Stage
    lamps: Lamps
    boxes: Float32[np.ndarray, "B 2 3"]
    """About all that can be met [m]."""

    def sparsely(
        self, s: Samples, d: np.ndarray, index: np.ndarray, places: Places, sky: int
    ) -> Float32[np.ndarray, "N channels"]:
        """Light that arrives at samples that share it with those within 12 × 12 pixels.

        Args:
            s: What samples met.
            d: Unit directions from the eye.
            index: Samples that ask.
            places: Where in the picture they are.
            sky: Rays to the sky of each.

        """
        number = np.empty(len(index), np.int64)
        kernels_ask.numbers(places.row, places.column, number)
        return self.along(s, d, Directions(index, number, places, (WAYS, sky, SUNS)))

    def along(
        self, s: Samples, d: np.ndarray, ways: Directions
    ) -> Float32[np.ndarray, "N channels"]:
        """Light that arrives at samples along the directions that they look."""
        stage, index, many = self.stage, ways.index, len(ways.index)
        sets, sky, suns = ways.counts
        light = np.zeros((many, WIDE), np.float32)
        o, w = (np.empty((many * (sky + suns) + 1, 3), np.float32) for _ in range(2))
        ray, asker = (np.empty(len(o), np.int64) for _ in range(2))
        pixel = ways.places.row * 65536 + ways.places.column
        to = kernels_ask.sky_points(sets * sky), kernels_ask.sun_ways(self.lamps, sets * suns)
        who = index, ways.number, pixel
        n = kernels_ask.ask(
            s, *who, self.lamps, to, (sky, suns), self.boxes, o, w, ray, asker, light
        )
        free = stage.free(o[:n], w[:n], ray[:n])
        kernels_ask.answered(s, index, w, asker, free, self.lamps, (sky, suns), light)
        n = kernels_ask.mirror(
            s, index, ways.number, d, self.lamps, ways.mirrored, o, w, asker, light
        )
        if n:
            seen, who = np.empty((n, 3), np.float32), asker[:n]
            prim, u, v, t = stage.hit(o[:n], w[:n])
            kernels_light.mirrored(
                stage.look, stage.normals, self.lamps, s, index[who], w, prim, u, v, t, seen, 0
            )
            light[who, 4:CHANNELS] = seen
        return light

    def again(
        self, s: Samples, d: np.ndarray, on: np.ndarray, block: Block, arrived: Arrived
    ) -> None:
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
        kernels_doubt.doubtful(
            s, on, d, arrived.light, *surface, arrived.known, first, self.lamps, doubt
        )
        if not doubt.any():
            return
        asks = kernels_film.widened(doubt, AROUND) & arrived.known
        index = np.flatnonzero(asks)
        times = np.empty(len(index), np.int64)
        kernels_doubt.lonely(index, arrived.known, *surface, times)
        who = np.repeat(index, times)
        places, number = block.places(who), np.empty(len(who), np.int64)
        kernels_doubt.sets(who, places.row, places.column, number)
        found = np.empty((len(who), WIDE), np.float32)
        # Where all rays to the sun that were smoothed over agree, no edge of a shadow is near.
        bright = arrived.light.reshape(-1, WIDE)[who, 3]
        calm = (bright < SAME) | (bright > 1 - SAME)
        for some, suns in ((calm, 0), (~calm, AGAIN[1])):
            ways = who[some], number[some], block.places(who[some]), (SETS, AGAIN[0], suns)
            found[some] = self.along(s, d, Directions(*ways, False))
        found[calm, 3] = bright[calm]
        light = np.zeros_like(arrived.light)
        kernels_doubt.together(index, times, found, light.reshape(-1, WIDE))
        # Those at the rim only help others: not all that they would be smoothed over asked.
        inner = np.flatnonzero(kernels_film.widened(doubt, AROUND - RIM) & arrived.known)
        room = np.zeros_like(light), np.empty_like(light), np.empty_like(light)
        kernels_doubt.settle(s, inner, light, *surface, asks, AGAIN, arrived.light, room)
