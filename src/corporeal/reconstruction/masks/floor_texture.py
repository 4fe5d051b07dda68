"""Likelihood of pixels under the floor's texture at their place.

An object on a newspaper is as white and black as this, so that colours alone do not tell them apart. But the floor is
one plane: taken to it, all views see one print there, but for light. A pixel that has another colour than the print at
its place, and is no shade of it, does not show the floor; nor does one at a place about which views do not agree, since
something stands on it. How well it fits is learned with colours, as if it were one more channel: an object that is as
white as paper fits the print before which it is seen here and there, by chance, and paper everywhere.

Texture of the floor, and its lighting in each picture.

A picture has its own exposure and white balance, and a flash lights what is near more than what is far, from another
place in every picture. Both are smooth over the floor, and its print is not: of the logarithms of what all views see
there, print is the median of all views, and light what a view has beside that, as a polynomial of the second degree.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import gaussian_filter, map_coordinates
from skimage.color import rgb2lab

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.point_cloud_geometry import SIGMA_PER_MEDIAN_DEVIATION
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_colour import DARK_FLOOR_U8, MIN_SHADOW_LOG, floor_cell_colours
from corporeal.reconstruction.masks.floor_grid import MIN_AGREEING_PARTNERS, floor_grid, floor_intersections

LIGHT_SAMPLE_SPACING_CELLS = 3
"""Cells from one that light is fitted at to the next."""
MIN_LIGHT_SAMPLES = 50
"""Of such cells, for a view to be fitted."""
LIGHT_ITERATIONS, REWEIGHTING_ITERATIONS = 3, 4
"""Of finding print and light in turn, and of weighing anew within one."""
ROBUST_SCALE_LOG = 0.15
"""Difference of logarithms at which a cell counts a quarter: objects stand before some."""
EVEN_LIGHT_WEIGHT = 0.02
"""Weight of light that is even, for each cell's of what is seen."""


def floor_light(seen: Float[np.ndarray, "V n n 3"]) -> Float[np.ndarray, "V n n 3"]:
    """Return the light of each view on each cell of the floor, in logarithms.

    Args:
        seen: Logarithms of colours; nan: not in the picture.
    """
    terms = _light_terms(seen.shape[1])
    few = np.zeros(seen.shape[1:3], np.bool_)
    few[::LIGHT_SAMPLE_SPACING_CELLS, ::LIGHT_SAMPLE_SPACING_CELLS] = True
    flat, basis = seen[:, few], terms[few.ravel()]
    factor = np.zeros((len(seen), terms.shape[1], 3))
    for _ in range(LIGHT_ITERATIONS):
        usual = known_median(flat - basis @ factor)
        for k, one in enumerate(flat):
            good = np.isfinite(one - usual).all(axis=-1)
            if good.sum() >= MIN_LIGHT_SAMPLES:
                factor[k] = _fit_light(basis[good], (one - usual)[good], factor[k])
    return (terms @ factor).reshape(seen.shape)


def known_median(values: Float[np.ndarray, "V *rest"]) -> Float[np.ndarray, "*rest"]:
    """Return the median over views of what is known; nan: no view knows it."""
    ordered, count = np.sort(values, axis=0), np.isfinite(values).sum(axis=0)
    ends = np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)])
    return np.take_along_axis(ordered, ends, axis=0).mean(axis=0)


def _light_terms(count: int) -> Float[np.ndarray, "M 6"]:
    line = np.linspace(-1, 1, count)
    y, x = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _fit_light(
    terms: Float[np.ndarray, "N 6"], light: Float[np.ndarray, "N 3"], factor: np.ndarray
) -> Float[np.ndarray, "6 3"]:
    """Fit again and again, with less weight for what is far off (after Geman and McClure)."""
    stiff = EVEN_LIGHT_WEIGHT * len(terms) * np.diag([0.0, 1, 1, 1, 1, 1])
    if not factor.any():
        factor = np.zeros_like(factor)
        factor[0] = np.median(light, axis=0)
    for _ in range(REWEIGHTING_ITERATIONS):
        off = (light - terms @ factor).mean(axis=1) / ROBUST_SCALE_LOG
        weighed = terms / np.square(1 + np.square(off))[:, None]
        factor = np.linalg.solve(terms.T @ weighed + stiff, weighed.T @ light)
    return factor


FIT_UNKNOWN, FIT_AGREES, FIT_PARTLY, FIT_CONTRADICTS = range(4)
"""Levels: what the floor has there is unknown, it is that, or nearly or darker, or it is not."""
FLOOR_EXTENT_RADII = 1.6
"""How much of the floor is looked at, in radii of the ball that all cameras look at: before what lies beyond the ball,
the upper half of an object is seen.
"""
MIN_FLOOR_SIGMA_LAB = 2.0
"""Least standard deviation of what a place of the floor shows, in CIELAB."""
PLAIN_CONTRAST_PERCENTILE, EDGED_CONTRAST_PERCENTILE = 30, 70
"""Percentiles of the print's contrast, below which it is plain, and above which it has edges."""
AGREEING_SIGMAS = 2.5
"""Standard deviations within which views agree."""
MIN_AGREEING_VIEWS_FRACTION = 1 / 3
"""Share of the views that see a place that must agree about it: half of them may see something that stands before
it."""
MAX_TRIED_VIEWS = 24
"""Views at most that others are compared with."""
PRIOR_OTHER_PROBABILITY = 0.1
"""How often a pixel shows something else than the floor, before anything is known."""
SHADOW_TO_LIT_ODDS = 0.15
"""How often the floor is in shadow, against how often a place of it shows its own colour."""
OTHER_PROBABILITY_LEVELS = 0.3, 0.8
"""Probabilities of something else from which on a pixel fits partly, and contradicts."""


def floor_fit(
    views: Views, floor: GroundPlane | None, around: ViewedRegion, sure: Bool[np.ndarray, "V H W"]
) -> UInt8[np.ndarray, "V H W"]:
    """Return how well each pixel fits the floor, as a level.

    Args:
        views: The pictures.
        floor: The plane that objects stand on; None: unknown, nor anything of a pixel.
        around: The ball that all look at.
        sure: Pixels that show the floor for certain, by its pattern.
    """
    made = np.full(views.rgb.shape[:3], FIT_UNKNOWN, np.uint8)
    if floor is None or len(views.cameras) <= MIN_AGREEING_PARTNERS:
        return made
    ground = floor_grid(views.cameras, floor, replace(around, radius=FLOOR_EXTENT_RADII * around.radius))
    pairs = zip(views.rgb, views.cameras, strict=True)
    seen = np.stack([floor_cell_colours(ground, rgb, c, 1, DARK_FLOOR_U8) for rgb, c in pairs])
    light = floor_light(seen)
    print_, spread, agreed = _agreed_floor(_lab_of_logarithms(seen - light))
    looking = np.isfinite(seen[..., 0]).sum(axis=0).ravel()
    between = _half_cell_differences(print_)
    for k, (rgb, camera) in enumerate(zip(views.rgb, views.cameras, strict=True)):
        places = floor_intersections(camera, floor)
        cell = ground.cells(places).reshape(rgb.shape[:2])
        compared = (cell >= 0) & (looking[cell] >= 2 * MIN_AGREEING_PARTNERS)
        at = ground.at(places.reshape(*rgb.shape)[compared]).T - 0.5
        own = np.log(np.maximum(rgb[compared].astype(float), DARK_FLOOR_U8) / 255) - _interpolate_cells(light[k], at)
        expected, reach = _interpolate_cells(print_, at), _interpolate_cells(between, at)
        off = _lab_of_logarithms(own) - expected
        off = np.sign(off) * np.maximum(np.abs(off) - reach, 0)
        fit = _floor_likelihood(off, _interpolate_cells(spread[k], at), expected[:, 0])
        fit = np.where(agreed.ravel()[cell[compared]], fit, 0.0)
        other = np.where(
            sure[k][compared],
            0.0,
            PRIOR_OTHER_PROBABILITY / (PRIOR_OTHER_PROBABILITY + (1 - PRIOR_OTHER_PROBABILITY) * fit),
        )
        made[k][compared] = FIT_AGREES + np.searchsorted(OTHER_PROBABILITY_LEVELS, other)
    return made


def _lab_of_logarithms(logarithms: Float[np.ndarray, "*N 3"]) -> Float[np.ndarray, "*N 3"]:
    """Return CIELAB of logarithms of colours; nan stays."""
    known = np.isfinite(logarithms)
    lowest = np.log(DARK_FLOOR_U8 / 255)
    clear = np.clip(np.where(known, logarithms, lowest), lowest, 0)
    return np.where(known, np.asarray(rgb2lab(np.exp(clear))), np.nan)


def _interpolate_cells(table: Float[np.ndarray, "n n 3"], at: Float[np.ndarray, "2 N"]) -> Float[np.ndarray, "N 3"]:
    """Return what a table of cells has at rows and columns between them."""
    channels = np.moveaxis(np.nan_to_num(table), -1, 0)
    found = [map_coordinates(one, at, order=1, mode="nearest") for one in channels]
    return np.stack(found, axis=-1)


def _agreed_floor(
    lab: Float[np.ndarray, "V n n 3"],
) -> tuple[Float[np.ndarray, "n n 3"], Float[np.ndarray, "V n n 3"], Bool[np.ndarray, "n n"]]:
    """Return what most views have at each cell, how far each scatters, and if enough agree.

    A view scatters more at edges of the print, the more the sharper or the more blurred it is.
    """
    usual = known_median(lab)
    known = np.isfinite(usual).all(axis=-1)
    contrast = _local_contrast(np.where(known, usual[..., 0], 0.0))
    away = np.abs(lab - usual)
    low, high = np.percentile(contrast[known], [PLAIN_CONTRAST_PERCENTILE, EDGED_CONTRAST_PERCENTILE])
    plain, edged = known & (contrast <= low), known & (contrast >= high)
    least = np.maximum(
        np.median(SIGMA_PER_MEDIAN_DEVIATION * known_median(away[:, plain]), axis=0), MIN_FLOOR_SIGMA_LAB
    )
    by_edges = away[:, edged] / np.maximum(contrast[edged], MIN_FLOOR_SIGMA_LAB)[:, None]
    slope = SIGMA_PER_MEDIAN_DEVIATION * np.nan_to_num(known_median(np.moveaxis(by_edges, 1, 0)))
    spread = np.hypot(least, slope[:, None, None] * contrast[..., None])
    most, found = np.zeros(contrast.shape, np.int64), usual.copy()
    for k in range(0, len(lab), -(-len(lab) // MAX_TRIED_VIEWS)):
        with np.errstate(invalid="ignore"):
            alike = np.abs(lab - lab[k]) < AGREEING_SIGMAS * np.maximum(spread, spread[k])
        alike = alike.all(axis=-1)
        count = alike.sum(axis=0)
        total = np.where(alike[..., None], lab, 0.0).sum(axis=0)
        more = count > most
        found[more], most[more] = total[more] / count[more][:, None], count[more]
    with np.errstate(invalid="ignore"):
        agree = (np.abs(lab - found) < AGREEING_SIGMAS * spread).all(axis=-1).sum(axis=0)
    return (found, spread, agree >= MIN_AGREEING_VIEWS_FRACTION * np.isfinite(lab[..., 0]).sum(axis=0))


def _local_contrast(lightness: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """Return the standard deviation of what is about each cell."""
    mean = gaussian_filter(lightness, 1)
    return np.sqrt(np.maximum(gaussian_filter(lightness**2, 1) - mean**2, 0))


def _half_cell_differences(print_: Float[np.ndarray, "n n 3"]) -> Float[np.ndarray, "n n 3"]:
    """Return how far the print is off half a cell beside each (Birchfield and Tomasi 1998)."""
    clear = np.nan_to_num(print_)
    beside = [np.abs(np.roll(clear, d, a) - clear) for d in (-1, 1) for a in (0, 1)]
    return np.max(beside, axis=0) / 2


def _floor_likelihood(
    off: Float[np.ndarray, "N 3"], spread: Float[np.ndarray, "N 3"], lightness: Float[np.ndarray, " N"]
) -> Float[np.ndarray, " N"]:
    """Return how likely the floor looks like that, against its own colour there: 1."""
    each = np.exp(-0.5 * np.square(off / spread))
    darkest = lightness * (1 - np.exp(MIN_SHADOW_LOG))
    shade = (off[:, 0] < 0) & (off[:, 0] > -darkest)
    light = np.maximum(each[:, 0], SHADOW_TO_LIT_ODDS * shade)
    return light * each[:, 1] * each[:, 2]
