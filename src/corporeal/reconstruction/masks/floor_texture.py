"""How well pixels fit what the floor shows at their place, whatever its colours are elsewhere.

A thing on a newspaper is as white and black as this, so that colours alone do not tell them apart.
But the floor is one plane: taken to it, all views see one print there, but for light. A pixel that
has another colour than the print at its place, and is no shade of it, does not show the floor; nor
does one at a place about which views do not agree, since something stands on it. How well it fits
is learned with colours, as if it were one more channel: a thing that is as white as paper fits the
print before which it is seen here and there, by chance, and paper everywhere.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import gaussian_filter, map_coordinates
from skimage.color import rgb2lab

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.region import Region
from corporeal.multiview.robust import NORMAL
from corporeal.reconstruction.masks.floor_colour import DARK, DARKEST, colours_on
from corporeal.reconstruction.masks.floor_light import lit_floor, median_of
from corporeal.reconstruction.masks.floor_square import WITNESSES, met, square

UNKNOWN, FITS, PARTLY, CONTRADICTS = range(4)
"""Levels: nobody knows what the floor has there, it is that, or nearly or darker, or it is not."""
WIDE = 1.6
"""How much of the floor is looked at, in radii of the ball that all cameras look at: before what
lies beyond the ball, the upper half of a thing is seen."""
SPARE = 2.0
"""Least standard deviation of what a place of the floor shows, in CIELAB."""
PLAIN, EDGED = 30, 70
"""Percentiles of the print's contrast, below which it is plain, and above which it has edges."""
WITHIN = 2.5
"""Standard deviations within which views agree."""
AGREE = 1 / 3
"""Share of the views that see a place that must agree about it: half of them may see something that
stands before it."""
TRIED = 24
"""Views at most that others are compared with."""
OTHER = 0.1
"""How often a pixel shows something else than the floor, before anything is known."""
SHADE = 0.15
"""How often the floor is in shadow, against how often a place of it shows its own colour."""
UNLIKE = 0.3, 0.8
"""Probabilities of something else from which on a pixel fits partly, and contradicts."""


def floor_fit(
    views: Views,
    floor: Plane | None,
    around: Region,
    sure: Bool[np.ndarray, "V H W"],
) -> UInt8[np.ndarray, "V H W"]:
    """Return how well each pixel fits the floor, as a level.

    Args:
        views: The pictures.
        floor: The plane that objects stand on; None: nobody knows it, nor anything of a pixel.
        around: The ball that all look at.
        sure: Pixels that show the floor for certain, by its pattern.

    """
    made = np.full(views.rgb.shape[:3], UNKNOWN, np.uint8)
    if floor is None or len(views.cameras) <= WITNESSES:
        return made
    ground = square(views.cameras, floor, replace(around, radius=WIDE * around.radius))
    pairs = zip(views.rgb, views.cameras, strict=True)
    seen = np.stack([colours_on(ground, rgb, c, 1, DARK) for rgb, c in pairs])
    light = lit_floor(seen)
    print_, spread, agreed = _agreed(_lab(seen - light))
    looking = np.isfinite(seen[..., 0]).sum(axis=0).ravel()
    between = _between(print_)
    for k, (rgb, camera) in enumerate(zip(views.rgb, views.cameras, strict=True)):
        places = met(camera, floor)
        cell = ground.cells(places).reshape(rgb.shape[:2])
        told = (cell >= 0) & (looking[cell] >= 2 * WITNESSES)
        at = ground.at(places.reshape(*rgb.shape)[told]).T - 0.5
        own = np.log(np.maximum(rgb[told].astype(float), DARK) / 255) - _looked_up(light[k], at)
        expected, reach = _looked_up(print_, at), _looked_up(between, at)
        off = _lab(own) - expected
        off = np.sign(off) * np.maximum(np.abs(off) - reach, 0)
        fit = _likeness(off, _looked_up(spread[k], at), expected[:, 0])
        fit = np.where(agreed.ravel()[cell[told]], fit, 0.0)
        other = np.where(sure[k][told], 0.0, OTHER / (OTHER + (1 - OTHER) * fit))
        made[k][told] = FITS + np.searchsorted(UNLIKE, other)
    return made


def _lab(logarithms: Float[np.ndarray, "*N 3"]) -> Float[np.ndarray, "*N 3"]:
    """Return CIELAB of logarithms of colours; nan stays."""
    known = np.isfinite(logarithms)
    lowest = np.log(DARK / 255)
    clear = np.clip(np.where(known, logarithms, lowest), lowest, 0)
    return np.where(known, np.asarray(rgb2lab(np.exp(clear))), np.nan)


def _looked_up(
    table: Float[np.ndarray, "n n 3"], at: Float[np.ndarray, "2 N"]
) -> Float[np.ndarray, "N 3"]:
    """Return what a table of cells has at rows and columns between them."""
    channels = np.moveaxis(np.nan_to_num(table), -1, 0)
    found = [map_coordinates(one, at, order=1, mode="nearest") for one in channels]
    return np.stack(found, axis=-1)


def _agreed(
    lab: Float[np.ndarray, "V n n 3"],
) -> tuple[Float[np.ndarray, "n n 3"], Float[np.ndarray, "V n n 3"], Bool[np.ndarray, "n n"]]:
    """Return what most views have at each cell, how far each scatters, and if enough agree.

    A view scatters more at edges of the print, the more the sharper or the more blurred it is.
    """
    usual = median_of(lab)
    known = np.isfinite(usual).all(axis=-1)
    contrast = _contrast(np.where(known, usual[..., 0], 0.0))
    away = np.abs(lab - usual)
    low, high = np.percentile(contrast[known], [PLAIN, EDGED])
    plain, edged = known & (contrast <= low), known & (contrast >= high)
    least = np.maximum(np.median(NORMAL * median_of(away[:, plain]), axis=0), SPARE)
    by_edges = away[:, edged] / np.maximum(contrast[edged], SPARE)[:, None]
    slope = NORMAL * np.nan_to_num(median_of(np.moveaxis(by_edges, 1, 0)))
    spread = np.hypot(least, slope[:, None, None] * contrast[..., None])
    most, found = np.zeros(contrast.shape, np.int64), usual.copy()
    for k in range(0, len(lab), -(-len(lab) // TRIED)):
        with np.errstate(invalid="ignore"):
            alike = np.abs(lab - lab[k]) < WITHIN * np.maximum(spread, spread[k])
        alike = alike.all(axis=-1)
        count = alike.sum(axis=0)
        total = np.where(alike[..., None], lab, 0.0).sum(axis=0)
        more = count > most
        found[more], most[more] = total[more] / count[more][:, None], count[more]
    with np.errstate(invalid="ignore"):
        agree = (np.abs(lab - found) < WITHIN * spread).all(axis=-1).sum(axis=0)
    return found, spread, agree >= AGREE * np.isfinite(lab[..., 0]).sum(axis=0)


def _contrast(lightness: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """Return the standard deviation of what is about each cell."""
    mean = gaussian_filter(lightness, 1)
    return np.sqrt(np.maximum(gaussian_filter(lightness**2, 1) - mean**2, 0))


def _between(print_: Float[np.ndarray, "n n 3"]) -> Float[np.ndarray, "n n 3"]:
    """Return how far the print is off half a cell beside each (Birchfield and Tomasi 1998)."""
    clear = np.nan_to_num(print_)
    beside = [np.abs(np.roll(clear, d, a) - clear) for d in (-1, 1) for a in (0, 1)]
    return np.max(beside, axis=0) / 2


def _likeness(
    off: Float[np.ndarray, "N 3"],
    spread: Float[np.ndarray, "N 3"],
    lightness: Float[np.ndarray, " N"],
) -> Float[np.ndarray, " N"]:
    """Return how likely the floor looks like that, against its own colour there: 1."""
    each = np.exp(-0.5 * np.square(off / spread))
    darkest = lightness * (1 - np.exp(DARKEST))
    shade = (off[:, 0] < 0) & (off[:, 0] > -darkest)
    light = np.maximum(each[:, 0], SHADE * shade)
    return light * each[:, 1] * each[:, 2]
