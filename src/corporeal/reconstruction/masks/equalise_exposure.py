"""Equalisation of exposure and white balance.

A phone chooses both anew for every picture, so that a brown floor has as many browns as there
are pictures, and what colours distinguish borders on all of them. What the floor's places look like
in each picture says by how much they differ.
"""

from dataclasses import replace

import numpy as np

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_colour import (
    COLOUR_PATCH_CELLS,
    DARK_FLOOR_U8,
    floor_cell_colours,
    picture_gains,
)
from corporeal.reconstruction.masks.floor_grid import MIN_AGREEING_PARTNERS, floor_grid
from corporeal.reconstruction.masks.reduce_views import reduce_views


def equalise_exposure(views: Views, floor: GroundPlane | None, around: ViewedRegion, longest: int) -> Views:
    """Return the pictures, each channel of each times one number; as they are: these are unknown.

    Args:
        views: The pictures.
        floor: The plane that objects stand on; None: unknown.
        around: The ball that all look at.
        longest: Longer side of the pictures that exposures are read from [px].
    """
    if floor is None or len(views.cameras) <= MIN_AGREEING_PARTNERS:
        return views
    rough = reduce_views(views, longest)
    ground = floor_grid(rough.cameras, floor, around)
    pairs = zip(rough.rgb, rough.cameras, strict=True)
    gain = picture_gains(
        np.stack([floor_cell_colours(ground, rgb, c, COLOUR_PATCH_CELLS, DARK_FLOOR_U8) for rgb, c in pairs])
    )
    rgb = np.empty_like(views.rgb)
    for one, picture, g in zip(rgb, views.rgb, gain, strict=True):
        one[:] = np.clip(np.round(picture * np.exp(-g)), 0, 255)
    return replace(views, rgb=rgb)
