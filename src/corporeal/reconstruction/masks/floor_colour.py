"""Detection of floor pixels, lit or in shadow, by colour and plane.

A shadow lies beside the object in every picture, has colours that the rest of the floor has not, and so is taken for a
part of the object where colours alone decide. But a shadow only takes light away: it leaves the ratios of the channels
as they are on the lit floor (Finlayson, Hordley, Lu and Drew 2006 build on the same). And it lies on one plane: taken
to it by its homography, views from different sides see one colour there, which they do not of what stands above it. A
floor that is grey has the ratios of everything grey and of every shade of it, and gives no information.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import map_coordinates, minimum_filter, uniform_filter

from corporeal.core.types import Camera, Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.point_cloud_geometry import SIGMA_PER_MEDIAN_DEVIATION
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_grid import (
    MIN_AGREEING_PARTNERS,
    FloorGrid,
    floor_grid,
    pixels_on_agreed_floor,
)

COLOUR_PATCH_CELLS = 5
"""Cells whose mean colour is compared."""
MAX_SHADE_SIGMAS = 2.5
"""Standard deviations of the floor's own ratios and lightness that shades may be off by."""
MIN_SHADE_SIGMA_LOG = 0.03
"""Least such deviation, in logarithms."""
MIN_COLOURFUL_RATIO = 2.0
"""A floor is grey if no ratio of its channels is so many times farther off 1 than shades may be."""
MAX_VIEW_DIFFERENCE_LOG = 0.12
"""Difference of lightness, and half of that of ratios, up to which views agree, in logarithms."""
DARK_FLOOR_U8 = 4.0
"""What is darker [of 255] is as dark where logarithms are compared: noise has no ratios."""
MIN_SHADOW_LOG = -1.6
"""Logarithm of the least share of the floor's light that a shadow leaves."""
SAMPLE_SPACING_CELLS = 4
"""Cells from one that gains and ratios are measured at to the next."""
GAIN_ITERATIONS = 3
"""Of finding the pictures' gains, by the median of all, and that median."""


def shaded_floor(views: Views, floor: GroundPlane | None, around: ViewedRegion) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels show the floor's own colour, or a shade of it, on the floor.

    None where the floor is unknown, or where it is grey.
    """
    nowhere = np.zeros(views.rgb.shape[:3], np.bool_)
    if floor is None or len(views.cameras) <= MIN_AGREEING_PARTNERS:
        return nowhere
    ground = floor_grid(views.cameras, floor, around)
    pairs = zip(views.rgb, views.cameras, strict=True)
    colours = np.stack([floor_cell_colours(ground, rgb, c, COLOUR_PATCH_CELLS, 1.0) for rgb, c in pairs])
    light, ratios = lightness_and_ratios(equalise_floor_colour(colours))
    like = _is_floor_coloured(light, ratios)
    if like is None:
        return nowhere

    def agreeing(k: int, others: Int[np.ndarray, " P"]) -> Bool[np.ndarray, "P n n"]:
        with np.errstate(invalid="ignore"):
            agreed = np.abs(light[others] - light[k]) < MAX_VIEW_DIFFERENCE_LOG
            agreed &= (np.abs(ratios[others] - ratios[k]) < 2 * MAX_VIEW_DIFFERENCE_LOG).all(axis=-1)
        return agreed & like[k]

    return pixels_on_agreed_floor(views.cameras, floor, around, agreeing, wide=True)


def floor_cell_colours(
    ground: FloorGrid, rgb: np.ndarray, camera: Camera, patch: int, darkest: float
) -> Float[np.ndarray, "n n 3"]:
    """Return the logarithm of the colour around each cell; nan: not in the picture.

    Args:
        ground: The cells.
        rgb: A picture.
        camera: That took it.
        patch: Cells along each side whose mean it is.
        darkest: Of 255; what is darker counts as that, so that noise is not a ratio.
    """
    size, at = (ground.count, ground.count), ground.seen_by(camera)
    out = np.empty((*size, 3))
    for k in range(3):
        one = map_coordinates(rgb[..., k].astype(float), at, order=1, cval=np.nan).reshape(size)
        shown = minimum_filter(np.isfinite(one), patch)
        out[..., k] = np.where(shown, uniform_filter(np.nan_to_num(one), patch), np.nan)
    return np.log(np.maximum(out, darkest) / 255)


def equalise_floor_colour(colour: Float[np.ndarray, "V n n 3"]) -> Float[np.ndarray, "V n n 3"]:
    """Take every picture's own exposure and white balance off, as the floor shows them."""
    return colour - picture_gains(colour)[:, None, None]


def picture_gains(colour: Float[np.ndarray, "V n n 3"]) -> Float[np.ndarray, "V 3"]:
    """Return by how much pictures differ from the median of all, in logarithms."""
    few = colour[:, ::SAMPLE_SPACING_CELLS, ::SAMPLE_SPACING_CELLS].reshape(len(colour), -1, 3)
    few = few[:, np.isfinite(few).all(axis=-1).sum(axis=0) >= MIN_AGREEING_PARTNERS]
    gain = np.zeros((len(colour), 1, 3))
    if not few.size:
        return gain[:, 0]
    for _ in range(GAIN_ITERATIONS):
        usual = np.nanmedian(few - gain, axis=0)
        away = few - usual
        some = np.isfinite(away).any(axis=(1, 2))
        gain[some, 0] = np.nanmedian(away[some], axis=1)
    return gain[:, 0]


def lightness_and_ratios(
    colour: Float[np.ndarray, "V n n 3"],
) -> tuple[Float[np.ndarray, "V n n"], Float[np.ndarray, "V n n 2"]]:
    """Return lightness, and red and blue against green, all as logarithms."""
    return colour.mean(axis=-1), colour[..., [0, 2]] - colour[..., 1:2]


def _is_floor_coloured(
    light: Float[np.ndarray, "V n n"], ratios: Float[np.ndarray, "V n n 2"]
) -> Bool[np.ndarray, "V n n"] | None:
    """Return where the floor's own ratios are seen, no lighter than it; None: it is grey."""
    few = np.concatenate([light[..., None], ratios], axis=-1)[
        :, ::SAMPLE_SPACING_CELLS, ::SAMPLE_SPACING_CELLS
    ].reshape(-1, 3)
    few = few[np.isfinite(few).all(axis=1)]
    if not len(few):
        return None
    usual = np.median(few, axis=0)
    spread = MAX_SHADE_SIGMAS * np.maximum(
        SIGMA_PER_MEDIAN_DEVIATION * np.median(np.abs(few - usual), axis=0), MIN_SHADE_SIGMA_LOG
    )
    if (np.abs(usual[1:]) < MIN_COLOURFUL_RATIO * spread[1:]).all():
        return None
    with np.errstate(invalid="ignore"):
        like = (np.abs(ratios - usual[1:]) < spread[1:]).all(axis=-1)
        darker = light - usual[0]
        return like & (darker > MIN_SHADOW_LOG) & (darker < spread[0])
